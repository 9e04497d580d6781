"""Where a segment meets edges and triangles, in whole numbers."""

from __future__ import annotations

import itertools
from fractions import Fraction

from engine.segment_clipping.exact_pieces import (
    ZERO,
    Contact,
    edge_stretch,
    is_crossed,
    nodes_with_locations,
    triangle_stretch,
)


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


def test_what_holds_in_the_spans_between_contacts() -> None:
    t = [Fraction(k, 8) for k in range(9)]
    contacts = [Contact(t[2], t[4], 7, True, False), Contact(t[4], t[4], 3, False, True)]
    contacts.append(Contact(t[6], t[6], 1, False, False))

    def spans(p: int, q: int, asked: int = 0) -> list[tuple[Fraction, bool, bool]]:
        found = nodes_with_locations(contacts, (p, q), lambda at: {t[1]: asked}[at])
        return [(at, is_along, is_in) for at, _, is_along, is_in in found]

    outside_first = [(ZERO, False, False), (t[2], True, False), (t[4], False, True), (t[6], False, True)]
    inside_first = [(at, is_along, not is_in) for at, is_along, is_in in outside_first]
    for case in ((-1, 0), (0, 1), (0, 0, -1)):
        assert spans(*case)[:-1] == outside_first
    for case in ((1, 0), (0, -1), (0, 0, 1)):
        assert spans(*case)[:-1] == inside_first


def test_the_line_beside_crosses_what_meets_in_a_vertex_or_an_edge_an_even_number_of_times_around() -> None:
    """A closed surface is crossed as often inwards as outwards, along whatever line of a lattice."""
    corners = list(itertools.product([0, 2], repeat=3))
    faces = [
        (0, 1, 3),
        (0, 3, 2),
        (4, 6, 7),
        (4, 7, 5),
        (0, 4, 5),
        (0, 5, 1),
        (2, 3, 7),
        (2, 7, 6),
        (0, 2, 6),
        (0, 6, 4),
    ]
    faces += [(1, 5, 7), (1, 7, 3)]
    ring = [(0, 0), (2, 0), (2, 2), (1, 1), (0, 2)]
    places = list(itertools.product([-1, 0, 1, 2, 3], repeat=3))
    for p, q in zip(places, places[::-1]):
        if p != q:
            assert sum(is_crossed(p, q, [corners[k] for k in face]) for face in faces) in (0, 2)
        if p[:2] != q[:2]:
            assert sum(is_crossed(p[:2], q[:2], edge) for edge in zip(ring, ring[1:] + ring[:1])) in (0, 2, 4)
