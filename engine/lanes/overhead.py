"""Which of the eight triangles of a block lie over a point: seen from above, in single precision, with a band.

A block is (8, 8) float32, a triangle to a lane: x and y of its three corners less the block's centre, the band, and its
growth with the blur b of the point. Let R >= 2^-50 bound the corners and the point about the centre, u = 2^-24, and
S = 2 R + b: no difference of corner and point is larger. It is off by 2 u S at most (each rounded once, and their
difference), a product of two by 5 u S^2, and orient2d by 12 u S^2, below 108 u max(R, b)^2 < 2^-17 (R^2 + b^2); what
underflows is far below 2^-117. The blur itself moves it by 4 R b, so the growth is 8 R.
"""

from __future__ import annotations

from typing import Final

from engine.lanes.boxes import BOX_ROWS
from engine.lanes.lanes import bits_of, greater, lesser, load
from engine.lanes.tracing import Number, Rows, traced

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
