"""Whether two segments, a segment and a triangle, or two triangles have a common point; squared distances."""

from __future__ import annotations

from tests.reference.containment import on_segment
from tests.reference.exact import Q, Vector, along, cross, dot, sign, square, sub

Segment = tuple[Vector, Vector]
Triangle = tuple[Vector, Vector, Vector]


def boxes_meet(first: tuple[Vector, ...], second: tuple[Vector, ...]) -> bool:
    """Tell whether the closed boxes of two sets of points have a common point."""
    return all(
        max(min(p[k] for p in first), min(p[k] for p in second))
        <= min(max(p[k] for p in first), max(p[k] for p in second))
        for k in range(len(first[0]))
    )


def segments_meet(first: Segment, second: Segment) -> bool:
    """Tell whether two closed segments have a common point, in any dimension; either may be a point."""
    if not boxes_meet(first, second):
        return False
    if on_segment(first[0], *second) or on_segment(first[1], *second):
        return True
    if on_segment(second[0], *first) or on_segment(second[1], *first):
        return True
    return crossing_of_lines(first, second) is not None


def crossing_of_lines(first: Segment, second: Segment) -> Vector | None:
    """Return the one common point of two closed segments that are not parallel, None where there is none."""
    (a, b), (c, d) = first, second
    u, v, w = sub(b, a), sub(d, c), sub(c, a)
    normal = cross(u, v)
    size = square(normal)
    if size == 0 or (len(a) == 3 and dot(normal, w) != 0):
        return None
    t, s = dot(cross(w, v), normal) / size, dot(cross(w, u), normal) / size
    return along(a, b, t) if 0 <= t <= 1 and 0 <= s <= 1 else None


def part_in_triangle(segment: Segment, triangle: Triangle) -> tuple[Q, Q] | None:
    """Return the parameters (first, last) of what a segment has in common with a triangle of some area, or None."""
    (p, r), (a, b, c) = segment, triangle
    normal = cross(sub(b, a), sub(c, a))
    low, high = Q(0), Q(1)
    at_p, at_r = dot(normal, sub(p, a)), dot(normal, sub(r, a))
    if at_p * at_r > 0:
        return None
    if at_p != at_r:
        low = high = at_p / (at_p - at_r)
    for start, end in ((a, b), (b, c), (c, a)):
        inward = cross(normal, sub(end, start))
        at_p, at_r = dot(inward, sub(p, start)), dot(inward, sub(r, start))
        if at_p + low * (at_r - at_p) < 0 and at_p + high * (at_r - at_p) < 0:
            return None
        if at_p + low * (at_r - at_p) < 0:
            low = at_p / (at_p - at_r)
        if at_p + high * (at_r - at_p) < 0:
            high = at_p / (at_p - at_r)
    return low, high


def segment_meets_triangle(segment: Segment, triangle: Triangle) -> bool:
    """Tell whether a closed segment and a closed triangle of space have a common point; both may be degenerate."""
    if not boxes_meet(segment, triangle):
        return False
    if square(cross(sub(triangle[1], triangle[0]), sub(triangle[2], triangle[0]))) == 0:
        return any(segments_meet(segment, side) for side in sides(triangle))
    return part_in_triangle(segment, triangle) is not None


def sides(triangle: Triangle) -> list[Segment]:
    return [(triangle[k], triangle[(k + 1) % 3]) for k in range(3)]


def triangles_meet(first: Triangle, second: Triangle) -> bool:
    """Tell whether two closed triangles of space have a common point.

    Their common part is convex; each of its extreme points lies on a side of one of them and in the other.
    """
    if not boxes_meet(first, second):
        return False
    return any(segment_meets_triangle(side, second) for side in sides(first)) or any(
        segment_meets_triangle(side, first) for side in sides(second)
    )


def planar_overlap(first: Triangle, second: Triangle) -> bool:
    """Tell whether two triangles of space lie in one plane and share some area."""
    normal = cross(sub(first[1], first[0]), sub(first[2], first[0]))
    other = cross(sub(second[1], second[0]), sub(second[2], second[0]))
    if square(normal) == 0 or square(other) == 0 or any(dot(normal, sub(p, first[0])) != 0 for p in second):
        return False
    # one plane: they share no area exactly if a side of one separates them weakly
    for triangle, against in ((first, second), (second, first)):
        for k in range(3):
            inward = cross(normal, sub(triangle[(k + 1) % 3], triangle[k]))
            inside = sign(dot(inward, sub(triangle[(k + 2) % 3], triangle[k])))
            if all(inside * dot(inward, sub(p, triangle[k])) <= 0 for p in against):
                return False
    return True


def squared_distance_to_segment(p: Vector, a: Vector, b: Vector) -> Q:
    ab, size = sub(b, a), square(sub(b, a))
    t = min(Q(1), max(Q(0), dot(sub(p, a), ab) / size)) if size else Q(0)
    return square(sub(p, along(a, b, t)))


def squared_distance_to_triangle(p: Vector, triangle: Triangle) -> Q:
    """Return the exact squared distance from p to a closed triangle of space."""
    a, b, c = triangle
    normal = cross(sub(b, a), sub(c, a))
    if square(normal) != 0 and all(dot(cross(normal, sub(e, s)), sub(p, s)) >= 0 for s, e in sides(triangle)):
        return dot(normal, sub(p, a)) ** 2 / square(normal)
    return min(squared_distance_to_segment(p, s, e) for s, e in sides(triangle))
