"""Pairs of convex bodies of space in batches: balls around them, then the portal, then faces for one in the other.

Everything is float64 with a proven margin; what no margin proves, contact above all, stays UNSETTLED and is decided by
the exact path of the pair.

**Inside.** The first lies within the open interior of the second when every vertex is strictly below each face of the
second. With n the unit normal of a face as computed, and p one of its corners, n . (a - p) differs from the value for
the exact image of the face by the error of the posed coordinates and by the error of the normal times |a - p|: its
`slack`, and 3e-12 because a pose turns normals by the inverse transposed, of which a rotation of floats is off by
`engine.solids.pose.TOLERANCE`; 1e-11 covers both and the rounding.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, UNSETTLED
from engine.collision.convex.body import ASIDE, CENTER, RADIUS, ConvexArrays, point_of
from engine.collision.convex.xenocollide import APART, MEETING, PlacedBody, largest, meet_or_apart, placed_body
from engine.collision.meshes.placement import PoseArrays, placed, turned
from engine.jit import inline, kernel, merged
from engine.predicates.vectors import dot, minus
from engine.types import UNDECIDED, Point3

_OUT, _WITHIN = 0, 1
_POLL_EVERY = 256
LARGEST_ERROR = 2.0**250
"""Reached where coordinates are about 2^299: products of four lengths stay finite below it."""


@inline
def relate_convex(
    pool: ConvexArrays, first: int, second: int, a: PlacedBody, b: PlacedBody, is_boolean: bool, may_be_equal: bool
) -> int:
    """Return the relation or UNSETTLED; OVERLAPPING for all that meet if is_boolean, for equal ones if may_be_equal."""
    error = a.place.error + b.place.error
    if not error < LARGEST_ERROR:
        return UNSETTLED
    start = minus(inner_point(pool.numbers, first, a, CENTER), inner_point(pool.numbers, second, b, ASIDE))
    square = dot(start, start)
    first_radius, second_radius = pool.numbers[first, RADIUS], pool.numbers[second, RADIUS]
    if is_farther(square, first_radius + second_radius, error):
        return DISJOINT
    if a.round > 0.0 and b.round > 0.0:
        return _relate_balls(np.sqrt(square), a.round, b.round, error, may_be_equal)
    found = meet_or_apart(pool.points, pool.graph, a, b, start)
    if found == APART:
        return DISJOINT
    if found != MEETING:
        return UNSETTLED
    return OVERLAPPING if is_boolean else relate_meeting(pool, first, second, a, b, square)


@inline
def relate_meeting(pool: ConvexArrays, first: int, second: int, a: PlacedBody, b: PlacedBody, square: float) -> int:
    """Return the relation of two bodies whose open interiors meet, or UNSETTLED; square: of how far they are."""
    error = a.place.error + b.place.error
    first_lies = second_lies = _OUT
    if not is_farther(square, pool.numbers[second, RADIUS], error):
        first_lies = _lies(pool, first, second, a, b, square)
    if first_lies == _WITHIN:
        return FIRST_INSIDE_SECOND
    if not is_farther(square, pool.numbers[first, RADIUS], error):
        second_lies = _lies(pool, second, first, b, a, square)
    if second_lies == _WITHIN:
        return SECOND_INSIDE_FIRST
    return OVERLAPPING if first_lies == _OUT and second_lies == _OUT else UNSETTLED


@inline
def _relate_balls(distance: float, first_radius: float, second_radius: float, error: float, may_be_equal: bool) -> int:
    """Return the relation of two balls by the distance of their centres, or UNSETTLED."""
    both = first_radius + second_radius
    slack = 2.0**-40 * (distance + both) + 8.0 * error + 2.0**-400
    if distance > both + slack:
        return DISJOINT
    if distance < second_radius - first_radius - slack:
        return FIRST_INSIDE_SECOND
    if distance < first_radius - second_radius - slack:
        return SECOND_INSIDE_FIRST
    if may_be_equal and first_radius == second_radius and distance < both - slack:
        return OVERLAPPING  # neither lies within the other
    return OVERLAPPING if abs(first_radius - second_radius) + slack < distance < both - slack else UNSETTLED


@merged
def inner_point(numbers: Any, body: int, f: PlacedBody, which: int) -> Point3:
    """Return one of the two points inside a body, posed: CENTER or ASIDE."""
    return placed(Point3(numbers[body, which], numbers[body, which + 1], numbers[body, which + 2]), f.place)


@merged
def is_farther(square: float, distance: float, error: float) -> bool:
    """Tell whether a distance, given by its square, surely is larger than one that a pose may have stretched."""
    limit = distance * (1.0 + 2.0**-30) + 8.0 * error
    return square > limit * limit + 2.0**-900


@inline
def _lies(pool: ConvexArrays, inner: int, outer: int, a: PlacedBody, b: PlacedBody, square: float) -> int:
    """Return whether a body lies within the open interior of another: _WITHIN, _OUT (some of it not) or UNDECIDED."""
    error = 8.0 * (a.place.error + b.place.error)
    first, stop = pool.firsts[1, outer], pool.firsts[1, outer + 1]
    if first == stop:
        return _lies_in_ball(pool.points, a, inner_point(pool.numbers, outer, b, CENTER), b.round, error)
    extent, result = np.sqrt(square) + pool.numbers[inner, RADIUS] + pool.numbers[outer, RADIUS], _WITHIN
    for face in range(first, stop):
        n = turned(b.place, point_of(pool.normals, face))
        level = dot(n, placed(point_of(pool.points, pool.anchors[face]), b.place))
        height, slack = largest(pool.points, a, n) - level, extent * (1e-11 + pool.normals[3, face]) + error
        if height > slack:
            return _OUT
        if not height < -slack:
            result = UNDECIDED
    return result


@inline
def _lies_in_ball(points: Any, a: PlacedBody, center: Point3, radius: float, error: float) -> int:
    """Return the same for a ball: its centre and the farthest point of the other body."""
    most = 0.0
    for point in range(a.first, a.stop):
        v = minus(placed(point_of(points, point), a.place), center)
        most = max(most, dot(v, v))
    reach = np.sqrt(most) + a.round
    slack = 2.0**-40 * (reach + radius) + error + 2.0**-400
    return _OUT if reach > radius + slack else (_WITHIN if reach < radius - slack else UNDECIDED)


@merged
def _has_equal_pose(rotations: Any, translations: Any, i: int, j: int) -> bool:
    """Tell whether rows i and j hold one pose: then the two bodies count as unposed."""
    for k in range(3):
        for m in range(3):
            if translations[i, k] != translations[j, k] or rotations[i, k, m] != rotations[j, k, m]:
                return False
    return True


@kernel
def relate_convex_pairs(
    pool: ConvexArrays, bodies: Any, poses: PoseArrays, pairs: Any, is_boolean: bool, may_be_equal: bool,
    relations: Any, flag: Any,
) -> None:  # fmt: skip
    """Fill what is UNSETTLED in relations (n,) int8 for pairs (n, 2) of rows; bodies: of each row its body, or -1.

    poses: n_rows; row 0 holds the identity, which also stands for no pose.
    Returns early when the flag is raised.
    """
    for item in range(pairs.shape[0]):
        if item % _POLL_EVERY == 0 and flag[0] != 0:
            return
        i, j = pairs[item, 0], pairs[item, 1]
        first, second = bodies[i], bodies[j]
        if relations[item] != UNSETTLED or first < 0 or second < 0:
            continue
        if _has_equal_pose(poses.rotations, poses.translations, i, j):
            i = j = 0
            if first == second and may_be_equal:
                relations[item] = OVERLAPPING
                continue
        a, b = placed_body(pool, first, poses, i), placed_body(pool, second, poses, j)
        relations[item] = relate_convex(pool, first, second, a, b, is_boolean, may_be_equal)
