"""The containment reference against answers by hand."""

from __future__ import annotations

import pytest

from tests.reference.containment import locate, locate_many
from tests.reference.shapes import aabb, box, half_space, polygon, reversed_faces, sphere, tetrahedron, union_of

TINY = 5e-324
UNIT = box((0, 0, 0), (1, 1, 1))
BOW = polygon([[0, 0], [2, 2], [2, 0], [0, 2]])
CANCELLED = polygon([[0, 0], [2, 0], [2, 2], [0, 2]], [[2, 0], [4, 0], [4, 2], [2, 2]])


@pytest.mark.parametrize(
    ("point", "solid", "expected"),
    [
        ((0.5, 0.5, 0.5), UNIT, 1),
        ((0.5, 0.5, 1), UNIT, 0),
        ((1, 1, 1), UNIT, 0),
        ((1, 1, 1 + 2**-52), UNIT, -1),
        ((TINY, TINY, TINY), UNIT, 1),
        ((0.5, 0.5, 0.5), union_of(UNIT, UNIT), -1),  # even
        ((0.5, 0.5, 0.5), union_of(UNIT, UNIT, UNIT), 1),
        ((0.5, 0.5, 0), union_of(UNIT, UNIT), 0),  # on faces that cancel
        ((0.5, 0.5, 0.5), reversed_faces(UNIT), 1),
        ((0.25, 0.25, 0.25), tetrahedron((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)), 1),
        ((0.5, 1), BOW, 1),
        ((1, 1), BOW, 0),
        ((1, 1.5), BOW, -1),
        ((1, 1.5), {"type": "csg", "operation": "difference", "operands": [aabb((0, 0), (2, 2)), BOW]}, 1),
        ((2, 1), CANCELLED, 0),
        ((3, 1), CANCELLED, 1),
        ((1, 0), sphere((0, 0), 1), 0),
        ((0.6, 0.8), sphere((0, 0), 1), -1),  # the doubles: 0.6^2 + 0.8^2 > 1
        ((0, 5, 0), half_space((0, 1, 0), -5), 0),
        ((1, 1), aabb((1, 0), (1, 3)), 0),
        ((1, TINY), {"type": "convex", "planes": [[1, 0, 0], [0, 1, 0]]}, 1),
        ((1, 0), {"type": "triangle", "vertices": [[0, 0], [0, 2], [2, 0]]}, 0),
        ((1, 0.5), {"type": "triangle", "vertices": [[0, 0], [0, 2], [2, 0]]}, 1),
        ((0.5, 0.5, 99), {"type": "triangle", "vertices": [[0, 0, 0], [2, 0, 0], [0, 2, 0]]}, 1),
        ((1, 1, 99), {"type": "triangle", "vertices": [[0, 0, 0], [2, 0, 0], [0, 2, 0]]}, 0),
        (
            (3, 4),
            {"type": "implicit", "terms": [{"powers": [0, 0], "coefficient": 25}]
             + [{"powers": p, "coefficient": -1} for p in ([2, 0], [0, 2])]},
            0,
        ),
    ],
)  # fmt: skip
def test_by_hand(point: tuple, solid: dict, expected: int) -> None:
    assert locate(point, solid) == expected
    assert locate_many([point, point], solid) == [expected, expected]


def test_a_surface_has_no_inside() -> None:
    with pytest.raises(ValueError, match="no inside"):
        locate((0, 0, 0), {**UNIT, "type": "surface"})


def test_posed() -> None:
    # x = 10 - y', y = x': the face x' = 1 goes to y = 1
    turn = {"rotation": [[0, -1, 0], [1, 0, 0], [0, 0, 1]], "translation": [10, 0, 0]}
    plane = half_space((1, 0, 0), -1)
    for solid in (UNIT, aabb((0, 0, 0), (1, 1, 1)), sphere((0.5, 0.5, 0.5), 0.5), plane):
        assert locate((9.5, 1, 0.5), solid, turn) == 0


def test_faces_without_area_count_for_boundary_only() -> None:
    needle = [[0, 0, 0], [0, 0, 3], [0, 0, 1]]
    solid = {"type": "polyhedron", "vertices": needle, "faces": [[0, 1, 2], [2, 1, 0]]}
    assert locate_many([[0, 0, 2], [0, 0, 4], [1, 0, 0]], solid) == [0, -1, -1]
