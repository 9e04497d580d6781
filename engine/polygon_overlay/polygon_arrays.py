"""Many polygons as three arrays, without an object for each: what layers and batches of their pairs are made of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple, cast, overload

import numpy as np

from engine.arrays import FloatArray, IntArray, read_only
from engine.compiling.direct import entry_of
from engine.errors import RingTooShortError
from engine.polygon_overlay.compiled.loading import find_most
from engine.polygon_overlay.found import chained, places_of
from engine.polygon_overlay.implicit_rings import one_polygon
from engine.solids.polygon import Polygon
from engine.solids.ragged import parted, summed

_LEAST: Final = 3
"""Positions of a ring that has area."""


class PolygonArrays(NamedTuple):
    """vertices (n, 2) float64; ring_offsets into them, no ring repeats its first; polygon_offsets into the rings."""

    vertices: FloatArray
    ring_offsets: IntArray
    polygon_offsets: IntArray

    def polygon(self, number: int) -> Polygon:
        """Return one of the polygons, as a view."""
        rings = self.ring_offsets[self.polygon_offsets[number] : self.polygon_offsets[number + 1] + 1]
        return Polygon.of_arrays(self.vertices[rings[0] : rings[-1]], read_only(rings - rings[0]))

    def taken(self, numbers: IntArray) -> PolygonArrays:
        """Return some of the polygons, in the order of `numbers`."""
        rings = places_of(self.polygon_offsets, numbers)
        return PolygonArrays(
            read_only(self.vertices[places_of(self.ring_offsets, rings)]),
            summed(np.diff(self.ring_offsets)[rings]),
            summed(np.diff(self.polygon_offsets)[numbers]),
        )

    def merged(self, groups: IntArray) -> PolygonArrays:
        """Return as one polygon the rings of those from groups[k] up to groups[k + 1]."""
        return self._replace(polygon_offsets=read_only(self.polygon_offsets[groups]))

    def sizes(self) -> IntArray:
        """Return the number of vertices of each."""
        starts = self.ring_offsets[self.polygon_offsets]
        return starts[1:] - starts[:-1]

    def most(self) -> tuple[int, int]:
        """Return the most vertices, and the most rings, that one has."""
        found: tuple[int, int] = entry_of(find_most)(self.ring_offsets, self.polygon_offsets)
        return found

    def boxes(self, numbers: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the low and the high corners (n, 2) of some, none of which is empty and which are in order."""
        starts = self.ring_offsets[self.polygon_offsets[numbers]]
        if not len(starts):
            return np.zeros((0, 2)), np.zeros((0, 2))
        return np.minimum.reduceat(self.vertices, starts), np.maximum.reduceat(self.vertices, starts)


def arrays_of(coordinates: object, ring_offsets: object, polygon_offsets: object) -> PolygonArrays:
    """Return what `polygons` takes as arrays; a ring of two positions, which has no area, is left out.

    Raises: as `polygons`.
    """
    vertices, starts, ends, groups = parted(coordinates, ring_offsets, polygon_offsets)
    sizes = ends - starts
    if len(single := np.flatnonzero(sizes == 1)):
        place = int(single[0])
        raise RingTooShortError(f"ring {place} of ring_offsets has one position; give 3", ("ring_offsets", place))
    is_kept = sizes >= _LEAST
    offsets = summed(sizes[is_kept])
    places = np.arange(offsets[-1]) + np.repeat(starts[is_kept] - offsets[:-1], sizes[is_kept])
    return PolygonArrays(read_only(vertices[places]), offsets, read_only(summed(is_kept.astype(np.int64))[groups]))


def joined_arrays(parts: Sequence[PolygonArrays]) -> PolygonArrays:
    """Return the polygons of some parts, at least one, one part after another."""
    return PolygonArrays(
        read_only(np.concatenate([part.vertices for part in parts])),
        chained([part.ring_offsets for part in parts]),
        chained([part.polygon_offsets for part in parts]),
    )


def gathered(polygons: Sequence[Polygon]) -> PolygonArrays:
    """Return polygons as arrays, joined as bytes: numpy takes three times as long to put small ones together."""
    if len(polygons) == 1:
        return PolygonArrays(polygons[0].vertices, polygons[0].ring_offsets, one_polygon(polygons[0].n_rings))
    vertices = np.frombuffer(b"".join(cast("list[bytes]", [each.vertices for each in polygons])))
    offsets = np.frombuffer(b"".join(cast("list[bytes]", [each.ring_offsets for each in polygons])), np.int64)
    if len(offsets) == 2 * len(polygons) and not offsets[::2].any():  # one ring each: a small batch waits for this
        return PolygonArrays(vertices.reshape(-1, 2), summed(offsets[1::2]), read_only(np.arange(len(polygons) + 1)))
    starts = np.flatnonzero(offsets == 0)  # of each polygon's: no ring is empty
    ends = np.append(starts[1:], len(offsets)) - 1
    sizes = np.delete(offsets[1:] - offsets[:-1], ends[:-1])
    return PolygonArrays(vertices.reshape(-1, 2), summed(sizes), summed(ends - starts))


class Chosen(Sequence[Polygon]):
    """Some polygons of arrays, by their numbers; an object is made for one that is asked for."""

    def __init__(self, arrays: PolygonArrays, numbers: IntArray) -> None:
        self._arrays, self._numbers = arrays, numbers

    def __len__(self) -> int:
        return len(self._numbers)

    @overload
    def __getitem__(self, place: int) -> Polygon: ...
    @overload
    def __getitem__(self, place: slice) -> Chosen: ...
    def __getitem__(self, place: int | slice) -> Polygon | Chosen:
        if isinstance(place, slice):
            return Chosen(self._arrays, self._numbers[place])
        return self._arrays.polygon(int(self._numbers[place]))

    def together(self) -> PolygonArrays:
        """Return them as arrays of their own."""
        return self._arrays.taken(self._numbers)

    @property
    def n_vertices(self) -> int:
        return int(self._arrays.sizes()[self._numbers].sum())
