"""docs/speed_and_error.html from stored results: one page that needs no other file, and the sentences of both pages."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.measure import interval

PAGES = Path(__file__).with_name("pages")
QUESTIONS: list[tuple[str, str, str, str]] = json.loads((PAGES / "questions.json").read_text("utf-8"))
"""Title, operation, its easy and its hard contest."""
N_FIRST = next(number for number, (title, *_) in enumerate(QUESTIONS) if title == "Bricks that touch")
"""Questions of the first list; contact, hits, cuts and layers are a list of their own."""
FACTS = ("commit", "processor", "cores", "seed", "load_before", "load_after", "seconds", "versions", "quick")
BAD = ("wrong", "refused", "outside")
SAME = 1.1
"""Two speeds are the same within this ratio."""
OURS = "exact-geometry"
CPP = "textbook: Sutherland-Hodgman in C++"
STEPS = ("1e-12", "1e-09", "1e-06")
"""By how much of the model's size hard items are moved, as the results name it."""
Row = dict[str, Any]


def key_of(row: Row) -> str:
    """Return operation and contest."""
    return f"{row['operation']}, {row['contest']}"


def failing(row: Row) -> int:
    """Return how many answers of a row are wrong, refused or out of its domain."""
    return sum(row["errors"].get(kind, 0) for kind in BAD)


def error_share(row: Row) -> float:
    """Return the share of wrong, refused and not taken among those judged."""
    return failing(row) / max(1, row["errors"]["judged"])


def percent(share: float) -> str:
    """Return a share in words."""
    return "0" if share == 0 else f"{100 * share + 1e-9:.2g}%" if share < 0.995 else "100%"


def with_interval(row: Row, kind: str = "wrong") -> str:
    """Return a share with its 95% interval."""
    count, total = row["errors"].get(kind, 0), row["errors"].get("judged", 0)
    low, high = interval(count, total)
    return f"{percent(count / max(1, total))} ({percent(low)} to {percent(high)})"


def shown(contender: str) -> str:
    """Return the name of a contender as the pages have it."""
    return (
        re.sub("^ours", OURS, contender).replace("another half-line", "ray recast").replace("half-line", "ray casting")
    )


def tone(ratio: float) -> str:
    """Say whether that many times faster is faster, the same, or slower."""
    return "same" if 1 / SAME <= ratio <= SAME else "faster" if ratio > 1 else "slower"


def number(ratio: float) -> str:
    """Return a ratio with two digits."""
    return f"{ratio:.2g}" if ratio < 9.95 else f"{ratio:,.0f}"


def times(ratio: float) -> str:
    """Say how many times faster ours is."""
    how = tone(ratio)
    return "the same as" if how == "same" else f"{number(max(ratio, 1 / ratio))}x {how} than"


def questions(rows: list[Row], titles: Sequence[tuple[str, str, str, str]] = QUESTIONS) -> list[dict[str, Any]]:
    """Return the questions that there are rows of: who is faster by how much, who is wrong, and both in a sentence."""
    result = []
    for number, (title, operation, easy, hard) in enumerate(titles):
        keys = [f"{operation}, {name}" for name in (easy, hard)]
        parts = [[row for row in rows if key_of(row) == key] for key in keys]
        if not any(parts):
            continue
        is_alone = not any(map(_peers, parts))
        sides = {side: _side(part, is_alone) for side, part in zip(("easy", "hard"), parts)}
        seen = [_seen(row) for row in _peers(parts[1] or parts[0], is_alone)]
        names = {"title": title, "id": title.lower().translate({ord(c): "-" for c in " ,?"}).strip("-")}
        keyed = {side: key if part else None for side, key, part in zip(("easy", "hard"), keys, parts)}
        near = next((row["near"] for row in parts[1] if row.get("near") is not None), None)
        say = _said(*parts) if titles is QUESTIONS else who_is_wrong(parts[1] or parts[0])
        made = {"sides": sides, "seen": seen, "is_alone": is_alone, "say": say, "near": near}
        made["is_more"] = number >= N_FIRST
        result.append(names | keyed | made)
    return result


def _peers(rows: list[Row], is_book: bool = False) -> list[Row]:
    """Return the peers that answered, or the textbook's methods, without turns of knobs, the fastest first."""
    remaining = [row for row in rows if row["rate"] and row.get("setting") is None]
    remaining = [
        row for row in remaining if (row["contender"].startswith(("textbook", "naive")) if is_book else row["package"])
    ]
    return sorted(remaining, key=lambda row: -row["rate"])


def _ours(rows: list[Row]) -> Row | None:
    return next((row for row in rows if row["contender"] == "ours"), None)


def _side(rows: list[Row], is_book: bool) -> dict[str, Any]:
    """Return how many times faster ours is than the fastest, who that is and how often it fails."""
    ours, others = _ours(rows), _peers(rows, is_book)
    if ours is None or not others:
        return {"ratio": None}
    return {"ratio": ours["rate"] / others[0]["rate"], "name": short(others[0]), "fails": error_share(others[0]),
            "seconds": [1 / ours["rate"], 1 / others[0]["rate"]]}  # fmt: skip


def short(row: Row) -> str:
    """Return the name of a package, or of a formula, without what it is called for."""
    name = shown(row["contender"]).removeprefix("textbook: ")
    return re.split(r",? |, ", name)[0] if row["package"] else name


def _seen(row: Row) -> dict[str, Any]:
    errors = row["errors"]
    made = {"name": short(row), "judged": max(1, errors["judged"])} | {kind: errors.get(kind, 0) for kind in BAD}
    rungs = [row.get("ladder", {}).get(step) for step in STEPS]
    return made | {"ladder": [share_of(rung) for rung in rungs if rung]}


def share_of(rung: Row) -> float:
    """Return the share of wrong answers among items that were moved away from the boundary."""
    return rung["wrong"] / max(1, rung["judged"])


def faults(each: dict[str, Any]) -> str:
    """Say how often one of the `seen` is wrong, refuses or does not take an item."""
    said = [f"{percent(each[kind] / each['judged'])}{' ' * bool(word)}{word}"
            for kind, word in zip(BAD, ("", "raised an error", "unsupported")) if each[kind]]  # fmt: skip
    return f"{each['name']} {', '.join(said) or '0'}"


def _said(easy: list[Row], hard: list[Row]) -> str:
    """Say who is faster on easy and on hard input, and who is wrong."""
    words = []
    for how, rows in (("Easy input", easy), ("Hard input", hard)):
        ours = _ours(rows)
        if ours is None:
            continue
        if bad := failing(ours):
            words.append(f"{how}: {OURS.upper()} IS WRONG in {bad} of {ours['errors']['judged']}.")
        words += _beside(how, ours, _peers(rows) or _peers(rows, is_book=True))
    return " ".join(words) or f"{OURS} alone."


def who_is_wrong(rows: list[Row]) -> str:
    """Say of an audit who is wrong: ours, the fastest peer, and the fastest that is never wrong, with their speeds."""
    ours, others = _ours(rows), _peers(rows) or _peers(rows, is_book=True)
    if ours is None:
        return f"{OURS} alone."
    kind = re.match(r"your (points|segments)", rows[0].get("about", ""))
    noun = kind[1] if kind else "answers"
    near, judged = rows[0].get("near"), ours["errors"]["judged"]
    half = "" if near is None else ", half of them almost on the boundary"
    words = [f"{OURS}: {failing(ours):,} wrong of {judged:,} {noun}{half}."]
    right = next((row for row in others if not failing(row)), None)
    for row in others[:1] + ([right] if right is not None and right is not others[0] else []):
        how, pace = (
            tone(row["rate"] / ours["rate"]),
            number(max(row["rate"] / ours["rate"], ours["rate"] / row["rate"])),
        )
        speed = "about as fast" if how == "same" else f"{pace} times {'as fast' if how == 'faster' else 'slower'}"
        total = max(1, row["errors"]["judged"])
        shares = [
            (row["errors"].get(kind, 0) / total, word) for kind, word in zip(BAD, ("wrong", "silent", "unsupported"))
        ]
        faulty = [f"{percent(share)} {word}" for share, word in shares if share]
        words.append(f"{short(row)}: {speed}, {' and '.join(faulty) or 'never wrong here'}.")
    return " ".join(words)


def _beside(how: str, ours: Row, others: list[Row]) -> list[str]:
    """Say how ours compares with the fastest, and where that one fails with the fastest that does not."""
    if not others:
        return []
    best = others[0]
    text = f"{how}: {times(ours['rate'] / best['rate'])} {best['contender']}"
    if failing(best):
        errors, silent = best["errors"], percent(error_share(best))
        text += ", " + (f"wrong in {with_interval(best)}" if errors["wrong"] else f"silent in {silent}")
        if right := next((other for other in others if not failing(other)), None):
            text += f"; {times(ours['rate'] / right['rate'])} {right['contender']}, never wrong here"
        else:
            quiet = [other["contender"] for other in others if not other["errors"]["wrong"]]
            text += f"; {' and '.join(quiet)} never wrong, but silent at times" if quiet else "; none is always right"
    return [f"{text}."]


def summary(queried: list[dict[str, Any]], rows: list[Row]) -> list[tuple[str, str, str, str]]:
    """Return three facts as a figure, its tone, what it counts, and in brief: ours wrong, easy input, hard input."""
    ours = [row for row in rows if row["contender"] == "ours"]
    wrong, judged = sum(map(failing, ours)), sum(row["errors"].get("judged", 0) for row in ours)
    words = f"answers of {OURS} are wrong, by exact arithmetic"
    facts = [(f"{wrong:,} of {judged:,}", "bad" if wrong else "good", words, "of our answers wrong")]
    for side in ("easy", "hard"):
        contained = [each["sides"][side] for each in queried if not each["is_alone"] and each["sides"][side]["ratio"]]
        slow = [each for each in contained if tone(each["ratio"]) == "slower"]
        words = f"questions on {side} input: faster than any peer, or within 10%"
        brief = f"{side} inputs: " + ("not slower than any peer" if side == "easy" else "likewise")
        failed = [each["fails"] for each in slow if each["fails"]]
        if failed:
            words += f"; {len(failed)} of the {len(slow)} peers that are faster give wrong or no answers"
            brief += f"; {len(failed)} of the {len(slow)} faster give wrong or no answers"
        if contained:
            facts.append(
                (f"{len(contained) - len(slow)} of {len(contained)}", "good" if not slow else "", words, brief)
            )
    return facts


def winners(rows: list[Row]) -> list[str]:
    """Return the questions at which a peer is faster and never wrong, on easy or hard input, the largest first."""
    found = []
    for title, operation, *names in QUESTIONS:
        best: list[tuple[float, str]] = []
        for how, name in zip(("easy", "hard"), names):
            mine = [row for row in rows if key_of(row) == f"{operation}, {name}"]
            ours, right = _ours(mine), [row for row in _peers(mine) if not failing(row)]
            if ours and right and tone(ours["rate"] / right[0]["rate"]) == "slower":
                best.append((right[0]["rate"] / ours["rate"], f"{short(right[0])}, {how}"))
        found += [(*max(best), title)] if best else []
    return [f"{title} {number(ratio)}x ({peer})" for ratio, peer, title in sorted(found, reverse=True)]


def costs(result: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Return what stands beside speed: its name, its figures, the best first, and how they were measured."""
    said = []
    for figure in result.get("figures", ()):
        rows, unit = figure["raw"].get("rows", {}), figure["unit"]
        way = -1 if unit == "x" else 1
        found = (f"{name} {number(value)} {unit}" for name, value in sorted(rows.items(), key=lambda row: way * row[1]))
        if "rows" in figure["raw"]:
            said.append((figure["name"], "; ".join(found), figure["note"]))
    beside = [_beside_cpp(row, result["rows"]) for row in result["rows"] if row["contender"] == CPP and row["rate"]]
    if beside:
        how = "float64, a page of code, compiled here; exact-geometry decides exactly and rounds each coordinate once"
        said.append(("Sutherland-Hodgman in C++", "; ".join(beside), how))
    return said


def _beside_cpp(cpp: Row, rows: list[Row]) -> str:
    ours = next(row for row in rows if row["contender"] == "ours" and key_of(row) == key_of(cpp))
    return f"{cpp['contest']}: {number(cpp['rate'] / ours['rate'])}x as fast, {percent(error_share(cpp))} wrong"


def verdicts(rows: list[Row]) -> list[tuple[str, str, str, str]]:
    """Return the verdicts of an audit, judged by the exact engine: how many are wrong, and the worst."""
    others = [row for row in rows if row["contender"] != "ours" and not row["absent"]]
    wrong = sorted((row for row in others if failing(row)), key=error_share)
    words = "contenders differ from the exact engine"
    facts = [(f"{len(wrong)} of {len(others)}", "bad" if wrong else "good", words, "contenders differ")]
    if wrong:
        worst = shown(wrong[-1]["contender"])
        facts.append(
            (
                percent(error_share(wrong[-1])),
                "bad",
                f"of the answers of {worst} are wrong, the worst",
                f"worst: {worst}",
            )
        )
    return facts


def _contest(rows: list[tuple[int, Row]]) -> dict[str, Any]:
    made = []
    for i, row in rows:
        errors = row["errors"]
        kind = "ours" if row["contender"] == "ours" else "peer" if row["package"] else "book"
        one = {"i": i, "name": shown(row["contender"]), "label": short(row), "kind": kind}
        one |= {key: errors.get(key, 0) for key in ("judged", *BAD, "off", "coordinates")}
        one |= {key: row.get(key) for key in ("absent", "setting", "rate", "build", "first", "latency", "worst")}
        one["where"] = errors.get("where", ())
        made.append(one | {"ulp": errors.get("ulp_largest", 0)})
    first = rows[0][1]
    return {"name": first["contest"], "hard": first["is_hard"], "about": first.get("about", ""), "rows": made}


def text_of(result: dict[str, Any], path: str, titles: Sequence[tuple[str, str, str, str]] = QUESTIONS) -> str:
    """Return the page; path: of the results, from the root of the repository; titles: as `QUESTIONS`."""
    rows, contests = result["rows"], {}
    queried = questions(rows, titles)
    for key in [question[side] for question in queried for side in ("easy", "hard") if question[side]]:
        contests[key] = _contest([(i, row) for i, row in enumerate(rows) if key_of(row) == key])
    data = {
        "facts": {key: result[key] for key in FACTS} | {"results": path},
        "summary": summary(queried, rows) if titles is QUESTIONS else verdicts(rows),
        "versus": f"{OURS} beside the fastest peer" if titles is QUESTIONS else "Your data",
        "winners": winners(rows) if titles is QUESTIONS else [],
        "museum": titles is QUESTIONS,
        "own": "" if titles is QUESTIONS else titles[0][0],
        "costs": costs(result) if titles is QUESTIONS else [],
        "questions": queried,
        "contests": contests,
    }
    return written("speed_and_error", data)


def written(name: str, data: dict[str, Any]) -> str:
    """Return a page with its style, its script and its data within."""
    text = (PAGES / f"{name}.html").read_text("utf-8")
    parts = {"STYLE": (PAGES / "style.css").read_text("utf-8"), "DRAWING": (PAGES / "drawing.js").read_text("utf-8"),
             "DATA": json.dumps(data, separators=(",", ":")).replace("</", "<\\/")}  # fmt: skip
    for mark, part in parts.items():
        text = text.replace(f"/*{mark}*/", part)
    return text
