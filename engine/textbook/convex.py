"""Point in a convex polyhedron (or convex polygon): on the inner side of every face.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics (figure 22.22, left).
What goes wrong: a row computed from rounded vertices is not the face's plane, and the sign is rounded once more.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import BoolArray, FloatArray
from engine.jit import kernel
from engine.textbook.half_space import signed_distance


@kernel
def contains(points: FloatArray, planes: FloatArray) -> BoolArray:
    """Tell of each point (n, dim) whether every row (normal, offset) of planes (m, dim + 1) is >= 0 there."""
    contained = np.ones(len(points), np.bool_)
    dim = points.shape[1]
    for i in range(len(points)):
        for j in range(len(planes)):
            if signed_distance(points[i], planes[j, :dim], planes[j, dim]) < 0.0:
                contained[i] = False
                break
    return contained
