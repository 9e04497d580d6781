"""Compiled: sides of vertices, faces that a plane leaves whole, where edges cross it, faces that are certainly apart.

Cut points are double-doubles. With weights w = |value of the plane| at both ends p and q, each known to b,

    t = w_p / (w_p + w_q)     error: below 1.01 (b_p + b_q) / (w_p + w_q)
    x = p + t (q - p)         error: |q - p| that of t, and `POINT_BOUND` (cut_point.py)

and the double nearest to x is certain where the bound says so; the caller computes the others in integers.

Faces are apart where a plane of one has all other corners of the other strictly on one side; of two that share an edge
the far corner is enough. The filter of orient3d decides (S. Gottschalk, Separating axis theorem, 1996).
"""

from __future__ import annotations

from engine.compiling.jit import inline, kernel
from engine.predicates.cut_point import POINT_BOUND, TINY, point_along
from engine.predicates.error_free import U2, dd_add, dd_div, dd_mul, dd_sub, fast_two_sum, is_correctly_rounded
from engine.predicates.orientation import orient3d_filter
from engine.predicates.side import dd_value, side_of_plane, side_of_plane_filter
from engine.predicates.vectors import as_point3, corners_of, minus
from engine.types import UNDECIDED, BoolArray, FlagArray, FloatArray, HalfSpace3, Int8Array, IntArray

_POLL = 0x3FFF


@kernel
def find_sides(vertices: FloatArray, row: FloatArray, is_exact: bool, sides: Int8Array, flag: FlagArray) -> int:
    """Fill sides (n,) with the sign of plane `row` (4,) at each vertex (n, 3), positive inside; return how many stay
    UNDECIDED. is_exact: the row is not rounded."""
    plane, n_open = HalfSpace3(row[0], row[1], row[2], row[3]), 0
    for vertex in range(vertices.shape[0]):
        if vertex & _POLL == 0 and flag[0] != 0:
            return 0
        point = as_point3(vertices, vertex)
        side = side_of_plane_filter(plane, point)
        if side == UNDECIDED:
            if is_exact:
                side = side_of_plane(plane, point)
            n_open += side == UNDECIDED
        sides[vertex] = side
    return n_open


@kernel
def split_faces(triangles: IntArray, sides: Int8Array, whole: IntArray, mixed: IntArray, flag: FlagArray) -> int:
    """Write the numbers of the triangles with three corners on side 1 to `whole`, of those with one or two to `mixed`;
    return n_whole << 32 | n_mixed."""
    n_whole, n_mixed = 0, 0
    for item in range(triangles.shape[0]):
        if item & _POLL == 0 and flag[0] != 0:
            break
        count = (
            int(sides[triangles[item, 0]] > 0) + int(sides[triangles[item, 1]] > 0) + int(sides[triangles[item, 2]] > 0)
        )
        whole[n_whole] = item
        mixed[n_mixed] = item
        n_whole += count == 3
        n_mixed += count == 1 or count == 2
    return n_whole << 32 | n_mixed


@kernel
def cut_edges(
    vertices: FloatArray, edges: IntArray, rows: FloatArray, which: IntArray, high: FloatArray, low: FloatArray,
    is_nearest: BoolArray,
) -> None:  # fmt: skip
    """Fill high and low (n, 3) with the crossings of edges (n, 2) of vertices and planes: edge k with row which[k] of
    `rows` (m, 4); high + low is a double-double, good to 2^-84. is_nearest (n,): whether all three numbers of high are
    certainly the nearest doubles."""
    for item in range(edges.shape[0]):
        p, q = edges[item, 0], edges[item, 1]
        row = rows[which[item]]
        ph, pl, p_bound = dd_value(row[0], row[1], row[2], row[3], as_point3(vertices, p))
        qh, ql, q_bound = dd_value(row[0], row[1], row[2], row[3], as_point3(vertices, q))
        if ph < 0.0:
            ph, pl, qh, ql = -ph, -pl, -qh, -ql
        sum_h, sum_l = dd_add(ph, pl, -qh, -ql)
        th, tl = dd_div(ph, pl, sum_h, sum_l)
        t_error = 1.01 * (p_bound + q_bound) / sum_h + 24.0 * U2 * th
        is_sure = True
        for k in range(3):
            x, y = vertices[p, k], vertices[q, k]
            sh, sl, mh, dh = point_along(x, y, th, tl)
            h, rest = fast_two_sum(sh, sl)
            bound = 1.01 * t_error * abs(dh) + POINT_BOUND * (abs(x) + abs(mh)) + TINY
            if x == y:
                h, rest, bound = x, 0.0, 0.0
            is_sure = is_sure and is_correctly_rounded(h, rest, bound) and bound <= 2.0**-84 * (abs(x) + abs(y))
            high[item, k], low[item, k] = h + 0.0, rest
        is_nearest[item] = is_sure


@kernel
def find_turned(
    high: FloatArray, low: FloatArray, size: float, triangles: IntArray, axes: IntArray, is_open: BoolArray
) -> None:
    """Fill is_open (n,): whether triangle k of points high + low, projected on axes[k], is not proven to be
    counter-clockwise. size: bound on coordinates, which are known to 2^-84 of it.

    Differences are off by 2^-83 of that and 4 u^2; products and their difference add 20 u^2."""
    i, j, off = axes[0], axes[1], 2.0**-82 * size
    for item in range(triangles.shape[0]):
        a, b, c = triangles[item, 0], triangles[item, 1], triangles[item, 2]
        uh, ul = dd_add(high[b, i], low[b, i], -high[a, i], -low[a, i])
        vh, vl = dd_add(high[c, j], low[c, j], -high[a, j], -low[a, j])
        sh, sl = dd_add(high[b, j], low[b, j], -high[a, j], -low[a, j])
        th, tl = dd_add(high[c, i], low[c, i], -high[a, i], -low[a, i])
        ph, pl = dd_mul(uh, ul, vh, vl)
        qh, ql = dd_mul(sh, sl, th, tl)
        gap, _ = dd_sub(ph, pl, qh, ql)
        bound = 1.01 * off * (abs(uh) + abs(vh) + abs(sh) + abs(th) + off) + 2.0**-98 * (abs(ph) + abs(qh)) + TINY
        is_open[item] = not gap > bound


@kernel
def turn_rings(points: FloatArray, i: int, j: int, ends: IntArray, firsts: IntArray, signs: Int8Array) -> None:
    """Fill firsts with the leftmost point of each ring, seen on axes i and j, the lowest of these; and signs with that
    of its area, 0 where rounding may have changed it. points: those of all rings, up to `ends`.

    Differences are off by u of the largest coordinates, products and sums of n by n 2^-50 of the span squared.
    """
    start = 0
    for ring in range(ends.shape[0]):
        stop, size, span, area = ends[ring], 0.0, 0.0, 0.0
        first = stop - 1
        x0, y0 = points[start, i], points[start, j]
        for k in range(start, stop):
            after = k + 1 if k + 1 < stop else start
            x, y = points[k, i], points[k, j]
            if x < points[first, i] or (x == points[first, i] and y < points[first, j]):
                first = k
            size = max(size, abs(x), abs(y))
            span = max(span, abs(x - x0), abs(y - y0))
            area += (x - x0) * (points[after, j] - y0) - (points[after, i] - x0) * (y - y0)
        bound = (stop - start) * 2.0**-49 * (span * size + span * span) + 2.0**-1000
        firsts[ring], signs[ring] = first, 1 if area > bound else -1 if -area > bound else 0
        start = stop


@kernel
def find_shapes(
    vertices: FloatArray, faces: IntArray, corners: FloatArray, origins: IntArray, rows: FloatArray, shapes: Int8Array
) -> None:
    """Fill shapes (n,) with 1 for rounded triangles (n, 3, 3) that look as the faces that they are parts of, or against
    the plane -1 - origin of `rows`, seen along the axis on which that normal is largest; -1 for the others, UNDECIDED
    where rounding may have changed a sign. Products of differences are off by 4 u of the factors' sizes, cancelled or
    not."""
    for item in range(corners.shape[0]):
        origin, sizes = origins[item], 0.0
        n = (-rows[-1 - origin, 0], -rows[-1 - origin, 1], -rows[-1 - origin, 2]) if origin < 0 else (0.0, 0.0, 0.0)
        if origin >= 0:
            a, b, c = corners_of(vertices, faces, origin)
            u, v = minus(b, a), minus(c, a)
            n = (u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x)
            sizes = max(abs(u.x), abs(u.y), abs(u.z)) * max(abs(v.x), abs(v.y), abs(v.z))
        axis = 0
        for k in range(1, 3):
            axis = k if abs(n[k]) > abs(n[axis]) else axis
        i, j = (axis + 1) % 3, (axis + 2) % 3
        left = (corners[item, 1, i] - corners[item, 0, i]) * (corners[item, 2, j] - corners[item, 0, j])
        right = (corners[item, 1, j] - corners[item, 0, j]) * (corners[item, 2, i] - corners[item, 0, i])
        turn = left - right if n[axis] > 0.0 else right - left
        is_sure = abs(n[axis]) > 2.0**-48 * sizes + TINY and abs(turn) > 2.0**-50 * (abs(left) + abs(right)) + TINY
        shapes[item] = UNDECIDED if not is_sure else 1 if turn > 0.0 else -1


@inline
def _is_beside(points: FloatArray, faces: IntArray, face: int, other: int) -> bool:
    """Return whether all corners of face `other` that are not corners of `face` lie strictly on one side of the plane
    of `face`."""
    a, b, c = corners_of(points, faces, face)
    side = 0
    for k in range(3):
        corner = faces[other, k]
        if corner != faces[face, 0] and corner != faces[face, 1] and corner != faces[face, 2]:
            sign = orient3d_filter(a, b, c, as_point3(points, corner))
            if sign == UNDECIDED or (side != 0 and sign != side):
                return False
            side = sign
    return side != 0


@kernel
def find_candidates(points: FloatArray, faces: IntArray, pairs: IntArray, n_common: Int8Array) -> None:
    """Fill n_common (n,) with how many corners pairs (n, 2) of faces have in common that may meet elsewhere too, -1 for
    the others."""
    for item in range(pairs.shape[0]):
        first, second, count = pairs[item, 0], pairs[item, 1], 0
        if _is_beside(points, faces, first, second) or _is_beside(points, faces, second, first):
            n_common[item] = -1
            continue
        for k in range(3):
            for j in range(3):
                count += faces[first, k] == faces[second, j]
        n_common[item] = count
