"""One pair of convex bodies under many poses of the second: the search of `xenocollide.py`, eight at once, in float32.

The first body rests, the second is posed. Coordinates count from a point inside each body, in units of a power of two
that no coordinate exceeds in magnitude (`lane_arrays`); T stands for the largest coordinate of the shift v0 between the
two points, computed in float64. All vertices are looked at, so a largest value is that of the whole body. What a lane
proves is proven as in `xenocollide.py`, with wider margins, for every entry rounded to float32 (u = 2^-24); a lane that
proves nothing is searched again in float64.

**Apart.** For a direction d, |d|_1 = D: largest d . a is off by 4.1 u D (rounded coordinates, three roundings); d
turned into the second body by 4.1 u D an entry, so largest d . R b by 12.3 u D and by 4.1 u of |R'd|_1 <= 1.74 D;
d . v0 by 4.1 u T D, the sums by u (5.5 + T) D: together below (30 + 5.1 T) u D, and `margin` is 2^-19 (1 + T / 4), plus
what float64 may have lost of v0. Directions of D <= 2^-40 prove nothing, so underflow is far below the margins.

**Meeting.** A corner a - R b + v0 is off by u for a, 8.9 u for R b, T u for v0, and by u (5.5 + T) for the sums:
below `margin` again.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numpy as np

from engine.collision.codes import DISJOINT, OVERLAPPING, UNSETTLED
from engine.collision.convex.body import ASIDE, CENTER, RADIUS, ConvexArrays, ConvexBody
from engine.collision.convex.pair import LARGEST_ERROR, inner_point, is_farther, relate_meeting
from engine.collision.convex.xenocollide import PlacedBody, is_around_origin, placed_body
from engine.collision.meshes.placement import PoseArrays
from engine.jit import allocating_kernel, inline, merged
from engine.lanes.lanes import bits_of, load, lowest_bit, select, spread, store
from engine.lanes.tracing import LANES
from engine.predicates.vectors import cross, dot, largest_of, minus, negative
from engine.types import Point3

MOST_VERTICES = 512
"""Of both bodies together: beyond, a walk uphill is shorter than a look at all."""

TURN, V0, D, V1, V2, V3, STAGE, MARGIN, TURNS = 0, 9, 12, 15, 18, 21, 24, 25, 26
N_ROWS = 27
"""Rows of the state (N_ROWS, 8) float32: the rotation, points of three rows each, and where the search stands."""

_TURNS = 48
_GUARD = 2.0**-40


@merged
def _point(state: Any, row: int) -> Point3:
    return Point3(load(state, row), load(state, row + 1), load(state, row + 2))


@merged
def _keep(state: Any, row: int, p: Point3) -> None:
    store(state, row, p.x)
    store(state, row + 1, p.y)
    store(state, row + 2, p.z)


@merged
def _either(mask: Any, a: Point3, b: Point3) -> Point3:
    """Return a in the lanes of the mask, else b."""
    return Point3(select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z))


@merged
def _farthest(points: Any, d: Point3) -> tuple[Point3, Any]:
    """Return the vertex farthest along d, and how far."""
    x, y, z = spread(points[0, 0]), spread(points[1, 0]), spread(points[2, 0])
    most = x * d.x + y * d.y + z * d.z
    for point in range(1, points.shape[1]):
        px, py, pz = spread(points[0, point]), spread(points[1, point]), spread(points[2, point])
        value = px * d.x + py * d.y + pz * d.z
        is_farther = value > most
        most = select(is_farther, value, most)
        x, y, z = select(is_farther, px, x), select(is_farther, py, y), select(is_farther, pz, z)
    return Point3(x, y, z), most


@inline
def step(first: Any, second: Any, state: Any) -> tuple[int, int, int]:
    """Move every lane by a support point; return bits of lanes proven apart, that may meet (V0 to V3), that ended."""
    v0, d, v1 = _point(state, V0), _point(state, D), _point(state, V1)
    xx, xy, xz = load(state, TURN), load(state, TURN + 1), load(state, TURN + 2)
    yx, yy, yz = load(state, TURN + 3), load(state, TURN + 4), load(state, TURN + 5)
    zx, zy, zz = load(state, TURN + 6), load(state, TURN + 7), load(state, TURN + 8)
    a, reach = _farthest(first, d)
    local = Point3(
        -(xx * d.x + yx * d.y + zx * d.z), -(xy * d.x + yy * d.y + zy * d.z), -(xz * d.x + yz * d.y + zz * d.z)
    )
    b, their_reach = _farthest(second, local)
    v = Point3(
        a.x - (xx * b.x + xy * b.y + xz * b.z) + v0.x,
        a.y - (yx * b.x + yy * b.y + yz * b.z) + v0.y,
        a.z - (zx * b.x + zy * b.y + zz * b.z) + v0.z,
    )
    zero, stage = spread(0.0), load(state, STAGE)
    size = abs(d.x) + abs(d.y) + abs(d.z)
    slack, height = load(state, MARGIN) * size, reach + their_reach + dot(d, v0)
    is_below, is_apart = ~(height > zero), (height < -slack) & (size > spread(_GUARD))

    is_first, is_second = stage < spread(0.5), (stage > spread(0.5)) & (stage < spread(1.5))
    is_third, is_last = (stage > spread(1.5)) & (stage < spread(2.5)), stage > spread(2.5)
    is_stuck = is_last & ~(height - dot(v1, d) > slack)
    v2, v3 = _point(state, V2), _point(state, V3)
    side = cross(v, v0)
    by_v1, by_v2, by_v3 = dot(v1, side), dot(v2, side), dot(v3, side)
    above1, above2, above3 = by_v1 > zero, by_v2 > zero, by_v3 > zero
    below1 = by_v1 < zero
    to1 = is_first | (is_third & ~below1 & above2) | (is_last & ((above1 & above2) | (~above1 & ~above3)))
    to2 = is_second | (is_third & below1) | (is_last & ~above1 & above3)
    to3 = ~(to1 | to2)
    v1, v2, v3 = _either(to1, v, v1), _either(to2, v, v2), _either(to3, v, v3)
    has_portal = is_last | (is_third & to3)
    p = _either(is_first, v0, minus(_either(has_portal, v2, v1), _either(has_portal, v1, v0)))
    q = _either(is_first, v, minus(_either(has_portal, v3, v2), _either(has_portal, v1, v0)))
    d = cross(p, q)
    is_turned = is_second & (dot(d, v0) > zero)
    v1, v2 = _either(is_turned, v2, v1), _either(is_turned, v1, v2)
    d = _either(is_turned, negative(d), d)
    meets = has_portal & ~is_below & ~is_stuck & (dot(d, v1) >= zero)
    turns = load(state, TURNS) + spread(1.0)
    has_ended = is_below | is_stuck | meets | (turns > spread(_TURNS))
    stage = select(has_portal, spread(3.0), select(is_first, spread(1.0), spread(2.0)))
    _keep(state, V1, v1)
    _keep(state, V2, v2)
    _keep(state, V3, v3)
    _keep(state, D, d)
    store(state, STAGE, stage)
    store(state, TURNS, turns)
    return bits_of(is_apart), bits_of(meets), bits_of(has_ended)


@merged
def lane_point(state: Any, row: int, lane: int) -> Point3:
    """Return a point of one lane, in float64."""
    return Point3(np.float64(state[row, lane]), np.float64(state[row + 1, lane]), np.float64(state[row + 2, lane]))


LEAST_POSES = 32
"""What the lanes need is made in the time that they spare on so many poses."""

_ALL_LANES = (1 << LANES) - 1


LaneArrays = namedtuple("LaneArrays", "first second scale")
"""What the lanes see of a pair: vertices (3, n) float32 of either body, in units of scale."""


def lane_arrays(first: ConvexBody, second: ConvexBody) -> LaneArrays | None:
    """Return the pair for the lanes, None where these do not pay or its numbers do not fit."""
    if first.points.shape[1] + second.points.shape[1] > MOST_VERTICES or not (
        len(first.anchors) and len(second.anchors)
    ):
        return None
    with np.errstate(all="ignore"):
        points = first.points - first.numbers[CENTER : CENTER + 3, None]
        their_points = second.points - second.numbers[ASIDE : ASIDE + 3, None]
        reach = max(np.abs(points).max(), np.abs(their_points).max())
    if not 2.0**-900 < reach < 2.0**250:
        return None
    scale = float(2.0 ** np.frexp(reach)[1])
    return LaneArrays(
        np.ascontiguousarray(points / scale, np.float32), np.ascontiguousarray(their_points / scale, np.float32), scale
    )


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
    f, v0 = b.place, Point3(start.x * per_unit, start.y * per_unit, start.z * per_unit)
    for row, p in ((TURN, f.x), (TURN + 3, f.y), (TURN + 6, f.z), (V0, v0), (D, negative(v0))):
        state[row, lane], state[row + 1, lane], state[row + 2, lane] = p
    state[STAGE, lane], state[TURNS, lane] = 0.0, 0.0
    state[MARGIN, lane] = 2.0**-19 * (1.0 + 0.25 * largest_of(v0)) + error * per_unit
    return UNSETTLED


@inline
def _meets(state: Any, lane: int) -> bool:
    """Tell whether the four points of a lane prove that the open interiors meet."""
    p, q = lane_point(state, V0, lane), lane_point(state, V1, lane)
    r, s = lane_point(state, V2, lane), lane_point(state, V3, lane)
    return is_around_origin(p, q, r, s, np.float64(state[MARGIN, lane]))


@allocating_kernel
def relate_in_lanes(
    pool: ConvexArrays, lanes: LaneArrays, still: PoseArrays, poses: PoseArrays, is_boolean: bool, relations: Any,
    flag: Any,
) -> None:  # fmt: skip
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
                relations[item] = OVERLAPPING
                if not is_boolean:
                    b = placed_body(pool, 1, poses, item)
                    start = minus(inner_point(pool.numbers, 0, a, CENTER), inner_point(pool.numbers, 1, b, ASIDE))
                    relations[item] = relate_meeting(pool, 0, 1, a, b, dot(start, start))
