"""How a segment and a triangle of space meet: see contacts.py.

**The filter.** Seen from p, with A = a - p and so on, E = q - p, every sign comes from the same three products:

    edges    E . (A x B), E . (B x C), E . (C x A)        the line passes the edge on one side or the other
    ends     s(p) = -A . (B x C), s(q) = s(p) + the sum of the edges          p, q on either side of the plane

Let u = 2^-53, S the largest |coordinate| of A, B, C and L = |E_x| + |E_y| + |E_z|. An edge is within (7 u + 56 u^2) of
its permanent, at most 2 S^2 L (orientation.py): 2^-49 S^2 L; s(p) likewise, its permanent at most 6 S^3: 2^-47 S^3.
s(q) carries both, thrice that of an edge, and three roundings of at most 6 S^2 L + 6 S^3: below 2^-46 S^2 (S + L). The
bounds used are twice that, so their own rounding is covered, and 2^-700 more for products that underflow: where S is
below 2^300 they lose less, where it is not the relative part is more. What overflows is unsure.

Where p and q are known to `blur` a coordinate only, below 2^-20 S, the edges move by less than 16 blur S (S + L), the
ends by less than 64 blur S (S + L).

**Touched.** The line beside the segment is the segment's moved by infinitesimals, and meets no corner and no side: from
one open span of the segment to the next the location turns over as often as that line crosses elements
(exact_pieces.py).
"""

from __future__ import annotations

from typing import Final

from engine.arrays import FloatArray
from engine.compiling.jit import called, inline, merged
from engine.lanes.triangles import AXES_BEFORE, longest_axis
from engine.predicates.error_free import workspace
from engine.predicates.orientation import orient3d
from engine.predicates.parameters import compare_differences
from engine.segment_clipping.on_boundary.contacts import Kind, Place, code_of
from engine.types import UNDECIDED, Point3

EDGE_BOUND: Final = 2.0**-48
END_BOUND: Final = 2.0**-45
UNDERFLOW: Final = 2.0**-700


@called
def exact_contact(a: Point3, b: Point3, c: Point3, p: Point3, q: Point3) -> int:
    """Return how a segment p q and a triangle a b c meet, by exact signs: what touches in one point by its code.

    Where an end is off the plane, the triangle has an area, and the line meets the plane in one point, within the
    segment unless both ends are on one side. That point is outside of the triangle only where two edges tell so.
    """
    of_p, of_q = orient3d(a, b, c, p), orient3d(a, b, c, q)
    if of_p == of_q and (of_p == 1 or of_p == -1):
        return Kind.APART
    ab, bc, ca = orient3d(p, q, a, b), orient3d(p, q, b, c), orient3d(p, q, c, a)
    if of_p != 0 or of_q != 0:  # case: in the plane of the triangle the edge signs are all zero and say nothing
        has_left, has_right = ab == 1 or bc == 1 or ca == 1, ab == -1 or bc == -1 or ca == -1
        if has_left and has_right:
            return Kind.APART
    if max(ab, bc, ca, of_p, of_q) == UNDECIDED or (of_p == 0 and of_q == 0):
        return Kind.DEGENERATE
    if ab == bc and bc == ca and ab != 0 and of_p != 0 and of_q != 0:
        return Kind.PROPER
    k = longest_axis((q.x - p.x, q.y - p.y, q.z - p.z))
    way = 1 if q[k] > p[k] else -1
    first = way * ab if ab != 0 else _beside(a, b, p, q, k)
    second = way * bc if bc != 0 else _beside(b, c, p, q, k)
    third = way * ca if ca != 0 else _beside(c, a, p, q, k)
    if max(first, second, third) == UNDECIDED:
        return Kind.DEGENERATE
    place = Place.START if of_p == 0 else Place.END if of_q == 0 else 3 if ab == 0 else 4 if bc == 0 else 5
    if place < Place.START and (ab == 0) + (bc == 0) + (ca == 0) == 2:
        place = 0 if bc != 0 else 1 if ca != 0 else 2
    return code_of(place, first == second and second == third)


@called
def _beside(a: Point3, b: Point3, p: Point3, q: Point3, k: int) -> int:
    """Return on which side of a side a b, which the line p q meets, that lies when it is moved: by eps along one axis,
    by eps^2 along the next (predicates/ties.py). UNDECIDED where they are parallel."""
    side = _slope(a, b, p, q, AXES_BEFORE[k + 1], k)
    if side == 0:
        side = -_slope(a, b, p, q, AXES_BEFORE[k], k)
    return side if abs(side) == 1 else UNDECIDED


@inline
def _slope(a: Point3, b: Point3, p: Point3, q: Point3, j: int, k: int) -> int:
    """Return the sign of (a_j - b_j) (q_k - p_k) - (a_k - b_k) (q_j - p_j).

    A filter, six roundings and a sum, 2^-50 is twice that; then exact where sizes are what `is_safe` wants."""
    x, y = (a[j] - b[j]) * (q[k] - p[k]), (a[k] - b[k]) * (q[j] - p[j])
    gap, bound = x - y, 2.0**-50 * (abs(x) + abs(y)) + UNDERFLOW
    if abs(gap) > bound:
        return 1 if gap > 0.0 else -1
    return compare_differences(a[j], b[j], q[k], p[k], a[k], b[k], q[j], p[j], workspace(16))


@merged
def contact_filter(a: Point3, b: Point3, c: Point3, p: Point3, q: Point3, blur: float) -> int:
    """Return how a segment and a triangle meet where rounding cannot have changed it, else UNDECIDED; p and q are known
    to `blur` a coordinate."""
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
    moved = 0.0
    if blur > 0.0:
        if not blur < 2.0**-20 * size:
            return UNDECIDED
        moved = blur * size * (size + length)
    bound = EDGE_BOUND * (size * size * length) + UNDERFLOW + 16.0 * moved
    least, most = min(ab, bc, ca), max(ab, bc, ca)
    if least < -bound and most > bound:
        return Kind.APART
    is_through = least > bound or most < -bound
    if blur == 0.0 and not is_through:
        return UNDECIDED
    of_p = -(ax * nx + ay * ny + az * nz)
    of_q = of_p + (ab + bc + ca)
    bound = END_BOUND * (size * size * (size + length)) + UNDERFLOW + 64.0 * moved
    least, most = min(of_p, of_q), max(of_p, of_q)
    if least > bound or most < -bound:
        return Kind.APART
    return Kind.PROPER if is_through and least < -bound and most > bound else UNDECIDED


@merged
def triangle_contact(elements: FloatArray, element: int, p: Point3, q: Point3, blur: float) -> int:
    """Return how a segment, its ends known to `blur` a coordinate, and one of some triangles (k, 3, 3) meet; UNDECIDED
    where the filter does not decide and blur is above 0."""
    a, b, c = triangle_at(elements, element)
    kind = contact_filter(a, b, c, p, q, blur)
    return kind if kind != UNDECIDED or blur > 0.0 else exact_contact(a, b, c, p, q)


@merged
def corner(elements: FloatArray, element: int, place: int) -> Point3:
    """Return a corner of one of some elements (k, corners, 3)."""
    return Point3(
        float(elements[element, place, 0]), float(elements[element, place, 1]), float(elements[element, place, 2])
    )


@merged
def triangle_at(elements: FloatArray, element: int) -> tuple[Point3, Point3, Point3]:
    """Return the corners of one of some triangles (k, 3, 3)."""
    return corner(elements, element, 0), corner(elements, element, 1), corner(elements, element, 2)
