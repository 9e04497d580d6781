"""Balls and the boundaries of other bodies."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine import Aabb, HalfSpace, Polygon, Polyhedron, Pose, Solid, Sphere, Surface
from engine.collision.exact_images import image_half_space, value_at
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.result import Work
from engine.collision.simple.against_ball import _by_distances, _by_floats, centers_in_frame
from engine.collision.simple.boundary import (
    boundary_of,
    box_distance_bounds,
    live_parts,
    segment_distance,
    simplex_distance,
)
from engine.predicates.rational import cross, minus, sign_of, squared_length
from engine.running.budget import Budget
from tests.reference.contact import squared_distance_to_segment, squared_distance_to_triangle
from tests.reference.exact import vector
from tests.unit.collision.meshes.bodies import brick

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


# --- What even-odd leaves of a face, and how far it is from a point ---


TWO = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


def glued(top: float) -> Polyhedron:
    """Two tetrahedra with one face in common, or with a smaller one within it."""
    base = [[0, 0, 0], [6, 0, 0], [0, 6, 0]]
    small = [[x * top / 6, y * top / 6, z] for x, y, z in base]
    faces = TWO + [[i + 4 for i in face] for face in TWO]
    return Polyhedron([*base, [1, 1, 5], *small, [1, 1, -5]], faces)


@pytest.mark.parametrize(("top", "n_left", "square"), [(6.0, 6, 25), (3.0, 7, Fraction(1, 2))])
def test_a_common_wall_is_not_live(top: float, n_left: int, square: Fraction) -> None:
    body = mesh_body_of(glued(top))
    with Budget(None, None) as budget:
        parts = [list(live_parts(body, face, budget)) for face in range(8)]
        assert sum(map(bool, parts)) == n_left
        cut = [found for found in parts if len(found) > 1]
        assert len(cut) == n_left - 6
        for found in cut:  # of the base what the smaller one leaves: beyond x + y = 3
            center = Fraction(1), Fraction(1), Fraction(0)
            assert min(simplex_distance(center, corners) for corners in found) == square
            doubled = (cross(minus(q, p), minus(r, p)) for p, q, r in found)
            assert sum(abs(normal[2]) for normal in doubled) == 36 - 9


def test_all_of_a_box_is_live() -> None:
    body = mesh_body_of(brick(1))
    with Budget(None, None) as budget:
        for face in range(12):
            (corners,) = live_parts(body, face, budget)
            assert len(corners) == 3


# --- Squared distances: exact ones against the reference, bounds around them ---


def test_agrees_with_the_reference_and_the_bounds_hold() -> None:
    rng = np.random.default_rng(2)
    for rows in rng.integers(0, 4, (200, 4, 3)).tolist():
        p, a, b, c = (tuple(map(Fraction, row)) for row in rows)
        q = [vector(row) for row in rows]
        if a != b:
            assert segment_distance(p, a, b) == squared_distance_to_segment(q[0], q[1], q[2])
        near, far = box_distance_bounds(
            np.array(rows[0], float),
            np.array([rows[1:]]).min(1).astype(float),
            np.array([rows[1:]]).max(1).astype(float),
        )
        assert near[0] <= simplex_distance(p, (a, b, c)) <= far[0]
        if np.cross(np.subtract(rows[2], rows[1]), np.subtract(rows[3], rows[1])).any():
            assert simplex_distance(p, (a, b, c)) == squared_distance_to_triangle(q[0], (q[1], q[2], q[3]))


def test_bounds_survive_overflow() -> None:
    low, high = np.array([[-1e200, 0.0]]), np.array([[np.inf, 1.0]])
    near, far = box_distance_bounds(np.array([1e200, 0.5]), low, high)
    assert near[0] <= 0.0
    assert far[0] == np.inf


# --- What floats say of a ball and a mesh is what rationals say, the face too; and they say it of most ---


FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


@pytest.mark.parametrize("scale", [1.0, 2.0**-500, 2.0**400])
@pytest.mark.parametrize("is_solid", [True, False])
def test_agrees_with_rationals(is_solid: bool, scale: float) -> None:
    draw = np.random.default_rng(int(is_solid))
    n_told = 0
    for _ in range(60):
        corners = draw.integers(-8, 9, (4, 3)) * scale
        if np.linalg.det((corners[1:] - corners[0]) / scale) <= 0:
            continue
        body = (Polyhedron if is_solid else Surface)(corners, FACES)
        for _ in range(8):
            ball = Sphere(draw.integers(-24, 25, 3) / 2 * scale, draw.integers(0, 20) / 2 * scale)
            found = _by_floats(body, [*ball.center.tolist(), 0.0], ball.radius, Work())
            if found is not None:
                n_told += 1
                assert found == _by_distances(body, ball, (None, None), Work())
    assert n_told > 100 or scale != 1.0


def test_a_rounded_centre_is_told_where_it_does_not_matter() -> None:
    body = Polyhedron([[0, 0, 0], [8, 0, 0], [0, 8, 0], [0, 0, 8]], FACES)
    turn = Pose([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]], [1e-3, 0, 0])
    moves = turn.rotation[None], turn.translation[None]
    for x in range(-3, 9):
        ball = Sphere([x, 0.5, 0.5], 1)
        found = _by_floats(body, centers_in_frame(ball, None, moves)[0].tolist(), 1.0, Work())
        assert found == _by_distances(body, ball, (None, turn), Work())
