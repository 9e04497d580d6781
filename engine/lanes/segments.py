"""A segment against eight boxes at once, one to a lane: which of a node's children it may meet.

A segment with the middle m and the half e, and a box with the centre c and half widths h, are apart exactly where one
of six axes separates them, with w = m - c:

    |w_i| > h_i + |e_i|                  |e_i w_j - e_j w_i| > h_i |e_j| + h_j |e_i|

No division, so nothing has to be said about directions along an axis. Half widths are enlarged by `slack`, the second
bound by `tiny`; what is no number separates nothing.

Source: C. Ericson, Real-time collision detection, 2005, section 5.3.3.
"""

from __future__ import annotations

from engine.lanes.boxes import BOX_ROWS
from engine.lanes.lanes import bits_of, load
from engine.lanes.tracing import Number, Rows, Triple, traced


@traced
def near_segment(boxes: Rows, node: int, middle: Triple, half: Triple, slack: Number, tiny: Number) -> int:
    """Return the lanes of a node (`bvh.py`), a bit each, that the segment may meet. All numbers are float32."""
    b = [load(boxes, BOX_ROWS * node + row) for row in range(BOX_ROWS)]
    w = [middle[k] - b[k] for k in range(3)]
    h = [b[3 + k] + slack for k in range(3)]
    e = [abs(half[k]) for k in range(3)]
    apart = abs(w[0]) > h[0] + e[0]
    for k in (1, 2):
        apart |= abs(w[k]) > h[k] + e[k]
    for i, j in ((0, 1), (1, 2), (2, 0)):
        apart |= abs(half[i] * w[j] - half[j] * w[i]) > h[i] * e[j] + h[j] * e[i] + tiny
    return bits_of(~apart)
