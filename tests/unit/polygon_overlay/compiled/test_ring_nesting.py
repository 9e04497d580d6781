"""Rings arranged again, compiled against the integers: equal rings, from the same rings before."""

from __future__ import annotations

import numpy as np
import pytest

from engine.polygon_overlay import in_integers
from engine.polygon_overlay.pair_arrays import PairResults, concatenate_pairs, one_pair
from engine.polygon_overlay.run import rebuild_from_rounded_rings
from engine.running.budget import Budget

Ring = list[tuple[float, float]]


def found_of(pieces: list[list[Ring]]) -> PairResults:
    rings = [ring for piece in pieces for ring in piece]
    vertices = np.array([vertex for ring in rings for vertex in ring], float)
    offsets, piece_offsets = np.cumsum([0, *map(len, rings)]), np.cumsum([0, *map(len, pieces)])
    return one_pair(vertices, offsets, piece_offsets, 0.0, 0)


def crowd(random: np.random.Generator, n_pieces: int, reach: int) -> list[list[Ring]]:
    """Shells and holes on a lattice, which cross, touch, coincide and nest as it happens."""
    return [
        [[(x + dx, y + dy) for dx, dy in random.integers(0, 7, (4, 2)).tolist()] for _ in range(random.integers(1, 4))]
        for x, y in random.integers(0, reach, (n_pieces, 2)).tolist()
    ]


def agree(given: PairResults) -> PairResults:
    compiled, exact = (
        rebuild_from_rounded_rings(given, Budget()),
        in_integers.rebuild_from_rounded_rings(given, Budget()),
    )
    for name in ("vertices", "ring_offsets", "piece_offsets"):
        assert getattr(compiled, name).tolist() == getattr(exact, name).tolist()
    assert sorted(compiled.evidence.tolist()) == sorted(exact.evidence.tolist())
    return compiled


@pytest.mark.parametrize(("n_pieces", "reach"), [(3, 4), (12, 8), (90, 60)])
@pytest.mark.parametrize("seed", range(8))
def test_evidence_is_that_of_the_integers(n_pieces: int, reach: int, seed: int) -> None:
    agree(found_of(crowd(np.random.default_rng(seed), n_pieces, reach)))


def square(radius: float) -> Ring:
    return [(-radius, -radius), (radius, -radius), (radius, radius), (-radius, radius)]


def test_frames_in_each_other_come_from_themselves() -> None:
    """A face in many holes comes from the innermost."""
    found = agree(found_of([[square(radius), square(radius - 1)[::-1]] for radius in range(200, 1, -2)]))
    assert sorted(found.evidence.tolist()) == [[ring, ring] for ring in range(200)]


def test_rings_through_one_point() -> None:
    angles = np.linspace(0, 2 * np.pi, 241)
    fan: list[list[Ring]] = [
        [[(0.0, 0.0), (np.cos(a), np.sin(a)), (np.cos(b), np.sin(b))]]
        for a, b in zip(angles[:-2:2], angles[1:-1:2], strict=True)
    ]
    assert len(agree(found_of(fan)).evidence) == 120


def test_pairs_together_are_pairs_alone() -> None:
    random = np.random.default_rng(1)
    pairs = [found_of(crowd(random, 5, 5)) for _ in range(9)]
    together, n_before, n_found = rebuild_from_rounded_rings(concatenate_pairs(pairs), Budget()), 0, 0
    expected: list[list[int]] = []
    for pair in pairs:
        alone = rebuild_from_rounded_rings(pair, Budget())
        expected += (alone.evidence + np.array([n_found, n_before])).tolist()
        n_found, n_before = n_found + int(alone.counts[0, 1]), n_before + int(pair.counts[0, 1])
    assert together.evidence.tolist() == expected
