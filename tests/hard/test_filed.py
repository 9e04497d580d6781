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
