"""A plane between two bodies that touch."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, Polyhedron, Pose, Relation, collide
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.meshes.mesh_pair import MeshPair
from engine.collision.result import Work
from engine.parallel import Budget

TETRA = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
BOX = Aabb([0, 0, 0], [1, 1, 1])
TURN = Pose([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]], [0.1, 0.2, 0.3])


def contacts_of(first: object, second: object, pose: Pose | None) -> tuple[bool, Relation]:
    """Return whether every pair of faces, taken as contacts, proves separation, and the relation."""
    a, b = mesh_body_of(first), mesh_body_of(second)
    n, m = len(a.faces), len(b.faces)
    pairs = np.stack([np.repeat(np.arange(n), m), np.tile(np.arange(m), n)], axis=1)
    with Budget(None, None) as budget, np.errstate(all="ignore"):
        found = any(MeshPair(a, pose, b, pose, Work(budget)).is_separated(pairs[i : i + 1]) for i in range(len(pairs)))
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
