"""How faces lie among the others of their body: clean, crossed, stacked."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Surface
from engine.collision.meshes.face_state import states_of
from engine.collision.meshes.mesh_arrays import STATE_CLEAN, STATE_CROSSED, STATE_STACKED, MeshBody, mesh_body_of
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
