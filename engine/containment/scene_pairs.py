"""Broad phase of a scene: which points lie in which boxes, through a grid of boxes, point by point in ascending order.

Bodies without bounds are candidates for every point; each point's list is the merge of two ascending lists.
"""

from __future__ import annotations

from typing import Any

from engine.bounding.grid import cell_of
from engine.jit import inline, kernel


@inline
def _is_in(points: Any, item: int, lows: Any, highs: Any, box: int) -> bool:
    for axis in range(points.shape[1]):
        if points[item, axis] < lows[box, axis] or points[item, axis] > highs[box, axis]:
            return False
    return True


@inline
def _cell(points: Any, item: int, u: Any, v: Any) -> int:
    """Return the cell of a point, -1 beside the grid."""
    x, y = points[item, 0], points[item, 1]
    if x < u.low or x > u.high or y < v.low or y > v.high:
        return -1
    return cell_of(y, v.low, v.cells_per_unit, v.n_cells) * u.n_cells + cell_of(x, u.low, u.cells_per_unit, u.n_cells)


@kernel
def count_candidates(points: Any, lows: Any, highs: Any, grid: Any, counts: Any, flag: Any) -> None:
    """Fill counts (n,) int64 with how many bounded boxes (m, dim) hold each point (n, dim)."""
    for item in range(len(points)):
        if flag[0]:
            break
        n_held = 0
        cell = _cell(points, item, grid.u, grid.v)
        if cell >= 0:
            for entry in range(grid.offsets[cell], grid.offsets[cell + 1]):
                n_held += _is_in(points, item, lows, highs, grid.items[entry])
        counts[item] = n_held


@kernel
def list_candidates(
    points: Any,
    lows: Any,
    highs: Any,
    grid: Any,
    bounded: Any,
    unbounded: Any,
    firsts: Any,
    owners: Any,
    bodies: Any,
    flag: Any,
) -> None:
    """Fill owners and bodies, int64, from firsts[item] on, with the candidates of each point, bodies ascending.

    bounded: (m,) the body of each box; unbounded: bodies without a box; both ascending.
    """
    for item in range(len(points)):
        if flag[0]:
            break
        place, waiting = firsts[item], 0
        cell = _cell(points, item, grid.u, grid.v)
        if cell >= 0:
            for entry in range(grid.offsets[cell], grid.offsets[cell + 1]):
                box = grid.items[entry]
                if _is_in(points, item, lows, highs, box):
                    while waiting < len(unbounded) and unbounded[waiting] < bounded[box]:  # bound: the list's length
                        owners[place], bodies[place] = item, unbounded[waiting]
                        place, waiting = place + 1, waiting + 1
                    owners[place], bodies[place] = item, bounded[box]
                    place += 1
        for rest in range(waiting, len(unbounded)):
            owners[place], bodies[place] = item, unbounded[rest]
            place += 1


@kernel
def group_by_body(bodies: Any, ends: Any, order: Any) -> None:
    """Fill order with the places of `bodies`, grouped by body; ends (n_bodies,) holds each group's first place."""
    for place in range(len(bodies)):
        body = bodies[place]
        order[ends[body]] = place
        ends[body] += 1
