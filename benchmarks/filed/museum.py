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
         "overlay": "/v1/overlay", "collide": "/v1/collide", "hits": "/v1/hits", "distances": "/v1/distances",
         "volume": "/v1/volume", "cut": "/v1/cut", "section": "/v1/section", "overlap": "/v1/overlap"}  # fmt: skip
CLOSE = 2.0**-20
"""Part of the extent that an answer may be off by."""
SIDES = {"distances": 1, "section": 2, "volume": 3, "cut": 3, "overlap": 3}
"""How many of the box's sides, the longest, a number is a product of."""
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
        {key: case[key] for key in ("id", "thread", "about")} | {"made": case.get("made", False)}
        | {"files": files_of(case), "exact": exact_words(case), "request": request(case), "today": answered[case["id"]]}
        for case in cases if case["id"] in answered
    ]  # fmt: skip
    # files first, rules of boundaries last
    shown.sort(key=lambda one: (min(_rank(outcome) for _, outcome, *_ in one["today"]), not one["files"]))
    wrong = sum(row["contender"] == "ours" and row["outcome"] != "right" for row in rows)
    versions = dict.fromkeys(f"{row['contender']} {row['version']}" for row in rows if row["version"])
    return written("museum", {"cases": shown, "ours": wrong, "versions": ", ".join(versions), "results": path})


def files_of(case: Case) -> list[str]:
    """Return the names of the files that a case is read from."""
    given = case.get("given", {}).values()
    return [solid["file"] for solid in given if isinstance(solid, dict) and "file" in solid]


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
    if case["operation"] == "hits":
        kinds = {hit["segment"]: hit["kind"] for hit in exact if hit["segment"] in where}
        return kinds.keys() == set(where) and engine.HitKind.ACROSS not in kinds.values()
    if case["operation"] == "clip_segments":
        middles = np.array([[piece["start"], piece["end"]] for piece in exact]).mean(axis=1)
        return len(exact) > 0 and not engine.locate(middles, from_json(case["input"]["region"])[0]).any()
    is_located = case["operation"] == "locate" and bool(where)
    return exact == "touching" or (is_located and all(exact[item] == 0 for item in where))


def far_off(case: Case, answer: Any) -> list[int]:
    """Return which numbers of an answer are not the exact ones, up to rounding."""
    data, exact = case["input"], np.atleast_1d(case["answer"])
    solid = data.get("solid") or data["first"]
    corners = solid.get("vertices") or [corner for ring in solid["rings"] for corner in ring]
    sides = np.sort(np.ptp(np.array([*corners, *data.get("points", ())], float), axis=0))
    size = np.prod(sides[-SIDES[case["operation"]] :])
    close = np.abs(np.atleast_1d(np.asarray(answer, float)) - exact) <= CLOSE * size
    return np.flatnonzero(~close).tolist()


def places(hits: Any) -> list[tuple[int, float]]:
    """Return where segments are hit, several hits at one place, up to rounding, once."""
    result: list[tuple[int, float]] = []
    for segment, t in sorted((int(segment), float(t)) for segment, t in hits):
        if not result or segment != result[-1][0] or t - result[-1][1] > CLOSE:
            result.append((segment, t))
    return result


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
        case "hits":
            return f"{plural(len(exact), 'place')} hit"
        case "distances" | "section":
            return numbers(exact)
        case "volume" | "cut" | "overlap":
            return f"volume {exact!r}"
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
        case "hits":
            return said_of_lines(case, answer)
        case "distances" | "section":
            return numbers(answer), far_off(case, answer) if case["operation"] == "distances" else []
        case "volume" | "cut" | "overlap":
            return "not closed" if np.isnan(answer) else f"volume {float(answer)!r}", []
    return plural(len(answer), "piece"), []


def wrong_lines(case: Case, answer: Any) -> list[int]:
    """Return the segments that are hit elsewhere than exactly."""
    exact, result = places([(hit["segment"], hit["t"]) for hit in case["answer"]]), places(answer)
    wrong = []
    for number in range(len(case["input"]["segments"])):
        both = [[t for segment, t in some if segment == number] for some in (exact, result)]
        if len(both[0]) != len(both[1]) or any(abs(a - b) > CLOSE for a, b in zip(*both)):
            wrong.append(number)
    return wrong


def said_of_lines(case: Case, answer: Any) -> tuple[str, list[int]]:
    """Return how often the first segment that is hit elsewhere than exactly is hit, and all such segments."""
    wrong = wrong_lines(case, answer)
    exact, result = ([t for segment, t in places(hits) if segment == wrong[0]]
                     for hits in ([(hit["segment"], hit["t"]) for hit in case["answer"]], answer))  # fmt: skip
    which = f" of line {wrong[0] + 1}" if len(case["input"]["segments"]) > 1 else ""
    if len(exact) == len(result):
        return f"{len(wrong)} of the lines hit elsewhere, the first at {result[0]!r}, exactly {exact[0]!r}", wrong
    return f"{plural(len(result), 'place')}{which} hit, exactly {len(exact)}", wrong


def numbers(values: Any) -> str:
    """Return the first few numbers in words."""
    some = [float(value) for value in values]
    return ", ".join(map(repr, some[:3])) + (f" and {len(some) - 3} more" if len(some) > 3 else "")


def plural(count: int, word: str) -> str:
    """Return a count with its word."""
    return f"{count} {word}{'s' * (count != 1)}"
