"""Pieces of segments: their arrays, exact ones, profiles."""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np

from engine.running.budget import Budget, Cancel
from engine.segment_clipping.exact_pieces import (
    FIRST,
    Contact,
    edge_overlap,
    is_crossed,
    nodes_with_locations,
    triangle_overlap,
)
from engine.segment_clipping.pieces import allocate_pieces, joined, point_of, put_own_end
from engine.segment_clipping.profiles import exact_pieces
from engine.solids.polygon import Polygon
from engine.solids.primitives import Convex, Sphere
from tests.unit.segment_clipping.scenes import settled_alone


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
        assert edge_overlap(p, q, a, b) == edge_overlap(p, q, b, a) == expected


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
            assert triangle_overlap(p, q, *turned) == expected
    assert triangle_overlap((0, 1, 0), (4, 1, 0), (2, 0, 0), (2, 2, 0), (2, 1, 0)) == (half, half, True)  # no area


def test_what_holds_in_the_spans_between_contacts() -> None:
    t = [Fraction(k, 8) for k in range(9)]
    contacts = [Contact(t[2], t[4], 7, True, False), Contact(t[4], t[4], 3, False, True)]
    contacts.append(Contact(t[6], t[6], 1, False, False))

    def spans(p: int, q: int, asked: int = 0) -> list[tuple[Fraction, bool, bool]]:
        found = nodes_with_locations(contacts, (p, q), lambda at: {t[1]: asked}[at])
        return [(at, is_along, is_in) for at, _, is_along, is_in in found]

    outside_first = [(FIRST, False, False), (t[2], True, False), (t[4], False, True), (t[6], False, True)]
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


# --- Pieces as kernels write them, and what joins them ---


def test_an_own_end_is_written_without_negative_zeros_and_parts_are_joined() -> None:
    for dimension in (2, 3):
        segments = np.array([[[-0.0, 1.0, 2.0], [3.0, -0.0, 5.0]]])[:, :, :dimension].copy()
        pieces = allocate_pieces(1, dimension)
        pieces.source[0] = 7
        for end in range(2):
            put_own_end(pieces, 0, end, segments, 0, dimension == 2)
        assert point_of(segments, 0, 1, dimension == 2) == (3.0, 0.0, 5.0 if dimension == 3 else 0.0)
        both = joined([pieces, pieces])
        assert both.ends.tobytes() == np.repeat(segments + 0.0, 2, axis=0).swapaxes(0, 1).tobytes()
        assert (both.source.tolist(), both.t.tolist(), both.faces.tolist()) == ([7, 7], [[0, 1]] * 2, [[-1, -1]] * 2)


# --- One segment on solids in whole numbers, against the same in Fractions; thousands of crossings ---


def test_planes_cut_where_fractions_say() -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        (p, q), rows = rng.integers(-4, 5, (2, 3)) / 2, np.c_[rng.integers(-2, 3, (4, 3)), rng.integers(-1, 4, 4)] * 1.0
        rows = rows[rows[:, :3].any(axis=1)]
        low, high = Fraction(0), Fraction(1)
        for row in rows:
            s_p, s_q = (Fraction(float(row[:3] @ end + row[3])) for end in (p, q))  # small numbers: no rounding
            if s_p < 0 or s_q < 0:
                t = s_p / (s_p - s_q) if s_p != s_q else Fraction(2)
                low = max(low, t if s_p < 0 or s_p == s_q else low)
                high = min(high, t if s_q < 0 <= s_p else high)
                low = Fraction(2) if s_p < 0 and s_q < 0 else low
        piece = settled_alone(p.tolist(), q.tolist(), Convex(rows))
        assert (piece is None) == (low > high)
        if piece is not None:
            assert piece.t == (float(low), float(high))
            at = [[float(Fraction(x) + t * Fraction(y - x)) for x, y in zip(p, q)] for t in (low, high)]
            assert [piece.start, piece.end] == at


def test_a_ball_is_entered_and_left_on_its_surface() -> None:
    ball = Sphere([0.0, 0.0], 5.0)
    assert settled_alone([-10.0, 3.0], [10.0, 3.0], ball) == ((0.3, 0.7), [-4.0, 3.0], [4.0, 3.0], (0, 0))
    assert settled_alone([-10.0, 5.0], [10.0, 5.0], ball) == ((0.5, 0.5), [0.0, 5.0], [0.0, 5.0], (0, 0))
    assert settled_alone([-10.0, 5.1], [10.0, 5.1], ball) is None


def test_thousands_of_crossings_are_sorted() -> None:
    """Teeth of a comb, crossed along it; the deadline is polled meanwhile."""
    n = 3000
    teeth = [[[x, -1.0], [x, 1.0], [x + 1.0, 1.0], [x + 1.0, -1.0]] for x in map(float, range(1, n, 2))]
    with Budget(None, Cancel()) as budget:
        found = exact_pieces([0.5, 0.0], [n + 0.5, 0.0], Polygon(teeth), None, budget)
    assert len(found) == n // 2
    assert [piece.rounded([0.5, 0.0], [n + 0.5, 0.0]).start[0] for piece in found] == [float(x) for x in range(1, n, 2)]
