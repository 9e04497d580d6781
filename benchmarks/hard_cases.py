"""Measures the shares of wrong answers in docs/hard_cases.md.

    python -m benchmarks hard_cases            # measures, and writes the figures into docs
    python -m benchmarks hard_cases --dry      # prints the figures only; --only WORD: of marks with this word

In the page, a line ``<!-- measured: points vertex; pairs d_ulp -->`` names sets; the paragraph after it is replaced by
the share of wrong or refused answers of every contender on each set. A set is

- ``points FAMILY``: points of that family (tests/hard/points.py) in a bumpy ball on a lattice, or in the solid after a
  colon, exact answers by tests/reference;
- ``pairs FAMILY``: pairs of closed bodies of the shared hard set; left as it stands where there are no data;
- ``cases OPERATION/FAMILY``: the stored cases of tests/hard/cases, put to the peers as the filed cases are;
- ``contest OPERATION, NAME``: a contest of the report, with fewer items.
"""

from __future__ import annotations

import argparse
import json
import re
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np

from benchmarks import filed
from benchmarks.contest import Contest, Size, field_of, run_contest
from benchmarks.errors import same
from benchmarks.fields import collision, containment, tasks
from benchmarks.workloads import Mesh, MissingDataError, bumpy_sphere, hard_pairs

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "hard_cases.md"
MARK = re.compile(r"<!-- measured: (.*?) -->\n(?:.+\n)*")
N_POINTS = 600
"""Of each family."""
Shares = dict[str, tuple[int, int]]
"""By contender: number of wrong or refused answers, and of all."""


def _shares_of(contest: Contest) -> Shares:
    result = {}
    for row in run_contest(contest, 1, 2.0):
        if not row.absent and not row.contender.startswith("ours,"):
            bad = (row.errors.get(kind, 0) for kind in ("wrong", "refused", "outside"))
            result[row.contender] = sum(bad), row.errors["judged"]
    return result


def points(words: str) -> Shares:
    """Return the shares on points of a family."""
    from tests.hard.points import generated_solids, hard_points
    from tests.reference.many_points import locate_points

    family, _, name = words.partition(": ")
    ball = bumpy_sphere("hard cases", 0, 3)
    rounded = Mesh("ball", np.round(ball.vertices * 64) / 64, ball.faces)
    mesh = Mesh(name, *generated_solids()[name]) if name else rounded
    drawn = dict(hard_points(f"hard cases {mesh.name}", mesh.vertices, mesh.faces, N_POINTS))
    questions = np.concatenate(list(drawn.values())) if family == "all" else drawn[family]
    exact = locate_points(questions, mesh.vertices, mesh.faces) >= 0
    return _shares_of(
        Contest("containment", family, True, questions, exact, same, field_of("points", mesh, containment.MESH_PEERS))
    )


def pairs(family: str) -> Shares:
    """Return the shares on the stored pairs of a family."""
    with suppress(MissingDataError):
        if cases := [case for case in hard_pairs() if case["family"] == family]:
            return _shares_of(collision.stored(family, cases))
    return {}


def cases(words: str) -> Shares:
    """Return the shares on stored cases."""
    operation, family = words.split("/")
    stored = json.loads((ROOT / "tests" / "hard" / "cases" / operation / f"{family}.json").read_text("utf-8"))
    questions = [{"id": case["name"], "operation": operation, **case} for case in stored]
    rows = [row for row in filed.replay(cases=questions) if row["outcome"] != "absent"]
    all_, bad = (Counter(row["contender"] for row in rows if row["outcome"] not in ok) for ok in ((), ("right",)))
    return {name: (bad[name], count) for name, count in all_.items()}


def contest(name: str) -> Shares:
    """Return the shares in a contest of the report."""
    for task in tasks(Size(0, 0.5), ("segments", "polygons", "overlay"), is_page=True):
        if name.endswith(task.name.partition(": ")[2]) and f"{(made := task.make()).operation}, {made.name}" == name:
            return _shares_of(made)
    raise KeyError(name)


SETS = {"points": points, "pairs": pairs, "cases": cases, "contest": contest}


def sentence(wanted: str, shares: Shares) -> str:
    """Return one set's line: contenders in the order of their shares, ours first."""
    total = max((questions for _, questions in shares.values()), default=0)
    others = sorted((name for name in shares if name != "ours"), key=lambda name: shares[name][0] / shares[name][1])
    parts = [f"**ours {shares['ours'][0]}**"]
    for name in others:
        wrong, questions = shares[name]
        share = (
            f"{100 * wrong / questions:.3g}%"
            if total >= 100
            else f"{wrong}" + (f" of {questions}" if questions < total else "")
        )
        parts.append(f"{name} {share if wrong else 0}")
    return f"- *{wanted}* ({total:,}): {', '.join(parts)}\n"


def measured(text: str, only: str) -> Iterator[tuple[str, str]]:
    """Yield for each mark of the page with the word `only` its sets and its new paragraph."""
    for wanted in dict.fromkeys(MARK.findall(text)):
        lines: list[str] = []
        if only not in wanted:
            continue
        for each in wanted.split("; "):
            kind, _, rest = each.partition(" ")
            shares = SETS[kind](rest)
            lines.append(sentence(each, shares) if shares else "")
            print(lines[-1], end="", flush=True)
        yield wanted, "".join(lines)


def _paragraph(mark: re.Match[str], lines: dict[str, str]) -> str:
    head, old = mark[0].split("\n", 1)
    return f"{head}\n{lines.get(mark[1]) or old}"


def main(words: list[str] | None = None) -> int:
    """Measure and write; return 1 if an answer of ours is wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dry", action="store_true", help="print the figures, write nothing")
    parser.add_argument("--only", default="", metavar="WORD", help="only marks with this word")
    options = parser.parse_args(words)
    text = PAGE.read_text("utf-8")
    lines = dict(measured(text, options.only))
    if not options.dry:
        PAGE.write_text(MARK.sub(lambda mark: _paragraph(mark, lines), text), "utf-8")
    return int(any("**ours 0**" not in line for every in lines.values() for line in every.splitlines()))
