"""Awkward shapes of any size: faces that touch, thin, stretched, flat, spiky; rings that share sides or nearly do."""

from __future__ import annotations

from itertools import product

import numpy as np

import engine
from benchmarks.bodies import random_rotations
from benchmarks.workloads import ring_around

Array = np.ndarray
Net = tuple[Array, Array]
"""Vertices (n, 3) and triangles (m, 3), outward."""


def turned(points: Array) -> Array:
    """Return points under one random rotation."""
    return points @ random_rotations(np.random.default_rng(3), 1)[0].T


def torus(n: int, stretch: tuple[float, float, float] = (1, 1, 1)) -> Net:
    """Return a torus of about n faces, turned, then stretched along the axes."""
    rows, columns = max(6, round(n**0.5)), max(4, round(n**0.5 / 2))
    u, v = np.meshgrid(np.arange(rows) * 2 * np.pi / rows, np.arange(columns) * 2 * np.pi / columns, indexing="ij")
    around = 1 + 0.4 * np.cos(v)
    points = np.stack([around * np.cos(u), around * np.sin(u), 0.4 * np.sin(v)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    following, above = (i + 1) % rows, (j + 1) % columns
    a, b = i * columns + j, following * columns + j
    c, d = following * columns + above, i * columns + above
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return turned(points) * stretch, faces


def bipyramid(n: int, height: float = 1.0) -> Net:
    """Return n faces, half of them around each of two apexes."""
    k = n // 2
    rim = np.column_stack([*unit_circle(k).T, np.zeros(k)])
    i = np.arange(k)
    j = (i + 1) % k
    faces = np.concatenate([np.column_stack([i, j, 0 * i + k]), np.column_stack([j, i, 0 * i + k + 1])])
    return turned(np.concatenate([rim, [[0, 0, height], [0, 0, -height]]])), faces


def block(n: int) -> Net:
    """Return a block whose flat top is cut into n triangles."""
    k = max(2, round((n / 2) ** 0.5))
    top = np.column_stack(
        [np.repeat(np.arange(k + 1.0), k + 1), np.tile(np.arange(k + 1.0), k + 1), np.ones((k + 1) ** 2)]
    )
    a = (np.arange(k)[:, None] * (k + 1) + np.arange(k)).ravel()
    faces = [np.column_stack([a, a + k + 1, a + k + 2]), np.column_stack([a, a + k + 2, a + 1])]
    side, last = np.arange(k) * (k + 1), (k + 1) * k
    rim = np.concatenate(
        [side, last + np.arange(k), last + k - side, k - np.arange(k)]
    )  # around the top, counter-clockwise
    low = len(top) + np.arange(len(rim))
    following, below = np.roll(rim, -1), np.roll(low, -1)
    faces += [np.column_stack([rim, low, below]), np.column_stack([rim, below, following])]
    faces.append(np.column_stack([low, 0 * low + len(top) + len(rim), below]))
    vertices = np.concatenate([top, top[rim] * [1, 1, 0], [[k / 2, k / 2, 0.0]]])
    return vertices, np.concatenate(faces)


def spiky(n: int) -> Net:
    """Return a torus with a third of its vertices pulled out five times as far from the core."""
    points, faces = torus(n)
    far = np.random.default_rng(n).random(len(points)) < 0.3
    return np.where(far[:, None], 5.0 * points, points), faces


def boxes_in_rows(n: int) -> list[engine.Aabb]:
    """Return n boxes on a grid, which touch."""
    k = round(n ** (1 / 3))
    return [engine.Aabb(at, np.add(at, 1.0)) for at in product(range(k), repeat=3)]


def unit_circle(n: int) -> Array:
    """Return n points around the origin."""
    return ring_around(np.arange(n) * 2 * np.pi / n)


def star(n: int, inner: float = 0.1) -> Array:
    """Return a star of n corners, every second one near the middle."""
    return unit_circle(n) * np.where(np.arange(n) % 2, 1.0, inner)[:, None]


def comb(n: int, height: float = 1.0) -> Array:
    """Return a comb of n / 4 teeth."""
    x = np.arange(max(1, n // 4), dtype=float)
    teeth = [np.column_stack([x + dx, 0 * x + y]) for dx, y in ((0, 0.1), (0.1, height), (0.4, height), (0.5, 0.1))]
    return np.concatenate([np.stack(teeth, 1).reshape(-1, 2), [[len(x), 0.1], [len(x), -1.0], [0.0, -1.0]]])[::-1]


def spiral(n: int) -> Array:
    """Return a band wound n / 40 times."""
    t = np.linspace(0.5, max(3, n // 40), n // 2) * 2 * np.pi
    way = np.column_stack([np.cos(t), np.sin(t)])
    return np.concatenate([way * t[:, None], (way * (t + 0.8 * np.pi)[:, None])[::-1]])


def zigzag(n: int) -> Array:
    """Return a ring of n corners, two of three on the line y = 0."""
    x = np.linspace(0.0, 1.0, n)
    return np.concatenate([np.column_stack([x, np.where(np.arange(n) % 3, 0.0, -0.1)]), [[1.0, 1.0], [0.0, 1.0]]])


def ngon(n: int) -> engine.Convex:
    """Return the convex region of n lines around the unit circle."""
    return engine.Convex(np.column_stack([-unit_circle(n), np.ones(n)]))
