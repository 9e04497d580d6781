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


def subdivided(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a mesh with each triangle in four, by rounded middles of edges: faces that are nearly in one plane."""
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    edges, of = np.unique(sides, axis=0, return_inverse=True)
    (a, b, c), (ab, bc, ca) = faces.T, of.reshape(-1, 3).T + len(vertices)
    rows = [np.stack(row, axis=1) for row in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return np.concatenate([vertices, vertices[edges].mean(axis=1)]), np.concatenate(rows)


def turned(vertices: np.ndarray) -> np.ndarray:
    """Return vertices turned about (1, 1, 1) by an angle whose cosine is 3 / 5, rounded."""
    rows = [[0.7333333333333333, -0.3285535, 0.5952201], [0.5952201, 0.7333333333333333, -0.3285535],
            [-0.3285535, 0.5952201, 0.7333333333333333]]  # fmt: skip
    return vertices @ np.array(rows)
