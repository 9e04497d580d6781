"""docs/speed_and_error.html from stored results: one page that needs no other file, and the sentences of both pages."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.measure import interval

TEMPLATE = Path(__file__).with_name("web_page.html")
QUESTIONS = (
    ("Points in a mesh", "containment 3D", "uniform", "boundary"),
    ("Points in a polygon", "containment 2D", "uniform", "boundary"),
    ("Points in a convex polygon", "containment, convex polygon", "uniform", "boundary"),
    ("Points in half-spaces", "containment, half-spaces", "uniform", "on a plane"),
    ("Points in a prism", "containment, triangle in space", "", "on its walls"),
    ("Do two bodies meet?", "collision", "apart or crossing", "contact"),
    ("Bodies under poses", "collision", "", "near contact, 1k"),
    ("Which of five relations?", "collision", "", "contact, which relation"),
    ("How far apart are two bodies?", "clearance", "1k faces, mixed", "nearly in contact"),
    ("How far apart are two polygons?", "clearance", "", "polygons nearly in contact"),
    ("Segments, box, plane", "clipping segments", "box 2D, random", "box 2D, corners"),
    ("Segments, box, space", "clipping segments", "box 3D, random", "box 3D, corners"),
    ("Segments, 20 planes", "clipping segments", "", "20 planes, edges"),
    ("Segments, sphere", "clipping segments", "", "sphere, tangents"),
    ("Polygons on a box", "clipping polygons", "random stars", "along the box"),
    ("Polygons on polygons", "overlay", "random stars", "lattice"),
    ("Polygons that users filed", "overlay", "", "public suites"),
    ("Sign of a determinant, 2D", "orientation 2D", "random", "nearly degenerate"),
    ("Sign of a determinant, 3D", "orientation 3D", "random", "nearly degenerate"),
)
"""Title, operation, its easy and its hard contest."""
FACTS = ("commit", "processor", "cores", "seed", "load_before", "load_after", "seconds", "versions", "quick")
BAD = ("wrong", "refused", "outside")
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
    return "0" if share == 0 else f"{100 * share:.2g}%" if share < 0.995 else "100%"


def with_interval(row: Row, kind: str = "wrong") -> str:
    """Return a share with its 95% interval."""
    count, total = row["errors"].get(kind, 0), row["errors"].get("judged", 0)
    low, high = interval(count, total)
    return f"{percent(count / max(1, total))} ({percent(low)} to {percent(high)})"


def number(ratio: float) -> str:
    """Return a ratio with two digits."""
    return f"{ratio:.2g}" if ratio < 9.95 else f"{ratio:,.0f}"


def times(ratio: float) -> str:
    """Say how many times faster ours is."""
    shown = number(max(ratio, 1 / ratio))
    return "as fast as" if shown == "1" else f"{shown}x {'faster' if ratio > 1 else 'slower'} than"


def questions(rows: list[Row], titles: Sequence[tuple[str, str, str, str]] = QUESTIONS) -> list[dict[str, Any]]:
    """Return the questions that there are rows of, each with a sentence."""
    found = []
    for title, operation, easy, hard in titles:
        keys = [f"{operation}, {name}" for name in (easy, hard)]
        parts = [[row for row in rows if key_of(row) == key] for key in keys]
        if any(parts):
            sides = {side: key if part else None for side, key, part in zip(("easy", "hard"), keys, parts)}
            tag, tone, say = _said(*parts)
            names = {"title": title, "id": title.lower().translate({ord(c): "-" for c in " ,?"}).strip("-")}
            found.append(names | sides | {"tag": tag, "tone": tone, "say": say})
    return found


def _peers(rows: list[Row], is_book: bool = False) -> list[Row]:
    """Return the peers that answered, or the textbook's methods, without turns of knobs, the fastest first."""
    kept = [row for row in rows if row["rate"] and row.get("setting") is None]
    kept = [row for row in kept if (row["contender"].startswith(("textbook", "naive")) if is_book else row["package"])]
    return sorted(kept, key=lambda row: -row["rate"])


def _said(easy: list[Row], hard: list[Row]) -> tuple[str, str, str]:
    """Return two words, their tone and a sentence: who is faster on easy and on hard input, and who is wrong."""
    words, ratios, is_wrong = [], [], False
    for how, rows in (("Easy input", easy), ("Hard input", hard)):
        ours, peers = next((row for row in rows if row["contender"] == "ours"), None), _peers(rows)
        if ours is None:
            continue
        if bad := failing(ours):
            words.append(f"{how}: OURS IS WRONG in {bad} of {ours['errors']['judged']}.")
            is_wrong = True
        if peers:
            ratios.append(ours["rate"] / peers[0]["rate"])
        words += _beside(how, ours, peers or _peers(rows, is_book=True))
    text = " ".join(words) or "Ours alone."
    if is_wrong:
        return "ours is wrong", "bad", text
    if not ratios:
        return "no peer", "", text
    cost = 1 / min(ratios)
    return ("exact is free", "good", text) if cost < 1.1 else (f"exact costs {number(cost)}x", "", text)


def _beside(how: str, ours: Row, others: list[Row]) -> list[str]:
    """Say how ours compares with the fastest, and where that one is wrong with the fastest that is not."""
    if not others:
        return []
    best = others[0]
    text = f"{how}: {times(ours['rate'] / best['rate'])} {best['contender']}"
    if failing(best):
        errors = best["errors"]
        silent = f"silent in {percent(error_share(best))}"
        text += ", " + (f"wrong in {with_interval(best)}" if errors["wrong"] else silent)
        right = [other for other in others if not failing(other)]
        text += "; " + (
            f"{times(ours['rate'] / right[0]['rate'])} {right[0]['contender']}, never wrong here"
            if right
            else "none of them is always right"
        )
    return [f"{text}."]


def _contest(rows: list[tuple[int, Row]]) -> dict[str, Any]:
    made = []
    for i, row in rows:
        errors = row["errors"]
        kind = "ours" if row["contender"] == "ours" else "peer" if row["package"] else "book"
        one = {"i": i, "name": row["contender"], "setting": row.get("setting"), "kind": kind, "absent": row["absent"]}
        one |= {key: errors.get(key, 0) for key in ("judged", *BAD, "off", "coordinates")}
        one |= {key: row.get(key) for key in ("rate", "build", "first", "latency", "worst")}
        one["where"] = errors.get("where", ())
        made.append(one | {"ulp": errors.get("ulp_largest", 0)})
    first = rows[0][1]
    return {"name": first["contest"], "hard": first["is_hard"], "about": first.get("about", ""), "rows": made}


def text_of(
    found: dict[str, Any],
    path: str,
    titles: Sequence[tuple[str, str, str, str]] = QUESTIONS,
    judge: str = "rational arithmetic",
) -> str:
    """Return the page; path: of the results, from the root of the repository; titles: as `QUESTIONS`."""
    rows, contests = found["rows"], {}
    asked = questions(rows, titles)
    for key in [question[side] for question in asked for side in ("easy", "hard") if question[side]]:
        contests[key] = _contest([(i, row) for i, row in enumerate(rows) if key_of(row) == key])
    ours = [row for row in rows if row["contender"] == "ours"]
    free = sum(question["tag"] == "exact is free" for question in asked)
    data = {
        "facts": {key: found[key] for key in FACTS} | {"results": path},
        "judge": judge,
        "wrong": sum(map(failing, ours)),
        "judged": sum(row["errors"].get("judged", 0) for row in ours),
        "summary": f"In {free} of {len(asked)} questions that costs nothing; the others say what it costs.",
        "questions": asked,
        "contests": contests,
    }
    text = json.dumps(data, separators=(",", ":")).replace("</", "<\\/")
    return TEMPLATE.read_text("utf-8").replace("/*DATA*/", text)
