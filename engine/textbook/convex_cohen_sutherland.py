"""Cohen-Sutherland for a convex polyhedron: one bit of the code word per face.

Source: exercise 22.4-6 of the chapter on computer graphics in Algorithms of Informatics. The loop is that of
`cohen_sutherland.py` with signed distances in place of coordinates.
What goes wrong: as there; and the distance of a cut point from its own plane is hardly ever exactly zero, so the loop
fails to end much more often. Capped, with status `unfinished`. At most 62 planes fit a code word.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.jit import inline, kernel
from engine.textbook.cohen_sutherland import clip_one
from engine.textbook.half_space import signed_distance

MAX_PLANES = 62


@inline
def code_word(p: Any, planes: Any) -> int:
    """Return one bit per row (normal, offset) that p is outside of."""
    code = 0
    for j in range(len(planes)):
        if signed_distance(p, planes[j, :-1], planes[j, -1]) < 0.0:
            code |= 1 << j
    return code


@inline
def cut(p: Any, q: Any, bit: int, planes: Any) -> Any:
    """Return the intersection of the segment with the plane of row `bit`."""
    normal, offset = planes[bit, :-1], planes[bit, -1]
    at_p, at_q = signed_distance(p, normal, offset), signed_distance(q, normal, offset)
    return p + at_p / (at_p - at_q) * (q - p)


@kernel
def clip(segments: FloatArray, planes: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return (clipped segments (n, 2, dim), status (n,)); planes (m, dim + 1), m <= MAX_PLANES."""
    clipped, status = segments.copy(), np.empty(len(segments), np.int64)
    for i in range(len(segments)):
        status[i] = clip_one(clipped[i, 0], clipped[i, 1], 2 * len(planes) + 2, (planes,), code_word, cut)
    return clipped, status
