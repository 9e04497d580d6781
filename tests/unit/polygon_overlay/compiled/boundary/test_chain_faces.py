"""Faces of rings that cross, touch, coincide, nest or lie apart: labels against the overlay in Python integers."""

from __future__ import annotations

import numpy as np
import pytest

from tests.unit.polygon_overlay.checks import OPERATIONS
from tests.unit.polygon_overlay.compiled.test_kernel import Rings, agree


def box(x: float, y: float, wide: float, high: float) -> list[tuple[float, float]]:
    return [(x, y), (x + wide, y), (x + wide, y + high), (x, y + high)]


def bars(n: int) -> tuple[Rings, Rings]:
    """Bars across and bars along, whose ends lie on the first bar of the others."""
    return [box(0, 3 * k, 3 * n, 1) for k in range(n)], [box(3 * k, 0, 1, 3 * n)[::-1] for k in range(n)]


def board(n: int, shift: float) -> tuple[Rings, Rings]:
    """Squares, and others between them that overlap their corners, touch there, or share parts of their sides."""
    return (
        [box(30 * i, 30 * j, 20, 20) for i in range(n) for j in range(n)],
        [box(30 * i + shift, 30 * j + 15, 20, 20) for i in range(n - 1) for j in range(n - 1)],
    )


SCENES = {
    "bars": bars(9),
    "checkerboards": board(5, 15.0),
    "corners on sides": board(4, 20.0),
    "sides in common": board(4, 0.0),
    "rings in rings that cross": (
        [box(4 * k, 4 * k, 100 - 8 * k, 100 - 8 * k) for k in range(8)],
        [box(4 * k + 2, 4 * k + 1, 100 - 8 * k, 100 - 8 * k) for k in range(8)],
    ),
    "rings in rings apart": (
        [box(2 * k, 2 * k, 40 - 4 * k, 40 - 4 * k) for k in range(0, 8, 2)],
        [box(2 * k, 2 * k, 40 - 4 * k, 40 - 4 * k) for k in range(1, 8, 2)] + [box(50, 50, 1, 1)],
    ),
    "equal rings twice and thrice": (
        [box(0, 0, 8, 8), box(0, 0, 8, 8)[::-1], box(0, 0, 8, 8), box(2, 2, 9, 2)],
        [box(0, 0, 8, 8), box(2, 2, 9, 2), box(2, 2, 9, 2), box(9, 3, 1, 9)],
    ),
    "a ring between two in a node": (
        [[(0, 0), (4, 1), (4, 2)], [(0, 0), (-4, 1), (-4, 2)], box(-1, -9, 2, 9)],
        [[(0, 0), (1, 4), (2, 4)], [(0, 0), (-1, 4), (-2, 4)], box(3, -3, 9, 9)],
    ),
}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_scenes_of_many_rings(name: str, turn: float) -> None:
    subject, clip = ([np.array(ring, float) for ring in rings] for rings in SCENES[name])
    if turn:
        turning = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        subject, clip = [ring @ turning for ring in subject], [ring @ turning for ring in clip]
    for operation in OPERATIONS:
        assert agree(subject, clip, operation)
        assert agree(clip, subject[::-1], operation)
