"""Polygon by cells: each cell of a grid has a reference point of known side; a point's side is the parity from there.

An edge is listed in every cell that its box reaches into (grid.py, conservative by monotone steps), and the segment
from a cell's reference point R to a point q of the cell stays in the cell: only the listed edges can cross it. Such
an edge a, b does if a and b lie on different sides of R q, and R and q on different sides of a b. Four signs from the
float filter decide; where one of them is not sure, the point goes to the exact ray (ring_crossing.py).

The sides are found row by row: the segment between the reference points of two neighbours stays in the two cells.
Where a sign of that is not sure, and at the head of each row, the exact ray is asked.
"""

from __future__ import annotations

from typing import Any

from engine.bounding.grid import cell_of
from engine.jit import inline, kernel
from engine.predicates.loading import as_point2
from engine.predicates.orientation import orient2d_filter
from engine.types import UNDECIDED, Point2


@inline
def segment_crosses(a: Any, b: Any, r: Any, q: Any) -> int:
    """Return 1 if the segments a b and r q surely cross, 0 if they surely do not touch, else UNDECIDED."""
    of_q = orient2d_filter(a, b, q)
    of_r = orient2d_filter(a, b, r)
    if of_q == of_r and of_q != UNDECIDED:
        return 0
    of_a = orient2d_filter(r, q, a)
    of_b = orient2d_filter(r, q, b)
    if of_a == of_b and of_a != UNDECIDED:
        return 0
    if of_q == UNDECIDED or of_r == UNDECIDED or of_a == UNDECIDED or of_b == UNDECIDED:
        return UNDECIDED
    return 1


@kernel
def walk_rows(starts: Any, ends: Any, grid: Any, columns: Any, rows: Any, heads: Any, sides: Any, flag: Any) -> None:
    """Fill sides (n_cells,) int8 with the side of each cell's reference point, 0 where it is not known.

    columns, rows: coordinates of the reference points, NaN where one is not in its cell.
    heads: (n_cells,) int8 sides known by the exact ray, 0 for the others.
    """
    nx = grid.u.n_cells
    for row in range(grid.v.n_cells):
        if flag[0]:
            break
        for column in range(nx):
            cell = row * nx + column
            side = heads[cell]
            if side == 0 and column > 0:
                side = sides[cell - 1]
                r, q = Point2(columns[column - 1], rows[row]), Point2(columns[column], rows[row])
                for both in range(2):
                    for entry in range(grid.offsets[cell - 1 + both], grid.offsets[cell + both]):
                        edge = grid.items[entry]
                        a, b = as_point2(starts, edge), as_point2(ends, edge)
                        if both == 1:
                            first = cell_of(min(a.x, b.x), grid.u.low, grid.u.cells_per_unit, nx)
                            if first < column:  # listed in the cell before as well
                                continue
                        crossed = segment_crosses(a, b, r, q)
                        if crossed == UNDECIDED:
                            side = 0
                        elif crossed == 1:
                            side = -side
            sides[cell] = side


@kernel
def locate_by_ring_cells(points: Any, ring_cells: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 2) from a `RingCells`; returns how many are left UNDECIDED."""
    starts, ends, grid, sides = ring_cells.starts, ring_cells.ends, ring_cells.grid, ring_cells.sides
    columns, rows, u, v = ring_cells.columns, ring_cells.rows, ring_cells.grid.u, ring_cells.grid.v
    offsets, items = grid.offsets, grid.items
    n_open = 0
    for item in range(len(points)):
        if item & 1023 == 0 and flag[0]:
            break
        q = as_point2(points, item)
        if (q.x < u.low) | (q.x > u.high) | (q.y < v.low) | (q.y > v.high):
            locations[item] = -1
            continue
        column = cell_of(q.x, u.low, u.cells_per_unit, u.n_cells)
        row = cell_of(q.y, v.low, v.cells_per_unit, v.n_cells)
        cell = row * u.n_cells + column
        side = sides[cell]
        if side == 0:
            side = UNDECIDED
        elif offsets[cell] != offsets[cell + 1]:
            r = Point2(columns[column], rows[row])
            for entry in range(offsets[cell], offsets[cell + 1]):
                edge = items[entry]
                crossed = segment_crosses(as_point2(starts, edge), as_point2(ends, edge), r, q)
                if crossed == UNDECIDED:
                    side = UNDECIDED
                    break
                if crossed == 1:
                    side = -side
        locations[item] = side
        n_open += side == UNDECIDED
    return n_open
