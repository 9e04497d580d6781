"""A segment against eight triangles at once, one to a lane: which of a block's triangles it may meet.

Seen along the segment, from its middle m, a triangle that the segment meets covers the origin. With k the longest axis
of the half e, i and j the others, and r = e_i / e_k, s = e_j / e_k,

    x = (v_i - m_i) - r (v_k - m_k)          y = (v_j - m_j) - s (v_k - m_k)          for each corner v.

The origin is outside where two edges a b, b c have x_a y_b - y_a x_b of different signs, and the segment ends before
the triangle where all v_k - m_k are beyond |e_k| to one side.

**The bound.** Let u = 2^-24 and S + 2 bound all coordinates (`local_segment`). Where a segment and a triangle meet,
the common point z lies within 2 u (S + 2) of m + t e on each axis, so its x within 4 u (S + 2), and 1 u more for the
rounding of r; a corner is rounded, which moves x by 2 u (S + 2), and x is computed within 10 u (S + 2). So a point
within 17 u (S + 2) of the origin lies in the triangle of the computed corners, and the sign of an edge is what it is
there where it exceeds 17 u (S + 2) times the edge's length in |x| + |y|, and 8.4 u (S + 2) times the corners' for its
own rounding. `slack` = 32 u (S + 2) times the sum of |x| + |y| of all corners is more than both. Products that
underflow are far below: no sign exceeds the bound unless that sum exceeds 2^-18.

What is no number separates nothing.

Source: T. Moller, B. Trumbore, Fast, minimum storage ray/triangle intersection, 1997; the shear is that of S. Woop,
C. Benthin, I. Wald, Watertight ray/triangle intersection, 2013. Changed: conservative, exact signs decide behind it.
"""

from __future__ import annotations

from typing import Any, Final

from engine.jit import inline
from engine.lanes.lanes import bits_of, load
from engine.lanes.tracing import Number, Rows, Triple, traced

CORNER_ROWS: Final = 9
"""ax ay az bx by bz cx cy cz."""
AXES_BEFORE: Final = (1, 2, 0, 1, 2)
"""The other two of axis k: AXES_BEFORE[k], AXES_BEFORE[k + 1]."""


@inline
def longest_axis(half: Any) -> int:
    """Return the axis along which a half is longest."""
    x, y, z = abs(half[0]), abs(half[1]), abs(half[2])
    if x >= y and x >= z:
        return 0
    return 1 if y >= z else 2


@traced
def near_triangles(
    corners: Rows, node: int, i: int, j: int, k: int, middle: Triple, r: Number, s: Number, reach: Number, slack: Number
) -> int:
    """Return the lanes of a block, a bit each, that the segment may meet. All numbers are float32.

    middle: on the axes i, j, k; reach: |e_k| + slack.
    """

    def away(axis: int, place: int) -> Any:
        return [load(corners, CORNER_ROWS * node + axis + 3 * corner) - middle[place] for corner in range(3)]

    z = away(k, 2)
    x = [along - r * z[corner] for corner, along in enumerate(away(i, 0))]
    y = [along - s * z[corner] for corner, along in enumerate(away(j, 1))]
    sizes = [abs(x[corner]) + abs(y[corner]) for corner in range(3)]
    bound = slack * (sizes[0] + sizes[1] + sizes[2])
    edges = [x[a] * y[b] - y[a] * x[b] for a, b in ((0, 1), (1, 2), (2, 0))]
    is_left = (edges[0] > bound) | (edges[1] > bound) | (edges[2] > bound)
    is_right = (edges[0] < -bound) | (edges[1] < -bound) | (edges[2] < -bound)
    is_before = (z[0] < -reach) & (z[1] < -reach) & (z[2] < -reach)
    is_beyond = (z[0] > reach) & (z[1] > reach) & (z[2] > reach)
    return bits_of(~((is_left & is_right) | is_beyond | is_before))
