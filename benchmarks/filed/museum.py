"""docs/museum.html: every filed case with its drawing, the exact answer, and each contender's current answer."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from typing import Any

import numpy as np

import engine
from benchmarks.web_page import written
from engine.files.solids import from_json

PATHS = {"locate": "/v1/contains", "clip_segments": "/v1/clip/segments", "clip_polygons": "/v1/clip/polygons",
         "overlay": "/v1/overlay", "collide": "/v1/collide"}  # fmt: skip
PLACES = {-1: "outside", 0: "on the boundary", 1: "inside"}
Case = dict[str, Any]


def text_of(rows: list[dict[str, Any]], cases: list[Case], path: str) -> str:
    """Return the page; rows: of `replay`; path: of the results that they stand in."""
    answered: dict[str, list[Any]] = {}
    known = {case["id"]: case for case in cases}
    for row in rows:
        if row["outcome"] != "absent" and row["contender"] != "ours":
            where, case = row.get("where", []), known[row["case"]]
            is_rule = row["outcome"] == "wrong" and is_on_boundary(case, where)
            one = [row["contender"], "another rule" if is_rule else row["outcome"], row["note"], where]
            answered.setdefault(row["case"], []).append(one)
    shown = [
        {key: case[key] for key in ("id", "thread", "about")}
        | {"exact": exact_words(case), "request": request(case), "today": answered[case["id"]]}
        for case in cases if case["id"] in answered
    ]  # fmt: skip
    shown.sort(key=lambda one: min(_rank(outcome) for _, outcome, *_ in one["today"]))  # rules of boundaries last
    wrong = sum(row["contender"] == "ours" and row["outcome"] != "right" for row in rows)
    versions = dict.fromkeys(f"{row['contender']} {row['version']}" for row in rows if row["version"])
    return written("museum", {"cases": shown, "ours": wrong, "versions": ", ".join(versions), "results": path})


def _rank(outcome: str) -> int:
    return {"wrong": 0, "right": 3, "another rule": 2}.get(outcome, 1)


def request(case: Case) -> tuple[str, dict[str, Any]]:
    """Return path and body of the request to the service; posed bodies become a scene of two."""
    data = case["input"]
    if "first_pose" in data or "second_pose" in data:
        bodies = [{"solid": data[key]} | ({"pose": data[f"{key}_pose"]} if f"{key}_pose" in data else {})
                  for key in ("first", "second")]  # fmt: skip
        return "/v1/collide/scene", {"bodies": bodies}
    return PATHS[case["operation"]], data


def is_on_boundary(case: Case, where: list[int]) -> bool:
    """Return whether the wrong items are on the boundary or only touch, where libraries may define another answer."""
    exact = case["answer"]
    if case["operation"] == "clip_segments":
        middles = np.array([[piece["start"], piece["end"]] for piece in exact]).mean(axis=1)
        return len(exact) > 0 and not engine.locate(middles, from_json(case["input"]["region"])[0]).any()
    return exact == "touching" or (bool(where) and all(exact[item] == 0 for item in where))


def exact_words(case: Case) -> str:
    """Return the exact answer in words."""
    exact = case["answer"]
    match case["operation"]:
        case "locate":
            if len(exact) == 1:
                return PLACES[exact[0]]
            counts = Counter(exact)
            return ", ".join(f"{counts[place]} {word}" for place, word in PLACES.items() if counts[place])
        case "collide":
            return str(exact).replace("_", " ")
        case "overlay":
            area = float(Fraction(*(int(part, 16) for part in exact["area"].split("/"))))
            return f"area {area!r} in {plural(exact['pieces'], 'polygon')}"
        case "clip_polygons":
            return f"{plural(sum(map(len, exact)), 'polygon')} left"
    return f"{plural(len(exact), 'piece')} left"


def said(case: Case, answer: Any) -> tuple[str, list[int]]:
    """Return a contender's answer in words, and the items that it gets wrong, if any."""
    match case["operation"]:
        case "locate":
            wrong = [
                i for i, (contained, place) in enumerate(zip(answer, case["answer"])) if bool(contained) != (place >= 0)
            ]
            first = f"{'inside' if answer[wrong[0]] else 'outside'}, where exact is {PLACES[case['answer'][wrong[0]]]}"
            return (first if len(answer) == 1 else f"{len(wrong)} of {len(answer)} points, the first {first}"), wrong
        case "collide":
            return ("a common point" if answer else "no common point"), []
        case "overlay" | "clip_polygons":
            return f"area {float(sum(answer) if case['operation'] == 'clip_polygons' else answer)!r}", []
    return plural(len(answer), "piece"), []


def plural(count: int, word: str) -> str:
    """Return a count with its word."""
    return f"{count} {word}{'s' * (count != 1)}"
