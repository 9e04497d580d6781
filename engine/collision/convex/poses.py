"""One pair of convex bodies under many poses of the second: eight searches at a time."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.arrays import Float32Array
from engine.collision.codes import DISJOINT, OVERLAPPING, UNSETTLED
from engine.collision.convex.body import ASIDE, CENTER, RADIUS, ConvexArrays, ConvexBody
from engine.collision.convex.pair import LARGEST_ERROR, inner_point, is_farther, relate_meeting
from engine.collision.convex.xenocollide import PlacedBody, is_around_origin, placed_body
from engine.collision.convex.xenocollide_lanes import (
    MARGIN,
    N_ROWS,
    V0,
    V1,
    V2,
    V3,
    lane_point,
    lane_points,
    lane_scale,
    start_lane,
    step,
)
from engine.collision.meshes.placement import PoseArrays
from engine.jit import inline, kernel
from engine.lanes.lanes import lowest_bit
from engine.lanes.tracing import LANES
from engine.predicates.vectors import dot, minus
from engine.types import Point3

LEAST_POSES = 32
"""What the lanes need is made in the time that they spare on so many poses."""

_ALL_LANES = (1 << LANES) - 1


class LaneArrays(NamedTuple):
    """What the lanes see of a pair: vertices (3, n) float32 of either body, in units of scale."""

    first: Float32Array
    second: Float32Array
    scale: float


def lane_arrays(first: ConvexBody, second: ConvexBody) -> LaneArrays | None:
    """Return the pair for the lanes, None where these do not pay or its numbers do not fit."""
    middle, their_middle = first.numbers[CENTER : CENTER + 3], second.numbers[ASIDE : ASIDE + 3]
    scale = lane_scale(first, middle, second, their_middle)
    if scale == 0.0:
        return None
    return LaneArrays(lane_points(first, middle, scale), lane_points(second, their_middle, scale), scale)


@inline
def _start(
    pool: ConvexArrays, per_unit: float, a: PlacedBody, poses: PoseArrays, item: int, state: Any, lane: int
) -> int:
    """Begin the search of a pose in a lane and return UNSETTLED; DISJOINT where the balls around the bodies tell."""
    b = placed_body(pool, 1, poses, item)
    start = minus(inner_point(pool.numbers, 0, a, CENTER), inner_point(pool.numbers, 1, b, ASIDE))
    error, square = a.place.error + b.place.error, dot(start, start)
    if error < LARGEST_ERROR and is_farther(square, pool.numbers[0, RADIUS] + pool.numbers[1, RADIUS], error):
        return DISJOINT
    v0 = Point3(start.x * per_unit, start.y * per_unit, start.z * per_unit)
    shift = max(abs(v0.x), abs(v0.y), abs(v0.z))
    start_lane(state, lane, b.place, v0, 2.0**-19 * (1.0 + 0.25 * shift) + error * per_unit)
    return UNSETTLED


@inline
def _meets(state: Any, lane: int) -> bool:
    """Tell whether the four points of a lane prove that the open interiors meet."""
    points = lane_point(state, V0, lane), lane_point(state, V1, lane), lane_point(state, V2, lane)
    return is_around_origin(
        points[0], points[1], points[2], lane_point(state, V3, lane), np.float64(state[MARGIN, lane])
    )


@inline
def _relate_met(pool: ConvexArrays, a: PlacedBody, b: PlacedBody, is_boolean: bool) -> int:
    """Return the relation of the two bodies, whose open interiors meet."""
    if is_boolean:
        return OVERLAPPING
    start = minus(inner_point(pool.numbers, 0, a, CENTER), inner_point(pool.numbers, 1, b, ASIDE))
    return relate_meeting(pool, 0, 1, a, b, dot(start, start))


@kernel
def relate_in_lanes(
    pool: ConvexArrays,
    lanes: LaneArrays,
    still: PoseArrays,
    poses: PoseArrays,
    is_boolean: bool,
    relations: Any,
    flag: Any,
) -> None:
    """Fill relations (n,) int8 of the two bodies of a pool for n poses of the second, UNSETTLED where open.

    still: the identity. A lane whose search has ended takes the next pose. Returns early when the flag is raised.
    """
    a = placed_body(pool, 0, still, 0)
    state, items = np.zeros((N_ROWS, LANES), np.float32), np.zeros(LANES, np.int64)
    n_poses, following, busy, per_unit = relations.shape[0], 0, 0, 1.0 / lanes.scale
    while flag[0] == 0:
        idle = _ALL_LANES & ~busy
        while idle != 0 and following < n_poses:
            lane = lowest_bit(idle)
            relations[following] = _start(pool, per_unit, a, poses, following, state, lane)
            if relations[following] == UNSETTLED:
                items[lane] = following
                busy |= 1 << lane
                idle &= idle - 1
            following += 1
        if busy == 0:
            return
        is_apart, meets, ended = step(lanes.first, lanes.second, state)
        ended &= busy
        busy &= ~ended
        while ended != 0:  # bound: every search ends by its count of turns
            lane = lowest_bit(ended)
            ended &= ended - 1
            item = items[lane]
            if is_apart >> lane & 1:
                relations[item] = DISJOINT
            elif meets >> lane & 1 and _meets(state, lane):
                b = placed_body(pool, 1, poses, item)
                relations[item] = _relate_met(pool, a, b, is_boolean)
