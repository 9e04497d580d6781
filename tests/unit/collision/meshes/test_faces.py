"""Faces: which are free, what they enclose, where they touch."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from engine import Aabb, Polyhedron, Pose, Surface, collide, locate
from engine.collision.meshes.contact_kinds import N_NAMED
from engine.collision.meshes.exact_body import classify_exact, kind_of_contact
from engine.collision.meshes.mesh_arrays import (
    STATE_CLEAN,
    STATE_CROSSED,
    STATE_STACKED,
    MeshBody,
    mesh_body_of,
    mesh_body_of_triangles,
)
from engine.collision.meshes.mesh_mesh import inspect_regions
from engine.collision.meshes.mesh_pair import MeshPair
from engine.collision.meshes.parity import SIDE_UNKNOWN, inner_side, locate_vertices, states_of
from engine.collision.meshes.triangle_triangle import APART, COMMON_AREA, COPLANAR, CORNER
from engine.collision.result import Work
from engine.types import UNDECIDED
from tests.reference.shapes import Solid, box, reversed_faces, tetrahedron, union_of
from tests.unit.collision.meshes.bodies import TURN, brick, mesh, with_far_shell

FACE = [[0, 0, 0], [6, 0, 0], [0, 6, 0]]


def states(body: MeshBody) -> list[int]:
    found = states_of(body.arrays, np.arange(len(body.faces)))
    return found[np.argsort(body.faces)].tolist()


def test_faces_of_a_box_are_clean() -> None:
    assert states(mesh(3)) == [STATE_CLEAN] * 108


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        ([[1, 1, -1], [1, 2, 1], [2, 1, 1]], STATE_CROSSED),
        ([[1, 1, 0], [2, 1, 0], [1, 2, 1]], STATE_CROSSED),  # an edge within the face
        ([[1, 1, 0], [2, 1, 1], [1, 2, 1]], STATE_CLEAN),  # a single point
        ([[1, 1, 0], [2, 1, 0], [1, 2, 0]], STATE_STACKED),
        ([[6, 0, 0], [6, 6, 0], [0, 6, 0]], STATE_CLEAN),  # beside it in its plane
        ([[1, 1, 0], [1, 1, 0], [1, 1, 0]], STATE_CLEAN),  # a face without area
    ],
)
def test_what_another_face_makes_of_it(other: list[list[float]], expected: int) -> None:
    assert states(mesh_body_of(Surface(FACE + other, [[0, 1, 2], [3, 4, 5]])))[0] == expected


CUBE = box((0, 0, 0), (2, 2, 2))


def body(solid: Solid) -> MeshBody:
    triangles = [[f[0], f[k], f[k + 1]] for f in solid["faces"] for k in range(1, len(f) - 1)]
    return mesh_body_of_triangles(
        np.array(solid["vertices"], float), np.array(triangles), np.arange(len(triangles)), True
    )


def sides(solid: Solid) -> set[int]:
    mesh = body(solid).arrays
    with np.errstate(all="ignore"):
        return {inner_side(mesh, face, np.zeros((1, 12))) for face in range(len(mesh.triangles))}


@pytest.mark.full
@pytest.mark.parametrize("solid", [CUBE, tetrahedron((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))])
def test_is_against_outward_normals(solid: Solid) -> None:
    (side,) = sides(solid)
    assert sides(reversed_faces(solid)) == {-side}
    assert side in (1, -1)


def test_a_cavity_turned_outward_has_its_body_on_the_other_side() -> None:
    assert sides(union_of(CUBE, box((0.5, 0.5, 0.5), (1, 1, 1)))) == {1, -1}


def test_of_faces_that_cancel_nothing_is_told() -> None:
    assert sides(union_of(CUBE, CUBE)) == {SIDE_UNKNOWN}


# --- Regions of faces in contact: where both insides come up to one side ---


@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize(("at", "overlaps"), [((1, 0, 0), True), ((2, 0, 0), False), ((0, 0, 0), True)])
def test_flush_boxes(at: tuple[float, float, float], overlaps: bool, pose: Pose | None) -> None:
    pair = MeshPair(mesh(2), mesh(2, at), (pose, pose), Work())
    with np.errstate(all="ignore"):
        pair.find_contacts()
        found = False
        for face in np.unique(pair.contacts[:, 0]).tolist():
            is_overlap, pierces = inspect_regions(pair, 0, face, True)
            found |= is_overlap
            assert not pierces or overlaps
        assert found == overlaps


def test_regions_of_a_body_in_one_plane_are_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """They would show that it has no interior: 400 faces over one another took 45 seconds."""
    turns = 2 * np.pi * np.arange(60) / 60
    rim = np.round(64 * np.c_[np.cos(turns), np.sin(turns)])
    corners = np.r_[rim, [[3, 5], [-7, 2]]]
    around = [[i, (i + 1) % 60, 60] for i in range(60)] + [[(i + 1) % 60, i, 61] for i in range(60)]
    asked = []
    monkeypatch.setattr("engine.collision.meshes.exact_regions.regions_of", lambda *_: asked.append(1) or iter(()))
    in_plane = [np.c_[rows, rows[:, 0] + 2 * rows[:, 1]] for rows in (corners, corners + np.array([9.0, 4.0]))]
    first, second = (Polyhedron(rows, around) for rows in in_plane)
    answers = [collide(first, second)]
    assert not asked
    monkeypatch.undo()
    answers.append(collide(first, Aabb([-9, -9, -100], [9, 9, 100])))
    assert [answer.relation.label for answer in answers] == ["touching", "touching"]
    assert [answer.witness.piercing for answer in answers if answer.witness] == [False, True]


# --- All contacts of a pair, the first of them by the caller's faces, coplanar ones with more than a corner first ---


@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize("at", [(2, 0.5, 0), (2, 2, 1), (9, 0, 0)])
def test_contacts_are_those_of_all_pairs_in_order(pose: Pose | None, at: tuple[float, float, float]) -> None:
    pair = MeshPair(mesh_body_of(with_far_shell(brick(2))), mesh(1, at), (pose, pose), Work())
    with np.errstate(all="ignore"):
        pair.find_contacts()
    assert not pair.is_settled
    a, b = pair.exact
    every = list(itertools.product(range(len(a.mesh.faces)), range(len(b.mesh.faces))))
    kinds = {(i, j): classify_exact(a.corners(i), b.corners(j)) for i, j in every}
    found = [(i, j) for i, j in pair.contacts.tolist()]
    assert sorted(found) == [key for key in every if kinds[key] != APART]
    ranks = {COMMON_AREA: 0, COPLANAR: 1}
    for (i, j), kind in kinds.items():
        if kind == COPLANAR and kind_of_contact(a.corners(i), b.corners(j)) == "vertex_vertex":
            kinds[i, j] = CORNER
    keys = [(ranks.get(kinds[i, j], 2), a.mesh.faces[i], b.mesh.faces[j], i, j) for i, j in found]
    assert keys[:N_NAMED] == sorted(keys)[:N_NAMED]


def test_a_crossing_settles() -> None:
    pair = MeshPair(mesh(2), mesh(2, (1, 0.5, 0.25)), (None, None), Work())
    pair.find_contacts()
    assert pair.is_settled
    assert len(pair.contacts) == 1


# --- Vertices of one placed body in another: what exact containment says, or UNDECIDED ---


@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize("at", [(0, 0, 0), (0.5, 0.25, 1), (0.1, 0.2, 0.3)])
def test_agrees_with_locate(pose: Pose | None, at: tuple[float, float, float]) -> None:
    solid = Polyhedron([[0, 0, 0], [3, 0, 0], [0, 3, 0], [0.5, 0.5, 3]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    source = mesh_body_of(brick(3, at))
    target = mesh_body_of(solid)
    vertices = np.arange(len(source.arrays.vertices))
    found = np.empty(len(vertices), np.int8)
    with np.errstate(all="ignore"):
        locate_vertices(
            source.arrays, source.posed(pose), vertices, target.arrays, target.posed(pose), found, np.zeros(1, np.uint8)
        )
    expected = locate(source.arrays.vertices, solid)  # one pose of both changes nothing
    is_off = expected != 0  # on a face nothing is promised
    decided = is_off & (found != UNDECIDED)
    assert (found[decided] == expected[decided]).all()
    assert decided.sum() > (0.4 if pose is not None else 0.99) * is_off.sum()
