"""NumPy: convex solids as one matrix product and a comparison, in plain float64.

Points are taken in blocks that fit the second-level cache (faster than all at once), on as many threads as we have.
"""

from __future__ import annotations

import numpy as np

import engine
from benchmarks.contenders import Prepared, in_threads

PACKAGE = "numpy"
NAMES = {"determinant": "numpy determinant", "linalg": "numpy.linalg.det"}

BLOCK = 1 << 15
"""Signed distances held at once: 256 KB, and products too small for the BLAS to start threads of its own."""


def _points(solid: engine.Convex, threads: int) -> Prepared:
    normals, offsets = np.ascontiguousarray(solid.planes[:, :-1].T), solid.planes[:, -1]

    def ask(points: np.ndarray) -> np.ndarray:
        held = np.empty(len(points), np.bool_)

        def part_of(part: slice) -> None:
            block = BLOCK // len(offsets)
            for start in range(part.start, part.stop, block):
                stop = min(start + block, part.stop)
                held[start:stop] = (points[start:stop] @ normals + offsets >= 0.0).all(axis=1)

        in_threads(part_of, len(points), threads)
        return held

    return Prepared(ask)


def _determinant(dimension: int, threads: int) -> Prepared:
    def ask(items: np.ndarray) -> np.ndarray:
        u, v = items[:, 1] - items[:, 0], items[:, 2] - items[:, 0]
        if dimension == 2:
            return np.sign(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
        return np.sign((np.cross(u, v) * (items[:, 3] - items[:, 0])).sum(axis=1))

    return Prepared(ask)


MAKERS = {
    "points": _points, "determinant": _determinant,
    "linalg": lambda *_: Prepared(lambda items: np.sign(np.linalg.det(items[:, 1:] - items[:, :1]))),
}  # fmt: skip
