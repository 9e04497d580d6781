"""The flat cylinders of a tree hold the faces below their children, and are flat where these are."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Surface
from engine.collision.meshes.mesh_arrays import MeshBody, mesh_body_of
from engine.lanes.boxes import EMPTY


def faces_below(mesh: MeshBody, node: int) -> list[int]:
    """Return the triangles below a node."""
    child = mesh.arrays.child[node]
    if child[0] < 0:
        return [-1 - int(item) for item in child if item != EMPTY]
    return [face for below in child if below != EMPTY for face in faces_below(mesh, int(below))]


def surfaces() -> dict[str, Surface]:
    rng = np.random.default_rng(5)
    x, y = (values.ravel() for values in np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9)))
    cells = np.array([9 * row + column for row in range(8) for column in range(8)])
    faces = np.concatenate([np.stack([cells, cells + 1, cells + 10], 1), np.stack([cells, cells + 10, cells + 9], 1)])
    across, up = np.pi * x, 0.5 * np.pi * y
    sphere = np.stack([np.cos(up) * np.cos(across), np.cos(up) * np.sin(across), np.sin(up)], 1)
    return {
        "flat": Surface(np.stack([x, y, x + 2 * y], 1), faces),
        "waves": Surface(np.stack([x, y, 0.1 * np.sin(5 * x) * np.cos(4 * y)], 1), faces),
        "line": Surface(np.stack([x, 2 * x, 3 * x], 1), faces),
        "soup": Surface(rng.normal(size=(300, 3)), np.arange(300).reshape(-1, 3)),
        "sphere": Surface(sphere, faces),
    }


@pytest.mark.parametrize("name", surfaces())
def test_a_disc_holds_the_faces_of_its_child(name: str) -> None:
    mesh = mesh_body_of(surfaces()[name])
    arrays = mesh.arrays
    local = (arrays.vertices - arrays.origin) / arrays.scale
    for node in range(len(arrays.child)):
        for lane in range(8):
            below = int(arrays.child[node, lane])
            if below < 0:
                continue
            disc = arrays.discs[node, :, lane].astype(float)
            n = disc[3:6] / np.linalg.norm(disc[3:6])
            away = local[arrays.triangles[faces_below(mesh, below)]].reshape(-1, 3) - disc[:3]
            along = away @ n
            assert (np.abs(along) <= disc[7]).all()
            assert (np.linalg.norm(away - along[:, None] * n, axis=1) <= disc[6]).all()
            assert name != "flat" or disc[7] < 1e-5
