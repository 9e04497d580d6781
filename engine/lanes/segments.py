"""A segment against eight boxes at once, one to a lane: which of a node's children it may meet.

A segment with the middle m and the half e, and a box with the centre c and half widths h, are apart exactly where one
of six axes separates them, with w = m - c:

    |w_i| > h_i + |e_i|                  |e_i w_j - e_j w_i| > h_i |e_j| + h_j |e_i|

No division, so nothing has to be said about directions along an axis. Half widths are enlarged by `slack`, the second
bound by `tiny`; what is no number separates nothing. A plain twin serves when the compiler is disabled.

Source: C. Ericson, Real-time collision detection, 2005, section 5.3.3.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import config as numba_config
from numba import types
from numba.extending import intrinsic

from engine.lanes.rows import LANES, absolute, bits_without, first_row, load_row, spread_number

PAIRS = ((0, 1), (1, 2), (2, 0))


def plain_near_segment(boxes: Any, node: int, middle: Any, half: Any, slack: Any, tiny: Any) -> int:
    """Return the lanes of a node (`bvh.py`), a bit each, that the segment may meet. All numbers are float32."""
    b = boxes[node]
    with np.errstate(all="ignore"):
        w = [middle[k] - b[k] for k in range(3)]
        h = [b[3 + k] + slack for k in range(3)]
        e = [abs(half[k]) for k in range(3)]
        apart = np.zeros(LANES, np.bool_)
        for k in range(3):
            apart |= abs(w[k]) > h[k] + e[k]
        for i, j in PAIRS:
            apart |= abs(half[i] * w[j] - half[j] * w[i]) > h[i] * e[j] + h[j] * e[i] + tiny
    return sum(1 << lane for lane in np.flatnonzero(~apart).tolist())


def _near_segment_intrinsic(
    typing_context: Any, boxes: Any, node: Any, middle: Any, half: Any, slack: Any, tiny: Any
) -> Any:
    """Return what `plain_near_segment` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        def triple(place: int) -> list[Any]:
            return [spread_number(builder, builder.extract_value(arguments[place], k)) for k in range(3)]

        data = first_row(context, builder, signature.args[0], arguments[0], arguments[1], 6)
        b = [load_row(builder, data, place) for place in range(6)]
        m, e = triple(2), triple(3)
        slack, tiny = (spread_number(builder, arguments[place]) for place in (4, 5))
        w = [builder.fsub(m[k], b[k]) for k in range(3)]
        h = [builder.fadd(b[3 + k], slack) for k in range(3)]
        a = [absolute(builder, e[k]) for k in range(3)]
        apart = None
        for k in range(3):
            found = builder.fcmp_ordered(">", absolute(builder, w[k]), builder.fadd(h[k], a[k]))
            apart = found if apart is None else builder.or_(apart, found)
        for i, j in PAIRS:
            gap = builder.fsub(builder.fmul(e[i], w[j]), builder.fmul(e[j], w[i]))
            reach = builder.fadd(builder.fadd(builder.fmul(h[i], a[j]), builder.fmul(h[j], a[i])), tiny)
            apart = builder.or_(apart, builder.fcmp_ordered(">", absolute(builder, gap), reach))
        return bits_without(builder, apart)

    triple = types.UniTuple(types.float32, 3)
    return types.int64(boxes, types.int64, triple, triple, types.float32, types.float32), generate


near_segment: Any = plain_near_segment if numba_config.DISABLE_JIT else intrinsic(_near_segment_intrinsic)
