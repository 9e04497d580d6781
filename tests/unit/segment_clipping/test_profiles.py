"""One segment on solids in whole numbers, against the same in Fractions; thousands of crossings."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from engine.budget import Budget, Cancel
from engine.segment_clipping.profiles import exact_pieces
from engine.solids.convex import Convex
from engine.solids.polygon import Polygon
from engine.solids.sphere import Sphere
from tests.unit.segment_clipping.scenes import settled_alone


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
    """Teeth of a comb, crossed along it; asked whether to stop meanwhile."""
    n = 3000
    teeth = [[[x, -1.0], [x, 1.0], [x + 1.0, 1.0], [x + 1.0, -1.0]] for x in map(float, range(1, n, 2))]
    with Budget(None, Cancel()) as budget:
        found = exact_pieces([0.5, 0.0], [n + 0.5, 0.0], Polygon(teeth), None, budget)
    assert len(found) == n // 2
    assert [piece.rounded([0.5, 0.0], [n + 0.5, 0.0]).start[0] for piece in found] == [float(x) for x in range(1, n, 2)]
