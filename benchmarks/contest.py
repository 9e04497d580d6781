"""A contest: one workload with its exact answers, put to several contenders; speed and error of each in one row.

A contender is a maker: called once (that is its build, timed), it returns `ask`, which takes the items and returns the
answers. One that cannot be imported is absent, one that raises refuses. Contenders are asked in turn, in an order that
changes from round to round; a slow one gets the first so many items only, which its row says.
"""

from __future__ import annotations

import gc
import os
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from benchmarks.load import memory_of
from benchmarks.measure import clocked

Ask = Callable[[Any], Any]
REFUSED = -9
"""In place of an answer: the contender raised an error for this item."""
PROBE = 40
"""Items of the first, untimed question; the least that a slow contender gets."""


@dataclass(frozen=True, slots=True)
class Contender:
    """One way to answer a contest."""

    name: str
    make: Callable[[], Ask]
    package: str = ""
    """The distribution whose version the report gives; empty for our own code."""
    exact_share: Callable[[], float] | None = None
    """Share of items that needed more than the filter, after an answer."""
    overhead: Callable[[], float] | None = None
    """Seconds that one call costs by itself, where each item is a call from Python."""


@dataclass(frozen=True, slots=True)
class Contest:
    """One workload."""

    operation: str
    name: str
    is_hard: bool
    items: Sequence[Any] | np.ndarray
    exact: Any
    """Answers to the first items, as many as there are; see `judge`."""
    judge: Callable[[Any, Any], dict[str, Any]]
    """``judge(answers, exact)`` counts what is wrong."""
    contenders: Sequence[Contender]
    about: str = ""


@dataclass(slots=True)
class Row:
    """What one contender did in one contest."""

    operation: str
    contest: str
    is_hard: bool
    contender: str
    package: str = ""
    absent: str = ""
    n_items: int = 0
    build: float = 0.0
    memory: int = 0
    """Bytes by which the process grew while it was built."""
    seconds: list[float] = field(default_factory=list)
    """One value a round, for `n_items`."""
    call_overhead: float = 0.0
    exact_share: float | None = None
    errors: dict[str, Any] = field(default_factory=dict)

    @property
    def rate(self) -> float:
        """Items a second at the median, gross."""
        return self.n_items / statistics.median(self.seconds) if self.seconds else 0.0

    @property
    def net_rate(self) -> float:
        """The same without what the calls themselves cost."""
        if not self.seconds:
            return 0.0
        return self.n_items / max(statistics.median(self.seconds) - self.n_items * self.call_overhead, 1e-12)


def hold(contest: Contest, rounds: int, seconds: float) -> list[Row]:
    """Return one row for each contender; each is timed for about `seconds`."""
    rows, asks = [], []
    for contender in contest.contenders:
        row = Row(contest.operation, contest.name, contest.is_hard, contender.name, contender.package)
        rows.append(row)
        asks.append(_built(contest, contender, row, seconds / rounds))
    for round_ in range(rounds):
        order = range(len(rows)) if round_ % 2 == 0 else reversed(range(len(rows)))
        for i in order:
            if asks[i] is None:
                continue
            gc.collect()
            rows[i].seconds.append(clocked(partial(asks[i], contest.items[: rows[i].n_items]))[0])
    return rows


def _built(contest: Contest, contender: Contender, row: Row, seconds: float) -> Ask | None:
    """Build a contender, ask it once, judge its answers; None if it is absent."""
    gc.collect()
    resident, before = memory_of(os.getpid()), time.perf_counter()
    try:
        ask = contender.make()
    except (ImportError, OSError) as error:
        row.absent = f"{type(error).__name__}: {error}".splitlines()[0]
        return None
    row.build = time.perf_counter() - before
    row.memory = int(max(0.0, memory_of(os.getpid()) - resident) * 2**20)
    try:
        ask(contest.items[:PROBE])  # cold: compiles, loads
        row.n_items = _how_many(ask, contest.items, seconds)
        answers = ask(contest.items[: row.n_items])
    except Exception as error:  # of a peer, for the whole batch; ours has no excuse
        if contender.name == "ours":
            raise
        row.absent = f"raised {type(error).__name__}: {error}".splitlines()[0]
        return None
    n_judged = min(row.n_items, len(contest.exact))
    row.errors = contest.judge(answers[:n_judged], contest.exact[:n_judged])
    if contender.exact_share is not None:
        row.exact_share = contender.exact_share()
    if contender.overhead is not None:
        row.call_overhead = contender.overhead()
    return ask


def _how_many(ask: Ask, items: Any, seconds: float) -> int:
    """Return how many items a contender answers in about so many seconds; some have a large cost per call."""
    n_items = PROBE
    while n_items < len(items):
        once = partial(ask, items[:n_items])
        taken = clocked(once)[0]
        if 2 * taken > seconds:  # it may have built something that later questions use
            taken = min(taken, clocked(once)[0])
        if 2 * taken > seconds:
            return n_items
        n_items = int(n_items * min(8.0, max(1.5, seconds / max(taken, 1e-9))))
    return len(items)


def same(answers: np.ndarray, exact: np.ndarray) -> dict[str, Any]:
    """Judge answers that are labels: equal or wrong."""
    answers, exact = np.asarray(answers).astype(np.int64), np.asarray(exact).astype(np.int64)
    refused = answers == REFUSED
    return {
        "judged": len(exact),
        "wrong": int(((answers != exact) & ~refused).sum()),
        "refused": int(refused.sum()),
    }


def coordinates(answers: np.ndarray, exact: np.ndarray) -> dict[str, Any]:
    """Judge rows of coordinates, NaN where nothing remains: wrong where that differs; else their errors in ulps."""
    kept, should = ~np.isnan(answers).any(axis=1), ~np.isnan(exact).any(axis=1)
    both = kept & should
    ulps = np.abs(answers[both] - exact[both]) / np.spacing(np.maximum(np.abs(exact[both]), np.finfo(float).tiny))
    values = ulps.ravel()
    return {
        "judged": len(exact),
        "wrong": int((kept != should).sum()),
        "refused": 0,
        "ulp_largest": float(values.max(initial=0.0)),
        "ulp_median": float(np.median(values)) if len(values) else 0.0,
        "ulp_histogram": np.bincount(np.minimum(np.ceil(np.log2(values + 1)).astype(int), 20), minlength=21).tolist(),
        "off": int((values > 0).sum()),
        "coordinates": len(values),
    }


AREA_TOLERANCE = 2.0**-20
"""Of the largest area of the pair: more than rounding coordinates does, less than any piece anyone would miss."""


def areas(answers: np.ndarray, exact: np.ndarray) -> dict[str, Any]:
    """Judge (area, scale) pairs: NaN is a refusal; wrong is an area off by more than `AREA_TOLERANCE` of the scale."""
    answers = np.asarray(answers, float)
    refused = np.isnan(answers)
    error = np.abs(answers - exact[:, 0]) / exact[:, 1]
    good = error[~refused & (error <= AREA_TOLERANCE)] * 2.0**53
    return {
        "judged": len(exact),
        "wrong": int((error > AREA_TOLERANCE).sum()),
        "refused": int(refused.sum()),
        "ulp_largest": float(good.max(initial=0.0)),
        "ulp_median": float(np.median(good)) if len(good) else 0.0,
    }
