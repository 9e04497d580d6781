"""One segment in whole numbers, against the same in Fractions."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from engine.segment_clipping.exact_segments import clip_by_planes, clip_by_sphere


def test_planes_cut_where_fractions_say() -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        (p, q), rows = rng.integers(-4, 5, (2, 3)) / 2, np.c_[rng.integers(-2, 3, (4, 3)), rng.integers(-1, 4, 4)] * 1.0
        low, high = Fraction(0), Fraction(1)
        for row in rows:
            s_p, s_q = (Fraction(float(row[:3] @ end + row[3])) for end in (p, q))  # small numbers: no rounding
            if s_p < 0 or s_q < 0:
                t = s_p / (s_p - s_q) if s_p != s_q else Fraction(2)
                low = max(low, t if s_p < 0 or s_p == s_q else low)
                high = min(high, t if s_q < 0 <= s_p else high)
                low = Fraction(2) if s_p < 0 and s_q < 0 else low
        piece = clip_by_planes(p.tolist(), q.tolist(), rows.tolist())
        assert (piece is None) == (low > high)
        if piece is not None:
            assert piece.t == (float(low), float(high))
            at = [[float(Fraction(x) + t * Fraction(y - x)) for x, y in zip(p, q)] for t in (low, high)]
            assert [piece.start, piece.end] == at


def test_a_ball_is_entered_and_left_on_its_surface() -> None:
    piece = clip_by_sphere([-10.0, 3.0], [10.0, 3.0], [0.0, 0.0], 5.0)
    assert piece == ((0.3, 0.7), [-4.0, 3.0], [4.0, 3.0], (0, 0))
    assert clip_by_sphere([-10.0, 5.0], [10.0, 5.0], [0.0, 0.0], 5.0) == ((0.5, 0.5), [0.0, 5.0], [0.0, 5.0], (0, 0))
    assert clip_by_sphere([-10.0, 5.1], [10.0, 5.1], [0.0, 0.0], 5.0) is None
