"""Bodies with faces or edges against balls: the reference, walls that cancel, and parts known by hand."""

from __future__ import annotations

import pytest

import engine
from engine import Aabb, Polygon, Relation, Solid, Sphere, collide
from engine.collision.result import Parts, Work
from engine.collision.simple.against_ball import body_sphere_parts
from tests.reference.shapes import box, union_of
from tests.unit.collision.lattices import (
    COUNTS,
    Maker,
    check_pairs,
    polygon,
    polyhedron,
    solid,
    sphere,
    surface,
    triangle,
)


@pytest.mark.parametrize(
    ("d", "first", "second"),
    [(2, sphere, triangle), (2, sphere, polygon), (3, sphere, polyhedron), (3, sphere, surface)],
)
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
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


SLAB, SQUARE = Aabb([-3, -4, -1], [3, 4, 1]), Polygon([[[-3, -4], [3, -4], [3, 4], [-3, 4]]])


@pytest.mark.parametrize(
    ("body", "ball", "expected"),
    [
        (SLAB, Sphere([0, 0, 0], 1), Parts(True, False, True)),  # touches two faces from within
        (SLAB, Sphere([0, 0, 0], 0.5), Parts(True, False, False)),
        (SLAB, Sphere([0, 0, 0], 2), Parts(True, True, True)),
        (SLAB, Sphere([0, 0, 0], 9), Parts(False, True, False)),
        (SQUARE, Sphere([0, 0], 5), Parts(False, True, True)),  # through the corners
        (SQUARE, Sphere([0, 0], 3), Parts(True, False, True)),
    ],
)
def test_known_parts(body: Solid, ball: Sphere, expected: Parts) -> None:
    assert body_sphere_parts(body, ball, (None, None), Work()) == expected
