"""Parameters at which segments meet planes, each within its bound, and which is larger."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from engine.segment_clipping.plane_meeting import T_BOUND, gap_between, meeting


def rational(numbers: np.ndarray) -> list[Fraction]:
    return [Fraction(number) for number in numbers.tolist()]


def test_parameters_are_within_their_bound_and_in_their_order() -> None:
    rng = np.random.default_rng(1)
    n_sure = 0
    for _ in range(200):
        ends = rng.integers(-6, 7, (2, 2)) / 3 if rng.random() < 0.5 else rng.integers(-6, 7, (2, 2)) / 2
        places = rng.integers(-3, 4, 2) / 2
        if (ends[:, 0] == ends[:, 1]).any():
            continue
        found = [meeting(p, q, at, float(k)) for k, ((p, q), at) in enumerate(zip(ends.tolist(), places.tolist()))]
        exact = [Fraction(at - p) / Fraction(q - p) for (p, q), at in zip(map(rational, ends), rational(places))]
        for m, t in zip(found, exact):
            assert abs(Fraction(m.t) + Fraction(m.t_low) - t) <= Fraction(T_BOUND) * abs(t)
        gap, is_sure = gap_between(*found)
        n_sure += is_sure
        if is_sure:
            assert (gap > 0) - (gap < 0) == (exact[0] > exact[1]) - (exact[0] < exact[1])
    assert n_sure > 100
