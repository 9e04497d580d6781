"""Threads simulated on one: what a machine with more cores would take, from the CPU time of each range on this one.

A call runs as with so many workers, but all its ranges in the calling thread, each as the first free of the virtual
threads would take it; what is not in a range is serial. The policy is the real one (`Ranges`, `threads_that_pay`). Not
in it: memory traffic, page faults of many threads at once, and work of ranges that holds the interpreter lock, beyond
`LOCK_SECONDS`.
"""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final
from unittest.mock import patch

from engine.running import parallel
from engine.running.budget import Budget
from engine.running.parallel import Progress, Ranges

LOCK_SECONDS: Final = 20e-6
"""How long a range holds the interpreter lock: the hand-over that `parallel.CHUNK_SECONDS` is long against."""
START_SECONDS: Final = 50e-6
"""Time from one thread's start to the next."""


def makespan(ranges: Ranges, run: Callable[[int, int], float], lock_seconds: float = LOCK_SECONDS) -> float:
    """Return when the last of the virtual threads ends, which start one after another and take ranges as they are free.
    run: called with each range, returns its seconds, after `Ranges.took`. lock_seconds: held for each range."""
    threads = [(k * START_SECONDS, k) for k in range(ranges.n_threads)]
    lock_free = end = 0.0
    while threads:  # bound: each turn takes a range or ends a thread
        now, thread = heapq.heappop(threads)
        taken = ranges.take(is_shared=False)
        if taken is None:
            end = max(end, now)
            continue
        lock_free = max(now, lock_free) + lock_seconds
        heapq.heappush(threads, (lock_free + run(*taken), thread))
    return end


class Spent:
    """CPU seconds of one call in what it shares, with those that simulating takes, and the makespan of its ranges on
    virtual threads."""

    def __init__(self) -> None:
        self.shared = self.makespan = 0.0

    def share(
        self, task: Callable[[int, int], object], ranges: Ranges, budget: Budget, progress: Progress | None
    ) -> None:
        """Run ranges here, in place of `parallel._run_threaded`."""

        def run(first: int, stop: int) -> float:
            before = time.thread_time()
            task(first, stop)
            seconds = time.thread_time() - before
            ranges.took(stop - first, seconds)
            budget.check()
            if progress is not None:
                progress(stop - first)
            return seconds

        begin = time.thread_time()
        self.makespan += makespan(ranges, run)
        self.shared += time.thread_time() - begin


@contextmanager
def simulated() -> Iterator[Spent]:
    """Have the calls within share their ranges among virtual threads."""
    spent = Spent()
    with patch.object(parallel, "_run_threaded", spent.share):
        yield spent


def predict(question: Callable[[int | None], Any], counts: list[int], rounds: int) -> dict[str, Any]:
    """Return, by number of workers, the predicted speed-up over one, and with the most the share of one worker's time
    that is not shared."""
    least: dict[int, tuple[float, float]] = {}
    one = float("inf")
    for _ in range(rounds):
        before = time.thread_time()
        question(1)
        one = min(one, time.thread_time() - before)
        for count in counts:
            with simulated() as spent:
                before = time.thread_time()
                question(count)
                serial = time.thread_time() - before - spent.shared
            least[count] = min(least.get(count, (float("inf"), 0.0)), (serial + spent.makespan, serial))
    speed_up = {str(count): one / seconds for count, (seconds, _) in least.items()}
    return {"seconds": one, "serial": least[counts[-1]][1] / one, "speed_up": speed_up}
