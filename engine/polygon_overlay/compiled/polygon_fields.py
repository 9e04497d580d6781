"""The fields of many polygons, read from the objects by compiled code.

Reading them in Python takes a sixth of the time of small overlays, and holds the interpreter lock, for which all other
threads wait. CPython has the items of a tuple one after another and the slots of an object at fixed places; numpy has
the address of an array's data and its shape at those that its C interface states. `LAYOUT` is where, as one polygon
shows; None where it shows anything else, and then Python reads the fields.
"""

from __future__ import annotations

import ctypes
import sys
from typing import Final, NamedTuple

import numpy as np

from engine.compiling.jit import kernel, merged
from engine.lanes.lanes import array_at
from engine.solids.polygon import Polygon
from engine.types import FloatArray, IntArray, read_only

_DATA, _SHAPE = 16, 32
"""Places of the address of the data and of that of the shape in an array (numpy/ndarraytypes.h)."""


class Layout(NamedTuple):
    """Where fields are, in bytes from the address of their object: the items of a tuple, the slots of a polygon."""

    items: int
    vertices: int
    ring_offsets: int


def _words(thing: object) -> list[int]:
    """Return the memory of an object of a fixed size, as numbers of eight bytes."""
    n = type(thing).__basicsize__ // 8
    return list((ctypes.c_int64 * n).from_address(id(thing)))


def _layout() -> Layout | None:
    """Return the layout of polygons here, None if it is not what kernels read."""
    if sys.implementation.name != "cpython" or ctypes.sizeof(ctypes.c_void_p) != 8:
        return None
    fields = read_only(np.arange(16.0).reshape(8, 2)[2:]), read_only(np.array([0, 3, 6]))
    polygon = Polygon.of_arrays(*fields)
    pair, words, items = (polygon, polygon), _words(polygon), tuple.__basicsize__
    if list((ctypes.c_int64 * 2).from_address(id(pair) + items)) != [id(polygon)] * 2:
        return None
    for field in fields:
        own = _words(field)
        if id(field) not in words or own[_DATA // 8] != field.ctypes.data or own[3] & 0xFFFFFFFF != field.ndim:
            return None
        if ctypes.c_int64.from_address(own[_SHAPE // 8]).value != len(field):
            return None
    return Layout(items, *(8 * words.index(id(field)) for field in fields))


LAYOUT: Final = _layout()


@merged
def _at(address: int) -> int:
    """Return the eight bytes at an address."""
    return int(array_at(address, (1,), np.int64)[0])


@kernel
def count_rings(polygons: int, layout: Layout, first: int, polygon_offsets: IntArray) -> int:
    """Fill polygon_offsets (n + 1,) of n polygons of a tuple at the address ``polygons``, from number ``first`` on;
    return their number of vertices. Caller guarantees that all are `Polygon` and that the tuple stays."""
    n_vertices = n_rings = 0
    polygon_offsets[0] = 0
    for k in range(polygon_offsets.shape[0] - 1):
        polygon = _at(polygons + layout.items + 8 * (first + k))
        n_vertices += _at(_at(_at(polygon + layout.vertices) + _SHAPE))
        n_rings += _at(_at(_at(polygon + layout.ring_offsets) + _SHAPE)) - 1
        polygon_offsets[k + 1] = n_rings
    return n_vertices


@kernel
def copy_rings(
    polygons: int, layout: Layout, first: int, polygon_offsets: IntArray, vertices: FloatArray, ring_offsets: IntArray
) -> None:
    """Fill vertices (n, 2) and ring_offsets of the polygons that `count_rings` counted."""
    n = 0
    ring_offsets[0] = 0
    for k in range(polygon_offsets.shape[0] - 1):
        polygon, ring = _at(polygons + layout.items + 8 * (first + k)), polygon_offsets[k]
        field, offsets = _at(polygon + layout.vertices), _at(polygon + layout.ring_offsets)
        m, n_rings = _at(_at(field + _SHAPE)), polygon_offsets[k + 1] - ring
        own, rings = (
            array_at(_at(field + _DATA), (2 * m,), np.float64),
            array_at(_at(offsets + _DATA), (n_rings + 1,), np.int64),
        )
        for i in range(m):
            vertices[n + i, 0], vertices[n + i, 1] = own[2 * i], own[2 * i + 1]
        for i in range(n_rings):
            ring_offsets[ring + i + 1] = n + rings[i + 1]
        n += m
