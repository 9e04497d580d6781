"""Eight triangles against eight triangles of another body at once, one to a lane: which pairs may meet.

A block (9, 8) float32 holds the corners of up to eight triangles, px py pz qx ... rz, in the coordinates of their tree
(`bvh.py`); lanes without one hold `NOWHERE`. Each block is taken to the tree of the other by `frames` (`boxes.py`),
and a pair is apart where one of eight directions separates it: the axes of either tree (`meet_boxes`), and the
normals of the two planes (`set_normals`, `beside_planes`). That spares most of the exact signs: two surfaces that come
near each other are side by side there, and it is the planes of their triangles that part them.

**margin.** A direction w, however it was rounded, separates two triangles where the numbers w . x of their corners do;
so only the corners and the products have errors. In the tree of w a corner is off by at most a quarter of `margin`
(frames.py: the sums there are those of `box_lanes.meeting`, with room to spare), a product w . x by 2^-22 |w|_1 |x|,
which is below a quarter of margin |w|_1; both bodies together: `margin` |w|_1. What underflows is below `_TINY`.
Normals are taken from a tree's own coordinates, at most 2, so nothing overflows where the other tree is large.

Plain twins serve when the compiler is disabled.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import config as numba_config
from numba import types
from numba.extending import intrinsic

from engine.jit import inline
from engine.lanes.boxes import FRAME_ROWS, lowest_bit
from engine.lanes.rows import (
    FLOAT,
    LANES,
    WORD,
    absolute,
    any_above,
    bits_by_row,
    bits_without,
    dot,
    first_row,
    load_row,
    spread,
    spread_number,
    store_row,
)
from engine.lanes.triangles import CORNER_ROWS

NOWHERE: Final = 1e30
"""Coordinate of the corners of a lane that is not used: beyond every image and every margin."""

WORK_ROWS: Final = 28
_SECOND_IMAGE, _FIRST_IMAGE, _FIRST_NORMAL, _SECOND_NORMAL = 0, 9, 18, 23
"""Rows of the work space: corners of either block in the tree of the other; normal, and lowest and highest product of
it, of either block in its own tree."""
_TINY: Final = 2.0**-120
_BEYOND: Final = 2.0**98  # a float32 between all coordinates with their margins and `NOWHERE`
_SHIFT, _MARGIN = 18, 21  # rows of a frame


@inline
def faces_meeting(first: Any, i: int, second: Any, j: int, frames: Any, work: Any) -> tuple[int, int]:
    """Return which triangles of block i and block j may meet: bit 8 a + b for the lanes a and b, lanes a < 4 and the
    others apart, each in 32 bits. work (WORK_ROWS, 8) float32: what it holds after the call is of no use."""
    low, high = meet_boxes(first, i, second, j, frames, work)
    if low | high == 0:
        return low, high
    set_normals(first, i, second, j, frames, work)
    return _not_beside(low, 0, work), _not_beside(high, LANES // 2, work)


@inline
def _not_beside(bits: int, first_lane: int, work: Any) -> int:
    """Return the pairs among those of four lanes that no normal parts."""
    kept = 0
    while bits != 0:  # bound: each turn ends a lane
        shift = lowest_bit(bits) & -LANES
        lane_bits = bits & 255 << shift
        bits ^= lane_bits
        kept |= lane_bits & beside_planes(work, first_lane + shift // LANES) << shift
    return kept


# ---- plain twins ----------------------------------------------------------------------------------------------------


def plain_meet_boxes(first: Any, i: int, second: Any, j: int, frames: Any, work: Any) -> tuple[int, int]:
    """Return as `faces_meeting` does the pairs that the axes of the trees leave; write the images to `work`."""
    a, b = first[i], second[j]
    with np.errstate(all="ignore"):
        for own, row, frame in ((b, _SECOND_IMAGE, frames[0]), (a, _FIRST_IMAGE, frames[1])):
            for corner in range(3):
                x, y, z = own[3 * corner : 3 * corner + 3]
                for k in range(3):
                    image = frame[3 * k] * x + frame[3 * k + 1] * y + frame[3 * k + 2] * z + frame[_SHIFT + k]
                    work[row + 3 * corner + k] = image
        apart = _boxes_apart(a, work[_SECOND_IMAGE : _SECOND_IMAGE + 9], frames[0, _MARGIN])
        apart |= _boxes_apart(b, work[_FIRST_IMAGE : _FIRST_IMAGE + 9], frames[1, _MARGIN]).T
        apart |= (a[0] > _BEYOND)[:, None]
    bits = sum(1 << place for place in np.flatnonzero(~apart.reshape(-1)).tolist())
    return bits & 0xFFFFFFFF, bits >> 32


def _boxes_apart(own: Any, image: Any, margin: Any) -> Any:
    """Return (8, 8): is lane a of the block apart from the image in lane b on an axis?"""
    apart = np.zeros((LANES, LANES), np.bool_)
    for k in range(3):
        apart |= image[k::3].min(axis=0)[None, :] > (own[k::3].max(axis=0) + margin)[:, None]
        apart |= (own[k::3].min(axis=0) - margin)[:, None] > image[k::3].max(axis=0)[None, :]
    return apart


def plain_set_normals(first: Any, i: int, second: Any, j: int, frames: Any, work: Any) -> None:
    """Write the normals of two blocks to `work`, and what their own corners reach along them."""
    with np.errstate(all="ignore"):
        for own, row, margin in (
            (first[i], _FIRST_NORMAL, frames[0, _MARGIN]),
            (second[j], _SECOND_NORMAL, frames[1, _MARGIN]),
        ):
            p, q, r = own[0:3], own[3:6], own[6:9]
            u, v = q - p, r - p
            for k in range(3):
                x, y = (k + 1) % 3, (k + 2) % 3
                work[row + k] = u[x] * v[y] - u[y] * v[x]
            products = [_product(work[row : row + 3], corner) for corner in (p, q, r)]
            bound = np.abs(work[row : row + 3]).sum(axis=0) * margin + np.float32(_TINY)
            work[row + 3] = np.min(products, axis=0) - bound
            work[row + 4] = np.max(products, axis=0) + bound


def _product(w: Any, x: Any) -> Any:
    return w[0] * x[0] + w[1] * x[1] + w[2] * x[2]


def plain_beside_planes(work: Any, lane: int) -> int:
    """Return the triangles of the second block, a bit each, that no normal parts from one lane of the first."""
    apart = np.zeros(LANES, np.bool_)
    with np.errstate(all="ignore"):
        for w, image in (
            (work[_FIRST_NORMAL : _FIRST_NORMAL + 5, lane, None], work[_SECOND_IMAGE : _SECOND_IMAGE + 9]),
            (work[_SECOND_NORMAL : _SECOND_NORMAL + 5], work[_FIRST_IMAGE : _FIRST_IMAGE + 9, lane, None]),
        ):
            products = [_product(w, image[3 * corner : 3 * corner + 3]) for corner in range(3)]
            apart |= (np.min(products, axis=0) > w[4]) | (w[3] > np.max(products, axis=0))
    return sum(1 << place for place in np.flatnonzero(~apart).tolist())


# ---- compiled -------------------------------------------------------------------------------------------------------


def _least(builder: Any, vectors: list[Any]) -> Any:
    least = vectors[0]
    for vector in vectors[1:]:
        least = builder.select(builder.fcmp_ordered("<", vector, least), vector, least)
    return least


def _greatest(builder: Any, vectors: list[Any]) -> Any:
    greatest = vectors[0]
    for vector in vectors[1:]:
        greatest = builder.select(builder.fcmp_ordered(">", vector, greatest), vector, greatest)
    return greatest


def _block(context: Any, builder: Any, signature: Any, arguments: Any, which: int) -> list[Any]:
    """Return the rows of a block that is argument `which`, its number the next one."""
    array_type, array, item = signature.args[which], arguments[which], arguments[which + 1]
    first = first_row(context, builder, array_type, array, item, CORNER_ROWS)
    return [load_row(builder, first, place) for place in range(CORNER_ROWS)]


def _start(context: Any, builder: Any, signature: Any, arguments: Any, which: int) -> Any:
    return first_row(context, builder, signature.args[which], arguments[which], ir.Constant(WORD, 0), 1)


def _meet_boxes_intrinsic(typing_context: Any, first: Any, i: Any, second: Any, j: Any, frames: Any, work: Any) -> Any:
    """Return what `plain_meet_boxes` does; arrays C-contiguous."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        frames = _start(context, builder, signature, arguments, 4)
        work = _start(context, builder, signature, arguments, 5)
        sides = []
        for which, image_row in ((0, _SECOND_IMAGE), (1, _FIRST_IMAGE)):
            own = _block(context, builder, signature, arguments, 2 * which)
            other = _block(context, builder, signature, arguments, 2 - 2 * which)
            frame = [load_row(builder, frames, which * FRAME_ROWS + place) for place in range(FRAME_ROWS)]
            image = []
            for corner in range(3):
                for k in range(3):
                    turned = dot(builder, frame[3 * k : 3 * k + 3], other[3 * corner : 3 * corner + 3])
                    image.append(builder.fadd(turned, frame[_SHIFT + k]))
            for place, vector in enumerate(image):
                store_row(builder, work, image_row + place, vector)
            low = [builder.fsub(_least(builder, own[k::3]), frame[_MARGIN]) for k in range(3)]
            high = [builder.fadd(_greatest(builder, own[k::3]), frame[_MARGIN]) for k in range(3)]
            sides.append(
                (low, high, [_least(builder, image[k::3]) for k in range(3)],
                 [_greatest(builder, image[k::3]) for k in range(3)])
            )  # fmt: skip
        (a_low, a_high, b_image_low, b_image_high), (b_low, b_high, a_image_low, a_image_high) = sides
        beyond = spread_number(builder, ir.Constant(FLOAT, _BEYOND))

        def pairs_of(lane: int) -> list[tuple[Any, Any]]:
            pairs = [(spread(builder, a_low[0], lane), beyond)]  # case: neither lane is used
            for k in range(3):
                pairs.append((b_image_low[k], spread(builder, a_high[k], lane)))
                pairs.append((spread(builder, a_low[k], lane), b_image_high[k]))
                pairs.append((b_low[k], spread(builder, a_image_high[k], lane)))
                pairs.append((spread(builder, a_image_low[k], lane), b_high[k]))
            return pairs

        return bits_by_row(builder, pairs_of)

    pair = types.UniTuple(types.int64, 2)
    return pair(first, types.int64, second, types.int64, frames, work), generate


def _set_normals_intrinsic(typing_context: Any, first: Any, i: Any, second: Any, j: Any, frames: Any, work: Any) -> Any:
    """Do what `plain_set_normals` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        frames = _start(context, builder, signature, arguments, 4)
        work = _start(context, builder, signature, arguments, 5)
        for which, row in ((0, _FIRST_NORMAL), (1, _SECOND_NORMAL)):
            own = _block(context, builder, signature, arguments, 2 * which)
            p, q, r = own[0:3], own[3:6], own[6:9]
            u = [builder.fsub(q[k], p[k]) for k in range(3)]
            v = [builder.fsub(r[k], p[k]) for k in range(3)]
            w = []
            for k in range(3):
                x, y = (k + 1) % 3, (k + 2) % 3
                w.append(builder.fsub(builder.fmul(u[x], v[y]), builder.fmul(u[y], v[x])))
            products = [dot(builder, w, corner) for corner in (p, q, r)]
            size = builder.fadd(builder.fadd(absolute(builder, w[0]), absolute(builder, w[1])), absolute(builder, w[2]))
            margin = load_row(builder, frames, which * FRAME_ROWS + _MARGIN)
            tiny = spread_number(builder, ir.Constant(FLOAT, _TINY))
            bound = builder.fadd(builder.fmul(size, margin), tiny)
            low = builder.fsub(_least(builder, products), bound)
            high = builder.fadd(_greatest(builder, products), bound)
            for place, vector in enumerate([*w, low, high]):
                store_row(builder, work, row + place, vector)
        return context.get_dummy_value()

    return types.none(first, types.int64, second, types.int64, frames, work), generate


def _beside_planes_intrinsic(typing_context: Any, work: Any, lane: Any) -> Any:
    """Return what `plain_beside_planes` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        work = _start(context, builder, signature, arguments, 0)

        def number(place: int) -> Any:
            there = builder.add(arguments[1], ir.Constant(WORD, place * LANES))
            return spread_number(builder, builder.load(builder.gep(work, [there])))

        def vector(place: int) -> Any:
            return load_row(builder, work, place)

        pairs = []
        for normal_row, of_normal, image_row, of_image in (
            (_FIRST_NORMAL, number, _SECOND_IMAGE, vector),
            (_SECOND_NORMAL, vector, _FIRST_IMAGE, number),
        ):
            w = [of_normal(normal_row + k) for k in range(3)]
            products = [
                dot(builder, w, [of_image(image_row + 3 * corner + k) for k in range(3)]) for corner in range(3)
            ]
            pairs.append((_least(builder, products), of_normal(normal_row + 4)))
            pairs.append((of_normal(normal_row + 3), _greatest(builder, products)))
        return bits_without(builder, any_above(builder, pairs))

    return types.int64(work, types.int64), generate


meet_boxes: Any = plain_meet_boxes if numba_config.DISABLE_JIT else intrinsic(_meet_boxes_intrinsic)
set_normals: Any = plain_set_normals if numba_config.DISABLE_JIT else intrinsic(_set_normals_intrinsic)
beside_planes: Any = plain_beside_planes if numba_config.DISABLE_JIT else intrinsic(_beside_planes_intrinsic)
