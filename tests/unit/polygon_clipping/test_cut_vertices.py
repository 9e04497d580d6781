"""Vertices of cut rings in doubles, integers and digits."""

from __future__ import annotations

import itertools
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine.polygon_clipping.clip_polygons import clip_polygons
from engine.polygon_clipping.cut_vertices import (
    edge_parameter,
    interpolate,
    is_exactly_at,
    parameter_of,
    point_on_edge,
    settle,
    value_of,
)
from engine.polygon_clipping.in_doubles import scratch_for
from engine.polygon_clipping.in_integers import MOST_BITS, clip_polygon, integer_row, plane_through
from engine.polygon_clipping.rings import Plane
from engine.solids.primitives import Aabb, Convex
from tests.unit.polygon_clipping.test_clip_polygons import check


def test_cuts_are_within_their_bounds() -> None:
    rng = np.random.default_rng(2)
    for _ in range(300):
        a, b, x, y = (rng.uniform(-1, 1, 4) * 10.0 ** rng.integers(-9, 9, 4)).tolist()
        place = a + rng.random() * (b - a)
        if not min(a, b) < place < max(a, b):
            continue
        exact = Fraction(x) + (Fraction(a) - Fraction(place)) / (Fraction(a) - Fraction(b)) * (
            Fraction(y) - Fraction(x)
        )
        th, tl, is_known = edge_parameter(a, b, place)
        h, rest, bound = point_on_edge(x, y, th, tl)
        assert is_known
        assert abs(Fraction(h) + Fraction(rest) - exact) <= Fraction(bound)
        assert not is_exactly_at(x, y, a, b, place, h) or Fraction(h) == exact


def test_a_cut_between_cut_vertices_is_within_its_bound() -> None:
    """Plane values of both ends, and the ends themselves, are off by as much as their bounds allow."""
    rng = np.random.default_rng(3)
    for _ in range(400):
        x, y = (rng.uniform(-1, 1, 2) * 10.0 ** rng.integers(-3, 3, 2)).tolist()
        ph, qh = (rng.uniform(0.01, 1, 2) * 10.0 ** rng.integers(-3, 3, 2)).tolist()
        (pl, ql), (x_low, y_low) = rng.uniform(-1, 1, (2, 2)) * 2.0**-54
        pl, ql, x_low, y_low = pl * ph, ql * qh, x_low * abs(x), y_low * abs(y)
        p_bound, q_bound, x_bound, y_bound = (rng.choice([0.0, 2.0**-100, 2.0**-30], 4) * [ph, qh, 1, 1]).tolist()
        turn = 1.0 if rng.random() < 0.5 else -1.0
        t = parameter_of((turn * ph, turn * pl, p_bound), (-turn * qh, -turn * ql, q_bound))
        for low in (0.0, 1.0):
            h, rest, bound = interpolate((x, low * x_low, x_bound), (y, low * y_low, y_bound), t)
            for sides in itertools.product((-1, 0, 1), repeat=4):
                off = [side * Fraction(each) for side, each in zip(sides, (p_bound, q_bound, x_bound, y_bound))]
                p, q = Fraction(ph) + Fraction(pl) + off[0], Fraction(qh) + Fraction(ql) + off[1]
                first = Fraction(x) + Fraction(low * x_low) + off[2]
                second = Fraction(y) + Fraction(low * y_low) + off[3]
                assert abs(Fraction(h) + Fraction(rest) - (first * q + second * p) / (p + q)) <= Fraction(bound)


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_plane_value_is_within_its_bound(dimension: int) -> None:
    """Also where nearly all of it cancels, at cut vertices and for rows of double-doubles."""
    rng = np.random.default_rng(dimension)
    made = scratch_for(2, 1, tuple(range(dimension))).vertices
    for _ in range(300):
        high = np.append(rng.uniform(-1, 1, dimension), 0.0)
        point = rng.uniform(-1, 1, dimension) * 10.0 ** rng.integers(-3, 3, dimension)
        high[-1] = -(high[:-1] @ point) * (1.0 + rng.choice([0.0, 1.0, 2.0**-40]))
        low, rests = (rng.choice([0.0, 2.0**-54]) * rng.uniform(-1, 1, n) for n in (dimension + 1, dimension))
        low, rests = low * high, rests * point
        bound = rng.choice([0.0, 2.0**-80])
        made.pool[dimension:] = point
        made.rests[2 * dimension :] = np.stack([rests, np.full(dimension, bound)], axis=1).ravel()
        h, rest, error = value_of(made, Plane(high[None], low[None], 0, -1, 0.0), 1, 1)
        row = [Fraction(a) + Fraction(b) for a, b in zip(high.tolist(), low.tolist())]
        for sides in itertools.product((-1, 1), repeat=dimension):
            place = [Fraction(x) + Fraction(y) + side * Fraction(bound) for x, y, side in zip(point, rests, sides)]
            exact = row[-1] + sum(a * x for a, x in zip(row, place))
            assert abs(Fraction(h) + Fraction(rest) - exact) <= Fraction(error)


def test_a_cut_at_a_double_is_known_to_be_there() -> None:
    assert is_exactly_at(0.0, 1.0, 0.0, 4.0, 1.0, 0.25)
    assert not is_exactly_at(0.0, 1.0, 0.0, 3.0, 1.0, 1 / 3)


# --- What doubles and double-doubles prove: long rings in runs, lattices through corners ---


@pytest.mark.parametrize("dimension", [2, 3])
def test_long_rings_are_taken_in_runs(dimension: int) -> None:
    """Many vertices on one side of all planes, and single ones on the planes between them; the ends of a ring equal."""
    rng = np.random.default_rng(6)
    walks = np.cumsum(rng.integers(-1, 2, (12, 40, dimension)) / 4, axis=1)
    walks[6:] += rng.uniform(-0.1, 0.1, (6, 40, dimension))
    walks[:3, -1] = walks[:3, 0]
    for region in (
        Aabb([-0.5] * dimension, [0.5] * dimension),
        Convex(np.c_[np.eye(dimension) + 1, np.ones(dimension)]),
    ):
        check(walks, region)


@pytest.mark.parametrize("dimension", [2, 3])
def test_contours_through_corners_stay_in_the_kernel(dimension: int) -> None:
    """Exact zeros that geometry explains need no integers: corners of a box, corners and edges of an octahedron."""
    rng = np.random.default_rng(dimension)
    contours = rng.integers(-20, 21, (60, 5, dimension)) / 8
    contours[:20] = rng.uniform(-2, 2, (20, 5, dimension))
    offset = rng.integers(-8, 9, (20, dimension)) / 8
    contours[:20, 0], contours[:20, 1] = 1 + offset, 1 - offset  # an edge through the corner of the box
    contours[20:30, 1:3, 0] = 1.0  # an edge on a plane
    signs = np.array(list(itertools.product([-1.0, 1.0], repeat=dimension)))
    for region in (Aabb([-1] * dimension, [1] * dimension), Convex(np.c_[signs, np.full(len(signs), 1.5)])):
        clipped, accuracy = clip_polygons(contours, region, report=True)
        assert accuracy.n_rational < 6
        check(contours, region, clipped)


# --- Sutherland-Hodgman in Python's integers ---


def test_too_complex_is_marked_and_spoils_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    monkeypatch.setattr("engine.polygon_clipping.in_integers.MOST_BITS", 400)
    assert MOST_BITS == 1 << 17
    box = Aabb([-0.5] * 3, [0.5] * 3)
    easy = [[0.0, 0.0, 0.0], [0.25, 0.0, 0.0], [0.0, 0.25, 0.0]]
    hard = rng.uniform(-1, 1, (6, 3)).tolist()
    clipped = clip_polygons([[easy], [hard, easy], [easy]], box)
    assert clipped.status.tolist() in ([0, 1, 0], [0, 0, 0])  # a kernel may settle what exact arithmetic would not
    assert clipped.rings(0)[0].tolist() == clipped.rings(2)[0].tolist() == easy


def test_areas_on_both_sides_of_a_line_add_up() -> None:
    """What is left of a ring on either side of a line, bridges or not, has its area, but for rounding."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        ring, line = rng.integers(-9, 10, (7, 2)) * 1.0, rng.integers(-5, 6, 3) * 1.0
        line[0] += not line[:2].any()
        areas = [area(ring.tolist())]
        for row in (line, -line):
            (left,), _ = clip_polygon([ring.tolist()], [integer_row(row.tolist())], lambda: None)
            assert all(abs(x) <= 9 for vertex in left for x in vertex)
            areas.append(area(left))
        assert abs(areas[1] + areas[2] - areas[0]) < Fraction(1, 10**10)


def test_stars_on_many_planes_use_the_room_of_dropped_vertices_again() -> None:
    rng = np.random.default_rng(4)
    turns = np.arange(128) * 2 * np.pi / 128
    region = Convex(np.c_[-np.cos(turns), -np.sin(turns), np.ones(128)])
    around = np.arange(200) * 2 * np.pi / 200
    star = np.stack([np.cos(around), np.sin(around)], 1) * rng.uniform(0.1, 3.0, 200)[:, None]
    clipped, accuracy = clip_polygons([[star]], region, report=True)
    assert accuracy.n_rational == 0
    (left,), _ = clip_polygon([star.tolist()], [integer_row(row) for row in region.planes.tolist()], lambda: None)
    assert clipped.rings(0)[0].tolist() == left


def area(ring: Any) -> Fraction:
    points = [tuple(map(Fraction, vertex)) for vertex in ring]
    return sum((p[0] * q[1] - p[1] * q[0] for p, q in zip(points, points[1:] + points[:1])), Fraction(0)) / 2


def test_a_plane_through_three_points_is_zero_at_them_and_positive_behind() -> None:
    row = plane_through([0.5, 0.0, 0.25], [1.5, 0.0, 0.25], [0.5, 2.0, 0.25])
    values = [sum(a * x for a, x in zip(row, (*point, 1.0))) for point in ([9.0, 9.0, 0.25], [0, 0, 0], [0, 0, 1])]
    assert [(value > 0) - (value < 0) for value in values] == [0, 1, -1]


# --- What doubles leave open and whole numbers settle in the kernel ---


@pytest.mark.parametrize("dimension", [2, 3])
def test_planes_through_vertices_need_no_rational_arithmetic(dimension: int) -> None:
    """Every plane passes through a vertex of every ring, so doubles decide none; edges along planes are cut again."""
    rng = np.random.default_rng(dimension)
    rows = np.c_[rng.integers(-2, 3, (6, dimension)) + 0.25, np.zeros(6)]
    contours = rng.integers(-8, 9, (40, 6, dimension)) / 4
    contours[:, 0] = 0.0
    contours[::2, 3] = 0.0
    clipped, accuracy = clip_polygons(contours, Convex(rows), report=True)
    assert accuracy.n_beyond_filter == 40
    assert accuracy.n_rational < 10
    check(contours, Convex(rows), clipped)


@pytest.mark.parametrize("seed", range(20))
def test_coordinates_on_and_between_doubles_are_settled(seed: int) -> None:
    """Ends an ulp off lattice points, neighbours of zero too: exact doubles, ties, and what comes near them."""
    rng = np.random.default_rng(seed)
    made = scratch_for(1, 1, (0, 1)).vertices
    for _ in range(100):
        a, b, x, y = (rng.integers(-4, 5, 4) / 4).tolist()
        a, b, x, y = (float(np.nextafter(v, rng.choice([-9, v, 9]))) for v in (a, b, x, y))
        place = float(rng.choice([-0.5, 0.0, 0.25, 1.0]))
        if not min(a, b) < place < max(a, b):
            continue
        t = (Fraction(a) - Fraction(place)) / (Fraction(a) - Fraction(b))
        exact = Fraction(x) + t * (Fraction(y) - Fraction(x))
        th, tl, is_safe = edge_parameter(a, b, place)
        if not is_safe:
            continue
        (h, rest, bound), is_known = settle(made, point_on_edge(x, y, th, tl), (x, y, a, b), place)
        assert is_known
        assert (h, str(h)[0]) == (float(exact), str(float(exact) + 0.0)[0])
        assert abs(Fraction(h) + Fraction(rest) - exact) <= Fraction(bound)


def test_an_ulp_beside_walls_needs_no_integers() -> None:
    rng = np.random.default_rng(4)
    turns = np.sort(rng.uniform(0, 2 * np.pi, (200, 12)), axis=1)
    stars = np.stack([np.cos(turns), np.sin(turns)], -1) * rng.uniform(0.4, 1.6, (200, 12, 1))
    contours = np.round((stars + rng.uniform(-1, 1, (200, 1, 2))) * 2) / 2
    contours += rng.integers(-1, 2, contours.shape) * (rng.random(contours.shape) < 0.3) * np.spacing(np.abs(contours))
    clipped, accuracy = clip_polygons(contours, Aabb([-1, -1], [1, 1]), report=True)
    assert accuracy.n_beyond_filter < 16
    check(contours, Aabb([-1, -1], [1, 1]), clipped)
