"""The overlay in integers: exact areas add up, whatever the exponents, and valid rings come back as they are."""

from __future__ import annotations

import numpy as np
import pytest

from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.in_integers import overlay_exactly, rebuild_from_rounded_rings
from engine.polygon_overlay.overlay import overlay
from engine.polygon_overlay.pair_arrays import one_pair
from engine.polygon_overlay.run import overlay_compiled
from engine.running.budget import Budget
from engine.solids.polygon import Polygon
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


def near_zero(seed: int) -> list[np.ndarray]:
    """Two rings in general position or on a lattice, zeros replaced by neighbours of zero; some differ by an ulp."""
    random = np.random.default_rng(seed)
    sides = []
    for _ in range(2):
        n = random.integers(3, 9)
        ring = [random.integers(-2, 3, (n, 2)).astype(float), random.uniform(-1, 1, (n, 2)).round(1)][seed % 2]
        zeros = (ring == 0.0) & (random.random(ring.shape) < 0.6)
        ring[zeros] = random.choice([5e-324, -5e-324, 1e-323, -(2.0**-1062)], zeros.sum())
        sides.append(ring)
    if seed % 3 == 0:
        sides[1] = np.nextafter(sides[0], random.choice([-9.0, 9.0], sides[0].shape))
    return sides


@pytest.mark.parametrize("operation", OPERATIONS)
@pytest.mark.parametrize("seed", range(60))
def test_neighbours_of_zero(seed: int, operation: str) -> None:
    first, second = near_zero(seed)
    found = overlay(Polygon([first]), Polygon([second]), operation)  # type: ignore[call-overload]
    expected, _ = overlay_exactly(arrays([first]), arrays([second]), operation, Budget())  # type: ignore[arg-type]
    for name in ("vertices", "ring_offsets", "piece_offsets"):
        assert getattr(found, name).tolist() == getattr(expected, name).tolist()


def test_an_ulp_beside_zero_is_compiled() -> None:
    turn = np.arange(400) * np.pi / 200
    circle = np.c_[np.cos(turn), np.sin(turn)]
    pair = arrays([circle]), arrays([np.nextafter(circle, 9.0)])
    assert pair[1].vertices[0, 1] == 5e-324
    for operation in OPERATIONS:
        assert overlay_compiled(*pair, operation, Budget()) is not None  # type: ignore[arg-type]
