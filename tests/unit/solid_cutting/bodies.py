"""Meshes for the tests of cutting."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

_QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
CUBE = np.array([(a, b, c) for a, b, c, d in _QUADS] + [(a, c, d) for a, b, c, d in _QUADS])


def block(low: Any, high: Any) -> np.ndarray:
    return np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)], float)


def joined(parts: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    return np.concatenate([each for each, _ in parts]), np.concatenate([f + k for (_, f), k in zip(parts, starts)])


def star(seed: int, n: int = 6, m: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """Return a ball of random radii: star-shaped, so no faces cross."""
    turns, rises = np.linspace(0, 2 * np.pi, n, endpoint=False), np.linspace(-np.pi / 2, np.pi / 2, m + 1)[1:-1]
    rows = [[math.cos(r) * math.cos(t), math.cos(r) * math.sin(t), math.sin(r)] for r in rises for t in turns]
    vertices = np.array([[0, 0, -1.0], *rows, [0, 0, 1.0]])
    faces, top = [], len(vertices) - 1
    for k in range(n):
        after = (k + 1) % n
        faces += [(0, 1 + after, 1 + k), (top, top - n + k, top - n + after)]
        for row in range(m - 2):
            a, b = 1 + row * n, 1 + row * n + n
            faces += [(a + k, a + after, b + after), (a + k, b + after, b + k)]
    sizes = np.random.default_rng(seed).uniform(0.5, 2, (len(vertices), 1))
    return vertices * sizes, np.array(faces)
