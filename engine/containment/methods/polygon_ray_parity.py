"""Point location in a polygon by ray parity (crossing number, even-odd over all rings), exact, one ray a point.

The ray goes right from q, moved up by an infinitesimal eps (simulation of simplicity), so it misses every vertex:

| edge | decision |
|---|---|
| one end with y <= q.y, the other with y > q.y | crossed if the crossing is right of q: sign of orient2d |
| that sign is zero | q is on the edge: BOUNDARY, whatever the parity |
| horizontal | never crossed, tested for BOUNDARY only |

Edges are listed as runs, from one vertex of a ring to another: whole rings, or the parts of them in a horizontal slab
(prepared.py). Where horizontal lines meet far more edges than vertical ones, x and y change places: rays go up. The
filter goes over all edges of a run without branches, so that the compiler vectorises it; the edges are decided one by
one if the sign at a crossed edge is uncertain or a vertex has the height of q. A grid of cells, if built, knows the
location of all points of most cells.

A point may have a blur, a bound on its coordinates' error as in methods/filters.py; what it leaves open is UNDECIDED.

Source: Shimrat 1962, "Algorithm 112: position of point relative to polygon"; Hormann and Agathos 2001, "The point in
polygon problem for arbitrary polygons". Changed: exact signs, three values.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.bounding.box_grid import Axis, cell_of
from engine.compiling.jit import called, inline, kernel, merged
from engine.containment.methods.filters import NOT_FINITE, has_not_finite
from engine.predicates.orientation import BOUND_2D, GUARD_2D, orient2d_exact, orient2d_filter
from engine.types import UNDECIDED, FlagArray, FloatArray, Int8Array, Int32Array, IntArray, Point2

MISSED, CROSSED, ON_EDGE = 0, 1, 3
"""How the ray from q meets an edge; ON_EDGE: q lies on the edge."""
MIXED: Final = 2
"""Status of a grid cell that an edge may reach into; the status of any other cell is the location of all its points."""


class Rings(NamedTuple):
    """Edges of a polygon, listed by horizontal slab, for rays to the right; the grid of cells is optional."""

    columns: tuple[int, int]
    """Which coordinates of a point are x and y here: (0, 1), or (1, 0) where they have changed places."""
    xs: FloatArray
    """x of the vertices of all rings, each ring closed by its first vertex."""
    ys: FloatArray
    slabs: Axis
    offsets: IntArray
    """``(n_slabs + 1,)``: first run of each slab."""
    runs: Int32Array
    """``(n, 2)``: indices of the first and last vertex of each run, in xs and ys."""
    box: tuple[float, float, float, float]
    """xmin, xmax, ymin, ymax."""
    u: Axis
    v: Axis
    statuses: Int8Array
    """Locations of the grid's cells, row by row, or MIXED; empty without a grid."""


@merged
def _crosses_edge(ax: float, ay: float, bx: float, by: float, x: float, y: float, blur: float) -> tuple[bool, bool]:
    """Return whether the ray to the right from q = (x, y) crosses edge ab, and whether the filter fails to prove that
    for all of the blur of q."""
    above = ay - y
    left = (ax - x) * (by - y)
    right = above * (bx - x)
    turn = left - right
    bound = BOUND_2D * (abs(left) + abs(right)) + GUARD_2D
    bound += blur * (abs(bx - ax) + abs(by - ay))
    is_passed = (ay <= y) != (by <= y)
    is_unsure = (is_passed & (not abs(turn) > bound)) | (not abs(above) > blur)  # NaN is not sure
    return is_passed & ((turn > 0.0) == (ay < by)), is_unsure


@merged
def _count_crossings(
    xs: FloatArray, ys: FloatArray, first: int, last: int, x: float, y: float, blur: float
) -> tuple[int, int]:
    """Return how many of the edges from vertex first to vertex last (consecutive in xs, ys) the ray to the right from
    the blurred point (x, y) crosses, and for how many the filter cannot tell."""
    n_crossed = n_unsure = 0
    for edge in range(np.uint64(first), np.uint64(last)):  # unsigned: no index that counts from the end
        follow = edge + np.uint64(1)
        is_crossed, is_unsure = _crosses_edge(xs[edge], ys[edge], xs[follow], ys[follow], x, y, blur)
        n_crossed += is_crossed
        n_unsure += is_unsure
    return n_crossed, n_unsure


@inline
def meet_edge(a: Point2, b: Point2, q: Point2) -> int:
    """Return CROSSED, MISSED, ON_EDGE or UNDECIDED for the ray to the right from q and edge ab; exact."""
    if (a.y < q.y and b.y < q.y) or (a.y > q.y and b.y > q.y) or (a.x < q.x and b.x < q.x):
        return MISSED
    is_passed = (a.y <= q.y) != (b.y <= q.y)
    if a.x > q.x and b.x > q.x:  # wholly to the right: no sign needed
        return CROSSED if is_passed else MISSED
    turn = orient2d_filter(a, b, q)
    if turn == UNDECIDED:
        turn = orient2d_exact(a, b, q)
    if turn == UNDECIDED:
        return UNDECIDED
    if turn == 0:
        # on the line, and between the ends in y; in x too, unless the edge is horizontal and q beyond it
        return ON_EDGE if min(a.x, b.x) <= q.x and q.x <= max(a.x, b.x) else MISSED
    return CROSSED if is_passed and (turn > 0) == (a.y < b.y) else MISSED


@called
def _locate_edge_by_edge(xs: FloatArray, ys: FloatArray, runs: Int32Array, first: int, last: int, q: Point2) -> int:
    """Return the location of q by exact signs at the edges of runs first .. last - 1: 1, 0, -1, or UNDECIDED where
    exponents are out of range."""
    is_odd, is_open = False, False
    for run in range(first, last):
        for edge in range(runs[run, 0], runs[run, 1]):
            ay, by = ys[edge], ys[edge + 1]
            if (ay < q.y and by < q.y) or (ay > q.y and by > q.y):
                continue
            met = meet_edge(Point2(float(xs[edge]), float(ay)), Point2(float(xs[edge + 1]), float(by)), q)
            if met == ON_EDGE:
                return 0
            is_open |= met == UNDECIDED
            is_odd ^= met == CROSSED
    return UNDECIDED if is_open else 1 if is_odd else -1


@inline
def locate_in_runs(
    xs: FloatArray, ys: FloatArray, runs: Int32Array, first: int, last: int, x: float, y: float, blur: float
) -> tuple[int, bool]:
    """Return the location of a blurred point (x, y) by the runs first .. last - 1 (1, 0, -1, UNDECIDED), and whether
    the filter left an edge open. Caller guarantees that these runs have every edge at the height of the point."""
    n_crossed = n_unsure = 0
    for run in range(first, last):
        crossed, unsure = _count_crossings(xs, ys, runs[run, 0], runs[run, 1], x, y, blur)
        n_crossed += crossed
        n_unsure += unsure
    if n_unsure == 0:
        return (1 if n_crossed & 1 else -1), False
    if blur != 0.0:
        return UNDECIDED, True
    return _locate_edge_by_edge(xs, ys, runs, first, last, Point2(x, y)), True


@merged
def _write_cell_statuses(points: FloatArray, rings: Rings, locations: Int8Array) -> None:
    """Fill locations with the status of each point's grid cell, -1 outside the polygon's box; without branches."""
    u, v, (x_min, x_max, y_min, y_max), statuses = rings.u, rings.v, rings.box, rings.statuses
    xs, ys = points[:, rings.columns[0]], points[:, rings.columns[1]]
    for item in range(len(points)):
        x, y = xs[item], ys[item]
        is_out = (x < x_min) | (x > x_max) | (y < y_min) | (y > y_max)
        column = cell_of(min(max(x, x_min), x_max), u.low, u.cells_per_unit, u.n_cells)
        row = cell_of(min(max(y, y_min), y_max), v.low, v.cells_per_unit, v.n_cells)
        status = statuses[np.uint64(row * u.n_cells + column)]
        locations[item] = status | -np.int8(is_out)  # any but 0 would be a branch


@kernel
def locate_in_rings(points: FloatArray, blurs: FloatArray, rings: Rings, locations: Int8Array, flag: FlagArray) -> int:
    """Fill locations (n,) int8 of points (n, 2) in a polygon; return how many the filter left open, or NOT_FINITE.
    blurs: (n,), or (0,) for exact points; only these are tested for NaN and infinity."""
    if len(blurs) == 0 and has_not_finite(points):
        return NOT_FINITE
    x_min, x_max, y_min, y_max = rings.box
    slabs, offsets, n_beyond = rings.slabs, rings.offsets, 0
    xs, ys = points[:, rings.columns[0]], points[:, rings.columns[1]]
    has_cells = len(rings.statuses) > 0 and len(blurs) == 0
    if has_cells:
        _write_cell_statuses(points, rings, locations)
    for item in range(len(points)):
        if has_cells and locations[item] != MIXED:
            continue
        if flag[0]:
            break
        q, blur = Point2(xs[item], ys[item]), float(blurs[item]) if len(blurs) > 0 else 0.0
        below, above = q.y - blur, q.y + blur
        if q.x + blur < x_min or q.x - blur > x_max or above < y_min or below > y_max:
            locations[item] = -1
            continue
        location, is_beyond = UNDECIDED, True
        if below >= y_min:  # false for NaN; what sticks out of the slabs is left open
            slab = cell_of(below, slabs.low, slabs.cells_per_unit, slabs.n_cells)
            if blur == 0.0 or slab == cell_of(above, slabs.low, slabs.cells_per_unit, slabs.n_cells):
                first, last = offsets[slab], offsets[slab + 1]
                location, is_beyond = locate_in_runs(rings.xs, rings.ys, rings.runs, first, last, q.x, q.y, blur)
        locations[item] = location
        n_beyond += is_beyond
    return n_beyond
