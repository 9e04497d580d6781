"""Chains of boundary edges, their rings and faces."""

from __future__ import annotations

import numpy as np
import pytest

from engine.polygon_overlay.overlay import overlay
from engine.solids.polygon import Polygon
from tests.unit.polygon_overlay.checks import OPERATIONS
from tests.unit.polygon_overlay.compiled.test_kernel import Rings, agree


def ring(n: int, radius: float = 1.0, x: float = 0.0) -> np.ndarray:
    angles = np.linspace(0, 2 * np.pi, n, endpoint=False)
    return np.stack([x + radius * np.cos(angles), radius * np.sin(angles)], axis=1)


@pytest.mark.parametrize("n_common", [2, 5, 30])
def test_chains_that_coincide(n_common: int) -> None:
    """Stretches of many vertices in common, the same way or back, once or three times over."""
    first = ring(40)
    second = np.concatenate([first[:n_common], 1.5 * first[n_common:]])
    for clip in ([second], [second[::-1]], [second, first], [second, second[::-1], first]):
        for operation in OPERATIONS:
            assert agree([first], clip, operation)


@pytest.mark.parametrize("n", [3, 8, 25])
def test_nodes_of_many_chains(n: int) -> None:
    """Wedges about one point: a star of 4 n half-chains, sorted by direction exactly."""
    angles = np.linspace(0, 2 * np.pi, 2 * n, endpoint=False)
    wedges = [[(0.0, 0.0), (np.cos(a), np.sin(a)), (np.cos(a + 1 / n), np.sin(a + 1 / n))] for a in angles[::2]]
    turned = [[(0.0, 0.0), (np.cos(a), np.sin(a)), (np.cos(a + 2 / n), np.sin(a + 2 / n))] for a in angles[1::2]]
    for operation in OPERATIONS:
        assert agree(wedges, turned, operation)


@pytest.mark.parametrize("depth", [1, 2, 3])
def test_components_in_each_other(depth: int) -> None:
    """Each is joined to its face by the edge above its last vertex, which two rings may share."""
    subject = [ring(7, 2.0 * k + 1.0) for k in range(depth)]
    clip = [ring(9, 2.0 * k + 2.0) for k in range(depth)] + [ring(5, 0.25, 0.5), ring(5, 0.25, -0.4)]
    for operation in OPERATIONS:
        assert agree(subject, clip, operation)


# --- Boundary rings where walks pass a node twice, and where straight points are left out ---


FRAME = [(0, 0), (8, 0), (8, 8), (0, 8)]
CASES = {
    "hole touches its shell": [[(4, 0), (6, 3), (2, 3)]],
    "hole touches its shell twice": [[(4, 0), (6, 4), (4, 8), (2, 4)]],
    "holes touch each other": [[(2, 2), (4, 4), (2, 6)], [(4, 4), (6, 2), (6, 6)]],
    "a chain of holes encloses a part": [[(2, 2), (6, 2), (4, 3)], [(6, 2), (6, 6), (5, 4)], [(2, 2), (5, 4), (6, 6)]],
    "corner to corner": [[(8, 8), (9, 8), (9, 9)], [(-1, -1), (0, 0), (-1, 0)]],
}


@pytest.mark.parametrize("name", CASES)
def test_walks_are_cut_into_simple_rings(name: str) -> None:
    for operation in OPERATIONS:
        assert agree([FRAME], CASES[name], operation)
        assert agree(
            [[(x / 3, y / 7) for x, y in FRAME]], [[(x / 3, y / 7) for x, y in r] for r in CASES[name]], operation
        )


def test_straight_points_leave_no_trace() -> None:
    fine = [(x, 0) for x in range(9)] + [(8, y) for y in range(1, 9)] + [(x, 8) for x in range(7, -1, -1)] + [(0, 3)]
    union = overlay(Polygon([fine]), Polygon([[(2, 2), (8, 2), (8, 6), (2, 6)]]), "union")
    assert union.vertices.tolist() == [[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]]


# --- Faces of rings that cross, touch, coincide, nest or lie apart ---


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


@pytest.mark.some(6)
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
