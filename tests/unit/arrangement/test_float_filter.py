"""The filter never contradicts exact arithmetic, settles easy pairs, and is unsure beyond the exponent range."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine.arrangement.float_filter import CROSS, MISS, classify_pairs
from engine.parallel import Budget
from engine.types import UNDECIDED


def exact_turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> int:
    ax, ay, bx, by, cx, cy = (Fraction(float(value)) for value in (*a, *b, *c))
    value = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    return (value > 0) - (value < 0)


@pytest.mark.parametrize("scale", [1.0, 2.0**-40, 2.0**500, 2.0**-530, 2.0**-1060])
def test_sure_verdicts_are_right(scale: float) -> None:
    random = np.random.default_rng(3)
    points = random.integers(0, 5, (400, 2)) + random.choice([0.0, 2.0**-50], (400, 2))
    points = points * scale
    segments = np.arange(400).reshape(-1, 2)
    pairs = random.integers(0, 200, (3000, 2))
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    verdicts = classify_pairs(points, segments, pairs, Budget())
    for (i, j), verdict in zip(pairs, verdicts, strict=True):
        (a, b), (c, d) = points[segments[i]], points[segments[j]]
        first = exact_turn(a, b, c) * exact_turn(a, b, d)
        second = exact_turn(c, d, a) * exact_turn(c, d, b)
        if verdict == CROSS:
            assert first == second == -1
        elif verdict == MISS:
            assert first == 1 or second == 1
    if 2.0**-500 < scale < 2.0**400:
        assert (verdicts != UNDECIDED).mean() > 0.5


def test_segments_that_share_an_end_miss_unless_collinear() -> None:
    points = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (2.0, 0.0)])
    segments = np.array([(0, 1), (0, 2), (0, 3)])
    assert classify_pairs(points, segments, np.array([(0, 1), (0, 2)]), Budget()).tolist() == [MISS, UNDECIDED]


def test_overflow_is_unsure() -> None:
    points = np.array([(-1e300, 0.0), (1e300, 1.0), (0.0, -1e300), (0.0, 1e300)])
    assert classify_pairs(points, np.array([(0, 1), (2, 3)]), np.array([(0, 1)]), Budget()).tolist() == [UNDECIDED]
