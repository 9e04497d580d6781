"""Point in a polygon of the plane: a half-line along x meets the edges an odd number of times.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics. The half-open rule for the ends
of an edge ("one end strictly above, the other not") counts a vertex once.
What goes wrong: the crossing is computed by a division and compared; near an edge the answer is rounding's.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.jit import kernel


@kernel
def contains(points: FloatArray, vertices: FloatArray, ring_offsets: IntArray) -> BoolArray:
    """Tell of each point (n, 2) whether it is in the rings vertices[ring_offsets[r] : ring_offsets[r + 1]]."""
    contained = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        x, y = points[i]
        inside = False
        for r in range(len(ring_offsets) - 1):
            before = ring_offsets[r + 1] - 1
            for now in range(ring_offsets[r], ring_offsets[r + 1]):
                x1, y1 = vertices[before]
                x2, y2 = vertices[now]
                if (y1 > y) != (y2 > y) and x < x1 + (y - y1) * (x2 - x1) / (y2 - y1):
                    inside = not inside
                before = now
        contained[i] = inside
    return contained
