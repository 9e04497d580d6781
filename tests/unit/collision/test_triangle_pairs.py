"""The kernel for pairs of triangles of the plane: right or UNSETTLED, and that only beyond its exponents."""

from __future__ import annotations

import numpy as np

from engine.collision.codes import UNSETTLED
from engine.collision.triangles import relate_triangles_2d
from tests.reference.collision import relation


def test_agrees_with_the_reference_on_a_lattice() -> None:
    first, second = np.random.default_rng(7).integers(0, 4, (2, 400, 3, 2)).astype(float)
    found = np.empty(400, np.int8)
    relate_triangles_2d(first, second, found)
    for t, u, how in zip(first.tolist(), second.tolist(), found.tolist()):
        assert how == relation({"type": "triangle", "vertices": t}, {"type": "triangle", "vertices": u})


def test_exponents_that_no_expansion_spans_stay_unsettled() -> None:
    t = np.array([[[0.0, 0.0], [2.0**1000, 2.0**-1073], [2.0**-1073, 2.0**1000]]])
    found = np.empty(1, np.int8)
    with np.errstate(all="ignore"):
        relate_triangles_2d(t, t + 0.0, found)
    assert found[0] == UNSETTLED
