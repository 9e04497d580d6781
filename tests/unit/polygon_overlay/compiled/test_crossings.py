"""Crossings of edges: signs and nearest doubles."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine.polygon_overlay.compiled.clearance import round_crossing
from engine.polygon_overlay.compiled.crossing_signs import Edges, crossing_against, order_of_crossings, orient

Point = tuple[Fraction, Fraction]


def edges_of(ends: np.ndarray) -> Edges:
    """Return segments (n, 2, 2) as edges 0, 2, 4, ..., each to the vertex after it."""
    x, y = np.ascontiguousarray(ends.reshape(-1, 2).T)
    there = np.arange(len(x)) ^ 1
    return Edges(x, y, there, there, there, np.zeros(2, np.int64))


def exact(edges: Edges, v: int) -> Point:
    return Fraction(float(edges.x[v])), Fraction(float(edges.y[v]))


def cross(a: Point, b: Point, c: Point) -> Fraction:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def sign(value: Fraction) -> int:
    return (value > 0) - (value < 0)


def crossing(edges: Edges, e: int, f: int) -> tuple[Point, Fraction]:
    """Return where edges e and f cross, and the parameter along e."""
    a, b, c, d = (exact(edges, v) for v in (e, e ^ 1, f, f ^ 1))
    t = cross(c, d, a) / (cross(c, d, a) - cross(c, d, b))
    return (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])), t


def star(seed: int) -> Edges:
    """Three edges through nearly, or exactly, one point; the first crosses both others."""
    random = np.random.default_rng(seed)
    middle = random.integers(-9, 10, 2) / 8
    reach = random.integers(1, 30, (3, 1, 1)) * np.array([[[-1.0], [1.0]]]) * random.integers(1, 9, (3, 1, 2))
    reach[0, :, 1] *= -1.0
    ends = middle + reach / 3.0
    ends[1:] += random.integers(-1, 2, (2, 2, 2)) * np.spacing(ends[1:])
    return edges_of(ends)


@pytest.mark.parametrize("seed", range(60))
def test_signs_are_exact(seed: int) -> None:
    edges = star(seed)
    places = {}
    for f in (2, 4):
        sides = [sign(cross(*(exact(edges, v) for v in vs))) for vs in ((0, 1, f), (0, 1, f + 1))]
        assert [orient(edges, 0, 1, f), orient(edges, 0, 1, f + 1)] == sides
        other = [sign(cross(*(exact(edges, v) for v in vs))) for vs in ((f, f + 1, 0), (f, f + 1, 1))]
        if sides[0] * sides[1] < 0 and other[0] * other[1] < 0:
            (x, y), places[f] = crossing(edges, 0, f)
            for axis, value in ((0, x), (1, y)):
                near = float(value)
                assert crossing_against(edges, 0, f, axis, near, 0.0) == sign(value - Fraction(near))
                half = abs(float(np.spacing(near))) / 2
                expected = sign(value - Fraction(near) - Fraction(half))
                assert crossing_against(edges, 0, f, axis, near, half) == expected
    if len(places) == 2:
        assert order_of_crossings(edges, 0, 2, 4) == sign(places[2] - places[4])


TINY = 5e-324


def test_infinitesimals_decide_nothing_and_say_so() -> None:
    # two edges through (0.5, 0) but for infinitesimals, and a third that crosses both first ones elsewhere
    edges = edges_of(np.array([[[0.0, 0.0], [1.0, TINY]], [[0.5, -1.0], [0.5, 1.0]], [[0.0, -0.5], [1.0, 0.5]]]))
    assert order_of_crossings(edges, 0, 2, 4) == 0
    assert edges.doubts[0] == 1  # not a tie: the first crosses at y = TINY / 2, the last at x = 0.5 + TINY / 2
    edges.doubts[0] = 0
    assert crossing_against(edges, 0, 2, 1, 0.0, 0.0) == 0
    assert edges.doubts[0] == 1
    edges.doubts[0] = 0
    assert crossing_against(edges, 0, 2, 0, 0.25, 0.0) == 1
    assert crossing_against(edges, 0, 2, 1, 0.25, 0.0) == -1
    assert edges.doubts[0] == 0
    assert orient(edges, 0, 1, 2) == -1
    assert orient(edges, 0, 1, 3) == 1
    assert [orient(edges, 0, 2, 1), orient(edges, 4, 5, 0)] == [1, 1]


# --- Crossings rounded to the nearest doubles, as rational arithmetic has them ---


@pytest.mark.parametrize("seed", range(100))
def test_nearest_doubles(seed: int) -> None:
    edges = star(seed)
    for f in (2, 4):
        a, b, c, d = (exact(edges, v) for v in (0, 1, f, f + 1))
        if sign(cross(a, b, c)) * sign(cross(a, b, d)) < 0 and sign(cross(c, d, a)) * sign(cross(c, d, b)) < 0:
            place, _ = crossing(edges, 0, f)
            found = round_crossing(edges, 0, f)
            for value, near, error in zip(place, found[:2], found[2:], strict=True):
                assert float(value) == near
                assert abs(value - Fraction(near)) <= Fraction(error)
                assert (error == 0.0) == (value == Fraction(near))
