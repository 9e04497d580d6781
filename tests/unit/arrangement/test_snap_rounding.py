"""Snap rounding: lattice points only, nothing crosses afterwards, no edge moves by more than half a diagonal."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine.arrangement.arrange import arrange_rings
from engine.arrangement.snap_rounding import snap_rings


def exact_rings(seed: int, size: int) -> list[list[tuple[Fraction, Fraction]]]:
    """Return the edges of a random arrangement as degenerate rings: each is there and back again."""
    random = np.random.default_rng(seed)
    coordinates = random.integers(0, size, (12, 2)).astype(float)
    arrangement = arrange_rings(coordinates, [0, 6, 12], [1, 2])
    exact = arrangement.nodes.exact
    return [[exact(tail), exact(head)] for tail, head in zip(arrangement.tails, arrangement.heads, strict=True)]


@pytest.mark.parametrize("spacing", [-2, 0, 3])
@pytest.mark.parametrize("seed", range(12))
def test_snapped_edges_meet_in_lattice_points_only(seed: int, spacing: int) -> None:
    chains, _ = snap_rings(exact_rings(seed, 60), spacing)
    unit = 2.0**spacing
    vertices = np.array([vertex for chain in chains for vertex in chain]).reshape(-1, 2)
    assert (vertices / unit == np.rint(vertices / unit)).all()
    arrangement = arrange_rings(vertices, np.cumsum([0, *map(len, chains)]).tolist(), [1] * len(chains))
    assert arrangement.nodes.all_floats  # no new crossing: only points that were there


@pytest.mark.parametrize("seed", range(6))
def test_no_vertex_of_a_chain_is_far_from_its_edge(seed: int) -> None:
    rings = exact_rings(seed, 40)
    for (a, b), chain in zip(rings, snap_rings(rings, 1)[0], strict=True):
        for x, y in chain:
            cross = (b[0] - a[0]) * (Fraction(y) - a[1]) - (b[1] - a[1]) * (Fraction(x) - a[0])
            length = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2
            assert cross**2 <= length * 2  # half the diagonal of a pixel of side 2 is sqrt 2


def test_pixels_are_half_open() -> None:
    half = Fraction(1, 2)
    assert snap_rings([[(half, half), (-half, -half), (Fraction(3), Fraction(0))]], 0)[0] == [[(1, 1), (0, 0), (3, 0)]]


def test_edge_goes_through_the_hot_pixels_it_passes() -> None:
    zero = Fraction(0)
    near = [(Fraction(5), Fraction(1, 4)), (Fraction(5), Fraction(4)), (Fraction(6), Fraction(4))]
    edge = [(zero, zero), (Fraction(10), zero), (zero, Fraction(-9))]
    assert snap_rings([edge, near], 0)[0][0] == [(0, 0), (5, 0), (10, 0), (0, -9)]


def test_ring_smaller_than_a_pixel_shrinks_to_a_point() -> None:
    tiny = Fraction(1, 8)
    assert snap_rings([[(tiny, tiny), (2 * tiny, tiny), (tiny, 2 * tiny)]], 0)[0] == [[(0, 0)]]
