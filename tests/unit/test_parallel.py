"""The chunking pool: every item once, whatever the workers; deadline, cancel, errors, forked children."""

from __future__ import annotations

import gc
import multiprocessing
import threading
import time
import weakref

import numpy as np
import pytest

from engine.errors import CancelledError, DeadlineExceededError, InvalidInputError
from engine.running import parallel
from engine.running.budget import Budget, Cancel
from engine.running.parallel import check_options, is_unlimited, run_chunks


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
            time.sleep(1e-5 * (stop - start))
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
    with Budget() as budget:
        run_chunks(lambda *_: seen.add(threading.get_ident()), 10_000, budget=budget, first_chunk=100, workers=2)
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
