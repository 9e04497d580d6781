"""Splits a batch into chunks over a thread pool, within a budget, and reports progress.

Kernels are serial and release the interpreter lock, so plain threads run them side by side; two kernels that each start
threads of their own would abort the process under numba's workqueue layer. Between chunks there is room for other
requests. Inside a chunk, a kernel whose work per item is not small polls `Budget.flag` (at least every 10 ms) and
returns early when it is set; slow Python loops call `Budget.check`.

Policy, for a rest of the batch that takes T seconds on one thread:

| question | rule |
| --- | --- |
| threads | sqrt(T / 100 us), at most `workers`: starting w threads takes w * 100 us, they save T - T / w |
| the calling thread | works too; it waits only for chunks that run when no range is left |
| longest chunk | 1.25 ms for each thread, from 2 to 20 ms: a chunk takes the interpreter lock a fixed number of times |
| few, long items of a known time | no chunk is timed first: `pace` |
| first chunk of each thread | 3/4 of an even share, so that few chunks remain |
| the others | 1/1.3 of an even share of the rest, not below 1/4 of the longest or a sixth of the first share |
| tasks in order, up to 4 threads | half an even share of the rest, at most 2 ms |
| other calls use the pool | 2 ms; a thread then goes to the end of the queue after each chunk |
| pace | CPU time of the last chunk, which does not hold the wait for the interpreter lock as wall time does |
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import lru_cache
from math import ceil, sqrt
from pathlib import Path
from queue import SimpleQueue
from typing import Final, TypedDict

import numpy as np

from engine.errors import CancelledError, DeadlineExceededError, InvalidInputError
from engine.running.budget import UNLIMITED, Budget, Cancel, current, poll, shown, work_under

Progress = Callable[[int], object]
"""Called with the number of items just finished, so that ``tqdm(total=n).update`` fits."""

CHUNK_SECONDS: Final = 0.002
"""Least target duration of a chunk: short enough for fairness between requests, long against 20 us of hand-over."""

_LONGEST: Final = 0.02
_PER_THREAD: Final = 0.00125
"""Largest target duration of a chunk, and its part for each thread."""
_START_SECONDS: Final = 100e-6
"""Time in which the calling thread starts another."""
_SMALLEST: Final = 8
"""Least size of the last chunks, as a part of a full one."""
FEW_THREADS: Final = 4
"""Number of threads up to which short ranges do not wait for the interpreter lock."""
_cpu_seconds: Final = getattr(time, "thread_time", time.perf_counter)


class Options(TypedDict, total=False):
    """Keyword arguments of every public function, for its overloads."""

    workers: int | None
    deadline: float | None
    cancel: Cancel | None
    progress: Progress | None


def check_options(workers: object, progress: object, **flags: object) -> None:
    """Raise unless `workers` is a whole number from 1 or None, `progress` callable or None, and each flag a bool."""
    if workers is not None and (isinstance(workers, bool) or not isinstance(workers, (int, np.integer)) or workers < 1):
        raise InvalidInputError(
            f"workers must be at least 1, got {shown(workers)}; leave it out for one per core", ("workers",)
        )
    if progress is not None and not callable(progress):
        raise InvalidInputError(f"progress must be callable or None, got {shown(progress)}", ("progress",))
    for name, flag in flags.items():
        if flag is not True and flag is not False and not isinstance(flag, np.bool_):
            raise InvalidInputError(f"{name} must be True or False, got {shown(flag)}", (name,))


def is_unlimited(workers: object, deadline: object, cancel: object, progress: object) -> bool:
    """Return whether a small batch may take the fast path: no limit, and any number of threads."""
    is_any = workers is None or (type(workers) is int and workers > 0)
    return is_any and deadline is None and cancel is None and progress is None


def default_workers() -> int:
    """Return the number of cores this process may use, the most threads that a call takes by default.

    Returns
    -------
    int
        The cores of its affinity, at most the CPU quota of its container (control groups 1 and 2) rounded up; at
        least 1.

    Notes
    -----
    The quota is read once a process.

    References
    ----------
    Linux kernel documentation, Control Group v2, CPU interface files.

    Examples
    --------
    >>> from engine import default_workers
    >>> default_workers() >= 1
    True
    """
    n_cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(n_cores, _quota() or n_cores))


@lru_cache(1)
def _quota(root: Path = Path("/sys/fs/cgroup"), own: Path = Path("/proc/self/cgroup")) -> int | None:
    """Return the CPU quota of the control group (version 2 or 1) in cores, rounded up; None if there is none."""
    try:
        groups = [line.split(":", 2)[1:] for line in own.read_text().splitlines() if line.count(":") >= 2]
    except (OSError, ValueError):
        return None
    quotas = []
    for controllers, path in groups:
        folder = root if not controllers else root / "cpu"
        if controllers and "cpu" not in controllers.split(","):
            continue
        place = folder / path.lstrip("/")
        for group in [place, *place.parents]:  # a quota of a parent binds too
            quotas += _quota_of(group, not controllers)
            if group == folder:
                break
    return ceil(min(quotas)) if quotas else None


def _quota_of(group: Path, is_unified: bool) -> list[float]:
    """Return the quota of one control group, or nothing."""
    try:
        if is_unified:
            quota, period = (group / "cpu.max").read_text().split()
        else:
            quota, period = ((group / f"cpu.cfs_{name}_us").read_text().strip() for name in ("quota", "period"))
        return [int(quota) / int(period)] if quota != "max" and int(quota) > 0 else []
    except (OSError, ValueError):
        return []


_pool: ThreadPoolExecutor | None = None
_pool_lock = threading.Lock()
_n_calls = 0
"""Number of calls that use the pool now."""


def _forget_pool() -> None:
    """Reset the pool in a forked child, which has its object but none of its threads."""
    global _pool, _pool_lock, _n_calls
    _pool, _pool_lock, _n_calls = None, threading.Lock(), 0


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_pool)


def _shared_pool() -> ThreadPoolExecutor:
    global _pool
    with _pool_lock:
        if _pool is None:
            _pool = ThreadPoolExecutor(default_workers(), thread_name_prefix="engine")
        return _pool


def run_chunks(
    task: Callable[[int, int], object],
    n_items: int,
    *,
    budget: Budget,
    first_chunk: int = 1024,
    workers: int | None = None,
    progress: Progress | None = None,
    in_order: bool = False,
    pace: float = 0.0,
) -> None:
    """Call ``task(start, stop)`` until the ranges cover ``0 .. n_items``, each item once.

    The first chunks run in the calling thread and are timed, the very first only if it is long enough: it may load code
    and data for the others. The rest is shared with as many threads as pay (see the table of this file); with one
    worker, or if it takes less than two chunks, no other thread is started: waiting for one takes up to half a
    millisecond. Tasks write to disjoint slices, so the result does not depend on `workers` or on the sizes chosen.

    workers: threads at once; None for one per core, 1 for the calling thread only. in_order: a task continues what the
    range before began, so that ranges stay short where there are few threads. pace: seconds an item takes, where that
    is known and items are few and long: none is timed first.
    Raises: what `task` raises (of the ranges that failed before the flag was raised, the earliest),
    `DeadlineExceededError`, `CancelledError`.
    """
    check_options(workers, progress)
    n_workers = default_workers() if workers is None else workers
    done, chunk, is_timed = 0, max(1, first_chunk), pace > 0.0
    while done < n_items:
        budget.check()
        rest = (n_items - done) * pace
        if is_timed and n_workers > 1 and n_items - done > chunk and rest > 2.0 * CHUNK_SECONDS:
            ranges = Ranges(done, n_items, pace, threads_that_pay(rest, n_workers), in_order)
            _run_threaded(task, ranges, budget, progress)
            break
        stop = min(n_items, done + chunk)
        before = time.perf_counter()
        task(done, stop)
        seconds = time.perf_counter() - before
        if progress is not None:
            progress(stop - done)
        is_timed = done > 0 or seconds > CHUNK_SECONDS / _SMALLEST
        chunk, pace = _next_chunk(stop - done, seconds, CHUNK_SECONDS), seconds / (stop - done)
        done = stop
    budget.check()


def share(task: Callable[[int, int], object], n_items: int, pace: float) -> None:
    """Call ``task(start, stop)`` as `run_chunks` does, for a structure that the call of this thread needs: with its
    budget, and its workers. pace: seconds an item takes. Raises: as `run_chunks`."""
    poll()
    if n_items * pace > CHUNK_SECONDS:
        budget, chunk = current(), max(1, int(CHUNK_SECONDS / pace))
        budget = Budget() if budget is UNLIMITED else budget  # an error in one thread sets its flag
        run_chunks(task, n_items, budget=budget, first_chunk=chunk, workers=budget.workers, pace=pace)
    elif n_items:
        task(0, n_items)
        poll()


def _next_chunk(n_items: int, seconds: float, target: float) -> int:
    """Return the size of a chunk that should take `target` seconds, at most eight times the last."""
    return max(1, int(n_items * min(8.0, target / max(seconds, 1e-9))))


def threads_that_pay(seconds: float, n_workers: int) -> int:
    """Return how many threads share work of so many seconds: w minimises seconds / w + w * `_START_SECONDS`."""
    return min(n_workers, max(2, int(sqrt(seconds / _START_SECONDS))))


class Ranges:
    """The remaining ranges of a batch, and the size of the next; knows no clock."""

    def __init__(self, start: int, n_items: int, pace: float, n_threads: int, in_order: bool = False) -> None:
        self._are_short = in_order and n_threads <= FEW_THREADS
        self._start, self.n_items, self.n_threads, self._n_taken = start, n_items, n_threads, 0
        self._share = (n_items - start) // n_threads
        self._target = min(_LONGEST, max(CHUNK_SECONDS, n_threads * _PER_THREAD))
        self._chunk = max(1, int(self._target / max(pace, 1e-12)))
        self._lock = threading.Lock()

    @property
    def are_left(self) -> bool:
        return self._start < self.n_items

    def take(self, is_shared: bool) -> tuple[int, int] | None:
        """Return the next range, None where there is none; is_shared: other calls use the pool."""
        with self._lock:
            first = self._start
            if first >= self.n_items:
                return None
            most = int(self._chunk * CHUNK_SECONDS / self._target) if is_shared or self._are_short else self._chunk
            if self._are_short:
                share = max(most // _SMALLEST, (self.n_items - first) // (2 * self.n_threads))
            elif self._n_taken < self.n_threads:
                share = 3 * self._share // 4
            else:
                least = max(most // 16, min(self._share // 6, most // 4))
                share = max(least, 10 * (self.n_items - first) // (13 * self.n_threads))
            self._start, self._n_taken = min(self.n_items, first + max(1, min(most, share))), self._n_taken + 1
            return first, self._start

    def took(self, n_items: int, seconds: float) -> None:
        """Adapt the size of the next chunks to the CPU time that a chunk of n_items took, in seconds."""
        self._chunk = _next_chunk(n_items, seconds, self._target)


class _Run:
    """One call whose ranges several threads take; on the first error the flag is set, so that all end soon.

    A thread of the pool wakes the calling thread only to report progress, and when it is the last to end: each time,
    one waits for the interpreter lock, some 50 us.
    """

    def __init__(
        self, task: Callable[[int, int], object], ranges: Ranges, budget: Budget, progress: Progress | None
    ) -> None:
        self._task, self._ranges, self._budget, self._progress = task, ranges, budget, progress
        self._lock, self._n_working, self._is_closed = threading.Lock(), 0, False
        self.failures: list[tuple[int, BaseException]] = []
        self._reports: SimpleQueue[int | None] = SimpleQueue()
        """Numbers of items that other threads finished, if progress is due; None: the last has ended."""

    def _do_next(self) -> int:
        """Run the next range; return the number of its items, 0 if there is none or the call failed."""
        taken = None if self.failures else self._ranges.take(_n_calls > 1)
        if taken is None:
            return 0
        first, stop = taken
        try:
            before = _cpu_seconds()
            self._task(first, stop)
            self._ranges.took(stop - first, _cpu_seconds() - before)
            self._budget.check()
        except BaseException as error:  # the caller's, who gets it, and not what follows from a raised flag
            is_late = self._budget.flag[0] or isinstance(error, (CancelledError, DeadlineExceededError))
            self.fail(self._ranges.n_items if is_late else first, error)
            return 0
        return stop - first

    def fail(self, place: int, error: BaseException) -> None:
        """Note an error; the one with the least place is raised."""
        self.failures.append((place, error))
        self._budget.flag[0] = 1

    def turn(self) -> None:
        """Run ranges in a thread of the pool; after each, let the other calls' turns go first."""
        with self._lock:
            if self._is_closed:
                return
            self._n_working += 1
        work_under(self._budget)
        while n_done := self._do_next():
            if self._progress is not None:
                self._reports.put(n_done)
            if _n_calls > 1 and self._ranges.are_left:
                with suppress(RuntimeError):  # the interpreter ends
                    _shared_pool().submit(self.turn)
                    break
        with self._lock:
            self._n_working -= 1
            if self._is_closed and not self._n_working:
                self._reports.put(None)

    def finish(self) -> None:
        """Work in the calling thread until no range is left, then wait for the ranges that other threads run."""
        reports = self._reports
        while n_done := self._do_next():
            if self._progress is not None:
                while not reports.empty():
                    n_done += reports.get() or 0
                self._progress(n_done)
        with self._lock:
            self._is_closed = True
            if not self._n_working:
                reports.put(None)
        while (report := reports.get()) is not None:
            if self._progress is not None and not self.failures:
                self._progress(report)


def _run_threaded(
    task: Callable[[int, int], object], ranges: Ranges, budget: Budget, progress: Progress | None
) -> None:
    """Share ranges with other threads; on the first error wait for running tasks, and re-raise it."""
    global _n_calls
    run, pool = _Run(task, ranges, budget, progress), _shared_pool()
    with _pool_lock:
        _n_calls += 1
    try:
        for _ in range(ranges.n_threads - 1):
            pool.submit(run.turn)
        run.finish()
    except BaseException as error:  # of `progress`, or an interrupt: nobody waits for the threads, let them end
        run.fail(-1, error)
        raise
    finally:
        with _pool_lock:
            _n_calls -= 1
    if run.failures:
        budget.resume()  # who handles the error may go on under this budget
        try:
            raise min(run.failures, key=lambda failure: failure[0])[1]
        finally:
            run.failures.clear()  # each leads to frames that lead here: a search for cycles would have to free them
