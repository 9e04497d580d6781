"""Rings in their order against Python's sort of the same rings."""

from __future__ import annotations

import numpy as np
import pytest

from engine.polygon_overlay.compiled.chain_rings import Rings
from engine.polygon_overlay.compiled.clearance import Rounded
from engine.polygon_overlay.compiled.ring_order import Ranking, find_shells, rank_rings

Ring = list[tuple[float, float]]


def turned(ring: Ring) -> Ring:
    first = ring.index(min(ring))
    return ring[first:] + ring[:first]


@pytest.mark.parametrize("seed", range(10))
def test_pieces_by_shells_and_holes_after_their_shell(seed: int) -> None:
    random = np.random.default_rng(seed)
    pieces: list[list[Ring]] = []
    for x, y in random.integers(0, 3, (7 if seed % 2 else 300, 2)).tolist():
        far = len(pieces)  # many begin at one x, or in one point
        shell: Ring = [(x, y), (x + 50 + far, y), (x + 50 + far, y + 50)]
        holes: list[Ring] = [
            [(x + k, y + k), (x + k, y + k + 1), (x + k + 1, y + k)] for k in random.permutation(4)[:2] + 1.0
        ]
        pieces.append([shell, *holes])
    rings = [(region, ring) for region, piece in enumerate(pieces) for ring in piece]
    rings = [rings[k] for k in random.permutation(len(rings))]
    rings = [
        (region, ring[k:] + ring[:k]) for (region, ring), k in zip(rings, random.integers(0, 3, 999), strict=False)
    ]
    n, points = len(rings), np.array([vertex for _, ring in rings for vertex in ring])
    offsets, regions = np.cumsum([0, *(len(ring) for _, ring in rings)]), np.array([region for region, _ in rings])
    found = Rings(np.arange(len(points)), np.arange(len(points)), np.zeros(len(points), np.uint8), offsets, regions)
    ranking = Ranking(*(np.zeros(n, kind) for kind in (np.int64, float, float, np.uint8, np.int64, np.int64, np.int64)))
    x, y = np.ascontiguousarray(points.T)
    none = np.zeros(0)
    rounded = Rounded(x, y, np.zeros(len(x), np.uint8), none, none, none)
    scratch = np.zeros(n, np.int64), np.zeros((n, 4)), np.zeros(1, np.uint8)
    assert rank_rings(found, n, rounded, ranking, True, *scratch) == len(pieces)
    expected = sorted([turned(piece[0]), *sorted(map(turned, piece[1:]))] for piece in pieces)
    assert [turned(rings[k][1]) for k in ranking.order.tolist()] == [ring for piece in expected for ring in piece]


def holes_among(rings: list[list[tuple[float, float]]]) -> list[bool] | None:
    """Return which rings of one region are holes, None where that is not sure."""
    n, points = len(rings), np.array([point for ring in rings for point in ring])
    offsets = np.cumsum([0, *map(len, rings)])
    found = Rings(
        np.arange(len(points)), np.arange(len(points)), np.ones(len(points), np.uint8), offsets, np.zeros(n, np.int64)
    )
    ranking = Ranking(*(np.zeros(n, kind) for kind in (np.int64, float, float, np.uint8, np.int64, np.int64, np.int64)))
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
