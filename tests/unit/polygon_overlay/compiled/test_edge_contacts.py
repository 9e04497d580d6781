"""Contacts of edges, kind by kind, against the integers, in all four operations; and which are reported far apart."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine.polygon_overlay.compiled.edge_contacts import segments_are_far
from tests.unit.polygon_overlay.checks import OPERATIONS
from tests.unit.polygon_overlay.compiled.test_crossings import Point, cross
from tests.unit.polygon_overlay.compiled.test_kernel import agree

SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]
KINDS = {
    "proper crossing": [(1, 1), (6, 2), (1, 3)],
    "vertex in an edge": [(4, 2), (7, 1), (7, 3)],
    "vertex on vertex": [(4, 4), (7, 4), (7, 7)],
    "edge through a vertex": [(3, 5), (5, 3), (6, 6)],
    "overlap, one within the other": [(4, 1), (4, 3), (6, 2)],
    "overlap, end in each": [(4, 2), (4, 6), (6, 4)],
    "overlap, one end in common": [(4, 0), (4, 2), (6, 1)],
    "equal edges": [(4, 0), (4, 4), (6, 2)],
    "fold": [(1, 1), (3, 1), (2, 1), (2, 3)],
    "fold across": [(2, 2), (9, 2), (3, 2), (3, 3)],
    "three lines through one point": [(2, -1), (4, 4), (6, 9), (1, 4)],
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("turn", range(4))
def test_contact(kind: str, turn: int) -> None:
    subject, clip = np.array(SQUARE, float), np.array(KINDS[kind], float)
    if turn & 1:
        clip = clip[::-1]
    if turn & 2:
        subject, clip = np.roll(subject, 1, axis=0) / 3.0, clip / 3.0
    for operation in OPERATIONS:
        assert agree([subject], [clip], operation)
        assert agree([clip], [subject], operation)


def square_of_distance(p: Point, a: Point, b: Point) -> Fraction:
    """Return the square of the distance of a point from a segment."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = dx * dx + dy * dy
    t = (
        min(max(((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / length, Fraction(0)), Fraction(1))
        if length
        else Fraction(0)
    )
    return (a[0] + t * dx - p[0]) ** 2 + (a[1] + t * dy - p[1]) ** 2


@pytest.mark.parametrize("seed", range(200))
def test_far_apart(seed: int) -> None:
    random = np.random.default_rng(seed)
    ends = random.integers(-4, 5, (4, 2)).astype(float)
    a, b, c, d = [(Fraction(x), Fraction(y)) for x, y in ends.tolist()]
    crosses = cross(a, b, c) * cross(a, b, d) < 0 and cross(c, d, a) * cross(c, d, b) < 0
    pairs = ((a, c, d), (b, c, d), (c, a, b), (d, a, b))
    square = Fraction(0) if crosses else min(square_of_distance(*each) for each in pairs)
    x, y = np.ascontiguousarray(ends.T)
    for margin in (0.25, 1.0, 4.0):
        is_far = segments_are_far(x, y, 0, 1, 2, 3, margin)
        assert not is_far or square > margin * (1 - 2.0**-40)
        assert is_far or square < margin * (1 + 2.0**-40)
