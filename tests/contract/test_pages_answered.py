"""Every request on the pages of speed against error and of filed cases, sent to a service: the answer shown."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import httpx
import pytest

from benchmarks.errors import AREA_TOLERANCE
from benchmarks.filed import museum
from tests.unit.service.test_live import Service

DOCS = Path(__file__).resolve().parents[2] / "docs"
DATA = 'type="application/json">'


def data_of(name: str) -> dict[str, Any]:
    """Return what a page holds."""
    text = (DOCS / f"{name}.html").read_text("utf-8")
    return json.loads(text[text.index(DATA) + len(DATA) :].partition("</script>")[0])  # type: ignore[no-any-return]


WORST = {
    f"{key}, {row['name']}": row["worst"]
    for key, contest in data_of("speed_and_error")["contests"].items() for row in contest["rows"]
    if row["worst"].get("request", (None, None))[1]
}  # fmt: skip
FILED = {case["id"]: case for case in data_of("museum")["cases"]}


@pytest.fixture(scope="module")
def asked() -> Iterator[Any]:
    """Return what posts a request to a service on loopback and returns its answer."""
    service = Service(deadline_seconds=300)
    service.wait_until_ready()
    with httpx.Client(base_url=service.url, timeout=300) as client:

        def ask(request: tuple[str, dict[str, Any]]) -> dict[str, Any]:
            answer = client.post(request[0], json=request[1])
            assert answer.status_code == 200, answer.text
            return answer.json()  # type: ignore[no-any-return]

        yield ask
    service.close()


def ring_area(ring: list[list[float]]) -> Fraction:
    """Return the signed area of a ring's rounded vertices, exactly."""
    points = [[Fraction(x) for x in point] for point in ring]
    return sum((a[0] * b[1] - b[0] * a[1] for a, b in zip(points, points[1:] + points[:1])), Fraction(0)) / 2


def is_shown(path: str, answer: dict[str, Any], exact: Any, keep: str = "") -> bool:
    """Say whether an answer about one item is what the page of speed against error calls exact."""
    match path:
        case "/v1/contains":
            return answer["contained"] == [bool(exact)]
        case "/v1/collide":
            return (answer["collisions"][0]["relation"] != "disjoint") == bool(exact)
        case "/v1/distances":
            return answer["within"] == [bool(exact)] if "within" in answer else answer["distances"] == [exact]
        case "/v1/clearance":
            return answer["clearances"][0]["distance"] == exact
        case "/v1/clip/segments":
            pieces = [[*piece["start"], *piece["end"]] for piece in answer["pieces"]]
            return pieces[:1] == ([] if exact[0] is None else [exact])
        case "/v1/clip/polygons":
            rings = [ring for polygon in answer["polygons"] for ring in polygon["rings"]]
            off = sum(map(abs, map(ring_area, rings)), Fraction(0)) - Fraction(exact[0])
            return abs(off) <= Fraction(AREA_TOLERANCE) * Fraction(exact[1])  # of rounded vertices
        case "/v1/overlay":
            return answer["area"] == exact[0]
        case "/v1/volume":
            return answer["volume"] == exact[0]
        case "/v1/cut":
            return answer["parts"][0]["volume"] == exact[0]
        case "/v1/section":
            return abs(sum(piece["area"] for piece in answer["sections"][0]["pieces"]) - exact[0]) <= 1e-12 * exact[1]
        case "/v1/hits" if "met" in answer:
            return answer["met"] == [bool(exact)]
        case "/v1/hits":
            places = [hit["t"] for hit in answer["hits"]]
            return places == ([] if exact is None else [exact]) if keep == "first" else len(places) == exact
    raise AssertionError(path)


@pytest.mark.parametrize("name", WORST)
def test_the_worst_answer_of_a_contender_is_asked_again(asked: Any, name: str) -> None:
    worst = WORST[name]
    answer = asked(worst["request"])
    assert is_shown(worst["request"][0], answer, worst["exact"], worst["request"][1].get("keep", "")), answer
    assert worst["answer"] != worst["exact"]


def words_of(case: dict[str, Any], answer: dict[str, Any]) -> str:
    """Return what the museum says of an answer of the service."""
    match case["request"][0]:
        case "/v1/contains":
            boundary = set(answer["boundary"])
            places = [0 if i in boundary else 1 if held else -1 for i, held in enumerate(answer["contained"])]
            return museum.exact_words({"operation": "locate", "answer": places})
        case "/v1/collide":
            return museum.exact_words({"operation": "collide", "answer": answer["collisions"][0]["relation"]})
        case "/v1/collide/scene":
            relations = [pair["relation"] for pair in answer["pairs"]]
            return museum.exact_words({"operation": "collide", "answer": (relations or ["disjoint"])[0]})
        case "/v1/overlay":
            return f"area {answer['area']!r} in {museum.plural(answer['rounding']['pieces_exact'], 'polygon')}"
        case "/v1/clip/polygons":
            return museum.plural(len(answer["polygons"]), "polygon") + " left"
        case "/v1/hits":
            return museum.exact_words({"operation": "hits", "answer": answer["hits"]})
        case "/v1/distances":
            return museum.exact_words({"operation": "distances", "answer": answer["distances"]})
        case "/v1/section":
            areas = [math.fsum(piece["area"] for piece in one["pieces"]) for one in answer["sections"]]
            return museum.exact_words({"operation": "section", "answer": areas})
        case "/v1/volume":
            return f"volume {answer['volume']!r}"
        case "/v1/cut":
            return f"volume {answer['parts'][0]['volume']!r}"
        case "/v1/overlap":
            return f"volume {answer['overlaps'][0]['overlap']!r}"
    return museum.plural(len(answer["pieces"]), "piece") + " left"


@pytest.mark.parametrize("name", FILED)
def test_a_case_of_the_museum_has_the_answer_shown(asked: Any, name: str) -> None:
    case = FILED[name]
    assert words_of(case, asked(case["request"])) == case["exact"]
