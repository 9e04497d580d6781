"""Edges near each other: the certificate may fail, but what passes it is what exact arithmetic says."""

from __future__ import annotations

import numpy as np
import pytest

from tests.unit.polygon_overlay.checks import OPERATIONS
from tests.unit.polygon_overlay.compiled.test_kernel import agree


@pytest.mark.parametrize("steps", [0, 3, 60, 300])
@pytest.mark.parametrize("turns", [0, 1])
def test_stripes_so_many_units_apart(steps: int, turns: int) -> None:
    """Gaps between edges, between crossings along an edge, and between a crossing and a vertex."""
    gap = steps * 2.0**-52
    rng = np.random.default_rng([steps, turns])
    slant = rng.uniform(0.1, 0.4)
    stripe = np.array([(-0.9, 0.1), (0.9, 0.1 + slant), (0.9, 0.3 + slant), (-0.9, 0.3)])
    comb = np.array(
        [(-0.5, -0.8), (0.5, -0.8), (0.5, 0.9), (gap, 0.9), (gap, -0.2), (0.0, -0.2), (0.0, 0.9), (-0.5, 0.7)]
    )
    corner = np.array([(0.5 - gap, -1.0), (1.0, -1.0), (1.0, 1.0), (0.5 - gap, 1.0)])
    for clip in (comb, corner, stripe + gap):
        other = clip[:, ::-1] if turns else clip
        agree([stripe, comb], [other], "union")
        for operation in OPERATIONS:
            agree([stripe], [other], operation)
