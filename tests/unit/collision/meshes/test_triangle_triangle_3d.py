"""The kernel for pairs of triangles of space: right, or UNSETTLED where one has no area."""

from __future__ import annotations

import numpy as np

from engine.collision.codes import UNSETTLED
from engine.collision.triangles import relate_triangles_3d
from tests.reference.contact import triangles_meet
from tests.reference.exact import vector


def test_agrees_with_the_reference_on_a_lattice() -> None:
    first, second = np.random.default_rng(8).integers(0, 3, (2, 400, 3, 3)).astype(float)
    found = np.empty(400, np.int8)
    relate_triangles_3d(first, second, found)
    for t, u, how in zip(first, second, found.tolist()):
        if how == UNSETTLED:
            areas = [np.cross(v[1] - v[0], v[2] - v[0]).any() for v in (t, u)]
            assert not all(areas)
            continue
        one, other = (tuple(vector(p) for p in v.tolist()) for v in (t, u))
        if all(np.cross(v[1] - v[0], v[2] - v[0]).any() for v in (t, u)):
            assert (how != 0) == triangles_meet(one, other)
    assert (found == UNSETTLED).mean() < 0.3
