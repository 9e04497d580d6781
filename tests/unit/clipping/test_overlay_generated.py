"""Generated families that make rounding hard: every output valid, every count and area consistent.

A few pairs of each family by default, a thousand with --full. Small pairs are also held against the reference.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from engine.clipping.overlay import overlay
from engine.solids.polygon import Polygon
from tests.unit.clipping.overlay_checks import (
    OPERATIONS,
    assert_area_close,
    assert_counts_add_up,
    assert_equals_reference,
    assert_valid,
)

Random = np.random.Generator
Rings = list[np.ndarray]


def star(random: Random, n: int, centre: float = 0.0, radius: float = 1.0) -> np.ndarray:
    angles = np.sort(random.random(n)) * 2 * np.pi
    lengths = radius * (0.3 + random.random(n))
    return np.stack([centre + lengths * np.cos(angles), centre + lengths * np.sin(angles)], axis=1)


def rotated(ring: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return ring @ np.array([[c, s], [-s, c]])


def lattice(random: Random) -> tuple[Rings, Rings]:
    size = int(random.integers(3, 17))
    rings = [random.integers(0, size, (int(random.integers(4, 12)), 2)).astype(float) for _ in range(3)]
    return rings[:2], rings[2:]


def nearly_lattice(random: Random) -> tuple[Rings, Rings]:
    rings = [random.integers(0, 4, (9, 2)) + random.integers(-2, 3, (9, 2)) * 2.0**-51 for _ in range(2)]
    return rings[:1], rings[1:]


def rotated_lattice(random: Random) -> tuple[Rings, Rings]:
    angle = random.random()
    rings = [rotated(random.integers(0, 6, (8, 2)).astype(float), angle) for _ in range(2)]
    return rings[:1], rings[1:]


def nearly_coincident(random: Random) -> tuple[Rings, Rings]:
    first = star(random, 12)
    return [first], [np.concatenate([first[:6] * (1 + random.integers(-2, 3, (6, 2)) * 2.0**-52), star(random, 5)])]


def turned_by_less_than_an_ulp(random: Random) -> tuple[Rings, Rings]:
    rings, angle = [star(random, 10, 0.0, 1e-3), star(random, 9)], random.random() * 1e-15
    return rings, [rotated(ring, angle) for ring in rings]


def far_away(random: Random) -> tuple[Rings, Rings]:
    offset = float(random.choice([1e6, 1e9]))
    return [star(random, 10, offset)], [star(random, 10, offset)]


def many_exponents(random: Random) -> tuple[Rings, Rings]:
    rings = [random.random((10, 2)) * 2.0 ** -random.integers(0, 52, (10, 2)).astype(float) for _ in range(2)]
    return rings[:1], rings[1:]


def combs(random: Random) -> tuple[Rings, Rings]:
    x = np.arange(12.0)
    comb = np.concatenate([np.stack([x, (x % 2) * 11], axis=1), [[12.0, -1.0], [-1.0, -1.0]]])
    return [comb], [rotated(comb - 6, np.pi / 2 * (1 + int(random.integers(-1, 2)) * 2.0**-50)) + 6]


FAMILIES: list[Callable[[Random], tuple[Rings, Rings]]] = [
    lattice,
    nearly_lattice,
    rotated_lattice,
    nearly_coincident,
    turned_by_less_than_an_ulp,
    far_away,
    many_exponents,
    combs,
]


def check(subject: Any, clip: Any) -> None:
    first, second, areas = Polygon(subject), Polygon(clip), []
    is_small = len(first.vertices) + len(second.vertices) <= 20
    for operation in OPERATIONS:
        result = overlay(first, second, operation)
        assert_valid(result)
        assert_counts_add_up(result)
        assert_area_close(result)
        if is_small:
            rings = [[ring.tolist() for ring in each] for each in (subject, clip)]
            assert_equals_reference(result, *rings, operation)
        areas.append(result.area_exact)
    both, union, only, either = areas
    other = overlay(second, first, "difference").area_exact
    assert only + other == either
    assert either + both == union


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.__name__)
def test_sample(family: Callable[[Random], tuple[Rings, Rings]]) -> None:
    for seed in range(2):
        check(*family(np.random.default_rng(seed)))


@pytest.mark.full
@pytest.mark.parametrize("block", range(10))
@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.__name__)
def test_all(family: Callable[[Random], tuple[Rings, Rings]], block: int) -> None:
    for seed in range(100 * block + 2, 100 * block + 102):
        check(*family(np.random.default_rng(seed)))
