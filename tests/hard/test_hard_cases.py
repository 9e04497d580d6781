"""One runner for all hard cases: as stored, and under every transformation."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import pytest

import engine
from tests.hard.operations import OPERATIONS
from tests.hard.transform import NoImage, OutOfRange, motions, reordered
from tests.reference.solids import dimension

CASES = [
    pytest.param(path.parent.name, case, id=f"{path.parent.name}/{path.stem}/{case['name']}")
    for path in sorted((Path(__file__).parent / "cases").rglob("*.json"))
    for case in json.loads(path.read_text("utf-8"))
]


def dimension_of(data: dict[str, Any]) -> int:
    """Return the dimension a case lives in."""
    for key in ("solid", "region", "first", "subject"):
        if key in data:
            return dimension(data[key])
    return dimension(data["bodies"][0]["solid"])


def exact_or_error(operation: str, data: dict[str, Any]) -> Any:
    """Return the reference's answer; the engine's error where a coordinate is beyond the doubles."""
    try:
        return OPERATIONS[operation].exact(data)
    except OverflowError:
        return engine.NotRepresentableError


def answer_or_error(operation: str, data: dict[str, Any]) -> Any:
    try:
        return OPERATIONS[operation].by_engine(data)
    except engine.NotRepresentableError:
        return engine.NotRepresentableError
    except engine.InvalidInputError as error:
        return error


def expect_failure(request: pytest.FixtureRequest, case: dict[str, Any]) -> None:
    """A known failure is stored as a case marked with its present error; it must fail until it is repaired."""
    if "known_failure" in case:
        request.applymarker(pytest.mark.xfail(reason=case["known_failure"], strict=True))


@pytest.mark.parametrize(("operation", "case"), CASES)
def test_stored_answer_is_the_reference_s(operation: str, case: dict[str, Any]) -> None:
    found = OPERATIONS[operation].exact(case["input"])
    assert json.loads(json.dumps(found)) == case["answer"]


@pytest.mark.parametrize(("operation", "case"), CASES)
def test_engine_gives_the_stored_answer(request: pytest.FixtureRequest, operation: str, case: dict[str, Any]) -> None:
    expect_failure(request, case)
    assert answer_or_error(operation, case["input"]) == case["answer"]


@pytest.mark.some(25)
@pytest.mark.parametrize(("operation", "case"), CASES)
def test_engine_under_transformations(request: pytest.FixtureRequest, operation: str, case: dict[str, Any]) -> None:
    expect_failure(request, case)
    data, kept, wrong = case["input"], OPERATIONS[operation].kept, []
    chosen = list(motions(data, dimension_of(data)))
    if not request.config.getoption("--full"):
        chosen = random.Random(case["name"]).sample(chosen, 3)
    for name, motion in chosen:
        try:
            moved = motion.case(data)
        except (OutOfRange, NoImage):
            continue
        found, expected = answer_or_error(operation, moved), exact_or_error(operation, moved)
        if motion.is_exact and expected is not engine.NotRepresentableError and kept(expected) != kept(case["answer"]):
            wrong.append((name, "the reference itself changed", expected))
        if isinstance(found, engine.InvalidInputError) and not motion.is_exact:
            continue  # rounding broke an invariant: a ring of three vertices, two of which became one
        if found != expected:
            wrong.append((name, found, expected, moved))
    assert not wrong


@pytest.mark.some(25)
@pytest.mark.parametrize(("operation", "case"), CASES)
def test_engine_whatever_the_order(request: pytest.FixtureRequest, operation: str, case: dict[str, Any]) -> None:
    expect_failure(request, case)
    source = random.Random(case["name"])
    for _ in range(10 if request.config.getoption("--full") else 1):
        other = reordered(case["input"], source)
        expected = OPERATIONS[operation].exact(other)
        assert OPERATIONS[operation].kept(expected) == OPERATIONS[operation].kept(case["answer"])
        assert answer_or_error(operation, other) == expected, other
