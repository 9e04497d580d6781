"""The chunking pool: every item once, whatever the workers; deadline, cancel, errors, forked children; the policy by
simulation, without a clock."""

from __future__ import annotations

import gc
import multiprocessing
import threading
import time
import weakref
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks.simulated_cores import makespan
from engine.errors import CancelledError, DeadlineExceededError, InvalidInputError
from engine.running import parallel
from engine.running.budget import Budget, Cancel
from engine.running.joining import join_columns
from engine.running.parallel import Ranges, check_options, is_unlimited, run_chunks, threads_that_pay


@pytest.mark.parametrize("workers", [1, 2, 5, None])
@pytest.mark.parametrize("n_items", [0, 1, 7, 100_000])
def test_every_item_is_done_once(workers: int | None, n_items: int) -> None:
    times_done, reported = np.zeros(n_items, np.int64), []

    def task(start: int, stop: int) -> None:
        times_done[start:stop] += 1

    with Budget() as budget:
        run_chunks(task, n_items, budget=budget, first_chunk=10, workers=workers, progress=reported.append)
    assert (times_done == 1).all()
    assert sum(reported) == n_items


def test_a_chunk_that_waits_for_the_flag_ends_at_the_deadline() -> None:
    def task(_start: int, _stop: int) -> None:
        while not budget.flag[0]:
            time.sleep(0.001)

    with Budget(deadline=0.05) as budget, pytest.raises(DeadlineExceededError, match=r"0\.05"):
        run_chunks(task, 10, budget=budget, first_chunk=1)
    assert budget.flag[0] == 1


def test_a_deadline_of_zero_does_no_work() -> None:
    with Budget(deadline=0.0) as budget, pytest.raises(DeadlineExceededError):
        run_chunks(lambda *_: pytest.fail("worked"), 10, budget=budget)


def test_the_deadline_that_passed_is_named_as_it_was_given() -> None:
    """Not what was left of it for a call within the call; one of its own that ends before is."""
    with Budget(0.01) as budget:
        time.sleep(0.02)
        with Budget(budget.left()) as inner, pytest.raises(DeadlineExceededError, match=r"of 0\.01 s"):
            inner.check()
    with Budget(60.0), Budget(0.0) as first, pytest.raises(DeadlineExceededError, match=r"of 0\.0 s"):
        first.check()


@pytest.mark.parametrize("workers", [1, 2])
def test_another_thread_can_cancel(workers: int) -> None:
    cancel = Cancel()

    def task(_start: int, _stop: int) -> None:
        while not budget.flag[0]:
            time.sleep(0.001)

    threading.Timer(0.02, cancel.set).start()
    with Budget(cancel=cancel) as budget, pytest.raises(CancelledError):
        run_chunks(task, 10, budget=budget, first_chunk=1, workers=workers)


def test_a_cancel_thrown_before_the_call_counts() -> None:
    cancel = Cancel()
    cancel.set()
    with Budget(cancel=cancel) as budget, pytest.raises(CancelledError):
        run_chunks(lambda *_: None, 10, budget=budget)
    assert budget.flag[0] == 1


@pytest.mark.parametrize("workers", [1, 3])
def test_an_error_in_a_chunk_reaches_the_caller(workers: int) -> None:
    def task(start: int, _stop: int) -> None:
        if start >= 50:
            raise ZeroDivisionError(start)

    with Budget() as budget, pytest.raises(ZeroDivisionError):
        run_chunks(task, 100_000, budget=budget, first_chunk=10, workers=workers)


@pytest.mark.parametrize("has_progress", [False, True])
def test_two_calls_take_fair_turns(has_progress: bool) -> None:
    """A thread that goes from chunk to chunk by itself lets a later, shorter call have its turns."""
    done: dict[str, list[int]] = {"long": [], "short": []}

    def run(name: str, n_items: int) -> None:
        def task(start: int, stop: int) -> None:
            end = time.thread_time() + 1e-5 * (stop - start)  # chunks are sized by CPU time
            while time.thread_time() < end:
                pass
            done[name].append(stop - start)

        reported: list[int] = []
        with Budget() as budget:
            progress = reported.append if has_progress else None
            run_chunks(task, n_items, budget=budget, first_chunk=100, workers=4, progress=progress)
        assert sum(done[name]) == n_items
        assert sum(reported) == (n_items if has_progress else 0)

    long = threading.Thread(target=run, args=("long", 60_000))
    long.start()
    while sum(done["long"]) < 2_000:
        time.sleep(0.001)
    before = sum(done["long"])
    run("short", 2_000)
    meanwhile = sum(done["long"]) - before
    long.join()
    assert sum(done["long"]) == 60_000
    assert meanwhile < 10 * 2_000


@pytest.mark.parametrize("is_progress", [False, True])
def test_threads_end_soon_after_an_error(is_progress: bool) -> None:
    """Nobody waits for them where the error is the progress bar's; they must not go on through the batch."""
    n_begun: list[int] = []

    def task(start: int, _stop: int) -> None:
        n_begun.append(start)
        time.sleep(0.001)
        if not is_progress and start > 100:
            raise ZeroDivisionError

    def progress(_n_items: int) -> None:
        if is_progress and len(n_begun) > 3:
            raise ZeroDivisionError

    with Budget() as budget, pytest.raises(ZeroDivisionError):
        run_chunks(task, 10**9, budget=budget, first_chunk=1, workers=2, progress=progress)
    for _ in range(100):  # bound: a thread may be late by itself, on a busy machine, but not go on
        n_then = len(n_begun)
        time.sleep(0.05)
        if len(n_begun) == n_then:
            return
    raise AssertionError(f"{len(n_begun)} chunks were begun")


@pytest.mark.parametrize(("seconds", "is_alone"), [(60.0, True), (1e-9, False)])
def test_what_takes_less_than_a_chunk_stays_in_the_calling_thread(
    monkeypatch: pytest.MonkeyPatch, seconds: float, is_alone: bool
) -> None:
    monkeypatch.setattr(parallel, "CHUNK_SECONDS", seconds)
    seen: set[int] = set()

    def task(_start: int, _stop: int) -> None:
        seen.add(threading.get_ident())
        time.sleep(0.002)  # or the calling thread does all before another has begun

    with Budget() as budget:
        run_chunks(task, 10_000, budget=budget, first_chunk=100, workers=2)
    assert (seen == {threading.get_ident()}) is is_alone


def test_workers_must_be_positive() -> None:
    with Budget() as budget, pytest.raises(ValueError, match="at least 1"):
        run_chunks(lambda *_: None, 1, budget=budget, workers=0)


def _sum_in_chunks(n_items: int) -> int:
    out = np.zeros(n_items, np.int64)

    def task(start: int, stop: int) -> None:
        out[start:stop] = np.arange(start, stop)

    with Budget() as budget:
        run_chunks(task, n_items, budget=budget, first_chunk=10, workers=2)
    return int(out.sum())


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # Python 3.12 warns of every fork beside threads
def test_a_forked_child_gets_a_pool_of_its_own() -> None:
    expected = _sum_in_chunks(50_000)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply_async(_sum_in_chunks, (50_000,)).get(timeout=300) == expected


def test_other_options_of_the_wrong_type_are_refused() -> None:
    with pytest.raises(InvalidInputError, match="cancel must be"):
        Budget(cancel=threading.Event())  # type: ignore[arg-type] # the case
    for workers in (0, -1, True, 1.5, "2", float("nan")):
        with pytest.raises(InvalidInputError, match="workers must be at least 1"):
            check_options(workers, None)
    with pytest.raises(InvalidInputError, match="progress must be callable"):
        check_options(None, 3)


def test_a_raised_flag_never_passes_for_a_finished_call() -> None:
    """A clock that steps back must not let answers through that kernels left incomplete."""
    with Budget(deadline=100.0) as budget:
        budget.flag[0] = 1
        with pytest.raises(DeadlineExceededError):
            budget.check()


def test_the_error_that_raised_the_flag_reaches_the_caller() -> None:
    """Not what an earlier chunk says that saw the flag and gave up."""
    is_at_work = threading.Event()

    def task(start: int, _stop: int) -> None:
        if start == 0:
            time.sleep(0.01)  # the others are worth a thread each
        elif start == 1:
            is_at_work.set()
            while not budget.flag[0]:
                time.sleep(0.001)
            budget.check()
        else:
            is_at_work.wait()
            raise KeyError(start)

    with Budget() as budget, pytest.raises(KeyError):
        run_chunks(task, 3, budget=budget, first_chunk=1, workers=2)


@pytest.mark.parametrize("is_cancelled", [False, True])
def test_the_budget_of_a_call_outlives_an_error_in_a_thread(is_cancelled: bool) -> None:
    """Who handles the error goes on under the same budget: it has neither been cancelled nor passed its deadline."""
    cancel = Cancel()

    def task(start: int, _stop: int) -> None:
        if is_cancelled:
            cancel.set()
        raise ValueError(start)

    with Budget(60.0, cancel) as budget:
        with pytest.raises(ValueError, match=r"^\d+$"):  # whichever failed before the flag was up
            run_chunks(task, 100, budget=budget, first_chunk=1, workers=4, pace=0.001)
        assert budget.flag[0] == is_cancelled
        if is_cancelled:
            with pytest.raises(CancelledError):
                budget.check()
        else:
            budget.check()


def test_an_error_leaves_nothing_that_only_a_search_for_cycles_finds() -> None:
    held = np.zeros(1)
    gone = weakref.ref(held)

    def work(held: np.ndarray) -> None:
        def task(start: int, stop: int) -> None:
            time.sleep(0.003)
            if start > 0:  # the first is done by the calling thread
                raise ValueError(held)

        with Budget() as budget:
            run_chunks(task, 10, budget=budget, first_chunk=1, workers=2)

    gc.disable()
    try:
        with pytest.raises(ValueError, match="0"):
            work(held)
        del held
        for _ in range(400):  # the thread that failed may be about to end
            if gone() is None:
                break
            time.sleep(0.005)
        assert gone() is None
    finally:
        gc.enable()


@pytest.mark.parametrize(
    ("workers", "is_any"), [(None, True), (1, True), (8, True), (0, False), (True, False), ("1", False)]
)
def test_what_may_be_answered_at_once(workers: object, is_any: bool) -> None:
    assert is_unlimited(workers, None, None, None) is is_any
    assert not is_unlimited(workers, 1.0, None, None)
    assert not is_unlimited(workers, None, Cancel(), None)
    assert not is_unlimited(workers, None, None, print)


def _simulate(n_cores: int, n_items: int, pace: Callable[[int], float], lock_seconds: float) -> tuple[float, int]:
    """Return the makespan, and the number of chunks, of a batch on so many cores with one interpreter lock.

    pace: seconds of kernel by item, constant in each thousandth of the batch. lock_seconds: held for each chunk.
    """
    costs = np.array([pace(k * n_items // 1000) for k in range(1000)])
    summed = np.concatenate([[0.0], np.cumsum(costs * (n_items / 1000))])
    cost_up_to = lambda item: float(np.interp(item * 1000 / n_items, np.arange(1001), summed))  # noqa: E731
    ranges = Ranges(0, n_items, pace(0), threads_that_pay(n_items * pace(0), n_cores))
    n_chunks = n_done = 0

    def run(first: int, stop: int) -> float:
        nonlocal n_chunks, n_done
        assert first == n_done
        n_done, n_chunks = stop, n_chunks + 1
        seconds = cost_up_to(stop) - cost_up_to(first)
        ranges.took(stop - first, seconds + lock_seconds)
        return seconds

    end = makespan(ranges, run, lock_seconds)
    assert n_done == n_items
    return end, n_chunks


@pytest.mark.parametrize("n_cores", [2, 8, 32, 64])
@pytest.mark.parametrize(
    "pace",
    [lambda _: 1e-7, lambda k: 2e-8 if k < 500_000 else 2e-7, lambda k: 2e-7 if k < 100_000 else 2e-8],
    ids=["even", "slow_end", "slow_start"],
)
def test_simulated_threads_share_work_evenly_and_hold_the_lock_seldom(
    n_cores: int, pace: Callable[[int], float]
) -> None:
    n_items = 1_000_000 * n_cores
    one = sum(pace(k * n_items // 1000) for k in range(1000)) * n_items / 1000
    end, n_chunks = _simulate(n_cores, n_items, pace, lock_seconds=60e-6)
    assert end < 1.25 * one / n_cores + n_cores * 50e-6 + 0.01  # a chunk at the end
    assert n_chunks * 60e-6 < 0.4 * end + 60e-6 * 3 * n_cores  # nobody waits long for the lock


@pytest.mark.parametrize("n_cores", [2, 8, 32, 64])
def test_simulated_small_work_is_never_slower_than_one_thread(n_cores: int) -> None:
    for milliseconds in (4, 6, 10, 20, 50):
        n_items = 10_000 * milliseconds
        end, _ = _simulate(n_cores, n_items, lambda _: 1e-7, lock_seconds=60e-6)
        assert end < 1e-3 * milliseconds


@pytest.mark.parametrize(
    ("files", "groups", "cores"),
    [
        ({"cpu.max": "max 100000"}, "0::/", None),
        ({"cpu.max": "150000 100000"}, "0::/", 2),
        ({"cpu.max": "max 100000", "a/cpu.max": "400000 100000", "a/b/cpu.max": "max 100000"}, "0::/a/b", 4),
        ({"cpu/box/cpu.cfs_quota_us": "300000", "cpu/box/cpu.cfs_period_us": "100000"}, "4:cpu,cpuacct:/box", 3),
        ({"cpu/cpu.cfs_quota_us": "-1", "cpu/cpu.cfs_period_us": "100000"}, "4:cpu,cpuacct:/", None),
        ({"cpu.max": "nonsense"}, "0::/", None),
        ({}, "", None),
    ],
)
def test_a_quota_of_the_container_counts_as_cores(
    tmp_path: Path, files: dict[str, str], groups: str, cores: int | None
) -> None:
    for name, text in files.items():
        (tmp_path / "cgroup" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "cgroup" / name).write_text(text + "\n")
    (tmp_path / "own").write_text(groups + "\n")
    assert parallel._quota.__wrapped__(tmp_path / "cgroup", tmp_path / "own") == cores


@pytest.mark.parametrize("workers", [1, 2, 3, 16])
def test_columns_join_as_numpy_concatenates(workers: int) -> None:
    rng = np.random.default_rng(4)
    parts = [(rng.random((n, 3)), rng.random((2, n, 3)), rng.integers(0, 9, n)) for n in (7, 0, 60_000, 1, 90_000)]
    joined = join_columns(parts, Budget(), workers, (0, 1, 0))
    for array, column, axis in zip(joined, zip(*parts), (0, 1, 0), strict=True):
        expected = np.concatenate(column, axis)
        assert array.dtype == expected.dtype
        assert np.array_equal(array, expected)
