"""Eight triangles against a segment: none that it meets is missed, and compiled code says what Python says."""

from __future__ import annotations

import numpy as np
import pytest

from engine.jit import kernel
from engine.lanes.triangles import near_triangles
from engine.segment_clipping.on_boundary.mesh_contacts import local_segment, shear_of
from engine.segment_clipping.on_boundary.prepared_boundary import mesh_of
from engine.types import Point3


@kernel
def asked(corners, node, i, j, k, middle, r, s, reach, slack):  # type: ignore[no-untyped-def]
    return near_triangles(corners, node, i, j, k, middle, r, s, reach, slack)


@pytest.mark.parametrize("scale", [1e-150, 1e-9, 1.0, 1e9, 1e150])
def test_triangles_met_are_near(scale: float) -> None:
    """Triangles through points of a segment, of all sizes and shapes, far from the origin too."""
    rng = np.random.default_rng(int(np.log10(scale)) + 200)
    n_met = n_apart = 0
    for size in (1e-6, 1e-3, 1.0):
        for length in (1e-6, 1.0, 1e6):
            p, q = rng.uniform(-1, 1, (2, 3)) * [length, length, 1.0]
            at = p + rng.uniform(0, 1, (64, 1)) * (q - p)
            u, v = rng.normal(size=(2, 64, 3)) * size * 10.0 ** rng.uniform(-4, 0, (2, 64, 1))
            met = np.stack([at + u, at + v, at - u - v], axis=1)  # its middle is on the segment
            met[::8, 1] = met[::8, 0]  # no area
            met[::8, 2] = 2 * at[::8] - met[::8, 0]
            free = rng.uniform(-1, 1, (64, 1, 3)) + rng.normal(size=(64, 3, 3)) * size
            offset = rng.choice([0.0, 1e3]) * np.ones(3)
            corners = (np.concatenate([met, free]) + offset) * scale
            mesh = mesh_of(corners, np.arange(len(corners)))
            ends = Point3(*((p + offset) * scale)), Point3(*((q + offset) * scale))
            way = local_segment(*ends, mesh.origin, mesh.inverse, 0.0)
            assert way.is_near
            (i, j, k), middle, *numbers = shear_of(way)
            arguments = (i, j, k, middle, *map(np.float32, numbers))
            for node in np.flatnonzero(mesh.child[:, 0] < 0):
                block = node - mesh.n_inner
                lanes = near_triangles(mesh.corners, block, *arguments)
                assert asked(mesh.corners, block, *arguments) == lanes
                for lane, item in enumerate(-1 - mesh.child[node].astype(int)):
                    if item < len(met) and item >= 0 and length <= 1.0:  # longer ones: rounding moves the point off
                        assert lanes >> lane & 1
                        n_met += 1
                    elif 0 <= item < len(corners):
                        n_apart += not lanes >> lane & 1
    assert min(n_met, n_apart) > 100
