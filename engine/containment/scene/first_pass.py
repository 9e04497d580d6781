"""Which points are in which bodies of a scene: one pass over the points decides most candidates on the spot.

A point's candidates are the bodies whose boxes hold it, by the cells of a grid, and the bodies without bounds, merged
in ascending order. A candidate is decided by what its solid has: the sides of a box, squared distance, rows of planes,
the edges of a small polygon, the cells of a polyhedron. A body under a pose is asked in its own frame, where the point
carries a blur (posed/frames.py). Filters decide with proven bounds (those of half_spaces.py, ball.py and
posed/filters.py), what they leave is UNDECIDED and listed for the methods of single solids.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from engine.arrays import BoolArray, FloatArray, Int8Array, Int32Array, IntArray
from engine.containment.cells.locate import side_in_cell
from engine.containment.methods.ball import located
from engine.containment.methods.polygon_ray_parity import locate_in_runs
from engine.containment.posed.filters import in_space, side_of_box, side_of_rows
from engine.containment.posed.frames import to_frame
from engine.containment.scene.grid import cell_at
from engine.jit import kernel, merged
from engine.types import UNDECIDED

SECOND_PASS: Final = 0
BOX: Final = 1
BALL: Final = 2
ROWS: Final = 3
RINGS: Final = 4
CELLS: Final = 5
"""Kinds of bodies: how a candidate is decided in the first pass."""


class SceneTables(NamedTuple):
    """What the first pass reads of the bodies; a body's row in the tables of its kind is its slot."""

    kinds: Int8Array
    slots: Int32Array
    lows: FloatArray
    """``(n_bodies, 3)``: boxes, rounded outward; the third axis of a scene of the plane is 0."""
    highs: FloatArray
    frames: Int32Array
    """Row of a body's pose in the next three, -1 for none."""
    inverses: FloatArray
    """``(n_poses, 3, 3)``: R^-1 rounded (posed/frames.py); the plane's in the upper left."""
    translations: FloatArray
    is_turn: BoolArray
    box_lows: FloatArray
    """``(n, 3)``: of boxes in their own frame."""
    box_highs: FloatArray
    centers: FloatArray
    """``(n, 3)``: of balls, in the world."""
    balls: FloatArray
    """``(n, 2)``: radius, and a bound on the error of each coordinate of the centre."""
    row_offsets: IntArray
    """Where the rows of a half-space or convex begin."""
    rows: FloatArray
    """``(n, 4)``: normal and offset; the plane's have 0 in the third place."""
    polygon_offsets: IntArray
    """Where the rings of a polygon begin."""
    rings: Int32Array
    xs: FloatArray
    """The vertices of all rings, each ended by its first one."""
    ys: FloatArray
    cell_frames: FloatArray
    cell_places: IntArray
    """``(n, 6)`` and ``(n, 4)``: what `TopCells` has of a polyhedron."""


@merged
def _is_in_bounds(tables: Any, body: int, p: Any) -> bool:
    lows, highs = tables.lows, tables.highs
    is_out = (p[0] < lows[body, 0]) | (p[0] > highs[body, 0])
    is_out |= (p[1] < lows[body, 1]) | (p[1] > highs[body, 1])
    is_out |= (p[2] < lows[body, 2]) | (p[2] > highs[body, 2])
    return not is_out


@merged
def _locate_in_body(tables: Any, body: int, is_flat: bool, p: Any) -> tuple[int, bool]:
    """Return the location of a point in a body, and whether it took more than a filter."""
    kind, slot = tables.kinds[body], tables.slots[body]
    q, blur = to_frame(tables, tables.frames[body], p)
    if kind == RINGS:
        first, last = tables.polygon_offsets[slot], tables.polygon_offsets[slot + 1]
        return locate_in_runs(tables.xs, tables.ys, tables.rings, first, last, q[0], q[1], blur)
    location = UNDECIDED
    if kind == CELLS:
        location = side_in_cell(tables.cell_frames, tables.cell_places, slot, q, blur)
    elif kind == BOX:
        location = side_of_box(in_space(tables.box_lows, slot), in_space(tables.box_highs, slot), is_flat, q, blur)
    elif kind == BALL:
        c, radius, blur = in_space(tables.centers, slot), tables.balls[slot, 0], tables.balls[slot, 1]
        square, reach = radius * radius, radius + 2.0 * blur
        location = int(located(p[0] - c[0], p[1] - c[1], p[2] - c[2], square, reach, blur))
    elif kind == ROWS:
        location = side_of_rows(tables.rows, tables.row_offsets[slot], tables.row_offsets[slot + 1], q, blur)
    return location, False


@kernel
def sort_by_cell(points: Any, grid: Any, shift: int, keys: Any, ends: Any, order: Any, gathered: Any) -> None:
    """Gather points (n, dim) in the order of their cells, so that those that meet the same bodies come together.

    shift: cells that share all higher bits of their number count as one. keys, order: (n,) int32, order is filled with
    the points' places; ends: (number of cells + 1 >> shift, and two more) int64, zero.
    """
    for item in range(len(points)):
        key = (cell_at(in_space(points, item), grid) + 1) >> shift
        keys[item] = key
        ends[key + 1] += 1
    for key in range(1, len(ends)):
        ends[key] += ends[key - 1]
    for item in range(len(points)):
        place = ends[keys[item]]
        ends[keys[item]] += 1
        order[place] = item
        for axis in range(points.shape[1]):
            gathered[place, axis] = points[item, axis]


@kernel
def scan_points(
    points: Any, tables: Any, grid: Any, unbounded: Any, counts: Any, bodies: Any, located: Any, flag: Any
) -> Any:
    """List the bodies that hold the points (n, 2 or 3), as far as the room goes.

    counts: (n,) int64, bodies of each point; bodies int32, located int8: (room,) the bodies of all points, ascending
    for each, where they are not surely outside. unbounded: bodies that are asked about every point, ascending.
    Returns the numbers of points done, bodies listed, and those that took more than a filter.
    """
    is_flat, n_unbounded, items = points.shape[1] == 2, len(unbounded), grid.items
    n_bodies = n_beyond = done = 0
    for item in range(len(points)):
        if flag[0]:
            break
        p = in_space(points, item)
        entry = last = waiting = 0
        cell = cell_at(p, grid)
        if cell >= 0:
            entry, last = grid.offsets[cell], grid.offsets[cell + 1]
        if n_bodies + (last - entry) + n_unbounded > len(bodies):
            break
        before = n_bodies
        while entry < last or waiting < n_unbounded:  # bound: each turn takes one from one of the lists
            is_listed = waiting == n_unbounded or (entry < last and items[entry] < unbounded[waiting])
            body = items[entry] if is_listed else unbounded[waiting]
            entry, waiting = entry + is_listed, waiting + (not is_listed)
            if is_listed and not _is_in_bounds(tables, body, p):
                continue
            location, is_beyond = _locate_in_body(tables, body, is_flat, p)
            n_beyond += is_beyond
            if location != -1:
                bodies[n_bodies], located[n_bodies] = body, location
                n_bodies += 1
        counts[item] = n_bodies - before
        done = item + 1
    return done, n_bodies, n_beyond


@kernel
def put_in_order(
    order: Any, sorted_counts: Any, sorted_bodies: Any, sorted_located: Any, counts: Any, starts: Any, lists: Any
) -> int:
    """Bring what `scan_points` listed for gathered points into the order of the points.

    order: (n,) each one's place; counts: (n,) and starts: (n,) int64 are filled; lists: bodies int64 and located int8,
    of the pairs' number, then places and owners int64: the pairs that are UNDECIDED, and their points.
    Returns how many those are.
    """
    bodies, located, places, owners = lists
    for place in range(len(order)):
        counts[order[place]] = sorted_counts[place]
    start = 0
    for item in range(len(counts)):
        starts[item] = start
        start += counts[item]
    pair = n_open = 0
    for place in range(len(order)):
        item = order[place]
        for target in range(starts[item], starts[item] + counts[item]):
            bodies[target], located[target] = sorted_bodies[pair], sorted_located[pair]
            if located[target] == UNDECIDED:
                places[n_open], owners[n_open] = target, item
                n_open += 1
            pair += 1
    return n_open


@kernel
def drop_outside(counts: Any, bodies: Any, located: Any) -> int:
    """Close up over the bodies that turned out not to hold their point; returns how many are left."""
    place = kept = 0
    for item in range(len(counts)):
        before = kept
        for _ in range(counts[item]):
            if located[place] >= 0:
                bodies[kept], located[kept] = bodies[place], located[place]
                kept += 1
            place += 1
        counts[item] = kept - before
    return kept
