"""The rules of timing.

- Contenders are compared in one process, interleaved: each round runs one after the other, the next round in reverse,
  so that other load of the machine affects all. The figure is the median of the rounds, with its quartiles.
- The first run of each is cold (it may compile, load, build caches) and is reported separately.
- A sample shorter than `LEAST_SECONDS` is repeated within the round until it is long enough.
- CPU time is taken too: where other processes share the machine, its ratio is the steadier one.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

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


def interval(count: int, total: int) -> tuple[float, float]:
    """Return the 95% interval of a share by Wilson's score: 0 of 134 is 0 to 2.8%."""
    if not total:
        return 0.0, 1.0
    z2, share = 1.959964**2, count / total
    middle, wide = share + z2 / (2 * total), (z2 * (share * (1 - share) + z2 / (4 * total)) / total) ** 0.5
    low, high = ((middle + sign * wide) / (1 + z2 / total) for sign in (-1, 1))
    return (low if count else 0.0), (high if count < total else 1.0)


def percentile(values: list[float], share: float) -> float:
    """Return the value that this share of `values` does not exceed."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def clocked(run: Callable[[], object]) -> tuple[float, float, object]:
    """Return wall seconds, CPU seconds and the result of one run."""
    cpu, wall = time.process_time(), time.perf_counter()
    result = run()
    return time.perf_counter() - wall, time.process_time() - cpu, result


def memory_of(pid: int | None = None) -> float:
    """Return the resident megabytes of a process, of this one if none is named (Linux), else NaN."""
    try:
        pages = int(Path(f"/proc/{pid or os.getpid()}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 2**20
    except OSError:
        return float("nan")
