"""The speed of two checkouts of the engine, row by row, in turns: ``python -m benchmarks checkouts OTHER``.

    python -m benchmarks checkouts ../before             # every row of ours, about twelve minutes
    python -m benchmarks checkouts ../before --quick     # small sizes, two or three
    python -m benchmarks checkouts ../before --only "overlay" --minutes 3

Two processes, one with the engine of the other checkout, one with this one's; both make ours of every contest of the
tables (fields/) of this checkout. They run in turns, the order swapped from round to round, and never at the same time.
A figure is the median over all rounds of the time of the other over the time of this one: above 1, this one is faster;
beside it the same by CPU time, the steadier one where other processes share the machine. Each pass has new processes:
where arrays happen to lie in memory can be worth some percent. Rows that look slower get one pass more. The first run
compiles, untimed.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.measure import LEAST_SECONDS, Spread, clocked, spread

ROOT = Path(__file__).resolve().parents[1]
START = """
import sys
import engine  # of the working directory
sys.path[0] = sys.argv[1]
for name in [name for name in sys.modules if name.partition(".")[0] == "benchmarks"]:
    del sys.modules[name]
from benchmarks import checkouts
checkouts.serve()
"""
MEAN, WORST = 0.98, 0.93
"""What must hold: the geometric mean over all rows, and every row."""
LEAST_ROUNDS, QUICK = 3, 0.05
DOUBTFUL = 0.96
"""A row below this is measured once more."""


# --- the process of one checkout --------------------------------------------------------------------------------------


def serve() -> None:
    """Answer the lines of the standard input, one JSON each: what to make, or how often to run it."""
    import engine
    from benchmarks.contest import Contest, Size, run_of_ours
    from benchmarks.fields import tasks

    answers, sys.stdout = sys.stdout, sys.stderr
    known: dict[str, Callable[[], Any]] = {}
    run: Callable[[], Any] | None = None
    for line in sys.stdin:
        asked = json.loads(line)
        try:
            if "seed" in asked:
                known = {task.name: task.make for task in tasks(Size(asked["seed"], asked["scale"]), has_figures=False)}
                found: Any = str(Path(engine.__file__).resolve().parents[1])
            elif "make" in asked:
                run = None  # what the row before holds goes first
                made = known[asked["make"]]()
                assert isinstance(made, Contest)
                run = run_of_ours(made)
                run()
                found = min(clocked(run)[0] for _ in range(2))
            else:
                assert run is not None
                found = _seconds(run, asked["times"])
        except Exception as error:  # of a row: the others go on
            found = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(found), file=answers, flush=True)


def _seconds(run: Callable[[], Any], times: int) -> tuple[float, float]:
    wall, cpu, _ = clocked(lambda: [run() for _ in range(times)])
    return wall / times, cpu / times


class Side:
    """A process with the engine of one checkout."""

    def __init__(self, checkout: Path, seed: int, scale: float) -> None:
        words = [sys.executable, "-c", START, str(ROOT)]
        self._process = subprocess.Popen(
            words, cwd=checkout, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
        )
        self.send(seed=seed, scale=scale)
        if (found := self.answer()) != str(checkout):
            raise SystemExit(f"the engine was imported from {found}, not from {checkout}")

    def send(self, **words: Any) -> None:
        """Ask, and do not wait; that a process is dead is told by `answer`."""
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps(words) + "\n")
            self._process.stdin.flush()

    def answer(self) -> Any:
        """Wait for the answer."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        return json.loads(line) if line else {"error": f"the process ended with {self._process.wait()}"}

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):
            self._process.stdin.close()
        self._process.wait(60)


# --- measuring --------------------------------------------------------------------------------------------------------


@dataclass(slots=True)
class Compared:
    """One row: wall and CPU seconds of a run in each round, of the other checkout and of this one."""

    name: str
    other: list[list[float]] = field(default_factory=list)
    ours: list[list[float]] = field(default_factory=list)
    failed: str = ""

    @property
    def ratio(self) -> Spread:
        """How many times faster this checkout is, round by round."""
        return spread([a / b for (a, _), (b, _) in zip(self.other, self.ours, strict=True)])

    @property
    def cpu_ratio(self) -> float:
        """The median of the same by CPU time."""
        return spread([a / max(b, 1e-9) for (_, a), (_, b) in zip(self.other, self.ours, strict=True)]).median

    @property
    def is_doubtful(self) -> bool:
        """Whether it looks slower by either clock."""
        return not self.failed and min(self.ratio.median, self.cpu_ratio) < DOUBTFUL


def compare(row: Compared, sides: tuple[Side, Side], rounds: int, seconds: float) -> None:
    """Add the rounds of one row: as many as asked for, at least three, and no more when the time is over."""
    for side in sides:  # both at the same time: not timed
        side.send(make=row.name)
    warm = [side.answer() for side in sides]
    if failed := [found["error"] for found in warm if isinstance(found, dict)]:
        row.failed = failed[0]
        return
    times = max(1, int(LEAST_SECONDS / max(min(warm), 1e-7)))
    end = time.perf_counter() + seconds
    for round_ in range(rounds):
        if round_ >= LEAST_ROUNDS and time.perf_counter() > end:
            break
        found: list[list[float]] = [[], []]
        for i_side in (0, 1) if round_ % 2 == 0 else (1, 0):
            sides[i_side].send(times=times)
            found[i_side] = sides[i_side].answer()
        row.other.append(found[0])
        row.ours.append(found[1])


def run(other: Path, given: argparse.Namespace) -> list[Compared]:
    """Return all rows, measured in several passes of new processes, doubtful rows once more."""
    from benchmarks.contest import Size
    from benchmarks.fields import tasks

    names = [task.name for task in tasks(Size(given.seed, given.scale), has_figures=False)]
    rows = [Compared(name) for name in names if given.only in name]
    n_left, end = len(rows) * given.passes, time.perf_counter() + 60 * given.minutes
    for pass_ in range(given.passes):
        n_left = _pass(rows, other, given, end, n_left, is_swapped=bool(pass_ % 2))
    doubtful = [row for row in rows if row.is_doubtful]
    _pass(doubtful, other, given, time.perf_counter() + 15 * given.minutes, len(doubtful), bool(given.passes % 2))
    return rows


def _pass(
    rows: list[Compared], other: Path, given: argparse.Namespace, end: float, n_left: int, is_swapped: bool
) -> int:
    """Measure the rows once, with an even share of the time until `end` for each; return how many are left."""
    places = [ROOT, other] if is_swapped else [other, ROOT]
    sides = {place: Side(place, given.seed, given.scale) for place in places} if rows else {}
    for row in rows:
        started, share = time.perf_counter(), max(0.0, end - time.perf_counter()) / n_left
        if not row.failed:
            compare(row, (sides[other], sides[ROOT]), given.rounds, share)
        n_left -= 1
        print(f"{line(row)}  {time.perf_counter() - started:.1f} s", file=sys.stderr, flush=True)
    for side in sides.values():
        side.close()
    return n_left


def line(row: Compared) -> str:
    """Return the printed line of a row."""
    if row.failed:
        return f"{row.name:<52} failed: {row.failed}"
    found = row.ratio
    micros = [1e6 * statistics.median(wall for wall, _ in side) for side in (row.other, row.ours)]
    return (
        f"{row.name:<52} {found.median:>6.3f}  {found.low:.3f} - {found.high:.3f}  {row.cpu_ratio:>6.3f} "
        f"{len(row.ours):>3}  {micros[0]:>12,.1f} {micros[1]:>12,.1f}"
    )


def verdict(rows: list[Compared]) -> tuple[str, bool]:
    """Return the last lines, and whether what must hold does, by one of the two clocks: the other may be disturbed."""
    failed = [row for row in rows if row.failed]
    if failed or not rows:
        return f"{len(failed)} of {len(rows)} rows failed", False
    lines, means = [f"{len(rows)} rows"], []
    for clock, ratios in (("wall", [row.ratio.median for row in rows]), ("CPU", [row.cpu_ratio for row in rows])):
        means.append(math.exp(statistics.fmean(map(math.log, ratios))))
        worst, name = min(zip(ratios, (row.name for row in rows)))
        lines.append(f"{clock}: geometric mean {means[-1]:.4f} (must: {MEAN}), worst {worst:.3f}: {name}")
    below = [row for row in rows if max(row.ratio.median, row.cpu_ratio) < WORST]
    lines += [f"below {WORST} by both clocks: {row.name}" for row in below]
    return "\n".join(lines), max(means) >= MEAN and not below


def main(words: list[str] | None = None) -> int:
    """Measure and print; 1 if the mean, or a row, is below what must hold."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path, help="the folder of the other checkout")
    parser.add_argument("--quick", action="store_true", help="small sizes, few rounds")
    parser.add_argument("--only", default="", metavar="WORD", help="only rows whose name contains WORD")
    parser.add_argument("--rounds", type=int, help="a row and pass, at most (21; quick: 7)")
    parser.add_argument("--passes", type=int, help="new processes so many times (2; quick: 1)")
    parser.add_argument("--minutes", type=float, help="of the whole run, but three rounds of each row (12; quick: 2)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", type=Path, help="write every round's seconds here")
    given = parser.parse_args(words)
    usual = (7, 1, 2.0, QUICK) if given.quick else (21, 2, 12.0, 1.0)
    given.rounds, given.passes = given.rounds or usual[0], given.passes or usual[1]
    given.minutes, given.scale = given.minutes or usual[2], usual[3]
    rows = run(given.other.resolve(), given)
    print(f"{'row':<52} {'ratio':>6}  {'quartiles':<13}  {'by CPU':>6} {'n':>3}  {'other, us':>12} {'this, us':>12}")
    for row in rows:
        print(line(row))
    if given.json is not None:
        given.json.write_text(json.dumps([{"name": row.name, "other": row.other, "ours": row.ours} for row in rows]))
    text, holds = verdict(rows)
    print(text)
    return int(not holds)
