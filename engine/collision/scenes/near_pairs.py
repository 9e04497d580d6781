"""Which pairs of a scene that do not meet are nearer than a gap, and how far apart they are.

Boxes along the axes, balls and convex bodies are measured in batches (closed_forms.py, convex_gaps.py), all others as
by `clearance_poses`.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import Final

import numpy as np

from engine.arrays import FloatArray, IntArray, read_only
from engine.budget import Budget
from engine.collision.clearance.clearance import has_plane
from engine.collision.clearance.convex_gaps import gaps_of_pairs
from engine.collision.clearance.forms import are_small, gap_of_planes, told_under_poses
from engine.collision.clearance.spreads import SpreadPair, in_space
from engine.collision.convex.body import pooled
from engine.collision.meshes.placement import PoseArrays
from engine.collision.scenes.batches import SceneBatches
from engine.collision.scenes.bodies import SceneBodies
from engine.collision.simple.closed_forms import form_of
from engine.collision.simple.form_relations import N_NUMBERS
from engine.direct import entry_of
from engine.parallel import run_chunks

_STRETCHED: Final = 1.0 + 2.0**-38
"""What a pose may stretch: no entry of R' R - I is beyond 1e-12. Two equal poses are left out, as by `collide`, but not
from the boxes."""


_NONE: Final = pooled([])


def enlarged(bodies: SceneBodies, gap: float | None) -> FloatArray:
    """Return the low corners (n, d) moved outward by the gap: boxes of bodies that are nearer have a common point."""
    return bodies.low if gap is None else np.nextafter(bodies.low - gap * _STRETCHED, -np.inf)


def distances_below(
    batches: SceneBatches, pairs: IntArray, gap: float, is_measured: bool, budget: Budget, workers: int | None
) -> FloatArray:
    """Return ``(n,)`` the distances of pairs without a common point that are nearer than the gap, infinite for others.

    is_measured: else only whether they are nearer is told, and those that are have 0.0.
    """
    bodies, found = batches.bodies, np.full(len(pairs), np.inf)
    if not gap:
        return found
    places = pairs + 1
    kinds, (i, j) = bodies.kinds[pairs], places.T
    turns, moves = bodies.rotations, bodies.translations
    equal = np.flatnonzero((moves[i] == moves[j]).all(axis=1))  # of equal poses, which are left out, as by `collide`
    places[equal[(turns[i[equal]] == turns[j[equal]]).all(axis=(1, 2))]] = 0
    forms = np.full((len(bodies.distinct), N_NUMBERS), np.nan)  # of solids that have none
    for kind in np.flatnonzero(np.bincount(kinds.ravel(), minlength=len(forms))).tolist():
        form = form_of(bodies.distinct[kind])
        forms[kind] = forms[kind] if form is None else form
    pool, convex = _NONE, np.full(len(forms), -1, np.int64)
    if bodies.dimension == 3 and (bodies.is_posed[pairs].any() or np.isnan(forms[kinds, 0]).any()):
        pool, convex = batches.pairs.pool(budget)

    def by_batch(start: int, stop: int) -> None:
        entry_of(gaps_of_pairs)(
            forms, pool, convex, kinds[start:stop], PoseArrays(turns, moves, True), places[start:stop], gap,
            is_measured, found[start:stop], budget.flag,
        )  # fmt: skip

    run_chunks(by_batch, len(pairs), budget=budget, workers=workers)
    still = np.flatnonzero(np.isnan(found))
    still = still[np.lexsort(kinds[still].T)]  # pairs of the same two solids are asked together

    def by_search(start: int, stop: int) -> None:
        some = kinds[still[start:stop]]
        ends = [*(start + 1 + np.flatnonzero((some[1:] != some[:-1]).any(axis=1))).tolist(), stop]
        for begin, end in pairwise([start, *ends]):
            rows = still[begin:end]
            found[rows] = _asked(bodies, pairs[rows], places[rows], gap, is_measured, budget)

    run_chunks(by_search, len(still), budget=budget, first_chunk=4, workers=workers)
    return found


def _asked(
    bodies: SceneBodies, pairs: IntArray, places: IntArray, gap: float, is_measured: bool, budget: Budget
) -> FloatArray:
    """Return the distances of pairs of the same two solids under the poses of some rows, as `distances_below` does."""
    first, second = (bodies.solids[number] for number in pairs[0].tolist())
    found = np.full(len(pairs), np.nan)
    if has_plane(first, second):
        for item, ((i, j), place) in enumerate(zip(pairs.tolist(), places[:, 0].tolist())):
            budget.check()
            placed = (bodies.poses[i], bodies.poses[j]) if place else (None, None)
            apart, _ = gap_of_planes(first, second, placed, budget)
            found[item] = np.inf if apart.is_at_least(Fraction(gap)) else apart.distance() if is_measured else 0.0
        return found
    if are_small(first, second):
        motions = [read_only(some[rows]) for rows in places.T for some in (bodies.rotations, bodies.translations)]
        found = told_under_poses(first, second, motions, None if is_measured else Fraction(gap), budget)
        found[found > gap], found[found == gap] = np.inf, np.nan
        if not np.isnan(found).any():
            return found
    own, others = (in_space(bodies.rotations[rows], bodies.translations[rows]) for rows in places.T)
    pair = SpreadPair(first, second, own, others, budget)
    pair.fill(0, len(pairs), found, Fraction(gap))
    if is_measured:
        found[found == 0.0] = np.nan
        pair.fill(0, len(pairs), found)
    return found
