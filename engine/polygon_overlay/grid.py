"""Overlays on a grid: for borders that should coincide and nearly do.

    input / grid  ->  overlay, valid  ->  snap rounding to whole numbers  ->  arranged again  ->  times the grid

Coordinates are counted in units of the grid. The overlay itself is exact and valid as any; its rings are snapped once
(compiled/snapping.py), so that no edge moves by more than half a diagonal of a cell, 0.71 of the grid. Where that joins
or collapses parts, rings are arranged once more, without another rounding.
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
from engine.polygon_overlay.compiled.workspace import keep, scratch_for
from engine.polygon_overlay.implicit_rings import ImplicitRings, rings_alone
from engine.polygon_overlay.pair_arrays import Found, one_pair, ring_numbers
from engine.polygon_overlay.result import Overlay, made_overlay
from engine.running.budget import Budget
from engine.solids.checks import shown
from engine.solids.ragged import next_in_rings, summed
from engine.types import FloatArray, Int32Array, IntArray, read_only

_MOST: Final = 2.0**51
"""Cells from zero up to which halves of cells are doubles, with room for sums."""
_TENS: Final = 22
"""Powers of ten up to which they are doubles."""
_LEAST: Final = 2.0**-60
"""Part of a cell that counts as none: exponents stay in the range of expansions."""
_ROUNDED: Final = 2.0**-51
_SURELY_VALID: Final = 2.0**24
_FINEST: Final = 2.0**49
"""Cells from zero, and these times the longest edge, up to which rings surely stay valid; see `_are_told_apart`."""
HALF_DIAGONAL: Final = nextafter(0.5**0.5, 1.0)


class Grid(NamedTuple):
    """Multiples of ``base ** power``; base: 2 or 10. spacing: their distance, the nearest double.

    into, back: by what coordinates are divided, and twice multiplied, to be counted in units, and these to be
    coordinates. Of two factors of a power of two, which no double may be, the first loses nothing.
    """

    base: int
    power: int
    spacing: float
    into: tuple[float, float, float]
    back: tuple[float, float, float]

    def units_of(self, vertices: FloatArray) -> FloatArray:
        """Return coordinates in units of the grid; by powers of ten these are rounded to doubles."""
        near_by = _ROUNDED if self.base == 10 else 0.0  # multiples, rounded twice, are whole numbers again
        units = np.empty_like(vertices)
        if not entry_of(scale)(vertices, *self.into, near_by, _LEAST, units) < _MOST:
            raise InvalidInputError(
                f"grid must be no finer than 2^-51 of the largest coordinate, {np.abs(vertices).max().item()!r}; got "
                f"{self.spacing!r}",
                ("grid",),
            )
        return read_only(units)

    def places_of(self, units: FloatArray) -> tuple[FloatArray, float]:
        """Return the doubles nearest to whole multiples of the grid, and the largest of them without its sign."""
        places = np.empty_like(units)
        largest = entry_of(scale)(units, *self.back, 0.0, 0.0, places)
        if not largest < inf:
            raise NotRepresentableError("a multiple of the grid is beyond the largest float64; scale the input down")
        return read_only(places), largest


_LARGEST: Final = float(np.finfo(np.float64).max)


def grid_of(size: object) -> Grid:
    """Return the grid of a spacing; refuse what is no power of two or ten."""
    if isinstance(size, (int, float, np.floating)) and not isinstance(size, bool) and 0 < size <= _LARGEST:
        if (found := _grid_of(float(size))) is not None:
            return found
    raise InvalidInputError(
        f"grid must be a power of two, or of ten from 1e-{_TENS} to 1e{_TENS}; got {shown(size)}", ("grid",)
    )


@functools.lru_cache(64)
def _grid_of(size: float) -> Grid | None:
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


class _OnGrid(NamedTuple):
    """What becomes of valid rings on whole numbers. n_moved: vertices that are none; stays: whether rings stay what
    they are; are_apart: whether no edge is surely nearer to another vertex then than half a cell. vertices, offsets,
    edges: rings then, and by vertex the one whose edge goes on from there; else the whole points of all vertices, and
    of passages which edge passes the pixel of which vertex."""

    n_moved: int
    stays: bool
    are_apart: bool
    vertices: FloatArray
    offsets: IntArray
    edges: Int32Array | None
    passages: Int32Array


def snap_vertices(vertices: FloatArray, offsets: IntArray, piece_offsets: IntArray, budget: Budget) -> _OnGrid:
    """Return what becomes of valid rings, read-only arrays. Raises as `Budget.check`."""
    n = len(vertices)
    n_most, n_rings = max(64, n), len(offsets) - 1
    pixels, corners, starts = np.empty((n, 2)), np.empty(n, np.int32), np.empty(n_rings + 1, np.int64)
    while True:  # bound: the second turn has room
        passages = np.empty((n_most, 2), np.int32)
        budget.take(8 * n_most)
        scratch = scratch_for(n, n_rings, 256, 0, 0)
        n_moved, m, n_corners, are_apart = entry_of(snap)(
            vertices, offsets, piece_offsets, budget.flag, scratch.words, pixels, corners, starts, passages
        )
        budget.check()
        keep(scratch)
        if m <= n_most:
            break
        n_most = m
    if n_corners in (n, FOLDS):
        return _OnGrid(n_moved, n_corners == n, are_apart, read_only(pixels), offsets, None, passages[:m])
    corners = corners[:n_corners]
    pixels = pixels[corners]
    n_moved = int((pixels != vertices[corners]).any(axis=1).sum())
    return _OnGrid(n_moved, True, are_apart, read_only(pixels), read_only(starts), corners, passages[:m])


def snapped_to_units(rings: Found, budget: Budget, known: _OnGrid | None = None) -> Found:
    """Return valid rings of one pair snapped to whole numbers: DONE, or MAY_CROSS if they are to be arranged again.

    Displacement is 0 where no vertex moved. sources: twice the vertex whose edge goes on from there. known: what
    `snap_vertices` returned for these rings.
    """
    vertices, offsets = rings.vertices, rings.ring_offsets
    found = known or snap_vertices(read_only(vertices), read_only(offsets), read_only(rings.piece_offsets), budget)
    edges = np.arange(len(vertices)) if found.edges is None else found.edges.astype(np.int64)
    if found.n_moved == 0 and found.edges is None:
        return rings._replace(sources=_along(edges))
    snapped, ends, status = found.vertices, found.offsets, PairStatus.DONE
    if not found.stays:
        snapped, edges, ends = _bent(vertices, snapped, offsets, found.passages.astype(np.int64))
        status = PairStatus.MAY_CROSS
    return one_pair(snapped, ends, rings.piece_offsets, HALF_DIAGONAL, 0, _along(edges), status)


def as_it_stays(found: Found, snapped: _OnGrid, grid: Grid, start: int) -> Overlay | None:
    """Return the overlay of a pair whose rings stay what they are on the grid, in the units of its input.

    start: of the vertices of the clip among all. The same as `settle_rings` and `from_units`; None where they do not,
    or doubles may not tell its multiples apart.
    """
    if not snapped.stays:
        return None
    # by powers of ten a vertex and an edge come nearer by less than half a cell, below 2^51 cells
    if grid.base == 10 and not snapped.are_apart and not _are_told_apart(snapped.vertices, snapped.offsets):
        return None
    places, largest = grid.places_of(snapped.vertices)
    has_moved = snapped.n_moved > 0 or snapped.edges is not None
    moved = found.displacement.item()
    displacement = nextafter(moved + HALF_DIAGONAL, inf) if has_moved else moved
    return made_overlay(
        places, snapped.offsets, found.piece_offsets, rings_alone(places, snapped.offsets),
        largest_displacement=_displacement(displacement, grid, largest),
        rounds=int(moved > 0.0) + int(has_moved), snapped=has_moved, vertices_moved=snapped.n_moved,
        _edges=found.sources if snapped.edges is None else found.sources[snapped.edges], _starts=np.array([start]),
    )  # fmt: skip


def _bent(
    vertices: FloatArray, pixels: FloatArray, offsets: IntArray, passages: Int32Array
) -> tuple[FloatArray, IntArray, IntArray]:
    """Return rings led through the pixels that they pass, none twice in succession, and of each vertex its edge."""
    edges, others = passages.T
    ways = np.sign(vertices[next_in_rings(offsets)[edges]] - vertices[edges])
    along = (ways * pixels[others]).sum(axis=1)  # order: an edge that rises passes no pixel further left or below
    in_order = np.lexsort((along, edges))
    edges, others = edges[in_order], others[in_order]
    chain = np.insert(pixels, edges + 1, pixels[others], axis=0)  # a vertex before what its edge passes
    edge = np.insert(np.arange(len(vertices)), edges + 1, edges)
    ring = ring_numbers(offsets)[edge]
    stops = summed(np.bincount(ring, minlength=len(offsets) - 1))
    kept = (chain != chain[next_in_rings(stops)]).any(axis=1)  # of equal ones the last, whose edge goes on
    kept[stops[1:] - 1] |= np.bincount(ring[kept], minlength=len(offsets) - 1) == 0  # rings that shrink to a point
    return chain[kept], edge[kept], summed(np.bincount(ring[kept], minlength=len(offsets) - 1))


def _along(edges: IntArray) -> Any:
    """Return the sources of vertices from which rings go on along these edges."""
    return np.repeat(edges.astype(np.int32), 2).reshape(-1, 2)


def _are_told_apart(units: FloatArray, offsets: IntArray) -> bool:
    """Tell whether valid rings surely stay so where each of these multiples is rounded to a double.

    With C the largest, that moves a coordinate by no more than d = 2^-53 C cells. Let no edge be longer than L along an
    axis, which is 1 at least. Before rings become invalid on the way there, a vertex c comes to lie on an edge ab,
    within its box. Either abc turned before, by 1 at least, since these are whole numbers, and a turn of points so near
    changes by 8 d L + 24 d^2 at most; or c was on the line beyond an end, by 1 at least along an axis, which 2 d make
    up for. Neither can be where C L is no more than 2^49.
    """
    largest = max(-float(units.min()), float(units.max())) if len(units) else 0.0
    is_near = largest <= _SURELY_VALID
    return is_near or bool(largest * np.abs(units[next_in_rings(offsets)] - units).max() <= _FINEST)


def _displacement(displacement: float, grid: Grid, largest: float) -> float:
    """Return a bound in units as one between places, with what is rounded between these, up to the largest place."""
    moved = grid.spacing * displacement
    if grid.base == 10 and largest > 0.0:  # units are rounded, and what they stand for
        moved += 2.0 * ulp(largest)
    return nextafter(moved, inf) if moved else 0.0


def from_units(result: Overlay, grid: Grid, start: int, again: Any, budget: Budget) -> Overlay:
    """Return an overlay in units of the grid as one in the units of its input; its exact rings are its own then.

    start: of the vertices of the clip among all. again: arranges rings.
    """
    vertices, largest = grid.places_of(read_only(result.vertices))
    if grid.base == 10 and not _are_told_apart(result.vertices, result.ring_offsets):
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
        result, vertices=vertices, exact=rings_alone(vertices, result.ring_offsets),
        largest_displacement=_displacement(result.largest_displacement, grid, largest),
        _lost=result._lost and result._lost._replace(unit=Fraction(grid.base) ** grid.power), _edges=edges,
        _starts=np.array([start]),
    )  # fmt: skip
