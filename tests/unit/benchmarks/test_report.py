"""The report runs without any peer, counts right and wrong answers, and writes its page."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks import errors, machine, page, workloads
from benchmarks.contenders import Prepared
from benchmarks.contenders.with_ours import ring_areas
from benchmarks.contest import Contender, Contest, Row, Size, run_contest, sketch
from benchmarks.fields import costs, tasks

pytest.importorskip("gmpy2", reason="exact answers need gmpy2")


def held(**answers: object) -> list[Row]:
    """Return the rows of a contest on the numbers 0..99: is a number even?"""
    items = np.arange(100)
    contenders = [Contender(name, lambda ask=ask: Prepared(ask)) for name, ask in answers.items()]
    return run_contest(Contest("numbers", "even", True, items, items % 2 == 0, errors.same, contenders), 3, 0.1)


@pytest.mark.full
def test_right_wrong_refused_and_absent_are_told_apart() -> None:
    def absent() -> object:
        raise ImportError("no such package")

    right, wrong, refused = held(
        ours=lambda items: items % 2 == 0,
        never=lambda items: np.zeros(len(items)),
        odd=lambda items: np.where(items % 2, errors.REFUSED, 1),
    )
    assert (right.errors["wrong"], right.errors["refused"], right.errors["judged"]) == (0, 0, 100)
    assert (wrong.errors["wrong"], refused.errors["refused"], refused.errors["wrong"]) == (50, 50, 0)
    assert right.rate > 0
    rows = run_contest(Contest("n", "e", True, np.arange(3), np.ones(3), errors.same, [Contender("x", absent)]), 1, 0.1)
    assert rows[0].absent == "ImportError: no such package"


def test_from_where_on_a_contender_is_right_stands_in_its_row() -> None:
    """Of numbers that are moved away from whole ones, a contender that rounds to ninths is right from 1e-9 on."""
    items = np.arange(0.0, 100.0)

    def moved(step: float) -> tuple[np.ndarray, np.ndarray]:
        other = items[:40] + step
        return other, other > np.floor(other)

    asked = [Contender("ours", lambda: Prepared(lambda x: x > np.floor(x))),
             Contender("peer", lambda: Prepared(lambda x: np.round(x, 9) > np.floor(x)))]  # fmt: skip
    contest = Contest("n", "e", True, items, items > np.floor(items), errors.same, asked, moved=moved, near=0.25)
    ours, peer = run_contest(contest, 1, 0.01, has_latency=True)
    assert (ours.near, peer.near) == (0.25, 0.25)
    assert [(step, rung["judged"], rung["wrong"]) for step, rung in peer.ladder.items()] == [
        ("1e-12", 40, 40), ("1e-09", 40, 0), ("1e-06", 40, 0)]  # fmt: skip
    assert all(rung["wrong"] == 0 for rung in ours.ladder.values())


def test_coordinates_are_judged_in_ulps() -> None:
    exact = np.array([[1.0, 2.0], [np.nan, np.nan], [1.0, 1.0]])
    answers = np.array([[1.0, 2.0 + 2**-50], [0.0, 0.0], [1.0, 1.0]])
    found = errors.coordinates(answers, exact)
    assert (found["wrong"], found["off"], found["coordinates"], found["ulp_largest"]) == (1, 1, 4, 2.0)


def test_areas_are_wrong_beyond_a_millionth() -> None:
    exact = np.array([[1.0, 1.0], [1.0, 1.0], [1.0, 1.0]])
    found = errors.areas(np.array([1.0, 1.001, np.nan]), exact)
    assert (found["wrong"], found["refused"], found["ulp_largest"]) == (1, 1, 0.0)


def test_every_judge_of_numbers_tells_what_the_page_shows() -> None:
    """A distance that is refused or not taken counts as neither right nor off."""
    found = errors.distances(np.array([1.0, 2.0 + 2**-51, np.nan, np.inf, 0.0]), np.array([1.0, 2.0, 1.0, 1.0, 1.0]))
    assert (found["wrong"], found["refused"], found["outside"], found["off"], found["coordinates"]) == (1, 1, 1, 1, 2)
    pieces = errors.coordinates(np.ones((1, 2)), np.ones((1, 2)))
    area = errors.areas(np.ones(1), np.ones((1, 2)))
    assert all({"ulp_largest", "ulp_median"} <= set(each) for each in (found, pieces, area))


@pytest.mark.full
@pytest.mark.parametrize("field", ["clearance", "distances", "polygons", "segments"])
def test_ours_has_no_wrong_answer(field: str) -> None:
    for task in tasks(Size(0, 0.01), (field,), is_page=True):
        each = task.make()
        mine = [contender for contender in each.contenders if contender.name == "ours" or "textbook" in contender.name]
        only = Contest(each.operation, each.name, each.is_hard, each.items, each.exact, each.judge, mine)
        row = run_contest(only, 1, 0.01, has_latency=True)[0]
        assert row.errors["judged"] > 0
        assert row.errors["wrong"] + row.errors["refused"] + row.errors.get("off", 0) == 0


def test_a_body_too_large_to_be_shown_is_drawn_by_some_of_its_faces() -> None:
    mesh = workloads.bumpy_sphere("sketch", 0, 4)
    rings = [[[k, k * k] for k in range(2000)]]
    body = {"first": workloads.document(mesh), "second": {"type": "polygon", "rings": rings}}
    found = sketch(body)
    assert len(json.dumps(found)) < 60_000 < len(json.dumps(body))
    assert 200 < len(found["first"]["faces"]) <= 300
    assert {vertex for face in found["first"]["faces"] for vertex in face} == set(
        range(len(found["first"]["vertices"]))
    )
    assert 200 < len(found["second"]["rings"][0]) <= 300


@pytest.mark.parametrize(("n_cores", "runs"), [(2, 0), (4, 0), (8, 1)])
def test_the_report_has_the_table_of_many_cores(
    n_cores: int, runs: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """That of the machine with most cores; one with more than four measures its own, once."""

    def store(speed_up: float, cores: int) -> None:
        rows = {"points": {"speed_up": {"1": 1.0, "default": speed_up}}}
        path = tmp_path / f"p-{cores}-cores" / "cores.json"
        path.parent.mkdir()
        path.write_text(json.dumps({"facts": {"cores": cores, "processor": "p", "commit": "c"}, "threads": rows}))

    monkeypatch.setattr(machine, "RESULTS", tmp_path)
    monkeypatch.setattr(machine, "cores", lambda: n_cores)
    monkeypatch.setattr(machine, "processor", lambda: "p")
    measured: list[list[str]] = []

    def measure(words: list[str]) -> None:
        measured.append(words)
        store(7.5, n_cores)

    monkeypatch.setattr(costs.many_cores, "main", measure)
    store(3.5, 3)
    for _ in range(2):
        figure = costs._cores()
    assert len(measured) == runs
    assert (figure.name, figure.raw["rows"]) == (
        ("8 cores against one", {"points": 7.5}) if runs else ("3 cores against one", {"points": 3.5})
    )


def test_ring_areas() -> None:
    square, triangle = [[1, 1], [3, 1], [3, 3], [1, 3]], [[0, 0], [0, 2], [2, 0]]
    assert ring_areas(np.array(square + triangle, float), np.array([0, 4, 7])).tolist() == [4.0, -2.0]


@pytest.mark.full
def test_the_page_lists_wrong_answers_of_ours_first() -> None:
    rows = held(ours=lambda items: items % 2 == 1, peer=lambda items: items % 2 == 0)
    plain = [
        {name: getattr(row, name) for name in Row.__slots__} | {"rate": row.rate, "net_rate": row.net_rate}
        for row in rows
    ]
    facts = {"rows": plain, "versions": {}, "commit": "x", "seed": 0, "processor": "p", "cores": 2}
    text = page.text_of(facts | {"load_before": 0, "load_after": 0, "seconds": 1.0})
    assert text.index("Wrong answers of exact-geometry: 1 contest") < text.index("Where another is faster")
    assert "peer" in text
