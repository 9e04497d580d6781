"""Simple rings, the sides of their interiors and the tree over their edges, against all pairs and exact locations."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from engine import Location, Polygon
from engine.arrangement.simple_rings import after, fill_tree, find_rings, n_leaves, next_leaf
from engine.containment.methods.rational_locate import rational_location
from engine.predicates.rational import orient2d_rational

Place = tuple[Fraction, Fraction]


def found(polygons: list[Polygon], most: int = 1 << 20) -> list[tuple[list[int], list[int]]]:
    """Return `following` and `sides` of each polygon, all found in one call."""
    vertices = np.concatenate([each.vertices for each in polygons])
    rings = np.cumsum([0, *(n for each in polygons for n in np.diff(each.ring_offsets))])
    offsets = np.cumsum([0, *(each.n_rings for each in polygons)])
    following, sides = np.empty(len(vertices), np.int64), np.zeros(len(vertices), np.int8)
    n = find_rings(vertices, rings, offsets, most, following, sides, np.zeros(1, np.uint8))
    parts = [slice(rings[first], rings[end]) for first, end in pairwise(offsets)]
    answers = [(following[part].tolist(), sides[part].tolist()) for part in parts]
    assert n == sum(own[0] != 0 for _, own in answers)
    return answers


def do_meet(a: Place, b: Place, c: Place, d: Place) -> bool:
    if any(max(p[k], q[k]) < min(r[k], s[k]) for k in range(2) for p, q, r, s in ((a, b, c, d), (c, d, a, b))):
        return False
    return (
        orient2d_rational(a, b, c) * orient2d_rational(a, b, d) <= 0
        and orient2d_rational(c, d, a) * orient2d_rational(c, d, b) <= 0
    )


def is_simple(points: list[Place], following: list[int]) -> bool:
    for i, end in enumerate(following):
        a, b, c = points[i], points[end], points[following[end]]
        if a == b or following[end] == i:
            return False
        ahead = (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]) > 0
        if orient2d_rational(a, b, c) == 0 and not ahead:
            return False
        for j in range(i):
            if following[j] != i and end != j and do_meet(a, b, points[j], points[following[j]]):
                return False
    return True


def expected_sides(polygon: Polygon, points: list[Place], following: list[int]) -> list[int]:
    """Return by edge the side of the interior, from the location of a point near its middle."""
    sides = []
    for i, end in enumerate(following):
        (ax, ay), (bx, by) = points[i], points[end]
        tiny = Fraction(1, 10**6)
        left = (ax + bx) / 2 - tiny * (by - ay), (ay + by) / 2 + tiny * (bx - ax)
        is_inside = rational_location(left, polygon, None, lambda: None) == Location.INSIDE
        sides.append(1 if is_inside else -1)
    return sides


def drawn(random: np.random.Generator) -> Polygon:
    kind = random.integers(4)
    if kind == 0:
        return Polygon([random.integers(0, 5, (random.integers(3, 7), 2)).astype(float)])
    if kind == 1:
        t = np.sort(random.uniform(0, 2 * np.pi, 40))
        star = np.stack([np.cos(t), np.sin(t)], 1) * random.uniform(0.3, 2, 40)[:, None]
        return Polygon([star[:: random.choice([-1, 1])]])
    square = np.array([[0, 0], [8, 0], [8, 8], [0, 8]])
    nested: list[Any] = [square * size + (1 - size) * 4 for size in (1, 0.75, 0.5, 0.25)]
    nested = [np.roll(ring, random.integers(4), axis=0)[:: random.choice([-1, 1])] for ring in nested]
    if kind == 2:
        nested.append(random.integers(0, 9, (3, 2)).astype(float))  # touches the others, or crosses them, or not
    return Polygon([nested[k] for k in random.permutation(len(nested))])


@pytest.mark.parametrize("seed", range(4))
def test_simple_rings_and_sides_are_those_of_exact_arithmetic(seed: int) -> None:
    random = np.random.default_rng(seed)
    polygons = [drawn(random) for _ in range(60)]
    n_simple = 0
    for polygon, (following, sides) in zip(polygons, found(polygons)):
        points = [(Fraction(x), Fraction(y)) for x, y in polygon.vertices.tolist()]
        assert [following[k - 1] for k in polygon.ring_offsets[1:]] == polygon.ring_offsets[:-1].tolist()
        if is_simple(points, following):
            assert sides == expected_sides(polygon, points, following)
            n_simple += 1
        else:
            assert not any(sides)
    assert 10 < n_simple < 60
    assert not any(any(sides) for _, sides in found(polygons, most=2))


def test_coordinates_out_of_range_have_no_sides() -> None:
    triangle = np.array([[1.0, 1.0], [2.0, 1.0], [1.0, 2.0]])
    for unit, is_known in ((1.0, True), (2.0**470, True), (2.0**-470, True), (2.0**500, False), (2.0**-500, False)):
        ((_, sides),) = found([Polygon([triangle * unit])])
        assert (sides == [1, 1, 1]) == is_known


@pytest.mark.parametrize("n", [1, 3, 8, 9, 70, 200])
def test_the_tree_passes_every_edge_near_a_box_in_order(n: int) -> None:
    random = np.random.default_rng(n)
    points, following = random.random((n, 2)), np.roll(np.arange(n), -1)
    boxes = np.empty((2 * n_leaves(n), 4))
    fill_tree(points, following, boxes)
    low, high = np.minimum(points, points[following]), np.maximum(points, points[following])
    for _ in range(50):
        corner, size = random.random(2), random.random(2) * 0.3
        box = (*corner.tolist(), *(corner + size).tolist())
        near = np.flatnonzero((low <= corner + size).all(axis=1) & (high >= corner).all(axis=1)) // 8
        passed, leaf = [], next_leaf(boxes, 1, *box)
        while leaf:
            passed.append(leaf - len(boxes) // 2)
            leaf = next_leaf(boxes, after(leaf), *box)
        assert passed == sorted(set(passed))
        assert set(near.tolist()) <= set(passed)
