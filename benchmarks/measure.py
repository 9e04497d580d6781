"""The rules of timing.

- Contenders are compared in one process, in turn: each round asks one after the other, the next round the other way
  round, so that what else the machine does falls on all. The figure is the median of the rounds, with its quartiles.
- The first run of each is cold (it may compile, load, build what it keeps) and is kept apart.
- A sample shorter than `LEAST_SECONDS` is repeated within the round until it is long enough.
- CPU time is taken too: where other processes share the machine, its ratio is the steadier one.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

LEAST_SECONDS = 0.03


@dataclass(frozen=True, slots=True)
class Spread:
    """A median with its quartiles."""

    median: float
    low: float
    high: float


def spread(values: list[float]) -> Spread:
    """Return median and quartiles (of two values or fewer: their least and largest)."""
    if len(values) < 3:
        return Spread(statistics.median(values), min(values), max(values))
    low, middle, high = statistics.quantiles(values, n=4, method="inclusive")
    return Spread(middle, low, high)


def clocked(run: Callable[[], object]) -> tuple[float, float, object]:
    """Return wall seconds, CPU seconds and the result of one run."""
    cpu, wall = time.process_time(), time.perf_counter()
    result = run()
    return time.perf_counter() - wall, time.process_time() - cpu, result
