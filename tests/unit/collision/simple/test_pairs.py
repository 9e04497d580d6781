"""Pairs of simple solids, each with its own rule."""

from __future__ import annotations

import math

import numpy as np
import pytest

import engine
from engine import Aabb, HalfSpace, Polygon, Pose, Relation, Solid, Sphere, collide
from engine.collision.result import Parts, Work
from engine.collision.simple.against_ball import body_sphere_parts
from engine.collision.simple.closed_forms import half_space_body_parts
from tests.reference.shapes import box, union_of
from tests.unit.collision.lattices import (
    COUNTS,
    Maker,
    aabb,
    check_pairs,
    half_space,
    polygon,
    polyhedron,
    solid,
    sphere,
    surface,
    triangle,
)


@pytest.mark.parametrize(("d", "first", "second"), [(2, sphere, sphere), (3, sphere, sphere)])
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


@pytest.mark.parametrize("other", [engine.Sphere([3, 0, 0], 2), engine.Aabb([1, -1, -1], [2, 1, 1])])
def test_a_ball_keeps_its_relation_under_a_common_pose(other: engine.Solid) -> None:
    ball, plane = engine.Sphere([0, 0, 0], 1), engine.HalfSpace([1, 0, 0], -1)
    random_ = np.random.default_rng(4)
    for _ in range(8):
        turn, _ = np.linalg.qr(random_.normal(size=(3, 3)))
        pose = Pose(turn * np.sign(np.linalg.det(turn)), random_.normal(size=3))
        for body in (other, plane):
            assert collide(ball, body, first_pose=pose, second_pose=pose).relation == Relation.TOUCHING
        pairs = engine.collide_scene([ball, other], [pose, pose])
        assert pairs.relation.tolist() == [Relation.TOUCHING]


# --- Boxes against balls: the reference, and one unit in the last place beside a contact ---


@pytest.mark.parametrize(("d", "first", "second"), [(2, sphere, aabb), (3, sphere, aabb)])
@COUNTS
def test_a_box_and_a_ball_agree_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


@pytest.mark.parametrize(("radius", "label"), [(1.0, "touching"), (math.nextafter(1.0, 2), "overlapping")])
def test_one_ulp_decides(radius: float, label: str) -> None:
    assert collide(Aabb([0, 0], [1, 1]), Sphere([2, 0.5], radius)).relation.label == label
    assert collide(Aabb([0, 0], [1, 1]), Sphere([2, 0.5], math.nextafter(1.0, 0))).relation.label == "disjoint"


# --- Half-spaces against balls ---


@pytest.mark.parametrize(("d", "first", "second"), [(2, half_space, sphere), (3, half_space, sphere)])
@COUNTS
def test_a_half_space_and_a_ball_agree_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


# --- Half-spaces against half-spaces ---


@pytest.mark.parametrize(("d", "first", "second"), [(2, half_space, half_space), (3, half_space, half_space)])
@COUNTS
def test_two_half_spaces_agree_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


# --- Half-spaces against bodies given by vertices: the reference, and parts known by hand ---


@pytest.mark.parametrize(
    ("d", "first", "second"),
    [
        (2, half_space, aabb),
        (2, half_space, triangle),
        (2, half_space, polygon),
        (3, half_space, aabb),
        (3, half_space, polyhedron),
        (3, half_space, surface),
    ],
)
@COUNTS
def test_a_half_space_and_vertices_agree_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


SQUARE = [[0, 0], [2, 0], [2, 2], [0, 2]]


@pytest.mark.parametrize(("offset", "expected"), [(1, (False, False)), (0, (False, True)), (-1, (True, True))])
def test_known_parts(offset: float, expected: tuple[bool, bool]) -> None:
    space, plane = HalfSpace([1, 0, 0], offset), HalfSpace([1, 0], offset)
    assert half_space_body_parts(space, Aabb([0, 0, 0], [2, 2, 2]), (None, None), Work()) == Parts(True, *expected)
    assert half_space_body_parts(plane, Polygon([SQUARE]), (None, None), Work()) == Parts(True, *expected)


def test_walls_that_cancel_do_not_stick_out() -> None:
    walled = Polygon([SQUARE, [[-3, 1], [-1, 1], [-2, 1]]])
    assert half_space_body_parts(HalfSpace([1, 0], 0), walled, (None, None), Work()) == Parts(True, False, True)


# --- Bodies with faces or edges against balls: the reference, walls that cancel, and parts known by hand ---


@pytest.mark.parametrize(
    ("d", "first", "second"),
    [(2, sphere, triangle), (2, sphere, polygon), (3, sphere, polyhedron), (3, sphere, surface)],
)
@COUNTS
def test_a_body_and_a_ball_agree_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


BLOCK = box((0, 0, 0), (6, 6, 6))
WALLED = union_of(BLOCK, box((1, 1, 3), (5, 5, 3)))  # the box in the middle has no thickness: its walls cancel
HALVES = {"type": "polygon", "rings": [[[0, 0], [6, 0], [6, 6], [0, 6]], [[1, 3], [5, 3], [4, 3]]]}


@pytest.mark.parametrize(("radius", "expected"), [(1.0, "overlapping"), (0.0, "touching"), (3.0, "overlapping")])
def test_a_ball_centred_on_a_wall_that_cancels(radius: float, expected: str) -> None:
    for body, center in ((WALLED, [3.0, 3.0, 3.0]), (HALVES, [3.0, 3.0])):
        ball = {"type": "sphere", "center": center, "radius": radius}
        assert collide(solid(body), solid(ball)).relation.label == expected


def test_a_ball_centred_on_a_cancelled_wall_outside_only_touches() -> None:
    beside = engine.Polygon([[[0, 0], [2, 0], [2, 2], [0, 2]], [[4, 3], [8, 3], [7, 3]]])
    assert collide(beside, engine.Sphere([6, 3], 1)).relation == Relation.TOUCHING


SLAB, SQUARE_BODY = Aabb([-3, -4, -1], [3, 4, 1]), Polygon([[[-3, -4], [3, -4], [3, 4], [-3, 4]]])


@pytest.mark.parametrize(
    ("body", "ball", "expected"),
    [
        (SLAB, Sphere([0, 0, 0], 1), Parts(True, False, True)),  # touches two faces from within
        (SLAB, Sphere([0, 0, 0], 0.5), Parts(True, False, False)),
        (SLAB, Sphere([0, 0, 0], 2), Parts(True, True, True)),
        (SLAB, Sphere([0, 0, 0], 9), Parts(False, True, False)),
        (SQUARE_BODY, Sphere([0, 0], 5), Parts(False, True, True)),  # through the corners
        (SQUARE_BODY, Sphere([0, 0], 3), Parts(True, False, True)),
    ],
)
def test_known_parts_of_a_body_and_a_ball(body: Solid, ball: Sphere, expected: Parts) -> None:
    assert body_sphere_parts(body, ball, (None, None), Work()) == expected
