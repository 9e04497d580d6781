"""Rows of ours alone: every kind of question whose speed the tables show, by the public names of the engine only.

A row is made in a process of its own kind (its own checkout of the engine); making it is not timed, running it is.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import cycle
from typing import Any

FILES = ("containment", "collision", "segments", "polygons", "overlays", "calls")
Run = Callable[[], object]


@dataclass(frozen=True, slots=True)
class Question:
    """One row: its name, and what makes the call that is timed."""

    name: str
    make: Callable[[], Run]


@dataclass(frozen=True, slots=True)
class Size:
    """How large the workloads are."""

    seed: int
    is_quick: bool

    def of(self, full: int, quick: int) -> int:
        """Return one of two sizes."""
        return quick if self.is_quick else full


def questions(size: Size, only: str = "") -> Iterator[Question]:
    """Yield the rows whose name contains a word, in their order."""
    for file in FILES:
        for question in importlib.import_module(f"benchmarks.rows.{file}").questions(size):
            if only in question.name:
                yield question


def in_turn(ask: Callable[[Any], object], items: list[Any]) -> Run:
    """Return what asks about the next item at every call: a single input would be learned by heart."""
    following = cycle(items)
    return lambda: ask(next(following))


def asked_before(run: Run, times: int = 6) -> Run:
    """Ask so often that structures which pay only after many questions are there."""
    for _ in range(times):
        run()
    return run
