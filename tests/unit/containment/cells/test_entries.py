"""Entries of a cell: their signs are those of exact arithmetic beyond the band."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.containment.cells.entries import set_entry, set_nothing
from engine.lanes.cells import group_parity, groups_of
from engine.lanes.tracing import LANES
from engine.types import UNDECIDED


def exact_crossing(a: Any, b: Any, c: Any, x: Any) -> int | None:
    """Return whether the segment from 0 to x crosses the triangle, None where anything is degenerate; in integers."""
    from fractions import Fraction

    p = [[Fraction(float(value)) for value in point] for point in (a, b, c, x)]

    def volume(u: Any, v: Any, w: Any) -> Fraction:
        crossed = [u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3] for k in range(3)]
        return sum((m * n for m, n in zip(crossed, w)), Fraction(0))

    def less(u: Any, v: Any) -> Any:
        return [m - n for m, n in zip(u, v)]

    edges = [volume(p[k], p[(k + 1) % 3], p[3]) for k in range(3)]
    of_r = volume(less(p[1], p[0]), less(p[2], p[0]), less([Fraction(0)] * 3, p[0]))
    of_x = volume(less(p[1], p[0]), less(p[2], p[0]), less(p[3], p[0]))
    if of_r == 0 or of_x == 0 or 0 in edges:
        return None
    return int(of_r * of_x < 0 and (min(edges) > 0 or max(edges) < 0))


def test_entries_are_right_beyond_their_band() -> None:
    random = np.random.default_rng(6)
    n_sure = n_crossed = 0
    for case in range(1500):
        a, b, c = random.uniform(-1, 1, (3, 3)) * random.choice([1.0, 30.0, 1e-3]) + random.uniform(-0.3, 0.3, 3)
        if case % 3 == 0:
            c = a + (b - a) * random.uniform(-1, 2) + random.normal(size=3) * 10.0 ** -random.integers(1, 12)
        weights = random.dirichlet([1, 1, 1])
        x = weights[0] * a + weights[1] * b + weights[2] * c
        x = x * (1 + random.choice([0, 1e-7, 1e-6, 1e-5, -1e-5, 0.3])) + random.normal(size=3) * 1e-7
        if np.abs(x).max() > 0.6:
            x = random.uniform(-0.6, 0.6, 3)
        groups, lane = groups_of(1), case % LANES
        with np.errstate(all="ignore"):
            for other in range(LANES):
                set_nothing(groups[0, :, other])
            set_entry(groups[0, :, lane], tuple(a), tuple(b), tuple(c), tuple(b - a), tuple(c - a))
            found = group_parity(groups, 0, *x.astype(np.float32))
        if found < UNDECIDED:
            n_sure += 1
            n_crossed += found
            assert found == exact_crossing(a, b, c, x)
    assert n_sure > 500
    assert n_crossed > 50
