"""Contacts of a segment with the triangles of a mesh: one traversal for clipping and for scenes.

The segment descends a tree of boxes (bvh.py). Blocks of triangles that it reaches are queued, and so are the triangles
that `near_triangles` leaves of them, so that their cache lines are fetched together. A filter, then exact signs decide
each triangle.

The tree holds float32 boxes in coordinates of its own. A segment is brought there in doubles, cut to what lies
near the tree, and stored as its middle and half in float32; the slack covers what all this rounds:

    middle, w = m - c      2^-24 (S + 2) each, S the largest coordinate (the tree's own are at most 2)
    half, quotients        see `enter_boxes`
    cutting                2^-50 of the segment's coordinates before, in either end

16 * 2^-24 (S + 2) for half widths is more than their sum.

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

Source: I. Wald, C. Benthin, S. Boulos, Getting rid of packets: efficient SIMD single-ray traversal using
multi-branching BVHs, 2008.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.bounding.bvh import STACK, WIDTH
from engine.compiling.jit import allocating, allocating_kernel, called, entry_of, inline, merged
from engine.lanes.boxes import BOX_ROWS, EMPTY, enter_boxes
from engine.lanes.faces import AXES_BEFORE, CORNER_ROWS, longest_axis, near_triangles
from engine.lanes.lanes import lowest_bit, prefetch
from engine.lanes.tracing import LANES
from engine.predicates.error_free import workspace
from engine.predicates.orientation import orient2d, orient3d
from engine.predicates.parameters import compare_differences
from engine.predicates.vectors import minus
from engine.running.budget import Budget
from engine.segment_clipping.on_boundary.contacts import (
    CODE_BITS,
    NO_ROOM,
    Bit,
    Contacts,
    Kind,
    Place,
    allocate_contacts,
    along_edge,
    are_same,
    code_of,
    find_contacts_2d,
    overlap_code,
)
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, Outline
from engine.types import UNDECIDED, FlagArray, FloatArray, IntArray, Point2, Point3

EDGE_BOUND: Final = 2.0**-48
END_BOUND: Final = 2.0**-45
UNDERFLOW: Final = 2.0**-700
SLACK: Final = 2.0**-20
CUT_SLACK: Final = 2.0**-45
LIMIT: Final = 4.0
"""Half side of the cube, in tree coordinates, to which segments are cut: far outside of every box."""

_MOST: Final = np.float32(2.0**100)
Way = namedtuple("Way", "middle half inverse slack is_near")
"""A segment in tree coordinates, float32: middle +- half, and its slack. inverse: 1 / half, at most 2^100, where halves
are far below every slack; is_near: whether it comes near the tree."""


@called
def exact_contact(a: Point3, b: Point3, c: Point3, p: Point3, q: Point3) -> int:
    """Return the `Kind` or packed codes of the contacts of segment p q and triangle a b c, by exact signs. If an end is
    off the plane and the triangle has an area, the line meets the plane in one point, on the segment unless both ends
    are on one side; that point is outside of the triangle only if the signs of two edges differ."""
    is_apart = False
    for k in range(3):
        is_apart |= min(a[k], b[k], c[k]) > max(p[k], q[k]) or max(a[k], b[k], c[k]) < min(p[k], q[k])
    if is_apart:
        return Kind.APART
    at_p, at_q = _corner_at(a, b, c, p), _corner_at(a, b, c, q)
    of_p, of_q = 0 if at_p >= 0 else orient3d(a, b, c, p), 0 if at_q >= 0 else orient3d(a, b, c, q)
    if of_p == of_q and (of_p == 1 or of_p == -1):
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
    if max(ab, bc, ca, of_p, of_q) == UNDECIDED:
        return Kind.DEGENERATE
    if ab == bc and bc == ca and ab != 0 and of_p != 0 and of_q != 0:
        return Kind.PROPER
    first, second, third = _perturbed_sides(a, b, c, p, q, (ab, bc, ca))
    if max(first, second, third) == UNDECIDED:
        return Kind.DEGENERATE
    place = Place.START if of_p == 0 else Place.END if of_q == 0 else 3 if ab == 0 else 4 if bc == 0 else 5
    if place < Place.START and (ab == 0) + (bc == 0) + (ca == 0) == 2:
        place = 0 if bc != 0 else 1 if ca != 0 else 2
    return code_of(place, first == second and second == third)


@called
def crossed_before(a: Point3, b: Point3, c: Point3, p: Point3, q: Point3) -> int:
    """Return PROPER if the perturbed line through p and q crosses triangle a b c before p, APART if not, DEGENERATE if
    undecided. The line nears the plane, seen from p, where q is on its other side or farther from it."""
    of_p, of_q = orient3d(a, b, c, p), orient3d(a, b, c, q)
    if of_p == 0 or of_q == 0 or of_p == -of_q:
        return Kind.APART
    ab, bc, ca = orient3d(p, q, a, b), orient3d(p, q, b, c), orient3d(p, q, c, a)
    if max(of_p, of_q, ab, bc, ca) == UNDECIDED:
        return Kind.DEGENERATE
    if min(ab, bc, ca) * max(ab, bc, ca) < 0 or min(ab, bc, ca) == max(ab, bc, ca) == 0:
        return Kind.APART
    first, second, third = _perturbed_sides(a, b, c, p, q, (ab, bc, ca))
    if max(first, second, third) == UNDECIDED:
        return Kind.DEGENERATE
    return (
        Kind.PROPER
        if first == second == third and ab + bc + ca != 0 and (ab + bc + ca > 0) == (of_p > 0)
        else Kind.APART
    )


@inline
def _perturbed_sides(
    a: Point3, b: Point3, c: Point3, p: Point3, q: Point3, sides: tuple[int, int, int]
) -> tuple[int, int, int]:
    """Return the sides (1, -1) on which the perturbed line passes edges a b, b c and c a, all times one sign; UNDECIDED
    as in `_side_when_perturbed`. sides: of the line p q itself, 0 where it meets an edge's line."""
    k = longest_axis((q.x - p.x, q.y - p.y, q.z - p.z))
    way = 1 if q[k] > p[k] else -1
    return (
        way * sides[0] if sides[0] != 0 else _side_when_perturbed(a, b, p, q, k),
        way * sides[1] if sides[1] != 0 else _side_when_perturbed(b, c, p, q, k),
        way * sides[2] if sides[2] != 0 else _side_when_perturbed(c, a, p, q, k),
    )


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
def triangle_contact(elements: FloatArray, element: int, p: Point3, q: Point3, blur: float) -> int:
    """Return the `Kind` or packed codes of the contacts of segment p q with triangle ``element`` of elements (k, 3, 3).
    blur: error of each coordinate of p and q; if above 0, UNDECIDED where the filter does not decide."""
    a, b, c = triangle_at(elements, element)
    kind = contact_filter(a, b, c, p, q, blur)
    return kind if kind != UNDECIDED or blur > 0.0 else exact_contact(a, b, c, p, q)


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


@merged
def local_segment(p: Point3, q: Point3, origin: Any, inverse: Any, blur: float) -> Way:
    """Return segment p q in tree coordinates, by axis (x - origin) * inverse, as a `Way`. blur: error of each
    coordinate of p and q."""
    ix, iy, iz = inverse[0], inverse[1], inverse[2]
    px, py, pz = p.x * ix - origin[0] * ix, p.y * iy - origin[1] * iy, p.z * iz - origin[2] * iz
    dx, dy, dz = q.x * ix - p.x * ix, q.y * iy - p.y * iy, q.z * iz - p.z * iz
    size = max(abs(px), abs(py), abs(pz), abs(px + dx), abs(py + dy), abs(pz + dz))
    start, end, is_near = 0.0, 1.0, True
    cut = CUT_SLACK * (size + 2.0)
    if size > LIMIT and size < 2.0**40:
        for at, step in ((px, dx), (py, dy), (pz, dz)):
            if abs(step) < 2.0**-40:
                is_near &= abs(at) <= LIMIT
                continue
            first, last = (-LIMIT - at) / step, (LIMIT - at) / step
            start, end = max(start, min(first, last)), min(end, max(first, last))
        is_near &= start <= end
        size = LIMIT + 1.0
    middle, length = 0.5 * (start + end), 0.5 * (end - start)
    half: Any = np.float32(length * dx), np.float32(length * dy), np.float32(length * dz)
    x, y, z = np.float32(1.0) / half[0], np.float32(1.0) / half[1], np.float32(1.0) / half[2]
    return Way(
        (np.float32(px + middle * dx), np.float32(py + middle * dy), np.float32(pz + middle * dz)),
        half,
        (min(max(x, -_MOST), _MOST), min(max(y, -_MOST), _MOST), min(max(z, -_MOST), _MOST)),
        np.float32(SLACK * (size + 2.0) + cut + 64.0 * blur * max(ix, iy, iz)),
        is_near,
    )


@inline
def _far_before(p: Point3, q: Point3, inverse: Any) -> Point3:
    """Return a point about on the line p q before p, beyond the tree if p is near it; its rounding is far below the
    slack of `local_segment`."""
    x, y, z = q.x - p.x, q.y - p.y, q.z - p.z
    reach = 4.0 * LIMIT / max(abs(x * inverse[0]), abs(y * inverse[1]), abs(z * inverse[2]))
    return Point3(p.x - reach * x, p.y - reach * y, p.z - reach * z)


@merged
def shear_of(way: Way) -> Any:
    """Return the arguments of `near_triangles` for a segment: the axes (i, j, k), k the one along which it is longest;
    its middle on these; the slopes r and s; reach; slack."""
    k, middle, half = longest_axis(way.half), way.middle, way.half
    i, j = AXES_BEFORE[k], AXES_BEFORE[k + 1]
    slack = np.float32(2.0) * way.slack  # 32 u (S + 2) of lanes/faces.py, and twice what cutting loses
    place = middle[i], middle[j], middle[k]
    return (i, j, k), place, half[i] / half[k], half[j] / half[k], abs(half[k]) + slack, slack


_ROOM: Final = 512
"""Capacity of the queues of blocks, and of triangles."""

Waiting = namedtuple("Waiting", "stack entered blocks triangles")
"""Scratch of one traversal: stack (STACK,) int32 nodes; entered (1, WIDTH) float32, see `enter_boxes`; blocks,
triangles: int64, at least 2 * LANES each."""


@allocating
def traversal_buffers() -> Waiting:
    """Allocate the scratch of one traversal."""
    return Waiting(
        np.empty(STACK, np.int32),
        np.empty((1, WIDTH), np.float32),
        np.empty(_ROOM, np.int64),
        np.empty(_ROOM, np.int64),
    )


@inline
def is_answered(is_any: bool, n_met: int, kinds: IntArray | FlagArray) -> bool:
    """Return whether a traversal may end: n_met is NO_ROOM, or `is_any` and the contact in row 0 is decided."""
    return n_met < 0 or (is_any and n_met > 0 and kinds[0] != Kind.DEGENERATE)


@inline
def _append_triangles(
    mesh: Any, ends: Any, is_any: bool, triangles: IntArray, n: int, met: IntArray, kinds: Any, n_met: int
) -> int:
    """Append the contacts of a segment with triangles[:n] to met (elements) and kinds, after the n_met there; return
    their number then, or NO_ROOM. mesh: the `Mesh`; ends: (p, q, blur, is_before); is_any: one contact is enough, in
    row 0."""
    p, q, blur, is_before = ends
    for place in range(n):
        element = triangles[place]
        if is_before:
            a, b, c = triangle_at(mesh.elements, element)
            kind = crossed_before(a, b, c, p, q)
        else:
            kind = triangle_contact(mesh.elements, element, p, q, blur)
        while kind != Kind.APART:  # bound: two codes
            row = 0 if is_any else n_met
            if row == met.size:
                return NO_ROOM
            prefetch(mesh.faces, element)
            met[row], kinds[row], n_met = element, kind & ((1 << CODE_BITS) - 1), row + 1
            kind >>= CODE_BITS
        if is_answered(is_any, n_met, kinds):
            break
    return n_met


@inline
def _append_blocks(
    mesh: Any, ends: Any, shear: Any, is_any: bool, waiting: Waiting, n: int, met: IntArray, kinds: Any, n_met: int
) -> int:
    """Append the contacts of a segment with the triangles of n leaf blocks, queued in `waiting`, to met (elements) and
    kinds, after the n_met there; return their number then, or NO_ROOM. ends: (p, q, blur, is_before); shear: `shear_of`
    the segment; is_any: one contact is enough, in row 0."""
    (i, j, k), place, r, s, reach, slack = shear
    n_waiting = 0
    for turn in range(n):
        block = waiting.blocks[turn]
        bits = near_triangles(mesh.corners, block, i, j, k, place, r, s, reach, slack)
        while bits != 0:
            below = mesh.child[mesh.n_inner + block, lowest_bit(bits)]
            bits &= bits - 1
            if below != EMPTY:
                waiting.triangles[n_waiting] = -1 - below
                n_waiting += 1
                prefetch(mesh.elements, (-1 - below) * 9)
                prefetch(mesh.elements, (-1 - below) * 9 + 8)
        if n_waiting + LANES > waiting.triangles.size or turn == n - 1:
            n_met = _append_triangles(mesh, ends, is_any, waiting.triangles, n_waiting, met, kinds, n_met)
            n_waiting = 0
            if is_answered(is_any, n_met, kinds):
                break
    return n_met


@inline
def append_contacts(
    mesh: Any, p: Point3, q: Point3, blur: float, is_any: bool, is_before: bool, waiting: Waiting, met: IntArray,
    kinds: Any, n_met: int,
) -> int:  # fmt: skip
    """Append the contacts of segment p q with the triangles of a `Mesh` to met (elements) and kinds, after the n_met
    there; return their number then, or NO_ROOM. blur: error of each coordinate of p and q; if above 0, what the filter
    leaves open is Kind.DEGENERATE. is_any: one contact is enough, in row 0; it is Kind.DEGENERATE only if no other is
    decided. is_before: instead, what `crossed_before` tells of triangles. waiting: scratch."""
    stack, blocks, last = waiting.stack, waiting.blocks, np.float32(1.0)
    start, end = (_far_before(p, q, mesh.inverse), p) if is_before else (p, q)
    way = local_segment(start, end, mesh.origin, mesh.inverse, blur)
    shear, ends, n_blocks, depth = shear_of(way), (p, q, blur, is_before), 0, int(way.is_near)
    stack[0], blocks[0] = 0, 0
    if mesh.n_inner == 0:
        depth, n_blocks = 0, depth
    while depth > 0 or n_blocks > 0:  # bound: each node enters the stack once
        if depth > 0:
            depth -= 1
            node = stack[depth]
            bits = enter_boxes(mesh.boxes, node, way.middle, way.inverse, way.slack, last, waiting.entered)
            while bits != 0:
                below = mesh.child[node, lowest_bit(bits)]
                bits &= bits - 1
                if below < 0:  # case: numbers that are none, which nothing separates
                    continue
                prefetch(mesh.child, below * WIDTH)
                if below >= mesh.n_inner:
                    blocks[n_blocks] = below - mesh.n_inner
                    n_blocks += 1
                    for line in range(0, CORNER_ROWS * LANES, 16):
                        prefetch(mesh.corners, (below - mesh.n_inner) * (CORNER_ROWS * LANES) + line)
                else:
                    stack[depth] = below
                    depth += 1
                    for line in range(0, BOX_ROWS * WIDTH, 16):
                        prefetch(mesh.boxes, below * (BOX_ROWS * WIDTH) + line)
        if depth == 0 or n_blocks + WIDTH > blocks.size:
            n_met, n_blocks = _append_blocks(mesh, ends, shear, is_any, waiting, n_blocks, met, kinds, n_met), 0
            if is_answered(is_any, n_met, kinds):
                break
    return n_met


@called
def gather_triangles(contacts: Contacts, mesh: Mesh, segments: FloatArray, n: int, stop: FlagArray) -> int:
    """Fill `contacts` with those of the first n of segments (m, 2, 3) and the triangles of a `Mesh`; return the number
    of segments for which there is room. Ends early if `stop` (one uint8) is set."""
    n_met = 0
    contacts.offsets[0] = 0
    for i in range(n):
        if not are_same(segments[i], 0, segments[i], 1):
            p, q = corner(segments, i, 0), corner(segments, i, 1)
            n_met = append_contacts(
                mesh, p, q, 0.0, False, False, contacts.waiting, contacts.met, contacts.kinds, n_met
            )
        contacts.offsets[i + 1] = n_met
        if n_met < 0 or stop[0]:
            return i
    return n


@allocating_kernel
def find_contacts_3d(segments: FloatArray, mesh: Mesh, stop: FlagArray, room: int) -> tuple[int, Any, Any, Any]:
    """Return (number, met, kinds, offsets): the contacts of at most GROUP segments (n, 2, 3) float64 with triangles,
    segment by segment. met int64: the elements; kinds uint8: `Kind` or code; offsets (n + 1,) of segments. The number
    is NO_ROOM if there are more than `room`, or `stop` (one uint8) is set."""
    n, contacts = segments.shape[0], allocate_contacts(segments.shape[0], room, traversal_buffers())
    n_met = contacts.offsets[n] if gather_triangles(contacts, mesh, segments, n, stop) == n else NO_ROOM
    return n_met, contacts.met, contacts.kinds, contacts.offsets


_LEAST_CONTACTS: Final = 1 << 10
"""Smallest capacity for contacts, plus `_EACH` for each segment; doubled if there are more."""
_EACH: Final = 8


def contacts_with(
    segments: FloatArray, boundary: Outline | Mesh, budget: Budget
) -> tuple[IntArray, FlagArray, IntArray]:
    """Return (met, kinds, offsets) for segments (n <= GROUP, 2, dim): the elements that each meets or may meet, segment
    by segment; the `Kind` or code of each contact; and the offsets (n + 1,) of segments."""
    kernel: Any = find_contacts_3d if isinstance(boundary, Mesh) else find_contacts_2d
    room, n_contacts = _LEAST_CONTACTS + _EACH * len(segments), NO_ROOM
    met, kinds, offsets = np.zeros(0, np.int64), np.zeros(0, np.uint8), np.zeros(0, np.int64)
    while n_contacts == NO_ROOM:  # bound: room is doubled, and a segment meets an element once
        n_contacts, met, kinds, offsets = entry_of(kernel)(segments, boundary, budget.flag, room)
        budget.check()
        room *= 2
    return met[:n_contacts], kinds[:n_contacts], offsets[: len(segments) + 1]
