"""Files of triangles without numbers of vertices."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np


def ball(n: int) -> Any:
    """Return the corners (m, 3, 3) of a closed ball of 2 n (n - 1) triangles, by longitude and latitude."""
    turns, rises = np.linspace(0, 2 * np.pi, n + 1)[:-1], np.linspace(-np.pi / 2, np.pi / 2, n + 1)
    rings = [np.c_[np.cos(rise) * np.cos(turns), np.cos(rise) * np.sin(turns), np.full(n, np.sin(rise))]
             for rise in rises]  # fmt: skip
    rings[0][:], rings[-1][:] = [0, 0, -1], [0, 0, 1]
    made = []
    for low, high in pairwise(rings):
        a, b, c, d = low, np.roll(low, -1, axis=0), np.roll(high, -1, axis=0), high
        made += [] if low is rings[0] else [np.stack([a, b, d], axis=1)]
        made += [] if high is rings[-1] else [np.stack([b, c, d], axis=1)]
    return np.concatenate(made)


def binary(corners: Any) -> bytes:
    rows = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    rows["corners"] = corners
    return bytes(80) + np.uint32(len(rows)).tobytes() + rows.tobytes()


def ascii_stl(corners: Any) -> bytes:
    facets = []
    for triangle in np.asarray(corners, np.float32):
        lines = "".join(f"vertex {x!s} {y!s} {z!s}\n" for x, y, z in triangle)
        facets.append(f"facet normal 0 0 0\nouter loop\n{lines}endloop\nendfacet\n")
    return f"solid s\n{''.join(facets)}endsolid s\n".encode()


def obj(corners: Any) -> bytes:
    lines = [f"v {x!s} {y!s} {z!s}" for x, y, z in np.asarray(corners, np.float32).reshape(-1, 3)]
    lines += [f"f {3 * k + 1} {3 * k + 2} {3 * k + 3}" for k in range(len(corners))]
    return "\n".join(lines).encode()


FAR = np.array([448262.0, 5411932.0, 150.0])
"""Surveyors' coordinates: in single precision 3 cm apart, to the north 50 cm."""


def has_equal(corners: Any) -> Any:
    single = np.asarray(corners, np.float32)
    return (single == np.roll(single, 1, axis=1)).all(axis=2).any(axis=1)
