"""How a segment touches a triangle: where, and whether a line beside the segment crosses it; the codes of contacts.py.

The line beside it is the segment's moved by infinitesimals, and meets no corner and no side: from one open span of the
segment to the next the location turns over as often as that line crosses elements (exact_pieces.py).
"""

from __future__ import annotations

from typing import Any

from engine.jit import called, inline, merged
from engine.lanes.triangles import AXES_BEFORE, longest_axis
from engine.predicates.error_free import workspace
from engine.predicates.orientation import orient3d
from engine.predicates.parameters import compare_differences
from engine.segment_clipping.on_boundary.contacts import DEGENERATE, END, START, code_of, place_of
from engine.segment_clipping.on_boundary.triangle_contact import UNDERFLOW, corner
from engine.segment_clipping.pieces import Triple
from engine.types import UNDECIDED, Point3


@called
def touched_triangle(elements: Any, element: int, p: Point3, q: Point3) -> int:
    """Return the code of a triangle that the segment p q touches in one point, with all signs decided; or
    DEGENERATE."""
    a, b, c = corner(elements, element, 0), corner(elements, element, 1), corner(elements, element, 2)
    of_p, of_q = orient3d(a, b, c, p), orient3d(a, b, c, q)
    ab, bc, ca = orient3d(p, q, a, b), orient3d(p, q, b, c), orient3d(p, q, c, a)
    start, end = (p.x, p.y, p.z), (q.x, q.y, q.z)
    k = longest_axis((q.x - p.x, q.y - p.y, q.z - p.z))
    way = 1 if end[k] > start[k] else -1
    first = way * ab if ab != 0 else _beside(elements, element, 0, start, end, k)
    second = way * bc if bc != 0 else _beside(elements, element, 1, start, end, k)
    third = way * ca if ca != 0 else _beside(elements, element, 2, start, end, k)
    if first == UNDECIDED or second == UNDECIDED or third == UNDECIDED:
        return DEGENERATE
    place = START if of_p == 0 else END if of_q == 0 else 3 if ab == 0 else 4 if bc == 0 else 5
    if place < START and (ab == 0) + (bc == 0) + (ca == 0) == 2:
        place = 0 if bc != 0 else 1 if ca != 0 else 2
    return code_of(place, first == second and second == third)


@called
def _beside(elements: Any, element: int, place: int, p: Triple, q: Triple, k: int) -> int:
    """Return on which side of the side from a corner on, which the line p q meets, it lies when it is moved: by eps
    along one axis, by eps^2 along the next. UNDECIDED where they are parallel."""
    side = _slope(elements, element, place, p, q, AXES_BEFORE[k + 1], k)
    if side == 0:
        side = -_slope(elements, element, place, p, q, AXES_BEFORE[k], k)
    return side if side != 0 else UNDECIDED


@inline
def _slope(elements: Any, element: int, place: int, p: Triple, q: Triple, j: int, k: int) -> int:
    """Return the sign of (a_j - b_j) (q_k - p_k) - (a_k - b_k) (q_j - p_j) for the side a b from a corner on.

    A filter, six roundings and a sum, 2^-50 is twice that; then exact where sizes are what `is_safe` wants."""
    other = (place + 1) % 3
    a_j, a_k = elements[element, place, j], elements[element, place, k]
    b_j, b_k = elements[element, other, j], elements[element, other, k]
    x, y = (a_j - b_j) * (q[k] - p[k]), (a_k - b_k) * (q[j] - p[j])
    gap, bound = x - y, 2.0**-50 * (abs(x) + abs(y)) + UNDERFLOW
    if abs(gap) > bound:
        return 1 if gap > 0.0 else -1
    return compare_differences(a_j, b_j, q[k], p[k], a_k, b_k, q[j], p[j], workspace(16))


@merged
def axis_of(segments: Any, item: int) -> int:
    """Return the axis along which a segment is longest."""
    best = 0
    for k in range(1, segments.shape[2]):
        length = abs(segments[item, 1, k] - segments[item, 0, k])
        if length > abs(segments[item, 1, best] - segments[item, 0, best]):
            best = k
    return best


@inline
def are_one(elements: Any, first: int, code: int, second: int, other: int) -> bool:
    """Tell whether what two codes say of two elements is one point: an end, or a corner or one side of both."""
    n, m = place_of(code), place_of(other)
    if n >= START or m >= START:
        return n == m and n <= END
    if (n < 3) != (m < 3):
        return False
    if n < 3:
        return _are_equal(elements, first, n, second, m)
    a, b, c, d = n - 3, (n - 2) % 3, m - 3, (m - 2) % 3
    return (_are_equal(elements, first, a, second, c) and _are_equal(elements, first, b, second, d)) or (
        _are_equal(elements, first, a, second, d) and _are_equal(elements, first, b, second, c)
    )


@inline
def _are_equal(elements: Any, first: int, place: int, second: int, other: int) -> bool:
    """Tell whether a corner of one element is one of another."""
    are_equal = True
    for k in range(elements.shape[2]):
        are_equal &= elements[first, place, k] == elements[second, other, k]
    return are_equal
