"""The stab straight down, against all edges in rational arithmetic."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine.arrangement.arrange import Arrangement
from engine.arrangement.subdivision import EdgesBelow
from tests.unit.arrangement.segments import arrange_segments


def slow_edge_below(arrangement: Arrangement, node: int) -> int:
    """All edges that span x + 0, by height at x, then by slope."""
    x, y = arrangement.nodes.exact(node)
    found: list[tuple[Fraction, Fraction, int]] = []
    for edge, (tail, head) in enumerate(zip(arrangement.tails, arrangement.heads, strict=True)):
        (px, py), (qx, qy) = arrangement.nodes.exact(tail), arrangement.nodes.exact(head)
        if px <= x < qx:
            slope = (qy - py) / (qx - px)
            if (height := py + slope * (x - px)) < y:
                found.append((height, slope, edge))
    return max(found)[2] if found else -1


@pytest.mark.parametrize("seed", range(6))
def test_equals_the_slow_answer(seed: int) -> None:
    random = np.random.default_rng(seed)
    segments = [tuple(map(tuple, segment)) for segment in random.integers(0, 9, (14, 2, 2)).astype(float).tolist()]
    arrangement = arrange_segments(segments)
    below = EdgesBelow(arrangement)
    for node in {*arrangement.tails, *arrangement.heads}:
        assert below.find(node) == slow_edge_below(arrangement, node)
