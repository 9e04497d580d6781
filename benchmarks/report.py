"""The report of speed against error: every operation, ours beside the textbook and the peers, easy and hard apart.

    python -m benchmarks report             # the record: page, pictures, results/<machine>/report.json
    python -m benchmarks report --quick     # minutes: every contender runs, ours has 0 wrong; writes nothing
    python -m benchmarks report --pages     # the page and its pictures again from the stored results
    python -m benchmarks compare a.json b.json

A figure is items a second at the median of interleaved rounds. Errors are counted against exact answers by rational
arithmetic that shares nothing with the engine (tests/reference).
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks import curves, filed, machine, page, pictures
from benchmarks.contest import Contest, Row, hold
from benchmarks.fields import collision, containment, overlay, polygons, primitives, segments
from benchmarks.table import RESULTS, as_json

FIELDS = (containment, collision, segments, polygons, overlay, primitives)
ROOT = Path(__file__).resolve().parents[1]
DOCS, README = ROOT / "docs", ROOT / "README.md"
BEGIN, END = "<!-- benchmarks report writes this table -->", "<!-- to here -->"


def main(words: list[str] | None = None) -> int:
    """Hold the contests, write the page; 1 if an answer of ours is wrong."""
    options = _options(words)
    path = RESULTS / machine.name() / "report.json"
    if options.pages:
        _write_pages(json.loads(path.read_text()))
        return 0
    found: dict[str, Any] = machine.facts(options.seed, machine.cores()) | {"quick": options.quick}
    started, scale = time.perf_counter(), 0.05 if options.quick else 1.0
    rounds, seconds = (2, 0.2) if options.quick else (7, options.seconds)
    rows: list[Row] = []
    for contest in _contests(options.seed, scale, options.only):
        say(f"{contest.operation}, {contest.name}")
        for row in hold(contest, rounds, seconds):
            rows.append(row)
            print(_line(row), flush=True)
    found["rows"] = [as_json(row) for row in rows]
    if not options.only:
        measure = partial(curves.by_distance, options.seed, 100 if options.quick else 2000)
        found["curves"] = {"distance": measure(), "size": curves.by_size(options.seed, options.quick)}
        say("the cases that users filed")
        found["filed"] = filed.replay()
    found |= {"seconds": round(time.perf_counter() - started, 1), "load_after": machine.load()}
    wrong = sum(row.errors.get("wrong", 0) + row.errors.get("off", 0) for row in rows if row.contender == "ours")
    wrong += sum(row["contender"] == "ours" and row["outcome"] != "right" for row in found.get("filed", ()))
    print(f"{len(rows)} rows in {found['seconds']} s; wrong answers or inexact coordinates of ours: {wrong}")
    if not (options.quick or options.only):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(found, indent=1) + "\n")
        _write_pages(found)
    return 1 if wrong else 0


def _contests(seed: int, scale: float, only: str) -> Iterator[Contest]:
    for field in FIELDS:
        if only in field.__name__:
            yield from field.contests(seed, scale)


def _write_pages(found: dict[str, Any]) -> None:
    for name, text in pictures.draw(found).items():
        (DOCS / "pictures").mkdir(parents=True, exist_ok=True)
        (DOCS / "pictures" / name).write_text(text)
    (DOCS / "speed_and_error.md").write_text(page.text_of(found))
    head, _, rest = README.read_text().partition(BEGIN)
    README.write_text(f"{head}{BEGIN}\n{page.smallest(found)}{END}{rest.partition(END)[2]}")


def say(words: str) -> None:
    """Tell what is measured, where someone looks."""
    if sys.stderr.isatty():
        print(f"  ... {words:<70}", end="\r", file=sys.stderr, flush=True)


def _line(row: Row) -> str:
    name = f"{row.operation}, {row.contest}"
    if row.absent:
        return f"{name:<46} {row.contender:<34} absent: {row.absent}"
    errors = ", ".join(f"{key} {row.errors[key]:.3g}" for key in page.SHOWN if row.errors.get(key))
    share = "" if row.exact_share is None else f", beyond the filter {row.exact_share:.2g}"
    judged = f"of {row.errors['judged']}: {errors or 'all right'}{share}"
    return f"{name:<46} {row.contender:<34} {row.rate:>12,.0f}/s  {judged}"


def _options(words: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small and short; writes nothing")
    parser.add_argument("--pages", action="store_true", help="only write the page from the stored results")
    parser.add_argument("--only", default="", metavar="WORD", help="only operations whose file name contains WORD")
    parser.add_argument("--seconds", type=float, default=3.0, help="of each contender in each contest (3)")
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args(words)
