"""The side of a face on which its body lies, whichever way its faces are turned."""

from __future__ import annotations

import numpy as np
import pytest

from engine.collision.meshes.inner_side import UNTOLD, inner_side
from engine.collision.meshes.mesh_arrays import MeshBody, mesh_body_of_triangles
from tests.reference.shapes import Solid, box, reversed_faces, tetrahedron, union_of

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
