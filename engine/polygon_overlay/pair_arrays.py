"""Results of overlays of pairs, and many polygons, as flat arrays without an object for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple, cast, overload

import numpy as np

from engine.compiling.jit import entry_of
from engine.errors import RingTooShortError
from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.compiled.loading import boxes_of_runs, largest_counts
from engine.polygon_overlay.implicit_rings import one_polygon
from engine.running.budget import UNLIMITED, Budget
from engine.running.joining import join_columns, join_sizes
from engine.solids.polygon import Polygon
from engine.solids.ragged import parted, summed
from engine.types import BoolArray, FloatArray, Int8Array, Int32Array, IntArray, read_only

NO_EVIDENCE: Final = np.zeros((0, 2), np.int64)


class PairResults(NamedTuple):
    """Results of the kernel, pair after pair.

    | field | dtype, shape | meaning |
    | --- | --- | --- |
    | status | int8 (pairs,) | DONE, OPEN or MAY_CROSS |
    | counts | int64 (pairs, 4) | pieces, rings, vertices, exactly decided edge pairs |
    | displacement | float64 (pairs,) | largest displacement by rounding |
    | vertices, sources | float64, int32 (n, 2) | of all pairs that are not OPEN; sources as in `overlay_pairs` |
    | ring_offsets, piece_offsets | int64 | into the vertices, into the rings |
    | evidence | int64 (m, 2) | rounded rings: a ring, and a ring it comes from |
    """

    status: Int8Array
    counts: IntArray
    displacement: FloatArray
    vertices: FloatArray
    sources: Int32Array
    ring_offsets: IntArray
    piece_offsets: IntArray
    evidence: IntArray


NO_PAIRS: Final = PairResults(
    np.zeros(0, np.int8), np.zeros((0, 4), np.int64), np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2), np.int32),
    np.zeros(1, np.int64), np.zeros(1, np.int64), NO_EVIDENCE,
)  # fmt: skip


def one_pair(
    vertices: FloatArray, ring_offsets: IntArray, piece_offsets: IntArray, displacement: float, n_exact: int,
    sources: Int32Array | None = None, status: int = PairStatus.DONE,
) -> PairResults:  # fmt: skip
    """Return the result of one pair. displacement: the largest by rounding; n_exact: edge pairs decided exactly;
    sources: None for zeros; status: `PairStatus`."""
    counts = np.array([[len(piece_offsets) - 1, len(ring_offsets) - 1, len(vertices), n_exact]])
    sources = np.zeros((len(vertices), 2), np.int32) if sources is None else sources
    outcome = np.array([status], np.int8), counts, np.array([displacement])
    return PairResults(*outcome, vertices, sources, ring_offsets, piece_offsets, NO_EVIDENCE)


def take_pairs(pairs: PairResults, items: IntArray) -> PairResults:
    """Return the results of pairs ``items``, in this order, without evidence."""
    of_pieces, of_rings, of_vertices = (places_of(summed(pairs.counts[:, k]), items) for k in range(3))
    return PairResults(
        pairs.status[items], pairs.counts[items], pairs.displacement[items], pairs.vertices[of_vertices],
        pairs.sources[of_vertices], summed(np.diff(pairs.ring_offsets)[of_rings]),
        summed(np.diff(pairs.piece_offsets)[of_pieces]), NO_EVIDENCE,
    )  # fmt: skip


def places_of(offsets: IntArray, items: IntArray) -> IntArray:
    """Return the concatenated ranges offsets[k] .. offsets[k + 1] - 1 for k in ``items``."""
    return places_from(offsets[items], offsets[items + 1] - offsets[items])


def places_from(starts: IntArray, sizes: IntArray) -> IntArray:
    """Return the concatenated ranges starts[k] .. starts[k] + sizes[k] - 1."""
    ends = np.cumsum(sizes)
    return np.arange(ends[-1] if len(ends) else 0) + np.repeat(starts - (ends - sizes), sizes)


def concatenate_pairs(parts: list[PairResults], budget: Budget = UNLIMITED, workers: int | None = 1) -> PairResults:
    """Return the pairs of all parts, at least one, without evidence."""
    if len(parts) == 1:
        return parts[0]._replace(evidence=NO_EVIDENCE)
    outcomes: Any = join_columns([part[:5] for part in parts], budget, workers)
    rings, pieces = (read_only(join_sizes([np.diff(part[k]) for part in parts], budget, workers)) for k in (5, 6))
    return PairResults._make([*outcomes, rings, pieces, NO_EVIDENCE])


def concatenate_parts(parts: Sequence[Sequence[Any]]) -> list[Any]:
    """Concatenate tuples (vertices, sources, ring offsets, piece offsets, evidence) field by field; offsets are
    shifted."""
    vertices, sources, ring_offsets, piece_offsets, evidence = zip(*parts, strict=True)
    offsets = concatenate_offsets(ring_offsets), concatenate_offsets(piece_offsets)
    return [np.concatenate(vertices), np.concatenate(sources), *offsets, np.concatenate(evidence)]


def concatenate_offsets(offsets: Sequence[IntArray]) -> IntArray:
    """Return the offsets of concatenated arrays from the offsets of each."""
    return summed(np.concatenate([np.zeros(0, np.int64), *(each[1:] - each[:-1] for each in offsets)]))


def ring_of_vertices(offsets: IntArray) -> IntArray:
    """Return, by vertex, the number of its ring. offsets: of rings into vertices."""
    return np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))


def ring_sizes(rings: PairResults) -> FloatArray:
    """Return, by ring, a quarter of the sum of width and height of its box: below the largest double."""
    starts = rings.ring_offsets[:-1]
    if not len(starts):
        return np.zeros(0)
    low, high = np.minimum.reduceat(rings.vertices, starts), np.maximum.reduceat(rings.vertices, starts)
    return cast("FloatArray", (high / 4 - low / 4).sum(axis=1))


_FEW: Final = 16
"""Number of polygons up to which each is compared as bytes; of more only those of equal sizes and first vertices."""
_LEAST: Final = 3
"""Smallest number of positions of a ring with area."""


class PolygonArrays(NamedTuple):
    """Polygons as flat arrays: vertices (n, 2) float64; ring_offsets into them, first vertices not repeated;
    polygon_offsets into the rings."""

    vertices: FloatArray
    ring_offsets: IntArray
    polygon_offsets: IntArray

    def polygon(self, number: int) -> Polygon:
        """Return polygon ``number`` as a view."""
        rings = self.ring_offsets[self.polygon_offsets[number] : self.polygon_offsets[number + 1] + 1]
        return Polygon.of_arrays(self.vertices[rings[0] : rings[-1]], read_only(rings - rings[0]))

    def take(self, numbers: IntArray) -> PolygonArrays:
        """Return polygons `numbers`, in this order."""
        rings = places_of(self.polygon_offsets, numbers)
        return PolygonArrays(
            read_only(self.vertices[places_of(self.ring_offsets, rings)]),
            summed(np.diff(self.ring_offsets)[rings]),
            summed(np.diff(self.polygon_offsets)[numbers]),
        )

    def merged(self, groups: IntArray) -> PolygonArrays:
        """Return one polygon for each group k, with the rings of polygons groups[k] .. groups[k + 1] - 1."""
        return self._replace(polygon_offsets=read_only(self.polygon_offsets[groups]))

    def without_repeats(self) -> PolygonArrays:
        """Return the polygons with those that equal an earlier one, number by number, without rings."""
        sizes = self.sizes()
        alike = np.flatnonzero(sizes)
        if len(alike) > _FEW:
            keys = np.column_stack([self.vertices[self.ring_offsets[self.polygon_offsets[alike]]], sizes[alike]])
            order = np.lexsort(keys.T)
            is_alike = np.append(False, (keys[order[1:]] == keys[order[:-1]]).all(axis=1))
            alike = np.sort(alike[order[is_alike | np.append(is_alike[1:], False)]])
        repeats, known = [], set[tuple[bytes, bytes]]()
        for number in alike.tolist():
            ends = self.ring_offsets[self.polygon_offsets[number] : self.polygon_offsets[number + 1] + 1]
            rings = self.vertices[ends[0] : ends[-1]].tobytes(), (ends - ends[0]).tobytes()
            if rings in known:
                repeats.append(number)
            known.add(rings)
        if not repeats:
            return self
        stays = np.ones(len(sizes), np.bool_)
        stays[repeats] = False
        return self.restricted(stays)

    def restricted(self, stays: BoolArray) -> PolygonArrays:
        """Return the polygons, number by number, without rings where ``stays`` is False."""
        if stays.all():
            return self
        n_rings = np.diff(self.polygon_offsets)
        of_rings = np.repeat(stays, n_rings)
        of_vertices = np.repeat(of_rings, np.diff(self.ring_offsets))
        vertices, offsets = read_only(self.vertices[of_vertices]), summed(np.diff(self.ring_offsets)[of_rings])
        return PolygonArrays(vertices, offsets, summed(n_rings * stays))

    def sizes(self) -> IntArray:
        """Return the number of vertices of each polygon."""
        starts = self.ring_offsets[self.polygon_offsets]
        return starts[1:] - starts[:-1]

    def largest_counts(self) -> tuple[int, int]:
        """Return the largest number of vertices of one polygon, and the largest number of rings of one."""
        largest: tuple[int, int] = entry_of(largest_counts)(self.ring_offsets, self.polygon_offsets)
        return largest

    def boxes(self, numbers: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the low and high corners (n, 2) of the boxes of polygons `numbers`, ascending and none empty."""
        low, high = np.empty((len(numbers), 2)), np.empty((len(numbers), 2))
        entry_of(boxes_of_runs)(self.vertices, self.ring_offsets[self.polygon_offsets[numbers]], low, high)
        return low, high


def arrays_of(coordinates: object, ring_offsets: object, polygon_offsets: object) -> PolygonArrays:
    """Return the input of `polygons` as flat arrays; rings of two positions are dropped. Raises as `polygons`."""
    vertices, starts, ends, groups = parted(coordinates, ring_offsets, polygon_offsets)
    sizes = ends - starts
    if len(single := np.flatnonzero(sizes == 1)):
        place = int(single[0])
        raise RingTooShortError(f"ring {place} of ring_offsets has one position; give 3", ("ring_offsets", place))
    is_ring = sizes >= _LEAST
    offsets = summed(sizes[is_ring])
    places = places_from(starts[is_ring], sizes[is_ring])
    return PolygonArrays(read_only(vertices[places]), offsets, read_only(summed(is_ring.astype(np.int64))[groups]))


def concatenate_polygons(parts: Sequence[PolygonArrays]) -> PolygonArrays:
    """Concatenate the polygons of at least one part."""
    return PolygonArrays(
        read_only(np.concatenate([part.vertices for part in parts])),
        concatenate_offsets([part.ring_offsets for part in parts]),
        concatenate_offsets([part.polygon_offsets for part in parts]),
    )


def polygon_arrays_of(polygons: Sequence[Polygon], first: int = 0, last: int | None = None) -> PolygonArrays:
    """Return polygons first .. last - 1, by default to the end, as flat arrays, joined as bytes: numpy takes three
    times as long to concatenate small ones."""
    some = polygons[first:last]
    if len(some) == 1:
        return PolygonArrays(some[0].vertices, some[0].ring_offsets, one_polygon(some[0].n_rings))
    vertices = np.frombuffer(b"".join(cast("list[bytes]", [each.vertices for each in some])))
    offsets = np.frombuffer(b"".join(cast("list[bytes]", [each.ring_offsets for each in some])), np.int64)
    if len(offsets) == 2 * len(some) and not offsets[::2].any():  # one ring each: a small batch waits for this
        return PolygonArrays(vertices.reshape(-1, 2), summed(offsets[1::2]), read_only(np.arange(len(some) + 1)))
    starts = np.flatnonzero(offsets == 0)  # of each polygon's: no ring is empty
    ends = np.append(starts[1:], len(offsets)) - 1
    sizes = np.delete(offsets[1:] - offsets[:-1], ends[:-1])
    return PolygonArrays(vertices.reshape(-1, 2), summed(sizes), summed(ends - starts))


class PolygonSelection(Sequence[Polygon]):
    """The polygons with some numbers among flat arrays, as a sequence; indexing makes a `Polygon`."""

    def __init__(self, arrays: PolygonArrays, numbers: IntArray) -> None:
        self._arrays, self._numbers = arrays, numbers

    def __len__(self) -> int:
        return len(self._numbers)

    @overload
    def __getitem__(self, place: int) -> Polygon: ...
    @overload
    def __getitem__(self, place: slice) -> PolygonSelection: ...
    def __getitem__(self, place: int | slice) -> Polygon | PolygonSelection:
        if isinstance(place, slice):
            return PolygonSelection(self._arrays, self._numbers[place])
        return self._arrays.polygon(int(self._numbers[place]))

    def arrays(self) -> PolygonArrays:
        """Return the selected polygons as flat arrays, copied."""
        return self._arrays.take(self._numbers)

    @property
    def n_vertices(self) -> int:
        return int(self._arrays.sizes()[self._numbers].sum())
