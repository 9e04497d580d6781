"""Segments on posed bodies, compiled: parameters are those of the segment in the body's own frame.

A pose x -> R x + t with det R > 0 keeps parameters and all orientation signs. With M = R^-1 as double-doubles and the
exact differences p - t and q - p,

    p' = M (p - t),    e' = M (q - p),    a plane's values s(p') and s(p') + n . e' at the ends

in double-doubles with running bounds (u = 2^-53): an entry of M carries u^2, its product 5 u^2, two sums 3 u^2 each, so
a coordinate of p' is within 32 u^2 sum |p - t|, and one of e' likewise; entries of M are below 1.01. A ball stays in
the world, about the image of its centre. What a bound leaves open (a sign, the order of two parameters, a coordinate
that may round either way) makes the segment OPEN.

On meshes doubles of p' and p' + e', off by `blur` at most, find the triangles. The filter of triangle_contact.py gets
room for that: with S the largest coordinate seen from p', L = |E_x| + |E_y| + |E_z|, and blur below 2^-20 S, the edges
move by less than 16 blur S (S + L), the ends by less than 64 blur S (S + L).
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from engine.bounding.bvh import MAX_DEPTH, WIDTH
from engine.jit import inline, kernel
from engine.lanes.boxes import EMPTY, near_segment
from engine.lanes.lanes import lowest_bit
from engine.predicates.cut_point import point_at
from engine.predicates.double_double import U2, dd_add, dd_div, dd_mul, dd_scale, dd_sub
from engine.predicates.error_free import fma, two_diff, two_prod, two_sum
from engine.segment_clipping.boundary_cut import SETTLED, crossings_for, emit, sort_crossings
from engine.segment_clipping.contacts import APART, PROPER
from engine.segment_clipping.crossing_values import VALUE_BOUND, is_item_safe, minor, product
from engine.segment_clipping.mesh_contacts import local_segment
from engine.segment_clipping.pieces import Pieces, point_of, put_own_end
from engine.segment_clipping.plane_meeting import T_BOUND
from engine.segment_clipping.triangle_contact import EDGE_BOUND, END_BOUND, UNDERFLOW, corner
from engine.types import OPEN, UNDECIDED, Point3

_FRAME_BOUND: Final = 32.0 * U2
_DEEPEST: Final = WIDTH * (MAX_DEPTH + 1)
"""Nodes that wait: eight for each level of a tree."""
MOST_MET: Final = 512
"""Triangles that a segment meets; with more it is OPEN."""

Pair = tuple[float, float]
Vector = tuple[Pair, Pair, Pair]


class Frame(NamedTuple):
    """A pose as kernels read it, double-doubles of its inverse (3, 3, 2) and t (3,); those of the plane with z = z."""

    inverse: Any
    shift: Any


@inline
def _row(m: Any, i: int, v: Vector) -> Pair:
    ah, al = dd_mul(m[i, 0, 0], m[i, 0, 1], v[0][0], v[0][1])
    bh, bl = dd_mul(m[i, 1, 0], m[i, 1, 1], v[1][0], v[1][1])
    ch, cl = dd_mul(m[i, 2, 0], m[i, 2, 1], v[2][0], v[2][1])
    ah, al = dd_add(ah, al, bh, bl)
    return dd_add(ah, al, ch, cl)


@inline
def _turned(frame: Frame, v: Vector) -> tuple[Vector, float]:
    """Return M v for a vector of pairs without error, and the bound of each coordinate."""
    m = frame.inverse
    bound = _FRAME_BOUND * (abs(v[0][0]) + abs(v[1][0]) + abs(v[2][0]))
    return (_row(m, 0, v), _row(m, 1, v), _row(m, 2, v)), bound


@inline
def _in_frame(frame: Frame, segments: Any, item: int, is_flat: bool) -> tuple[Vector, float, Vector, float]:
    """Return p' and e' of a segment with their bounds."""
    p, q = point_of(segments, item, 0, is_flat), point_of(segments, item, 1, is_flat)
    shift = frame.shift
    own, blur = _turned(frame, (two_diff(p[0], shift[0]), two_diff(p[1], shift[1]), two_diff(p[2], shift[2])))
    along, along_blur = _turned(frame, (two_diff(q[0], p[0]), two_diff(q[1], p[1]), two_diff(q[2], p[2])))
    return own, blur, along, along_blur


@inline
def _plane_at(row: Any, v: Vector, offset: float, blur: float) -> tuple[float, float, float]:
    """Return n . v + offset as a double-double, and its bound; blur: of each coordinate of v."""
    ah, al = dd_scale(v[0][0], v[0][1], row[0])
    bh, bl = dd_scale(v[1][0], v[1][1], row[1])
    ch, cl = dd_scale(v[2][0], v[2][1], row[2])
    size = abs(ah) + abs(bh) + abs(ch) + abs(offset)
    ah, al = dd_add(ah, al, bh, bl)
    ah, al = dd_add(ah, al, ch, cl)
    ah, al = dd_add(ah, al, offset, 0.0)
    return ah, al, 16.0 * U2 * size + 1.01 * blur * (abs(row[0]) + abs(row[1]) + abs(row[2]))


@inline
def _sign(value: float, bound: float) -> int:
    if value > bound:
        return 1
    return -1 if value < -bound else UNDECIDED


@inline
def _slack(s: float, s_bound: float, d: float, d_bound: float) -> float:
    """Return the relative error that s / d has from its parts; infinite where their sizes have no range for it."""
    if not (2.0**-400 <= abs(d) <= 2.0**400 and abs(s) >= 2.0**-500):
        return np.inf
    return 1.01 * (s_bound / abs(s) + d_bound / abs(d))


@inline
def _order(t: float, t_low: float, slack: float, other: float, other_low: float, other_slack: float) -> int:
    """Return the sign of the difference of two parameters, each within 32 u^2 + slack of itself."""
    gap = (t - other) + (t_low - other_low)
    bound = 1.01 * ((32.0 * U2 + slack) * abs(t) + (32.0 * U2 + other_slack) * abs(other))
    return _sign(gap, bound + 2.0**-52 * abs(gap))


@inline
def _put(out: Pieces, row: int, end: int, segments: Any, item: int, t: float, low: float, slack: float) -> bool:
    """Write an end of a piece; tell whether all is surely nearest."""
    bound = (T_BOUND + slack) * abs(t)
    sure = (slack < 0.001) & (t + (low - bound) == t + (low + bound))
    out.t[row, end] = t + low
    for k in range(segments.shape[2]):
        x, is_x = point_at(segments[item, 0, k], segments[item, 1, k], t, low, slack)
        out.ends[end, row, k] = x + 0.0
        sure &= is_x
    return sure


@inline
def _put_piece(out: Pieces, row: int, segments: Any, item: int, first: Any, last: Any) -> bool:
    """Write a piece between two ends (parameter, its low part, slack, face; face -1 for the segment's own)."""
    is_flat, sure = segments.shape[2] == 2, True
    out.source[row] = item
    for end in range(2):
        t, low, slack, face = first if end == 0 else last
        if face < 0:
            put_own_end(out, row, end, segments, item, is_flat)
        else:
            sure &= _put(out, row, end, segments, item, t, low, slack)
            out.faces[row, end] = face
    return sure


@inline
def _between_planes(rows: Any, own: Vector, blur: float, along: Vector, along_blur: float) -> tuple[int, Any, Any]:
    """Return 1, -1 or UNDECIDED for a segment that meets all half-spaces, or not, or may, and the ends of its piece."""
    first, last = (-1.0, 0.0, 0.0, -1), (2.0, 0.0, 0.0, -1)
    for face in range(rows.shape[0]):
        s, s_low, s_bound = _plane_at(rows[face], own, rows[face, 3], blur)
        d, d_low, d_bound = _plane_at(rows[face], along, 0.0, along_blur)
        at_q, _ = dd_add(s, s_low, d, d_low)
        of_p = _sign(s, s_bound)
        of_q = _sign(at_q, 1.01 * (s_bound + d_bound) + 8.0 * U2 * (abs(s) + abs(d)))
        if of_p == -1 and of_q == -1:
            return -1, first, last
        if of_p == UNDECIDED or of_q == UNDECIDED:
            return UNDECIDED, first, last
        if of_p == of_q:
            continue
        t, t_low = dd_div(-s, -s_low, d, d_low)
        slack = _slack(s, s_bound, d, d_bound)
        best = first if of_p < 0 else last
        order = _order(t, t_low, slack, best[0], best[1], best[2])
        if order == UNDECIDED:
            return UNDECIDED, first, last
        if of_p < 0 and order > 0:
            first = (t, t_low, slack, face)
        elif of_q < 0 and order < 0:
            last = (t, t_low, slack, face)
    return _order(last[0], last[1], last[2], first[0], first[1], first[2]), first, last


@kernel
def cut_on_posed_rows(segments: Any, rows: Any, frame: Any, stop: Any, out: Any, state: Any) -> int:
    """Cut segments (n, 2, dim) on the half-spaces of rows (k, 4) under a pose; return how many pieces there are.

    out: room for n pieces. state: (n,) uint8, SETTLED or OPEN.
    """
    n_rows, is_flat = 0, segments.shape[2] == 2
    for item in range(segments.shape[0]):
        state[item] = OPEN
        if stop[0]:
            break
        if not is_item_safe(segments, item):
            continue
        own, blur, along, along_blur = _in_frame(frame, segments, item, is_flat)
        meets, first, last = _between_planes(rows, own, blur, along, along_blur)
        if meets == UNDECIDED:
            continue
        if meets < 0 or _put_piece(out, n_rows, segments, item, first, last):
            state[item] = SETTLED
            n_rows += meets > 0
    return n_rows


@inline
def _dot(a: Vector, b: Vector) -> Pair:
    xh, xl = dd_mul(a[0][0], a[0][1], b[0][0], b[0][1])
    yh, yl = dd_mul(a[1][0], a[1][1], b[1][0], b[1][1])
    zh, zl = dd_mul(a[2][0], a[2][1], b[2][0], b[2][1])
    xh, xl = dd_add(xh, xl, yh, yl)
    return dd_add(xh, xl, zh, zl)


@inline
def _in_ball(d: Vector, f: Vector, blur: float, radius: float) -> tuple[int, Any, Any]:
    """Return what `_between_planes` does for the ball a t^2 + 2 b t + c <= 0 with a = d . d, b = d . f,
    c = f . f - r^2, f known to `blur` a coordinate: sums of squares and products carry 12 u^2 of their size."""
    first, last = (-1.0, 0.0, 0.0, -1), (2.0, 0.0, 0.0, -1)
    d_size, f_size = abs(d[0][0]) + abs(d[1][0]) + abs(d[2][0]), abs(f[0][0]) + abs(f[1][0]) + abs(f[2][0])
    ah, al = _dot(d, d)
    bh, bl = _dot(d, f)
    ch, cl = _dot(f, f)
    rh, rl = two_prod(radius, radius)
    a_bound, b_bound = 16.0 * U2 * ah, 16.0 * U2 * d_size * f_size + 1.01 * blur * d_size
    c_bound = 16.0 * U2 * (f_size * f_size + rh) + 2.02 * blur * (f_size + 2.0 * blur)
    ch, cl = dd_sub(ch, cl, rh, rl)
    eh, el = dd_add(ah, al, 2.0 * bh, 2.0 * bl)
    eh, el = dd_add(eh, el, ch, cl)
    of_p = _sign(ch, c_bound)
    of_q = _sign(eh, 1.01 * (a_bound + 2.0 * b_bound + c_bound) + 16.0 * U2 * (ah + 2.0 * abs(bh) + abs(ch)))
    if of_p == UNDECIDED or of_q == UNDECIDED:
        return UNDECIDED, first, last
    if of_p < 0 and of_q < 0:
        return 1, first, last
    bbh, bbl = dd_mul(bh, bl, bh, bl)
    ach, acl = dd_mul(ah, al, ch, cl)
    dh, dl = dd_sub(bbh, bbl, ach, acl)
    d_bound = 1.01 * (2.0 * abs(bh) * b_bound + ah * c_bound + abs(ch) * a_bound + b_bound * b_bound)
    d_bound += 32.0 * U2 * (bbh + abs(ach))
    if of_p > 0 and of_q > 0:
        if bh > b_bound or ah + bh < -(a_bound + b_bound + 2.0**-50 * (ah + abs(bh))) or dh < -d_bound:
            return -1, first, last
        if not (bh < -b_bound and ah + bh > a_bound + b_bound + 2.0**-50 * (ah + abs(bh))):
            return UNDECIDED, first, last
    if not dh > 1024.0 * d_bound:
        return UNDECIDED, first, last
    sh = math.sqrt(dh)
    sl = (fma(-sh, sh, dh) + dl) / (2.0 * sh)
    s_bound = d_bound / (1.9 * sh) + 16.0 * U2 * sh
    for end in range(2):
        if (of_p if end == 0 else of_q) < 0:
            continue
        way = -1.0 if end == 0 else 1.0
        nh, nl = dd_add(-bh, -bl, way * sh, way * sl)
        slack = _slack(nh, b_bound + s_bound + 4.0 * U2 * (abs(bh) + sh), ah, a_bound)
        t, t_low = dd_div(nh, nl, ah, al)
        if end == 0:
            first = (t, t_low, slack, 0)
        else:
            last = (t, t_low, slack, 0)
    return 1, first, last


@kernel
def cut_on_posed_ball(segments: Any, center: Any, radius: float, stop: Any, out: Any, state: Any) -> int:
    """Cut segments (n, 2, dim) on a ball about a centre (3, 2) of double-doubles: see `cut_on_posed_rows`."""
    n_rows, is_flat = 0, segments.shape[2] == 2
    for item in range(segments.shape[0]):
        state[item] = OPEN
        if stop[0]:
            break
        if not is_item_safe(segments, item):
            continue
        p, q = point_of(segments, item, 0, is_flat), point_of(segments, item, 1, is_flat)
        along = (two_diff(q[0], p[0]), two_diff(q[1], p[1]), two_diff(q[2], p[2]))
        own = (
            dd_sub(p[0], 0.0, center[0, 0], center[0, 1]),
            dd_sub(p[1], 0.0, center[1, 0], center[1, 1]),
            dd_sub(p[2], 0.0, center[2, 0], center[2, 1]),
        )
        size = max(abs(p[0]), abs(p[1]), abs(p[2]), abs(center[0, 0]), abs(center[1, 0]), abs(center[2, 0]))
        meets, first, last = _in_ball(along, own, 8.0 * U2 * size, radius)
        if meets == UNDECIDED:
            continue
        if meets < 0 or _put_piece(out, n_rows, segments, item, first, last):
            state[item] = SETTLED
            n_rows += meets > 0
    return n_rows


@inline
def _contact(a: Point3, b: Point3, c: Point3, p: Point3, q: Point3, blur: float) -> int:
    """Return APART, PROPER or UNDECIDED for a triangle and a segment whose ends are known to `blur` a coordinate; see
    `contact_filter`."""
    ex, ey, ez = q.x - p.x, q.y - p.y, q.z - p.z
    ax, ay, az = a.x - p.x, a.y - p.y, a.z - p.z
    bx, by, bz = b.x - p.x, b.y - p.y, b.z - p.z
    cx, cy, cz = c.x - p.x, c.y - p.y, c.z - p.z
    nx, ny, nz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    ab = ex * (ay * bz - az * by) + ey * (az * bx - ax * bz) + ez * (ax * by - ay * bx)
    bc = ex * nx + ey * ny + ez * nz
    ca = ex * (cy * az - cz * ay) + ey * (cz * ax - cx * az) + ez * (cx * ay - cy * ax)
    size = max(abs(ax), abs(ay), abs(az), abs(bx), abs(by), abs(bz), abs(cx), abs(cy), abs(cz))
    length = abs(ex) + abs(ey) + abs(ez)
    if not blur < 2.0**-20 * size:
        return UNDECIDED
    moved = blur * size * (size + length)
    bound = EDGE_BOUND * (size * size * length) + UNDERFLOW + 16.0 * moved
    least, most = min(ab, bc, ca), max(ab, bc, ca)
    if least < -bound and most > bound:
        return APART
    is_through = least > bound or most < -bound
    of_p = -(ax * nx + ay * ny + az * nz)
    of_q = of_p + (ab + bc + ca)
    bound = END_BOUND * (size * size * (size + length)) + UNDERFLOW + 64.0 * moved
    least, most = min(of_p, of_q), max(of_p, of_q)
    if least > bound or most < -bound:
        return APART
    return PROPER if is_through and least < -bound and most > bound else UNDECIDED


@inline
def _gather(mesh: Any, p: Point3, q: Point3, blur: float, stack: Any, met: Any) -> int:
    """Fill met with the triangles that a segment crosses; return how many, -1 where one may be met otherwise."""
    middle, half, slack, tiny, is_near = local_segment(p, q, mesh.origin, mesh.inverse)
    if not is_near:
        return 0
    room = 64.0 * blur * mesh.inverse
    slack, tiny = np.float32(slack + room), np.float32(tiny + room)
    n_met, depth, stack[0] = 0, 1, 0
    while depth > 0:  # bound: each node enters the stack once
        depth -= 1
        node = stack[depth]
        bits = near_segment(mesh.boxes, node, middle, half, slack, tiny)
        while bits != 0:
            below = mesh.child[node, lowest_bit(bits)]
            bits &= bits - 1
            if below == EMPTY:
                continue
            if below >= 0:
                stack[depth] = below
                depth += 1
                continue
            element = -1 - below
            a, b, c = (
                corner(mesh.elements, element, 0),
                corner(mesh.elements, element, 1),
                corner(mesh.elements, element, 2),
            )
            kind = _contact(a, b, c, p, q, blur)
            if kind == UNDECIDED or n_met == met.size:
                return -1
            if kind == PROPER:
                met[n_met] = element
                n_met += 1
    return n_met


@inline
def _dot_normal(nx: Any, ny: Any, nz: Any, v: Vector, blur: float) -> tuple[float, float, float]:
    """Return n . v for a normal of minors as a double-double, and its bound; see `dot` of crossing_values.py. What v
    lost in its own rounding is 4 u^2 of it."""
    x, x_low, x_size = product(nx, v[0][0], v[0][1])
    y, y_low, y_size = product(ny, v[1][0], v[1][1])
    z, z_low, z_size = product(nz, v[2][0], v[2][1])
    h, first = two_sum(x, y)
    h, second = two_sum(h, z)
    h, low = two_sum(h, ((x_low + y_low) + (z_low + first)) + second)
    bound = (VALUE_BOUND + 32.0 * U2) * (x_size + y_size + z_size)
    return h, low, bound + 1.01 * blur * (nx[2] + ny[2] + nz[2])


@inline
def _plane_values(mesh: Any, element: int, own: Vector, blur: float, along: Vector, along_blur: float) -> Any:
    """Return s(p') and n . e' of a triangle's plane as double-doubles with their bounds."""
    a, b, c = corner(mesh.elements, element, 0), corner(mesh.elements, element, 1), corner(mesh.elements, element, 2)
    ux, ux_low = two_diff(b.x, a.x)
    uy, uy_low = two_diff(b.y, a.y)
    uz, uz_low = two_diff(b.z, a.z)
    vx, vx_low = two_diff(c.x, a.x)
    vy, vy_low = two_diff(c.y, a.y)
    vz, vz_low = two_diff(c.z, a.z)
    nx = minor(uy, uy_low, vz, vz_low, uz, uz_low, vy, vy_low)
    ny = minor(uz, uz_low, vx, vx_low, ux, ux_low, vz, vz_low)
    nz = minor(ux, ux_low, vy, vy_low, uy, uy_low, vx, vx_low)
    from_a = (
        dd_sub(own[0][0], own[0][1], a.x, 0.0),
        dd_sub(own[1][0], own[1][1], a.y, 0.0),
        dd_sub(own[2][0], own[2][1], a.z, 0.0),
    )
    return _dot_normal(nx, ny, nz, from_a, blur), _dot_normal(nx, ny, nz, along, along_blur)


@inline
def _cut(mesh: Any, segments: Any, item: int, frame: Any, stack: Any, met: Any, cuts: Any) -> int:
    """Make the crossings of a segment, in order; return how many, -1 where not all is sure."""
    own, blur, along, along_blur = _in_frame(frame, segments, item, False)
    p = Point3(own[0][0], own[1][0], own[2][0])
    q = Point3(p.x + along[0][0], p.y + along[1][0], p.z + along[2][0])
    size = max(abs(p.x), abs(p.y), abs(p.z), abs(q.x), abs(q.y), abs(q.z))
    n_met = _gather(mesh, p, q, 2.0**-51 * size + 2.0 * (blur + along_blur), stack, met)
    for i in range(n_met):
        element = met[i]
        if not (mesh.are_safe or is_item_safe(mesh.elements, element)):
            return -1
        at_p, on_way = _plane_values(mesh, element, own, blur, along, along_blur)
        slack = _slack(at_p[0], at_p[2], on_way[0], on_way[2])
        t, low = dd_div(-at_p[0], -at_p[1], on_way[0], on_way[1])
        bound = (T_BOUND + slack) * abs(t)
        sure = (slack < 0.001) & (t + (low - bound) == t + (low + bound))
        for k in range(3):
            x, is_x = point_at(segments[item, 0, k], segments[item, 1, k], t, low, slack)
            cuts.points[i, k] = x + 0.0
            sure &= is_x
        cuts.t[i], cuts.faces[i] = t + low, mesh.faces[element]
        if not sure:
            return -1
    if n_met > 0 and not sort_crossings(cuts, 0, n_met):
        return -1
    return n_met


@kernel
def cut_on_posed_mesh(
    segments: Any, locations: Any, mesh: Any, frame: Any, stop: Any, out: Any, state: Any, n: Any
) -> None:
    """Cut segments (m, 2, 3) on a mesh under a pose, as far as double-doubles and filters go.

    locations: (m,) int8 of their first ends. state: (m,) uint8, SETTLED or OPEN. n: the place to begin with, afterwards
    where to go on, short of the end where there is no room in `out`; and how many rows are filled.
    """
    stack, met, cuts = np.empty(_DEEPEST, np.int32), np.empty(MOST_MET, np.int64), crossings_for(MOST_MET, 3)
    n[1] = 0
    for item in range(n[0], segments.shape[0]):
        state[item] = OPEN
        n[0] = item
        if stop[0] or n[1] + MOST_MET > out.source.size:
            return
        if is_item_safe(segments, item):
            n_met = _cut(mesh, segments, item, frame, stack, met, cuts)
            if n_met >= 0 and locations[item] != 0:
                n[1] = emit(segments, item, item, locations[item] >= 0, cuts, 0, n_met, out, n[1])
                state[item] = SETTLED
    n[0] = segments.shape[0]
