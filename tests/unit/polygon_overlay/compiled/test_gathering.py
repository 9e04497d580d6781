"""Objects are measured up to the first that is no polygon; their rings are put one after another."""

from __future__ import annotations

import numpy as np
import pytest

from engine.polygon_overlay import held
from engine.polygon_overlay.compiled.gathering import find_most, gather_polygons, measure_polygons
from engine.solids.polygon import Polygon


def test_rings_are_gathered() -> None:
    layout = held._layout()
    if layout is None:
        pytest.skip("objects are not held as CPython and numpy held them")
    frame, bare = Polygon([[(0, 0), (9, 0), (9, 9)], [(1, 1), (2, 1), (1, 2), (0, 3)]]), Polygon([])
    some = frame, bare, frame, "text", frame
    assert measure_polygons(id(some), len(some), layout) == (3, 14, 4)
    coordinates, ring_offsets, polygon_offsets = np.empty(28), np.empty(5, np.int64), np.empty(4, np.int64)
    gather_polygons(id(some), layout, coordinates, ring_offsets, polygon_offsets)
    assert coordinates.tolist() == 2 * frame.vertices.ravel().tolist()
    assert (ring_offsets.tolist(), polygon_offsets.tolist()) == ([0, 3, 7, 10, 14], [0, 2, 2, 4])
    assert find_most(ring_offsets, polygon_offsets) == (7, 2)
    assert find_most(ring_offsets[:1], polygon_offsets[:1]) == (0, 0)
