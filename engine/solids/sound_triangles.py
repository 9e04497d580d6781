"""One look at a small mesh of triangles: is there anything about it that the checks of large ones would refuse?

It only says yes or no. After a no the checks run as for other meshes: they name what is wrong, or merge equal vertices.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.jit import kernel

MOST_VERTICES: Final = 64
MOST_CORNERS: Final = 3 * 256
"""A table of the uses of every edge, and a comparison of every two vertices: a few microseconds up to here."""


@kernel
def are_sound(points: Any, indices: Any, must_close: bool) -> bool:
    """Tell whether triangles, indices (3 m,) into points (n, 3) and in range, name three different points each, no
    two points are equal and, where it must be so, every edge is used equally often in both directions."""
    n_points = points.shape[0]
    for i in range(n_points):
        for k in range(i):
            if points[i, 0] == points[k, 0] and points[i, 1] == points[k, 1] and points[i, 2] == points[k, 2]:
                return False
    uses = np.zeros((n_points, n_points), np.int32)
    for start in range(0, indices.shape[0], 3):
        a, b, c = indices[start], indices[start + 1], indices[start + 2]
        if a == b or b == c or c == a:
            return False
        uses[a, b] += 1
        uses[b, c] += 1
        uses[c, a] += 1
    if must_close:
        for i in range(n_points):
            for k in range(i):
                if uses[i, k] != uses[k, i]:
                    return False
    return True
