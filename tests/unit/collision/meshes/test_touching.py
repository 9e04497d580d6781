"""A plane between two bodies that touch, and faces in contact that nothing cuts."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, Polyhedron, Pose, Relation, collide
from engine.collision.codes import UNSETTLED
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.meshes.mesh_pair import relate, what_to_seek
from engine.collision.meshes.pose_batch import RELATION
from engine.collision.result import Collision, Witness, Work
from engine.solids.base import Solid

TETRA = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
BOX = Aabb([0, 0, 0], [1, 1, 1])
TURN = Pose([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]], [0.1, 0.2, 0.3])


def compiled(first: Solid, second: Solid, pose: Pose | None) -> int:
    """Return the relation that compiled proofs find."""
    a, b, work = mesh_body_of(first), mesh_body_of(second), Work()
    with np.errstate(all="ignore"):
        return relate(a, b, (a.posed(pose), b.posed(pose)), what_to_seek(a, b, work), work)[0][RELATION]


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
def test_finds_a_plane_between_convex_bodies(other: Solid, pose: Pose | None) -> None:
    assert compiled(BOX, other, pose) == Relation.TOUCHING


@pytest.mark.parametrize("pose", [None, TURN])
def test_finds_none_where_interiors_meet(pose: Pose | None) -> None:
    for other in (Aabb([0.5, 0, 0], [2, 1, 1]), BOX):
        assert compiled(BOX, other, pose) in (UNSETTLED, Relation.OVERLAPPING)
        assert collide(BOX, other, first_pose=pose, second_pose=pose).relation == Relation.OVERLAPPING


def cone(tip: float, base: float, radius: float, n: int) -> Polyhedron:
    """Return a cone around the z axis, its sides some way in and out so that it is not convex."""
    turn = np.arange(n) * 2.0 * np.pi / n
    reach = radius * np.where(np.arange(n) % 2, 1.0, 0.75)
    ring = np.column_stack([reach * np.cos(turn), reach * np.sin(turn), np.full(n, base)])
    vertices = np.concatenate([ring, [[0.0, 0.0, tip], [0.0, 0.0, base]]])
    sides = [[i, n, (i + 1) % n] for i in range(n)]
    caps = [[(i + 1) % n, n + 1, i] for i in range(n)]
    faces = np.array(sides + caps)
    return Polyhedron(vertices, faces if tip < base else faces[:, ::-1])


@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize("n", [6, 40, 70])
def test_faces_that_only_meet_in_points_decide(n: int, pose: Pose | None) -> None:
    wide, narrow = cone(0.0, 2.0, 1.0, n), cone(0.0, 3.0, 0.25, n)
    pit = Polyhedron(  # a block around the wide cone: its sides, from outside, and four walls further out
        np.concatenate([wide.vertices[: n + 1], cone(-1.0, 2.0, 4.0, n).vertices[: n + 1]]),
        [[(i + 1) % n, n, i] for i in range(n)]
        + [[n + 1 + i, 2 * n + 1, n + 1 + (i + 1) % n] for i in range(n)]
        + [f for i in range(n) for f in ([i, n + 1 + i, (i + 1) % n], [n + 1 + i, n + 1 + (i + 1) % n, (i + 1) % n])],
    )
    answer = collide(pit, narrow, first_pose=pose)
    assert pose is not None or (answer.relation, answer.witness.kind) == (Relation.TOUCHING, "vertex_vertex")
    assert collide(pit, wide).relation == Relation.TOUCHING  # flush all around
    assert collide(wide, narrow).relation == Relation.OVERLAPPING  # one in the other, from a common corner


def test_of_thousands_of_flush_contacts_the_witness_is_that_of_the_first_faces() -> None:
    found = collide(cone(0.0, 2.0, 1.0, 70), cone(0.0, 2.0, 1.0, 70))
    assert found == Collision(Relation.OVERLAPPING, Witness("face_face", 0, 0))


def test_corners_on_walls_from_inside_are_not_taken_for_outside() -> None:
    big = Aabb([0, 0, 0], [4, 4, 4])
    for axes in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (1, 0, 2), (0, 2, 1), (2, 1, 0)):
        for far in (0.0, 4.0):
            inside = np.array([[far, 1, 1], [far, 3, 3], [1, 4 - far, 1], [3, far, 2]])[:, axes]
            faces = TETRA if np.linalg.det(inside[1:] - inside[0]) > 0 else [face[::-1] for face in TETRA]
            tetra = Polyhedron(inside, faces)
            assert collide(big, tetra).relation == collide(tetra, big).relation == Relation.OVERLAPPING
