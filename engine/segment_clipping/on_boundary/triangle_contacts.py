"""How a segment and a triangle meet: a filter, then exact signs.

**The filter.** Seen from p, with A = a - p and so on, E = q - p, every sign comes from the same three products:

    edges    E . (A x B), E . (B x C), E . (C x A)        the line passes the edge on one side or the other
    ends     s(p) = -A . (B x C), s(q) = s(p) + the sum of the edges          p, q on either side of the plane

Let u = 2^-53; by axis k, S_k the largest |coordinate| of A, B, C, L_k = |E_k| and M_k = S_k + L_k, so that bounds do
not depend on the units of an axis. Let Q = L_x S_y S_z + S_x L_y S_z + S_x S_y L_z and V = S_x S_y S_z. An edge is
within (7 u + 56 u^2) of its permanent, at most 2 Q (orientation.py): 2^-49 Q; s(p) likewise, its permanent at most 6 V:
2^-47 V. s(q) carries both, thrice that of an edge, and three roundings of at most 6 Q + 6 V: below 2^-46 (Q + V). The
bounds used are twice that, so their own rounding is covered, and 2^-700 + 2^-1000 sum M for products that underflow.
What overflows is UNDECIDED.

Where p and q are known to `blur` a coordinate only, A, B, C move by as much, E by twice that. With T = M_x M_y + M_y
M_z + M_z M_x the edges move by at most 4 blur T + 8 blur^2 sum M, the ends by 6 blur T and terms of second order.

**Touched.** The perturbed line, the segment's line moved by infinitesimals, meets no corner and no side: from one open
span of the segment to the next the location flips once for each element that it crosses (exact_pieces.py).
"""

from __future__ import annotations

from typing import Any, Final

from engine.compiling.jit import called, inline, merged
from engine.lanes.faces import AXES_BEFORE, longest_axis
from engine.predicates.error_free import workspace
from engine.predicates.orientation import orient2d, orient3d
from engine.predicates.parameters import compare_differences
from engine.predicates.vectors import minus
from engine.segment_clipping.on_boundary.contacts import Bit, Kind, Place, along_edge, code_of, overlap_code
from engine.types import UNDECIDED, FloatArray, Point2, Point3

EDGE_BOUND: Final = 2.0**-48
END_BOUND: Final = 2.0**-45
UNDERFLOW: Final = 2.0**-700


@called
def exact_contact(a: Point3, b: Point3, c: Point3, p: Point3, q: Point3, is_before: bool) -> int:
    """Return the `Kind` or packed codes of the contacts of segment p q and triangle a b c, by exact signs. If an end is
    off the plane and the triangle has an area, the line meets the plane in one point, on the segment unless both ends
    are on one side; that point is outside of the triangle only if the signs of two edges differ. is_before: instead,
    PROPER if the perturbed line crosses the triangle before p; it does where q is farther from the plane."""
    is_apart = False
    for k in range(0 if is_before else 3):
        is_apart |= min(a[k], b[k], c[k]) > max(p[k], q[k]) or max(a[k], b[k], c[k]) < min(p[k], q[k])
    if is_apart:
        return Kind.APART
    at_p, at_q = _corner_at(a, b, c, p), _corner_at(a, b, c, q)
    of_p, of_q = 0 if at_p >= 0 else orient3d(a, b, c, p), 0 if at_q >= 0 else orient3d(a, b, c, q)
    if max(of_p, of_q) == UNDECIDED:
        return Kind.DEGENERATE
    if (of_p * of_q == 1) != is_before:
        return Kind.APART
    if of_p == 0 and of_q == 0:
        return _coplanar_contact(a, b, c, p, q)
    if at_p >= 0 or at_q >= 0:  # case: the line passes the corner; its side of the opposite edge is known
        if max(at_p, at_q) > 0:
            a, b, c = (b, c, a) if max(at_p, at_q) == 1 else (c, a, b)
        ab, bc, ca = 0, of_q - of_p, 0
    else:
        ab, bc, ca = orient3d(p, q, a, b), orient3d(p, q, b, c), orient3d(p, q, c, a)
    has_left, has_right = ab == 1 or bc == 1 or ca == 1, ab == -1 or bc == -1 or ca == -1
    if has_left and has_right:
        return Kind.APART
    if max(ab, bc, ca) == UNDECIDED:
        return Kind.DEGENERATE
    if not is_before and ab == bc and bc == ca and ab != 0 and of_p != 0 and of_q != 0:
        return Kind.PROPER
    k = longest_axis((q.x - p.x, q.y - p.y, q.z - p.z))
    way = 1 if q[k] > p[k] else -1
    first = way * ab if ab != 0 else _side_when_perturbed(a, b, p, q, k)
    second = way * bc if bc != 0 else _side_when_perturbed(b, c, p, q, k)
    third = way * ca if ca != 0 else _side_when_perturbed(c, a, p, q, k)
    if max(first, second, third) == UNDECIDED:
        return Kind.DEGENERATE
    is_crossed = first == second and second == third
    if is_before:
        return Kind.PROPER if is_crossed and (ab + bc + ca) * of_p > 0 else Kind.APART
    place = Place.START if of_p == 0 else Place.END if of_q == 0 else 3 if ab == 0 else 4 if bc == 0 else 5
    if place < Place.START and (ab == 0) + (bc == 0) + (ca == 0) == 2:
        place = 0 if bc != 0 else 1 if ca != 0 else 2
    return code_of(place, is_crossed)


@inline
def _corner_at(a: Point3, b: Point3, c: Point3, p: Point3) -> int:
    """Return the corner (0, 1, 2) of triangle a b c that equals p, or -1."""
    if p.x == a.x and p.y == a.y and p.z == a.z:
        return 0
    if p.x == b.x and p.y == b.y and p.z == b.z:
        return 1
    return 2 if p.x == c.x and p.y == c.y and p.z == c.z else -1


@inline
def _seen_along(a: Point3, k: int) -> Point2:
    """Return a point without its coordinate on axis k."""
    return Point2(a[AXES_BEFORE[k]], a[AXES_BEFORE[k + 1]])


@called
def flat_axis(a: Point3, b: Point3, c: Point3) -> tuple[int, int]:
    """Return (k, turn): an axis along which triangle a b c is proven to be seen with an area, and the sign of orient2d
    there; turn is not 1 or -1 if there is none."""
    u, v = minus(b, a), minus(c, a)
    k, turn = longest_axis((u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x)), 0
    for _ in range(3):
        turn = orient2d(_seen_along(a, k), _seen_along(b, k), _seen_along(c, k))
        if abs(turn) == 1:
            break
        k = AXES_BEFORE[k]
    return k, turn


@called
def _coplanar_contact(a: Point3, b: Point3, c: Point3, p: Point3, q: Point3) -> int:
    """Return the packed codes of the overlap of segment p q with a coplanar triangle a b c, one code if it is a point;
    APART if there is none, DEGENERATE if the triangle has no area. Seen along an axis, the line enters a triangle that
    turns left where the triangle's boundary passes from the left to the right of the line, and leaves it where the
    boundary passes back: in a side, or in a corner on the line."""
    k, turn = flat_axis(a, b, c)
    start, end = _seen_along(p, k), _seen_along(q, k)
    corners = _seen_along(a, k), _seen_along(b, k), _seen_along(c, k)
    sides = orient2d(start, end, corners[0]), orient2d(start, end, corners[1]), orient2d(start, end, corners[2])
    if abs(turn) != 1 or max(sides) == UNDECIDED:
        return Kind.DEGENERATE
    if min(sides) > 0 or max(sides) < 0:
        return Kind.APART
    enter, leave = -1, -1
    for i in range(3):
        before, at, after = sides[(i + 2) % 3], sides[i], sides[(i + 1) % 3]
        if at == 0 and after == 0:
            return along_edge(corners[i], corners[(i + 1) % 3], start, end, i, (i + 1) % 3)
        if at == 0 and before == after:  # case: touched in a corner
            enter, leave = i, i
        elif at * after < 0 or (at == 0 and before * after < 0):
            place = 3 + i if at != 0 else i
            if (after < 0) == (turn > 0):
                enter = place
            else:
                leave = place
    from_enter, to_enter = (
        _beyond(corners, enter, turn, start, start, end),
        _beyond(corners, enter, turn, end, start, end),
    )
    from_leave, to_leave = (
        _beyond(corners, leave, -turn, start, start, end),
        _beyond(corners, leave, -turn, end, start, end),
    )
    if max(from_enter, to_enter, from_leave, to_leave) == UNDECIDED:
        return Kind.DEGENERATE
    if to_enter < 0 or from_leave > 0:
        return Kind.APART
    if to_enter == 0 or from_leave == 0 or enter == leave:
        return code_of(Place.END if to_enter == 0 else Place.START if from_leave == 0 else enter, False) | Bit.ALONG
    return overlap_code(Place.START if from_enter >= 0 else enter, Place.END if to_leave <= 0 else leave)


@inline
def _beyond(corners: Any, place: int, turn: int, x: Point2, p: Point2, q: Point2) -> int:
    """Return 1 if a point x of the line p q lies beyond the place where the line passes a corner, 0 .. 2, or a side,
    3 .. 5, of a triangle; 0 at it, -1 before it; or UNDECIDED. turn: 1 if what lies left of the side is beyond it."""
    if place >= 3:
        side = orient2d(corners[place - 3], corners[(place - 2) % 3], x)
        return side if side == UNDECIDED else turn * side
    k = 0 if abs(q.x - p.x) >= abs(q.y - p.y) else 1
    at, there = (x[k], corners[place][k]) if q[k] > p[k] else (corners[place][k], x[k])
    return 1 if at > there else -1 if at < there else 0


@called
def _side_when_perturbed(a: Point3, b: Point3, p: Point3, q: Point3, k: int) -> int:
    """Return the side (1, -1) of edge a b on which the line p q passes when moved by eps along the axis after k and by
    eps^2 along the next; UNDECIDED if they are parallel. k: the axis along which p q is longest. Caller guarantees that
    a b and p q lie in one plane."""
    side = _slope(a, b, p, q, AXES_BEFORE[k + 1], k)
    if side == 0:
        side = -_slope(a, b, p, q, AXES_BEFORE[k], k)
    return side if abs(side) == 1 else UNDECIDED


@inline
def _slope(a: Point3, b: Point3, p: Point3, q: Point3, j: int, k: int) -> int:
    """Return the exact sign of (a_j - b_j) (q_k - p_k) - (a_k - b_k) (q_j - p_j), or UNDECIDED. j, k: axes. The filter
    has six roundings and a sum, twice that is 2^-50; beyond it the sign is exact if sizes satisfy `is_safe`."""
    x, y = (a[j] - b[j]) * (q[k] - p[k]), (a[k] - b[k]) * (q[j] - p[j])
    gap, bound = x - y, 2.0**-50 * (abs(x) + abs(y)) + UNDERFLOW
    if abs(gap) > bound:
        return 1 if gap > 0.0 else -1
    return compare_differences(a[j], b[j], q[k], p[k], a[k], b[k], q[j], p[j], workspace(16))


@merged
def contact_filter(a: Point3, b: Point3, c: Point3, p: Point3, q: Point3, blur: float) -> int:
    """Return APART or PROPER if the filter proves it for segment p q and triangle a b c, else UNDECIDED. blur: error of
    each coordinate of p and q."""
    ex, ey, ez = q.x - p.x, q.y - p.y, q.z - p.z
    ax, ay, az = a.x - p.x, a.y - p.y, a.z - p.z
    bx, by, bz = b.x - p.x, b.y - p.y, b.z - p.z
    cx, cy, cz = c.x - p.x, c.y - p.y, c.z - p.z
    nx, ny, nz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    ab = ex * (ay * bz - az * by) + ey * (az * bx - ax * bz) + ez * (ax * by - ay * bx)
    bc = ex * nx + ey * ny + ez * nz
    ca = ex * (cy * az - cz * ay) + ey * (cz * ax - cx * az) + ez * (cx * ay - cy * ax)
    sx, sy, sz = max(abs(ax), abs(bx), abs(cx)), max(abs(ay), abs(by), abs(cy)), max(abs(az), abs(bz), abs(cz))
    lx, ly, lz = abs(ex), abs(ey), abs(ez)
    mx, my, mz = sx + lx, sy + ly, sz + lz
    lost, across = UNDERFLOW + 2.0**-1000 * (mx + my + mz), lz * sx * sy + sz * (lx * sy + sx * ly)
    if blur > 0.0:
        lost += 16.0 * blur * (mx * my + mz * (mx + my) + blur * (mx + my + mz))
    bound = EDGE_BOUND * across + lost
    least, most = min(ab, bc, ca), max(ab, bc, ca)
    if least < -bound and most > bound:
        return Kind.APART
    is_through = least > bound or most < -bound
    if blur == 0.0 and not is_through:
        return UNDECIDED
    of_p = -(ax * nx + ay * ny + az * nz)
    of_q = of_p + (ab + bc + ca)
    bound = END_BOUND * (across + sx * sy * sz) + lost
    least, most = min(of_p, of_q), max(of_p, of_q)
    if least > bound or most < -bound:
        return Kind.APART
    return Kind.PROPER if is_through and least < -bound and most > bound else UNDECIDED


@merged
def triangle_contact(elements: FloatArray, element: int, p: Point3, q: Point3, blur: float, is_before: bool) -> int:
    """Return the `Kind` or packed codes of the contacts of segment p q with triangle ``element`` of elements (k, 3, 3).
    blur: error of each coordinate of p and q; if above 0, UNDECIDED where the filter does not decide. is_before: see
    `exact_contact`."""
    a, b, c = triangle_at(elements, element)
    kind = UNDECIDED if is_before else contact_filter(a, b, c, p, q, blur)
    return kind if kind != UNDECIDED or blur > 0.0 else exact_contact(a, b, c, p, q, is_before)


@merged
def corner(elements: FloatArray, element: int, place: int) -> Point3:
    """Return corner ``place`` of element ``element`` (k, corners, 3)."""
    return Point3(
        float(elements[element, place, 0]), float(elements[element, place, 1]), float(elements[element, place, 2])
    )


@merged
def triangle_at(elements: FloatArray, element: int) -> tuple[Point3, Point3, Point3]:
    """Return the corners of triangle ``element`` (k, 3, 3)."""
    return corner(elements, element, 0), corner(elements, element, 1), corner(elements, element, 2)


@called
def are_flush(elements: FloatArray, first: int, second: int) -> bool:
    """Return whether two triangles are proven to lie in one plane. The caller guarantees that the first has an area."""
    a, b, c = triangle_at(elements, first)
    d, e, f = triangle_at(elements, second)
    return orient3d(a, b, c, d) == 0 and orient3d(a, b, c, e) == 0 and orient3d(a, b, c, f) == 0
