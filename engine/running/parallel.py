"""Splits a batch into chunks of 1-3 ms over a thread pool, within a budget, and reports progress.

Kernels are serial and release the interpreter lock, so plain threads run them side by side; two kernels that each start
threads of their own would abort the process under numba's workqueue layer. Between chunks there is room for other
requests. Inside a chunk, a kernel whose work per item is not small polls `Budget.flag` (at least every 10 ms) and
returns early when it is set; slow Python loops call `Budget.check`.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Final, TypedDict

import numpy as np

from engine.errors import CancelledError, DeadlineExceededError, InvalidInputError
from engine.running.budget import Budget, Cancel, shown, work_under

Progress = Callable[[int], object]
"""Called with the number of items just finished, so that ``tqdm(total=n).update`` fits."""

CHUNK_SECONDS: Final = 0.002
"""Target duration of a chunk: short enough for fairness between requests, long against 20 us of hand-over."""

_SMALLEST: Final = 8
"""Least size of the last chunks, as a part of a full one."""


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
    """Return the number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
) -> None:
    """Call ``task(start, stop)`` until the ranges cover ``0 .. n_items``, each item once.

    The first chunks run in the calling thread and are timed, the very first only if it is long enough: it may load code
    and data for the others. Later ones are sized to take `CHUNK_SECONDS`. With one worker, or if the rest would take
    less than twice that, no other thread is started: waiting for one takes up to half a millisecond.
    Tasks write to disjoint slices, so the result does not depend on `workers` or on the sizes chosen.

    task: must not call `run_chunks` with more than one worker (the pool is shared and could wait on itself).
    workers: threads at once; None for one per core, 1 for the calling thread only.
    Raises: what `task` raises (the earliest range first), `DeadlineExceededError`, `CancelledError`.
    """
    check_options(workers, progress)
    n_workers = default_workers() if workers is None else workers
    done, chunk, pace, is_timed = 0, max(1, first_chunk), 0.0, False  # pace: seconds an item
    while done < n_items:
        budget.check()
        is_worth_it = n_items - done > chunk and (n_items - done) * pace > 2.0 * CHUNK_SECONDS
        if is_timed and n_workers > 1 and is_worth_it:
            _run_threaded(task, done, n_items, chunk, n_workers, budget, progress)
            break
        stop = min(n_items, done + chunk)
        before = time.perf_counter()
        task(done, stop)
        seconds = time.perf_counter() - before
        if progress is not None:
            progress(stop - done)
        is_timed = done > 0 or seconds > CHUNK_SECONDS / _SMALLEST
        chunk, pace = _next_chunk(stop - done, seconds), seconds / (stop - done)
        done = stop
    budget.check()


def _next_chunk(n_items: int, seconds: float) -> int:
    """Return the size of a chunk that should take `CHUNK_SECONDS`, at most eight times the last."""
    return max(1, int(n_items * min(8.0, CHUNK_SECONDS / max(seconds, 1e-9))))


class _Ranges:
    """The remaining ranges of a batch. Chunks get smaller towards the end, so that all threads end together."""

    def __init__(self, start: int, n_items: int, chunk: int, n_workers: int) -> None:
        self._start, self._n_items = start, n_items
        self._chunk, self._n_workers = chunk, n_workers
        self._lock = threading.Lock()

    @property
    def are_left(self) -> bool:
        return self._start < self._n_items

    def take(self) -> tuple[int, int] | None:
        """Return the next range, None where there is none."""
        with self._lock:
            first = self._start
            if first >= self._n_items:
                return None
            share = max(1, self._chunk // _SMALLEST, (self._n_items - first) // (2 * self._n_workers))
            self._start = min(self._n_items, first + min(self._chunk, share))
            return first, self._start

    def took(self, n_items: int, seconds: float) -> None:
        """Size the next chunks by the duration of one that is done."""
        self._chunk = _next_chunk(n_items, seconds)


def _run_threaded(
    task: Callable[[int, int], object],
    start: int,
    n_items: int,
    chunk: int,
    n_workers: int,
    budget: Budget,
    progress: Progress | None,
) -> None:
    """Run `n_workers` threads; on the first error set the flag, wait for running tasks, re-raise.

    A thread takes chunk after chunk by itself: notifying this one after each costs a tenth of the time. It returns
    after a chunk if another call uses the pool, for fairness, or if `progress` is due.
    """
    global _n_calls
    ranges, pool = _Ranges(start, n_items, chunk, n_workers), _shared_pool()
    failures: list[tuple[int, BaseException]] = []

    def work() -> int:
        work_under(budget)
        n_done = 0
        while not failures and (next_range := ranges.take()) is not None:
            first, stop = next_range
            before = time.perf_counter()
            try:
                task(first, stop)
                ranges.took(stop - first, time.perf_counter() - before)
                n_done += stop - first
                budget.check()
            except BaseException as error:  # the caller's, who gets it, and not what follows from a raised flag
                is_late = budget.flag[0] or isinstance(error, (CancelledError, DeadlineExceededError))
                failures.append((n_items if is_late else first, error))
                budget.flag[0] = 1
                break
            if progress is not None or _n_calls > 1:
                break
        return n_done

    # where that is every thread of the pool, one more turn waits in its queue, so that none is idle meanwhile
    n_turns = n_workers + (n_workers >= default_workers())
    with _pool_lock:
        _n_calls += 1
    try:
        turns: set[Future[int]] = set()
        while True:
            while len(turns) < n_turns and not failures and ranges.are_left:
                turns.add(pool.submit(work))
            if not turns:
                break
            finished, turns = wait(turns, return_when=FIRST_COMPLETED)
            for future in finished:
                if progress is not None and not failures and future.result():
                    progress(future.result())
    except BaseException as error:  # of `progress`, or an interrupt: nobody waits for the threads, let them end
        failures.append((-1, error))
        budget.flag[0] = 1
        raise
    finally:
        with _pool_lock:
            _n_calls -= 1
    if failures:
        try:
            raise min(failures, key=lambda failure: failure[0])[1]
        finally:
            failures.clear()  # each leads to frames that lead here: only a search for cycles would free what they hold
