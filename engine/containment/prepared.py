"""Structures that queries share, each built once a solid: columns of triangles, slabs of edges, rounded rows."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Final, NamedTuple

import numpy as np

from engine.arrays import BoolArray, FloatArray, Int8Array, Int32Array, read_only
from engine.bounding.grid import BoxGrid, build_box_grid
from engine.containment.methods.polyhedron_ray_parity import fill_rows
from engine.containment.rational_locate import Check, next_in_ring, no_check
from engine.predicates.rational import orient2d_rational
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.triangle import Triangle
from engine.types import UNDECIDED

_AT_ONCE: Final = 1 << 16
_PASSES: Final = 16
_POINTS_A_PASS: Final = 1024
"""As `run_chunks` begins with."""


class Columns(NamedTuple):
    """Triangles by columns of a grid over x and y, for vertical rays."""

    vertices: FloatArray
    """``(n, 3)``: the solid's."""
    triangles: Int32Array
    """``(m, 3)``, by falling zmax."""
    boxes: FloatArray
    """``(m, 6)``: xmin, xmax, ymin, ymax, zmin, zmax."""
    areas: Int8Array
    """``(m,)``: exact sign of the area seen from above."""
    grid: BoxGrid
    z_min: float


class Rings(NamedTuple):
    """Edges of a polygon by horizontal slabs, for rays to the right."""

    starts: FloatArray
    """``(m, 2)``, by falling larger x."""
    ends: FloatArray
    x_highs: FloatArray
    """``(m,)``: the larger x of each edge."""
    slabs: BoxGrid
    """Over y; its second axis has one cell."""
    box: tuple[float, float, float, float]
    """xmin, xmax, ymin, ymax."""


def columns_of(solid: Polyhedron, check: Check = no_check) -> Columns:
    """Return the columns of `solid`, prepared once: about two triangles to a column if they are evenly spread.

    check: called between the steps, a second's work for a million triangles; what it raises ends the building.
    """
    return solid.prepared("columns", lambda: _build_columns(solid, check), check)


def columns_pay(solid: Polyhedron, n_points: int) -> bool:
    """Tell whether the points asked so far would have taken as long, in passes over all triangles, as columns take."""
    passes = solid.prepared("passes", lambda: [0])
    passes[0] += 1 + (n_points - 1) // _POINTS_A_PASS
    return passes[0] > _PASSES


def _build_columns(solid: Polyhedron, check: Check) -> Columns:
    check()
    vertices, given = solid.vertices, solid.triangles
    heights = vertices[:, 2].copy()
    tops = heights[given[:, 0]]
    for corner in (1, 2):
        check()
        np.maximum(tops, heights[given[:, corner]], out=tops)
    check()
    order = np.argsort(-tops, kind="stable")
    del tops
    triangles, boxes = np.empty((len(order), 3), np.int32), np.empty((len(order), 6))
    areas = np.empty(len(order), np.int8)
    for start in range(0, len(order), _AT_ONCE):
        check()
        some = slice(start, start + _AT_ONCE)
        with np.errstate(all="ignore"):
            fill_rows(vertices, given, order[some], triangles[some], boxes[some], areas[some])
    check()
    for index in np.flatnonzero(areas == UNDECIDED):
        check()
        areas[index] = orient2d_rational(*vertices[triangles[index], :2].tolist())
    side = max(1, min(2048, int(len(order) ** 0.5)))
    grid = build_box_grid([boxes[:, 0], boxes[:, 2]], [boxes[:, 1], boxes[:, 3]], [side, side], check)
    return Columns(vertices, triangles, boxes, areas, grid, float(boxes[:, 4].min()))


def rings_of(solid: Polygon | Triangle, check: Check = no_check) -> Rings:
    """Return the slabs of a polygon, or of a plane triangle as one ring, prepared once; check as in `columns_of`."""

    def build() -> Rings:
        check()
        if isinstance(solid, Triangle):
            return _build_rings(solid.vertices, solid.vertices[[1, 2, 0]], check)
        return _build_rings(solid.vertices, solid.vertices[next_in_ring(solid)], check)

    return solid.prepared("slabs", build, check)


def _build_rings(starts: FloatArray, ends: FloatArray, check: Check) -> Rings:
    order = np.argsort(-np.maximum(starts[:, 0], ends[:, 0]), kind="stable")
    check()
    starts, ends = np.ascontiguousarray(starts[order]), np.ascontiguousarray(ends[order])
    check()
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    flat = np.zeros(1)
    slabs = build_box_grid([low[:, 1], flat], [high[:, 1], flat], [max(1, min(1 << 20, len(order))), 1], check)
    box = (float(low[:, 0].min()), float(high[:, 0].max()), float(low[:, 1].min()), float(high[:, 1].max()))
    return Rings(starts, ends, np.ascontiguousarray(high[:, 0]), slabs, box)


def rounded_rows(rows: Sequence[Sequence[int | Fraction]]) -> tuple[FloatArray, BoolArray]:
    """Return rational rows, each scaled to a largest coefficient near 1 and correctly rounded, and whether exactly so.

    A coefficient that is smaller than 2^-900 of the largest, and not zero, could underflow: such a row becomes NaN,
    which no filter accepts.
    """
    rounded, is_exact = np.empty((len(rows), len(rows[0]))), np.empty(len(rows), np.bool_)
    for i_row, row in enumerate(rows):
        largest = max(abs(Fraction(value)) for value in row)
        exponent = largest.numerator.bit_length() - largest.denominator.bit_length()
        scale = Fraction(1, 1 << exponent) if exponent >= 0 else Fraction(1 << -exponent)
        scaled = [Fraction(value) * scale for value in row]
        rounded[i_row] = [float(value) for value in scaled]
        if any(value != 0 and abs(value) < Fraction(1, 1 << 900) for value in scaled):
            rounded[i_row] = np.nan
        is_exact[i_row] = all(Fraction(float(value)) == value for value in scaled)
    return read_only(rounded), is_exact & ~np.isnan(rounded[:, 0])
