"""Each body alone along the line of the nearest pair so far: what of it reaches far enough to be nearer."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.collision.clearance.blocks import DONE, FULL, block_reach, keep_below, measure_blocks, reach_from
from engine.collision.clearance.boxes import MOST_LISTED, Search, View, size_of, way_of
from engine.jit import inline, merged
from engine.lanes.boxes import EMPTY
from engine.lanes.gaps import box_reaches
from engine.lanes.tracing import LANES

MOST_STEPS: Final = 8
"""Of the first approach."""


@merged
def _set_reaches(s: Search, view: View, row: int, node: int) -> tuple[float, float]:
    """Write how far the boxes of a node reach along the line toward the other body to the first row of work: times the
    second number, plus the first."""
    box_reaches(view.mesh.boxes, node, way_of(s.room.line, row, 1.0 - 2.0 * row), s.room.work)
    return reach_from(s, view, row) + s.margin, size_of(view)


@merged
def _furthest(s: Search, view: View, row: int) -> tuple[float, int]:
    """Return how far a body reaches along the line toward the other, and the block that does."""
    child, waiting, bounds, sign = view.mesh.child, s.room.waiting, s.room.waiting_bounds, (1.0 if row == 0 else -1.0)
    waiting[0], bounds[0], n, best, found = 0, np.inf, 1, -np.inf, 0
    while n > 0:  # bound: each node enters once
        n -= 1
        node = int(waiting[n])
        if bounds[n] <= best:
            continue
        if child[node, 0] < 0:
            reach = sign * block_reach(s, view, row, node)
            if reach > best:
                best, found = reach, node
            continue
        start, size = _set_reaches(s, view, row, node)
        for lane in range(LANES):
            if child[node, lane] == EMPTY:
                continue
            bound, place = start + size * float(s.room.work[0, lane]), n
            while place > 0 and n - place < lane and bounds[place - 1] > bound:  # order: of a node, the furthest last
                waiting[place], bounds[place] = waiting[place - 1], bounds[place - 1]
                place -= 1
            waiting[place], bounds[place] = child[node, lane], bound
            n += 1
    return best, found


@inline
def approach(s: Search, limits: Any) -> tuple[int, int]:
    """Measure the blocks that reach furthest along the line as long as that brings an upper bound down and turns it.

    Returns CLOSER or DONE, and 0.
    """
    for _ in range(MOST_STEPS):
        before = limits[0]
        (reach, i), (their_reach, j) = _furthest(s, s.a, 0), _furthest(s, s.b, 1)
        if -their_reach - reach - s.margin > limits[0]:
            return DONE, 0
        how, _ = measure_blocks(s, i, j, 0, limits)
        if how != DONE or not limits[0] < before:
            return how, 0
    return DONE, 0


@merged
def _list_blocks(s: Search, view: View, row: int, least: float) -> int:
    """List the blocks that reach so far toward the other body; return their number, above MOST_LISTED for too many."""
    child, waiting, sign = view.mesh.child, s.room.waiting, (1.0 if row == 0 else -1.0)
    waiting[0], n, n_listed = 0, 1, 0
    while n > 0 and n_listed <= MOST_LISTED:  # bound: each node enters once
        n -= 1
        node = int(waiting[n])
        if child[node, 0] < 0:
            if sign * block_reach(s, view, row, node) >= least:
                if n_listed < MOST_LISTED:
                    s.room.listed[row, n_listed] = node
                n_listed += 1
            continue
        start, size = _set_reaches(s, view, row, node)
        for lane in range(LANES):
            if child[node, lane] != EMPTY and start + size * float(s.room.work[0, lane]) >= least:
                waiting[n] = child[node, lane]
                n += 1
    return n_listed


@inline
def finish_along_line(s: Search, limits: Any) -> tuple[int, int]:
    """Measure all pairs of blocks that may be nearer than the least upper bound, where few reach so far along the line.

    Bodies that bulge toward each other have few: this looks at each body alone, not at pairs of boxes. Returns FULL
    where they are many, and there is nothing gained.
    """
    margin = s.margin
    (furthest, _), (theirs, _) = _furthest(s, s.a, 0), _furthest(s, s.b, 1)
    n_first = _list_blocks(s, s.a, 0, -theirs - limits[0] - 2.0 * margin)
    if n_first > MOST_LISTED:
        return FULL, 0
    n_second = _list_blocks(s, s.b, 1, -furthest - limits[0] - 2.0 * margin)
    if n_second > MOST_LISTED:
        return FULL, 0
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
