"""Which pairs of a scene that do not meet are nearer than a gap, and how far apart they are.

Boxes around the bodies tell in doubles, with room for rounding, which pairs are surely clear; of two boxes that are
bodies themselves the same numbers tell which are surely near, of two balls the distance of the middles of their boxes.
`clearance` decides the others.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import Final

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.collision.clearance.bodies import in_space
from engine.collision.clearance.half_spaces import gap_of_planes
from engine.collision.clearance.spreads import SpreadPair
from engine.collision.scenes.bodies import SceneBodies
from engine.parallel import Budget, run_chunks
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.half_space import HalfSpace
from engine.solids.sphere import Sphere

_ROUNDING: Final = 2.0**-48
"""Of a distance of two boxes: differences, two hypotenuses and the products here round by less than 16 u."""
_TINY: Final = 2.0**-1060
_STRETCHED: Final = 1.0 + 2.0**-38
"""What a pose may stretch: no entry of R' R - I is beyond 1e-12. Two equal poses are left out, as by `collide`, but not
from the boxes."""


def enlarged(bodies: SceneBodies, gap: float | None) -> FloatArray:
    """Return the low corners (n, d) moved outward by the gap: boxes of bodies that are nearer have a common point."""
    return bodies.low if gap is None else np.nextafter(bodies.low - gap * _STRETCHED, -np.inf)


def distances_below(
    bodies: SceneBodies, pairs: IntArray, gap: float, is_measured: bool, budget: Budget, workers: int | None
) -> FloatArray:
    """Return ``(n,)`` the distances of pairs without a common point that are nearer than the gap, infinite for others.

    is_measured: else only whether they are nearer is told, and those that are have NaN.
    """
    result = np.full(len(pairs), np.inf)
    if not gap:
        return result
    apart = _apart_on_axes(bodies, pairs)
    left = np.flatnonzero(~_is_above(apart, gap * _STRETCHED))
    apart = apart[left]
    are_boxes, are_balls = (_of_type(bodies, kind)[pairs[left]].all(axis=1) for kind in (Aabb, Sphere))
    is_near, is_clear = are_boxes & _is_below(apart, gap), np.zeros(len(left), np.bool_)
    balls = np.flatnonzero(are_balls)
    is_near[balls], is_clear[balls] = _near_and_clear_balls(bodies, pairs[left[balls]], gap)
    # along one axis a difference is the nearest double
    is_known = is_near & (are_boxes & ((apart > 0.0).sum(axis=1) == 1) if is_measured else True)
    result[left[is_known]] = apart[is_known].max(axis=1) if is_measured else np.nan
    is_left = ~(is_known | is_clear)
    left, is_near = left[is_left], is_near[is_left]
    order = np.lexsort(bodies.kinds[pairs[left]].T)  # pairs of the same two solids are asked together
    left, is_near = left[order], is_near[order]

    def task(start: int, stop: int) -> None:
        kinds = bodies.kinds[pairs[left[start:stop]]]
        ends = [*(start + 1 + np.flatnonzero((kinds[1:] != kinds[:-1]).any(axis=1))).tolist(), stop]
        for begin, end in pairwise([start, *ends]):
            some = left[begin:end]
            result[some] = _asked(bodies, pairs[some], is_near[begin:end], gap, is_measured, budget)

    run_chunks(task, len(left), budget=budget, first_chunk=4, workers=workers)
    return result


def _asked(
    bodies: SceneBodies, pairs: IntArray, is_near: BoolArray, gap: float, is_measured: bool, budget: Budget
) -> FloatArray:
    """Return the distances of pairs of the same two solids, as `distances_below` does; is_near: those proven so."""
    first, second = (bodies.solids[number] for number in pairs[0].tolist())
    found = np.where(is_near, 0.0, np.nan)
    if isinstance(first, HalfSpace) or isinstance(second, HalfSpace):
        for item, (i, j) in enumerate(pairs.tolist()):
            budget.check()
            p, q = bodies.poses[i], bodies.poses[j]
            p, q = (None, None) if p == q else (p, q)
            apart, _ = gap_of_planes(first, second, p, q, budget)
            found[item] = np.inf if apart.is_at_least(Fraction(gap)) else apart.distance() if is_measured else np.nan
        return found
    turns, moves, (i, j) = bodies.rotations, bodies.translations, pairs.T + 1
    is_equal = (turns[i] == turns[j]).all(axis=(1, 2)) & (moves[i] == moves[j]).all(axis=1)
    own, others = (in_space(turns[rows], moves[rows]) for rows in (np.where(is_equal, 0, i), np.where(is_equal, 0, j)))
    pair = SpreadPair(first, second, own, others, budget)
    pair.fill(0, len(pairs), found, Fraction(gap))
    found[found == 0.0] = np.nan
    if is_measured:
        pair.fill(0, len(pairs), found)
    return found


@np.errstate(all="ignore")
def _apart_on_axes(bodies: SceneBodies, pairs: IntArray) -> FloatArray:
    """Return ``(n, d)`` how far the boxes of pairs are apart on each axis, 0 where they are not."""
    (i, j), low, high = pairs.T, bodies.low, bodies.high
    return np.fmax(np.fmax(low[j] - high[i], low[i] - high[j]), 0.0)


def _of_type(bodies: SceneBodies, kind: type[Solid]) -> BoolArray:
    """Tell which bodies are of a type; boxes only where they are their own."""
    found = np.array([isinstance(solid, kind) for solid in bodies.distinct], np.bool_)[bodies.kinds]
    return found & ~bodies.is_posed if kind is Aabb else found


@np.errstate(all="ignore")
def _near_and_clear_balls(bodies: SceneBodies, pairs: IntArray, gap: float) -> tuple[BoolArray, BoolArray]:
    """Tell which pairs of balls are surely nearer than the gap, and which surely not.

    Bound: the middle of a ball's box is off by a few roundings of its corners, which the largest of them bounds.
    """
    (i, j), low, high = pairs.T, bodies.low, bodies.high
    radii = np.array([getattr(solid, "radius", 0.0) for solid in bodies.distinct])[bodies.kinds]
    size = np.maximum(np.abs(low), np.abs(high)).max(axis=1)
    middles = 0.5 * low + 0.5 * high
    apart = _distance(middles[i] - middles[j]) - radii[i] - radii[j]
    slack = 64.0 * _ROUNDING * (size[i] + size[j] + gap) + _TINY
    return apart + slack < gap * (2.0 - _STRETCHED), apart - slack > gap * _STRETCHED


def _distance(apart: FloatArray) -> FloatArray:
    return np.hypot.reduce(apart, axis=1)


def _is_above(apart: FloatArray, gap: float) -> BoolArray:
    """Tell which boxes are surely further apart than the gap."""
    return _distance(apart) * (1.0 - _ROUNDING) > gap * (1.0 + _ROUNDING) + _TINY


def _is_below(apart: FloatArray, gap: float) -> BoolArray:
    """Tell which boxes are surely nearer than the gap."""
    return _distance(apart) * (1.0 + _ROUNDING) + _TINY < gap * (1.0 - _ROUNDING)
