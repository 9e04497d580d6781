"""Polyhedron by ray and parity: even-odd over all triangles, exact, with no ray ever cast again.

The ray goes straight up from q = (x, y, z), moved by the symbolic (eps, eps^2, 0). So moved, no vertex, no edge and no
vertical triangle lies over it, and every other triangle is passed in its interior or not at all:

- q' is in the triangle's projection if orient2d(a, b, q), (b, c, q), (c, a, q) have the sign of its area. A zero is
  decided by the move: the derivative of orient2d(a, b, q) by q.x is a.y - b.y, by q.y it is b.x - a.x.
- orient3d(a, b, c, q) tells whether the triangle passes above q or below. Where it is zero and q is in the closed
  projection, q is on the triangle: BOUNDARY, whatever the parity.
- A vertical triangle (projected area exactly zero) is only looked at for BOUNDARY. Such a q is in its plane and on no
  projection on both sides of its edges; that also holds for triangles that are a segment or a point.

Both triangles at an edge decide the zero on their common edge alike, so the parity is that of a generic ray close to q
for every surface that is even at each edge: also self-intersecting, non-manifold and degenerate ones.

Source: the textbook's ray and parity test; symbolic perturbation after Edelsbrunner and Muecke 1990, "Simulation of
simplicity".
"""

from __future__ import annotations

from typing import Any, Final

from engine.bounding.grid import cell_of
from engine.jit import inline, kernel
from engine.predicates.loading import as_point3
from engine.predicates.orientation import orient2d_exact, orient2d_filter, orient3d_exact, orient3d_filter
from engine.types import UNDECIDED, Point2

MISSED: Final = 0
CROSSED: Final = 1
ON_FACE: Final = 3
"""How a ray meets a triangle; UNDECIDED where a sign is out of the compiled range, for rational arithmetic."""
BEYOND: Final = 4
"""Added to one of these where the filter was not enough."""


@inline
def decide2(a: Any, b: Any, c: Any) -> Any:
    """Return (orient2d, 0), or (orient2d, BEYOND) where it took more than the filter."""
    turn = orient2d_filter(a, b, c)
    if turn != UNDECIDED:
        return turn, 0
    return orient2d_exact(a, b, c), BEYOND


@inline
def moved_sign(turn: int, a: Any, b: Any) -> int:
    """Return `turn` = orient2d(a, b, q), a zero decided as for q + (eps, eps^2)."""
    if turn != 0:
        return turn
    if a.y != b.y:
        return 1 if a.y > b.y else -1
    return 1 if b.x > a.x else -1 if b.x < a.x else 0


@inline
def _is_astride(first: int, second: int, third: int) -> bool:
    """Tell whether both 1 and -1 are among the three signs; UNDECIDED counts as neither."""
    has_left = first == 1 or second == 1 or third == 1
    has_right = first == -1 or second == -1 or third == -1
    return has_left and has_right


@inline
def touch_in_plane(a: Any, b: Any, c: Any, q: Any) -> int:
    """Return ON_FACE, MISSED or UNDECIDED for 2D points: q among the signs of all three edges never on both sides."""
    first, second, third = orient2d(a, b, q), orient2d(b, c, q), orient2d(c, a, q)
    if _is_astride(first, second, third):
        return MISSED
    if first == UNDECIDED or second == UNDECIDED or third == UNDECIDED:
        return UNDECIDED
    return ON_FACE


@inline
def orient2d(a: Any, b: Any, c: Any) -> int:
    """Return the exact sign or UNDECIDED; the filter is `decide2`'s."""
    return decide2(a, b, c)[0]


@inline
def touch_triangle(a: Any, b: Any, c: Any, q: Any) -> int:
    """Return ON_FACE if q lies on the closed triangle a, b, c, which may be degenerate; else MISSED, or UNDECIDED.

    Caller guarantees that q lies in the triangle's box.
    """
    side = orient3d_filter(a, b, c, q)
    if side != UNDECIDED:
        return MISSED
    side = orient3d_exact(a, b, c, q)
    if side == 1 or side == -1:
        return MISSED | BEYOND
    is_open = side == UNDECIDED
    for axis in range(3):
        if axis == 0:
            met = touch_in_plane(Point2(a.y, a.z), Point2(b.y, b.z), Point2(c.y, c.z), Point2(q.y, q.z))
        elif axis == 1:
            met = touch_in_plane(Point2(a.z, a.x), Point2(b.z, b.x), Point2(c.z, c.x), Point2(q.z, q.x))
        else:
            met = touch_in_plane(Point2(a.x, a.y), Point2(b.x, b.y), Point2(c.x, c.y), Point2(q.x, q.y))
        if met == MISSED:
            return MISSED | BEYOND
        is_open |= met == UNDECIDED
    return (UNDECIDED if is_open else ON_FACE) | BEYOND


@inline
def cross_upwards(a: Any, b: Any, c: Any, area: int, z_low: float, q: Any) -> int:
    """Return CROSSED if the ray up from the moved q meets the face, ON_FACE if q is on it, else MISSED, or UNDECIDED.

    area: exact sign of the projected area, not 0. Caller guarantees that q is in the box in x and y, and not above it.
    """
    a2, b2, c2, q2 = Point2(a.x, a.y), Point2(b.x, b.y), Point2(c.x, c.y), Point2(q.x, q.y)
    beyond, is_open, is_inside = 0, False, True
    for edge in range(3):
        if edge == 0:
            start, end = a2, b2
        elif edge == 1:
            start, end = b2, c2
        else:
            start, end = c2, a2
        turn, more = decide2(start, end, q2)
        beyond |= more
        if turn == -area:
            return MISSED | beyond
        if turn == UNDECIDED:
            is_open = True
        elif turn == 0:
            is_inside &= moved_sign(0, start, end) == area
    if is_open:
        return UNDECIDED | beyond
    if q.z < z_low:
        return (CROSSED if is_inside else MISSED) | beyond
    side = orient3d_filter(a, b, c, q)
    if side == UNDECIDED:
        beyond = BEYOND
        side = orient3d_exact(a, b, c, q)
    if side == 0:
        return ON_FACE | beyond
    if side == UNDECIDED:
        return UNDECIDED | beyond
    return (CROSSED if is_inside and side != area else MISSED) | beyond


@kernel
def fill_rows(vertices: Any, triangles: Any, order: Any, rows: Any, boxes: Any, areas: Any) -> None:
    """Fill rows (m, 3) int32, boxes (m, 6) and areas (m,) int8 with the triangles that `order` names.

    boxes: xmin, xmax, ymin, ymax, zmin, zmax. areas: exact sign of the area seen from above, UNDECIDED out of range.
    """
    for place in range(len(order)):
        triangle = order[place]
        for corner in range(3):
            rows[place, corner] = triangles[triangle, corner]
        a = as_point3(vertices, triangles[triangle, 0])
        b = as_point3(vertices, triangles[triangle, 1])
        c = as_point3(vertices, triangles[triangle, 2])
        boxes[place, 0], boxes[place, 1] = min(a.x, b.x, c.x), max(a.x, b.x, c.x)
        boxes[place, 2], boxes[place, 3] = min(a.y, b.y, c.y), max(a.y, b.y, c.y)
        boxes[place, 4], boxes[place, 5] = min(a.z, b.z, c.z), max(a.z, b.z, c.z)
        areas[place] = orient2d(Point2(a.x, a.y), Point2(b.x, b.y), Point2(c.x, c.y))


@kernel
def locate_by_columns(
    points: Any,
    vertices: Any,
    triangles: Any,
    boxes: Any,
    areas: Any,
    columns: Any,
    z_min: float,
    locations: Any,
    flag: Any,
) -> int:
    """Fill `locations` (n,) int8 for points (n, 3); returns how many needed more than the filter.

    triangles: (m, 3) by falling zmax. boxes: (m, 6) xmin, xmax, ymin, ymax, zmin, zmax. areas: (m,) int8 exact signs.
    columns: a `BoxGrid` over x and y. Caller guarantees a surface that is even at each edge.
    """
    u, v = columns.u, columns.v
    n_beyond = 0
    for item in range(len(points)):
        if flag[0]:
            break
        q = as_point3(points, item)
        if q.x < u.low or q.x > u.high or q.y < v.low or q.y > v.high or q.z < z_min:
            locations[item] = -1
            continue
        column = cell_of(q.x, u.low, u.cells_per_unit, u.n_cells)
        column += cell_of(q.y, v.low, v.cells_per_unit, v.n_cells) * u.n_cells
        is_odd, is_open, beyond = False, False, 0
        location = -1
        for entry in range(columns.offsets[column], columns.offsets[column + 1]):
            triangle = columns.items[entry]
            if boxes[triangle, 5] < q.z:
                break
            if entry & 1023 == 1023 and flag[0]:
                break
            if (
                q.x < boxes[triangle, 0]
                or q.x > boxes[triangle, 1]
                or q.y < boxes[triangle, 2]
                or q.y > boxes[triangle, 3]
            ):
                continue
            z_low, area = boxes[triangle, 4], areas[triangle]
            if area == 0 and q.z < z_low:
                continue
            a = as_point3(vertices, triangles[triangle, 0])
            b = as_point3(vertices, triangles[triangle, 1])
            c = as_point3(vertices, triangles[triangle, 2])
            if area != 0:
                met = cross_upwards(a, b, c, area, z_low, q)
            else:
                met = touch_triangle(a, b, c, q)
            beyond |= met & BEYOND
            met &= 3
            if met == ON_FACE:
                location = 0
                break
            is_open |= met == UNDECIDED
            is_odd ^= met == CROSSED
        if location != 0:
            location = UNDECIDED if is_open else 1 if is_odd else -1
        locations[item] = location
        n_beyond += beyond != 0
    return n_beyond
