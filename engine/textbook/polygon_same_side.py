"""Point in a convex polygon: on the same side of every edge as the polygon itself.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics. Either orientation of the ring
will do; a point on an edge counts as inside.
What goes wrong: the cross product of a point close to an edge may have the wrong sign.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import BoolArray, FloatArray
from engine.jit import kernel


@kernel
def contains(points: FloatArray, vertices: FloatArray) -> BoolArray:
    """Tell of each point (n, 2) whether it is in the convex ring vertices (m, 2)."""
    contained = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        has_left, has_right = False, False
        for j in range(len(vertices)):
            edge, to_point = vertices[j] - vertices[j - 1], points[i] - vertices[j - 1]
            turn = edge[0] * to_point[1] - edge[1] * to_point[0]
            has_left = has_left or turn > 0.0
            has_right = has_right or turn < 0.0
        contained[i] = not (has_left and has_right)
    return contained
