"""Where segments meet triangles."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine.predicates.rational import cross, minus, orient2d_rational
from engine.segment_clipping.exact_pieces import edge_overlap, triangle_overlap
from engine.segment_clipping.on_boundary.contacts import CODE_BITS, CROSSED, NO_ROOM, Bit, Kind, Place, find_contacts_2d
from engine.segment_clipping.on_boundary.crossing_values import cut_at, is_item_safe, line_values, plane_values
from engine.segment_clipping.on_boundary.prepared_boundary import outline_of
from engine.segment_clipping.on_boundary.triangle_contacts import contact_filter, exact_contact
from engine.types import UNDECIDED, Point3


def contact(edge: list[list[float]], segment: list[list[float]]) -> list[int]:
    """Return the kind or the codes of the contact of an edge and a segment, in halves; [] if they are apart."""
    signs = [orient2d_rational(*segment, end) for end in edge], [orient2d_rational(*edge, end) for end in segment]
    if any(pair in ([1, 1], [-1, -1]) for pair in signs):
        return []
    if all(sorted(pair) == [-1, 1] for pair in signs):
        return [Kind.PROPER]
    (of_a, of_b), (of_p, of_q) = signs
    if of_a == of_b == 0:
        p, q, a, b = ([int(2 * x) for x in point] for point in (*segment, *edge))
        overlap = edge_overlap(p, q, a, b)
        return [Kind.DEGENERATE] if a == b else [] if overlap is None else overlap_codes(p, q, [a, b], *overlap[:2])
    place = Place.START if of_p == 0 else Place.END if of_q == 0 else 0 if of_a == 0 else 1
    return [2 * place + 4 + ((of_a > 0) != (of_b > 0))]


def overlap_codes(p: list[int], q: list[int], corners: list[list[int]], first: Fraction, last: Fraction) -> list[int]:
    """Return the codes of the overlap, from one parameter to another, of a segment with an edge or a triangle."""

    def at(t: Fraction) -> int:
        point = [x + t * (y - x) for x, y in zip(p, q)]
        if t in (0, 1):
            return int(Place.START + t)
        if point in corners:
            return corners.index(point)
        ends = zip(corners, [*corners[1:], corners[0]])
        return 3 + [not any(cross(minus(b, a), minus(point, a))) for a, b in ends].index(True)  # type: ignore[arg-type]

    codes = [2 * at(t) + 4 + Bit.ALONG for t in (first, last)]
    return [codes[0] + Bit.BEGINS, codes[1] + Bit.CEASES] if first < last else codes[:1]


def test_contacts_are_those_of_all_edges() -> None:
    rng = np.random.default_rng(1)
    edges, segments = rng.integers(-3, 4, (30, 2, 2)) * 0.5, rng.integers(-3, 4, (20, 2, 2)) * 0.5
    segments[0, 1] = segments[0, 0]
    outline, stop = outline_of(edges, np.arange(30), np.array([0, 30])), np.zeros(1, np.uint8)
    n, met, kinds, offsets = find_contacts_2d(segments, outline, stop, 1000)
    assert n == offsets[-1] > 20
    for i, segment in enumerate(segments.tolist()):
        mine = slice(offsets[i], offsets[i + 1])
        found = sorted(zip(met[mine].tolist(), kinds[mine].tolist()))
        surely = [(k, kind) for k, edge in enumerate(edges.tolist()) if i > 0 for kind in contact(edge, segment)]
        # boxes keep apart what only edges that are points leave open
        assert set(found) <= set(surely)
        assert [pair for pair in found if pair[1] != Kind.DEGENERATE] == sorted(
            pair for pair in surely if pair[1] != Kind.DEGENERATE
        )
    assert find_contacts_2d(segments, outline, stop, 3)[0] == NO_ROOM


# --- How a segment and a triangle meet: the filter never says what exact signs do not ---


def test_contacts_are_those_of_whole_numbers() -> None:
    """What is apart is not met, what is proper is met within; the filter agrees where it says anything."""
    rng = np.random.default_rng(1)
    n_told = n_along = 0
    for _ in range(3000):
        numbers = rng.integers(-2, 3, (5, 3))
        if (numbers[3] == numbers[4]).all():
            continue
        points = [Point3(*row) for row in (numbers * 0.25).tolist()]
        kind, rough = exact_contact(*points, False), contact_filter(*points, 0.0)
        n_told += rough != UNDECIDED
        a, b, c, p, q = numbers.tolist()
        stretch = triangle_overlap(p, q, a, b, c)
        assert rough in (kind, UNDECIDED) or (rough == Kind.APART and stretch is None)
        has_area = any(cross(minus(b, a), minus(c, a)))
        assert (kind == Kind.DEGENERATE) == (not has_area and kind != Kind.APART)
        assert kind == Kind.APART or stretch is not None or not has_area
        if stretch is not None and has_area:
            codes = [kind & 255, kind >> CODE_BITS] if kind >> CODE_BITS else [kind]
            assert codes == overlap_codes(p, q, [a, b, c], *stretch[:2]) if stretch[2] else not kind & Bit.ALONG
            assert kind != Kind.PROPER or 0 < stretch[0] == stretch[1] < 1
            n_along += stretch[2]
    assert n_told > 1500
    assert n_along > 10


def test_the_filter_does_not_depend_on_the_units_of_an_axis() -> None:
    """Axes stretched by powers of two change no answer, and hardly any is left open."""
    rng = np.random.default_rng(4)
    n_left = 0
    for _ in range(300):
        points = rng.uniform(-1, 1, (5, 3))
        points[4] = points[:3].mean(axis=0) * rng.uniform(0.5, 2.0) + rng.uniform(-1, 1, 3)
        stretched = points * 2.0 ** rng.integers(-40, 40, 3)
        kind = contact_filter(*(Point3(*row) for row in points.tolist()), 0.0)
        assert contact_filter(*(Point3(*row) for row in stretched.tolist()), 0.0) == kind
        n_left += kind == UNDECIDED
    assert n_left < 5


def test_segments_in_the_plane_of_a_triangle() -> None:
    """Segments and triangles of a lattice: the codes are those of rational parameters."""
    rng = np.random.default_rng(3)
    for numbers in rng.integers(-2, 3, (3000, 5, 2)).tolist():
        a, b, c, p, q = ([x, y, 2 * x - 3 * y] for x, y in numbers)
        if p == q:
            continue
        kind, stretch = exact_contact(*(Point3(*map(float, row)) for row in (a, b, c, p, q)), False), None
        if any(cross(minus(b, a), minus(c, a))):
            stretch = triangle_overlap(p, q, a, b, c)
            codes = [kind & 255, kind >> CODE_BITS] if kind >> CODE_BITS else [kind]
            assert codes == ([Kind.APART] if stretch is None else overlap_codes(p, q, [a, b, c], *stretch[:2]))


# --- Signed distances and where they say that elements are crossed ---


def exact_value(element: Any, w: Any) -> Fraction:
    a = [Fraction(x) for x in element[0]]
    u, v = ([Fraction(x) - y for x, y in zip(corner, a)] for corner in (element[1], element[-1]))
    if len(a) == 2:
        return u[0] * w[1] - u[1] * w[0]
    normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    return sum((x * y for x, y in zip(normal, w)), Fraction(0))


@pytest.mark.parametrize("dimension", [2, 3])
def test_values_and_crossings_are_those_of_rationals(dimension: int) -> None:
    rng = np.random.default_rng(dimension)
    elements = rng.uniform(-1, 1, (40, dimension, dimension)) * 2.0 ** rng.integers(-30, 30, (40, 1, 1))
    segments = elements.mean(axis=1)[:, None] + rng.uniform(-1, 1, (40, 2, dimension))
    points = np.empty((1, dimension))
    for i, (element, segment) in enumerate(zip(elements.tolist(), segments.tolist())):
        p, q = ([Fraction(x) for x in end] for end in segment)
        at_p = exact_value(element, [x - Fraction(y) for x, y in zip(p, element[0])])
        along = exact_value(element, [x - y for x, y in zip(p, q)])
        line = line_values(elements, i, (0, 1, 0, 1), segments, i)
        found = line if dimension == 2 else plane_values(elements, i, segments, i)
        for exact, (h, low, bound) in zip((at_p, along), found):
            assert abs(Fraction(h) + Fraction(low) - exact) <= Fraction(bound)
        t, is_sure = cut_at(segments, i, elements, i, CROSSED, points, 0)
        if is_sure and 0 <= at_p / along <= 1:
            exact_t = at_p / along
            assert t == float(exact_t)
            assert points[0].tolist() == [float(x + exact_t * (y - x)) for x, y in zip(p, q)]


def test_items_out_of_range_are_not_safe() -> None:
    items = np.ones((3, 2, 2))
    items[1, 1, 0], items[2, 0, 1] = 1e-300, 0.0
    assert [is_item_safe(items, i) for i in range(3)] == [True, False, True]
