"""Larger bodies that a plane parts and that touch: the strongest contact of the lowest faces, without all contacts."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from engine import Polyhedron, Pose, Relation, collide, collide_poses
from engine.collision.meshes.contact_kinds import STRENGTH
from engine.collision.meshes.exact_body import classify_exact, exact_pair, kind_of_contact
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.meshes.separated import FEW
from engine.collision.meshes.triangle_triangle import APART
from engine.collision.result import Poses


def fan(n: int, height: float = 1.0, seed: int = 0) -> Polyhedron:
    """Return n faces, half of them around each of two apexes, at (0, 0, +-height), in any order."""
    k = n // 2
    angles, i = np.arange(k) * 2 * np.pi / k, np.arange(k)
    j = (i + 1) % k
    rim = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    faces = np.concatenate([np.column_stack([i, j, 0 * i + k]), np.column_stack([j, i, 0 * i + k + 1])])
    return Polyhedron(
        np.concatenate([rim, [[0, 0, height], [0, 0, -height]]]), np.random.default_rng(seed).permutation(faces)
    )


def block(nx: int, ny: int, seed: int = 0) -> Polyhedron:
    """Return the box from (0, 0, 0) to (4, 4, 1) with flat sides of many triangles, in any order."""
    flat = [[4 * i / nx, 4 * j / ny] for i in range(nx + 1) for j in range(ny + 1)]
    vertices = np.array([[x, y, z] for z in (0.0, 1.0) for x, y in flat])
    faces, top = [], len(flat)
    for i, j in itertools.product(range(nx), range(ny)):
        a, b, c, d = (x * (ny + 1) + y for x, y in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
        faces += [[a, c, b], [a, d, c], [top + a, top + b, top + c], [top + a, top + c, top + d]]
    rim = [i * (ny + 1) for i in range(nx)] + [nx * (ny + 1) + j for j in range(ny)]
    rim += [i * (ny + 1) + ny for i in range(nx, 0, -1)] + list(range(ny, 0, -1))
    for a, b in zip(rim, rim[1:] + rim[:1]):
        faces += [[a, b, top + b], [a, top + b, top + a]]
    return Polyhedron(vertices, np.random.default_rng(seed).permutation(faces))


def strongest(first: Polyhedron, second: Polyhedron, poses: Poses) -> tuple[str, int, int]:
    """Return kind and faces of the strongest contact of all, of equal ones that of the lowest faces."""
    a, b = mesh_body_of(first), mesh_body_of(second)
    x, y = exact_pair(a, b, poses)
    found = []
    for i, j in itertools.product(range(len(a.faces)), range(len(b.faces))):
        if classify_exact(x.corners(i), y.corners(j)) != APART:
            kind = kind_of_contact(x.corners(i), y.corners(j))
            found.append((STRENGTH.index(kind), int(a.faces[i]), int(b.faces[j])))
    best = min(found)
    return STRENGTH[best[0]], *best[1:]


BLOCKS = [(0, 0, 1), (0.5, 0.25, 1), (3, 3.5, 1), (4, 0, 0), (4, 4, 0), (4, 4, 1), (4, 0.5, 1), (-4, 1, 0.5)]


@pytest.mark.parametrize("at", BLOCKS)
def test_flush_blocks_of_other_tilings(at: tuple[float, float, float]) -> None:
    first, second = block(4, 3, 1), block(3, 5, 2)
    assert first.n_faces * second.n_faces > FEW
    move = Pose(np.eye(3), at)
    found = collide(first, second, second_pose=move)
    assert found.relation == Relation.TOUCHING
    assert found.witness is not None
    assert (found.witness.kind, found.witness.first_face, found.witness.second_face) == strongest(
        first, second, (None, move)
    )


@pytest.mark.parametrize("n", [8, 30, 70, 90, 1000])
@pytest.mark.parametrize("height", [1.0, 1e-6, 1e6])
def test_apex_to_apex(n: int, height: float) -> None:
    first, second = fan(n, height, 3), fan(n + 2, height, 4)
    for step, expected in (
        (2.0, Relation.TOUCHING),
        (2.0 + 1e-15, Relation.DISJOINT),
        (2.0 - 1e-15, Relation.OVERLAPPING),
    ):
        move = Pose(np.eye(3), [0, 0, step * height])
        found = collide(first, second, second_pose=move)
        assert found.relation == expected
        assert collide_poses(first, second, move.rotation[None], move.translation[None]).tolist() == [expected]
        assert collide(second, first, first_pose=move).relation == expected
        if expected == Relation.TOUCHING:
            top = np.flatnonzero((first.triangles == n // 2).any(axis=1)).min()
            low = np.flatnonzero((second.triangles == n // 2 + 2).any(axis=1)).min()
            assert found.witness is not None
            assert (found.witness.kind, found.witness.first_face, found.witness.second_face) == (
                "vertex_vertex",
                top,
                low,
            )


def test_apex_on_a_plate_of_many_faces() -> None:
    plate, cone = block(6, 6, 5), fan(200, 1.0, 6)
    for at in ([2.0, 2.0, 2.0], [2.1, 2.0, 2.0], [2.1, 2.2, 2.0]):  # on a vertex, within an edge, within a face
        move = Pose(np.eye(3), at)
        found = collide(plate, cone, second_pose=move)
        assert found.relation == Relation.TOUCHING
        assert found.witness is not None
        assert (found.witness.kind, found.witness.first_face, found.witness.second_face) == strongest(
            plate, cone, (None, move)
        )


@pytest.mark.parametrize("at", [(0.0, 0.0), (0.3, 0.1)])
def test_plates_with_little_between_them(at: tuple[float, float]) -> None:
    plate, gap = block(20, 16, 7), 2.0**-30
    move = Pose(np.eye(3), [*at, 1.0 + gap])
    assert collide(plate, plate, second_pose=move).relation == Relation.DISJOINT
    for low, expected in ((gap, Relation.TOUCHING), (gap / 2, Relation.DISJOINT), (2 * gap, Relation.OVERLAPPING)):
        vertices = plate.vertices.copy()
        vertices[8 * 17 + 8] -= [0, 0, low]  # one vertex of the lower side nearer
        bent = Polyhedron(vertices, plate.triangles)
        assert collide(plate, bent, second_pose=move).relation == expected
        assert collide(bent, plate, first_pose=move).relation == expected


def test_fans_that_overlap_are_decided_in_time() -> None:
    first, second = fan(64_000, 1.0, 1), fan(64_000, 1.0, 2)
    for at in ([0.3, 0.1, 0.2], [0.0, 0.0, 0.3]):  # all boxes around the apexes overlap
        move = Pose(np.eye(3), at)
        for n in (8, 40_000):  # compiles, the trees of large meshes as well
            collide(fan(n), fan(n), second_pose=move)
        assert collide(first, second, second_pose=move, deadline=0.5).relation == Relation.OVERLAPPING
        assert collide(second, first, second_pose=move, deadline=0.5).relation == Relation.OVERLAPPING


def prism() -> Polyhedron:
    """Return a prism of 512 sides, with corners at (1, 0) and (-1, 0)."""
    n, turns = 512, np.arange(512) * 2 * np.pi / 512
    ring = np.column_stack([np.cos(turns), np.sin(turns)])
    ring[[0, 256]] = [1.0, 0.0], [-1.0, 0.0]
    faces = [list(range(n))[::-1], list(range(n, 2 * n))]
    faces += [[k, (k + 1) % n, n + (k + 1) % n] for k in range(n)] + [[k, n + (k + 1) % n, n + k] for k in range(n)]
    return Polyhedron(np.concatenate([np.column_stack([ring, np.full(n, z)]) for z in (0.0, 1.0)]), faces)


def test_prisms_that_share_an_edge_are_named_in_time() -> None:
    """510 triangles of each flat side meet in the ends of an edge; the sides lie in one plane."""
    first, turn = prism(), Pose(np.diag([-1.0, -1.0, 1.0]), [2, 0, 0])
    collide(first, first, second_pose=Pose(np.eye(3), [0, 0.5, -1]))  # compiles
    found = collide(first, first, second_pose=turn, deadline=2.0)  # it took six seconds
    assert found.relation == Relation.TOUCHING
    assert found.witness is not None
    assert (found.witness.kind, found.witness.first_face, found.witness.second_face) == ("edge_edge", 513, 513)


def test_faces_of_many_triangles_are_named_in_time() -> None:
    """Two prisms with flush sides of 510 triangles each: of one face all triangles have its number."""
    first = prism()
    collide(first, first, second_pose=Pose(np.eye(3), [0, 0.5, -1]))  # compiles
    found = collide(first, first, second_pose=Pose(np.eye(3), [0, 1, -1]), deadline=1.0)  # it took three seconds
    assert found.relation == Relation.TOUCHING
    assert found.witness is not None
    assert (found.witness.kind, found.witness.first_face, found.witness.second_face) == ("face_face", 0, 1)
