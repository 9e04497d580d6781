"""The report of speed against error: every operation, ours beside the textbook and the peers, easy and hard apart.

    python -m benchmarks report             # the record: page, pictures, results/<machine>/report.json
    python -m benchmarks report --quick     # minutes: every contender runs, ours has 0 wrong; writes nothing
    python -m benchmarks report --keep      # with --quick: writes all the same, and the page says that it is quick
    python -m benchmarks report --pages     # the page and its pictures again from the stored results

A figure is items a second at the median of interleaved rounds. Errors are counted against exact answers by rational
arithmetic that shares nothing with the engine (tests/reference).
"""

from __future__ import annotations

import json
from typing import Any

from benchmarks import curves, filed, machine, page, pictures, table, web_page
from benchmarks.fields import tasks
from benchmarks.filed import museum

DOCS, README = machine.ROOT / "docs", machine.ROOT / "README.md"
BEGIN, END = "<!-- benchmarks report writes this table -->", "<!-- to here -->"


def main(words: list[str] | None = None) -> int:
    """Hold the contests, write the page; 1 if an answer of ours is wrong."""
    given = table.options(
        words, __doc__ or "", pages="only write the page from the stored results", keep="write what is quick, too"
    )
    if given.pages:
        _write_pages(json.loads(machine.results("report").read_text()))
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
        _write_pages(json.loads(machine.results("report").read_text()))
    return 1 if wrong else 0


def keep(name: str, part: Any) -> None:
    """Put a part that is not timed into the stored results, and write the pages."""
    found = json.loads(machine.results("report").read_text()) | {name: part}
    table.store("report", found)
    _write_pages(found)


def _write_pages(found: dict[str, Any]) -> None:
    if machine.results("cold_start").exists():
        found["cold_start"] = json.loads(machine.results("cold_start").read_text())
    for name, text in pictures.draw(found).items():
        (DOCS / "pictures").mkdir(parents=True, exist_ok=True)
        (DOCS / "pictures" / name).write_text(text)
    found["filed"] = [row for row in found["filed"] if row["outcome"] != "not applicable"]  # older results have them
    (DOCS / "speed_and_error.md").write_text(page.text_of(found))
    path = machine.results("report").relative_to(machine.ROOT).as_posix()
    (DOCS / "speed_and_error.html").write_text(web_page.text_of(found, path))
    (DOCS / "museum.html").write_text(museum.text_of(found["filed"], filed.load(), path))
    head, _, rest = README.read_text().partition(BEGIN)
    README.write_text(f"{head}{BEGIN}\n{page.smallest(found)}{END}{rest.partition(END)[2]}")
