"""The boundary of a body: exact corners within their bounds, signs, and faces of both kinds."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine import Aabb, HalfSpace, Polygon, Pose, Solid
from engine.collision.exact_images import image_half_space, value_at
from engine.collision.result import Work
from engine.collision.simple.boundary import boundary_of, simplex_distance
from engine.predicates.rational import minus, sign_of, squared_length

BLOCK, SQUARE = Aabb([0, 0, 0], [1, 2, 3]), Polygon([[[0, 0], [2, 0], [2, 1], [0, 1]]])
TURNED3 = Pose([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]], [0.1, 0.2, 0.3])
TURNED2 = Pose([[0.6, -0.8], [0.8, 0.6]], [0.1, 0.2])


@pytest.mark.parametrize(("body", "pose"), [(BLOCK, None), (BLOCK, TURNED3), (SQUARE, None), (SQUARE, TURNED2)])
def test_rounded_vertices_bounds_and_signs_hold_the_exact_ones(body: Solid, pose: Pose | None) -> None:
    boundary = boundary_of(body, pose, Work())
    center = tuple(map(Fraction, [5, 6, 7][: body.dimension]))
    plane = image_half_space(HalfSpace([3.0, 1.0, -2.0][: body.dimension], -2.5), None)
    floats = boundary.floats(slice(None))
    lower, upper = boundary.bounds(center, floats, floats)
    signs = boundary.signs(plane)
    for vertex, rounded in enumerate(floats.tolist()):
        exact = boundary.exact(vertex)
        assert all(abs(Fraction(r) - x) <= boundary.error for r, x in zip(rounded, exact))
        assert lower[vertex] <= squared_length(minus(exact, center)) <= upper[vertex]
        assert signs[vertex] == sign_of(value_at(plane, exact))
    lower, _ = boundary.face_bounds(center)
    for face in range(len(boundary.ends)):
        assert (
            lower[face]
            <= simplex_distance(center, boundary.corners(face))
            == min(
                simplex_distance(center, corners)
                for corners in boundary.live([face])
                if corners == boundary.corners(face)
            )
        )


def test_what_is_live_of_a_square() -> None:
    boundary, corner = boundary_of(SQUARE, None, Work()), (Fraction(2), Fraction(1))
    edges = np.arange(4)
    assert boundary.has_live(edges, lambda ends: max(squared_length(minus(p, corner)) for p in ends) == 5)
    assert not boundary.has_live(edges, lambda ends: simplex_distance(corner, ends) > 4)
