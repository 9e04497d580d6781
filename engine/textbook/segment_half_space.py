"""Clipping segments on a half-space: keep, remove, or replace the end that is out by the intersection with the plane.

    r(t) = r1 + t (r2 - r1),  t = -(n . r1 + d) / (n . (r2 - r1))

Source: section 22.4.2 of the chapter on computer graphics in Algorithms of Informatics.
What goes wrong: both signs are rounded; the intersection carries the error of t times the length of the segment.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import BoolArray, FloatArray
from engine.jit import kernel
from engine.textbook.half_space import signed_distance


@kernel
def clip(segments: FloatArray, normal: FloatArray, offset: float) -> tuple[FloatArray, BoolArray]:
    """Return (clipped segments (n, 2, dim), kept (n,)); a removed segment is left as it came."""
    clipped, kept = segments.copy(), np.ones(len(segments), np.bool_)
    for i in range(len(segments)):
        first, second = segments[i, 0], segments[i, 1]
        at_first = signed_distance(first, normal, offset)
        at_second = signed_distance(second, normal, offset)
        if at_first < 0.0 and at_second < 0.0:
            kept[i] = False
        elif at_first < 0.0:
            clipped[i, 0] = first + at_first / (at_first - at_second) * (second - first)
        elif at_second < 0.0:
            clipped[i, 1] = first + at_first / (at_first - at_second) * (second - first)
    return clipped, kept
