"""How faces lie among the others of their body: clean, crossed, stacked."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Surface
from engine.collision.meshes.face_state import UNTOLD, inner_side, states_of
from engine.collision.meshes.mesh_arrays import (
    STATE_CLEAN,
    STATE_CROSSED,
    STATE_STACKED,
    MeshBody,
    mesh_body_of,
    mesh_body_of_triangles,
)
from tests.reference.shapes import Solid, box, reversed_faces, tetrahedron, union_of
from tests.unit.collision.meshes.bodies import mesh

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


@pytest.mark.parametrize("solid", [CUBE, tetrahedron((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))])
def test_is_against_outward_normals(solid: Solid) -> None:
    (side,) = sides(solid)
    assert sides(reversed_faces(solid)) == {-side}
    assert side in (1, -1)


def test_a_cavity_turned_outward_has_its_body_on_the_other_side() -> None:
    assert sides(union_of(CUBE, box((0.5, 0.5, 0.5), (1, 1, 1)))) == {1, -1}


def test_of_faces_that_cancel_nothing_is_told() -> None:
    assert sides(union_of(CUBE, CUBE)) == {UNTOLD}
