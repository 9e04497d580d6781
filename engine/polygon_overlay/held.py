"""Polygons as arrays, read from memory where CPython keeps objects as expected, else asked for one by one.

Nothing is taken for granted: where a tuple holds its items, and an object its class, slots and numbers, is looked for
in a polygon whose parts are known. Where any is not found in one place, nothing is ever read.
"""

from __future__ import annotations

import ctypes
import functools
import sys
from typing import Any

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.direct import entry_of
from engine.polygon_overlay.compiled.gathering import Layout, gather_polygons, measure_polygons
from engine.solids.polygon import Polygon


def _place_in(holder: Any, word: int) -> int:
    """Return where an object holds a word, in bytes from its beginning; raises ValueError unless there is one place."""
    size = type(holder).__basicsize__ + (8 * len(holder) if isinstance(holder, tuple) else 0)
    words = np.frombuffer(ctypes.string_at(id(holder), size), np.int64)
    (place,) = np.flatnonzero(words == word).tolist()
    return 8 * int(place)


@functools.cache
def _layout() -> Layout | None:
    """Return where things are held, None where that is not as expected."""
    polygon = Polygon([[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]])
    vertices, offsets = polygon.vertices, polygon.ring_offsets
    try:
        data = _place_in(vertices, vertices.ctypes.data)
        for array in (vertices, offsets):
            # numpy's interface for C: the numbers, how many axes, their lengths
            n_axes = ctypes.c_int.from_address(id(array) + data + 8).value
            if _place_in(array, array.ctypes.data) != data or n_axes != array.ndim:
                return None
        return Layout(
            id(Polygon), _place_in((polygon, None), id(polygon)), _place_in(polygon, id(Polygon)),
            _place_in(polygon, id(vertices)), _place_in(polygon, id(offsets)), data,
        )  # fmt: skip
    except ValueError:
        return None


def arrays_held(polygons: tuple[Polygon, ...]) -> tuple[FloatArray, IntArray, IntArray] | None:
    """Return vertices, ring and polygon offsets as `gathered` does, None where they are to be asked for.

    Caller guarantees that the tuple, while this reads it, is held.
    """
    layout = _layout() if sys.implementation.name == "cpython" else None
    if layout is None:
        return None
    n, n_vertices, n_rings = entry_of(measure_polygons)(id(polygons), len(polygons), layout)
    if n < len(polygons):
        return None
    vertices, offsets = np.empty(2 * n_vertices), (np.empty(n_rings + 1, np.int64), np.empty(n + 1, np.int64))
    entry_of(gather_polygons)(id(polygons), layout, vertices, *offsets)
    for array in (vertices, *offsets):
        array.setflags(write=False)
    return vertices.reshape(-1, 2), *offsets
