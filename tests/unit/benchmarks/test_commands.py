"""What a user of the reference may type wrong: a clear word and exit code 2, never a traceback."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import audit
from benchmarks.__main__ import main
from benchmarks.contest import LISTENERS
from engine.__main__ import main as engine_main

BOX = {"type": "aabb", "min": [0, 0], "max": [1, 1]}
BALL = {"type": "sphere", "center": [0, 0], "radius": 1}
SQUARE = {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]]}
TWO = {"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {}, "geometry": SQUARE}] * 2}


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write some files and go there."""
    for name, value in (
        ("box.json", BOX), ("ball.json", BALL), ("two.geojson", TWO),
    ):  # fmt: skip
        (tmp_path / name).write_text(json.dumps(value))
    (tmp_path / "broken.json").write_text('{"type": "aabb", "min": [0')
    (tmp_path / "empty.csv").write_text("")
    np.save(tmp_path / "points.npy", np.zeros((3, 2)))
    np.save(tmp_path / "none.npy", np.zeros((0, 2)))
    np.save(tmp_path / "wide.npy", np.zeros((3, 5)))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["no.json"], "no such file"),
        (["box.json"], "one file is a mesh or a polygon"),
        (["two.geojson"], "holds 2 polygons"),
        (["two.geojson", "points.npy"], "holds 2 polygons"),
        (["broken.json", "points.npy"], "is not JSON"),
        (["points.npy", "box.json"], "a solid is read from"),
        (["box.json", "ball.json"], "layers are of polygons or boxes of the plane, not of a sphere"),
        (["box.json", "empty.csv"], "holds nothing to ask about"),
        (["ball.json", "none.npy"], "holds nothing to ask about"),
        (["ball.json", "wide.npy"], "rows of 2 x 2 numbers expected, the shape is (3, 5)"),
        (["ball.json", "points.npy", "--seconds", "nan"], "more than 0"),
        (["ball.json", "points.npy", "--seconds", "-1"], "more than 0"),
        (["ball.json", "points.npy", "-o", "page.txt"], "page.txt: a file .html, or .json"),
        (["ball.json", "points.npy", "-o", "nowhere/page.html"], "in a folder that is there"),
    ],
)
def test_the_audit_says_what_is_wrong_with_its_files(
    files: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        code = engine_main(["audit", *words, "--asked", ""])
    except SystemExit as refused:
        code = int(str(refused.code))
    assert code == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["segments", "--quick", "--only", "no such row"],
            "no row has 'no such row' in its name; there are segments: ",
        ),
        (["segments", "--quick", "--contest", "sphere, tangents", "--contender", "nobody"], "no contender 'nobody'"),
    ],
)
def test_a_command_says_what_is_wrong(
    files: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as refused:
        main([*words, "--rounds", "1", "--seconds", "0.01"])
    assert refused.value.code == 2
    assert said in capsys.readouterr().err


class Died:
    """A process that ends as soon as it asks the package named for its death, as one that crashed does."""

    def __init__(self, words: list[str], tried: list[list[str]]) -> None:
        tried.append(words)
        left_out = [words[i + 1] for i, word in enumerate(words) if word == "--without"]
        asked = Path(words[words.index("--asked") + 1])
        name = next((name for name in ("crashes", "hangs") if name not in left_out), "")
        asked.write_text(name)
        self.returncode = {"crashes": -11, "hangs": None, "": 0}[name]

    def poll(self) -> int | None:
        return self.returncode

    def kill(self) -> None:
        self.returncode = -9


def test_who_ends_the_process_or_gives_no_answer_is_left_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tried: list[list[str]] = []
    monkeypatch.setattr(audit.subprocess, "Popen", lambda words: Died(words, tried))
    monkeypatch.setattr(audit, "LIMIT", 0.0)
    assert audit.watched(["ball.json", "points.npy"]) == 0
    assert [words.count("--without") for words in tried] == [0, 1, 2]
    said = capsys.readouterr().out
    assert said.index("crashes ended the process") < said.index("hangs ended the process")


def test_who_watches_is_told_which_package_is_asked(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One left out is named with the reason; the page is written all the same, in a process of its own."""
    words = ["two.geojson", "box.json", "--seconds", "0.01", "--without", "shapely (GEOS)", "-o", "page.json"]
    assert engine_main(["audit", *words]) == 0
    found: Any = json.loads((files / "page.json").read_text())
    absent = {row["contender"]: row["absent"] for row in found["rows"]}
    assert absent["shapely (GEOS)"].startswith("not asked: left out")
    assert absent["ours"] == ""
    assert LISTENERS == []
