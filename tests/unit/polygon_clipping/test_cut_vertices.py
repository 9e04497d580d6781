"""Coordinates of cuts: each within its bound of the exact value."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from engine.polygon_clipping.cut_vertices import Share, between, is_at, on_edge, share_of_edge
from engine.predicates.double_double import dd_add, dd_div


def test_cuts_are_within_their_bounds() -> None:
    rng = np.random.default_rng(2)
    for _ in range(300):
        a, b, x, y = (rng.uniform(-1, 1, 4) * 10.0 ** rng.integers(-9, 9, 4)).tolist()
        place = a + rng.random() * (b - a)
        if not min(a, b) < place < max(a, b):
            continue
        exact = Fraction(x) + (Fraction(a) - Fraction(place)) / (Fraction(a) - Fraction(b)) * (
            Fraction(y) - Fraction(x)
        )
        th, tl, is_known = share_of_edge(a, b, place)
        h, rest, bound = on_edge(x, y, th, tl)
        assert is_known
        assert abs(Fraction(h) + Fraction(rest) - exact) <= Fraction(bound)
        assert not is_at(x, y, a, b, place, h) or Fraction(h) == exact


def test_a_cut_between_cut_vertices_is_within_its_bound() -> None:
    rng = np.random.default_rng(3)
    for _ in range(300):
        x, y = rng.uniform(-1, 1, 2).tolist()
        ph, qh = rng.uniform(0.1, 1, 2).tolist()
        (x_low, pl), (y_low, ql) = rng.uniform(-1, 1, (2, 2)) * 2.0**-56
        sum_h, sum_l = dd_add(ph, pl, qh, ql)
        th, tl = dd_div(ph, pl, sum_h, sum_l)
        share = Share(ph, pl, qh, ql, sum_h, sum_l, th, tl, 0.0)
        p, q = Fraction(ph) + Fraction(pl), Fraction(qh) + Fraction(ql)
        for low in (0.0, 1.0):
            first, second = Fraction(x) + Fraction(low * x_low), Fraction(y) + Fraction(low * y_low)
            h, rest, bound = between((x, low * x_low, 0.0), (y, low * y_low, 0.0), share)
            assert abs(Fraction(h) + Fraction(rest) - (first * q + second * p) / (p + q)) <= Fraction(bound)


def test_a_cut_at_a_double_is_known_to_be_there() -> None:
    assert is_at(0.0, 1.0, 0.0, 4.0, 1.0, 0.25)
    assert not is_at(0.0, 1.0, 0.0, 3.0, 1.0, 1 / 3)
