"""The same answers as stored, bit for bit, whoever restructured what: a tenth of benchmarks/answers.

`python -m benchmarks answers --check` asks all of it.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import engine
from benchmarks.answers.asking import CHUNKS, digest, joined
from benchmarks.answers.stored import Row, asked, chosen, differences, load

TENTH = 4


@pytest.mark.parametrize("operation", CHUNKS)
def test_answers_to_a_tenth_of_the_questions_are_those_stored(operation: str) -> None:
    chunks = [chunk for chunk in chosen(TENTH) if chunk.operation == operation]
    assert chunks
    assert differences(asked(chunks), load()) == []


def test_what_is_stored_is_of_the_chunks_that_there_are() -> None:
    table = load()
    assert {name: list(chunks) for name, chunks in CHUNKS.items()} == {
        name: list(row["chunks"]) for name, row in table.items()
    }
    assert all(joined(row["chunks"].values()) == row["sha256"] for row in table.values())


def test_threads_change_no_answer() -> None:
    chunks = chosen(only="/many_bodies/0") + chosen(only="locate/polygons_asked_again_and_again/0")
    assert asked(chunks, 1) == asked(chunks, 3)


def test_one_wrong_answer_changes_the_digest_and_is_named() -> None:
    found = np.array([1, 0, -1], np.int8)
    wrong = found.copy()
    wrong[1] = 1
    assert digest([found]) != digest([wrong])
    rows = [Row("locate", "simple_solids/0", 3, digest([wrong]))]
    table = {"locate": {"chunks": {"simple_solids/0": digest([found])}}}
    assert [line.partition(":")[0] for line in differences(rows, table)] == ["locate/simple_solids/0"]


def test_a_digest_is_of_values_not_of_their_types_in_memory() -> None:
    assert digest(np.array([1, 2], np.int8)) == digest(np.array([1, 2], ">i4"))
    assert digest(np.array([-np.nan, 1.0])) == digest(np.array([np.nan, 1.0]))
    assert digest(engine.Relation.TOUCHING) == digest(4) != digest(Fraction(9, 2))
    different = [0.0, -0.0, 0, None, False, "0", b"0", [0], [[0]], np.zeros(1), np.zeros((1, 1)), {"0": 0}]
    assert len({digest(value) for value in different}) == len(different)
