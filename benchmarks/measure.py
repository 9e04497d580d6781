"""The rules of timing.

- Contenders are compared in pairs, in one process, in turn: each round runs one and then the other, the next round the
  other way round, so that what else the machine does falls on both. The figure is the median of the rounds' ratios,
  with its quartiles; best and median of each contender stand beside it.
- The first run of each is cold (it may compile, load, build what it keeps) and is kept apart.
- A sample shorter than `LEAST_SECONDS` is repeated within the round until it is long enough.
- CPU time is taken too: where other processes share the machine, its ratio is the steadier one.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field

LEAST_SECONDS = 0.03
MOST_ROUNDS_AFTER_BUDGET = 3


@dataclass(slots=True)
class Timing:
    """What one contender took for one run of a workload."""

    cold: float
    """Seconds of the first run."""
    wall: list[float] = field(default_factory=list)
    """Seconds of one run, one value a round."""
    cpu: list[float] = field(default_factory=list)
    """CPU seconds of all threads, one value a round."""

    @property
    def median(self) -> float:
        return statistics.median(self.wall)

    @property
    def best(self) -> float:
        return min(self.wall)


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


def interleaved(runs: list[Callable[[], object]], rounds: int, seconds: float) -> tuple[list[Timing], list[object]]:
    """Time `runs` in turn over so many rounds, fewer (three at least) when `seconds` are over; return the results too.

    The results are those of the cold runs.
    """
    timings, results, repeats = [], [], []
    for run in runs:
        cold, _, result = clocked(run)
        timings.append(Timing(cold))
        results.append(result)
    for run in runs:
        warm = clocked(run)[0]
        if warm < LEAST_SECONDS:
            warm = min(warm, clocked(run)[0])
        repeats.append(max(1, int(LEAST_SECONDS / max(warm, 1e-7))))
    end = time.perf_counter() + seconds
    for round_ in range(rounds):
        if round_ >= MOST_ROUNDS_AFTER_BUDGET and time.perf_counter() > end:
            break
        order = range(len(runs)) if round_ % 2 == 0 else range(len(runs) - 1, -1, -1)
        for i_run in order:
            n = repeats[i_run]
            wall, cpu, _ = clocked(lambda run=runs[i_run], n=n: [run() for _ in range(n)] and None)
            timings[i_run].wall.append(wall / n)
            timings[i_run].cpu.append(cpu / n)
    return timings, results


def ratios(ours: Timing, peer: Timing) -> tuple[Spread, Spread]:
    """Return how many times faster ours is than the peer, round by round: by the clock and by CPU time."""
    wall = [b / a for a, b in zip(ours.wall, peer.wall, strict=True)]
    cpu = [b / max(a, 1e-9) for a, b in zip(ours.cpu, peer.cpu, strict=True)]
    return spread(wall), spread(cpu)
