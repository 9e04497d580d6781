"""A segment or a point against eight triangles at once, one to a lane: which of a block's triangles a segment may meet,
and which lie over a point.

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

**Over a point**, seen from above, in single precision, with a band.
A block is (8, 8) float32, a triangle to a lane: x and y of its three corners less the block's centre, the band, and its
growth with the blur b of the point. Let R >= 2^-50 bound the corners and the point about the centre, u = 2^-24, and
S = 2 R + b: no difference of corner and point is larger. It is off by 2 u S at most (each rounded once, and their
difference), a product of two by 5 u S^2, and orient2d by 12 u S^2, below 108 u max(R, b)^2 < 2^-17 (R^2 + b^2); what
underflows is far below 2^-117. The blur itself moves it by 4 R b, so the growth is 8 R.

Source: T. Moller, B. Trumbore, Fast, minimum storage ray/triangle intersection, 1997; the shear is that of S. Woop,
C. Benthin, I. Wald, Watertight ray/triangle intersection, 2013. Changed: conservative, exact signs decide behind it.
"""

from __future__ import annotations

from typing import Any, Final

from engine.compiling.jit import inline
from engine.lanes.boxes import BOX_ROWS
from engine.lanes.lanes import bits_of, greater, lesser, load
from engine.lanes.tracing import Number, Rows, Triple, traced

CORNER_ROWS: Final = 9
"""ax ay az bx by bz cx cy cz."""
AXES_BEFORE: Final = (1, 2, 0, 1, 2)
"""The other two of axis k: AXES_BEFORE[k], AXES_BEFORE[k + 1]."""


@inline
def longest_axis(half: tuple[float, ...]) -> int:
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


OVERHEAD_ROWS: Final = 8
BAND: Final = 2.0**-17
GROWTH: Final = 8.0
LEAST_REACH: Final = 2.0**-50


@traced
def overhead(blocks: Rows, boxes: Rows, node: int, x: Number, y: Number, z: Number, blur: Number) -> tuple[int, int]:
    """Return the lanes of a node whose triangles surely lie over a point, and those that it is surely beside.

    x, y: less the block's centre; z: an upper bound, in the coordinates of boxes (`bvh.py`).
    """
    rows = [load(blocks, OVERHEAD_ROWS * node + row) for row in range(OVERHEAD_ROWS)]
    u, v = [rows[k] - x for k in (0, 2, 4)], [rows[k] - y for k in (1, 3, 5)]
    turns = [u[i] * v[j] - v[i] * u[j] for i, j in ((0, 1), (1, 2), (2, 0))]
    least, most = lesser(lesser(turns[0], turns[1]), turns[2]), greater(greater(turns[0], turns[1]), turns[2])
    band = rows[6] + rows[7] * blur + blur * blur * BAND
    is_above = load(boxes, BOX_ROWS * node + 2) - load(boxes, BOX_ROWS * node + 5) > z
    is_within = (least - band > 0.0) | (most + band < 0.0)
    is_beside = (least + band < 0.0) & (most - band > 0.0)
    return bits_of(is_within & is_above), bits_of(is_beside)
