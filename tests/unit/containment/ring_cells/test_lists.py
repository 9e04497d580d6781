"""Lists of edges by cells: every edge is listed wherever it passes, and every cell's side is that of its points."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Polygon
from engine.arrays import read_only
from engine.containment.rational_locate import next_in_ring, rational_location
from engine.containment.ring_cells.lists import LevelOfNodes, choose_cuts, count_level, fill_level, place_edges
from engine.containment.ring_cells.locate import EDGE_SHIFT, FINE_BITS

FLAG = np.zeros(1, np.uint8)


def level_of(solid: Polygon) -> tuple[LevelOfNodes, np.ndarray, np.ndarray]:  # type: ignore[type-arg]
    """Return the topmost cells of a polygon whose box is [0, 8]^2, and counts and sides of them."""
    starts = solid.vertices
    ends = read_only(np.ascontiguousarray(starts[next_in_ring(solid)]))
    n = len(starts)
    edges, places = np.empty(4 * n + 4), np.zeros((n + 1, 4))
    edges[:4] = 0.0, -np.inf, np.inf, np.nan
    place_edges(starts, ends, np.zeros(2), np.full(2, (2.0**FINE_BITS - 2.0) / 4.0), edges, places)
    nodes, edges_of = np.array([[0, 0, FINE_BITS, FINE_BITS, 0, 0, n]]), np.arange(1, n + 1, dtype=np.int32)
    cuts = np.zeros((1, 2), np.int64)
    choose_cuts(nodes, edges_of, places, np.array([4, 4]), np.array([64, 256, 64]), True, cuts, FLAG)
    level = LevelOfNodes(nodes, cuts, np.zeros(1, np.int64), edges_of, edges, places, True)
    counts, sides = np.zeros(1 << cuts.sum(), np.int64), np.zeros(1 << cuts.sum(), np.int8)
    count_level(level, counts, sides, FLAG)
    return level, counts, sides


@pytest.mark.parametrize("seed", range(4))
def test_lists_and_sides(seed: int) -> None:
    random = np.random.default_rng(seed)
    solid = Polygon([[[0, 0], [8, 0], [8, 8], [0, 8]], random.uniform(0, 8, (5, 2))])
    level, counts, sides = level_of(solid)
    firsts = np.cumsum(counts) - counts
    stops, items = firsts.copy(), np.empty(counts.sum(), np.int32)
    fill_level(level, np.zeros(len(counts), np.bool_), stops, items, np.empty(0, np.int32), FLAG)
    assert (stops == firsts + counts).all()
    (a, b), points = level.cuts[0].tolist(), random.uniform(0.01, 7.99, (400, 2))
    scale = np.array([1 << a, 1 << b]) / 8.0 * (1.0 - 2.0 ** (1 - FINE_BITS))
    for point, (column, row) in zip(points, (points * scale).astype(int)):
        cell = (row << a) + column
        if counts[cell] == 0:
            assert 2 * int(sides[cell]) - 1 == rational_location(point.tolist(), solid)
    ends = solid.vertices[next_in_ring(solid)]
    for edge, (start, end) in enumerate(zip(solid.vertices, ends)):
        for share in np.linspace(0.0, 1.0, 33):
            column, row = ((start + (end - start) * share) * scale).astype(int)
            cell = (row << a) + column
            assert edge + 1 in items[firsts[cell] : stops[cell]] >> EDGE_SHIFT
