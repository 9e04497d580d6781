"""What README.md and the pages by reader show is what happens: calls are made, Python is run, commands exist."""

from __future__ import annotations

import doctest
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import anyio
import numpy as np
import pytest

import engine
from service.app import create_app
from service.errors import STATUS
from service.metrics import Metrics
from service.settings import Settings
from tests.unit.service.asking import client_of
from tests.unit.service.test_live import Service

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text("utf-8")
PAGES = README + "".join(
    (ROOT / "docs" / f"{name}.md").read_text("utf-8") for name in ("calling", "running", "importing")
)


def blocks(language: str) -> list[str]:
    """Return the fenced blocks of one language."""
    return re.findall(rf"```{language}\n(.*?)```", PAGES, re.DOTALL)


CALLS = [block for block in blocks("sh") if block.startswith("curl")]


def test_every_call_shows_its_answer() -> None:
    assert len(CALLS) == len(blocks("json")) > 0


@pytest.mark.parametrize("number", range(len(CALLS)))
def test_a_call_has_the_answer_shown(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "warm", lambda **_: None)
    path, body = re.search(r"localhost:8000(\S+).*?-d '(.*?)'", CALLS[number], re.DOTALL).groups()  # type: ignore[union-attr]

    async def ask() -> Any:
        async with client_of(create_app(Settings(deadline_seconds=300))) as client:
            return (await client.post(path, content=body, headers={"content-type": "application/json"})).json()

    shown, answer = json.loads(blocks("json")[number]), anyio.run(ask)
    if "accuracy" not in shown:  # README says that parts are left out
        answer = {name: answer[name] for name in shown}
    assert answer == shown


def test_the_calls_for_stored_solids_do_what_they_say() -> None:
    (session,) = [block for block in blocks("sh") if block.startswith("url=localhost")]
    service = Service(access_log=False)
    try:
        service.wait_until_ready()
        script = "set -euo pipefail\n" + session.replace("localhost:8000", f"127.0.0.1:{service.port}")
        command = ["bash", "-c", script.replace("| head -3", "")]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    finally:
        service.close()
    assert done.returncode == 0, done.stderr
    for expected in (
        r'"type":"sphere","dimension":3,"memory":24',
        r"HTTP/1.1 200 OK",
        r"^ +1$",
        r"^( +0){2}\n( +0){2}\n( +0){2}$",
        r'"type":"polyhedron","dimension":3,"vertices":4,"faces":4',
        r'"type":"surface","dimension":3,"vertices":3,"faces":1',
        r'{"status":"ok"}{"status":"ok"}',
        r"geometry_requests_total",
    ):
        assert re.search(expected, done.stdout, re.MULTILINE), (expected, done.stdout)


def test_every_setting_and_every_code_stands_in_a_table() -> None:
    settings = re.findall(r"^\| `GEOMETRY_(\w+)` \| (.*?) \|", PAGES, re.MULTILINE)
    assert [name.lower() for name, _ in settings] == list(Settings.model_fields)
    for name, shown in settings:
        default = Settings.model_fields[name.lower()].get_default(call_default_factory=True)
        if isinstance(default, int) and shown[0].isdigit() and "core" not in shown:
            assert int(re.sub(r"\D", "", shown)) * (2**20 if "MiB" in shown else 1) == default, name
    rows = re.findall(r"^\| (\d{3}) \| (.*?) \|", PAGES, re.MULTILINE)
    shown = {code: int(status) for status, codes in rows for code in re.findall(r"`(\w+)`", codes)}
    assert shown == STATUS


def test_the_python_shown_does_what_it_shows() -> None:
    for number, block in enumerate(blocks("python")):
        test = doctest.DocTestParser().get_doctest(block, {}, f"block {number}", "README.md", 0)
        assert doctest.DocTestRunner().run(test).failed == 0


def test_the_tutorial_does_what_it_shows() -> None:
    page = (ROOT / "docs" / "tutorial.md").read_text("utf-8")
    test = doctest.DocTestParser().get_doctest(page, {}, "tutorial", "docs/tutorial.md", 0)
    assert len(test.examples) >= 20
    assert doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL).run(test).failed == 0


def test_the_two_commands_are_one_line_each_and_ci_runs_the_test_command() -> None:
    commands = [block.strip() for block in blocks("sh") if block.startswith("python3 -m venv")]
    assert [command.split(" && ")[-1] for command in commands] == [
        ".venv/bin/python -m service",
        ".venv/bin/python -m pytest",
    ]
    assert "python -m pytest$" in (ROOT / ".ci" / "run").read_text("utf-8")


def test_readme_fits_on_two_screens() -> None:
    assert len(README.splitlines()) <= 110


def test_every_link_leads_somewhere() -> None:
    for path in (ROOT / "README.md", *(ROOT / "docs" / f"{name}.md" for name in ("calling", "running", "importing"))):
        for link in re.findall(r"\]\(([^)#]+)\)", path.read_text("utf-8")):
            assert (path.parent / link).exists(), (path.name, link)
    for name in re.findall(r"`((?:deploy|docs)/[\w.-]+)`", PAGES):
        assert (ROOT / name).exists(), name


def test_the_metrics_listed_are_those_counted() -> None:
    text = Metrics().text().decode()
    named = set(re.findall(r"`(geometry_\w+)`", PAGES))
    counted = {re.sub("_(total|bucket|count|sum|created)$", "", name) for name in re.findall(r"geometry_\w+", text)}
    assert {name.removesuffix("_total") for name in named} == counted


@pytest.mark.full
def test_the_files_of_the_command_line_are_asked(tmp_path: Path) -> None:
    """Small files under the names shown, in their formats."""
    trimesh = pytest.importorskip("trimesh", reason="the extra `formats` is not installed")
    box = trimesh.creation.box()
    for name in ("bunny.stl", "armadillo.ply", "gear.obj"):
        box.export(tmp_path / name)
    np.save(tmp_path / "points.npy", np.random.default_rng(0).random((50, 3)))
    np.savetxt(tmp_path / "segments.csv", np.random.default_rng(1).normal(size=(9, 6)), delimiter=",")
    poses = np.dstack([np.tile(np.eye(3), (4, 1, 1)), np.arange(12.0).reshape(4, 3, 1)]).reshape(4, 12)
    np.savetxt(tmp_path / "poses.csv", poses, delimiter=",")
    for name, low in (("parcels", 0.0), ("floods", 0.5)):
        ring = [[low, low], [low + 1, low], [low + 1, low + 1], [low, low + 1], [low, low]]
        feature = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
        collection = {"type": "FeatureCollection", "features": [feature]}
        (tmp_path / f"{name}.geojson").write_text(json.dumps(collection))
    well = {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [0.25, 0.75]}}
    (tmp_path / "wells.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [well]}))
    (block,) = [block for block in blocks("sh") if "pip install '.[formats]'" in block]
    commands = [line for line in block.splitlines() if line.startswith("python -m engine ")]
    assert len(commands) >= 5
    around = {**os.environ, "PYTHONPATH": str(ROOT)}
    for command in commands:
        words = [sys.executable, *shlex.split(command)[1:]]
        done = subprocess.run(words, cwd=tmp_path, env=around, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, (command, done.stderr)


def test_the_part_about_more_machines_runs_on_this_one() -> None:
    pytest.importorskip("distributed", reason="the extra `distributed` is not installed")
    (block,) = [block for block in blocks("python") if "tcp://scheduler" in block]
    box = engine.Polyhedron([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)],
        [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])  # fmt: skip
    told: list[int] = []
    known = {
        "points": np.random.default_rng(0).random((100, 3)) * 2,
        "vertices": box.vertices, "faces": [list(face) for face in np.split(box.face_indices, box.face_offsets[1:-1])],
        "bar": SimpleNamespace(update=told.append),
    }  # fmt: skip
    own = block.replace(
        'Client("tcp://scheduler:8786")', "Client(processes=False, n_workers=1, dashboard_address=None)"
    )
    exec(own, known)
    assert np.array_equal(known["locations"], engine.locate(known["points"], box))
    assert told
