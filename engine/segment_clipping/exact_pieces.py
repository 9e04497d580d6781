"""Exact fallback: clips one segment to a polygon, a polyhedron or a surface in integer arithmetic.

The contacts of the segment with the boundary split [0, 1] into open spans:

| span | location |
|---|---|
| along an element | inside: the boundary is part of the solid |
| off the boundary | one location, also that of the perturbed line, moved by (eps, eps^2) (orientation.py) |

From span to span the location flips once for each element that the perturbed line crosses: signs decide that, through
vertices and along edges too (simulation of simplicity). The first location is that of an end off the boundary, else of
a point that is located. Contacts are points of the result. Pieces are the connected components.

All coordinates of a segment and of the elements it meets are integers over one denominator, parameters are Fractions.
Cost: n log n for n elements.

A `Parameter` on a ball is a root (u + v sqrt(w)) / z of a quadratic, compared exactly with others. Rounding to nearest
is monotone, so only numbers that round alike need the sign of a + b sqrt(m) + c sqrt(n), decided by squaring.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import groupby
from typing import Final, NamedTuple

from engine.predicates.orientation import tie_sign_exact
from engine.predicates.rational import cross, dot, minus, nearest, nearest_with_root, sign_of

Integers = Sequence[int]
FIRST, LAST = Fraction(0), Fraction(1)
"""The parameters of the ends of a segment."""
_CHECK_EVERY: Final = 64


class Contact(NamedTuple):
    """Common part of a segment and an element (edge or triangle) of a face. first, last: its parameters, equal for a
    point. is_along: the segment lies in the element's plane or line. turns: the perturbed line crosses the element."""

    first: Fraction
    last: Fraction
    face: int
    is_along: bool
    turns: bool


def _cross(u: Integers, v: Integers) -> Integers:
    """Return the cross product u x v; in 2D its only component, and 0."""
    return cross(u, v) if len(u) == 3 else (u[0] * v[1] - u[1] * v[0], 0)


def edge_overlap(p: Integers, q: Integers, a: Integers, b: Integers) -> tuple[Fraction, Fraction, bool] | None:
    """Return (first, last, is_along): the parameters of the common part of segment p q and edge a b, and whether they
    are collinear (also if a = b); None if there is no common point."""
    u, v, w = minus(q, p), minus(b, a), minus(a, p)
    normal = _cross(u, v)
    size = dot(normal, normal)
    if size:
        if len(u) == 3 and dot(w, normal):
            return None  # the lines pass each other
        t, s = Fraction(dot(_cross(w, v), normal), size), Fraction(dot(_cross(w, u), normal), size)
        return (t, t, False) if 0 <= t <= 1 and 0 <= s <= 1 else None
    if any(_cross(u, w)):
        return None  # parallel, not on one line
    length = dot(u, u)
    if not length:  # case: a point
        is_on = not any(_cross(v, w)) and 0 <= -dot(v, w) <= dot(v, v) and (any(v) or not any(w))
        return (FIRST, LAST, True) if is_on else None
    ends = sorted(Fraction(dot(minus(end, p), u), length) for end in (a, b))
    first, last = max(ends[0], FIRST), min(ends[1], LAST)
    return (first, last, True) if first <= last else None


def triangle_overlap(
    p: Integers, q: Integers, a: Integers, b: Integers, c: Integers
) -> tuple[Fraction, Fraction, bool] | None:
    """Return (first, last, is_along): the parameters of the common part of segment p q and the closed triangle a b c,
    and whether they are coplanar (also if the triangle has no area); None if there is no common point.

    With corners relative to p and u = q - p, the normal is B x C + C x A + A x B; the line meets the triangle unless
    signs of the volumes u . (B x C), ... differ, and their sum is n . u.
    """
    u, *seen = (minus(x, p) for x in (q, a, b, c))
    around = [cross(seen[k - 2], seen[k - 1]) for k in range(3)]
    normal = [sum(each) for each in zip(*around)]
    if not any(normal):  # case: no area; the triangle is its edges
        stretches = [edge_overlap(p, q, *edge) for edge in ((a, b), (b, c), (c, a))]
        met = [stretch for stretch in stretches if stretch is not None]
        if not met:
            return None
        return min(s[0] for s in met), max(s[1] for s in met), True
    volumes, from_p = [dot(u, each) for each in around], dot(seen[0], around[0])
    if along := sum(volumes):
        if min(volumes) < 0 < max(volumes) or not 0 <= from_p * (1 if along > 0 else -1) <= abs(along):
            return None
        t = Fraction(from_p, along)
        return t, t, False
    if from_p:
        return None
    first, last = FIRST, LAST
    for corner, following in ((a, b), (b, c), (c, a)):
        inward = cross(normal, minus(following, corner))
        v_p, v_q = dot(inward, minus(p, corner)), dot(inward, minus(q, corner))
        if v_p == v_q:
            if v_p < 0:
                return None
        elif v_p < v_q:
            first = max(first, Fraction(v_p, v_p - v_q))
        else:
            last = min(last, Fraction(v_p, v_p - v_q))
    return (first, last, True) if first <= last else None


def is_crossed(p: Integers, q: Integers, corners: Sequence[Integers]) -> bool:
    """Return whether the line through p and q, moved by infinitesimals (eps, eps^2), crosses an edge or triangle. An
    element parallel to the line has no length or area, seen along it: no perturbed line meets it."""
    u = minus(q, p)
    if len(u) == 2:
        return len({_cross(u, minus(corner, p))[0] > 0 for corner in corners}) == 2
    k = max(range(3), key=lambda axis: abs(u[axis]))
    i, j = (k + 1) % 3, (k + 2) % 3
    seen = [(w[i] * u[k] - w[k] * u[i], w[j] * u[k] - w[k] * u[j]) for w in (minus(corner, p) for corner in corners)]
    sides = [a[0] * b[1] - a[1] * b[0] or tie_sign_exact(*a, *b) for a, b in zip(seen, [*seen[1:], seen[0]])]
    return min(sides) > 0 or max(sides) < 0


def contacts_of(
    start: Integers, end: Integers, elements: Sequence[tuple[int, Sequence[Integers]]], check: Callable[[], object]
) -> Iterator[Contact]:
    """Yield the contacts of the segment from start to end with elements, each given as the number of its face and its
    two or three corners; all are integers over one denominator. check: called now and then, and may raise."""
    for i, (face, corners) in enumerate(elements):
        if i % _CHECK_EVERY == 0:
            check()
        stretch = (edge_overlap if len(corners) == 2 else triangle_overlap)(start, end, *corners)
        if stretch is not None:
            yield Contact(*stretch[:2], face, stretch[2], is_crossed(start, end, corners))


def nodes_of(contacts: Sequence[Contact]) -> list[tuple[Fraction, list[Contact]]]:
    """Return, sorted, the parameters at which contacts begin or end, and 0 and 1, each with the contacts that begin or
    end there."""
    events: list[tuple[Fraction, Contact | None]] = [(FIRST, None), (LAST, None)]
    events += [(contact.first, contact) for contact in contacts]
    events += [(contact.last, contact) for contact in contacts if contact.first < contact.last]
    # rounding keeps order: Fractions are compared where doubles tie only
    events.sort(key=lambda event: (nearest(*event[0].as_integer_ratio()), event[0]))
    grouped = groupby(events, key=lambda event: event[0])
    return [(t, [contact for _, contact in same if contact is not None]) for t, same in grouped]


def nodes_with_locations(
    contacts: Sequence[Contact], locations: tuple[int, int], locate: Callable[[Fraction], int]
) -> Iterator[tuple[Fraction, list[Contact], bool, bool]]:
    """Yield (t, contacts, is_along, is_inside): each parameter of `nodes_of` with its contacts, and whether the span
    after it runs along an element, and is inside if not. locations: of the ends of the segment (-1, 0, 1). locate:
    returns the location at a parameter; called at most once, if both ends are on the boundary."""
    nodes = nodes_of(contacts)
    n_along, has_turned = 0, False
    are_along, have_turned = [], []  # of the span after each node; turned: against the first span
    for t, met in nodes:
        for contact in met:
            has_turned ^= contact.turns
            if contact.first < contact.last:
                n_along += 1 if t == contact.first else -1
        are_along.append(n_along > 0)
        have_turned.append(has_turned)
    is_first_in = locations[0] > 0
    if locations[0] == 0 and locations[1] != 0:
        is_first_in = (locations[1] > 0) ^ have_turned[-2]
    elif locations[0] == 0 and False in are_along[:-1]:
        i = are_along.index(False)
        is_first_in = (locate((nodes[i][0] + nodes[i + 1][0]) / 2) > 0) ^ have_turned[i]
    for (t, met), is_along, turned in zip(nodes, are_along, have_turned):
        yield t, met, is_along, is_first_in ^ turned


class Parameter(NamedTuple):
    """The number (u + v sqrt(w)) / z, in integers with w >= 0 and z > 0. near: the double nearest to it."""

    u: int
    v: int
    w: int
    z: int
    near: float


def parameter(u: int, v: int, w: int, z: int) -> Parameter:
    """Return the `Parameter` (u + v sqrt(w)) / z; z is not 0, and may be negative."""
    if z < 0:
        u, v, z = -u, -v, -z
    return Parameter(u, v, w, z, nearest_with_root(u, v, w, z))


ZERO: Final = parameter(0, 0, 0, 1)
ONE: Final = parameter(1, 0, 0, 1)


def compare(a: Parameter, b: Parameter) -> int:
    """Return the exact sign of a - b."""
    if a.near != b.near:
        return 1 if a.near > b.near else -1
    top, root = a.u * b.z - b.u * a.z, _sign_with_root(a.u * b.z - b.u * a.z, a.v * b.z, a.w)
    other = sign_of(-b.v) * sign_of(b.w)
    if root * other >= 0:
        return root or other
    square = top**2 + (a.v * b.z) ** 2 * a.w - (b.v * a.z) ** 2 * b.w
    return root * _sign_with_root(square, 2 * top * a.v * b.z, a.w)


def _sign_with_root(a: int, b: int, m: int) -> int:
    """Return the exact sign of a + b sqrt(m), m >= 0."""
    first, second = sign_of(a), sign_of(b) * sign_of(m)
    if first * second >= 0:
        return first or second
    return first * sign_of(a * a - b * b * m)
