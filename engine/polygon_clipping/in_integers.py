"""Sutherland-Hodgman in exact integers: the definition of `clip_polygons`, and the exact fallback of the kernel.

A vertex is a tuple of integers (x, y[, z], w) with w > 0 and no common divisor, standing for (x / w, y / w, z / w), so
equal points are equal tuples. A plane is a row of integers; its value at a vertex is one dot product. With values
s_p > 0 > s_q the edge p q crosses at s_p q - s_q p, again integers.

Numbers grow: where an edge of two cut vertices is cut again and the contour is not planar, digits add up, with many
planes to thousands of bits and more. `MOST_BITS` caps them.

Source: I. E. Sutherland, G. W. Hodgman, Reentrant polygon clipping, 1974; the textbook's section on clipping polygons.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

from engine.errors import TooComplexError
from engine.predicates.rational import common_integers, cross, dot, minus, nearest, reduced

Vertex = tuple[int, ...]
Row = tuple[int, ...]

MOST_BITS = 1 << 17
"""Most bits of an exact vertex: at 131,072 bits one cut costs milliseconds, and the next may cost double."""


def integer_row(row: Sequence[float]) -> Row:
    """Return a plane's row (a, b[, c], d) as integers, times a positive factor."""
    numbers, _ = common_integers(row)
    return tuple(numbers)


def plane_through(a: Sequence[float], b: Sequence[float], c: Sequence[float]) -> Row:
    """Return the integer row of the plane through a, b, c, positive on the side opposite to the normal (b - a) x (c -
    a)."""
    n, scale = common_integers([*a, *b, *c])
    p, q, r = n[:3], n[3:6], n[6:]
    normal = cross(minus(r, p), minus(q, p))
    return (*(x * scale for x in normal), -dot(normal, p))


def merge_repeated(contour: list[Vertex]) -> list[Vertex]:
    """Return the contour without repeated vertices, cyclically; the first of equal ones remains."""
    inside = [vertex for i, vertex in enumerate(contour) if i == 0 or vertex != contour[i - 1]]
    while len(inside) > 1 and inside[-1] == inside[0]:
        inside.pop()
    return inside


def clip_contour(contour: list[Vertex], row: Row) -> tuple[list[Vertex], int, bool]:
    """Return a contour clipped by one plane, the number of its points on the plane (cuts included), and whether a
    vertex was dropped."""
    values = [sum(a * x for a, x in zip(row, vertex)) for vertex in contour]
    if min(values) >= 0:
        return contour, values.count(0), False
    inside: list[Vertex] = []
    n_contacts = values.count(0)
    for (p, s_p), (q, s_q) in pairwise([*zip(contour, values), (contour[0], values[0])]):
        if s_p >= 0:
            inside.append(p)
        if (s_p > 0 > s_q) or (s_p < 0 < s_q):
            forward, back = (s_p, s_q) if s_p > 0 else (-s_p, -s_q)
            cut = reduced([forward * y - back * x for x, y in zip(p, q)])
            if max(map(int.bit_length, cut)) > MOST_BITS:
                raise TooComplexError(f"an exact vertex needs more than {MOST_BITS} bits; use fewer planes")
            inside.append(cut)
            n_contacts += 1
    return merge_repeated(inside), n_contacts, True


def clip_polygon(
    rings: Sequence[Sequence[Sequence[float]]], planes: Sequence[Row], check: Callable[[], object]
) -> tuple[list[list[list[float]]], bool]:
    """Return the contours of one polygon clipped by all planes, correctly rounded, and whether it may have bridge
    edges. rings: contours of at least one vertex each. planes: integer rows, applied in order. check: called for each
    plane. A contour that vanishes is an empty list. Raises: TooComplexError."""
    contours = []
    for ring in rings:
        dimension = len(ring[0])
        numbers, w = common_integers([x for vertex in ring for x in vertex])
        contours.append(
            merge_repeated([reduced((*numbers[i : i + dimension], w)) for i in range(0, len(numbers), dimension)])
        )
    may_have_bridges = False
    for row in planes:
        check()
        n_contacts, has_dropped = 0, False
        for i_contour, contour in enumerate(contours):
            if contour:
                contours[i_contour], met, dropped = clip_contour(contour, row)
                n_contacts, has_dropped = n_contacts + met, has_dropped or dropped
        may_have_bridges = may_have_bridges or (has_dropped and n_contacts > 2)
    may_have_bridges = may_have_bridges and any(contours)
    return [[[nearest(x, vertex[-1]) for x in vertex[:-1]] for vertex in contour] for contour in contours], (
        may_have_bridges
    )
