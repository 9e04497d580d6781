"""Every sentence and figure of the committed pages follows from the stored results, read here by other code."""

from __future__ import annotations

import copy
import json
import re
from itertools import groupby
from typing import Any

import pytest

from benchmarks import hard_cases, machine, report, web_page

RESULTS = report.named_by_the_page()
FOUND: dict[str, Any] = json.loads(RESULTS.read_text("utf-8"))
PAGE = (report.DOCS / "speed_and_error.html").read_text("utf-8")
DATA = json.loads(PAGE[PAGE.index('type="application/json">') + 24 :].partition("</script>")[0])
SHOWN = {"textbook: half-line": "textbook: ray casting", "textbook: another half-line": "textbook: ray recast"}
SPEED = re.compile(r"(?:([\d,.]+)x (faster|slower) than|the same as) ")
SHARE = re.compile(r"wrong in ([\d.]+)% \(([\d.]+)%? to ([\d.]+)%\)|silent in ([\d.]+)%")


def rows_of(contest: str, found: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the rows of a contest by contender, without those of a knob."""
    mine = (row for row in found["rows"] if f"{row['operation']}, {row['contest']}" == contest)
    return {row["contender"]: row for row in mine if row["setting"] is None and row["rate"]}


def is_near(said: float, value: float) -> bool:
    """Say whether a figure of two digits is the one that a value is rounded to."""
    return abs(said - value) <= 0.051 * abs(value) + 0.5 * (value >= 9.95)


def wrong_claims(sentence: str, rows: dict[str, dict[str, Any]]) -> list[str]:
    """Return the parts of a sentence about one contest that its rows do not bear out."""
    bad, rate = [], rows["ours"]["rate"]
    for found in SPEED.finditer(sentence):
        rest = sentence[found.end() :]
        name = max((name for name in rows if rest.startswith(name)), key=len, default=None)
        ratio = 0.0 if name is None else rate / rows[name]["rate"]
        said = float(found[1].replace(",", "")) if found[1] else 1.0
        is_true = (
            1 / 1.1 <= ratio <= 1.1 if not found[1] else is_near(said, 1 / ratio if found[2] == "slower" else ratio)
        )
        if name is None or not is_true:
            bad.append(found[0] + rest[:30])
            continue
        errors, tail = rows[name]["errors"], rest[len(name) :].partition(";")[0]
        failing = failing_of(rows[name])
        share = SHARE.search(tail)
        if (share is None) != (failing == 0 or "never wrong" in tail):
            bad.append(tail)
        elif share is not None:
            count = errors["wrong"] if share[1] else failing
            if not is_near(float(share[1] or share[4]), 100 * count / errors["judged"]):
                bad.append(tail)
    peers = peers_of(rows)
    quiet = [row["contender"] for row in peers if not row["errors"]["wrong"]]
    if "none is always right" in sentence and quiet:
        bad.append(f"{quiet} are not wrong")
    for name in re.findall(r"(?:; | and )([^;]+?)(?= and | never wrong, but)", sentence):
        bad += [] if name in quiet and failing_of(rows[name]) else [f"{name} is not silent alone"]
    return bad


def peers_of(rows: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the peers among rows, or the textbook's methods where no other library takes part."""
    books = [row for name, row in rows.items() if name.startswith(("textbook", "naive"))]
    return [row for row in rows.values() if row["package"]] or books


def failing_of(row: dict[str, Any]) -> int:
    """Return how many answers are wrong, refused or not taken."""
    return int(sum(row["errors"].get(kind, 0) for kind in ("wrong", "refused", "outside")))


def claims(found: dict[str, Any]) -> list[str]:
    """Return what the committed page claims and these results do not bear out."""
    bad = []
    for asked in DATA["questions"]:
        sides = {side: rows_of(asked[side], found) for side in ("easy", "hard") if asked[side]}
        said = re.split(r"(?:^| )(?=(?:Easy|Hard) input: )", asked["say"])[1:]
        is_alone = asked["say"] == "exact-geometry alone." and not any(map(peers_of, sides.values()))
        bad += [] if len(said) == len(sides) or is_alone else [asked["say"]]
        for sentence, (side, rows) in zip(said, sides.items()):
            bad += wrong_claims(sentence, rows)
            ratio = rows["ours"]["rate"] / max(row["rate"] for row in peers_of(rows))
            if asked["sides"][side]["ratio"] != ratio:
                bad.append(f"{asked['title']}: {asked['sides'][side]}")
        shown = rows_of(asked["hard"] or asked["easy"], found).values()
        counts = sorted((row["errors"]["wrong"], row["errors"]["judged"]) for row in shown)
        if any((each["wrong"], each["judged"]) not in counts for each in asked["seen"]):
            bad.append(f"{asked['title']}: {asked['seen']}")
    return bad + wrong_figures(found)


def wrong_figures(found: dict[str, Any]) -> list[str]:
    """Return the rows of the page's tables that are not those of the results, and the first words if they are not."""
    bad = []
    for key, contest in DATA["contests"].items():
        for row in contest["rows"]:
            line = found["rows"][row["i"]]
            same = [
                row[name] == line["errors"].get(name, 0) for name in ("judged", "wrong", "refused", "outside", "off")
            ]
            same += [row[name] == line[name] for name in ("rate", "build", "first", "latency", "setting", "worst")]
            if (
                not all(same)
                or key != f"{line['operation']}, {line['contest']}"
                or row["name"] != SHOWN.get(line["contender"], line["contender"].replace("ours", "exact-geometry"))
            ):
                bad.append(f"{key}: {row['name']}")
    ours = [row["errors"] for row in found["rows"] if row["contender"] == "ours"]
    total = [sum(errors.get(name, 0) for errors in ours for name in names)
             for names in (("wrong", "refused", "outside"), ("judged",))]  # fmt: skip
    return bad if DATA["summary"][0][0] == f"{total[0]:,} of {total[1]:,}" else [*bad, DATA["summary"][0][0]]


def test_the_page_names_results_that_are_there() -> None:
    assert DATA["facts"]["results"] == RESULTS.relative_to(machine.ROOT).as_posix()
    assert DATA["facts"]["commit"] == FOUND["commit"]


def test_every_sentence_and_every_figure_follows_from_its_rows() -> None:
    assert claims(FOUND) == []


def test_ours_is_asked_in_every_contest_and_wrong_in_none_or_said_first() -> None:
    key = lambda row: (row["operation"], row["contest"])  # noqa: E731
    for contest, rows in groupby(sorted(FOUND["rows"], key=key), key):
        assert "ours" in [row["contender"] for row in rows], contest


CHANGES = {
    "ours is slower than was measured": lambda row: row.update(rate=0.8 * row["rate"]) if is_ours(row) else None,
    "a peer is faster": lambda row: row.update(rate=1.3 * row["rate"]) if row["package"] else None,
    "peers are wrong more often": lambda row: (
        row["errors"].update(wrong=row["errors"]["judged"]) if row["package"] else None
    ),
    "ours is wrong once": lambda row: row["errors"].update(wrong=1) if is_ours(row) else None,
    "fewer are judged": lambda row: row["errors"].update(judged=row["errors"]["judged"] // 2),
}


def is_ours(row: dict[str, Any]) -> bool:
    return bool(row["contender"] == "ours")


@pytest.mark.parametrize("change", CHANGES)
def test_other_results_would_be_told(change: str) -> None:
    """The check can fail: on results that differ in one way every question it touches is named."""
    other = copy.deepcopy(FOUND)
    for row in other["rows"]:
        CHANGES[change](row)  # type: ignore[no-untyped-call]
    assert len(claims(other)) >= len(DATA["contests"]) / 2, change


def test_the_committed_files_are_what_the_results_give() -> None:
    """Whoever changes a page or a case runs ``python -m benchmarks report --pages``."""
    for path, text in report.pages_of(RESULTS).items():
        assert path.read_text("utf-8") == text, path.name


def test_every_question_of_the_page_is_there() -> None:
    assert [each["title"] for each in DATA["questions"]] == [title for title, *_ in web_page.QUESTIONS]


# --- The catalogue of hard cases shows pictures that are drawn and figures of every set that it names ---


TEXT = hard_cases.PAGE.read_text("utf-8")


def test_every_picture_is_stored_and_shown() -> None:
    shown = re.findall(r"\(pictures/hard_(\w+)\.svg\)", TEXT)
    stored = (hard_cases.PAGE.parent / "pictures").glob("hard_*.svg")
    assert sorted(shown) == sorted(path.stem.removeprefix("hard_") for path in stored)


def test_every_set_has_its_figures_and_none_of_ours_is_wrong() -> None:
    for mark in hard_cases.MARK.finditer(TEXT):
        wanted, lines = mark[1].split("; "), mark[0].splitlines()[1:]
        assert [line.split("*")[1] for line in lines] == wanted
        assert all("**ours 0**" in line for line in lines)
        assert {each.split(" ")[0] for each in wanted} <= set(hard_cases.SETS)


def test_a_line_of_figures() -> None:
    found = hard_cases.sentence("cases x/y", {"ours": (0, 8), "a": (3, 5), "b": (0, 8)})
    assert found == "- *cases x/y* (8): **ours 0**, b 0, a 3 of 5\n"
