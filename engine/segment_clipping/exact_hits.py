"""Exact fallback of hits: what a segment or ray has in common with triangles, in integers; unit normals likewise.

A ray is a segment to beyond all triangles. A line without direction is a point, seen as the start of one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from engine.predicates.rational import Number, common_integers, cross, dot, minus, nearest_with_root
from engine.segment_clipping.exact_pieces import LAST, Contact, contacts_of
from engine.segment_clipping.hit_rows import ACROSS, ALONG, END, RIM, TOUCH
from engine.segment_clipping.profiles import LARGEST, near_boxes
from engine.types import FlagArray, FloatArray


class ExactHit(NamedTuple):
    """A hit: its parameters, triangle and kind, and the barycentrics of its first point."""

    t: Fraction
    t_end: Fraction
    triangle: int
    kind: int
    weights: list[Fraction]


def exact_hits(
    p: Sequence[Number], way: Sequence[Number], is_ray: bool, mesh: Any, rims: FlagArray, near: Any,
    check: Callable[[], object],
) -> list[ExactHit]:  # fmt: skip
    """Return the hits of the line from p along `way` on a `Mesh`, in order. rims: see `find_hits`; near: all triangles
    that it may meet; check: called now and then, and may raise."""
    if not len(near):
        return []
    is_point, corners = not any(way), mesh.elements[near]
    start, step = [Fraction(x) for x in p], [Fraction(x) for x in ((1, 0, 0) if is_point else way)]
    size, scale = Fraction(float(abs(corners).max())), 1
    if is_ray or is_point:
        scale += max(int((size + abs(x)) / abs(d)) + 1 for x, d in zip(start, step) if d)
    end = [x + scale * d for x, d in zip(start, step)]
    flat, _ = common_integers([*start, *end, *corners.ravel().tolist()])
    first, last, *rest = [flat[i : i + 3] for i in range(0, len(flat), 3)]
    triangles = [rest[i : i + 3] for i in range(0, len(rest), 3)]
    contacts = sorted(contacts_of(first, last, list(enumerate(triangles)), check))
    if is_point:
        contacts = [contact._replace(last=contact.first) for contact in contacts if contact.first == 0]
    groups: list[list[Contact]] = []
    for contact in contacts:
        if groups and contact.first <= groups[-1][-1].last:
            farthest = max(contact.last, groups[-1][-1].last)
            groups[-1].append(contact._replace(last=farthest))  # invariant: the last of a group ends it
        else:
            groups.append([contact])
    hits = []
    for group in groups:
        check()
        t, t_end = group[0].first, group[-1].last
        x = [a + t * (b - a) for a, b in zip(first, last)]
        at_start = [each for each in group if each.first == t]
        keys = [(each.is_along and not is_point, mesh.faces[near[each.face]], near[each.face]) for each in at_start]
        if is_point:
            keys = [(not any(_normal(triangles[each.face])), *key[1:]) for each, key in zip(at_start, keys)]
        chosen = at_start[keys.index(min(keys))].face
        is_end = t == 0 or (t == LAST and not is_ray)
        is_rim = any(_is_on_rim(x, triangles[each.face], int(rims[near[each.face]])) for each in at_start)
        turns = sum(each.turns for each in group) % 2
        kind = ALONG if t < t_end else END if is_end else RIM if is_rim else ACROSS if turns else TOUCH
        hits.append(ExactHit(t * scale, t_end * scale, int(near[chosen]), kind, _weights(x, triangles[chosen])))
    return hits


def exact_normal(corners: Sequence[Sequence[Number]]) -> list[float]:
    """Return the unit normal of a triangle of exact corners, each component the nearest double; zero without area."""
    flat, _ = common_integers([x for corner in corners for x in corner])
    normal = _normal([flat[:3], flat[3:6], flat[6:]])
    square = dot(normal, normal)
    return [nearest_with_root(0, x, square, square) if square else 0.0 for x in normal]


def _normal(corners: Sequence[Sequence[Any]]) -> tuple[Any, Any, Any]:
    return cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]))


def _is_on_rim(x: Sequence[Any], corners: Sequence[Sequence[int]], sides: int) -> bool:
    """Return whether x lies on one of the sides of a triangle that are set in the bits of `sides`."""
    return any(sides >> k & 1 and _is_on(x, corners[k], corners[(k + 1) % 3]) for k in range(3))


def _is_on(x: Sequence[Any], a: Sequence[int], b: Sequence[int]) -> bool:
    """Return whether x lies on the side a b, which may be a point."""
    u, w = minus(b, a), minus(x, a)
    return not any(cross(u, w)) and 0 <= dot(u, w) <= dot(u, u) and (any(u) or not any(w))


def _weights(x: Sequence[Any], corners: Sequence[Sequence[int]]) -> list[Fraction]:
    """Return the barycentrics of x, a point of a triangle; without area on the first side that has the point."""
    normal = _normal(corners)
    square = dot(normal, normal)
    if square:
        seen = [minus(corner, x) for corner in corners]
        return [Fraction(dot(normal, cross(seen[k - 2], seen[k - 1]))) / square for k in range(3)]
    weights = [Fraction(0)] * 3
    k = next(k for k in range(3) if _is_on(x, corners[k], corners[(k + 1) % 3]))
    u, w = minus(corners[(k + 1) % 3], corners[k]), minus(x, corners[k])
    weights[(k + 1) % 3] = Fraction(dot(u, w)) / (dot(u, u) or 1)
    weights[k] = 1 - weights[(k + 1) % 3]
    return weights


def near_elements(elements: FloatArray, p: Sequence[Number], way: Sequence[Number], is_ray: bool) -> Any:
    """Return the indices of the triangles (k, 3, 3) whose boxes a line, or the boxes of a ray's axes, may meet."""
    if not is_ray:
        return near_boxes(elements, p, [Fraction(x) + Fraction(d) for x, d in zip(p, way)])
    apart = np.zeros(len(elements), np.bool_)
    for k, (x, d) in enumerate(zip(p, way)):
        at = float(max(min(x, LARGEST), -LARGEST))
        if d >= 0:
            apart |= elements[:, :, k].max(axis=1) < np.nextafter(at, -np.inf)
        if d <= 0:
            apart |= elements[:, :, k].min(axis=1) > np.nextafter(at, np.inf)
    return np.flatnonzero(~apart)
