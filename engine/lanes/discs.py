"""Eight flat cylinders against eight of another body: which children of two nodes are beside each other.

The boxes of a tree stand along its axes, so two patches of surface that face each other askew have boxes that overlap
long before they meet. Around each child stands therefore also a flat cylinder ("disc"): about a centre c, along a unit
vector n, the mean normal of its faces, with radius r and half thickness t. Two discs are apart where n of either
separates them; with g = n_a . n_b that is

    |n . (c_b - c_a)|  >  t_a + |g| t_b + sqrt(1 - g^2) r_b          and the same with a and b exchanged.

    discs (n_nodes, 8, 8) float32: rows cx cy cz nx ny nz r t, one child to a lane, in the coordinates of the tree

Near contact this leaves a fraction of what boxes leave, and the more so the finer a surface is.

**margin.** Numbers are below 5 in the own tree. In units of 2^-24, with the other scale `ratio` times the own and the
shift T of `frames`: n . (c_b - c_a) is off by less than 80 ratio + 16 |T| + 30 (corners, products and sums), the right
side by less than 70 ratio + 40 (g is off by 13, either n by 10); twice the margin of a frame is 128 + 224 ratio + 64
|T| (frames.py). Under the root g^2 is off by less than 30: `_ROUND` is 64. `fill_discs` enlarges by 16, which is more
than what its own rounding and that of the corners come to. What is no number separates nothing.

Plain twins serve when the compiler is disabled.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import config as numba_config
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from engine.jit import inline, kernel
from engine.lanes.boxes import EMPTY, lowest_bit
from engine.lanes.rows import (
    FLOAT,
    LANES,
    VECTOR,
    WORD,
    absolute,
    any_above,
    bits_without,
    dot,
    first_row,
    load_row,
    spread_number,
    store_row,
)

DISC_ROWS: Final = 8
_ROUND: Final = 2.0**-18
_ENLARGED: Final = 2.0**-20
_SHIFT, _MARGIN = 18, 21  # rows of a frame


@inline
def discs_meeting(
    low: int, high: int, first: Any, i: int, second: Any, j: int, frames: Any, scales: tuple[float, float], work: Any
) -> tuple[int, int]:
    """Return those of the pairs of children (`box_lanes.meeting`) whose discs may meet.

    scales: of the two trees. work (DISC_ROWS or more, 8) float32.
    """
    if low | high == 0:
        return low, high
    place_discs(second, j, frames, np.float32(scales[1] / scales[0]), np.float32(scales[0] / scales[1]), work)
    return _not_apart(low, 0, first, i, work), _not_apart(high, LANES // 2, first, i, work)


@inline
def _not_apart(bits: int, first_lane: int, first: Any, i: int, work: Any) -> int:
    """Return the pairs among those of four lanes that no normal parts."""
    kept = 0
    while bits != 0:  # bound: each turn ends a lane
        shift = lowest_bit(bits) & -LANES
        lane_bits = bits & 255 << shift
        bits ^= lane_bits
        kept |= lane_bits & beside_disc(first, i, first_lane + shift // LANES, work) << shift
    return kept


# ---- plain twins ----------------------------------------------------------------------------------------------------


def plain_place_discs(second: Any, j: int, frames: Any, ratio: Any, inverse: Any, work: Any) -> None:
    """Write the discs of node j, in the tree of the first body, to `work`; to their radii, twice the margin."""
    b, frame = second[j], frames[0]
    with np.errstate(all="ignore"):
        for k in range(3):
            work[k] = frame[3 * k] * b[0] + frame[3 * k + 1] * b[1] + frame[3 * k + 2] * b[2] + frame[_SHIFT + k]
            work[3 + k] = (frame[3 * k] * b[3] + frame[3 * k + 1] * b[4] + frame[3 * k + 2] * b[5]) * inverse
        work[6] = b[6] * ratio
        work[7] = b[7] * ratio
        work[8] = frame[_MARGIN] + frame[_MARGIN]


def plain_beside_disc(first: Any, i: int, lane: int, work: Any) -> int:
    """Return the discs in `work`, a bit each, that are not apart from one child of node i."""
    a = first[i, :, lane]
    with np.errstate(all="ignore"):
        gap = [work[k] - a[k] for k in range(3)]
        g = a[3] * work[3] + a[4] * work[4] + a[5] * work[5]
        along_a = np.abs(a[3] * gap[0] + a[4] * gap[1] + a[5] * gap[2])
        along_b = np.abs(work[3] * gap[0] + work[4] * gap[1] + work[5] * gap[2])
        rest = np.float32(1.0 + _ROUND) - g * g
        s, g = np.sqrt(np.where(rest > np.float32(_ROUND), rest, np.float32(_ROUND))), np.abs(g)
        apart = along_a > g * work[7] + s * work[6] + (work[8] + a[7])
        apart |= along_b > g * a[7] + s * a[6] + (work[8] + work[7])
    return sum(1 << place for place in np.flatnonzero(~apart).tolist())


# ---- compiled -------------------------------------------------------------------------------------------------------


def _place_discs_intrinsic(
    typing_context: Any, second: Any, j: Any, frames: Any, ratio: Any, inverse: Any, work: Any
) -> Any:
    """Do what `plain_place_discs` does; arrays C-contiguous."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first = first_row(context, builder, signature.args[0], arguments[0], arguments[1], DISC_ROWS)
        b = [load_row(builder, first, place) for place in range(DISC_ROWS)]
        zero = ir.Constant(WORD, 0)
        frame = first_row(context, builder, signature.args[2], arguments[2], zero, 1)
        work = first_row(context, builder, signature.args[5], arguments[5], zero, 1)
        ratio, inverse = (spread_number(builder, arguments[place]) for place in (3, 4))
        for k in range(3):
            turn = [load_row(builder, frame, 3 * k + place) for place in range(3)]
            shift = load_row(builder, frame, _SHIFT + k)
            store_row(builder, work, k, builder.fadd(dot(builder, turn, b[:3]), shift))
            store_row(builder, work, 3 + k, builder.fmul(dot(builder, turn, b[3:6]), inverse))
        store_row(builder, work, 6, builder.fmul(b[6], ratio))
        store_row(builder, work, 7, builder.fmul(b[7], ratio))
        margin = load_row(builder, frame, _MARGIN)
        store_row(builder, work, 8, builder.fadd(margin, margin))
        return context.get_dummy_value()

    return types.none(second, types.int64, frames, types.float32, types.float32, work), generate


def _beside_disc_intrinsic(typing_context: Any, first: Any, i: Any, lane: Any, work: Any) -> Any:
    """Return what `plain_beside_disc` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        node = first_row(context, builder, signature.args[0], arguments[0], arguments[1], DISC_ROWS)
        node = builder.gep(node, [arguments[2]])
        work = first_row(context, builder, signature.args[3], arguments[3], ir.Constant(WORD, 0), 1)

        def number(place: int) -> Any:
            there = builder.gep(node, [ir.Constant(WORD, place * LANES)])
            return spread_number(builder, builder.load(there))

        def constant(value: float) -> Any:
            return ir.Constant(VECTOR, [ir.Constant(FLOAT, value)] * LANES)

        a = [number(place) for place in range(DISC_ROWS)]
        b = [load_row(builder, work, place) for place in range(DISC_ROWS + 1)]
        gap = [builder.fsub(b[k], a[k]) for k in range(3)]
        g = dot(builder, a[3:6], b[3:6])
        along_a, along_b = (absolute(builder, dot(builder, n[3:6], gap)) for n in (a, b))
        rest = builder.fsub(constant(1.0 + _ROUND), builder.fmul(g, g))
        rest = builder.select(builder.fcmp_ordered(">", rest, constant(_ROUND)), rest, constant(_ROUND))
        root_type = ir.FunctionType(VECTOR, [VECTOR])
        square_root = cgutils.get_or_insert_function(builder.module, root_type, "llvm.sqrt.v8f32")
        s, g = builder.call(square_root, [rest]), absolute(builder, g)

        def reach(theirs: list[Any], ours: list[Any]) -> Any:
            across = builder.fadd(builder.fmul(g, theirs[7]), builder.fmul(s, theirs[6]))
            return builder.fadd(across, builder.fadd(b[8], ours[7]))

        return bits_without(builder, any_above(builder, [(along_a, reach(b, a)), (along_b, reach(a, b))]))

    return types.int64(first, types.int64, types.int64, work), generate


place_discs: Any = plain_place_discs if numba_config.DISABLE_JIT else intrinsic(_place_discs_intrinsic)
beside_disc: Any = plain_beside_disc if numba_config.DISABLE_JIT else intrinsic(_beside_disc_intrinsic)


# ---- the discs of a tree --------------------------------------------------------------------------------------------


@kernel
def fill_discs(blocks: Any, child: Any, boxes: Any, discs: Any) -> None:
    """Fill discs (n_nodes, 8, 8), of inner nodes only, from blocks (`faces.py`) and boxes of the same tree.

    A disc stands on the axis through the middle of the child's box along the sum of the normals of its faces.
    """
    n_nodes = child.shape[0]
    parent = np.full(n_nodes, -1, np.int64)  # 8 times the parent, and the lane
    sums = np.zeros((n_nodes, 3))
    for node in range(n_nodes):
        for lane in range(LANES):
            if child[node, lane] >= 0:
                parent[child[node, lane]] = LANES * node + lane
    for node in range(n_nodes):
        if child[node, 0] >= 0:
            continue
        x = y = z = 0.0
        for lane in range(LANES):
            if child[node, lane] == EMPTY:
                continue
            b = blocks[node, :, lane]
            ux, uy, uz = float(b[3]) - b[0], float(b[4]) - b[1], float(b[5]) - b[2]
            vx, vy, vz = float(b[6]) - b[0], float(b[7]) - b[1], float(b[8]) - b[2]
            x, y, z = x + (uy * vz - uz * vy), y + (uz * vx - ux * vz), z + (ux * vy - uy * vx)
        above = node
        while above >= 0:  # bound: the depth of the tree
            sums[above, 0] += x
            sums[above, 1] += y
            sums[above, 2] += z
            above = parent[above] >> 3 if parent[above] >= 0 else -1
    # the normal of a child, then the least and largest product with it and the largest squared distance from the axis
    normals, reached = np.empty((n_nodes, 3)), np.zeros((n_nodes, 3))
    for node in range(n_nodes):
        size = np.sqrt(sums[node, 0] ** 2 + sums[node, 1] ** 2 + sums[node, 2] ** 2)
        for k in range(3):
            normals[node, k] = sums[node, k] / size if size > 1e-100 else (1.0 if k == 2 else 0.0)
        reached[node, 0], reached[node, 1] = np.inf, -np.inf
    for node in range(n_nodes):
        if child[node, 0] >= 0:
            continue
        for lane in range(LANES):
            if child[node, lane] == EMPTY:
                continue
            b = blocks[node, :, lane]
            for corner in range(3):
                px, py, pz = b[3 * corner], b[3 * corner + 1], b[3 * corner + 2]
                below, up = node, parent[node]
                while up >= 0:  # bound: the depth of the tree
                    at, lane_above = up >> 3, up & 7
                    x = float(px) - boxes[at, 0, lane_above]
                    y = float(py) - boxes[at, 1, lane_above]
                    z = float(pz) - boxes[at, 2, lane_above]
                    along = x * normals[below, 0] + y * normals[below, 1] + z * normals[below, 2]
                    reached[below, 0] = min(reached[below, 0], along)
                    reached[below, 1] = max(reached[below, 1], along)
                    reached[below, 2] = max(reached[below, 2], x * x + y * y + z * z - along * along)
                    below, up = at, parent[at]
    for node in range(n_nodes):
        if child[node, 0] < 0:
            continue
        for lane in range(LANES):
            below = child[node, lane]
            if below == EMPTY:
                discs[node, :, lane] = 0.0
                continue
            middle = 0.5 * (reached[below, 0] + reached[below, 1])
            for k in range(3):
                discs[node, k, lane] = boxes[node, k, lane] + normals[below, k] * middle
                discs[node, 3 + k, lane] = normals[below, k]
            radius, half = np.sqrt(max(0.0, reached[below, 2])), 0.5 * (reached[below, 1] - reached[below, 0])
            discs[node, 6, lane] = radius * (1.0 + _ENLARGED) + _ENLARGED
            discs[node, 7, lane] = half * (1.0 + _ENLARGED) + _ENLARGED
