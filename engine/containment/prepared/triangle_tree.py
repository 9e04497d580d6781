"""Structures that queries share, each built once a solid: the tree of triangles, rounded rows."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import BoolArray, Float32Array, FloatArray, Int32Array, read_only
from engine.bounding.bvh import WIDTH, build_bvh, on_lines
from engine.compiling.jit import inline
from engine.containment.methods.polyhedron_ray_parity import fill_triangle_boxes, lay_out
from engine.containment.methods.rational_locate import Check, no_check, prism_walls
from engine.lanes.addresses import array_at
from engine.lanes.boxes import BOX_ROWS
from engine.lanes.triangles import OVERHEAD_ROWS
from engine.solids.polyhedron import Polyhedron
from engine.solids.triangle import Triangle

EXACT: Final = np.zeros(0)
"""In place of blurs: the points are what they are."""


IN_TREE, IN_TREE_A_FACE_OVER = 150.0, 2.0
"""Nanoseconds that a point takes in a tree, and more for each box of a face that it lies over (policy.py)."""
SAMPLE: Final = 256
"""Faces that are looked at to find out."""


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


def tree_line(tree: TriangleTree) -> tuple[tuple[int, ...], tuple[int, ...], tuple[float, ...]]:
    """Return a solid's row of addresses, sizes and places."""
    arrays: Any = tree.vertices, tree.triangles, tree.boxes, tree.child, tree.blocks
    sizes = len(tree.vertices), len(tree.triangles), len(tree.child)
    return tuple(array.ctypes.data for array in arrays), sizes, (*tree.origin, tree.scale, *tree.low, *tree.high)


@inline
def tree_at(tables: Any, row: int) -> TriangleTree:
    """Return the tree of a row of what has addresses, sizes and places (n, 5 / 3 / 10), as `tree_line` gives them."""
    addresses, sizes, places = tables.addresses, tables.sizes, tables.places
    return TriangleTree(
        array_at(addresses[row, 0], (sizes[row, 0], 3), np.float64),
        array_at(addresses[row, 1], (sizes[row, 1], 3), np.int32),
        array_at(addresses[row, 2], (sizes[row, 2], BOX_ROWS, WIDTH), np.float32),
        array_at(addresses[row, 3], (sizes[row, 2], WIDTH), np.int32),
        array_at(addresses[row, 4], (sizes[row, 2], OVERHEAD_ROWS, WIDTH), np.float32),
        (places[row, 0], places[row, 1], places[row, 2]), places[row, 3],
        (places[row, 4], places[row, 5], places[row, 6]), (places[row, 7], places[row, 8], places[row, 9]),
    )  # fmt: skip


def faces_over(solid: Polyhedron) -> float:
    """Return in how many boxes of faces, seen from above, a point lies in the mean; thousands on bad shapes."""

    def find() -> float:
        some = solid.vertices[solid.triangles[:: len(solid.triangles) // SAMPLE + 1], :2]
        with np.errstate(all="ignore"):
            extents = some.max(axis=1) - some.min(axis=1)
            for axis in (0, 1):
                extents[:, axis] /= np.ptp(solid.vertices[:, axis])
            over = float(extents.prod(axis=1).mean()) * len(solid.triangles)
        return over if over >= 0.0 else float(len(solid.triangles))

    return solid.prepared("faces_over", find)


def cost_in_tree(solid: Polyhedron) -> float:
    """Return what a point costs in the tree."""
    return IN_TREE + IN_TREE_A_FACE_OVER * faces_over(solid)


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
