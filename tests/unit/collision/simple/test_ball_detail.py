"""What of a body and of a ball lies outside the other, known by hand."""

from __future__ import annotations

import pytest

from engine import Aabb, Polygon, Solid, Sphere
from engine.collision.result import Parts, Work
from engine.collision.simple.ball_detail import body_ball_parts

BOX, SQUARE = Aabb([-3, -4, -1], [3, 4, 1]), Polygon([[[-3, -4], [3, -4], [3, 4], [-3, 4]]])


@pytest.mark.parametrize(
    ("body", "ball", "expected"),
    [
        (BOX, Sphere([0, 0, 0], 1), Parts(True, False, True)),  # touches two faces from within
        (BOX, Sphere([0, 0, 0], 0.5), Parts(True, False, False)),
        (BOX, Sphere([0, 0, 0], 2), Parts(True, True, True)),
        (BOX, Sphere([0, 0, 0], 9), Parts(False, True, False)),
        (SQUARE, Sphere([0, 0], 5), Parts(False, True, True)),  # through the corners
        (SQUARE, Sphere([0, 0], 3), Parts(True, False, True)),
    ],
)
def test_known_parts(body: Solid, ball: Sphere, expected: Parts) -> None:
    assert body_ball_parts(body, ball, None, None, Work()) == expected
