"""A plane between two bodies that touch; and sides of a face that a whole body keeps one status on."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, Polyhedron, Pose, Relation, collide
from engine.collision.meshes.exact_body import plane_through
from engine.collision.meshes.exact_cells import even_sides
from engine.collision.meshes.mesh_arrays import shell_of
from engine.collision.meshes.separating_plane import is_separated
from engine.collision.result import Work
from engine.parallel import Budget

TETRA = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
BOX = Aabb([0, 0, 0], [1, 1, 1])
TURN = Pose([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]], [0.1, 0.2, 0.3])


def contacts_of(first: object, second: object, pose: Pose | None) -> tuple[bool, Relation]:
    """Return whether every pair of faces, taken as contacts, proves separation, and the relation."""
    a, b = shell_of(first), shell_of(second)
    n, m = len(a.faces), len(b.faces)
    pairs = np.stack([np.repeat(np.arange(n), m), np.tile(np.arange(m), n)], axis=1)
    with Budget(None, None) as budget, np.errstate(all="ignore"):
        found = any(
            is_separated(a.arrays, a.posed(pose), b.arrays, b.posed(pose), pairs[i : i + 1], Work(budget).budget.flag)
            for i in range(len(pairs))
        )
    return found, collide(first, second, first_pose=pose, second_pose=pose).relation


@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize(
    "other",
    [
        Aabb([1, 0, 0], [2, 1, 1]),  # flush
        Aabb([1, 1, 1], [2, 2, 2]),  # a corner
        Polyhedron([[0.5, 0.5, 1], [0, 0, 3], [1, 0, 3], [0, 1, 3]], TETRA),  # a vertex on a face
        Polyhedron([[-1, 0.5, 3], [3, 0.5, -1], [2, 0, 3], [3, 1, 2]], TETRA),  # edges that cross
    ],
)
def test_finds_a_plane_between_convex_bodies(other: object, pose: Pose | None) -> None:
    found, relation = contacts_of(BOX, other, pose)
    assert relation != Relation.TOUCHING or found
    assert relation == Relation.TOUCHING


@pytest.mark.parametrize("pose", [None, TURN])
def test_finds_none_where_interiors_meet(pose: Pose | None) -> None:
    assert contacts_of(BOX, Aabb([0.5, 0, 0], [2, 1, 1]), pose) == (False, Relation.OVERLAPPING)
    assert contacts_of(BOX, BOX, pose) == (False, Relation.OVERLAPPING)


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        (((1, 1, 0), (2, 1, 5), (1, 2, 5)), (False, True)),  # stands on the open face
        (((1, 1, 0), (2, 1, -5), (1, 2, -5)), (True, False)),
        (((0, 0, 0), (0, -9, 5), (0, -9, -5)), (True, True)),  # passes a corner
        (((0, 0, 0), (9, 0, 0), (0, 0, 9)), (True, True)),  # stands on an edge
        (((1, -1, -5), (1, 9, 0), (1, -1, 5)), (False, False)),  # goes through
        (((1, 1, 0), (2, 1, 0), (1, 2, 0)), (True, True)),  # lies in the plane
    ],
)
def test_even_sides(other: tuple[tuple[int, int, int], ...], expected: tuple[bool, bool]) -> None:
    face = ((0, 0, 0), (9, 0, 0), (0, 9, 0))
    assert even_sides(face, plane_through(face), 2, [other]) == expected
    turned = (face[0], face[2], face[1])
    assert even_sides(turned, plane_through(turned), 2, [other]) == expected
