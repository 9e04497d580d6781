"""Eight boxes against eight boxes of another body at once, one to a lane.

Two nodes of two trees (`bvh.py`), each in the coordinates of its own tree, and the two maps between those (`frames`)
give 64 answers in some 200 vector instructions: the images of eight boxes are boxes around turned ones, and a pair is
apart where an axis of either tree separates it (six of the fifteen axes of two turned boxes; the others cost more than
they spare). The compiler does not find this by itself, hence the intrinsics; each has a plain twin with the same
results up to rounding, used when the compiler is disabled. Boxes and margins hold whatever float32 rounds.

    frames (2, 22, 8) float32, every number in all lanes: [0] takes the second tree to the first, [1] the first to the
    second. Rows: matrix by rows (9), magnitudes of its entries (9), shift (3), margin (1).
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import config as numba_config
from numba import types
from numba.extending import intrinsic

from engine.lanes.rows import (
    LANES,
    WORD,
    any_above,
    bits_by_row,
    bits_without,
    first_row,
    load_row,
    spread,
    spread_number,
)

FRAME_ROWS: Final = 22
EMPTY: Final = -(2**31)
"""What a node of a tree names in a lane without a child (`bvh.py`)."""


def plain_meeting(first: Any, i: int, second: Any, j: int, frames: Any) -> tuple[int, int]:
    """Return which children of node i and node j may meet: bit 8 a + b for the lanes a and b, lanes a < 4 and the
    others apart, each in 32 bits."""
    a, b = first[i], second[j]
    with np.errstate(all="ignore"):
        apart = _apart_on_axes(a, b, frames[0]) | _apart_on_axes(b, a, frames[1]).T
    bits = sum(1 << place for place in np.flatnonzero(~apart.reshape(-1)).tolist())
    return bits & 0xFFFFFFFF, bits >> 32


def _apart_on_axes(a: Any, b: Any, frame: Any) -> Any:
    """Return (8, 8): is lane a apart from the image of lane b on an axis of a?"""
    apart = np.zeros((LANES, LANES), np.bool_)
    for k in range(3):
        centre = frame[3 * k] * b[0] + frame[3 * k + 1] * b[1] + frame[3 * k + 2] * b[2] + frame[18 + k]
        half = frame[9 + 3 * k] * b[3] + frame[10 + 3 * k] * b[4] + frame[11 + 3 * k] * b[5] + frame[21]
        low, high = a[k] - a[3 + k], a[k] + a[3 + k]
        apart |= (centre - half)[None, :] > high[:, None]
        apart |= low[:, None] > (centre + half)[None, :]
    return apart


def plain_inside_box(boxes: Any, node: int, low: Any, high: Any) -> int:
    """Return the lanes of a node, a bit each, that meet the box of two triples of float32."""
    b = boxes[node]
    meets = np.ones(LANES, np.bool_)
    for k in range(3):
        meets &= (b[k] - b[3 + k] <= high[k]) & (b[k] + b[3 + k] >= low[k])
    return sum(1 << lane for lane in np.flatnonzero(meets).tolist())


def plain_lowest_bit(bits: int) -> int:
    """Return the place of the lowest bit set; bits > 0."""
    return (int(bits) & -int(bits)).bit_length() - 1


def _image(builder: Any, box: list[Any], frame: list[Any]) -> tuple[list[Any], list[Any]]:
    """Return low and high of the eight boxes around the images of eight boxes."""

    def product(places: list[int], vectors: list[Any], last: Any) -> Any:
        x, y, z = (builder.fmul(frame[place], vector) for place, vector in zip(places, vectors, strict=True))
        return builder.fadd(builder.fadd(builder.fadd(x, y), z), last)

    lows, highs = [], []
    for k in range(3):
        centre = product([3 * k, 3 * k + 1, 3 * k + 2], box[:3], frame[18 + k])
        half = product([9 + 3 * k, 10 + 3 * k, 11 + 3 * k], box[3:], frame[21])
        lows.append(builder.fsub(centre, half))
        highs.append(builder.fadd(centre, half))
    return lows, highs


def _meeting_intrinsic(typing_context: Any, first: Any, i: Any, second: Any, j: Any, frames: Any) -> Any:
    """Return what `plain_meeting` does; arrays C-contiguous."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        def node(which: int) -> list[Any]:
            array_type, array, item = signature.args[which], arguments[which], arguments[which + 1]
            data = first_row(context, builder, array_type, array, item, 6)
            return [load_row(builder, data, place) for place in range(6)]

        a, b = node(0), node(2)
        data = first_row(context, builder, signature.args[4], arguments[4], ir.Constant(WORD, 0), FRAME_ROWS)
        frame = [load_row(builder, data, place) for place in range(2 * FRAME_ROWS)]
        b_low, b_high = _image(builder, b, frame[:FRAME_ROWS])
        a_low, a_high = _image(builder, a, frame[FRAME_ROWS:])
        own_low = [builder.fsub(a[k], a[3 + k]) for k in range(3)]
        own_high = [builder.fadd(a[k], a[3 + k]) for k in range(3)]
        their_low = [builder.fsub(b[k], b[3 + k]) for k in range(3)]
        their_high = [builder.fadd(b[k], b[3 + k]) for k in range(3)]

        def pairs_of(lane: int) -> list[tuple[Any, Any]]:
            pairs = []
            for k in range(3):
                pairs.append((b_low[k], spread(builder, own_high[k], lane)))
                pairs.append((spread(builder, own_low[k], lane), b_high[k]))
            for k in range(3):
                pairs.append((their_low[k], spread(builder, a_high[k], lane)))
                pairs.append((spread(builder, a_low[k], lane), their_high[k]))
            return pairs

        return bits_by_row(builder, pairs_of)

    pair = types.UniTuple(types.int64, 2)
    return pair(first, types.int64, second, types.int64, frames), generate


def _inside_box_intrinsic(typing_context: Any, boxes: Any, node: Any, low: Any, high: Any) -> Any:
    """Return what `plain_inside_box` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = first_row(context, builder, signature.args[0], arguments[0], arguments[1], 6)
        b = [load_row(builder, data, place) for place in range(6)]
        pairs = []
        for k in range(3):
            low, high = (spread_number(builder, builder.extract_value(arguments[end], k)) for end in (2, 3))
            pairs.append((builder.fsub(b[k], b[3 + k]), high))
            pairs.append((low, builder.fadd(b[k], b[3 + k])))
        return bits_without(builder, any_above(builder, pairs))

    triple = types.UniTuple(types.float32, 3)
    return types.int64(boxes, types.int64, triple, triple), generate


def _lowest_bit_intrinsic(typing_context: Any, bits: Any) -> Any:
    """Return what `plain_lowest_bit` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], ir.Constant(ir.IntType(1), 1))

    return types.int64(types.int64), generate


meeting: Any = plain_meeting if numba_config.DISABLE_JIT else intrinsic(_meeting_intrinsic)
inside_box: Any = plain_inside_box if numba_config.DISABLE_JIT else intrinsic(_inside_box_intrinsic)
lowest_bit: Any = plain_lowest_bit if numba_config.DISABLE_JIT else intrinsic(_lowest_bit_intrinsic)
