"""How a segment and a triangle meet: the filter never says what exact signs do not."""

from __future__ import annotations

import numpy as np

from engine.segment_clipping.exact_pieces import triangle_stretch
from engine.segment_clipping.on_boundary.contacts import APART, DEGENERATE, PROPER
from engine.segment_clipping.on_boundary.triangle_contact import contact_filter, exact_contact
from engine.types import UNDECIDED, Point3


def test_contacts_are_those_of_whole_numbers() -> None:
    """What is apart is not met, what is proper is met within; the filter agrees where it says anything."""
    rng = np.random.default_rng(1)
    n_told = 0
    for _ in range(300):
        numbers = rng.integers(-4, 5, (5, 3))
        if (numbers[3] == numbers[4]).all():
            continue
        points = [Point3(*row) for row in (numbers * 0.25).tolist()]
        kind, rough = exact_contact(*points), contact_filter(*points, 0.0)
        n_told += rough != UNDECIDED
        a, b, c, p, q = numbers.tolist()
        stretch = triangle_stretch(p, q, a, b, c)
        assert rough in (kind, UNDECIDED) or (rough == APART and stretch is None)
        assert kind in (APART, DEGENERATE) if stretch is None else kind != APART
        if stretch is not None:
            assert (kind == DEGENERATE) == stretch[2]
            assert kind != PROPER or 0 < stretch[0] == stretch[1] < 1
    assert n_told > 150
