"""Cohen-Sutherland: a segment clipped on a box by code words of one bit per side, six in space and four in the plane.

    bit 0: x < xmin   bit 1: x > xmax          the plane, bits 3 2 1 0:
    bit 2: y < ymin   bit 3: y > ymax          1001 | 1000    | 1010       above
    bit 4: z < zmin   bit 5: z > zmax          0001 | 0000    | 0010       middle
                                               0101 | 0100    | 0110       below

Both code words zero: accept. A bit that both have: reject. Else the segment is cut on the plane of the first bit in
which they differ, the code word of the cut point is computed, and the procedure repeats.

Source: section 22.4.2 of the chapter on computer graphics in Algorithms of Informatics, algorithm
Cohen-Sutherland-Line-Clipping (figure 22.28).
What goes wrong: the cut point is rounded and may still be outside of the plane it was put on: the loop of the textbook
then never ends, for example on (1, 1)-(-1, -1) and the box from 1e-9 to 3. Here it is capped and says `unfinished`.
Segments that pass close to an edge or a corner of the box are accepted or rejected by rounding.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.jit import kernel, merged

REJECTED, ACCEPTED, UNFINISHED = 0, 1, 2
MAX_TURNS = 64  # six would do in exact arithmetic: each turn settles one plane


@merged
def code_word(p: Any, low: Any, high: Any) -> int:
    """Return one bit per side that p is outside of."""
    code = 0
    for k in range(len(low)):
        if p[k] < low[k]:
            code |= 1 << 2 * k
        if p[k] > high[k]:
            code |= 2 << 2 * k
    return code


@merged
def cut(p: Any, q: Any, bit: int, low: Any, high: Any) -> Any:
    """Return the intersection of the segment with the plane of the side `bit`."""
    axis = bit // 2
    plane = high[axis] if bit % 2 else low[axis]
    return p + (plane - p[axis]) / (q[axis] - p[axis]) * (q - p)


@merged
def clip_one(p: Any, q: Any, n_turns: int, region: Any, code_word: Any, cut: Any) -> int:
    """Cut p q in place by ``code_word(p, *region)`` and ``cut(p, q, bit, *region)``; return its status."""
    code_p, code_q = code_word(p, *region), code_word(q, *region)
    for _ in range(n_turns):
        if code_p == 0 and code_q == 0:
            return ACCEPTED
        if code_p & code_q:
            return REJECTED
        bit = 0
        while not (code_p ^ code_q) >> bit & 1:
            bit += 1
        if code_p >> bit & 1:
            p[:] = cut(p, q, bit, *region)
            code_p = code_word(p, *region)
        else:
            q[:] = cut(p, q, bit, *region)
            code_q = code_word(q, *region)
    return UNFINISHED


@kernel
def clip(segments: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return (clipped segments (n, 2, dim), status (n,): REJECTED, ACCEPTED or UNFINISHED)."""
    clipped, status = segments.copy(), np.empty(len(segments), np.int64)
    for i in range(len(segments)):
        status[i] = clip_one(clipped[i, 0], clipped[i, 1], MAX_TURNS, (low, high), code_word, cut)
    return clipped, status
