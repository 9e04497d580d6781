"""Where segments meet triangles."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine.predicates.rational import orient2d_rational
from engine.segment_clipping.exact_pieces import triangle_overlap
from engine.segment_clipping.on_boundary.contacts import NO_ROOM, Bit, Kind, Place, find_contacts_2d
from engine.segment_clipping.on_boundary.crossing_values import cut_at, is_item_safe, line_values, plane_values
from engine.segment_clipping.on_boundary.mesh_contacts import contact_filter, exact_contact
from engine.segment_clipping.on_boundary.prepared_boundary import outline_of
from engine.types import UNDECIDED, Point3


def contact(edge: list[list[float]], segment: list[list[float]]) -> int:
    signs = [orient2d_rational(*segment, end) for end in edge], [orient2d_rational(*edge, end) for end in segment]
    if any(pair in ([1, 1], [-1, -1]) for pair in signs):
        return Kind.APART
    if all(sorted(pair) == [-1, 1] for pair in signs):
        return Kind.PROPER
    (of_a, of_b), (of_p, of_q) = signs
    if of_a == of_b == 0:
        return Kind.DEGENERATE if edge[0] == edge[1] else Bit.ALONG
    place = Place.START if of_p == 0 else Place.END if of_q == 0 else 0 if of_a == 0 else 1
    return 2 * place + 4 + ((of_a > 0) != (of_b > 0))


def test_contacts_are_those_of_all_edges() -> None:
    rng = np.random.default_rng(1)
    edges, segments = rng.integers(-3, 4, (30, 2, 2)) * 0.5, rng.integers(-3, 4, (20, 2, 2)) * 0.5
    segments[0, 1] = segments[0, 0]
    outline, stop = outline_of(edges, np.arange(30), np.array([0, 30])), np.zeros(1, np.uint8)
    n, met, kinds, offsets = find_contacts_2d(segments, outline, stop, 1000)
    assert n == offsets[-1] > 20
    for i, segment in enumerate(segments.tolist()):
        mine = slice(offsets[i], offsets[i + 1])
        found = dict(zip(met[mine].tolist(), kinds[mine].tolist()))
        surely = {k: contact(edge, segment) for k, edge in enumerate(edges.tolist()) if i > 0}
        # boxes keep apart what only lines that touch, or points on a line, leave open
        assert {k: kind for k, kind in found.items() if kind == Kind.PROPER} == {
            k: kind for k, kind in surely.items() if kind == Kind.PROPER
        }
        assert found.items() <= surely.items()
    assert find_contacts_2d(segments, outline, stop, 3)[0] == NO_ROOM


# --- How a segment and a triangle meet: the filter never says what exact signs do not ---


def test_contacts_are_those_of_whole_numbers() -> None:
    """What is apart is not met, what is proper is met within; the filter agrees where it says anything."""
    rng = np.random.default_rng(1)
    n_told = 0
    for _ in range(300):
        numbers = rng.integers(-4, 5, (5, 3))
        if (numbers[3] == numbers[4]).all():
            continue
        points = [Point3(*row) for row in (numbers * 0.25).tolist()]
        kind, rough = exact_contact(*points), contact_filter(*points, 0.0)
        n_told += rough != UNDECIDED
        a, b, c, p, q = numbers.tolist()
        stretch = triangle_overlap(p, q, a, b, c)
        assert rough in (kind, UNDECIDED) or (rough == Kind.APART and stretch is None)
        assert kind in (Kind.APART, Kind.DEGENERATE) if stretch is None else kind != Kind.APART
        if stretch is not None:
            assert (kind == Kind.DEGENERATE) == stretch[2]
            assert kind != Kind.PROPER or 0 < stretch[0] == stretch[1] < 1
    assert n_told > 150


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
    values = line_values if dimension == 2 else plane_values
    elements = rng.uniform(-1, 1, (40, dimension, dimension)) * 2.0 ** rng.integers(-30, 30, (40, 1, 1))
    segments = elements.mean(axis=1)[:, None] + rng.uniform(-1, 1, (40, 2, dimension))
    points = np.empty((1, dimension))
    for i, (element, segment) in enumerate(zip(elements.tolist(), segments.tolist())):
        p, q = ([Fraction(x) for x in end] for end in segment)
        at_p = exact_value(element, [x - Fraction(y) for x, y in zip(p, element[0])])
        along = exact_value(element, [x - y for x, y in zip(p, q)])
        found = values(elements, i, segments, i)
        for exact, (h, low, bound) in zip((at_p, along), found):
            assert abs(Fraction(h) + Fraction(low) - exact) <= Fraction(bound)
        t, is_sure = cut_at(segments, i, elements, i, points, 0)
        if is_sure and 0 <= at_p / along <= 1:
            exact_t = at_p / along
            assert t == float(exact_t)
            assert points[0].tolist() == [float(x + exact_t * (y - x)) for x, y in zip(p, q)]


def test_items_out_of_range_are_not_safe() -> None:
    items = np.ones((3, 2, 2))
    items[1, 1, 0], items[2, 0, 1] = 1e-300, 0.0
    assert [is_item_safe(items, i) for i in range(3)] == [True, False, True]
