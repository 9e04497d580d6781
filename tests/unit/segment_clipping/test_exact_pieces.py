"""Where a segment meets edges and triangles, in whole numbers."""

from __future__ import annotations

import itertools
from fractions import Fraction

from engine.segment_clipping.exact_pieces import Contact, edge_stretch, face_at, spans_of, triangle_stretch


def test_edges_are_met_in_points_and_stretches() -> None:
    half = Fraction(1, 2)
    cases = [
        ((0, 0), (4, 0), (2, -1), (2, 1), (half, half, False)),
        ((0, 0), (4, 0), (2, 1), (2, 2), None),
        ((0, 0), (4, 0), (1, 0), (2, 0), (Fraction(1, 4), half, True)),
        ((0, 0), (4, 0), (6, 0), (2, 0), (half, 1, True)),
        ((0, 0), (4, 0), (2, 0), (2, 0), (half, half, True)),  # an edge of no length
        ((0, 0), (4, 0), (0, 1), (4, 1), None),  # parallel
        ((0, 0, 0), (4, 0, 0), (2, -1, 1), (2, 1, 1), None),  # the lines pass each other
    ]
    for p, q, a, b, expected in cases:
        assert edge_stretch(p, q, a, b) == edge_stretch(p, q, b, a) == expected


def test_triangles_are_met_whichever_way_they_are_turned() -> None:
    half, corners = Fraction(1, 2), ((0, 0, 0), (4, 0, 0), (0, 4, 0))
    cases = [
        ((1, 1, -1), (1, 1, 1), (half, half, False)),
        ((3, 3, -1), (3, 3, 1), None),
        ((2, 2, -1), (2, 2, 1), (half, half, False)),  # through an edge
        ((-4, 1, 0), (4, 1, 0), (half, Fraction(7, 8), True)),  # in the plane
        ((-1, 1, 1), (9, 1, 1), None),  # parallel to it
    ]
    for p, q, expected in cases:
        for turned in itertools.permutations(corners):
            assert triangle_stretch(p, q, *turned) == expected
    assert triangle_stretch((0, 1, 0), (4, 1, 0), (2, 0, 0), (2, 2, 0), (2, 1, 0)) == (half, half, True)  # no area


def test_spans_that_hang_together_are_one_piece() -> None:
    t = [Fraction(k, 8) for k in range(9)]
    contacts = [Contact(t[2], t[4], 7, True), Contact(t[4], t[4], 3, False), Contact(t[6], t[6], 1, False)]
    assert spans_of(contacts, lambda first, last: False) == [[t[2], t[4]], [t[6], t[6]]]
    assert spans_of(contacts, lambda first, last: first == t[4]) == [[t[2], t[6]]]
    assert (face_at(contacts, t[3]), face_at(contacts, t[4])) == (7, 3)
