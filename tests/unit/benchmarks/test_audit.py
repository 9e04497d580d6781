"""The audit of somebody's own files: every contender answers, the wrong ones are named with their items."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks import audit
from engine.__main__ import main

SQUARE = {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]]}
TETRAHEDRON = {"type": "polyhedron", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
               "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]}  # fmt: skip


def audited(folder: Path, first: object, second: object, *options: str) -> dict:
    """Return for each contender what was judged."""
    names = []
    for name, content in (("first", first), ("second", second)):
        path = folder / f"{name}.{'npy' if isinstance(content, np.ndarray) else 'json'}"
        if isinstance(content, np.ndarray):
            np.save(path, content)
        else:
            path = path.with_suffix(".geojson") if "coordinates" in str(content) else path
            path.write_text(json.dumps(content))
        names.append(str(path))
    found = folder / "found.json"
    assert main(["audit", *names, "--seconds", "0.01", "-o", str(found), "--asked", "", *options]) == 0
    rows = json.loads(found.read_text())["rows"]
    return {row["contender"]: row["errors"] for row in rows if not row["absent"]}


@pytest.mark.full
def test_points_and_who_is_wrong_about_which(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A half-line to the right from the square's right edge meets nothing; float32 moves a point beside it onto it."""
    points = np.array([[0.5, 0.5], [1.0, 0.5], [1.0 + 2**-40, 0.5], [2.0, 0.5]])
    found = audited(tmp_path, SQUARE, points)
    assert found["ours"] == {"judged": 4, "wrong": 0, "refused": 0, "outside": 0, "where": []}
    assert found["textbook: half-line"]["where"] == [1]
    line = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("textbook: ray casting  "))
    assert line.split()[-5:] == ["1", "(4.6%", "to", "70%)", "1"]
    assert {"textbook: signed angles", "textbook: same side, float32"} <= set(found)


@pytest.mark.full
def test_segments_bodies_and_layers(tmp_path: Path) -> None:
    box = {"type": "aabb", "min": [0, 0], "max": [1, 1]}
    found = audited(tmp_path, box, np.array([[-1.0, 0.5, 2.0, 0.5], [0.0, 3.0, 1.0, 3.0]]))
    assert found["ours"]["wrong"] == found["textbook: Cohen-Sutherland"]["wrong"] == 0
    moved = {**TETRAHEDRON, "vertices": [[x + 1, y, z] for x, y, z in TETRAHEDRON["vertices"]]}
    found = audited(tmp_path, TETRAHEDRON, moved)
    assert found["ours"]["wrong"] == 0
    assert found["textbook: volumes first, float32"] == found["textbook: volumes first"]
    assert audited(tmp_path, SQUARE, SQUARE)["ours"]["wrong"] == 0
    through = np.array([[[0.25, 0.25, -1.0], [0.25, 0.25, 1.0]], [[2.0, 2, 2], [3, 3, 3]]]).reshape(-1, 6)
    found = audited(tmp_path, TETRAHEDRON, through)
    assert found["ours"]["wrong"] == found["textbook: Moller-Trumbore"]["wrong"] == 0


@pytest.mark.full
def test_distances_of_points_and_what_float32_makes_of_them(tmp_path: Path) -> None:
    points = np.array([[2.0, 0.0, 0.0], [0.25, 0.25, 0.25], [0.5, 0.5, -(2.0**-30)], [0.25, 0.25, 0.5 + 1e-9]])
    found = audited(tmp_path, TETRAHEDRON, points, "--question", "distances")
    name = "textbook: nearest point of each triangle"
    assert found["ours"]["judged"] == 4
    assert (found["ours"]["where"], found[name]["where"]) == ([], [])
    assert found[f"{name}, float32"]["where"] == [3]


@pytest.mark.full
def test_a_page_is_written_that_needs_no_other_file(tmp_path: Path) -> None:
    (tmp_path / "square.geojson").write_text(json.dumps(SQUARE))
    (tmp_path / "points.csv").write_text("x,y\n0.5,0.5\n1,0.5\n")
    page = tmp_path / "page.html"
    files = [str(tmp_path / name) for name in ("square.geojson", "points.csv")]
    assert audit.main([*files, "--seconds", "0.01", "-o", str(page)]) == 0
    text = page.read_text()
    assert "square.geojson and points.csv" in text
    assert '"where":[1]' in text
    assert "http" not in text.replace("http://127.0.0.1:8000", "").replace("http://www.w3.org", "")


@pytest.mark.full
def test_a_mesh_alone_is_asked_about_the_middles_of_its_faces(tmp_path: Path) -> None:
    (tmp_path / "body.json").write_text(json.dumps(TETRAHEDRON))
    assert audit.main([str(tmp_path / "body.json"), "--seconds", "0.01", "-o", str(tmp_path / "found.json")]) == 0
    rows = json.loads((tmp_path / "found.json").read_text())["rows"]
    assert {row["errors"]["judged"] for row in rows if not row["absent"]} == {4}


def test_layers_of_different_lengths_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    layers = []
    for n in (2, 3):
        features = [{"type": "Feature", "properties": {}, "geometry": SQUARE}] * n
        layers.append(str(tmp_path / f"{n}.geojson"))
        Path(layers[-1]).write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    assert main(["audit", *layers, "--asked", ""]) == 2
    assert "2 and 3 polygons" in capsys.readouterr().err
