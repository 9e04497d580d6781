"""The pieces of one segment within a polygon or polyhedron, in exact integer arithmetic.

The segment's contacts with the boundary cut [0, 1] into open spans. A span along which the segment lies in an element
is kept (the boundary counts as in); any other meets no element, so one location decides for all of it: that of its
middle, or, where every contact so far is a proper crossing, that of the segment's first end turned over as often as the
boundary was crossed. Contacts are kept as points. Pieces are what hangs together.

All coordinates of a segment and of the elements it meets are integers over one denominator, parameters are Fractions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import NamedTuple

from engine.predicates.integers import common_integers, nearest
from engine.segment_clipping.exact_segments import Piece

Integers = Sequence[int]
ZERO, ONE = Fraction(0), Fraction(1)


class Contact(NamedTuple):
    """Where a segment and an element meet: from `first` to `last`, equal for a point; is_along: it lies in a stretch
    of the element's plane or line, so that the element is not crossed."""

    first: Fraction
    last: Fraction
    face: int
    is_along: bool


def _minus(a: Integers, b: Integers) -> list[int]:
    return [x - y for x, y in zip(a, b)]


def _dot(a: Integers, b: Integers) -> int:
    return sum(x * y for x, y in zip(a, b))


def _cross(u: Integers, v: Integers) -> list[int]:
    """Return u x v in space; in the plane the list of its one component."""
    if len(u) == 2:
        return [u[0] * v[1] - u[1] * v[0]]
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def edge_stretch(p: Integers, q: Integers, a: Integers, b: Integers) -> tuple[Fraction, Fraction, bool] | None:
    """Return where p q meets the edge a b, and whether it runs along it (so it does where a = b)."""
    u, v, w = _minus(q, p), _minus(b, a), _minus(a, p)
    normal = _cross(u, v)
    size = _dot(normal, normal)
    if size:
        if len(u) == 3 and _dot(w, normal):
            return None  # the lines pass each other
        t, s = Fraction(_dot(_cross(w, v), normal), size), Fraction(_dot(_cross(w, u), normal), size)
        return (t, t, False) if 0 <= t <= 1 and 0 <= s <= 1 else None
    if any(_cross(u, w)):
        return None  # parallel, not on one line
    length = _dot(u, u)
    ends = sorted(Fraction(_dot(_minus(end, p), u), length) for end in (a, b))
    first, last = max(ends[0], ZERO), min(ends[1], ONE)
    return (first, last, True) if first <= last else None


def triangle_stretch(
    p: Integers, q: Integers, a: Integers, b: Integers, c: Integers
) -> tuple[Fraction, Fraction, bool] | None:
    """Return where the segment p q meets the closed triangle a b c, and whether it runs in its plane (no area: yes)."""
    normal = _cross(_minus(b, a), _minus(c, a))
    if not any(normal):  # case: no area; the triangle is its edges
        found = [edge_stretch(p, q, *edge) for edge in ((a, b), (b, c), (c, a))]
        met = [stretch for stretch in found if stretch is not None]
        if not met:
            return None
        return min(s[0] for s in met), max(s[1] for s in met), True
    s_p, s_q = _dot(normal, _minus(p, a)), _dot(normal, _minus(q, a))
    first, last = ZERO, ONE
    if s_p != s_q:
        first = last = Fraction(s_p, s_p - s_q)
        if not 0 <= first <= 1:
            return None
    elif s_p:
        return None
    for corner, following in ((a, b), (b, c), (c, a)):
        inward = _cross(normal, _minus(following, corner))
        v_p, v_q = _dot(inward, _minus(p, corner)), _dot(inward, _minus(q, corner))
        if s_p != s_q:
            if v_p + first * (v_q - v_p) < 0:
                return None
        elif v_p == v_q:
            if v_p < 0:
                return None
        elif v_p < v_q:
            first = max(first, Fraction(v_p, v_p - v_q))
        else:
            last = min(last, Fraction(v_p, v_p - v_q))
    return (first, last, s_p == s_q) if first <= last else None


def contacts_of(
    start: Integers, end: Integers, elements: Sequence[tuple[int, Sequence[Integers]]]
) -> Iterator[Contact]:
    """Yield the contacts of a segment with elements, the face and the corners (two or three) of each."""
    for face, corners in elements:
        stretch = (edge_stretch if len(corners) == 2 else triangle_stretch)(start, end, *corners)
        if stretch is not None:
            yield Contact(stretch[0], stretch[1], face, stretch[2])


def spans_of(contacts: Sequence[Contact], is_kept: Callable[[Fraction, Fraction], bool]) -> list[list[Fraction]]:
    """Return the first and the last parameter of each piece; is_kept: whether a span between elements is inside."""
    touched = {t for contact in contacts for t in contact[:2]}
    along = [contact for contact in contacts if contact.first < contact.last]
    cuts = sorted({ZERO, ONE} | touched)
    spans: list[list[Fraction]] = []
    is_open = False  # was the span before this cut kept
    for t, following in zip(cuts, [*cuts[1:], None]):
        goes_on = following is not None and (
            any(contact.first <= t and following <= contact.last for contact in along) or is_kept(t, following)
        )
        if is_open:
            spans[-1][1] = t
        elif goes_on or t in touched:
            spans.append([t, t])
        is_open = goes_on
    return spans


def face_at(contacts: Sequence[Contact], t: Fraction) -> int:
    """Return the face of the contacts at t: the smallest, those that the segment runs along last."""
    met = [contact for contact in contacts if t in contact[:2] or contact.first < t < contact.last]
    return min(met, key=lambda contact: (contact.is_along, contact.face)).face


def pieces_of(
    p: Sequence[float],
    q: Sequence[float],
    elements: Sequence[tuple[int, Sequence[Sequence[float]]]],
    is_proper: bool,
    location: int,
    locate: Callable[[list[Fraction]], int],
) -> list[Piece]:
    """Return the pieces of the segment p q, p and q different.

    elements: the face and the corners (two or three) of each element that the segment may meet; others it misses.
    is_proper: each of them is crossed in an interior point, neither end lies on the boundary. location: that of p, then
    used for all spans; otherwise `locate` is asked for the middle of each.
    """
    n = len(p)
    flat, scale = common_integers([*p, *q, *(x for _, corners in elements for corner in corners for x in corner)])
    points = iter([flat[i : i + n] for i in range(0, len(flat), n)])
    start, end = next(points), next(points)
    contacts = list(contacts_of(start, end, [(face, [next(points) for _ in corners]) for face, corners in elements]))

    def at(t: Fraction) -> list[Fraction]:
        return [Fraction(x, scale) + t * Fraction(y - x, scale) for x, y in zip(start, end)]

    def is_kept(t: Fraction, following: Fraction) -> bool:
        if is_proper:
            return location * (-1) ** sum(contact.first <= t for contact in contacts) > 0
        return locate(at((t + following) / 2)) >= 0

    def rounded(t: Fraction) -> list[float]:
        return [nearest(x.numerator, x.denominator) for x in at(t)]

    return [
        Piece(
            (nearest(*first.as_integer_ratio()), nearest(*last.as_integer_ratio())),
            rounded(first),
            rounded(last),
            (-1 if first == 0 else face_at(contacts, first), -1 if last == 1 else face_at(contacts, last)),
        )
        for first, last in spans_of(contacts, is_kept)
    ]
