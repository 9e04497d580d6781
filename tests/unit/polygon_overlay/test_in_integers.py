"""The overlay in integers: exact areas add up, whatever the exponents, and valid rings come back as they are."""

from __future__ import annotations

import numpy as np
import pytest

from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.in_integers import overlay_exactly, rebuild_from_rounded_rings
from engine.polygon_overlay.pair_arrays import one_pair
from engine.running.budget import Budget
from tests.unit.polygon_overlay.checks import OPERATIONS
from tests.unit.polygon_overlay.compiled.test_kernel import arrays


@pytest.mark.parametrize("scale", [1.0, 2.0**900, 2.0**-900])
@pytest.mark.parametrize("seed", range(4))
def test_areas_add_up(seed: int, scale: float) -> None:
    random = np.random.default_rng(seed)
    subject, clip = (arrays([ring]) for ring in random.integers(0, 7, (2, 8, 2)) * scale)
    parts = [overlay_exactly(subject, clip, operation, Budget())[0] for operation in OPERATIONS]
    area = dict(zip(OPERATIONS, (part.area_exact for part in parts), strict=True))
    assert area["union"] == area["intersection"] + area["symmetric_difference"]
    other = overlay_exactly(clip, subject, "difference", Budget())[0].area_exact
    assert area["symmetric_difference"] == area["difference"] + other


def test_valid_rings_arranged_again_are_themselves() -> None:
    rings = [
        [(0, 0), (9, 0), (9, 9), (0, 9)],
        [(1, 1), (1, 2), (2, 1)],
        [(3, 3), (3, 4), (4, 3)],
        [(20, 0), (21, 0), (20, 1)],
    ]
    vertices = np.array([vertex for ring in rings for vertex in ring], float)
    given = one_pair(vertices, np.array([0, 4, 7, 10, 13]), np.array([0, 3, 4]), 0.0, 0)
    found = rebuild_from_rounded_rings(given, Budget())
    assert found.vertices.tolist() == vertices.tolist()
    assert (found.ring_offsets.tolist(), found.piece_offsets.tolist()) == ([0, 4, 7, 10, 13], [0, 3, 4])
    assert (found.status[0], found.evidence.tolist()) == (PairStatus.DONE, [[ring, ring] for ring in range(4)])
