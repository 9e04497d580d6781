"""The report of speed against error: every operation, ours beside the textbook and the peers, easy and hard apart.

    python -m benchmarks report             # the record: page, pictures, results/<machine>/report.json
    python -m benchmarks report --quick     # minutes: every contender runs, ours has 0 wrong; writes nothing
    python -m benchmarks report --keep      # with --quick: writes all the same, and the page says that it is quick
    python -m benchmarks report --pages     # the page and its pictures again from the results that it names

A figure is items a second at the median of interleaved rounds. Errors are counted against exact answers by rational
arithmetic that shares nothing with the engine (tests/reference).
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from benchmarks import curves, filed, machine, page, pictures, table, web_page
from benchmarks.fields import tasks
from benchmarks.filed import museum

DOCS, README = machine.ROOT / "docs", machine.ROOT / "README.md"
BEGIN, END = "<!-- benchmarks report writes this table -->", "<!-- to here -->"


def main(words: list[str] | None = None) -> int:
    """Hold the contests, write the page; 1 if an answer of ours is wrong."""
    given = table.options(
        words,
        __doc__ or "",
        pages="only write the page, from the results that it names",
        keep="write what is quick, too",
    )
    if given.pages:
        _write_pages(named_by_the_page())
        return 0
    found = table.measured("report", tasks(given.size, is_page=True), given, has_latency=True)
    if not given.only:
        found["curves"] = {
            "distance": curves.by_distance(given.seed, given.size.n(2000, 100)),
            "size": curves.by_size(given.seed, given.quick),
        }
        found["filed"] = filed.replay()
    ours = [row["errors"] for row in found["rows"] if row["contender"] == "ours" and row["errors"]]
    wrong = sum(errors.get("wrong", 0) + errors.get("refused", 0) + errors.get("off", 0) for errors in ours)
    wrong += sum(row["contender"] == "ours" and row["outcome"] != "right" for row in found.get("filed", ()))
    print(f"wrong answers, refusals or inexact coordinates of ours: {wrong}")
    if given.writes or (given.keep and not given.only):
        table.store("report", found)
        _write_pages(machine.results("report"))
    return 1 if wrong else 0


def named_by_the_page() -> Path:
    """Return the stored results that the page as it stands is made of."""
    named = re.search(r"benchmarks/results/[\w-]+/report\.json", (DOCS / "speed_and_error.html").read_text("utf-8"))
    assert named is not None
    return machine.ROOT / named[0]


def keep(name: str, part: Any) -> None:
    """Put a part that is not timed into the stored results, and write the pages."""
    path = named_by_the_page()
    path.write_text(table.written(json.loads(path.read_text()) | {name: part}))
    _write_pages(path)


def _write_pages(results: Path) -> None:
    drawn = {DOCS / "pictures" / name: text for name, text in pictures.draw(json.loads(results.read_text())).items()}
    for path, text in (drawn | pages_of(results)).items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")


def pages_of(results: Path) -> dict[Path, str]:
    """Return every file but the pictures that is made of stored results, and its text."""
    found, cold_start = json.loads(results.read_text()), results.with_name("cold_start.json")
    if cold_start.exists():
        found["cold_start"] = json.loads(cold_start.read_text())
    found["filed"] = [row for row in found["filed"] if row["outcome"] != "not applicable"]  # older results have them
    path = results.relative_to(machine.ROOT).as_posix()
    head, _, rest = README.read_text("utf-8").partition(BEGIN)
    return {
        DOCS / "speed_and_error.md": page.text_of(found),
        DOCS / "speed_and_error.html": web_page.text_of(found, path),
        DOCS / "museum.html": museum.text_of(found["filed"], filed.load(), path),
        README: f"{head}{BEGIN}\n{page.smallest(found)}{END}{rest.partition(END)[2]}",
    }
