"""The benchmark's smallest workload runs, and its own parts are right. Nothing here is timed."""

from __future__ import annotations

import json

import numpy as np
import pytest

from benchmarks import containment, errors, machine, measure, workloads
from benchmarks.contenders import Absent, load, split
from benchmarks.suite import Row, line


def test_workloads_are_seeded() -> None:
    first, second = (workloads.bumpy_sphere("bumpy", 5, 2) for _ in range(2))
    assert np.array_equal(first.vertices, second.vertices)
    points = [workloads.near_points(first, 50, seed) for seed in (0, 0, 1)]
    assert np.array_equal(points[0], points[1])
    assert not np.array_equal(points[0], points[2])


def test_subdivided_meshes_stay_closed() -> None:
    mesh = workloads.bumpy_sphere("bumpy", 0, 2)
    assert len(mesh.faces) == 320
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    keys = {tuple(edge) for edge in edges.tolist()}
    assert len(keys) == len(edges)
    assert all((b, a) in keys for a, b in keys)


def test_exact_answers_of_each_subject() -> None:
    mesh = workloads.bumpy_sphere("bumpy", 0, 1)
    assert errors.contained(np.zeros(3), mesh) == (True, False)
    assert errors.contained(mesh.vertices[3], mesh) == (True, True)
    assert errors.contained(mesh.vertices[3] * 1.01, mesh) == (False, False)
    square = workloads.Rings("square", [np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])])
    assert [errors.contained(np.array(p), square) for p in ([1.0, 1.0], [2.0, 1.0], [3.0, 1.0])] == [
        (True, False),
        (True, True),
        (False, False),
    ]
    cube = workloads.convex_planes(6, 0)
    assert errors.contained(np.array([1.0, 0.5, 0.0]), cube) == (True, True)


def test_compare_counts_wrong_answers() -> None:
    square = workloads.Rings("square", [np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])])
    points = np.array([[1.0, 1.0], [3.0, 1.0], [1.0, 0.5]])
    found = errors.compare(points, square, np.array([True, False, True]), np.array([True, True, False]), 0, 3, 9)
    assert (found["disagreements"], found["wrong_ours"], found["wrong_peer"]) == (2, 0, 2)


def test_a_median_has_quartiles() -> None:
    assert measure.spread([3.0, 1.0, 2.0]) == measure.Spread(2.0, 1.5, 2.5)
    assert measure.spread([1.0, 2.0]) == measure.Spread(1.5, 1.0, 2.0)


@pytest.mark.parametrize(("unit", "value", "verdict"), [("x", 3.0, "MISS"), ("x", 5.0, "must"), ("s", 1.0, "aim")])
def test_verdicts(unit: str, value: float, verdict: str) -> None:
    row = Row("row", unit, *((4.0, 8.0) if unit == "x" else (4.0, 2.0)), value)
    assert row.verdict == verdict
    assert verdict in line(row)


def test_parts_cover_all_items() -> None:
    assert split(7, 3) == [slice(0, 2), slice(2, 4), slice(4, 7)]


def test_a_missing_peer_says_why() -> None:
    assert isinstance(load("no_such_peer"), Absent)


def test_facts_name_what_figures_depend_on() -> None:
    facts = machine.facts(3, 2)
    assert facts["seed"] == 3
    assert facts["versions"]["numpy"] == np.__version__
    json.dumps(facts)


@pytest.mark.full
def test_quick_run(capsys: pytest.CaptureFixture[str]) -> None:
    assert containment.main(["--quick", "--only", "10 vertices", "--rounds", "3", "--seconds", "1"]) == 0
    assert "polygon, 10 vertices, near vs shapely" in capsys.readouterr().out
