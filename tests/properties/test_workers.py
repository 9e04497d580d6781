"""The same bytes for any number of workers: every array of the answers of large batches, at 1, 2, 3 and 16."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from benchmarks import cores
from engine.polygon_overlay import stripes

QUESTIONS = (
    "points, mesh", "points, polygon", "collide", "clearance", "segments, box", "segments, mesh", "segments, scene",
    "points, scene", "pairs, scene", "quads, box", "overlay_batch", "union",
)  # fmt: skip


@pytest.fixture(scope="module")
def questions() -> dict[str, Callable[[int | None], Any]]:
    """The questions of `python -m benchmarks cores`, smaller: large enough for several threads, and for stripes."""
    return {name: question for name, _, question in cores.workloads(0.1, seed=3)}


@pytest.mark.parametrize("name", QUESTIONS)
def test_answers_have_the_same_bytes(
    name: str, questions: dict[str, Callable[[int | None], Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stripes, "_LEAST_IN_ALL", 0)
    monkeypatch.setattr(stripes, "_LEAST", 5_000)
    (question,) = (question for each, question in questions.items() if name in each)
    digests = {cores.digest_of(question(workers)) for workers in (1, 2, 3, 16)}
    assert len(digests) == 1
    assert digests.isdisjoint({cores.digest_of(None)})


def test_every_question_is_asked(questions: dict[str, Callable[[int | None], Any]]) -> None:
    assert len(QUESTIONS) == len(questions)
