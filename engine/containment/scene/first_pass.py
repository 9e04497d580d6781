"""Which points are in which bodies of a scene: one pass over the points decides most candidates on the spot.

A point's candidates are the bodies whose boxes hold it, by the cells of a grid, and the bodies without bounds, merged
in ascending order. A candidate is decided by what its solid has: the sides of a box, squared distance, rows of planes,
the edges of a small polygon, the voxels of a polyhedron. A body under a pose is asked in its own frame, where the point
carries a blur (posed/body_frame.py). Filters decide with proven bounds (those of half_spaces.py, ball.py and
posed/filters.py), what they leave is UNDECIDED and listed for the methods of single solids.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from engine.arrays import BoolArray, FloatArray, Int8Array, Int32Array, IntArray
from engine.containment.scene.grid import cell_at
from engine.containment.scene.rings import locate_in_small_rings
from engine.containment.scene.voxels import side_in_voxels
from engine.jit import inline, kernel
from engine.predicates.error_free import two_diff
from engine.types import UNDECIDED

LATER: Final = 0
BOX: Final = 1
BALL: Final = 2
ROWS: Final = 3
RINGS: Final = 4
VOXELS: Final = 5
"""Kinds of bodies: how a candidate is decided in the first pass."""

FRAME_BLUR: Final = 128.0 * 2.0**-53
_TINY: Final = 1e-320
_SLACK: Final = 16.0 * 2.0**-53
_ROW_SLACK: Final = 8.0 * 2.0**-53


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
    """``(n_poses, 3, 3)``: R^-1 rounded (posed/body_frame.py); the plane's in the upper left."""
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
    ring_offsets: IntArray
    xs: FloatArray
    """The vertices of all rings, each ended by its first one."""
    ys: FloatArray
    voxel_frames: FloatArray
    voxel_places: IntArray
    """``(n, 2)``: address of the packed sides, and shift."""


@inline
def to_frame(inverses: Any, translations: Any, is_turn: Any, frame: int, px: float, py: float, pz: float) -> Any:
    """Return a point in the frame of a pose, and its blur: what `move_to_body_frame` does."""
    dx, x_tail = two_diff(px, float(translations[frame, 0]))
    dy, y_tail = two_diff(py, float(translations[frame, 1]))
    dz, z_tail = two_diff(pz, float(translations[frame, 2]))
    x = inverses[frame, 0, 0] * dx + inverses[frame, 0, 1] * dy + inverses[frame, 0, 2] * dz
    y = inverses[frame, 1, 0] * dx + inverses[frame, 1, 1] * dy + inverses[frame, 1, 2] * dz
    z = inverses[frame, 2, 0] * dx + inverses[frame, 2, 1] * dy + inverses[frame, 2, 2] * dz
    if is_turn[frame] and x_tail == 0.0 and y_tail == 0.0 and z_tail == 0.0:
        return x, y, z, 0.0
    return x, y, z, FRAME_BLUR * (abs(dx) + abs(dy) + abs(dz)) + _TINY


@inline
def _in_box(low: Any, high: Any, slot: int, is_flat: bool, x: float, y: float, z: float, blur: float) -> int:
    is_out = (x + blur < low[slot, 0]) | (x - blur > high[slot, 0])
    is_out |= (y + blur < low[slot, 1]) | (y - blur > high[slot, 1])
    is_out |= (z + blur < low[slot, 2]) | (z - blur > high[slot, 2])
    if is_out:
        return -1
    is_within = (low[slot, 0] < x - blur) & (x + blur < high[slot, 0])
    is_within &= (low[slot, 1] < y - blur) & (y + blur < high[slot, 1])
    is_within &= is_flat | ((low[slot, 2] < z - blur) & (z + blur < high[slot, 2]))
    if is_within:
        return 1
    return 0 if blur == 0.0 else UNDECIDED


@inline
def _in_ball(centers: Any, balls: Any, slot: int, px: float, py: float, pz: float) -> int:
    dx, dy, dz = px - centers[slot, 0], py - centers[slot, 1], pz - centers[slot, 2]
    radius, blur = balls[slot, 0], balls[slot, 1]
    square, total = radius * radius, dx * dx + dy * dy + dz * dz
    bound = _SLACK * (square + total) + _TINY + 4.0 * blur * (abs(dx) + abs(dy) + abs(dz) + 2.0 * blur)
    excess = square - total
    return 1 if excess > bound else -1 if -excess > bound else UNDECIDED


@inline
def _in_rows(rows: Any, first: int, last: int, x: float, y: float, z: float, blur: float) -> int:
    location = 1
    for row in range(first, last):
        ax, by, cz, d = rows[row, 0] * x, rows[row, 1] * y, rows[row, 2] * z, rows[row, 3]
        distance = ax + by + cz + d
        bound = _ROW_SLACK * (abs(ax) + abs(by) + abs(cz) + abs(d)) + _TINY
        bound += blur * (abs(rows[row, 0]) + abs(rows[row, 1]) + abs(rows[row, 2]))
        if distance > bound:
            continue
        if -distance > bound:
            return -1
        location = UNDECIDED
    return location


@kernel
def sort_by_cell(points: Any, grid: Any, shift: int, keys: Any, ends: Any, order: Any, gathered: Any) -> None:
    """Gather points (n, dim) in the order of their cells, so that those that meet the same bodies come together.

    shift: cells that share all higher bits of their number count as one. keys, order: (n,) int32, order is filled with
    the points' places; ends: (number of cells + 1 >> shift, and two more) int64, zero.
    """
    is_flat = points.shape[1] == 2
    u, v, w = grid.u, grid.v, grid.w
    for item in range(len(points)):
        x, y, z = float(points[item, 0]), float(points[item, 1]), 0.0 if is_flat else float(points[item, 2])
        key = (cell_at(x, y, z, u, v, w) + 1) >> shift
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
    points: Any,
    tables: Any,
    grid: Any,
    unbounded: Any,
    counts: Any,
    bodies: Any,
    located: Any,
    flag: Any,
) -> Any:
    """List the bodies that hold the points (n, 2 or 3), as far as the room goes.

    counts: (n,) int64, bodies of each point; bodies int32, located int8: (room,) the bodies of all points, ascending
    for each, where they are not surely outside. unbounded: bodies that are asked about every point, ascending.
    Returns the numbers of points done, bodies listed, and those that took more than a filter.
    """
    is_flat = points.shape[1] == 2
    # taken out of the tuples once: within the loop each would be counted up and down as an object of its own
    kinds, slots, lows, highs, frames = tables.kinds, tables.slots, tables.lows, tables.highs, tables.frames
    inverses, translations, is_turn = tables.inverses, tables.translations, tables.is_turn
    box_lows, box_highs, centers, balls = tables.box_lows, tables.box_highs, tables.centers, tables.balls
    row_offsets, rows = tables.row_offsets, tables.rows
    polygon_offsets, ring_offsets, xs, ys = tables.polygon_offsets, tables.ring_offsets, tables.xs, tables.ys
    voxel_frames, voxel_places = tables.voxel_frames, tables.voxel_places
    u, v, w, offsets, items = grid.u, grid.v, grid.w, grid.offsets, grid.items
    n_bodies = n_beyond = 0
    done = 0
    for item in range(len(points)):
        if flag[0]:
            break
        px, py, pz = float(points[item, 0]), float(points[item, 1]), 0.0 if is_flat else float(points[item, 2])
        entry = last = waiting = 0
        cell = cell_at(px, py, pz, u, v, w)
        if cell >= 0:
            entry, last = offsets[cell], offsets[cell + 1]
        if n_bodies + (last - entry) + len(unbounded) > len(bodies):
            break
        before = n_bodies
        while entry < last or waiting < len(unbounded):  # bound: each turn takes one from one of the lists
            if waiting == len(unbounded) or (entry < last and items[entry] < unbounded[waiting]):
                body = items[entry]
                entry += 1
                is_out = (px < lows[body, 0]) | (px > highs[body, 0])
                is_out |= (py < lows[body, 1]) | (py > highs[body, 1])
                is_out |= (pz < lows[body, 2]) | (pz > highs[body, 2])
                if is_out:
                    continue
            else:
                body = unbounded[waiting]
                waiting += 1
            kind, slot, frame = kinds[body], slots[body], frames[body]
            x, y, z, blur, location = px, py, pz, 0.0, UNDECIDED
            if frame >= 0:
                x, y, z, blur = to_frame(inverses, translations, is_turn, frame, px, py, pz)
            if kind == RINGS:
                first_ring, last_ring = polygon_offsets[slot], polygon_offsets[slot + 1]
                location, is_beyond = locate_in_small_rings(xs, ys, ring_offsets, first_ring, last_ring, x, y, blur)
                n_beyond += is_beyond
            elif kind == VOXELS:
                address, shift = voxel_places[slot, 0], voxel_places[slot, 1]
                location = side_in_voxels(voxel_frames, slot, address, shift, x, y, z, blur)
            elif kind == BOX:
                location = _in_box(box_lows, box_highs, slot, is_flat, x, y, z, blur)
            elif kind == BALL:
                location = _in_ball(centers, balls, slot, px, py, pz)
            elif kind == ROWS:
                location = _in_rows(rows, row_offsets[slot], row_offsets[slot + 1], x, y, z, blur)
            if location == -1:
                continue
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
def group_by_body(bodies: Any, ends: Any, order: Any) -> None:
    """Fill order with the places of `bodies`, grouped by body; ends (n_bodies,) holds each group's first place."""
    for place in range(len(bodies)):
        body = bodies[place]
        order[ends[body]] = place
        ends[body] += 1


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
