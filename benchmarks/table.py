"""The tables: contests and figures of one operation, printed row by row, stored as JSON.

A contender's figure is how many times as long as ours it takes, net of what its calls cost by themselves, with what
that must be and what it aims at. Speed and error stand in the same row.
"""

from __future__ import annotations

import argparse
import gc
import json
import sys
import time
from collections.abc import Iterable
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from benchmarks import contenders, machine
from benchmarks.contest import NAMED, Contest, Row, Size, Task, run_contest
from benchmarks.fields import FIELDS, Figure, tasks
from benchmarks.measure import Spread, spread
from benchmarks.workloads import MissingDataError

SHOWN = ("wrong", "refused", "outside", "off", "ulp_largest", "differ")
QUICK = 0.05
"""Size of a quick run."""


def options(words: list[str] | None, description: str, **more: str) -> argparse.Namespace:
    """Read the command line; more: switches of a command and what they do."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small sizes and few rounds: about a minute")
    parser.add_argument("--rounds", type=int, help="interleaved rounds a row (15, report 7; quick: 3)")
    parser.add_argument("--seconds", type=float, help="of each contender in each row (3, report 2; quick: 0.3)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", metavar="WORD", help="only rows whose name contains WORD")
    parser.add_argument("--contest", dest="only", metavar="WORD", help="the same as --only")
    parser.add_argument(
        "--contender",
        default="",
        metavar="WORD",
        help="ours and contenders whose name contains WORD, or the file contenders/with_WORD.py",
    )
    parser.add_argument("--dry", action="store_true", help="write no results file")
    for name, about in more.items():
        parser.add_argument(f"--{name}", action="store_true", help=about)
    given = parser.parse_args(words)
    given.refuse = parser.error
    given.rounds = given.rounds or (3 if given.quick else 7 if "pages" in more else 15)
    given.seconds = given.seconds or (0.3 if given.quick else 2.0 if "pages" in more else 3.0)
    given.writes = not (given.dry or given.quick or given.only or given.contender)
    NAMED[:] = [given.contender] if contenders.is_there(given.contender) else []
    given.size = Size(given.seed, QUICK if given.quick else 1.0)
    return given


def ratio(ours: Row, other: Row) -> tuple[Spread, float]:
    """Return how many times faster ours is, round by round: by the clock, net of bare calls, and by CPU time."""
    bare = other.call_overhead * other.n_items
    per_item = ours.n_items / max(other.n_items, 1)
    wall = [max(b - bare, 1e-12) / a * per_item for a, b in zip(ours.seconds, other.seconds)]
    cpu = [b / max(a, 1e-9) * per_item for a, b in zip(ours.cpu, other.cpu)]
    return spread(wall), spread(cpu).median


def verdict(value: float, must: float | None, aim: float | None, is_ratio: bool) -> str:
    """Return `aim`, `must`, `MISS` or, where there is no goal, nothing: larger ratios are better, smaller figures."""
    sign = 1 if is_ratio else -1
    if must is None:
        return ""
    if aim is not None and sign * value >= sign * aim:
        return "aim"
    return "must" if sign * value >= sign * must else "MISS"


def lines_of(made: list[Row] | Figure) -> Iterable[str]:
    """Yield the printed lines of a contest's rows or of a figure."""
    if isinstance(made, Figure):
        result = spread(made.values)
        said = verdict(result.median, made.must, made.aim, made.unit == "x")
        between = f"{result.low:.3g} - {result.high:.3g}" if len(made.values) > 1 else ""
        about = "; ".join(part for part in (made.ours, made.peer, made.error, made.note) if part)
        figure = f"{made.name:<54} {result.median:>9.4g} {made.unit:<5} {between:>17}"
        yield f"{figure} {_goals(made.must, made.aim)} {said}  {about}"
        return
    ours = next(row for row in made if row.contender == "ours")
    for row in made:
        operation = "" if row.operation in FIELDS else f"{row.operation}, "
        name = f"{operation + row.contest:<40} {named(row.contender, row.setting):<26}"
        if row.absent:
            yield f"{name} absent: {row.absent}"
            continue
        figures = f"{_rate(row):>11}"
        if row is not ours:
            result, cpu = ratio(ours, row)
            between, said = f"{result.low:.3g} - {result.high:.3g}", verdict(result.median, *row.goals, is_ratio=True)
            figures += f" {result.median:>7.3g}x {between:>15} {cpu:>7.3g}x {_goals(*row.goals)} {said:<4}"
        errors = ", ".join(
            f"{key} {row.errors[key]:{'.3g' if isinstance(row.errors[key], float) else ','}}"
            for key in SHOWN
            if row.errors.get(key)
        )
        judged = f"of {row.errors['judged']} judged: {errors or 'all right'}" if "judged" in row.errors else errors
        yield "  ".join(part for part in (name + figures, judged, row.method) if part)


def named(contender: str, setting: float | None) -> str:
    """Return a contender's name with the setting of its knob."""
    return contender if setting is None else f"{contender} @{setting:g}"


def _goals(must: float | None, aim: float | None) -> str:
    return f"{'' if must is None else f'{must:g}':>6} {'' if aim is None else f'{aim:g}':>6}"


def _rate(row: Row) -> str:
    if row.rate >= 1e3:
        return next(f"{row.rate / size:.3g} {unit}/s" for size, unit in ((1e6, "M"), (1e3, "k")) if row.rate >= size)
    return f"{1e3 / row.rate:.4g} ms"


def measured(name: str, chosen: Iterable[Task], given: argparse.Namespace, has_latency: bool = False) -> dict[str, Any]:
    """Hold the contests and take the figures; print them; return what is stored, and how many are below their must."""
    result: dict[str, Any] = machine.facts(given.seed, machine.cores()) | {"quick": given.quick}
    names, chosen = {"ours", *contenders.names_of(given.contender)}, list(chosen)
    some = [task for task in chosen if given.only in task.name]
    if not some:
        given.refuse(f"no row has {given.only!r} in its name; there are {', '.join(task.name for task in chosen)}")
    print(head(name, result))
    started, rows, figures, missed = time.perf_counter(), [], [], 0
    for task in some:
        if sys.stderr.isatty():
            print(f"  ... {task.name}", end="\r", file=sys.stderr, flush=True)
        try:
            made = task.make()
            if isinstance(made, Contest) and given.contender:
                queried = [each for each in made.contenders if each.name in names or given.contender in each.name]
                made = replace(made, contenders=queried)
            outcome = run_contest(made, given.rounds, given.seconds, has_latency) if isinstance(made, Contest) else made
        except MissingDataError as error:
            print(f"{task.name}: skipped: {error}", flush=True)
            continue
        if isinstance(outcome, Figure):
            figures.append(outcome)
        else:
            rows += outcome
        for line in lines_of(outcome):
            missed += " MISS" in line
            print(line, flush=True)
        del made
        gc.collect()
    if rows and given.contender and all(row.contender == "ours" for row in rows):
        given.refuse(f"no contender {given.contender!r} in these rows; files: {', '.join(sorted(contenders.files()))}")
    result |= {"load_after": machine.load(), "seconds": round(time.perf_counter() - started, 1)}
    result |= {"rows": [asdict(row) | {"rate": row.rate, "net_rate": row.net_rate} for row in rows]}
    print(f"{len(rows)} rows, {len(figures)} figures, {missed} below their must, {result['seconds']} s, "
          f"load {result['load_before']} before and {result['load_after']} after")  # fmt: skip
    return result | {"figures": [asdict(figure) for figure in figures]}


def store(name: str, result: dict[str, Any]) -> None:
    """Write results/<machine>/<name>.json."""
    path = machine.results(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(written(result))


def written(result: dict[str, Any]) -> str:
    """Return results as they are stored."""
    return json.dumps(result, indent=1, default=plain) + "\n"


def plain(value: Any) -> Any:
    """Return what JSON does not take as something that it takes."""
    return value.item() if isinstance(value, np.generic) else str(value)


def head(name: str, facts: dict[str, Any]) -> str:
    """Return what is printed above the table."""
    versions = ", ".join(f"{k} {v}" for k, v in facts["versions"].items() if v != "not installed")
    absent = ", ".join(k for k, v in facts["versions"].items() if v == "not installed")
    return (
        f"{name}: commit {facts['commit']}, seed {facts['seed']}, {facts['processor']}, {facts['cores']} cores, "
        f"load {facts['load_before']}\n{versions}"
        + (f"\nnot installed: {absent}" if absent else "")
        + "\nrow, contender, its speed; ours is faster by, quartiles, by CPU; must, aim; errors; method"
    )


def run(name: str, chosen: Iterable[Task], given: argparse.Namespace) -> int:
    """Measure, print and store; the exit code is 0 also where a row misses its goal: the table says so."""
    result = measured(name, chosen, given)
    if given.writes:
        store(name, result)
    return 0


def main(words: list[str] | None = None, name: str = "containment") -> int:
    """Run a table."""
    given = options(words, __doc__ or "")
    return run(name, tasks(given.size, (name,)), given)
