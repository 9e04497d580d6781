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

What is no number separates nothing. A plain twin serves when the compiler is disabled.

Source: T. Moller, B. Trumbore, Fast, minimum storage ray/triangle intersection, 1997; the shear is that of S. Woop,
C. Benthin, I. Wald, Watertight ray/triangle intersection, 2013. Changed: conservative, exact signs decide behind it.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import config as numba_config
from numba import types
from numba.extending import intrinsic

from engine.jit import inline
from engine.lanes.rows import (
    LANES,
    VECTOR,
    WORD,
    absolute,
    bits_without,
    first_row,
    load_row,
    spread_number,
)

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


def plain_near_triangles(
    corners: Any, node: int, i: int, j: int, k: int, middle: Any, r: Any, s: Any, reach: Any, slack: Any
) -> int:
    """Return the lanes of a block, a bit each, that the segment may meet. All numbers are float32.

    middle: on the axes i, j, k; reach: |e_k| + slack.
    """
    rows = corners[node]
    with np.errstate(all="ignore"):
        z = [rows[3 * corner + k] - middle[2] for corner in range(3)]
        x = [(rows[3 * corner + i] - middle[0]) - r * z[corner] for corner in range(3)]
        y = [(rows[3 * corner + j] - middle[1]) - s * z[corner] for corner in range(3)]
        size = (abs(x[0]) + abs(y[0])) + (abs(x[1]) + abs(y[1])) + (abs(x[2]) + abs(y[2]))
        bound = slack * size
        edges = [x[a] * y[b] - y[a] * x[b] for a, b in ((0, 1), (1, 2), (2, 0))]
        is_left, is_right = ([side * edge > bound for edge in edges] for side in (np.float32(1), np.float32(-1)))
        apart = (is_left[0] | is_left[1] | is_left[2]) & (is_right[0] | is_right[1] | is_right[2])
        apart |= (z[0] > reach) & (z[1] > reach) & (z[2] > reach)
        apart |= (z[0] < -reach) & (z[1] < -reach) & (z[2] < -reach)
    return sum(1 << lane for lane in np.flatnonzero(~apart).tolist())


def _near_triangles_intrinsic(
    typing_context: Any,
    corners: Any,
    node: Any,
    i: Any,
    j: Any,
    k: Any,
    middle: Any,
    r: Any,
    s: Any,
    reach: Any,
    slack: Any,
) -> Any:
    """Return what `plain_near_triangles` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        words = ir.VectorType(ir.IntType(32), LANES)
        sign = ir.Constant(words, [0x80000000] * LANES)

        def negative(vector: Any) -> Any:
            return builder.bitcast(builder.xor(builder.bitcast(vector, words), sign), VECTOR)

        def any_of(found: list[Any]) -> Any:
            return builder.or_(builder.or_(found[0], found[1]), found[2])

        def all_of(found: list[Any]) -> Any:
            return builder.and_(builder.and_(found[0], found[1]), found[2])

        data = first_row(context, builder, signature.args[0], arguments[0], arguments[1], CORNER_ROWS)
        first = [builder.gep(data, [builder.mul(arguments[place], ir.Constant(WORD, LANES))]) for place in (2, 3, 4)]

        def row(corner: int, axis: int) -> Any:
            return load_row(builder, first[axis], 3 * corner)

        m = [spread_number(builder, builder.extract_value(arguments[5], axis)) for axis in range(3)]
        r, s, reach, slack = (spread_number(builder, arguments[place]) for place in (6, 7, 8, 9))
        z = [builder.fsub(row(corner, 2), m[2]) for corner in range(3)]
        x = [builder.fsub(builder.fsub(row(c, 0), m[0]), builder.fmul(r, z[c])) for c in range(3)]
        y = [builder.fsub(builder.fsub(row(c, 1), m[1]), builder.fmul(s, z[c])) for c in range(3)]
        sizes = [builder.fadd(absolute(builder, x[c]), absolute(builder, y[c])) for c in range(3)]
        bound = builder.fmul(slack, builder.fadd(builder.fadd(sizes[0], sizes[1]), sizes[2]))
        edges = [builder.fsub(builder.fmul(x[a], y[b]), builder.fmul(y[a], x[b])) for a, b in ((0, 1), (1, 2), (2, 0))]
        lower, before = negative(bound), negative(reach)
        is_left = any_of([builder.fcmp_ordered(">", edge, bound) for edge in edges])
        is_right = any_of([builder.fcmp_ordered("<", edge, lower) for edge in edges])
        apart = builder.and_(is_left, is_right)
        apart = builder.or_(apart, all_of([builder.fcmp_ordered(">", z[c], reach) for c in range(3)]))
        apart = builder.or_(apart, all_of([builder.fcmp_ordered("<", z[c], before) for c in range(3)]))
        return bits_without(builder, apart)

    triple, number, word = types.UniTuple(types.float32, 3), types.float32, types.int64
    return types.int64(corners, word, word, word, word, triple, number, number, number, number), generate


near_triangles: Any = plain_near_triangles if numba_config.DISABLE_JIT else intrinsic(_near_triangles_intrinsic)
