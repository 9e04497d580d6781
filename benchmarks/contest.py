"""A contest: one workload with its exact answers, put to several contenders; speed and error of each in one row.

A contender is a maker: called once (that is its build, timed), it returns a `Prepared` that answers for the items. One
that cannot be imported is absent, one that raises refuses. Contenders are asked in turn, in an order that changes from
round to round; a slow one gets the first so many items only, which its row says.
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

from benchmarks import contenders, errors
from benchmarks.contenders import Prepared
from benchmarks.errors import REFUSED
from benchmarks.load import memory_of
from benchmarks.measure import LEAST_SECONDS, clocked

PROBE = 40
"""Items of the first, untimed question; the least that a slow contender gets."""
Goals = tuple[float | None, float | None]
"""What the ratio against a peer must be, and what it aims at."""


@dataclass(frozen=True, slots=True)
class Contender:
    """One way to answer a contest."""

    name: str
    make: Callable[[], Prepared]
    package: str = ""
    """The distribution whose version the report gives; empty for our own code."""
    overhead: Callable[[], float] | None = None
    """Seconds that one call costs by itself, where each item is a call from Python."""
    goals: Goals = (None, None)


def contender(
    name: str, module: str, kind: str, subject: Any, threads: int = 2, goals: Goals = (None, None), is_new: bool = False
) -> Contender:
    """Return the contender of a module for a kind of question; is_new: from the subject's arrays at every question."""
    build = contenders.anew if is_new else contenders.make
    package = contenders.PACKAGES.get(module, "")
    return Contender(name, partial(build, module, kind, subject, threads), package, goals=goals)


def refusing(ask: Callable[[Any], Any], item: Any, refusal: Any = REFUSED) -> Any:
    """Return the answer for one item; whatever a peer raises is a refusal."""
    try:
        return ask(item)
    except Exception:
        return refusal


@dataclass(frozen=True, slots=True)
class Contest:
    """One workload."""

    operation: str
    name: str
    is_hard: bool
    items: Any
    exact: Any
    """Answers to the first items, as many as there are (see `judge`); or what settles the items with given numbers, to
    be asked about those on which contenders differ and some others; or None: nothing is judged."""
    judge: Callable[[Any, Any], dict[str, Any]]
    """``judge(answers, exact)`` counts what is wrong."""
    contenders: Sequence[Contender]
    about: str = ""
    n_sample: int = 20
    """Of items that are settled though all agree."""
    most: int = 200
    """Of items on which contenders differ."""
    count: int = 0
    """How many questions the items stand for, where they are not one each; such items are never cut short."""


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
    cpu: list[float] = field(default_factory=list)
    """The same by CPU time of all threads."""
    cold: float = 0.0
    """Seconds of the first question."""
    method: str = ""
    goals: Goals = (None, None)
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


@dataclass(slots=True)
class _Entry:
    """A contender that answers."""

    row: Row
    prepared: Prepared
    items: Any
    answers: Any
    times: int


def hold(contest: Contest, rounds: int, seconds: float) -> list[Row]:
    """Return one row for each contender; each is timed for about `seconds`."""
    rows, entries = [], []
    for each in contest.contenders:
        row = Row(contest.operation, contest.name, contest.is_hard, each.name, each.package, goals=each.goals)
        rows.append(row)
        if (prepared := _built(each, row)) is not None:
            if (entry := _asked(contest, each, row, prepared, seconds / rounds)) is not None:
                entries.append(entry)
    _judge(contest, entries)
    for round_ in range(rounds):
        for entry in entries if round_ % 2 == 0 else reversed(entries):
            gc.collect()
            wall, cpu, _ = clocked(partial(_repeat, entry))
            entry.row.seconds.append(wall / entry.times)
            entry.row.cpu.append(cpu / entry.times)
    return rows


def _repeat(entry: _Entry) -> None:
    for _ in range(entry.times):
        entry.prepared.ask(entry.items)


def _built(each: Contender, row: Row) -> Prepared | None:
    """Build a contender; None if it is absent."""
    gc.collect()
    resident, before = memory_of(os.getpid()), time.perf_counter()
    try:
        prepared = each.make()
    except (ImportError, OSError) as error:
        row.absent = f"{type(error).__name__}: {error}".splitlines()[0]
        return None
    row.build = time.perf_counter() - before
    row.memory = int(max(0.0, memory_of(os.getpid()) - resident) * 2**20)
    return prepared


def _asked(contest: Contest, each: Contender, row: Row, prepared: Prepared, seconds: float) -> _Entry | None:
    """Ask a contender until it is warm; None if it refuses the whole batch, for which ours has no excuse."""
    try:
        if contest.count:
            row.n_items, items = contest.count, prepared.native(contest.items)
            row.cold = clocked(partial(prepared.ask, items))[0]
        else:
            row.cold = clocked(partial(prepared.ask, prepared.native(contest.items[:PROBE])))[0]
            row.n_items = _how_many(prepared, contest.items, seconds)
            items = prepared.native(contest.items[: row.n_items])
        settle(prepared, items)
        taken, _, found = clocked(partial(prepared.ask, items))
        answers = prepared.answer(found)
        row.method = prepared.method() if prepared.method else ""
        if prepared.share is not None:
            row.exact_share = prepared.share()
        if each.overhead is not None:
            row.call_overhead = each.overhead()
    except Exception as error:
        if each.name == "ours":
            raise
        row.absent = f"raised {type(error).__name__}: {error}".splitlines()[0]
        return None
    return _Entry(row, prepared, items, answers, max(1, int(LEAST_SECONDS / max(taken, 1e-7))))


def settle(prepared: Prepared, items: Any) -> None:
    """Ask until the method no longer changes: structures that pay only after many questions are then there."""
    if prepared.method is None and prepared.memory is None:
        return
    before = None
    for number in range(12):
        prepared.ask(items)
        now = (prepared.method() if prepared.method else "", prepared.memory() if prepared.memory else 0)
        if now == before and number >= 3:
            return
        before = now


def _how_many(prepared: Prepared, items: Any, seconds: float) -> int:
    """Return how many items a contender answers in about so many seconds; some have a large cost per call."""
    n_items = PROBE
    while n_items < len(items):
        once = partial(prepared.ask, prepared.native(items[:n_items]))
        taken = clocked(once)[0]
        if 2 * taken > seconds:  # it may have built something that later questions use
            taken = min(taken, clocked(once)[0])
        if 2 * taken > seconds:
            return n_items
        n_items = int(n_items * min(8.0, max(1.5, seconds / max(taken, 1e-9))))
    return len(items)


def _judge(contest: Contest, entries: list[_Entry]) -> None:
    """Judge the first items against their exact answers, or what contenders differ on and a sample of the rest."""
    if contest.exact is not None and not callable(contest.exact):
        for entry in entries:
            n_judged = min(entry.row.n_items, len(contest.exact))
            entry.row.errors = contest.judge(entry.answers[:n_judged], contest.exact[:n_judged])
        return
    told = [entry for entry in entries if entry.answers is not None]
    if len(told) < 1 + (contest.exact is None):
        return
    n_items = min(len(entry.answers) for entry in told)
    differs = np.zeros(n_items, bool)
    first = np.asarray(told[0].answers[:n_items])
    for entry in told[1:]:
        other = np.asarray(entry.answers[:n_items])
        differs |= ((first != other) & ~((first != first) & (other != other))).reshape(n_items, -1).any(axis=1)
    chosen = np.flatnonzero(differs)[: contest.most]
    sample = np.random.default_rng(0).choice(n_items, min(contest.n_sample, n_items), replace=False)
    chosen = np.union1d(chosen, sample)
    exact = None if contest.exact is None or errors.REASON else contest.exact(chosen)
    for entry in told:
        if exact is not None:
            entry.row.errors = contest.judge(np.asarray(entry.answers)[chosen], exact)
        entry.row.errors["differ"] = int(differs.sum())


def run_of_ours(contest: Contest) -> Callable[[], Any]:
    """Return the question that ours is timed on, warm: for two checkouts of the engine side by side."""
    prepared = next(each for each in contest.contenders if each.name == "ours").make()
    items = prepared.native(contest.items)
    settle(prepared, items)
    return partial(prepared.ask, items)
