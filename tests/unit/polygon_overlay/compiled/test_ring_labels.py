"""Verdicts on labels of rings against the rule said in sets, and the shell of a region told from boxes alone."""

from __future__ import annotations

import numpy as np
import pytest

from engine.polygon_overlay.compiled.chain_rings import Rings
from engine.polygon_overlay.compiled.ring_labels import MOST_BITS, verdict
from engine.polygon_overlay.compiled.ring_order import Ranking, find_shells
from engine.polygon_overlay.compiled.rounded_crossings import Rounded


@pytest.mark.parametrize("seed", range(20))
def test_verdict(seed: int) -> None:
    random = np.random.default_rng(seed)
    n_rings = int(random.integers(1, MOST_BITS + 1))
    shells = np.maximum.accumulate(np.where(random.random(n_rings) < 0.4, np.arange(n_rings), 0))
    for share in (0.05, 0.5, 0.95):
        within = set(np.flatnonzero(random.random(n_rings) < share).tolist())
        holes = {ring for ring in within if shells[ring] != ring}
        inside = within - holes - {int(shells[ring]) for ring in holes}
        expected = bool(inside), sum(1 << ring for ring in inside or holes)
        assert verdict(shells, sum(1 << ring for ring in within)) == expected


def holes_among(rings: list[list[tuple[float, float]]]) -> list[bool] | None:
    """Return which rings of one region are holes, None where that is not sure."""
    n, points = len(rings), np.array([point for ring in rings for point in ring])
    offsets = np.cumsum([0, *map(len, rings)])
    found = Rings(np.arange(len(points)), np.ones(len(points), np.uint8), offsets, np.zeros(n, np.int64))
    ranking = Ranking(*(np.zeros(n, kind) for kind in (np.int64, float, np.uint8, np.int64, np.int64, np.int64)))
    x, y = (np.ascontiguousarray(axis) for axis in points.T)
    none = np.zeros(0)
    rounded = Rounded(x, y, np.zeros(len(x), np.uint8), none, none, none)
    is_sure = find_shells(found, n, rounded, ranking, np.zeros(n, np.int64), np.zeros((n, 4)))
    return [bool(is_hole) for is_hole in ranking.is_hole] if is_sure else None


def test_the_widest_ring_is_the_shell_whatever_its_turn() -> None:
    hole: list[tuple[float, float]] = [(1, 1), (2, 1), (1, 2)]
    shell: list[tuple[float, float]] = [(0, 0), (0, 4), (4, 4), (4, 0)]
    flat: list[tuple[float, float]] = [(0, 0), (4, 4), (2, 2)]
    for order in ([hole, shell, hole], [shell, hole], [hole, shell]):
        assert holes_among(order) == [ring is hole for ring in order]
    assert holes_among([hole, flat]) == [True, False]
    assert holes_among([shell, flat]) is None  # boxes are equal: either may be the shell
    assert holes_among([hole, [(0, 1.5), (3, 1.5), (3, 1.6)]]) is None  # no box holds both
