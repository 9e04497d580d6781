"""Structures that queries share, each built once a solid: the tree of triangles, slabs of edges, rounded rows."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Final, NamedTuple

import numpy as np

from engine.arrays import BoolArray, Float32Array, FloatArray, Int32Array, IntArray, read_only
from engine.bounding.bvh import WIDTH, build_bvh, on_lines
from engine.bounding.grid import BoxGrid, build_box_grid
from engine.containment.methods.polyhedron_ray_parity import fill_triangle_boxes, lay_out
from engine.containment.rational_locate import Check, next_in_ring, no_check, prism_walls
from engine.lanes.triangles import OVERHEAD_ROWS
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.triangle import Triangle

EXACT: Final = np.zeros(0)
"""In place of blurs: the points are what they are."""


class TriangleTree(NamedTuple):
    """Triangles in a tree of boxes, for vertical rays."""

    vertices: FloatArray
    """``(n, 3)``: the solid's."""
    triangles: Int32Array
    """``(m, 3)``, in the order of the tree."""
    boxes: Float32Array
    child: Int32Array
    """As `Bvh` has them."""
    blocks: Float32Array
    """``(n_nodes, 8, 8)``: what `overhead` reads of the triangles of a node."""
    origin: tuple[float, float, float]
    scale: float
    low: tuple[float, float, float]
    """The box of all triangles."""
    high: tuple[float, float, float]


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


def tree_of(solid: Polyhedron, check: Check = no_check) -> TriangleTree:
    """Return the tree over the triangles of `solid`, prepared once.

    check: called between the steps, a second's work for a million triangles; what it raises ends the building.
    """
    return solid.prepared("tree", lambda: _build_tree(solid, check), check)


def _build_tree(solid: Polyhedron, check: Check) -> TriangleTree:
    check()
    boxes, triangles = np.empty((len(solid.triangles), 6)), np.empty((len(solid.triangles), 3), np.int32)
    fill_triangle_boxes(solid.vertices, solid.triangles, boxes)
    check()
    tree = build_bvh(boxes)
    check()
    child, blocks = np.empty_like(tree.child), np.zeros((len(tree.child), OVERHEAD_ROWS, WIDTH), np.float32)
    lay_out(solid.vertices, solid.triangles, tree, child, triangles, blocks)
    check()
    x, y, z, u, v, w = boxes.T
    low, high = (float(x.min()), float(y.min()), float(z.min())), (float(u.max()), float(v.max()), float(w.max()))
    origin = tuple(tree.origin.tolist())
    return TriangleTree(solid.vertices, triangles, tree.boxes, child, on_lines(blocks), origin, tree.scale, low, high)


def rings_of(solid: Polygon, check: Check = no_check) -> Rings:
    """Return the slabs of a polygon, prepared once; check as in `tree_of`."""
    return solid.prepared("slabs", lambda: _build_rings(solid.vertices, next_in_ring(solid), check), check)


def _build_rings(vertices: FloatArray, following: IntArray, check: Check) -> Rings:
    check()
    starts, ends = vertices, vertices[following]
    order = np.argsort(-np.maximum(starts[:, 0], ends[:, 0]), kind="stable")
    check()
    starts, ends = np.ascontiguousarray(starts[order]), np.ascontiguousarray(ends[order])
    check()
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    flat = np.zeros(1)
    slabs = build_box_grid([low[:, 1], flat], [high[:, 1], flat], [max(1, min(1 << 20, len(order))), 1], check)
    xs, ys = vertices[:, 0], vertices[:, 1]  # one by one: some 40 times as fast as min(axis=0)
    box = float(xs.min()), float(xs.max()), float(ys.min()), float(ys.max())
    return Rings(starts, ends, np.ascontiguousarray(high[:, 0]), slabs, box)


def prism_rows(solid: Triangle) -> tuple[FloatArray, BoolArray]:
    """Return the walls of the prism over a triangle, as `rounded_rows` does, prepared once."""
    return solid.prepared("rounded_walls", lambda: rounded_rows(prism_walls(solid)))


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
