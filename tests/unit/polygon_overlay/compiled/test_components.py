"""Components located among others by boxes against the integers, which stab for each; the order of rings is nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine.polygon_overlay.overlay import overlay
from engine.solids.polygon import Polygon
from tests.unit.polygon_overlay.checks import OPERATIONS
from tests.unit.polygon_overlay.compiled.test_kernel import agree
from tests.unit.polygon_overlay.families import star


def squares(n: int, at: float, size: float) -> list[np.ndarray]:
    corners = np.array([[0, 0], [size, 0], [size, size], [0, size]])
    return [corners + np.array([at + 30 * i, at + 30 * j]) for j in range(n) for i in range(n)]


def frames(n: int, at: float) -> list[np.ndarray]:
    """Rings in each other: every one lies in the box of those before."""
    return [np.array([[0, 0], [k, 0.1], [k, k], [0.2, k]]) * [1, 1] + at - k / 2 for k in range(2 * n, 0, -2)]


def crescent(n: int, radius: float) -> np.ndarray:
    """A ring whose box holds what its inside does not."""
    angles = np.linspace(-2.5, 2.5, n)
    outer = np.stack([radius * np.cos(angles), radius * np.sin(angles)], axis=1)
    return np.concatenate([outer, 0.9 * outer[::-1]])


WALL = np.array([[-50.0, -50], [400, -50], [400, 400], [-50, 400]])
SCENES = {
    "apart": (squares(6, 0, 10), squares(5, 15, 10)),
    "windows": ([WALL, *squares(6, 0, 10)], squares(5, 15, 10)),
    "panes": ([WALL, *squares(6, 0, 20)], squares(6, 5, 10)),
    "frames": (frames(12, 0.0), [*frames(9, 0.25), *frames(4, 40.0)]),
    "checkerboard": (squares(5, 0, 20), squares(4, 15, 20)),
    "crescents": ([crescent(40, 100.0), crescent(30, 50.0)], [*frames(4, 3.0), crescent(50, 80.0)]),
}


@pytest.mark.parametrize("name", SCENES)
def test_components_in_faces(name: str) -> None:
    for operation in OPERATIONS:
        assert agree(*SCENES[name], operation)


@pytest.mark.full
@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.full) for seed in range(2, 40))])
def test_scattered_rings_of_any_size(seed: int) -> None:
    random = np.random.default_rng(seed)

    def scattered(n: int) -> list[Any]:
        sizes = random.choice([0.01, 0.1, 0.6], n)
        return [
            star(random, int(random.integers(4, 60))) * size + random.random(2) for size in sizes
        ]  # some of many edges

    subject, clip = scattered(20), scattered(15)
    for operation in OPERATIONS:
        assert agree(subject, clip, operation)


@pytest.mark.parametrize("name", SCENES)
def test_the_order_of_rings_does_not_matter(name: str) -> None:
    random = np.random.default_rng(1)
    subject, clip = SCENES[name]
    for operation in OPERATIONS:
        expected = overlay(Polygon(subject), Polygon(clip), operation)
        mixed = [Polygon([side[k] for k in random.permutation(len(side))]) for side in (subject, clip)]
        found = overlay(mixed[0], mixed[1], operation)
        assert found.vertices.tolist() == expected.vertices.tolist()
        assert found.ring_offsets.tolist() == expected.ring_offsets.tolist()
        assert found.piece_offsets.tolist() == expected.piece_offsets.tolist()


@pytest.mark.parametrize("seed", range(4))
def test_many_rings_in_any_order(seed: int) -> None:
    """Cells of a raster tell what squares over it leave, whatever their order: so many are sorted when loaded."""
    random = np.random.default_rng(seed)

    def scattered(n: int) -> tuple[list[np.ndarray], np.ndarray]:
        rings, covered = [], np.zeros((40, 40), np.bool_)
        for x, y in random.integers(0, 38, (n, 2)).tolist():
            w, h = np.minimum(random.integers(1, 20 if random.random() < 0.05 else 3, 2), (40 - x, 40 - y)).tolist()
            rings.append(np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h]], np.float64))
            covered[x : x + w, y : y + h] ^= True
        return rings, covered

    (first, in_first), (second, in_second) = scattered(700), scattered(300)
    expected = in_first & in_second, in_first | in_second, in_first & ~in_second, in_first ^ in_second
    for operation, selected in zip(OPERATIONS, expected, strict=True):
        found = overlay(Polygon(first), Polygon(second), operation)
        again = overlay(Polygon([first[k] for k in random.permutation(len(first))]), Polygon(second[::-1]), operation)
        for name in ("vertices", "ring_offsets", "piece_offsets", "sources"):
            assert np.array_equal(getattr(found, name), getattr(again, name))
        assert found.area_exact == selected.sum()
