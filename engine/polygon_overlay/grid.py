"""Overlays on a grid: for borders that should coincide and nearly do.

    input / grid  ->  overlay, valid  ->  snap rounding to whole numbers  ->  arranged again  ->  times the grid

Coordinates are counted in units of the grid. The overlay itself is exact and valid as any; its rings are snapped once
(compiled/snapping.py), so that no edge moves by more than half a diagonal of a cell, 0.71 of the grid. Where that joins
or collapses parts, rings are arranged once more, without another rounding.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import frexp, isfinite, log10, nextafter
from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import FloatArray, IntArray, read_only
from engine.direct import entry_of
from engine.errors import InvalidInputError, NotRepresentableError
from engine.parallel import Budget
from engine.polygon_overlay.compiled.kernel import DONE, MAY_CROSS
from engine.polygon_overlay.compiled.snapping import find_passages, stay_apart
from engine.polygon_overlay.compiled.workspace import keep, scratch_for
from engine.polygon_overlay.found import Found, one_pair, ring_numbers, summed
from engine.polygon_overlay.implicit_rings import ImplicitRings, edges_along, rings_alone
from engine.polygon_overlay.result import Overlay
from engine.solids.checks import shown
from engine.solids.ragged import next_in_rings

_MOST: Final = 2.0**51
"""Cells from zero up to which halves of cells are doubles, with room for sums."""
_TENS: Final = 22
"""Powers of ten up to which they are doubles."""
_LEAST: Final = 2.0**-60
"""Part of a cell that counts as none: exponents stay in the range of expansions."""
_ROUNDED: Final = 2.0**-51
_SURELY_VALID: Final = 2.0**24
"""Cells from zero up to which the doubles nearest to tenths, hundredths, ... lie to each other as whole numbers do: a
turn of these is no less than 1, rounding them changes it by a half at most."""
HALF_DIAGONAL: Final = nextafter(0.5**0.5, 1.0)


class Grid(NamedTuple):
    """Multiples of ``base ** power``; base: 2 or 10."""

    base: int
    power: int

    @property
    def size(self) -> Fraction:
        """The spacing, exactly."""
        return Fraction(self.base) ** self.power

    def units_of(self, vertices: FloatArray) -> FloatArray:
        """Return coordinates in units of the grid; by powers of ten these are rounded to doubles."""
        with np.errstate(over="ignore"):
            if self.base == 2:
                units = np.ldexp(vertices, -self.power)
            else:
                units = vertices / 10.0**self.power if self.power > 0 else vertices * 10.0**-self.power
        if len(units) and not np.abs(units).max() < _MOST:
            raise InvalidInputError(
                f"grid must be no finer than 2^-51 of the largest coordinate, {np.abs(vertices).max().item()!r}; got "
                f"{float(self.size)!r}",
                ("grid",),
            )
        if self.base == 10:  # multiples, rounded twice, are whole numbers again
            near = np.rint(units)
            units = np.where(np.abs(units - near) <= _ROUNDED * np.abs(units), near, units)
        return read_only(np.where(np.abs(units) < _LEAST, 0.0, units))

    def places_of(self, units: FloatArray) -> FloatArray:
        """Return the doubles nearest to whole multiples of the grid."""
        with np.errstate(over="ignore"):
            if self.base == 2:
                places = np.ldexp(units, self.power)
            else:
                places = units * 10.0**self.power if self.power > 0 else units / 10.0**-self.power
        if not np.isfinite(places).all():
            raise NotRepresentableError("a multiple of the grid is beyond the largest float64; scale the input down")
        return places + 0.0


def grid_of(size: object) -> Grid:
    """Return the grid of a spacing; refuse what is no power of two or ten."""
    if isinstance(size, (int, float, np.floating)) and not isinstance(size, bool) and isfinite(size) and size > 0:
        mantissa, exponent = frexp(size)
        if mantissa == 0.5:
            return Grid(2, exponent - 1)
        power = round(log10(size))
        if abs(power) <= _TENS and float(size) == float(f"1e{power}"):
            return Grid(10, power)
    raise InvalidInputError(
        f"grid must be a power of two, or of ten from 1e-{_TENS} to 1e{_TENS}; got {shown(size)}", ("grid",)
    )


def snapped_to_units(rings: Found, budget: Budget) -> Found:
    """Return valid rings of one pair snapped to whole numbers: DONE, or MAY_CROSS if they are to be arranged again.

    Displacement is 0 where no vertex moved. sources: twice the vertex whose edge goes on from there.
    """
    vertices, offsets = rings.vertices, rings.ring_offsets
    pixels = _pixels_of(vertices)
    if np.array_equal(pixels, vertices):
        return rings._replace(sources=_along(np.arange(len(vertices))))
    passages, stays = _passages_of(vertices, offsets, budget)
    if stays and _are_in_order(pixels, rings):
        snapped, edges = pixels, np.arange(len(vertices))
    else:
        snapped, edges, offsets = _bent(vertices, pixels, offsets, passages)
    status = DONE if snapped is pixels else MAY_CROSS
    return one_pair(snapped, offsets, rings.piece_offsets, HALF_DIAGONAL, 0, _along(edges), status)


def _pixels_of(vertices: FloatArray) -> FloatArray:
    """Return the whole numbers whose pixels, half open, vertices lie in."""
    near = np.rint(vertices)
    return near + (vertices - near == 0.5) + 0.0


def _passages_of(vertices: FloatArray, offsets: IntArray, budget: Budget) -> tuple[IntArray, bool]:
    """Return what `find_passages` does."""
    n_most, n_rings = max(64, len(vertices)), len(offsets) - 1
    while True:  # bound: the second turn has room
        passages = np.empty((n_most, 2), np.int32)
        budget.take(8 * n_most)
        scratch = scratch_for(len(vertices), n_rings, 256, 0, 0)
        n, stays = entry_of(find_passages)(
            read_only(vertices), read_only(offsets), budget.flag, scratch.buffers, passages
        )
        budget.check()
        keep(scratch)
        if n <= n_most:
            return passages[:n].astype(np.int64), stays
        n_most = n


def _are_in_order(pixels: FloatArray, rings: Found) -> bool:
    """Tell whether pieces, and the holes of each, stand in their order, by their first vertices."""
    if len(rings.ring_offsets) <= 2:
        return True
    firsts, shells = pixels[rings.ring_offsets[:-1]], rings.piece_offsets[:-1]
    is_hole = np.ones(len(firsts), np.bool_)
    is_hole[shells] = False

    def ascend(some: FloatArray) -> Any:
        before, after = some[:-1], some[1:]
        return (before[:, 0] < after[:, 0]) | ((before[:, 0] == after[:, 0]) & (before[:, 1] < after[:, 1]))

    return bool(ascend(firsts[shells]).all() and (ascend(firsts) | ~(is_hole[1:] & is_hole[:-1])).all())


def _bent(
    vertices: FloatArray, pixels: FloatArray, offsets: IntArray, passages: IntArray
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


def _stay_apart(result: Overlay, budget: Budget) -> bool:
    """Tell whether the doubles nearest to multiples of the grid surely leave rings valid: none is off by more than half
    a unit in the last place of its own, which is a thirtieth of what `stay_apart` has room for."""
    vertices, offsets = result.vertices, result.ring_offsets
    _, points = np.unique(np.ascontiguousarray(vertices).view(np.complex128).ravel(), return_inverse=True)
    scratch = scratch_for(len(vertices), len(offsets) - 1, max(256, len(offsets)), 0, 0)
    are_apart = entry_of(stay_apart)(
        read_only(vertices), read_only(points.astype(np.int32)), read_only(offsets), budget.flag, scratch.buffers
    )
    budget.check()
    keep(scratch)
    return bool(are_apart)


def from_units(result: Overlay, grid: Grid, starts: IntArray, again: Any, budget: Budget) -> Overlay:
    """Return an overlay in units of the grid as one in the units of its input; its exact rings are its own then.

    starts: as `Overlay._starts`. again: arranges rings.
    """
    vertices = grid.places_of(result.vertices)
    is_valid = grid.base == 2 or not len(vertices) or np.abs(result.vertices).max() <= _SURELY_VALID
    if not is_valid and not _stay_apart(result, budget):
        rings = one_pair(vertices, result.ring_offsets, result.piece_offsets, 0.0, 0, status=MAY_CROSS)
        is_valid = np.array_equal(again(rings, budget).vertices, vertices)
        if not is_valid:
            raise NotRepresentableError(
                f"multiples of {float(grid.size)!r} are not told apart well enough by float64 here; take a power of two"
            )
    size = grid.size
    moved = float(size) * result.largest_displacement
    if grid.base == 10 and len(vertices):  # units are rounded, and what they stand for
        moved += 2.0 * float(np.spacing(np.abs(vertices).max()))
    edges = result._edges
    if edges is None:
        assert isinstance(result.exact, ImplicitRings)
        edges = edges_along(result.exact.sources)
    exact = rings_alone(vertices, result.ring_offsets)
    return replace(
        result,
        vertices=exact.subject.vertices,
        exact=exact,
        largest_displacement=float(np.nextafter(moved, np.inf)) if moved else 0.0,
        _lost=result._lost and result._lost._replace(unit=size),
        _edges=edges,
        _starts=starts,
    )
