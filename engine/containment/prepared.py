"""Prepared structures of point location, each built once a solid when it amortises: rings, slabs, cells, triangle tree.

**Slabs.** An edge is listed in the slabs of both its heights and all between; edges of a slab that follow each other in
a ring are one run.

**Cells.** Let U(x) = (x / 2 - low / 2) scale be the exact place of x in units of cells, of which there are at most 2^15
along an axis; `cell_of` computes it to within 2^-35. The image of an edge is within as much of the segment
between the computed places of its ends. That segment is taken row by row, 2^-7 of a cell beyond the row on both sides,
and every column that this part reaches to within 2^-7 is marked MIXED. Where the part is cut off at a side of the row,
the segment rises by 2^-7 at least, so its slope is at most 2^22 and the column there off by less than 2^-14.
So no edge comes as near as 2^-8 to a cell that is not marked: all doubles of the cell have one location, the same as
those of an adjacent unmarked cell, and none is on an edge. One point of each connected stretch of such cells is
located by the slabs. Below an extent of 2^-960 underflow could invalidate this: there is no grid.

Source: slabs after F. Preparata, M. Shamos, Computational Geometry, 1985; cells after C. Ericson, 2005, 7.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, Final, NamedTuple

import numpy as np

from engine.bounding.box_grid import Axis, cell_of, make_axis
from engine.bounding.bvh import WIDTH, empty_rows
from engine.bounding.trees import MANY, boxes_of, build_stretched_bvh
from engine.compiling.jit import entry_of, inline, kernel
from engine.containment.methods.polygon_ray_parity import MIXED, Rings, locate_in_runs
from engine.containment.methods.polyhedron_ray_parity import reorder_by_tree
from engine.containment.methods.rational_locate import Check, no_check, prism_walls
from engine.lanes.boxes import BOX_ROWS
from engine.lanes.faces import OVERHEAD_ROWS
from engine.lanes.lanes import array_at
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.primitives import Triangle
from engine.types import BoolArray, FlagArray, Float32Array, FloatArray, Int8Array, Int32Array, IntArray, read_only

_LEAST_IN_SLAB: Final = 8
_CELLS_AN_EDGE, _FEWEST_CELLS, _MOST_CELLS = 12, 1 << 14, 1 << 25
_MARKS_AN_EDGE, _MOST_ALONG = 16, 1 << 15
_SMALLEST: Final = 2.0**-960
_MARGIN: Final = 2.0**-7
_NO_STATUSES: Final = np.empty(0, np.int8)


@kernel
def close_rings(
    vertices: FloatArray, ring_offsets: IntArray, xs: FloatArray, ys: FloatArray, runs: Int32Array, box: FloatArray
) -> None:
    """Copy rings to xs, ys, each ended by its first vertex once more, and fill runs (n_rings, 2) with the first and
    last index of each there, and box with xmin, xmax, ymin, ymax. vertices: (n, 2)."""
    place, x_min, x_max, y_min, y_max = 0, np.inf, -np.inf, np.inf, -np.inf
    for ring in range(len(ring_offsets) - 1):
        first, last = ring_offsets[ring], ring_offsets[ring + 1]
        runs[ring, 0], runs[ring, 1] = place, place + last - first
        for vertex in range(first, last):
            x, y = vertices[vertex, 0], vertices[vertex, 1]
            x_min, x_max, y_min, y_max = min(x_min, x), max(x_max, x), min(y_min, y), max(y_max, y)
            xs[place], ys[place] = x, y
            place += 1
        xs[place], ys[place] = vertices[first, 0], vertices[first, 1]
        place += 1
    box[0], box[1], box[2], box[3] = x_min, x_max, y_min, y_max


@kernel
def list_runs(
    ys: FloatArray, rings: Int32Array, slabs: Axis, ends: IntArray, lasts: IntArray, runs: Int32Array, is_fill: bool
) -> None:
    """Count the runs of edges in each horizontal slab, by ends[slab] += 1; if is_fill, also write them to runs. A run
    is the indices in ys of its first and last vertex. rings (n, 2): the runs that are whole rings. lasts (n_slabs,): -1
    on entry; the last vertex of the last run of each slab."""
    low, scale, n_slabs = slabs.low, slabs.cells_per_unit, slabs.n_cells
    for ring in range(len(rings)):
        there = cell_of(ys[rings[ring, 0]], low, scale, n_slabs)
        for edge in range(rings[ring, 0], rings[ring, 1]):
            here, there = there, cell_of(ys[edge + 1], low, scale, n_slabs)
            for slab in range(min(here, there), max(here, there) + 1):
                if lasts[slab] != edge:
                    if is_fill:
                        runs[ends[slab], 0] = edge
                    ends[slab] += 1
                if is_fill:
                    runs[ends[slab] - 1, 1] = edge + 1
                lasts[slab] = edge + 1


@inline
def _place(value: float, axis: Axis) -> float:
    return (value * 0.5 - axis.low * 0.5) * axis.cells_per_unit


@kernel
def mark_cells(
    xs: FloatArray, ys: FloatArray, runs: Int32Array, u: Axis, v: Axis, statuses: Int8Array, flag: FlagArray
) -> None:
    """Set to MIXED the status of every cell of the grid over axes u, v that an edge of the runs may reach into."""
    for run in range(len(runs)):
        bu, bv = _place(xs[runs[run, 0]], u), _place(ys[runs[run, 0]], v)
        for edge in range(runs[run, 0], runs[run, 1]):
            if edge & 4095 == 4095 and flag[0]:
                return
            au, av, bu, bv = bu, bv, _place(xs[edge + 1], u), _place(ys[edge + 1], v)
            lower, low, upper, high = (au, av, bu, bv) if av <= bv else (bu, bv, au, av)
            slope = (upper - lower) / (high - low) if low != high else 0.0
            last = min(int(high + _MARGIN), v.n_cells - 1)
            for row in range(min(int(max(low - _MARGIN, 0.0)), last), last + 1):
                floor, top = row - _MARGIN, row + 1.0 + _MARGIN
                first = lower if low >= floor else lower + slope * (floor - low)
                then = upper if high <= top else lower + slope * (top - low)
                begin, end = int(max(min(first, then) - _MARGIN, 0.0)), int(max(first, then) + _MARGIN)
                head = row * u.n_cells
                for cell in range(head + min(begin, u.n_cells - 1), head + min(end, u.n_cells - 1) + 1):
                    statuses[cell] = MIXED


@kernel
def propagate_locations(rings: Rings, statuses: Int8Array, flag: FlagArray) -> None:
    """Fill statuses with the location of each cell that is not MIXED: copied from the cell left or below (flood fill),
    else that of the cell's centre by the slabs; MIXED if that is undecided."""
    u, v, slabs = rings.u, rings.v, rings.slabs
    for row in range(v.n_cells):
        if flag[0]:
            return
        y = 2.0 * (v.low * 0.5 + (row + 0.5) / v.cells_per_unit)
        is_in_row = v.low <= y and cell_of(y, v.low, v.cells_per_unit, v.n_cells) == row
        slab = cell_of(y, slabs.low, slabs.cells_per_unit, slabs.n_cells) if is_in_row else 0
        for column in range(u.n_cells):
            cell = row * u.n_cells + column
            if statuses[cell] == MIXED:
                continue
            status = MIXED
            if column > 0 and statuses[cell - 1] != MIXED:
                status = statuses[cell - 1]
            elif row > 0 and statuses[cell - u.n_cells] != MIXED:
                status = statuses[cell - u.n_cells]
            else:
                x = 2.0 * (u.low * 0.5 + (column + 0.5) / u.cells_per_unit)
                if is_in_row and u.low <= x and cell_of(x, u.low, u.cells_per_unit, u.n_cells) == column:
                    first, last = rings.offsets[slab], rings.offsets[slab + 1]
                    status, _ = locate_in_runs(rings.xs, rings.ys, rings.runs, first, last, x, y, 0.0)
            statuses[cell] = status  # UNDECIDED is MIXED


def closed_rings(vertices: FloatArray, ring_offsets: IntArray) -> tuple[FloatArray, FloatArray, Int32Array, FloatArray]:
    """Return xs, ys (the vertices of rings, each ring ended by its first one), runs (n_rings, 2) and box (4,): see
    `close_rings`."""
    n_rings = len(ring_offsets) - 1
    xs, ys = np.empty((2, len(vertices) + n_rings))
    runs, box = np.empty((n_rings, 2), np.int32), np.empty(4)
    entry_of(close_rings)(vertices, ring_offsets, xs, ys, runs, box)
    return xs, ys, runs, box


def edges_of(solid: Polygon | Triangle) -> Rings:
    """Return the edges of a polygon as `Rings` with a single slab and no grid, made at first use."""

    def build() -> Rings:
        xs, ys, runs, box = closed_rings(solid.vertices, solid.ring_offsets)
        x_min, x_max, y_min, y_max = box.tolist()
        flat, offsets = Axis(y_min, y_max, 0.0, 1), np.array([0, len(runs)])
        return Rings((0, 1), xs, ys, flat, offsets, runs, (x_min, x_max, y_min, y_max), flat, flat, _NO_STATUSES)

    return solid.prepared("edges", build)


def rings_of(solid: Polygon | Triangle, check: Check = no_check) -> Rings:
    """Return the edges of a polygon as `Rings` by slabs, made at first use. check: called between the steps; what it
    raises ends the construction. Cost: some 10 ns an edge, and 16 to 32 bytes."""

    def build() -> Rings:
        edges, (met, columns) = edges_of(solid), edges_in_slab(solid)
        if columns != edges.columns:
            edges = edges._replace(columns=columns, xs=edges.ys, ys=edges.xs, box=(*edges.box[2:], *edges.box[:2]))
        check()
        n_slabs = int(len(edges.xs) / max(_LEAST_IN_SLAB, met))
        slabs = make_axis(*edges.box[2:], max(n_slabs, 1))
        offsets = np.zeros(slabs.n_cells + 1, np.int64)
        list_runs(edges.ys, edges.runs, slabs, offsets[1:], np.full(slabs.n_cells, -1), edges.runs, False)
        check()
        np.cumsum(offsets, out=offsets)
        runs = np.empty((offsets[-1], 2), np.int32)
        list_runs(edges.ys, edges.runs, slabs, offsets[:-1].copy(), np.full(slabs.n_cells, -1), runs, True)
        return edges._replace(slabs=slabs, offsets=offsets, runs=runs)

    return solid.prepared("slabs", build, check)


def ring_cells_of(solid: Polygon, flag: FlagArray, check: Check = no_check) -> Rings:
    """Return the edges of a polygon as `Rings` with slabs and a grid, made at first use; no grid below an extent of
    2^-960. Cost: some 60 ns an edge, and 12 bytes."""

    def build() -> Rings:
        rings, met = rings_of(solid, check), mean_edges_met(solid)
        across, along = met[rings.columns[0]], met[rings.columns[1]]
        x_min, x_max, y_min, y_max = rings.box
        if min(x_max * 0.5 - x_min * 0.5, y_max * 0.5 - y_min * 0.5) < _SMALLEST:
            return rings
        n_edges, across, along = len(rings.xs), max(across, 1.0), max(along, 1.0)
        most = (_MARKS_AN_EDGE * (n_edges + 256)) ** 2 / (4.0 * across * along)  # so many cells have so many marks
        n_cells = int(min(max(_CELLS_AN_EDGE * n_edges, _FEWEST_CELLS), _MOST_CELLS, most))
        n_u = min(max(int((n_cells * along / across) ** 0.5), 1), _MOST_ALONG)
        u, v = make_axis(x_min, x_max, n_u), make_axis(y_min, y_max, min(max(n_cells // n_u, 1), _MOST_ALONG))
        statuses = np.zeros(u.n_cells * v.n_cells, np.int8)
        placed = rings._replace(u=u, v=v)
        mark_cells(rings.xs, rings.ys, edges_of(solid).runs, u, v, statuses, flag)
        check()
        propagate_locations(placed, statuses, flag)
        check()
        return placed._replace(statuses=statuses)

    return solid.prepared("ring_cells", build, check)


def mean_edges_met(solid: Polygon | Triangle) -> tuple[float, float]:
    """Return how many edges a vertical line, and a horizontal one, meet on average over the polygon's box; computed
    once."""

    def find() -> tuple[float, float]:
        edges, means = edges_of(solid), []
        for values, low, high in ((edges.xs, *edges.box[:2]), (edges.ys, *edges.box[2:])):
            with np.errstate(all="ignore"):
                met = float((np.abs(np.diff(values * 0.25)) / (high * 0.25 - low * 0.25)).sum())
            means.append(met if met < len(values) else float(len(values)))
        return means[0], means[1]

    return solid.prepared("edges_met", find)


def edges_in_slab(solid: Polygon | Triangle) -> tuple[float, tuple[int, int]]:
    """Return how many edges a ray's line meets on average, and which coordinates are along the ray and across it: see
    `Rings`. Vertical rays only where their lines meet less than half as many."""
    vertical, horizontal = mean_edges_met(solid)
    return (vertical, (1, 0)) if vertical * 2.0 < horizontal else (horizontal, (0, 1))


EXACT: Final = np.zeros(0)
"""Blurs (0,) for points whose coordinates are exact."""


IN_TREE, IN_TREE_A_FACE_OVER = 150.0, 2.0
"""Nanoseconds that a point takes in a tree, and for each face box above the point (policy.py)."""
_FILL_SECONDS: Final = 4e-8
"""Time for each triangle of a tree."""
SAMPLE: Final = 256
"""Number of faces that `mean_faces_above` looks at."""


class TriangleTree(NamedTuple):
    """Triangles in a tree of boxes, for vertical rays."""

    vertices: FloatArray
    """``(n, 3)``: the solid's."""
    triangles: Int32Array
    """``(m, 3)``, in the order of the tree."""
    boxes: Float32Array
    child: Int32Array
    """As in `Bvh`."""
    blocks: Float32Array
    """``(n_nodes, 8, 8)``: the triangles of each node as `overhead` takes them."""
    origin: tuple[float, float, float]
    scale: tuple[float, float, float]
    """Both as of `build_stretched_bvh`."""
    low: tuple[float, float, float]
    """Low and high corner of the box of all triangles."""
    high: tuple[float, float, float]


def tree_of(solid: Polyhedron, check: Check = no_check) -> TriangleTree:
    """Return the `TriangleTree` of a polyhedron, built at first use. check: called while another thread builds it; what
    it raises ends the waiting."""
    return solid.prepared("tree", lambda: build_tree(solid), check)


def build_tree(solid: Polyhedron, many: int = MANY) -> TriangleTree:
    """Build the `TriangleTree` of a polyhedron, on threads from `many` faces on. Raises: DeadlineExceededError,
    CancelledError."""
    boxes, triangles = boxes_of(solid.vertices, solid.triangles), np.empty((len(solid.triangles), 3), np.int32)
    tree, origin, scale, ends = build_stretched_bvh(boxes, many)
    x, y, z, u, v, w = ends.tolist()
    child, blocks = tree.child.copy(), empty_rows((len(tree.child), OVERHEAD_ROWS, WIDTH), np.float32)

    def fill(nodes: slice, first: int) -> None:
        given = solid.vertices, solid.triangles, tree.boxes[nodes], tree.child[nodes], origin, scale
        reorder_by_tree(*given, first, child[nodes], triangles, blocks[nodes])

    blocks[: tree.n_above] = 0.0
    tree.each(fill, _FILL_SECONDS)
    places = tuple(origin.tolist()), tuple(scale.tolist()), (x, y, z), (u, v, w)
    return TriangleTree(solid.vertices, triangles, tree.boxes, child, read_only(blocks), *places)


def tree_row(tree: TriangleTree) -> tuple[tuple[int, ...], tuple[int, ...], tuple[float, ...]]:
    """Return the addresses of the arrays (5), their sizes (3) and the numbers (12: origin, scale, low, high) of a tree,
    as one row of the tables that `tree_at` reads."""
    arrays: Any = tree.vertices, tree.triangles, tree.boxes, tree.child, tree.blocks
    sizes = len(tree.vertices), len(tree.triangles), len(tree.child)
    return tuple(array.ctypes.data for array in arrays), sizes, (*tree.origin, *tree.scale, *tree.low, *tree.high)


@inline
def tree_at(tables: Any, row: int) -> TriangleTree:
    """Return the tree that row `row` of the tables encodes: addresses (n, 5), sizes (n, 3), places (n, 12), see
    `tree_row`."""
    addresses, sizes, places = tables.addresses, tables.sizes, tables.places
    return TriangleTree(
        array_at(addresses[row, 0], (sizes[row, 0], 3), np.float64),
        array_at(addresses[row, 1], (sizes[row, 1], 3), np.int32),
        array_at(addresses[row, 2], (sizes[row, 2], BOX_ROWS, WIDTH), np.float32),
        array_at(addresses[row, 3], (sizes[row, 2], WIDTH), np.int32),
        array_at(addresses[row, 4], (sizes[row, 2], OVERHEAD_ROWS, WIDTH), np.float32),
        (places[row, 0], places[row, 1], places[row, 2]), (places[row, 3], places[row, 4], places[row, 5]),
        (places[row, 6], places[row, 7], places[row, 8]), (places[row, 9], places[row, 10], places[row, 11]),
    )  # fmt: skip


def mean_faces_above(solid: Polyhedron) -> float:
    """Return how many face boxes a vertical line meets on average, from a sample of faces; thousands on bad shapes."""

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
    """Return the nanoseconds that a point takes in the tree of a polyhedron."""
    return IN_TREE + IN_TREE_A_FACE_OVER * mean_faces_above(solid)


def prism_rows(solid: Triangle) -> tuple[FloatArray, BoolArray]:
    """Return the plane rows (3, 4) of the prism's walls, rounded, and by row whether it is exact; made at first use."""
    return solid.prepared("rounded_walls", lambda: rounded_rows(prism_walls(solid)))


def rounded_rows(rows: Sequence[Sequence[int | Fraction]]) -> tuple[FloatArray, BoolArray]:
    """Return rational plane rows as float64, scaled to a largest coefficient near 1; and, by row, whether all its
    numbers are exact. A nonzero coefficient below 2^-900 of the largest could underflow: such a row becomes NaN, which
    no filter accepts."""
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
