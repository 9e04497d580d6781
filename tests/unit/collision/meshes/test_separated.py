"""Bodies that a plane separates: relation and witness are those of all pairs of faces, by exact arithmetic."""

from __future__ import annotations

import itertools
import random

import numpy as np
import pytest

from engine import Polyhedron, Pose, Relation, Surface, clearance, collide, collide_poses, collide_scene
from engine.collision.meshes.contact_kinds import STRENGTH
from engine.collision.meshes.exact_body import classify_exact, exact_pair, kind_of_contact
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.meshes.triangle_triangle import APART
from tests.reference.collision import are_disjoint
from tests.unit.collision.meshes.bodies import TURN, brick, with_far_shell
from tests.unit.distance.makers import Json

TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


def strongest(first: Polyhedron, second: Polyhedron, poses: tuple[Pose | None, Pose | None]) -> tuple[int, int, int]:
    """Return the strongest kind of contact of two faces, among equals that of the lowest faces."""
    a, b = exact_pair(mesh_body_of(first), mesh_body_of(second), poses)
    found = []
    for i, j in itertools.product(range(len(a.mesh.faces)), range(len(b.mesh.faces))):
        if classify_exact(a.corners(i), b.corners(j)) != APART:
            kind = STRENGTH.index(kind_of_contact(a.corners(i), b.corners(j)))
            found.append((kind, int(a.mesh.faces[i]), int(b.mesh.faces[j])))
    return min(found)


def cut_corner(rng: np.random.Generator) -> Polyhedron:
    """A tetrahedron on small integers with a face in the plane z = 0, above it."""
    while True:
        corners = rng.integers(0, 4, (4, 3))
        corners[:3, 2], corners[3, 2] = 0, rng.integers(1, 4)
        if np.linalg.det(corners[1:] - corners[0]) > 0.5:
            return Polyhedron(corners.astype(float), TETRAHEDRON)


@pytest.mark.some(10)
@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize("seed", range(12))
def test_the_witness_is_the_strongest_of_all_contacts(seed: int, pose: Pose | None) -> None:
    rng, kinds = np.random.default_rng(seed), set()
    for _ in range(12):
        first, flip = cut_corner(rng), np.array([1.0, 1.0, -1.0])
        other = cut_corner(rng)
        moved = other.vertices * flip + [*rng.integers(-3, 4, 2).tolist(), 0]
        second = Polyhedron(moved, other.triangles[:, ::-1])
        answer = collide(first, second, first_pose=pose, second_pose=pose)
        assert answer.relation in (Relation.TOUCHING, Relation.DISJOINT)
        if answer.relation == Relation.TOUCHING:
            assert answer.witness is not None
            kind, f, g = strongest(first, second, (pose, pose))
            assert (answer.witness.kind, answer.witness.first_face, answer.witness.second_face) == (
                STRENGTH[kind],
                f,
                g,
            )
            kinds.add(kind)
    assert kinds


@pytest.mark.some(20)
@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize("at", list(itertools.product((-1, -0.5, 0, 1, 2), (-1, 0, 0.5, 2), (-1, 2))))
def test_boxes_that_touch(at: tuple[float, float, float], pose: Pose | None) -> None:
    first, second = brick(2), brick(1, at)
    answer = collide(first, second, first_pose=pose, second_pose=pose)
    assert answer.relation == Relation.TOUCHING
    kind, f, g = strongest(first, second, (pose, pose))
    assert answer.witness is not None
    assert (answer.witness.kind, answer.witness.first_face, answer.witness.second_face) == (STRENGTH[kind], f, g)
    far = with_far_shell(first)
    assert collide(far, second, first_pose=pose, second_pose=pose).witness == answer.witness
    relations, witnesses = collide_poses(first, second, np.eye(3)[None], np.zeros((1, 3)), witnesses=True)
    assert (relations[0], witnesses[0]) == (int(Relation.TOUCHING), answer.witness)


@pytest.mark.parametrize("gap", [0.0, 2.0**-30, 2.0**-48])
@pytest.mark.parametrize("pose", [None, TURN])
def test_plates_of_many_faces(gap: float, pose: Pose | None) -> None:
    """More pairs of faces near each other than are tried one by one; the gap is below what boxes resolve."""
    lower, upper = brick(24), brick(24, (0.5, 0.25, 24 + gap))
    answer = collide(lower, upper, first_pose=pose, second_pose=pose)
    slot = with_far_shell(lower, (1, 1, 100))
    assert collide(slot, upper, first_pose=pose, second_pose=pose).relation == answer.relation
    if gap:
        assert answer.relation == Relation.DISJOINT
        if pose is None:
            assert clearance(lower, upper).distance == upper.vertices[:, 2].min() - 24
    else:
        assert answer.relation == Relation.TOUCHING
        assert answer.witness is not None
        assert answer.witness.kind == "face_face"


@pytest.mark.parametrize("pose", [None, TURN])
def test_a_body_and_an_equal_one(pose: Pose | None) -> None:
    body, doubled = brick(2), brick(2)
    for second in (body, doubled):
        answer = collide(body, second, first_pose=pose, second_pose=pose, detail=True)
        assert str(answer) == "<Collision: overlapping, face_face 0 0, EQ>"
    sheet = Surface(body.vertices, body.triangles)  # the same arrays, and no inside
    for pair in ((body, sheet), (sheet, body), (sheet, sheet)):
        assert collide(*pair, first_pose=pose, second_pose=pose).relation == Relation.TOUCHING
    hollow = np.concatenate([body.triangles, body.triangles[:, ::-1]])  # its faces cancel: no inside at all
    nothing = Polyhedron(body.vertices, hollow)
    assert collide(nothing, nothing).relation == Relation.TOUCHING


def test_a_common_area_with_both_bodies_on_one_side_overlaps() -> None:
    """No face crosses another: all contacts are flush or along edges."""
    for at in itertools.product((-1, 0, 1), repeat=3):
        answer = collide(brick(2), brick(2, at), detail=True)
        assert answer.relation == Relation.OVERLAPPING
        assert answer.detail is not None
        assert answer.detail.label == ("EQ" if at == (0, 0, 0) else "PO")


def test_a_plane_between_a_body_and_faces_without_area_proves_no_contact() -> None:
    rng, n_apart = random.Random(7), 0
    for _ in range(60):
        corners = [[[float(rng.randint(-2, 2)) for _ in range(3)] for _ in range(4)] for _ in range(2)]
        corners[1][1] = corners[1][0]
        given: list[Json] = [{"type": "polyhedron", "vertices": each, "faces": TETRAHEDRON} for each in corners]
        bodies = [Polyhedron(each, TETRAHEDRON) for each in corners]
        are_apart = are_disjoint(*given)
        n_apart += are_apart
        assert (collide(*bodies, witness=False).relation == Relation.DISJOINT) == are_apart
        assert (collide_poses(*bodies, [np.eye(3)], [[0, 0, 0]])[0] == Relation.DISJOINT) == are_apart
        assert (len(collide_scene(bodies, witnesses=False).first) == 0) == are_apart
    assert 10 < n_apart < 50
