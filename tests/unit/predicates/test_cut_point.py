"""Points on segments: nearest doubles, or said to be unsure."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from engine.predicates.cut_point import nearest, point_at
from engine.predicates.double_double import dd_add, dd_div


def test_points_are_the_nearest_doubles() -> None:
    """Also midpoints between doubles, zeros and subnormal numbers, where double-doubles leave it to signs."""
    rng = np.random.default_rng(1)
    n_sure, e = 0, np.empty(96)
    for turn in range(300):
        p, q = (rng.integers(-8, 9, 2) * (1.0, 2.0**-52 / 3, 2.0**-1070)[turn % 3]).tolist()
        wp, wq = (rng.integers(1, 9, 2) * 1.0).tolist()
        exact = float((Fraction(p) * Fraction(wq) + Fraction(q) * Fraction(wp)) / (Fraction(wp) + Fraction(wq)))
        total = dd_add(wp, 0.0, wq, 0.0)
        x, is_sure = nearest(p, q, np.array([wp]), 1, np.array([wq]), 1, *total, e)
        assert is_sure
        assert x == exact
        if turn % 3 < 2:
            x, is_sure = point_at(p, q, *dd_div(wp, 0.0, *total), 0.0)
            n_sure += is_sure
            assert x == exact or not is_sure
    assert n_sure > 50
