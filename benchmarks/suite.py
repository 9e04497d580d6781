"""A suite of rows: measures them one by one, prints each as it is done, writes them with all they depend on as JSON.

A row is one figure of one workload: a ratio against a peer, or a time or a size of ours, with what it must be and what
it aims at. Speed and error stand in the same row.
"""

from __future__ import annotations

import argparse
import gc
import json
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import errors, machine
from benchmarks.contenders import Absent, Prepared, load
from benchmarks.measure import clocked, interleaved, ratios, spread
from benchmarks.workloads import MissingDataError

RESULTS = Path(__file__).resolve().parent / "results"


@dataclass(slots=True)
class Row:
    """One line of the table."""

    name: str
    unit: str
    """x (ratio: larger is better), s, MB or wrong (smaller is better)."""
    must: float | None = None
    aim: float | None = None
    value: float | None = None
    low: float | None = None
    high: float | None = None
    """Quartiles."""
    cpu_value: float | None = None
    """The same by CPU time."""
    ours: str = ""
    peer: str = ""
    """Speed of each in short: million items a second."""
    error: str = ""
    note: str = ""
    raw: dict[str, Any] = field(default_factory=dict)

    @property
    def verdict(self) -> str:
        """`aim`, `must`, `MISS` or, where there is no figure or no goal, nothing."""
        if self.value is None or self.must is None:
            return ""
        sign = 1 if self.unit == "x" else -1
        if self.aim is not None and sign * self.value >= sign * self.aim:
            return "aim"
        return "must" if sign * self.value >= sign * self.must else "MISS"


@dataclass(frozen=True, slots=True)
class Options:
    """What the command line says."""

    quick: bool
    rounds: int
    seconds: float
    """Of measuring a row, after which it ends with fewer rounds."""
    threads: int
    seed: int
    only: str
    write: bool

    @property
    def n_points(self) -> int:
        return 100_000 if self.quick else 1_000_000


def options(words: list[str] | None, description: str) -> Options:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--quick", action="store_true", help="small sizes and few rounds: about a minute")
    parser.add_argument("--rounds", type=int, help="interleaved rounds a row (15; quick: 5)")
    parser.add_argument("--seconds", type=float, default=20.0, help="of rounds a row, three rounds at least (20)")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", metavar="WORD", help="only rows whose name contains WORD")
    parser.add_argument("--dry", action="store_true", help="write no results file")
    given = parser.parse_args(words)
    rounds = given.rounds or (5 if given.quick else 15)
    write = not (given.dry or given.quick or given.only)
    return Options(given.quick, rounds, given.seconds, given.threads, given.seed, given.only, write)


class Suite:
    """Measures rows and keeps them."""

    def __init__(self, name: str, chosen: Options) -> None:
        self.name, self.options = name, chosen
        self.facts = machine.facts(chosen.seed, chosen.threads)
        self.rows: list[Row] = []

    def run(self, tasks: Iterable[tuple[str, Callable[[str], Iterable[Row]]]]) -> int:
        """Run tasks (row name, what yields its rows); print; write; return the number of rows below their must."""
        print(head(self.name, self.facts))
        print(HEADER)
        started = time.perf_counter()
        for name, task in tasks:
            if self.options.only not in name:
                continue
            if sys.stderr.isatty():
                print(f"  ... {name}", end="\r", file=sys.stderr, flush=True)
            try:
                rows = list(task(name))
            except MissingDataError as error:
                rows = [Row(name, "", note=f"skipped: {error}")]
            gc.collect()
            for row in rows:
                self.rows.append(row)
                print(line(row), flush=True)
        self.facts |= {"load_after": machine.load(), "seconds": round(time.perf_counter() - started, 1)}
        missed = sum(row.verdict == "MISS" for row in self.rows)
        print(f"{len(self.rows)} rows, {missed} below their must, {self.facts['seconds']} s, "
              f"load {self.facts['load_before']} before and {self.facts['load_after']} after")  # fmt: skip
        if self.options.write:
            folder = RESULTS / machine.name()
            folder.mkdir(parents=True, exist_ok=True)
            rows = [asdict(row) | {"verdict": row.verdict} for row in self.rows]
            text = json.dumps(self.facts | {"rows": rows}, indent=1, default=_plain)
            (folder / f"{self.name}.json").write_text(text + "\n")
        return missed

    def against(
        self,
        name: str,
        kind: str,
        peer_name: str,
        subject: Any,
        points: np.ndarray,
        goals: tuple[float | None, float | None],
        made: dict[str, Prepared] | None = None,
        n_sample: int = 20,
    ) -> Iterable[Row]:
        """Yield the row of ours against one peer on one workload, both prepared.

        made: contenders prepared before, by name; those made here are added.
        """
        chosen, row = self.options, Row(name, "x", *goals)
        peer_module = load(peer_name)
        if isinstance(peer_module, Absent):
            row.note = f"{peer_name} does not run here: {peer_module.reason}"
            yield row
            return
        made = {} if made is None else made
        for contender in ("ours", peer_name):
            if contender not in made:
                seconds, _, prepared = clocked(partial(load(contender).MAKERS[kind], subject, chosen.threads))
                made[contender] = prepared
                row.raw[f"made_{contender}"] = seconds
        ours, peer = made["ours"], made[peer_name]
        settle(ours, points)
        asked = [ours.native(points), peer.native(points)]
        runs = [lambda: ours.ask(asked[0]), lambda: peer.ask(asked[1])]
        (a, b), results = interleaved(runs, chosen.rounds, chosen.seconds)
        wall, cpu = ratios(a, b)
        row.value, row.low, row.high, row.cpu_value = wall.median, wall.low, wall.high, cpu.median
        row.ours, row.peer = (f"{len(points) / t.median / 1e6:.3g} M/s" for t in (a, b))
        most = 40 if chosen.quick else 200
        found = errors.compare(
            points, subject, ours.answer(results[0]), peer.answer(results[1]), chosen.seed, n_sample, most
        )
        row.error = in_short(found, peer_module.NAME)
        row.note = ours.method() if ours.method else ""
        row.raw |= {"ours": asdict(a), "peer": asdict(b), "errors": found, "n_items": len(points)}
        yield row


def settle(prepared: Prepared, points: np.ndarray) -> None:
    """Ask until the method no longer changes: structures that pay only after many questions are then there."""
    asked, before = prepared.native(points), None
    for _ in range(12):
        prepared.ask(asked)
        now = (prepared.method() if prepared.method else "", prepared.memory() if prepared.memory else 0)
        if now == before and _ >= 3:
            return
        before = now


def in_short(found: dict[str, Any], peer: str) -> str:
    """Return the counts of wrong answers in a few words."""
    if "unchecked" in found:
        return found["unchecked"]
    differ, settled = found["disagreements"], found["settled"]
    return f"wrong: ours {found['wrong_ours']}, {peer} {found['wrong_peer']} of {settled} settled; {differ} differ"


def of_seconds(row: Row, seconds: list[float], digits: str = "") -> Row:
    """Fill a row of seconds with the median of several."""
    middle = spread(seconds)
    row.value, row.low, row.high, row.raw["seconds"] = middle.median, middle.low, middle.high, seconds
    row.ours = digits
    return row


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else str(value)


HEADER = (
    f"{'row':<52} {'figure':>9} {'quartiles':>15} {'by CPU':>7} {'must':>6} {'aim':>6} {'':<4}  "
    f"{'ours':>10} {'peer':>10}  error; note"
)


def line(row: Row) -> str:
    """Return the printed line of a row."""

    def number(value: float | None, unit: str = "") -> str:
        return "" if value is None else f"{value:.3g}{unit}"

    quartiles = f"{row.low:.3g} - {row.high:.3g}" if row.low is not None and row.high is not None else ""
    extra = "; ".join(part for part in (row.error, row.note) if part)
    return (
        f"{row.name:<52} {number(row.value, ' ' + row.unit):>9} {quartiles:>15} {number(row.cpu_value):>7} "
        f"{number(row.must):>6} {number(row.aim):>6} {row.verdict:<4}  {row.ours:>10} {row.peer:>10}  {extra}"
    ).rstrip()


def head(name: str, facts: dict[str, Any]) -> str:
    """Return what is printed above the table."""
    versions = ", ".join(f"{k} {v}" for k, v in facts["versions"].items() if v != "not installed")
    absent = ", ".join(k for k, v in facts["versions"].items() if v == "not installed")
    return (
        f"{name}: commit {facts['commit']}, seed {facts['seed']}, {facts['threads']} threads, "
        f"{facts['processor']}, {facts['cores']} cores, load {facts['load_before']}\n{versions}"
        + (f"\nnot installed: {absent}" if absent else "")
    )
