"""Parameters of the engine say what they take: `Any` stays the exception."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MOST = 0.06
"""Share of parameters that may be `Any`."""


def test_few_parameters_are_any() -> None:
    annotations = [
        parameter.annotation
        for path in (ROOT / "engine").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.FunctionDef)
        for parameter in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
        if parameter.arg not in ("self", "cls")
    ]
    n_any = sum(isinstance(found, ast.Name) and found.id == "Any" for found in annotations)
    assert len(annotations) > 5000
    assert n_any <= MOST * len(annotations), f"{n_any} of {len(annotations)}"


TAKEN = """
import engine, numpy as np
square = {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [0, 1], [0, 0]]]}
engine.locate([(0.5, 0.5)], engine.Aabb((0, 0), (1, 1)))
engine.locate(np.zeros((3, 2)), square)
engine.contains({"type": "MultiPoint", "coordinates": [[0, 0]]}, [[(0, 0), (1, 0), (0, 1)]])
engine.collide(square, square, second_pose=np.eye(3))
engine.collide_poses(square, square, [engine.Pose.identity(2)]).first_contact
engine.collide_scene([square, square], [None, np.eye(3)])
engine.clip_lines([[(0, 0), (2, 2)]], square, keep="outside").to_shapely()
engine.locate([[0.0, 0.0, 0.0]], (np.zeros((4, 3)), [[0, 1, 2]]))
"""
REFUSED = """
import engine
engine.locate("nonsense", engine.Aabb((0, 0), (1, 1)))
engine.locate([(0, 0)], "nonsense")
engine.locate([(0, 0)], 7)
engine.collide("a.stl", "b.stl")
engine.collide(engine.Aabb((0, 0), (1, 1)), engine.Aabb((0, 0), (1, 1)), second_pose="up")
engine.collide_poses(engine.Aabb((0, 0), (1, 1)), engine.Aabb((0, 0), (1, 1)), "poses.csv")
engine.clip_segments("segments.csv", engine.Aabb((0, 0), (1, 1)))
engine.clip_lines([[(0, 0), (2, 2)]], engine.Aabb((0, 0), (1, 1)), keep="both")
"""


def test_a_type_checker_knows_what_is_taken(tmp_path: Path) -> None:
    """`mypy --strict` takes what people hold, and refuses a text in its place, line by line."""
    files = [tmp_path / "taken.py", tmp_path / "refused.py"]
    for file, text in zip(files, (TAKEN, REFUSED), strict=True):
        file.write_text(text)
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--config-file",
        "pyproject.toml",
        *map(str, files),
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    lines = re.findall(r"(taken|refused)\.py:(\d+): error", done.stdout)
    assert {int(number) for name, number in lines if name == "refused"} == set(range(3, 11)), done.stdout
    assert [number for name, number in lines if name == "taken"] == [], done.stdout


def test_dir_shows_the_public_names() -> None:
    import engine
    import exact_geometry

    assert dir(engine) == dir(exact_geometry) == sorted(engine.__all__)
