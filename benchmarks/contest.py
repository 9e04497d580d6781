"""A contest: one workload with its exact answers, run by several contenders; speed and error of each in one row.

A contender is a maker: called once (that is its build, timed), it returns a `Prepared` that answers for the items. One
that cannot be imported is absent, one that raises refuses. Contenders run interleaved, in an order that changes from
round to round; a slow one is timed on the first so many items only, which its row says, but judged, outside the clock,
on as many as all others.
"""

from __future__ import annotations

import gc
import json
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from benchmarks import contenders, errors
from benchmarks.contenders import Prepared
from benchmarks.measure import LEAST_SECONDS, clocked, percentile

PROBE = 40
"""Items of the first, untimed question; the least that a slow contender gets."""
JUDGING = 30.0
"""Seconds that a slow contender may take for the items it is judged on, outside the clock."""
SIZES = (1, 10, 100)
"""Items of a question whose latency is measured by itself."""
LARGEST = 20_000
"""Characters of the largest request that is stored."""
DRAWN = 300
"""Faces or vertices of the largest body that is stored."""
QUESTIONS = 200
"""At most, for each of these sizes."""
LADDER = (1e-12, 1e-9, 1e-6)
"""By how much of the model's size hard items are moved, to see from where on a contender is right."""
RUNG = 500
"""Items that are judged on each."""
NAMED: list[str] = []
"""Contenders that no contest knows and the command names."""
LISTENERS: list[Callable[[str], None]] = []
"""Called with the next package to run, "" for our own code: a package may end the process."""
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
    setting: float | None = None
    """Of the contender's own knob; rows of one contender that differ in nothing else are a curve."""


def contender(
    spec: str, kind: str, subject: Any, threads: int = 2, goals: Goals | None = None, is_new: bool = False
) -> Contender:
    """Return a contender; spec: module[:kind][@setting]; is_new: rebuilt from the subject's arrays at each call."""
    spec, _, setting = spec.partition("@")
    module, _, own = spec.partition(":")
    build = contenders.rebuilt_each_call if is_new else contenders.make
    knob = (float(setting),) if setting else ()
    return Contender(
        contenders.shown(module, own or kind), partial(build, module, own or kind, subject, threads, *knob),
        contenders.stated(module).get("PACKAGE", ""), goals=goals or (None, None), setting=knob[0] if knob else None,
    )  # fmt: skip


def field_of(
    kind: str, subject: Any, peers: Sequence[str] | Mapping[str, Goals | None] = (), threads: int = 2, **more: Any
) -> list[Contender]:
    """Return ours and peers, with their goals where they have any; also whom the command names."""
    goals = dict.fromkeys(NAMED) | (dict(peers) if isinstance(peers, Mapping) else dict.fromkeys(peers))
    return [contender(spec, kind, subject, threads, goal, **more) for spec, goal in ({"ours": None} | goals).items()]


def two_threads(kind: str, subject: Any, goals: Goals = (1.7, 1.9)) -> list[Contender]:
    """Return ours with two threads, and with one as its contender."""
    two, one = field_of(kind, subject, (), 2)[0], field_of(kind, subject, (), 1)[0]
    return [two, replace(one, name="ours, one thread", goals=goals)]


def refusing(ask: Callable[[Any], Any], item: Any, refusal: Any = errors.REFUSED) -> Any:
    """Return the answer for one item; any error of a peer is a refusal, NotApplicable is out of its domain."""
    try:
        return ask(item)
    except contenders.NotApplicable:
        return errors.OUTSIDE if refusal == errors.REFUSED else refusal
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
    """Answers to the first items, as many as there are (see `judge`); or a function that answers the items with given
    numbers, for those on which contenders differ and a sample of others; or None: nothing is judged."""
    judge: Callable[[Any, Any], dict[str, Any]]
    """``judge(answers, exact)`` counts what is wrong; `worst` names the worst, or the equally bad."""
    contenders: Sequence[Contender]
    about: str = ""
    n_sample: int = 20
    """Number of items on which all agree that are judged."""
    most: int = 200
    """Largest number of items on which contenders differ that are judged."""
    count: int = 0
    """How many questions the items stand for, where they are not one each; such items are never cut short."""
    request: Callable[[int], tuple[str, dict[str, Any]]] | None = None
    """Path and body that ask the service about the item with a number."""
    moved: Callable[[float], tuple[Any, Any]] | None = None
    """Items of a hard contest moved by so much of the model's size in random directions, and their exact answers."""
    near: float | None = None
    """How far the hard items are from the boundary: the median, of the model's size."""


class Task(NamedTuple):
    """A row of a table before it is made: a contest, or a figure."""

    name: str
    make: Callable[[], Any]
    is_on_page: bool = False
    is_figure: bool = False


@dataclass(frozen=True, slots=True)
class Size:
    """Scale of the workloads: 1.0 for the record, less for a quick run."""

    seed: int
    scale: float = 1.0

    @property
    def is_quick(self) -> bool:
        """Whether only small subjects are used."""
        return self.scale < 0.3

    def of(self, full: Any, quick: Any) -> Any:
        """Return one of two sizes."""
        return quick if self.is_quick else full

    def n(self, full: int, least: int = 20) -> int:
        """Return so many items, fewer if quick."""
        return max(min(least, full), int(full * self.scale))


@dataclass(slots=True)
class Row:
    """Result of one contender in one contest."""

    operation: str
    contest: str
    is_hard: bool
    contender: str
    package: str = ""
    setting: float | None = None
    about: str = ""
    absent: str = ""
    n_items: int = 0
    build: float = 0.0
    seconds: list[float] = field(default_factory=list)
    """One value a round, for `n_items`."""
    cpu: list[float] = field(default_factory=list)
    """The same by CPU time of all threads."""
    cold: float = 0.0
    """Seconds of the first question, of `PROBE` items."""
    first: float | None = None
    """Seconds of a fresh build and a question of one item, kernels loaded."""
    latency: dict[str, list[float]] = field(default_factory=dict)
    """By the number of items: median, 99th percentile, largest seconds of a question, and number of questions."""
    method: str = ""
    goals: Goals = (None, None)
    call_overhead: float = 0.0
    exact_share: float | None = None
    errors: dict[str, Any] = field(default_factory=dict)
    near: float | None = None
    """As of the contest."""
    ladder: dict[str, dict[str, int]] = field(default_factory=dict)
    """By how much items were moved: how many were judged, wrong, refused and not taken."""
    worst: dict[str, Any] = field(default_factory=dict)
    """The worst answer that is wrong: number of the item, answer, exact answer, path and body of the request."""

    @property
    def rate(self) -> float:
        """Items a second at the median, gross."""
        return self.n_items / statistics.median(self.seconds) if self.seconds else 0.0

    @property
    def net_rate(self) -> float:
        """The same without the overhead of the calls."""
        if not self.seconds:
            return 0.0
        return self.n_items / max(statistics.median(self.seconds) - self.n_items * self.call_overhead, 1e-12)


@dataclass(slots=True)
class _Entry:
    """A contender that answers."""

    row: Row
    contender: Contender
    prepared: Prepared
    items: Any
    answers: Any
    times: int
    taken: float


def run_contest(contest: Contest, rounds: int, seconds: float, has_latency: bool = False) -> list[Row]:
    """Run a contest; return one row for each contender, each timed for about `seconds`."""
    rows, entries = [], []
    for each in contest.contenders:
        row = Row(contest.operation, contest.name, contest.is_hard, each.name, each.package, each.setting,
                  contest.about, goals=each.goals, near=contest.near)  # fmt: skip
        rows.append(row)
        _announce(row)
        if (entry := _entered(contest, each, row, seconds / rounds)) is not None:
            entries.append(entry)
    _judge(contest, entries)
    if contest.moved is not None and has_latency:
        _climb(contest, entries)
    gc.collect()
    gc.freeze()  # existing objects are not collected again at every turn
    for round_ in range(rounds):
        for entry in entries if round_ % 2 == 0 else reversed(entries):
            gc.collect()
            _announce(entry.row)
            wall, cpu, _ = clocked(partial(_repeat, entry))
            entry.row.seconds.append(wall / entry.times)
            entry.row.cpu.append(cpu / entry.times)
    gc.unfreeze()
    if has_latency and not contest.count:
        for entry in entries:
            _announce(entry.row)
            _ask_few(contest, entry, seconds / 8)
    return rows


def _announce(row: Row) -> None:
    for listener in LISTENERS:
        listener(row.contender if row.package else "")


def _repeat(entry: _Entry) -> None:
    for _ in range(entry.times):
        entry.prepared.ask(entry.items)


def _entered(contest: Contest, each: Contender, row: Row, seconds: float) -> _Entry | None:
    """Build a contender and run it until it is warm; None if it is absent or refuses, which is an error for ours."""
    gc.collect()
    before = time.perf_counter()
    try:
        prepared = each.make()
        row.build = time.perf_counter() - before
        probe = contest.items if contest.count else contest.items[:PROBE]
        row.cold = clocked(partial(prepared.ask, prepared.native(probe)))[0]
        row.n_items = contest.count or _how_many(prepared, contest.items, seconds)
        items = prepared.native(contest.items if contest.count else contest.items[: row.n_items])
        settle(prepared, items)
        taken, _, result = clocked(partial(prepared.ask, items))
        answers = prepared.answer(result)
        row.method = prepared.method() if prepared.method else ""
        row.exact_share = prepared.share() if prepared.share else None
        row.call_overhead = each.overhead() if each.overhead else 0.0
    except Exception as error:
        if each.name == "ours":
            raise
        how = "" if isinstance(error, ImportError | OSError) else "raised "
        row.absent = f"{how}{contenders.said_by(error)}"
        if isinstance(error, contenders.NotApplicable):
            row.absent = f"not asked: {error}"
        return None
    return _Entry(row, each, prepared, items, answers, max(1, int(LEAST_SECONDS / max(taken, 1e-7))), taken)


def settle(prepared: Prepared, items: Any) -> None:
    """Run until the method no longer changes: structures that amortise only after many questions are then built."""
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
    """Return how many items a contender answers in about so many seconds; some have a large overhead per call."""
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


def _ask_few(contest: Contest, entry: _Entry, seconds: float) -> None:
    """Measure questions of few items, each of other items, and the first question of a fresh build."""
    for size in SIZES:
        if size > len(contest.items):
            break
        starts = np.linspace(0, len(contest.items) - size, QUESTIONS).astype(int)
        took: list[float] = []
        for start in starts:
            queried = entry.prepared.native(contest.items[start : start + size])
            took.append(clocked(partial(entry.prepared.ask, queried))[0])
            if sum(took) > seconds and len(took) >= 10:
                break
        row = [statistics.median(took), percentile(took, 0.99), max(took), len(took)]
        entry.row.latency[str(size)] = row
    if entry.row.build < seconds:
        made: list[Prepared] = []
        start = clocked(lambda: made.append(entry.contender.make()))[0]
        entry.row.first = start + clocked(partial(made[0].ask, made[0].native(contest.items[:1])))[0]


def _judge(contest: Contest, entries: list[_Entry]) -> None:
    """Judge all contenders by the exact answers, or by those for differing items and a sample; all on the same
    items."""
    if contest.exact is None or callable(contest.exact):
        _judge_differing(contest, entries)
        return
    for entry in entries:
        answers, n_items = entry.answers, len(contest.exact)
        if n_items > entry.row.n_items and not contest.count:
            n_items = min(n_items, max(entry.row.n_items, int(JUDGING * entry.row.n_items / max(entry.taken, 1e-9))))
            _announce(entry.row)
            answers = entry.prepared.answer(entry.prepared.ask(entry.prepared.native(contest.items[:n_items])))
        _note(contest, entry, answers[:n_items], contest.exact[:n_items], np.arange(n_items))


def _climb(contest: Contest, entries: list[_Entry]) -> None:
    """Judge all contenders on hard items that were moved away, step by step; outside the clock."""
    assert contest.moved is not None
    for step in LADDER:
        items, exact = contest.moved(step)
        for entry in entries:
            _announce(entry.row)
            asked, taken = entry.prepared, entry.taken / max(entry.row.n_items, 1)
            n_items = min(len(exact), max(PROBE, int(JUDGING / 3 / max(taken, 1e-9))))
            answers = asked.answer(asked.ask(asked.native(items[:n_items])))
            found = contest.judge(answers, exact[:n_items])
            entry.row.ladder[f"{step:g}"] = {
                key: found.get(key, 0) for key in ("judged", "wrong", "refused", "outside")
            }


def _note(contest: Contest, entry: _Entry, answers: Any, exact: Any, rows: np.ndarray) -> None:
    """Judge a contender; store the worst of its answers."""
    result = contest.judge(answers, exact)
    worst = np.atleast_1d(result.pop("worst", [])).astype(int).tolist()
    entry.row.errors = result
    for place in worst:  # until one is small enough to be shown
        item = int(rows[place])
        entry.row.worst = {"item": item, "answer": errors.plain(answers[place]), "exact": errors.plain(exact[place])}
        if contest.request is None:
            break
        path, body = contest.request(item)
        is_small = len(json.dumps(body)) <= LARGEST
        entry.row.worst["request"] = (path, body if is_small else None)
        if is_small:
            entry.row.worst.pop("sketch", None)
            break
        entry.row.worst["sketch"] = sketch(body)


def sketch(value: Any) -> Any:
    """Return a body too large to be stored as one that can be drawn: some of its faces and vertices."""
    if isinstance(value, list):
        return [sketch(each) for each in value[:DRAWN]]
    if not isinstance(value, dict):
        return value
    if "faces" in value:
        faces = value["faces"][:: 1 + len(value["faces"]) // DRAWN]
        used = sorted({vertex for face in faces for vertex in face})
        numbers = {vertex: number for number, vertex in enumerate(used)}
        corners = [[float(f"{x:.6g}") for x in value["vertices"][vertex]] for vertex in used]
        return {
            "type": value["type"],
            "vertices": corners,
            "faces": [[numbers[each] for each in face] for face in faces],
        }
    if "rings" in value:
        return value | {"rings": [ring[:: 1 + len(ring) // DRAWN] for ring in value["rings"]]}
    return {key: sketch(each) for key, each in value.items()}


def _judge_differing(contest: Contest, entries: list[_Entry]) -> None:
    answered = [entry for entry in entries if entry.answers is not None]
    if len(answered) < 1 + (contest.exact is None):
        return
    n_items = min(len(entry.answers) for entry in answered)
    differs = np.zeros(n_items, bool)
    first = np.asarray(answered[0].answers[:n_items])
    for entry in answered[1:]:
        other = np.asarray(entry.answers[:n_items])
        differs |= ((first != other) & ~((first != first) & (other != other))).reshape(n_items, -1).any(axis=1)
    chosen = np.flatnonzero(differs)[: contest.most]
    sample = np.random.default_rng(0).choice(n_items, min(contest.n_sample, n_items), replace=False)
    chosen = np.union1d(chosen, sample)
    exact = None if contest.exact is None or errors.REASON else contest.exact(chosen)
    for entry in answered:
        if exact is not None:
            _note(contest, entry, np.asarray(entry.answers)[chosen], exact, chosen)
        entry.row.errors["differ"] = int(differs.sum())


def run_of_ours(contest: Contest) -> Callable[[], Any]:
    """Return the timed question of ours, warm: for comparing two checkouts of the engine."""
    prepared = next(each for each in contest.contenders if each.name == "ours").make()
    items = prepared.native(contest.items)
    settle(prepared, items)
    return partial(prepared.ask, items)
