"""Nearest points of two bodies that lie apart along axes: flush boxes, plates, parts on one lattice.

If all of one body has x <= a, and all of the other x >= b > a, these planes are the walls of a gap, and no points are
nearer than b - a. On every axis with a gap both coordinates are bounded so; points on all walls, and straight across on
the other axes, are exactly as near as the gaps allow. Triangles that have some on the walls are compared as the points,
edges and triangles that they have there, seen along the gaps, in the order of their faces: the first two with a common
point are the answer: a corner of one of them, or where edges cross. Where no two meet, nothing is proven.

Exact: images of vertices are doubles, which is tested, and signs are those of `orient2d`. Where edges cross is rounded
to the nearest doubles, by double-doubles (u = 2^-53).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.collision.convex_body import ConvexArrays, point_of
from engine.collision.convex_pair import PlacedBody, placed_body
from engine.collision.meshes.near_triangles import FACE
from engine.collision.meshes.placement import PoseArrays, is_lattice_rotation, placed, rotate
from engine.compiling.jit import called, inline
from engine.distance.closed_forms import Wide, less, over, plus, root, times
from engine.predicates.error_free import U2, is_correctly_rounded, two_diff, two_sum
from engine.predicates.orientation import orient2d
from engine.types import UNDECIDED, FloatArray, IntArray, Point2, Point3

_OUTSIDE: Final = -1
_UNKNOWN: Final = -2
"""In place of a code: there is no common point, or none is proven."""
_SMALLEST: Final = 2.0**-400
_LARGEST: Final = 2.0**400
"""Range (_SMALLEST .. _LARGEST) of coordinates that are not 0, and of gaps: squares neither underflow nor overflow."""
_BOUND: Final = 64.0 * U2
"""Of a root of squares, less two radii, and of a point moved by a radius, times the numbers: 32 u^2 for the root
(`closed_forms.py`), 16 u^2 for the quotient, 5 for the product, 4 a sum."""


class Part(NamedTuple):
    """What a triangle has on the walls: n corners, of which k and other are the first two."""

    n: int
    k: int
    other: int


@inline
def _are_images_exact(f: PlacedBody, rotation: FloatArray) -> bool:
    """Return whether no coordinate of a vertex is rounded by the pose of its body, or out of range."""
    if not is_lattice_rotation(rotation):
        return False
    move = f.place.shift
    for vertex in range(f.first, f.stop):
        v = rotate(f.place, point_of(f.points, vertex))
        for x, shift in ((v.x, move.x), (v.y, move.y), (v.z, move.z)):
            image, rest = two_sum(x, shift)
            if rest != 0.0 or not (image == 0.0 or _SMALLEST < abs(image) < _LARGEST):
                return False
    return True


@inline
def _corner(f: PlacedBody, triangles: IntArray, item: int, k: int) -> Point3:
    """Return corner k of a triangle of a body, or the centre of a ball, which has no triangles."""
    return placed(point_of(f.points, triangles[item, k] if triangles.shape[0] > 0 else f.first), f.place)


@inline
def _box_of(f: PlacedBody) -> tuple[Point3, Point3]:
    """Return the low and high corners of the box of a body without its radius."""
    low = high = placed(point_of(f.points, f.first), f.place)
    for vertex in range(f.first + 1, f.stop):
        p = placed(point_of(f.points, vertex), f.place)
        low = Point3(min(low.x, p.x), min(low.y, p.y), min(low.z, p.z))
        high = Point3(max(high.x, p.x), max(high.y, p.y), max(high.z, p.z))
    return low, high


@inline
def _walls_along(low: float, high: float, other_low: float, other_high: float) -> tuple[float, float, bool]:
    """Return the walls of both bodies on an axis, and whether there is a gap between them."""
    if other_low > high:
        return high, other_low, True
    return low, other_high, low > other_high


@inline
def _part_of(f: PlacedBody, triangles: IntArray, item: int, wall: Point3, gaps: tuple[bool, bool, bool]) -> Part:
    """Return what a triangle of a body has on its walls, which are read on axes with gaps only."""
    n, k, other = 0, 0, 0
    for corner in range(3 if triangles.shape[0] > 0 else 1):
        p = _corner(f, triangles, item, corner)
        if (p.x == wall.x or not gaps[0]) and (p.y == wall.y or not gaps[1]) and (p.z == wall.z or not gaps[2]):
            k, other = (corner if n == 0 else k), (corner if n == 1 else other)
            n += 1
    return Part(n, k, other)


@inline
def _seen(p: Point3, gaps: tuple[bool, bool, bool]) -> Point2:
    """Return a point as seen along the axes with gaps: its coordinates on two other axes, 0.0 in place of one."""
    x, y, z = 0.0 if gaps[0] else p.x, 0.0 if gaps[1] else p.y, 0.0 if gaps[2] else p.z
    return Point2(y, z) if gaps[0] else (Point2(x, z) if gaps[1] else Point2(x, y))


@inline
def _unseen(t: Point2, gaps: tuple[bool, bool, bool]) -> Point3:
    """Return a point that is seen as t, with any coordinates on axes with gaps."""
    if gaps[0]:
        return Point3(0.0, t.x, t.y)
    return Point3(t.x, 0.0, t.y) if gaps[1] else Point3(t.x, t.y, 0.0)


@inline
def _number(part: Part, place: int) -> int:
    """Return the corner of the triangle that is number ``place`` of its part."""
    return part.k if place == 0 else (part.other if place == 1 else 2)


@inline
def _edge(part: Part, place: int) -> int:
    """Return the code of edge ``place`` of a part of two or three corners."""
    return 3 + (place if part.n == 3 else (part.k if part.other == part.k + 1 else part.other))


@called
def _code_at(t: Point2, part: Part, a: Point2, b: Point2, c: Point2) -> int:
    """Return the code of the feature of a triangle on which t lies, _OUTSIDE if it is on none, or _UNKNOWN. a, b, c:
    the corners of its part."""
    if part.n == 1 or (t.x == a.x and t.y == a.y):
        return part.k if t.x == a.x and t.y == a.y else _OUTSIDE
    if part.n == 2:
        if t.x == b.x and t.y == b.y:
            return part.other
        side = orient2d(a, b, t)
        if side == UNDECIDED:
            return _UNKNOWN
        is_between = min(a.x, b.x) <= t.x <= max(a.x, b.x) and min(a.y, b.y) <= t.y <= max(a.y, b.y)
        return _edge(part, 0) if side == 0 and is_between else _OUTSIDE
    turn, ab, bc, ca = orient2d(a, b, c), orient2d(a, b, t), orient2d(b, c, t), orient2d(c, a, t)
    if turn == 0 or UNDECIDED in (turn, ab, bc, ca):
        return _UNKNOWN
    if min(turn * ab, turn * bc, turn * ca) < 0:
        return _OUTSIDE
    if ab == 0:
        return 1 if bc == 0 else 3
    if bc == 0:
        return 2 if ca == 0 else 4
    return 5 if ca == 0 else FACE


@called
def _do_cross(a: Point2, b: Point2, p: Point2, q: Point2) -> int:
    """Return 1 if the inner points of two edges cross in one point, 0 if not, _UNKNOWN if that is not proven."""
    first, second, third, fourth = orient2d(a, b, p), orient2d(a, b, q), orient2d(p, q, a), orient2d(p, q, b)
    if UNDECIDED in (first, second, third, fourth):
        return _UNKNOWN
    return int(first * second < 0 and third * fourth < 0)


@inline
def _side(a: Point2, b: Point2, c: Point2) -> tuple[Wide, float]:
    """Return twice the area of the triangle a b c, with its sign, and an error bound: 5 u^2 a product, 4 u^2 their
    difference."""
    (ux, uy), (vx, vy) = (two_diff(b.x, a.x), two_diff(b.y, a.y)), (two_diff(c.x, a.x), two_diff(c.y, a.y))
    left, right = times(Wide(*ux), Wide(*vy)), times(Wide(*uy), Wide(*vx))
    return less(left, right), 16.0 * U2 * (abs(left.h) + abs(right.h))


@inline
def _between(x: float, y: float, share: Wide, moved: float) -> tuple[float, bool]:
    """Return x + share (y - x), rounded, and whether it is the nearest double. moved: error bound of the share, besides
    20 u^2 of itself; the product adds 5 u^2, the sum 4 u^2, the test 2 u^2."""
    d = Wide(*two_diff(y, x))
    step = times(share, d)
    end = plus(Wide(x, 0.0), step)
    bound = 1.01 * moved * abs(d.h) + 40.0 * U2 * (abs(x) + abs(step.h))
    return end.h + 0.0, is_correctly_rounded(end.h, end.low, bound)


@called
def _crossing(p: Point2, q: Point2, s: Point2, t: Point2) -> tuple[Point2, bool]:
    """Return where the edge p q crosses the edge s t, and whether both coordinates are the nearest doubles."""
    (value, error), (other, other_error) = _side(s, t, p), _side(s, t, q)
    if not (error < 2.0**-20 * abs(value.h) and other_error < 2.0**-20 * abs(other.h)):
        return p, False
    whole = less(value, other)  # of different signs
    share, moved = over(value, whole), 1.01 * max(error, other_error) / abs(whole.h)
    x, has_x = _between(p.x, q.x, share, moved)
    y, has_y = _between(p.y, q.y, share, moved)
    x, has_x = (p.x, True) if p.x == q.x else ((s.x, True) if s.x == t.x else (x, has_x))
    y, has_y = (p.y, True) if p.y == q.y else ((s.y, True) if s.y == t.y else (y, has_y))
    return Point2(x, y), has_x and has_y


@inline
def _common_point(
    own: Part, a: tuple[Point2, Point2, Point2], their: Part, b: tuple[Point2, Point2, Point2]
) -> tuple[int, int, Point2]:
    """Return the codes of two features and a point of both, a corner of either part or where edges cross, rounded to
    the nearest doubles; _OUTSIDE if the parts have no common point, _UNKNOWN if that is not proven. a, b: corners of
    the parts."""
    for place in range(own.n):
        code = _code_at(a[place], their, b[0], b[1], b[2])
        if code != _OUTSIDE:
            return _number(own, place), code, a[place]
    for place in range(their.n):
        code = _code_at(b[place], own, a[0], a[1], a[2])
        if code != _OUTSIDE:
            return code, _number(their, place), b[place]
    is_unknown = False
    for i in range(own.n if own.n != 2 else 1):
        for j in range(their.n if their.n != 2 else 1):
            p, q, s, t = a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3]
            crosses = _do_cross(p, q, s, t) if own.n > 1 and their.n > 1 else 0
            if crosses == 1:
                at, is_sure = _crossing(p, q, s, t)
                if is_sure:
                    return _edge(own, i), _edge(their, j), at
            is_unknown = is_unknown or crosses != 0
    return (_UNKNOWN, _UNKNOWN, a[0]) if is_unknown else (_OUTSIDE, _OUTSIDE, a[0])


@inline
def _moved(x: float, gap: Wide, size: Wide, is_one: bool, radius: float) -> tuple[float, bool]:
    """Return x moved by a radius times gap / size, rounded, and whether it is the nearest double. is_one: whether there
    is no other gap; with another the point is nearer than x + radius, which may halve two doubles, whatever it rounds
    to."""
    if radius == 0.0 or gap.h == 0.0:
        return x + 0.0, True
    if is_one:
        return (x + radius if gap.h > 0.0 else x - radius) + 0.0, True
    step = times(over(gap, size), Wide(radius, 0.0))
    end = plus(Wide(x, 0.0), step)
    return end.h, is_correctly_rounded(end.h, end.low, _BOUND * (abs(x) + radius))


@called
def nearest_across(
    first: ConvexArrays, faces: IntArray, first_pose: PoseArrays, second: ConvexArrays, second_faces: IntArray,
    second_pose: PoseArrays, points: FloatArray, row: IntArray,
) -> float:  # fmt: skip
    """Return the distance of two bodies, convex or not, and fill points (2, 3) and row (4,), as `nearest_of_convex`
    does; NaN where they do not lie apart along axes, or any of it is unproven. faces, second_faces: of the triangles,
    ascending; a ball has none."""
    a, b = placed_body(first, 0, first_pose, 0), placed_body(second, 0, second_pose, 0)
    if not (_are_images_exact(a, first_pose.rotations[0]) and _are_images_exact(b, second_pose.rotations[0])):
        return np.nan
    (low, high), (other_low, other_high) = _box_of(a), _box_of(b)
    x, other_x, has_x = _walls_along(low.x, high.x, other_low.x, other_high.x)
    y, other_y, has_y = _walls_along(low.y, high.y, other_low.y, other_high.y)
    z, other_z, has_z = _walls_along(low.z, high.z, other_low.z, other_high.z)
    wall, other, gaps = Point3(x, y, z), Point3(other_x, other_y, other_z), (has_x, has_y, has_z)
    if not (has_x or has_y or has_z):
        return np.nan
    triangles, others, best = first.triangles, second.triangles, Point2(0.0, 0.0)
    row[0] = row[2] = -1
    is_known, face, their_face = False, -1, -1
    for i in range(max(1, triangles.shape[0])):
        own = _part_of(a, triangles, i, wall, gaps)
        if own.n == 0 or (is_known and faces.size > 0 and faces[i] != face):
            continue
        p, q = _corner(a, triangles, i, own.k), _corner(a, triangles, i, own.other)
        corners = _seen(p, gaps), _seen(q, gaps), _seen(_corner(a, triangles, i, 2), gaps)
        for j in range(max(1, others.shape[0])):
            if is_known and (second_faces.size == 0 or second_faces[j] >= their_face):
                break
            their = _part_of(b, others, j, other, gaps)
            if their.n == 0:
                continue
            s, t = _corner(b, others, j, their.k), _corner(b, others, j, their.other)
            their_corners = _seen(s, gaps), _seen(t, gaps), _seen(_corner(b, others, j, 2), gaps)
            code, their_code, seen = _common_point(own, corners, their, their_corners)
            if code == _UNKNOWN or their_code == _UNKNOWN:
                return np.nan
            if code != _OUTSIDE:
                is_known, best, row[1], row[3] = True, seen, code, their_code
                if faces.size > 0:
                    row[0], face = i, faces[i]
                if second_faces.size > 0:
                    row[2], their_face = j, second_faces[j]
    return _measured(_unseen(best, gaps), wall, other, gaps, (a.round, b.round), points) if is_known else np.nan


@called
def _measured(
    at: Point3, wall: Point3, other: Point3, gaps: tuple[bool, bool, bool], radii: tuple[float, float],
    points: FloatArray,
) -> float:  # fmt: skip
    """Return the distance of two bodies and fill points (2, 3); NaN where a double is unproven. at: a nearest point of
    either centre or hull, which both have but for the axes with gaps."""
    none = Wide(0.0, 0.0)
    x = Wide(*two_diff(other.x, wall.x)) if gaps[0] else none
    y = Wide(*two_diff(other.y, wall.y)) if gaps[1] else none
    z = Wide(*two_diff(other.z, wall.z)) if gaps[2] else none
    is_one = int(gaps[0]) + int(gaps[1]) + int(gaps[2]) == 1
    size = plus(plus(x, y), z)
    if is_one:
        size = size if size.h > 0.0 else less(none, size)
    else:
        size = root(plus(plus(times(x, x), times(y, y)), times(z, z)))
    distance = less(less(size, Wide(radii[0], 0.0)), Wide(radii[1], 0.0))
    bound = 0.0 if is_one and radii[0] == 0.0 and radii[1] == 0.0 else _BOUND * (size.h + radii[0] + radii[1])
    sure = _SMALLEST < size.h < _LARGEST and distance.h > _SMALLEST
    sure = sure and is_correctly_rounded(distance.h, distance.low, bound)
    for axis, p, q, at_x, gap, has_gap in (
        (0, wall.x, other.x, at.x, x, gaps[0]), (1, wall.y, other.y, at.y, y, gaps[1]),
        (2, wall.z, other.z, at.z, z, gaps[2]),
    ):  # fmt: skip
        points[0, axis], is_first = _moved(p if has_gap else at_x, gap, size, is_one, radii[0])
        points[1, axis], is_second = _moved(q if has_gap else at_x, less(none, gap), size, is_one, radii[1])
        sure = sure and is_first and is_second
    return distance.h if sure else np.nan
