"""The cases that users of other libraries filed in public (benchmarks/filed): ours is right on every one."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from benchmarks.filed import FILES, PATH, load, museum
from tests.hard.operations import OPERATIONS

CASES = load()


@pytest.mark.parametrize("case", CASES, ids=[case["id"] for case in CASES])
def test_ours_is_right(case: dict[str, Any]) -> None:
    operation = OPERATIONS[case["operation"]]
    assert operation.by_engine(case["input"]) == case["answer"]
    assert json.loads(json.dumps(operation.exact(case["input"]))) == case["answer"], "the reference's own answer"


def test_cases_are_distinct_and_name_their_threads() -> None:
    assert len({case["id"] for case in CASES}) == len(CASES)
    assert all(case["thread"].count("#") == 1 and case["id"].startswith(case["thread"]) for case in CASES)
    assert len({case["thread"] for case in CASES}) >= 30
    assert len(CASES) >= 160


def test_cases_are_read_from_files() -> None:
    """At least twelve, of seven formats; every file is used, and the numbers asked about are those that stand in it."""
    named = {case["id"]: museum.files_of(case) for case in CASES}
    files = {name for names in named.values() for name in names}
    assert sum(map(bool, named.values())) >= 12
    assert files == {path.name for path in FILES.iterdir()}
    assert {Path(name).suffix for name in files} == {".stl", ".obj", ".off", ".ply", ".glb", ".geojson", ".wkt"}
    for case in CASES:
        for key, solid in case["given"].items():
            if isinstance(solid, dict) and not solid.get("file", ".glb").endswith(".glb"):  # GLB: float32 in octets
                read, text = case["input"][key], (FILES / solid["file"]).read_text("utf-8")
                points = read["vertices"] if "vertices" in read else read["rings"][0]
                assert {x for point in points for x in point} <= set(map(float, re.findall(r"-?\d[\d.e-]*", text)))


def test_whoever_filed_what_stands_in_our_own_files_is_credited() -> None:
    """A stored hard case that begins with the segment of a filed one names its thread, and so does the textbook."""
    root = PATH.parents[2]
    stored = [
        case for path in root.glob("tests/hard/cases/clip_segments/*.json") for case in json.loads(path.read_text())
    ]
    filed = {str((case["input"]["region"], case["input"]["segments"][0])): case["thread"]
             for case in CASES if case["operation"] == "clip_segments"}  # fmt: skip
    shared = {str((case["input"]["region"], case["input"]["segments"][0])): case["source"] for case in stored}
    both = filed.keys() & shared.keys()
    assert [filed[key] for key in both] == [shared[key] for key in both] == ["evil-mad/plotink#40"]
    book = (root / "engine" / "textbook" / "clip_segments.py").read_text("utf-8")
    assert "(1, 1)-(-1, -1) and the box from 1e-9 to 3 (evil-mad/plotink#40)" in book
