"""The triangles of two blocks: how far they reach along the line, and which pairs of them may be the nearest.

Each body alone is asked too what of it reaches far enough along the line of the nearest pair so far to be nearer.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.collision.clearance.boxes import MOST_LISTED, Search, View, scaled, set_line, size_of, way_of
from engine.collision.clearance.near_triangles import nearest_points, rounding_of, seen_from
from engine.collision.meshes.mesh_arrays import triangle_of
from engine.collision.meshes.placement import placed
from engine.collision.meshes.triangle_triangle import Facet
from engine.jit import inline, merged
from engine.lanes.boxes import EMPTY
from engine.lanes.gaps import box_reaches, near_triangle, place_triangles, triangle_reaches
from engine.lanes.lanes import lowest_bit
from engine.lanes.tracing import LANES
from engine.predicates.vectors import dot
from engine.types import Point3

DONE: Final = 0
FULL: Final = 1
CLOSER: Final = 2
INTERRUPTED: Final = 3
"""How a search ended: with all pairs; without room for more pairs of boxes or triangles; with two points nearer than
asked; by the flag."""
_REACH: Final = 2.0**-18
"""More than what a product of a direction with two vectors of float32, none of them above 2, is off by."""
_ABOVE_ONE: Final = 1.0 + 2.0**-22


@merged
def _triangle(view: View, item: int) -> Facet:
    """Return a placed triangle, rounded, times the unit."""
    t, place, unit = triangle_of(view.mesh, item), view.place, view.unit
    return Facet(scaled(placed(t.p, place), unit), scaled(placed(t.q, place), unit), scaled(placed(t.r, place), unit))


@inline
def _measure(s: Facet, t: Facet, error: float, most: float) -> tuple[float, float, Point3, tuple[int, int]]:
    """Return bounds on the distance of two triangles, from below and above, and direction and features of nearly
    nearest points; of any where the lower bound is above `most`.

    error: bound on the distance of a point from its rounded one, both bodies together.
    """
    origin = s.p
    s, t = seen_from(origin, s), seen_from(origin, t)
    slack = rounding_of(s, t) + error
    best, across = nearest_points(s, t, most + slack)
    return max(across.low - slack, 0.0), across.size + slack, across.way, (best.first, best.second)


@inline
def keep_below(found: Any, n: int, most: float) -> int:
    """Leave out the candidates above the bound; return how many there are."""
    n_kept = 0
    for item in range(n):
        if found.bounds[item] <= most:
            found.bounds[n_kept] = found.bounds[item]
            for column in range(4):
                found.pairs[n_kept, column] = found.pairs[item, column]
            n_kept += 1
    return n_kept


@merged
def reach_from(s: Search, view: View, row: int) -> float:
    """Return how far the origin of a body's tree reaches along the line toward the other body, rounding left out."""
    line, o, unit = s.room.line, view.mesh.origin, view.unit
    d = Point3(line[3 * row], line[3 * row + 1], line[3 * row + 2])
    return (1.0 - 2.0 * row) * (dot(d, scaled(Point3(o[0], o[1], o[2]), unit)) + line[9 + row]) + _REACH * size_of(view)


@merged
def block_reach(s: Search, view: View, row: int, node: int) -> float:
    """Return how far the triangles of a block reach along the line, toward the other body; kept until that turns."""
    kept, sign = s.room.kept[node], 1.0 - 2.0 * row
    if kept[2 * row] != s.room.line[11]:
        triangle_reaches(view.mesh.blocks, node, way_of(s.room.line, row, sign), s.room.work)
        kept[2 * row] = s.room.line[11]
        most = _most_of_block(view.mesh.child, node, s.room.work)
        kept[2 * row + 1] = sign * (reach_from(s, view, row) + most * size_of(view))
    return float(kept[2 * row + 1])


@inline
def _most_of_block(child: Any, node: int, work: Any) -> float:
    """Return the largest number in the first row of work in a lane with a triangle."""
    most = np.float64(work[0, 0])
    for lane in range(1, LANES):
        if child[node, lane] == EMPTY:
            break
        most = max(most, np.float64(work[0, lane]))
    return most


@merged
def measure_blocks(s: Search, i: int, j: int, n_found: int, limits: Any) -> tuple[int, int]:
    """Add the pairs of triangles of two blocks that may be the nearest; return how that ended, and their number.

    limits: as in `find_nearest`; the first falls.
    """
    line, frames, work, found = s.room.line, s.room.frames, s.room.work, s.room.found
    way, per_size = way_of(line, 0, 1.0), _ABOVE_ONE / size_of(s.a)
    place_triangles(s.b.mesh.blocks, j, frames, way, work)
    for k in range(LANES):
        own = int(s.a.mesh.child[i, k])
        if own == EMPTY:
            break
        bits = near_triangle(s.a.mesh.blocks, i, k, frames, way, limits[0] * per_size, work)
        t = _triangle(s.a, -1 - own)
        while bits != 0:  # bound: each turn takes a bit
            their = int(s.b.mesh.child[j, lowest_bit(bits)])
            bits &= bits - 1
            if their == EMPTY:
                break
            low, high, d, features = _measure(t, _triangle(s.b, -1 - their), s.error, limits[0])
            if high < limits[1]:
                return CLOSER, 0
            if high < limits[0]:
                limits[0] = high
                set_line(line, s.a, s.b, d)
            if low > limits[0]:
                continue
            if n_found == len(found.bounds):
                n_found = keep_below(found, n_found, limits[0])
                if 2 * n_found > len(found.bounds):
                    return FULL, 0
            found.bounds[n_found] = low
            found.pairs[n_found, 0], found.pairs[n_found, 1] = -1 - own, -1 - their
            found.pairs[n_found, 2], found.pairs[n_found, 3] = features
            n_found += 1
    return DONE, n_found


MOST_STEPS: Final = 8
"""Of the first approach."""


@inline
def _blocks_along(s: Search, view: View, row: int, least: float, is_listed: bool) -> tuple[float, int]:
    """List the blocks of a body that reach so far along the line toward the other body, and return `least` and their
    number, above MOST_LISTED for too many; or return how far the body reaches, and the block that does."""
    child, waiting, bounds, sign = view.mesh.child, s.room.waiting, s.room.waiting_bounds, 1.0 - 2.0 * row
    start, size, work = reach_from(s, view, row) + s.margin, size_of(view), s.room.work
    waiting[0], bounds[0], n, found = 0, np.inf, 1, 0
    while n > 0 and found <= MOST_LISTED:  # bound: each node enters once
        n -= 1
        node = int(waiting[n])
        if bounds[n] < least:
            continue
        if child[node, 0] < 0:
            reach = sign * block_reach(s, view, row, node)
            if reach >= least and is_listed:
                s.room.listed[row, min(found, MOST_LISTED - 1)] = node
                found += 1
            elif reach > least:
                least, s.room.listed[row, 0] = reach, node
            continue
        box_reaches(view.mesh.boxes, node, way_of(s.room.line, row, sign), work)
        for lane in range(LANES):
            if child[node, lane] == EMPTY:
                continue
            bound, place = start + size * np.float64(work[0, lane]), n
            while place > 0 and n - place < lane and bounds[place - 1] > bound:  # order: of a node, the furthest last
                waiting[place], bounds[place] = waiting[place - 1], bounds[place - 1]
                place -= 1
            waiting[place], bounds[place] = child[node, lane], bound
            n += 1
    return least, found


@inline
def approach(s: Search, limits: Any) -> tuple[int, int]:
    """Measure the blocks that reach furthest along the line as long as that brings an upper bound down and turns it.

    Returns CLOSER or DONE, and 0.
    """
    for _ in range(MOST_STEPS):
        before = limits[0]
        (reach, _), (their_reach, _) = (
            _blocks_along(s, s.a, 0, -np.inf, False),
            _blocks_along(s, s.b, 1, -np.inf, False),
        )
        if -their_reach - reach - s.margin > limits[0]:
            return DONE, 0
        i, j = int(s.room.listed[0, 0]), int(s.room.listed[1, 0])
        how, _ = measure_blocks(s, i, j, 0, limits)
        if how != DONE or not limits[0] < before:
            return how, 0
    return DONE, 0


@inline
def finish_along_line(s: Search, limits: Any) -> tuple[int, int]:
    """Measure all pairs of blocks that may be nearer than the least upper bound, where few reach so far along the line.

    Bodies that bulge toward each other have few: this looks at each body alone, not at pairs of boxes. Returns FULL
    and -1 where they are many, and there is nothing gained; FULL and 0 where what was found before is lost.
    """
    margin = s.margin
    (furthest, _), (theirs, _) = _blocks_along(s, s.a, 0, -np.inf, False), _blocks_along(s, s.b, 1, -np.inf, False)
    _, n_first = _blocks_along(s, s.a, 0, -theirs - limits[0] - 2.0 * margin, True)
    if n_first > MOST_LISTED:
        return FULL, -1
    _, n_second = _blocks_along(s, s.b, 1, -furthest - limits[0] - 2.0 * margin, True)
    if n_second > MOST_LISTED:
        return FULL, -1
    n_found = 0
    for k in range(n_first):
        for m in range(n_second):
            i, j = int(s.room.listed[0, k]), int(s.room.listed[1, m])
            if block_reach(s, s.b, 1, j) - block_reach(s, s.a, 0, i) - margin > limits[0]:
                continue
            how, n_found = measure_blocks(s, i, j, n_found, limits)
            if how != DONE:
                return how, 0
    return DONE, keep_below(s.room.found, n_found, limits[0])
