"""Float bounds on the distance of two triangles: both sides of the exact one, and close to it."""

from __future__ import annotations

import random

import numpy as np

from engine.collision.clearance.near_triangles import nearest_points, rounding_of, seen_from
from engine.collision.meshes.triangle_triangle import Facet
from engine.jit import kernel
from engine.types import Point3
from tests.reference.distance import squared_distance
from tests.reference.exact import q, vector
from tests.unit.collision.clearance.makers import turn


@kernel
def bounds(s: Facet, t: Facet) -> tuple[float, float]:
    origin = s.p
    s, t = seen_from(origin, s), seen_from(origin, t)
    _, across = nearest_points(s, t, np.inf)
    slack = rounding_of(s, t)
    return across.low - slack, across.size + slack


def test_bounds_enclose_the_exact_distance_closely() -> None:
    rng = random.Random(7)
    for _ in range(200):
        offset = rng.choice([2.5, 2.0 + 2.0**-40, 9.0])
        whole = rng.random() < 0.5
        s, t = (
            [[float(rng.randint(0, 2)) if whole else rng.uniform(0, 2) for _ in range(3)] for _ in range(3)]
            for _ in range(2)
        )
        t = [[x + offset, y, z] for x, y, z in t]
        low, high = bounds(*(Facet(*(Point3(*p) for p in hull)) for hull in (s, t)))
        exact = squared_distance(*[tuple(dict.fromkeys(map(vector, hull))) for hull in (s, t)])
        assert q(max(low, 0.0)) ** 2 <= exact <= q(high) ** 2, (s, t)
        assert high - low <= 1e-12 * (1.0 + high) or np.sqrt(float(exact)) < 1e-6, (s, t)


def test_the_foot_on_a_needle_is_a_point_of_it_though_its_normal_is_rounded_away() -> None:
    """A foot along such a normal lay off the needle, and nearer than any point of it."""
    rng = random.Random(1)
    for _ in range(400):
        rotation, thin, near = turn(rng, 3), 10.0 ** rng.uniform(-17, -1), 10.0 ** rng.uniform(-8, 0)
        slant = 10.0 ** rng.uniform(-8, 0)
        first = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [rng.uniform(-1, 1), thin, -thin * rng.uniform(-1, 1)]]
        second = [
            [-1.0, -slant, near],
            [1.0, slant, near],
            [rng.uniform(-1, 1), 0.0, near + slant * rng.uniform(-1, 1)],
        ]
        hulls = [[[sum(r * x for r, x in zip(row, p)) for row in rotation] for p in hull] for hull in (first, second)]
        low, high = bounds(*(Facet(*(Point3(*p) for p in hull)) for hull in hulls))
        exact = squared_distance(*[tuple(dict.fromkeys(map(vector, hull))) for hull in hulls])
        assert q(max(low, 0.0)) ** 2 <= exact <= q(high) ** 2, hulls
