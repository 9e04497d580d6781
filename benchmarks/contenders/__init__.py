"""Contenders: ours and one file per peer, all with the same call.

A contender is a module with `NAME`, `PACKAGE` (None for ours) and `MAKERS`: for each kind of task a function
``(subject, threads) -> Prepared``. The kinds and their subjects are those of workloads.py. Making is the build: it is
timed where a row asks for it. A module imports its package when it is imported itself, so a peer that is not installed
is found by `load`.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np

PEERS = ("coal_calls", "fcl_calls", "numpy_planes", "open3d_occupancy", "shapely_polygons")


@dataclass(frozen=True, slots=True)
class Prepared:
    """One contender, ready for the questions of one workload."""

    native: Callable[[np.ndarray], Any]
    """Converts float64 points to what the contender takes; not timed."""
    ask: Callable[[Any], Any]
    """Answers for all of them; timed."""
    answer: Callable[[Any], np.ndarray]
    """Reads the contender's answer: (n,) bool contained, or for a scene sorted point * n_bodies + body; not timed."""
    memory: Callable[[], int] | None = None
    """Bytes that it says it holds."""
    method: Callable[[], str] | None = None
    """What it says it used."""


@dataclass(frozen=True, slots=True)
class Absent:
    """A contender that cannot run here."""

    name: str
    reason: str


@cache
def load(name: str) -> ModuleType | Absent:
    """Return the module of a contender, or why it cannot run."""
    try:
        return importlib.import_module(f"benchmarks.contenders.{name}")
    except (ImportError, OSError) as error:  # not installed, or without a system library it needs
        return Absent(name, f"{type(error).__name__}: {error}".splitlines()[0])


@cache
def pool(threads: int) -> ThreadPoolExecutor:
    """Return threads for peers that have none of their own."""
    return ThreadPoolExecutor(threads)


def split(n_items: int, threads: int) -> list[slice]:
    """Return as many equal parts of 0 .. n_items as there are threads."""
    borders = [n_items * part // threads for part in range(threads + 1)]
    return [slice(start, stop) for start, stop in pairwise(borders)]


def in_threads(task: Callable[[slice], Any], n_items: int, threads: int) -> list[Any]:
    """Return what `task` returns for each part, all parts at once."""
    if threads == 1:
        return [task(slice(0, n_items))]
    return list(pool(threads).map(task, split(n_items, threads)))
