"""Each body alone along the line of the nearest pair so far: what of it reaches far enough to be nearer."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.collision.clearance.blocks import DONE, FULL, block_reach, keep_below, measure_blocks, reach_from
from engine.collision.clearance.boxes import MOST_LISTED, Search, View, size_of, way_of
from engine.jit import inline
from engine.lanes.boxes import EMPTY
from engine.lanes.gaps import box_reaches
from engine.lanes.tracing import LANES

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
def _reach(s: Search, view: View, row: int) -> float:
    """Return how far a body reaches along the line toward the other; the block that does is listed first."""
    return _blocks_along(s, view, row, -np.inf, False)[0]


@inline
def approach(s: Search, limits: Any) -> tuple[int, int]:
    """Measure the blocks that reach furthest along the line as long as that brings an upper bound down and turns it.

    Returns CLOSER or DONE, and 0.
    """
    for _ in range(MOST_STEPS):
        before = limits[0]
        reach, their_reach = _reach(s, s.a, 0), _reach(s, s.b, 1)
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
    furthest, theirs = _reach(s, s.a, 0), _reach(s, s.b, 1)
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
