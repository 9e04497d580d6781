"""Hits of a line on triangles in rationals, by clipping the line to each; whether it crosses, by a line moved a little.

Written apart from the engine: a triangle is an intersection of a plane and three half-spaces, the parity of crossings
is counted on a parallel line closer than anything else.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from tests.reference.exact import Q, Vector, add, cross, dot, sub, times, vector

ACROSS, TOUCH, RIM, END, ALONG = range(5)
_MOVED = vector((0.5891, -0.3137, 0.7121))
_TINY = Q(1, 2**400)


class Hit(NamedTuple):
    """A hit: parameters, triangle, kind, barycentrics of its first point."""

    t: Q
    t_end: Q
    triangle: int
    kind: int
    weights: tuple[Q, ...]


class Part(NamedTuple):
    """The common part of a line and a triangle; is_flat: it lies in the triangle's plane, or that has no area."""

    first: Q
    last: Q
    is_flat: bool
    triangle: int


def normal_of(triangle: Sequence[Vector]) -> Vector:
    a, b, c = triangle
    return cross(sub(b, a), sub(c, a))


def is_on(x: Vector, a: Vector, b: Vector) -> bool:
    """Return whether x lies on the side a b, which may be a point."""
    u, w = sub(b, a), sub(x, a)
    return not any(cross(u, w)) and 0 <= dot(u, w) <= dot(u, u) if any(u) else not any(w)


def sides(triangle: Sequence[Vector]) -> list[tuple[Vector, Vector]]:
    a, b, c = triangle
    return [(a, b), (b, c), (c, a)]


def rims_of(triangles: Sequence[Sequence[Vector]]) -> list[tuple[Vector, Vector]]:
    """Return the sides that an odd number of triangles has."""
    counts = Counter(tuple(sorted(side)) for each in triangles for side in sides(each) if side[0] != side[1])
    return [side for side, n in counts.items() if n % 2]


def _part_of_side(p: Vector, way: Vector, a: Vector, b: Vector) -> tuple[Q, Q] | None:
    """Return the parameters at which the whole line is on the side a b."""
    u, w = sub(b, a), sub(a, p)
    n = cross(way, u)
    if any(n):
        s = dot(cross(w, way), n) / dot(n, n)
        t = dot(cross(w, u), n) / dot(n, n)
        return (t, t) if dot(w, n) == 0 and 0 <= s <= 1 else None
    if any(cross(way, w)):
        return None
    ends = [dot(sub(x, p), way) / dot(way, way) for x in (a, b)]
    return min(ends), max(ends)


def _part(p: Vector, way: Vector, triangle: Sequence[Vector]) -> tuple[Q, Q, bool] | None:
    """Return the parameters at which the whole line is in a triangle, and whether it runs in its plane."""
    n = normal_of(triangle)
    if not any(n):
        met = [each for side in sides(triangle) if (each := _part_of_side(p, way, *side))]
        return (min(each[0] for each in met), max(each[1] for each in met), True) if met else None
    if dot(way, n):
        t = dot(sub(triangle[0], p), n) / dot(way, n)
        x = add(p, times(way, t))
        return (t, t, False) if all(dot(n, cross(sub(b, a), sub(x, a))) >= 0 for a, b in sides(triangle)) else None
    if dot(sub(triangle[0], p), n):
        return None
    first, last = None, None
    for a, b in sides(triangle):
        inward = cross(n, sub(b, a))
        rate, at = dot(inward, way), dot(inward, sub(p, a))
        if rate == 0 and at < 0:
            return None
        if rate > 0:
            first = -at / rate if first is None else max(first, -at / rate)
        elif rate < 0:
            last = -at / rate if last is None else min(last, -at / rate)
    assert first is not None
    assert last is not None
    return (first, last, True) if first <= last else None


def _weights(x: Vector, triangle: Sequence[Vector]) -> tuple[Q, ...]:
    n = normal_of(triangle)
    if any(n):
        a, b, c = triangle
        first, second = (dot(n, cross(sub(v, u), sub(x, u))) / dot(n, n) for u, v in ((b, c), (c, a)))
        return first, second, 1 - first - second
    k, (a, b) = next((k, side) for k, side in enumerate(sides(triangle)) if is_on(x, *side))
    s = dot(sub(x, a), sub(b, a)) / dot(sub(b, a), sub(b, a)) if a != b else Q(0)
    found = [Q(0)] * 3
    found[(k + 1) % 3], found[k] = s, 1 - s
    return tuple(found)


def hits(
    p: Vector, way: Vector, is_ray: bool, triangles: Sequence[Sequence[Vector]], faces: Sequence[int]
) -> list[Hit]:
    """Return the hits of the line from p along `way`, in order. faces: of the triangles."""
    parts, is_point = [], not any(way)
    for k, triangle in enumerate(triangles):
        found = _part(p, vector((1, 0, 0)) if is_point else way, triangle)
        if is_point and found is not None:
            found = (Q(0), Q(0), not any(normal_of(triangle))) if found[0] <= 0 <= found[1] else None
        if found is not None:
            first, last = max(found[0], Q(0)), found[1] if is_ray else min(found[1], Q(1))
            parts += [Part(first, last, found[2], k)] if first <= last else []
    groups: list[list[Part]] = []
    for part in sorted(parts):
        if groups and part.first <= max(each.last for each in groups[-1]):
            groups[-1].append(part)
        else:
            groups.append([part])
    return [_hit(p, way, is_ray, triangles, faces, group) for group in groups]


def _hit(
    p: Vector, way: Vector, is_ray: bool, triangles: Sequence[Sequence[Vector]], faces: Sequence[int], group: list[Part]
) -> Hit:
    t, t_end = group[0].first, max(each.last for each in group)
    x = add(p, times(way, t))
    _, _, k = min((each.is_flat, faces[each.triangle], each.triangle) for each in group if each.first == t)
    if t < t_end:
        kind = ALONG
    elif t == 0 or (t == 1 and not is_ray):
        kind = END
    elif any(is_on(x, *side) for side in rims_of(triangles)):
        kind = RIM
    else:
        scale = min(abs(number) for each in group for v in triangles[each.triangle] for number in v if number)
        moved = add(p, times(_MOVED, _TINY * scale))
        crossed = [triangles[each.triangle] for each in group if dot(way, normal_of(triangles[each.triangle]))]
        kind = ACROSS if sum(_part(moved, way, triangle) is not None for triangle in crossed) % 2 else TOUCH
    return Hit(t, t_end, k, kind, _weights(x, triangles[k]))
