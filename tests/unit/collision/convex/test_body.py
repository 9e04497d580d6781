"""What kernels are told of convex bodies: neighbours, farthest vertices, reaches, and points inside."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from engine import Aabb, Polyhedron, Solid, Sphere
from engine.collision.convex.body import ASIDE, CENTER, RADIUS, REACH, ROUND, convex_body_of, pooled
from tests.unit.collision.convex.test_pair import ball_of_belts


def test_bodies_without_interior_or_not_convex_have_no_place() -> None:
    notched = Polyhedron(
        [[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, 1], [0, 0, 4]],
        [[0, 2, 1], [0, 1, 4], [0, 4, 2], [1, 2, 3], [2, 4, 3], [4, 1, 3]],
    )
    bodies: list[Solid] = [Aabb([0, 0, 0], [1, 1, 0]), Sphere([0, 0, 0], 0), Sphere([0, 0], 1), notched]
    assert [convex_body_of(body) for body in bodies] == [None] * 4


def test_pooled_arrays_describe_each_body() -> None:
    solids: list[Solid] = [Aabb([0, 1, 2], [3, 4, 6]), Sphere([1, 2, 3], 2), ball_of_belts(6, 3)]
    bodies = [body for body in map(convex_body_of, solids) if body is not None]
    pool = pooled(bodies)
    assert pool.firsts[0].tolist() == [0, 8, 9, 29]
    for k, body in enumerate(bodies):
        first, stop = pool.firsts[0, k], pool.firsts[0, k + 1]
        points = pool.points[:, first:stop]
        assert (points == body.points).all()
        for octant in range(8):
            sign = np.array([1 if octant >> axis & 1 else -1 for axis in range(3)])
            vertex = pool.graph[pool.firsts[2, k] + octant]
            assert sign @ pool.points[:, vertex] == (sign @ points).max()
        for center in (CENTER, ASIDE):
            middle = [Fraction(x) for x in pool.numbers[k, center : center + 3].tolist()]
            farthest = max(sum((Fraction(x) - m) ** 2 for x, m in zip(p, middle)) for p in points.T.tolist())
            assert farthest <= Fraction(pool.numbers[k, RADIUS]) ** 2 or pool.numbers[k, ROUND] > 0
        assert pool.numbers[k, REACH] == np.abs(points).max() + pool.numbers[k, ROUND]
    triangles = solids[2].triangles  # type: ignore[attr-defined]
    for vertex in range(20):
        here = pool.graph[pool.graph[9 + vertex] : pool.graph[10 + vertex]] - 9
        assert set(here.tolist()) == {int(t[k]) for t in triangles if vertex in t for k in range(3)} - {vertex}
