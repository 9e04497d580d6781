"""Compares the speed of two checkouts of the engine, row by row, interleaved: ``python -m benchmarks checkouts OTHER``.

    python -m benchmarks checkouts ../before             # every row of ours, some twelve minutes
    python -m benchmarks checkouts ../before --quick     # small sizes, two or three; --only WORD: some rows

Two processes, one with the engine of the other checkout, one with this one's; both make ours of every contest of the
tables (fields/) of this checkout. They run in turns, the order swapped from round to round, and never at the same time.
A figure is the median over all rounds of the time of the other over the time of this one: above 1, this one is faster;
beside it the same by CPU time, the steadier one where other processes share the machine. Each of two passes has new
processes: where arrays happen to lie in memory can be worth some percent. The first run compiles, untimed.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from benchmarks.measure import LEAST_SECONDS, clocked, spread

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
"""Least ratios that pass: the geometric mean over all rows, and the worst row."""
SECONDS = 3.0
"""Seconds of a row in a pass; three rounds at least."""


# --- the process of one checkout --------------------------------------------------------------------------------------


def serve() -> None:
    """Answer the lines of the standard input, one JSON each: a row to make, or how often to run it."""
    import engine
    from benchmarks.contest import Contest, Size, run_of_ours
    from benchmarks.fields import tasks

    answers, sys.stdout = sys.stdout, sys.stderr
    known: dict[str, Callable[[], Any]] = {}
    run: Callable[[], Any] | None = None
    for line in sys.stdin:
        queried = json.loads(line)
        try:
            if "seed" in queried:
                known = {
                    task.name: task.make for task in tasks(Size(queried["seed"], queried["scale"]), has_figures=False)
                }
                result: Any = str(Path(engine.__file__).resolve().parents[1])
            elif "make" in queried:
                run = None  # what the row before holds goes first
                made = known[queried["make"]]()
                assert isinstance(made, Contest)
                run = run_of_ours(made)
                run()
                result = min(clocked(run)[0] for _ in range(2))
            else:
                assert run is not None
                result = _seconds(run, queried["times"])
        except Exception as error:  # of a row: the others go on
            result = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(result), file=answers, flush=True)


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
        if (result := self.answer()) != str(checkout):
            raise SystemExit(f"the engine was imported from {result}, not from {checkout}")

    def send(self, **words: Any) -> None:
        """Send a request without waiting; `answer` raises if the process is dead."""
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


def compare(name: str, sides: tuple[Side, Side], rounds: int) -> list[list[list[float]]] | str:
    """Return wall and CPU seconds of both sides in each round, or why a row failed."""
    for side in sides:  # both at the same time: not timed
        side.send(make=name)
    warm = [side.answer() for side in sides]
    if failed := [result["error"] for result in warm if isinstance(result, dict)]:
        return str(failed[0])
    times, end = max(1, int(LEAST_SECONDS / max(min(warm), 1e-7))), time.perf_counter() + SECONDS
    result: list[list[list[float]]] = []
    for round_ in range(rounds):
        if round_ >= 3 and time.perf_counter() > end:
            break
        pair: list[list[float]] = [[], []]
        for i_side in (0, 1) if round_ % 2 == 0 else (1, 0):
            sides[i_side].send(times=times)
            pair[i_side] = sides[i_side].answer()
        result.append(pair)
    return result


def line(name: str, result: list[list[list[float]]]) -> tuple[str, float, float]:
    """Return the printed line of a row, and how many times faster this checkout is by wall time and by CPU time."""
    wall = spread([other[0] / ours[0] for other, ours in result])
    cpu = statistics.median(other[1] / max(ours[1], 1e-9) for other, ours in result)
    micros = [1e6 * statistics.median(pair[side][0] for pair in result) for side in (0, 1)]
    text = f"{name:<52} {wall.median:>6.3f}  {wall.low:.3f} - {wall.high:.3f}  {cpu:>6.3f} {len(result):>3}"
    return f"{text}  {micros[0]:>12,.1f} {micros[1]:>12,.1f}", wall.median, cpu


def main(words: list[str] | None = None) -> int:
    """Measure and print; return 1 if a row failed, or the mean or a row is below its bound by both clocks."""
    from benchmarks.contest import Size
    from benchmarks.fields import tasks

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path, help="the folder of the other checkout")
    parser.add_argument("--quick", action="store_true", help="small sizes, one pass of seven rounds")
    parser.add_argument("--only", default="", metavar="WORD", help="only rows whose name contains WORD")
    parser.add_argument("--rounds", type=int, help="a row and pass, at most (21; quick: 7)")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(words)
    scale, rounds, other = (
        0.05 if given.quick else 1.0,
        given.rounds or (7 if given.quick else 21),
        given.other.resolve(),
    )
    names = [task.name for task in tasks(Size(given.seed, scale), has_figures=False) if given.only in task.name]
    rows: dict[str, list[list[list[float]]]] = defaultdict(list)
    failed: dict[str, str] = {}
    for pass_ in range(1 if given.quick else 2):
        places = [ROOT, other] if pass_ else [other, ROOT]
        sides = {place: Side(place, given.seed, scale) for place in places}
        for name in names:
            result = compare(name, (sides[other], sides[ROOT]), rounds)
            if isinstance(result, str):
                failed[name] = result
            else:
                rows[name] += result
                print(line(name, rows[name])[0], file=sys.stderr, flush=True)
        for side in sides.values():
            side.close()
    print(f"{'row':<52} {'ratio':>6}  {'quartiles':<13}  {'by CPU':>6} {'n':>3}  {'other, us':>12} {'this, us':>12}")
    shown = {name: line(name, result) for name, result in rows.items()}
    for text, _, _ in shown.values():
        print(text)
    for name, error in failed.items():
        print(f"{name:<52} failed: {error}")
    if not shown:
        return 1
    means = [math.exp(statistics.fmean(math.log(row[clock]) for row in shown.values())) for clock in (1, 2)]
    print(f"{len(shown)} rows; geometric mean {means[0]:.4f} by the wall clock, {means[1]:.4f} by CPU (must: {MEAN})")
    below = [name for name, row in shown.items() if max(row[1:]) < WORST]
    print("\n".join(f"below {WORST} by both clocks: {name}" for name in below), end="\n" * bool(below))
    return int(bool(failed or below) or max(means) < MEAN)
