"""NumPy: convex solids as one matrix product and a comparison, in plain float64.

Points are taken in blocks that fit the second-level cache (faster than all at once), on as many threads as we have.
"""

from __future__ import annotations

import numpy as np

import engine
from benchmarks.contenders import Prepared, in_threads

PACKAGE = "numpy"

BLOCK = 1 << 15
"""Signed distances held at once: 256 KB, and products too small for the BLAS to start threads of its own."""


def _points(solid: engine.Convex, threads: int) -> Prepared:
    normals, offsets = np.ascontiguousarray(solid.planes[:, :-1].T), solid.planes[:, -1]

    def ask(points: np.ndarray) -> np.ndarray:
        contained = np.empty(len(points), np.bool_)

        def part_of(part: slice) -> None:
            block = BLOCK // len(offsets)
            for start in range(part.start, part.stop, block):
                stop = min(start + block, part.stop)
                contained[start:stop] = (points[start:stop] @ normals + offsets >= 0.0).all(axis=1)

        in_threads(part_of, len(points), threads)
        return contained

    return Prepared(ask)


MAKERS = {"points": _points}
