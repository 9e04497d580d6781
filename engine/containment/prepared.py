"""Structures that queries share, each built once a solid: columns of triangles, slabs of edges, rounded rows."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from engine.bounding.grid import BoxGrid, build_box_grid
from engine.containment.rational_locate import next_in_ring
from engine.containment.ray_parity import projected_area_signs
from engine.predicates.rational import orient2d_rational
from engine.solids.base import FloatArray, as_read_only
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.triangle import Triangle
from engine.types import UNDECIDED


class Columns(NamedTuple):
    """Triangles by columns of a grid over x and y, for vertical rays."""

    vertices: FloatArray
    """``(n, 3)``: the solid's."""
    triangles: npt.NDArray[np.int32]
    """``(m, 3)``, by falling zmax."""
    boxes: FloatArray
    """``(m, 6)``: xmin, xmax, ymin, ymax, zmin, zmax."""
    areas: npt.NDArray[np.int8]
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


def columns_of(solid: Polyhedron) -> Columns:
    """Return the columns of `solid`, prepared once: about two triangles to a column if they are evenly spread."""
    return solid.prepared("columns", lambda: _build_columns(solid))


def _build_columns(solid: Polyhedron) -> Columns:
    vertices = solid.vertices
    corners = vertices[solid.triangles]
    low, high = corners.min(axis=1), corners.max(axis=1)
    order = np.argsort(-high[:, 2], kind="stable")
    triangles = np.ascontiguousarray(solid.triangles[order], np.int32)
    low, high = low[order], high[order]
    boxes = np.ascontiguousarray(np.stack([low, high], axis=2).reshape(len(order), 6))
    areas = np.empty(len(order), np.int8)
    with np.errstate(all="ignore"):
        projected_area_signs(vertices, triangles, areas)
    for index in np.flatnonzero(areas == UNDECIDED):
        areas[index] = orient2d_rational(*vertices[triangles[index], :2].tolist())
    side = max(1, min(2048, int(len(order) ** 0.5)))
    grid = build_box_grid(low[:, 0], high[:, 0], low[:, 1], high[:, 1], side, side)
    return Columns(vertices, triangles, boxes, areas, grid, float(low[:, 2].min()))


def rings_of(solid: Polygon | Triangle) -> Rings:
    """Return the slabs of a polygon, or of a plane triangle as one ring, prepared once."""

    def build() -> Rings:
        if isinstance(solid, Triangle):
            return _build_rings(solid.vertices, solid.vertices[[1, 2, 0]])
        return _build_rings(solid.vertices, solid.vertices[next_in_ring(solid)])

    return solid.prepared("slabs", build)


def _build_rings(starts: FloatArray, ends: FloatArray) -> Rings:
    order = np.argsort(-np.maximum(starts[:, 0], ends[:, 0]), kind="stable")
    starts, ends = np.ascontiguousarray(starts[order]), np.ascontiguousarray(ends[order])
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    flat = np.zeros(len(order))
    slabs = build_box_grid(low[:, 1], high[:, 1], flat, flat, max(1, min(1 << 20, len(order))), 1)
    box = (float(low[:, 0].min()), float(high[:, 0].max()), float(low[:, 1].min()), float(high[:, 1].max()))
    return Rings(starts, ends, np.ascontiguousarray(high[:, 0]), slabs, box)


def rounded_rows(rows: Sequence[Sequence[int | Fraction]]) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
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
    return as_read_only(rounded), is_exact & ~np.isnan(rounded[:, 0])
