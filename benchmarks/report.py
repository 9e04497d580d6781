"""The report of speed against error: every operation, ours beside the textbook and the peers, easy and hard apart.

    python -m benchmarks report             # the record: page, picture, results/<machine>/report.json
    python -m benchmarks report --quick     # minutes: every contender runs, ours has 0 wrong; writes nothing
    python -m benchmarks report --pages     # the page and its picture again from the results that it names
    python -m benchmarks report --filed     # replays the filed cases, puts them into these results, and the same

A figure is items a second at the median of interleaved rounds. Errors are counted against exact answers by rational
arithmetic that shares nothing with the engine (tests/reference).
"""

from __future__ import annotations

import json
import re
from pathlib import Path

from benchmarks import filed, machine, page, picture, table, web_page
from benchmarks.fields import tasks
from benchmarks.filed import museum

DOCS, README = machine.ROOT / "docs", machine.ROOT / "README.md"
BEGIN, END = "<!-- benchmarks report writes this table -->", "<!-- to here -->"


def main(words: list[str] | None = None) -> int:
    """Run the contests, write the page; return 1 if an answer of ours is wrong."""
    given = table.options(
        words,
        __doc__ or "",
        pages="only write the page, from the results that it names",
        filed="replay the filed cases only, into the results that the page names",
    )
    if given.pages or given.filed:
        path = named_by_the_page()
        if given.filed:
            path.write_text(table.written(json.loads(path.read_text()) | {"filed": filed.replay()}))
        _write_pages(path)
        return 0
    result = table.measured("report", tasks(given.size, is_page=True), given, has_latency=True)
    if not given.only:
        result["filed"] = filed.replay()
    ours = [row["errors"] for row in result["rows"] if row["contender"] == "ours" and row["errors"]]
    wrong = sum(errors.get("wrong", 0) + errors.get("refused", 0) + errors.get("off", 0) for errors in ours)
    wrong += sum(row["contender"] == "ours" and row["outcome"] != "right" for row in result.get("filed", ()))
    print(f"wrong answers, refusals or inexact coordinates of ours: {wrong}")
    if given.writes:
        table.store("report", result)
        _write_pages(machine.results("report"))
    return 1 if wrong else 0


def named_by_the_page() -> Path:
    """Return the stored results from which the current page is made."""
    named = re.findall(r"benchmarks/results/[\w-]+/report\.json", (DOCS / "speed_and_error.html").read_text("utf-8"))
    return machine.ROOT / named[0]


def _write_pages(results: Path) -> None:
    for path, text in pages_of(results).items():
        path.write_text(text, "utf-8")


def pages_of(results: Path) -> dict[Path, str]:
    """Return every file that is made from stored results, with its text."""
    result = json.loads(results.read_text())
    result["filed"] = [row for row in result["filed"] if row["outcome"] != "not applicable"]  # older results have them
    path = results.relative_to(machine.ROOT).as_posix()
    head, _, rest = README.read_text("utf-8").partition(BEGIN)
    return {
        DOCS / "pictures/speed_against_error.svg": picture.text_of(web_page.questions(result["rows"])),
        DOCS / "speed_and_error.md": page.text_of(result),
        DOCS / "speed_and_error.html": web_page.text_of(result, path),
        DOCS / "museum.html": museum.text_of(result["filed"], filed.load(), path),
        README: f"{head}{BEGIN}\n{page.smallest(result)}{END}{rest.partition(END)[2]}",
    }
