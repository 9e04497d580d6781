"""Where polygons meet without common area: sets of triangles of a lattice, in which all follows from sets alone, and
rings that cross themselves, against the arrangement in integers."""

from __future__ import annotations

from itertools import pairwise
from math import gcd
from typing import Any

import numpy as np
import pytest

from engine.errors import DeadlineExceededError
from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.compiled.loading import RingArrays
from engine.polygon_overlay.in_integers import parts_exactly
from engine.polygon_overlay.pair_arrays import PolygonSelection, polygon_arrays_of
from engine.polygon_overlay.run import EACH_PART, run_kernel
from engine.polygon_overlay.touching import Touching, _extract, touching
from engine.running.budget import Budget
from engine.solids.polygon import Polygon

SIZE = 5
Place = tuple[int, int]
Triangle = tuple[int, int, bool]
"""Column and row of a cell, and whether its upper half is meant."""


def corners(triangle: Triangle) -> list[Place]:
    x, y, is_upper = triangle
    return [(x, y), (x + 1, y + 1), (x, y + 1)] if is_upper else [(x, y), (x + 1, y), (x + 1, y + 1)]


def sides(triangle: Triangle) -> set[frozenset[Place]]:
    a, b, c = corners(triangle)
    return {frozenset((a, b)), frozenset((b, c)), frozenset((c, a))}


def expected(one: set[Triangle], other: set[Triangle]) -> tuple[set[frozenset[Place]], set[Place]]:
    """Return the edges and the points in which two sets of triangles meet without common area."""
    around: dict[Any, list[set[Triangle]]] = {}
    for k, some in enumerate((one - other, other - one, one & other)):
        for triangle in some:
            for thing in (*sides(triangle), *corners(triangle)):
                around.setdefault(thing, [set(), set(), set()])[k].add(triangle)
    of_both = [thing for thing, (a, b, both) in around.items() if a and b and not both]
    edges = {thing for thing in of_both if isinstance(thing, frozenset)}
    ends = {place for edge in edges for place in edge}
    return edges, {thing for thing in of_both if isinstance(thing, tuple) and thing not in ends}


def steps(line: np.ndarray[Any, Any]) -> list[frozenset[Place]]:
    """Return the edges of the lattice that a line runs along."""
    found = []
    for (a, b), (c, d) in zip(line.astype(int).tolist(), line[1:].astype(int).tolist()):
        n = gcd(c - a, d - b)
        stops = [(a + (c - a) // n * k, b + (d - b) // n * k) for k in range(n + 1)]
        found += [frozenset(pair) for pair in pairwise(stops)]
    return found


@pytest.mark.parametrize("matrix", [((1, 0), (0, 1)), ((3, 1), (-1, 2)), ((1000003, 999983), (-7, 1048573))])
@pytest.mark.parametrize("share", [0.15, 0.4, 0.7])
def test_sets_of_triangles(matrix: Any, share: float, pytestconfig: pytest.Config) -> None:
    rng = np.random.default_rng(int(100 * share))
    n = 3000 if pytestconfig.getoption("--full") else 150
    every = [(x, y, half) for x in range(SIZE) for y in range(SIZE) for half in (False, True)]
    pairs = [tuple({t for t in every if rng.random() < share} or {every[k]} for k in range(2)) for _ in range(n)]
    matrix = np.array(matrix)
    arrays = [
        polygon_arrays_of([Polygon([np.array(corners(t)) @ matrix for t in each[k]]) for each in pairs]) for k in (0, 1)
    ]
    with Budget(None, None) as budget:
        found = touching(*(PolygonSelection(each, np.arange(n)) for each in arrays), budget)
    to_lattice = np.linalg.inv(matrix)
    vertices, places = (np.rint(each @ to_lattice) for each in (found.vertices, found.places))
    assert np.array_equal(vertices @ matrix, found.vertices)
    for pair, (one, other) in enumerate(pairs):
        edges, points = expected(one, other)
        lines = [vertices[found.offsets[k] : found.offsets[k + 1]] for k in np.flatnonzero(found.lines == pair)]
        runs = [step for line in lines for step in steps(line)]
        assert len(runs) == len(edges)
        assert set(runs) == edges
        assert sorted(map(tuple, places[found.points == pair].tolist())) == sorted(points)
        ends = [tuple(line[k].tolist()) for line in lines for k in (0, -1)]
        inner = [tuple(place) for line in lines for place in line[1:-1].tolist()]
        assert not {*ends} & {*inner}
        assert len(inner) == len({*inner})


def shapes(found: Touching) -> tuple[list[Any], list[Any]]:
    """Return lines, whichever way they run, and points, in order."""
    lines = [found.vertices[a:b].tolist() for a, b in zip(found.offsets, found.offsets[1:])]
    return sorted(min(line, line[::-1]) for line in lines if line[0] != line[-1]), sorted(found.places.tolist())


def test_rings_that_cross_themselves(pytestconfig: pytest.Config) -> None:
    rng = np.random.default_rng(8)
    n_settled = n_met = 0
    for size in (4, 6, 9) * (400 if pytestconfig.getoption("--full") else 25):
        pair = [Polygon([rng.integers(0, size, (rng.integers(3, 8), 2)) for _ in range(2)]) for _ in range(2)]
        one, other = (polygon_arrays_of([each]) for each in pair)
        with Budget(None, None) as budget:
            n_settled += int(run_kernel(one, other, EACH_PART, budget).status[0] == PairStatus.DONE)
            found = touching(PolygonSelection(one, np.arange(1)), PolygonSelection(other, np.arange(1)), budget)
            exact, places = parts_exactly(RingArrays(*one[:2]), RingArrays(*other[:2]), budget)
        parts = exact.evidence[:, 1]
        assert shapes(found) == shapes(_extract(exact, parts, np.zeros(len(parts), np.int64), places))
        n_met += len(found.lines) + len(found.points)
    assert n_settled > 0
    assert n_met > 0


@pytest.mark.parametrize("order", range(6))
def test_where_a_polygon_crosses_itself_on_a_border(order: int) -> None:
    """Floats tell every sign of two edges; three pass through (0, 0)."""
    bow = [(-2, -1), (2, 1), (2, -1), (-2, 1)]
    below = [(-1, -8), (3, -8), (1, 8), (-1, -8)] if order == 0 else [(-1, -8), (1, 8), (-9, 8)]
    sides = [[np.roll(bow, order, axis=0)], [np.roll(below, order // 2, axis=0)]]
    for pair in (sides, sides[::-1]):
        one, other = (polygon_arrays_of([Polygon(rings)]) for rings in pair)
        with Budget(None, None) as budget:
            found = touching(PolygonSelection(one, np.arange(1)), PolygonSelection(other, np.arange(1)), budget)
            exact, places = parts_exactly(RingArrays(*one[:2]), RingArrays(*other[:2]), budget)
        parts = exact.evidence[:, 1]
        assert shapes(found) == shapes(_extract(exact, parts, np.zeros(len(parts), np.int64), places))


def test_far_exponents_and_nothing() -> None:
    near, far = Polygon([[(0, 0), (1, 0), (1, 1)]]), Polygon([[(1, 0), (1e300, 1e-300), (1, 1)]])
    sides = [
        PolygonSelection(polygon_arrays_of(each), np.arange(3))
        for each in ([near, near, near], [far, near, Polygon([])])
    ]
    with Budget(None, None) as budget:
        found = touching(*sides, budget)
        assert touching(
            *(PolygonSelection(polygon_arrays_of([near]), np.arange(0)) for _ in range(2)), budget
        ).offsets.tolist() == [0]
    assert found.lines.tolist() == [0]
    assert found.vertices.tolist() == [[1.0, 0.0], [1.0, 1.0]]
    assert not len(found.points)


def test_a_hole_that_is_filled_is_a_line_all_around() -> None:
    square = [(1, 1), (2, 1), (2, 2), (1, 2)]
    sides = [
        PolygonSelection(polygon_arrays_of([Polygon(rings)]), np.arange(1))
        for rings in ([[(0, 0), (3, 0), (3, 3), (0, 3)], square], [square])
    ]
    with Budget(None, None) as budget:
        found = touching(*sides, budget)
    assert found.vertices.tolist() == [[1, 1], [1, 2], [2, 2], [2, 1], [1, 1]]


def test_deadline() -> None:
    rng = np.random.default_rng(0)
    many = [Polygon([rng.random((4000, 2))]) for _ in range(2)]
    with pytest.raises(DeadlineExceededError), Budget(0.05, None) as budget:
        touching(*(PolygonSelection(polygon_arrays_of([each]), np.arange(1)) for each in many), budget)
