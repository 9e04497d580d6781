"""Rings of many polygons put one after another, read from where the objects hold them.

To ask objects for their arrays one by one takes longer than to overlay pairs of squares.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.jit import kernel, merged
from engine.lanes.addresses import array_at
from engine.lanes.lanes import move


class Layout(NamedTuple):
    """Where CPython and numpy keep things, in bytes from the beginning of an object, and the address of the class.

    items: the first item of a tuple; kind: the class of an object; vertices, ring_offsets: the slots of a polygon;
    data: of an array; its sizes are two words further.
    """

    polygon: int
    items: int
    kind: int
    vertices: int
    ring_offsets: int
    data: int


@merged
def _word(address: int) -> int:
    return array_at(address, (1,), np.int64)[0]


@merged
def _found(array: int, layout: Layout) -> tuple[int, int]:
    """Return the address of the first number of an array, and its length."""
    return _word(array + layout.data), _word(_word(array + layout.data + 16))


@kernel
def find_most(ring_offsets: Any, polygon_offsets: Any) -> tuple[int, int]:
    """Return the most vertices, and the most rings, that a polygon has."""
    n_vertices = n_rings = 0
    for k in range(polygon_offsets.shape[0] - 1):
        first, end = polygon_offsets[k], polygon_offsets[k + 1]
        n_vertices, n_rings = max(n_vertices, ring_offsets[end] - ring_offsets[first]), max(n_rings, end - first)
    return n_vertices, n_rings


@kernel
def measure_polygons(objects: int, n: int, layout: Layout) -> tuple[int, int, int]:
    """Return how many of a tuple's first n objects, up to one that is none, are polygons; their vertices and rings.

    objects: the address of the tuple, which the caller holds.
    """
    n_vertices = n_rings = 0
    for k in range(n):
        polygon = _word(objects + layout.items + 8 * k)
        if _word(polygon + layout.kind) != layout.polygon:
            return k, n_vertices, n_rings
        n_vertices += _found(_word(polygon + layout.vertices), layout)[1]
        n_rings += _found(_word(polygon + layout.ring_offsets), layout)[1] - 1
    return n, n_vertices, n_rings


@kernel
def gather_polygons(objects: int, layout: Layout, coordinates: Any, ring_offsets: Any, polygon_offsets: Any) -> None:
    """Fill arrays that `measure_polygons` tells the sizes of; coordinates: (2 n_vertices,)."""
    n_vertices = n_rings = 0
    ring_offsets[0] = polygon_offsets[0] = 0
    for k in range(polygon_offsets.shape[0] - 1):
        polygon = _word(objects + layout.items + 8 * k)
        vertices, n = _found(_word(polygon + layout.vertices), layout)
        offsets, m = _found(_word(polygon + layout.ring_offsets), layout)
        move(coordinates, 2 * n_vertices, array_at(vertices, (2 * n,), np.float64), 0, 2 * n)
        own = array_at(offsets, (m,), np.int64)
        for ring in range(1, m):
            ring_offsets[n_rings + ring] = n_vertices + own[ring]
        n_vertices, n_rings = n_vertices + n, n_rings + m - 1
        polygon_offsets[k + 1] = n_rings
