"""The cases that users of other libraries filed in public (benchmarks/filed): ours is right on every one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.hard.operations import OPERATIONS

PATH = Path(__file__).resolve().parents[2] / "benchmarks" / "filed" / "cases.json"
CASES = json.loads(PATH.read_text("utf-8"))


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
