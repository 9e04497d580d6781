"""Overlays on a grid: for borders that should coincide and nearly do.

    input / grid  ->  overlay, valid  ->  snap rounding to whole numbers  ->  arranged again  ->  times the grid

Coordinates are in units of the grid. The overlay itself is exact and valid as any; its rings are snapped once
(compiled/snapping.py), so that no edge moves by more than half a diagonal of a cell, 0.71 of the grid. Where that joins
or collapses parts, rings are arranged once more, without rounding.
"""

from __future__ import annotations

import functools
from dataclasses import replace
from fractions import Fraction
from math import frexp, inf, log10, nextafter, ulp
from typing import Any, Final, NamedTuple

import numpy as np

from engine.compiling.jit import entry_of
from engine.errors import InvalidInputError, NotRepresentableError
from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.compiled.snapping import FOLDS, scale, snap
from engine.polygon_overlay.compiled.workspace import return_scratch, scratch_for
from engine.polygon_overlay.implicit_rings import ImplicitRings, as_implicit_rings
from engine.polygon_overlay.pair_arrays import PairResults, one_pair, ring_of_vertices
from engine.polygon_overlay.result import Overlay, build_overlay
from engine.running.budget import Budget
from engine.solids.checks import shown
from engine.solids.ragged import next_in_rings, summed
from engine.types import FloatArray, Int32Array, IntArray, read_only

_MOST: Final = 2.0**51
"""Largest coordinate in cells, so that halves of cells are doubles, with room for sums."""
_TENS: Final = 22
"""Largest exponent of a power of ten that is a double."""
_LEAST: Final = 2.0**-60
"""Fraction of a cell that is rounded to zero, so that exponents stay in the range of expansions."""
_ROUNDED: Final = 2.0**-51
_CERTAINLY_VALID: Final = 2.0**24
_FINEST: Final = 2.0**49
"""Bounds of the largest coordinate in cells (_CERTAINLY_VALID), and of it times the longest edge (_FINEST), for rings
to stay valid: see `_are_distinguishable`."""
HALF_DIAGONAL: Final = nextafter(0.5**0.5, 1.0)


class Grid(NamedTuple):
    """The multiples of ``base ** power``, base 2 or 10; spacing: the double nearest to that. into, back: (divisor,
    factor, factor) that convert coordinates to multiples and back (`scale`). A power of two may be no double, so it is
    split into two factors; the first product is exact."""

    base: int
    power: int
    spacing: float
    into: tuple[float, float, float]
    back: tuple[float, float, float]

    def to_units(self, vertices: FloatArray) -> FloatArray:
        """Return coordinates in units of the grid, exact for powers of two, rounded for powers of ten. Raises
        `InvalidInputError` if the grid is finer than 2^-51 of the largest coordinate."""
        near_integer = _ROUNDED if self.base == 10 else 0.0  # multiples, rounded twice, are whole numbers again
        units = np.empty_like(vertices)
        if not entry_of(scale)(vertices, *self.into, near_integer, _LEAST, units) < _MOST:
            raise InvalidInputError(
                f"grid must be no finer than 2^-51 of the largest coordinate, {np.abs(vertices).max().item()!r}; got "
                f"{self.spacing!r}",
                ("grid",),
            )
        return read_only(units)

    def to_coordinates(self, units: FloatArray) -> tuple[FloatArray, float]:
        """Return the doubles nearest to the coordinates of integers `units`, multiples of the grid, and their largest
        magnitude. Raises `NotRepresentableError` beyond the largest double."""
        places = np.empty_like(units)
        largest = entry_of(scale)(units, *self.back, 0.0, 0.0, places)
        if not largest < inf:
            raise NotRepresentableError("a multiple of the grid is beyond the largest float64; scale the input down")
        return read_only(places), largest


_LARGEST: Final = float(np.finfo(np.float64).max)


def grid_of(size: object) -> Grid:
    """Return the `Grid` of a spacing. Raises `InvalidInputError` unless it is a power of two or of ten."""
    if isinstance(size, (int, float, np.floating)) and not isinstance(size, bool) and 0 < size <= _LARGEST:
        if (grid := _grid_of(float(size))) is not None:
            return grid
    raise InvalidInputError(
        f"grid must be a power of two, or of ten from 1e-{_TENS} to 1e{_TENS}; got {shown(size)}", ("grid",)
    )


@functools.lru_cache(64)
def _grid_of(size: float) -> Grid | None:
    """Return the grid of a power of two or of ten, None for other sizes; cached."""
    mantissa, exponent = frexp(size)
    if mantissa == 0.5:
        half = (exponent - 1) // 2
        first, second = 2.0**half, 2.0 ** (exponent - 1 - half)
        return Grid(2, exponent - 1, size, (1.0, 1.0 / first, 1.0 / second), (1.0, first, second))
    power = round(log10(size))
    if abs(power) > _TENS or size != float(f"1e{power}"):
        return None
    ten = 10.0 ** abs(power)
    ways = (ten, 1.0, 1.0), (1.0, ten, 1.0)
    return Grid(10, power, size, *(ways if power > 0 else ways[::-1]))


class _SnappedRings(NamedTuple):
    """Valid rings snapped to integer points.

    | field | topology kept | topology changed |
    | --- | --- | --- |
    | n_moved | number of vertices of `vertices` that moved | number of all vertices that moved |
    | keeps_topology | True | False |
    | are_apart | a vertex moved, and no edge is within half a cell of another vertex | as on the left |
    | vertices, offsets | the snapped rings | the integer points of all vertices |
    | edges | (m,) by vertex the input vertex whose edge continues there; None: all vertices, in order | None |
    | passages | unused | edges, and vertices whose pixels they pass |
    """

    n_moved: int
    keeps_topology: bool
    are_apart: bool
    vertices: FloatArray
    offsets: IntArray
    edges: Int32Array | None
    passages: Int32Array


def snap_vertices(vertices: FloatArray, offsets: IntArray, piece_offsets: IntArray, budget: Budget) -> _SnappedRings:
    """Snap valid rings to integer points. vertices (n, 2), offsets of rings into them, and of pieces into rings are
    read-only arrays. Raises as `Budget.check`."""
    n = len(vertices)
    n_most, n_rings = max(64, n), len(offsets) - 1
    pixels, corners, starts = np.empty((n, 2)), np.empty(n, np.int32), np.empty(n_rings + 1, np.int64)
    while True:  # bound: the second turn has room
        passages = np.empty((n_most, 2), np.int32)
        budget.take(8 * n_most)
        scratch = scratch_for(n, n_rings, 256, 0, 0)
        n_moved, m, n_corners, are_apart = entry_of(snap)(
            vertices, offsets, piece_offsets, budget.flag, scratch.addresses, pixels, corners, starts, passages
        )
        budget.check()
        return_scratch(scratch)
        if m <= n_most:
            break
        n_most = m
    if n_corners in (n, FOLDS):
        return _SnappedRings(n_moved, n_corners == n, are_apart, read_only(pixels), offsets, None, passages[:m])
    corners = corners[:n_corners]
    pixels = pixels[corners]
    n_moved = int((pixels != vertices[corners]).any(axis=1).sum())
    return _SnappedRings(n_moved, True, are_apart, read_only(pixels), read_only(starts), corners, passages[:m])


def snapped_to_units(rings: PairResults, budget: Budget, known: _SnappedRings | None = None) -> PairResults:
    """Return the valid rings of one pair snapped to integer points: status DONE, or MAY_CROSS where they must be
    arranged again. If a vertex moved, displacement is half a cell's diagonal. A row of sources is (v, v), v the vertex
    whose edge continues there. known: the result of `snap_vertices` for these rings, if computed."""
    vertices, offsets = rings.vertices, rings.ring_offsets
    on_grid = known or snap_vertices(read_only(vertices), read_only(offsets), read_only(rings.piece_offsets), budget)
    edges = np.arange(len(vertices)) if on_grid.edges is None else on_grid.edges.astype(np.int64)
    if on_grid.n_moved == 0 and on_grid.edges is None:
        return rings._replace(sources=_sources_along(edges))
    snapped, ends, status = on_grid.vertices, on_grid.offsets, PairStatus.DONE
    if not on_grid.keeps_topology:
        snapped, edges, ends = _route_through_pixels(vertices, snapped, offsets, on_grid.passages.astype(np.int64))
        status = PairStatus.MAY_CROSS
    return one_pair(snapped, ends, rings.piece_offsets, HALF_DIAGONAL, 0, _sources_along(edges), status)


def snapped_overlay(pair: PairResults, snapped: _SnappedRings, grid: Grid, start: int) -> Overlay | None:
    """Return the overlay of a pair in the coordinates of its input, from its rings in units of the grid as they are
    snapped; None if snapping changes their topology, or doubles may not distinguish multiples. start: number of the
    clip's first vertex. The result equals that of `make_valid_after_rounding` and `from_units`."""
    if not snapped.keeps_topology:
        return None
    # by powers of ten a vertex and an edge come nearer by less than half a cell, below 2^51 cells
    if grid.base == 10 and not snapped.are_apart and not _are_distinguishable(snapped.vertices, snapped.offsets):
        return None
    places, largest = grid.to_coordinates(snapped.vertices)
    has_moved = snapped.n_moved > 0 or snapped.edges is not None
    moved = pair.displacement.item()
    displacement = nextafter(moved + HALF_DIAGONAL, inf) if has_moved else moved
    return build_overlay(
        places, snapped.offsets, pair.piece_offsets, as_implicit_rings(places, snapped.offsets),
        largest_displacement=_displacement(displacement, grid, largest),
        rounds=int(moved > 0.0) + int(has_moved), snapped=has_moved, vertices_moved=snapped.n_moved,
        _edges=pair.sources if snapped.edges is None else pair.sources[snapped.edges], _starts=np.array([start]),
    )  # fmt: skip


def _route_through_pixels(
    vertices: FloatArray, pixels: FloatArray, offsets: IntArray, passages: Int32Array
) -> tuple[FloatArray, IntArray, IntArray]:
    """Route rings through the pixels that their edges pass; return the vertices, by vertex the input edge that
    continues there, and the offsets of rings; repeated points are left out. pixels: by input vertex its integer point.
    passages (m, 2): an edge, and a vertex whose pixel it passes."""
    edges, others = passages.T
    ways = np.sign(vertices[next_in_rings(offsets)[edges]] - vertices[edges])
    along = (ways * pixels[others]).sum(axis=1)  # order: an edge that rises passes no pixel further left or below
    in_order = np.lexsort((along, edges))
    edges, others = edges[in_order], others[in_order]
    chain = np.insert(pixels, edges + 1, pixels[others], axis=0)  # a vertex before what its edge passes
    edge = np.insert(np.arange(len(vertices)), edges + 1, edges)
    ring = ring_of_vertices(offsets)[edge]
    stops = summed(np.bincount(ring, minlength=len(offsets) - 1))
    is_distinct = (chain != chain[next_in_rings(stops)]).any(axis=1)  # of equal ones the last, whose edge continues
    is_distinct[stops[1:] - 1] |= (
        np.bincount(ring[is_distinct], minlength=len(offsets) - 1) == 0
    )  # rings that shrink to a point
    return chain[is_distinct], edge[is_distinct], summed(np.bincount(ring[is_distinct], minlength=len(offsets) - 1))


def _sources_along(edges: IntArray) -> Any:
    """Return the sources (n, 2) int32 of vertices from which rings continue along these edges: each edge twice."""
    return np.repeat(edges.astype(np.int32), 2).reshape(-1, 2)


def _are_distinguishable(units: FloatArray, offsets: IntArray) -> bool:
    """Return whether valid rings of whole multiples provably stay valid when each multiple is rounded to a double.

    With C the largest coordinate, ``d = 2^-53 C`` bounds the displacement in cells. L: the longest edge along an axis,
    at least 1. To become invalid, a vertex c must reach an edge ab, within its box. Either abc turned before, by at
    least 1 in whole numbers, and the turn changes by at most ``8 d L + 24 d^2``; or c was on the line beyond an end, by
    at least 1 along an axis, and gains at most ``2 d``. Both are impossible for ``C L <= 2^49``.
    """
    largest = max(-float(units.min()), float(units.max())) if len(units) else 0.0
    is_near = largest <= _CERTAINLY_VALID
    return is_near or bool(largest * np.abs(units[next_in_rings(offsets)] - units).max() <= _FINEST)


def _displacement(displacement: float, grid: Grid, largest: float) -> float:
    """Return a displacement in cells of the grid as a distance, rounded up, with the rounding of coordinates added.
    largest: the largest coordinate."""
    moved = grid.spacing * displacement
    if grid.base == 10 and largest > 0.0:  # units are rounded, and what they stand for
        moved += 2.0 * ulp(largest)
    return nextafter(moved, inf) if moved else 0.0


def from_units(result: Overlay, grid: Grid, start: int, again: Any, budget: Budget) -> Overlay:
    """Return an overlay in units of the grid as one in the coordinates of its input, with its own rings as exact rings.
    start: number of the clip's first vertex. again: function (rings, budget) that arranges rounded rings, to test
    whether they stay valid. Raises `NotRepresentableError` if not."""
    vertices, largest = grid.to_coordinates(read_only(result.vertices))
    if grid.base == 10 and not _are_distinguishable(result.vertices, result.ring_offsets):
        rings = one_pair(vertices, result.ring_offsets, result.piece_offsets, 0.0, 0, status=PairStatus.MAY_CROSS)
        if not np.array_equal(again(rings, budget).vertices, vertices):
            raise NotRepresentableError(
                f"multiples of {grid.spacing!r} are not told apart well enough by float64 here; take a power of two"
            )
    edges = result._edges
    if edges is None:
        assert isinstance(result.exact, ImplicitRings)
        edges = result.exact.sources
    return replace(
        result, vertices=vertices, exact=as_implicit_rings(vertices, result.ring_offsets),
        largest_displacement=_displacement(result.largest_displacement, grid, largest),
        _lost=result._lost and result._lost._replace(unit=Fraction(grid.base) ** grid.power), _edges=edges,
        _starts=np.array([start]),
    )  # fmt: skip
