"""The pieces of segments on a box: the points and parameters at which planes cut them, correctly rounded: 2D and 3D.

Both ends of a block of pieces are made at once, cut or not, without branches: see cohen_sutherland.py, which decides
between which planes each piece lies. Where t as a double-double leaves a number unsure, all of the end is made again
from exact differences (cut_point.py).
"""

from __future__ import annotations

from typing import Any

from engine.jit import called, kernel, merged
from engine.predicates.cut_point import point_at
from engine.predicates.error_free import workspace
from engine.segment_clipping.cohen_sutherland import corners_of
from engine.segment_clipping.pieces import BLOCK, Pieces, Triple, point_of, put_end
from engine.segment_clipping.plane_meeting import LONGEST, SHORTEST, T_BOUND, meeting
from engine.segment_clipping.planes_cut import cut_by_signs


@merged
def cut_end(
    p: Triple, q: Triple, lowest: Triple, highest: Triple, plane: float, end: float
) -> tuple[float, float, float, float, bool]:
    """Return where p q meets a plane, t there, and whether all is sure; for plane -1 the end of p q, 0 or 1."""
    (px, py, pz), (qx, qy, qz), (x0, y0, z0), (x1, y1, z1) = p, q, lowest, highest
    is_x, is_y, is_z = plane < 1.5, (plane > 1.5) & (plane < 3.5), plane > 3.5
    is_high = (plane == 1.0) | (plane == 3.0) | (plane == 5.0)
    low, high = (x0 if is_x else (y0 if is_y else z0)), (x1 if is_x else (y1 if is_y else z1))
    at = high if is_high else low
    m = meeting(px if is_x else (py if is_y else pz), qx if is_x else (qy if is_y else qz), at, plane)
    length, bound = abs(m.d), T_BOUND * m.t
    x, x_sure = point_at(px, qx, m.t, m.t_low, 0.0)
    y, y_sure = point_at(py, qy, m.t, m.t_low, 0.0)
    z, z_sure = point_at(pz, qz, m.t, m.t_low, 0.0)
    is_start = m.n == 0.0  # p lies on the plane: t = 0 and p itself
    sure = ((abs(m.n) >= 2.0**-500) | is_start) & (length >= SHORTEST) & (length <= LONGEST)
    sure = sure & (m.t + (m.t_low - bound) == m.t + (m.t_low + bound))
    sure = sure & (x_sure | is_x | is_start) & (y_sure | is_y | is_start) & (z_sure | is_z | is_start)
    x, y, z, t = (at if is_x else x), (at if is_y else y), (at if is_z else z), m.t + m.t_low
    is_own, is_first = plane < 0.0, end == 0.0
    x, y, z = (
        (x if not is_own else px if is_first else qx),
        (y if not is_own else py if is_first else qy),
        (z if not is_own else pz if is_first else qz),
    )
    return x + 0.0, y + 0.0, z + 0.0, (end if is_own else t + 0.0), sure | is_own


@called
def cut_again(
    segments: Any, low: Any, high: Any, columns: Any, row: int, unsure: int, pieces: Pieces
) -> bool:  # fmt: skip
    """Make those ends of a piece again whose bit of `unsure` is set, by exact signs; return whether all is sure."""
    all_sure = True
    for end in range(2):
        if unsure >> end & 1 == 1:
            segment, point, plane = segments[pieces.source[row]], pieces.ends[end, row], pieces.faces[row, end]
            at = high[plane >> 1] if plane & 1 else low[plane >> 1]
            pieces.t[row, end], is_sure = cut_by_signs(columns[:-2, plane], segment, point, plane >> 1, at)
            all_sure = all_sure and is_sure
    return all_sure


@kernel
def fill_on_boxes(
    segments: Any, low: Any, high: Any, columns: Any, items: Any, planes: Any, begin: int, size: int, stop: Any,
    pieces: Pieces, still: Any, n: Any,
) -> None:  # fmt: skip
    """Fill the pieces, from row `begin` on, of the first `size` items, ``segments`` ((n, 2, dim) float64) on a box.

    items: (m,) int32, planes: (m, 2) int32, as decided on the box `low`, `high`; columns: of its rows.
    still: the rows that are not surely rounded. n: how many of them, and how many needed more than the first try.
    stop: one uint8, polled.
    """
    is_flat = low.size == 2
    lowest, highest = corners_of(low, high)
    px, py, pz, qx, qy, qz, entered, left, t0, t1, unsure = (
        workspace(64), workspace(64), workspace(64), workspace(64), workspace(64), workspace(64),
        workspace(64), workspace(64), workspace(64), workspace(64), workspace(64),
    )  # fmt: skip
    n_open = beyond = 0
    for start in range(0, size, BLOCK):
        if stop[0]:
            return
        n_here = min(BLOCK, size - start)
        n_lanes = (n_here + 7) >> 3 << 3  # whole vectors
        for j in range(n_lanes):
            place = min(start + j, size - 1)
            px[j], py[j], pz[j] = point_of(segments, items[place], 0, is_flat)
            qx[j], qy[j], qz[j] = point_of(segments, items[place], 1, is_flat)
            entered[j], left[j] = planes[place, 0], planes[place, 1]
        for j in range(n_lanes):
            p, q = (px[j], py[j], pz[j]), (qx[j], qy[j], qz[j])
            px[j], py[j], pz[j], t0[j], p_sure = cut_end(p, q, lowest, highest, entered[j], 0.0)
            qx[j], qy[j], qz[j], t1[j], q_sure = cut_end(p, q, lowest, highest, left[j], 1.0)
            unsure[j] = (0.0 if p_sure else 1.0) + (0.0 if q_sure else 2.0)
        for j in range(n_here):
            row, place = begin + start + j, start + j
            pieces.source[row] = items[place]
            pieces.faces[row, 0], pieces.faces[row, 1] = planes[place, 0], planes[place, 1]
            pieces.t[row, 0], pieces.t[row, 1] = t0[j], t1[j]
            put_end(pieces, row, 0, (px[j], py[j], pz[j]), is_flat)
            put_end(pieces, row, 1, (qx[j], qy[j], qz[j]), is_flat)
        for j in range(n_here):
            if unsure[j] != 0.0:
                beyond += 1
                if not cut_again(segments, low, high, columns, begin + start + j, int(unsure[j]), pieces):
                    still[n_open] = begin + start + j
                    n_open += 1
    n[0], n[1] = n_open, beyond
