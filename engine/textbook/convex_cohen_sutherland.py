"""Cohen-Sutherland for a convex polyhedron: one bit of the code word per face.

Source: exercise 22.4-6 of the chapter on computer graphics in Algorithms of Informatics. The loop is that of
`cohen_sutherland.py` with signed distances in place of coordinates.
What goes wrong: as there; and the distance of a cut point from its own plane is hardly ever exactly zero, so the loop
fails to end much more often. Capped, with status `unfinished`. At most 62 planes fit a code word.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.jit import inline, kernel
from engine.textbook.cohen_sutherland import ACCEPTED, REJECTED, UNFINISHED
from engine.textbook.half_space import signed_distance
from engine.textbook.vectors import Floats, Ints

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
def cut(p: Any, q: Any, row: Any) -> Any:
    """Return the intersection of the segment with a plane."""
    at_p, at_q = signed_distance(p, row[:-1], row[-1]), signed_distance(q, row[:-1], row[-1])
    return p + at_p / (at_p - at_q) * (q - p)


@kernel
def clip(segments: Floats, planes: Floats) -> tuple[Floats, Ints]:
    """Return (clipped segments (n, 2, dim), status (n,)); planes (m, dim + 1), m <= MAX_PLANES."""
    clipped, status = segments.copy(), np.full(len(segments), UNFINISHED, np.int64)
    for i in range(len(segments)):
        p, q = clipped[i, 0], clipped[i, 1]
        code_p, code_q = code_word(p, planes), code_word(q, planes)
        for _ in range(2 * len(planes) + 2):
            if code_p == 0 and code_q == 0:
                status[i] = ACCEPTED
                break
            if code_p & code_q:
                status[i] = REJECTED
                break
            bit = 0
            while not (code_p ^ code_q) >> bit & 1:
                bit += 1
            if code_p >> bit & 1:
                p[:] = cut(p, q, planes[bit])
                code_p = code_word(p, planes)
            else:
                q[:] = cut(p, q, planes[bit])
                code_q = code_word(q, planes)
    return clipped, status
