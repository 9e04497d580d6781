"""Chains and their faces: stretches in common, nodes of many chains, and components in each other."""

from __future__ import annotations

import numpy as np
import pytest

from tests.unit.polygon_overlay.checks import OPERATIONS
from tests.unit.polygon_overlay.compiled.test_kernel import agree


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
