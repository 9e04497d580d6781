"""Segments through a scene: what the kernels settle (through.py), and what they leave.

A body that stands where its solid does then cuts a segment as `clip_segments` does; posed ones, CSG trees and prisms in
exact arithmetic (profiles.py).
"""

from __future__ import annotations

from dataclasses import fields
from functools import lru_cache
from typing import Any, Final, cast

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.containment.locators import locator_of
from engine.direct import entry_of
from engine.parallel import Budget, run_chunks
from engine.scenes.broad_phase import candidates
from engine.scenes.ends import Exact, Found, ScenePieces, in_order, joined
from engine.scenes.posed_mesh import MOST_MET, scratch_for
from engine.scenes.standing import Standing
from engine.scenes.through import MET, cut_pairs, find_first
from engine.segment_clipping.boundary import clip_chunk, cut_exactly
from engine.segment_clipping.clip_segments import method_for
from engine.segment_clipping.decide_then_cut import clip_on_convex
from engine.segment_clipping.pieces import Pieces, first_of, room_for
from engine.segment_clipping.profiles import ExactPiece, exact_pieces, settled
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.types import OPEN

_BYTES: Final = 400
"""Of a piece, in its part, joined and in order."""
_PAIRS: Final = 64
"""Bodies near a segment in the mean of few, for which there is room at once."""
_CROWD: Final = 48
"""Segments that go down the tree of a mesh together (mesh_streams.py) faster than one by one."""
_MOST_IN_GROUP: Final = 1 << 13
"""Segments that are cut on one body in one piece of work."""


class Counts:
    """Which segments the kernels left, and which took rational arithmetic."""

    def __init__(self, n: int) -> None:
        self.is_beyond, self.is_rational = np.zeros(n, np.bool_), np.zeros(n, np.bool_)

    def take(self, items: IntArray, counts: Counts) -> None:
        """Add those of some segments, all of which a search left."""
        self.is_beyond[items], self.is_rational[items] = True, counts.is_rational


def clip_all(
    segments: FloatArray, standing: Standing, counts: Counts, budget: Budget, workers: int | None
) -> ScenePieces:
    """Return all pieces of segments (n, 2, dim)."""
    parts = _parts(segments, standing, counts, budget, workers)
    return in_order(joined(parts, segments.shape[2]), len(segments), _exact_ends(segments, standing, budget))


def _exact_ends(segments: FloatArray, standing: Standing, budget: Budget) -> Exact:
    """Return what tells the exact parameters of a piece; those of the pieces asked about last are kept."""

    @lru_cache(1)
    def pieces(source: int, body: int) -> list[ExactPiece]:
        budget.check()
        p, q = segments[source].tolist()
        return exact_pieces(p, q, *standing.placed(body), budget)

    return lambda source, body, number: (pieces(source, body)[number].first, pieces(source, body)[number].last)


def clip_first(
    segments: FloatArray, standing: Standing, counts: Counts, budget: Budget, workers: int | None
) -> ScenePieces:
    """Return the first piece of each segment that meets a body, of those that begin at one point that of the first."""
    state, bodies, out = _searched(segments, standing, False, budget, workers)
    left, met = np.flatnonzero(state == OPEN), np.flatnonzero(state == MET)
    ranks = np.stack([np.zeros(len(met), np.int64), np.ones(len(met), np.int64)], axis=1)
    for place in np.flatnonzero(out.t[met, 0] == out.t[met, 1]).tolist():  # what was settled of others has a length
        ranks[place, 1] = standing.base.solids[bodies[met[place]]].type != "surface"
    sure = ScenePieces(met, bodies[met], out.ends[0, met], out.ends[1, met], out.t[met], out.faces[met], ranks)
    if not len(left):
        return sure
    more = Counts(len(left))
    some = clip_all(segments[left], standing, more, budget, workers)
    counts.take(left, more)
    first = np.flatnonzero(np.append(True, some.source[1:] != some.source[:-1])[: len(some)])
    some.ranks[:, 1] = some.ranks[:, 1] > some.ranks[:, 0]
    some.source[:] = left[some.source]
    found = [np.concatenate([getattr(sure, field.name), getattr(some, field.name)[first]]) for field in fields(sure)]
    order = np.argsort(found[0])
    return ScenePieces(*(each[order] for each in found))


def meets_any(
    segments: FloatArray, standing: Standing, counts: Counts, budget: Budget, workers: int | None
) -> BoolArray:
    """Return of each segment whether it meets a body."""
    state, _, _ = _searched(segments, standing, True, budget, workers)
    found: BoolArray = state == MET
    left = np.flatnonzero(state == OPEN)
    more = Counts(len(left))
    for part in _parts(segments[left], standing, more, budget, workers) if len(left) else ():
        found[left[part.source]] = True
    counts.take(left, more)
    return found


def _searched(
    segments: FloatArray, standing: Standing, is_any: bool, budget: Budget, workers: int | None
) -> tuple[Any, IntArray, Pieces]:
    """Return of each segment the state, and where it is MET a body and, unless `is_any`, in its row the first piece."""
    n, dimension = len(segments), segments.shape[2]
    found = np.empty(n, np.uint8), np.empty(n, np.int64), room_for(0 if is_any else n, dimension)
    where = standing.where(budget)

    def task(first: int, last: int) -> None:
        reached = np.array([first, 0, 0])
        room = room_for(0 if is_any else MOST_MET, dimension)
        scratch = scratch_for(len(where.together.low) + len(where.names))
        while reached[0] < last:  # bound: each turn reaches the end, or prepares what a body wants
            cut = standing.cut(budget)
            entry_of(find_first)(segments, last, where, cut, scratch, is_any, budget.flag, *found, room, reached)
            budget.check()
            if reached[1] < 0:
                standing.prepare(int(reached[2]), int(reached[1]), budget)

    run_chunks(task, n, budget=budget, workers=workers)
    return found


def _parts(
    segments: FloatArray, standing: Standing, counts: Counts, budget: Budget, workers: int | None
) -> list[Found]:
    """Return the pieces of segments within all bodies, in no order."""
    n, rest, parts = len(segments), list[Found](), dict[int, list[Found]]()
    if n < _CROWD:
        room = _PAIRS * n
        owners, bodies, state = np.empty(room, np.int64), np.empty(room, np.int64), np.empty(room, np.uint8)
        parts[0], n_pairs, n_open = _cut_pairs(segments, owners, bodies, -1, state, standing, budget)
    if n >= _CROWD or n_pairs < 0:
        owners, bodies = candidates(standing.where(budget), segments, budget, workers)
        are_streamed = standing.base.table(budget).are_streamed
        if n >= _CROWD:
            are_streamed = np.append(are_streamed, np.zeros(len(standing.names), np.bool_))
            is_crowded = (np.bincount(bodies, minlength=len(are_streamed)) >= _CROWD) & are_streamed
            together = np.flatnonzero(is_crowded[bodies])
            rest = _cut(segments, owners[together], bodies[together], False, standing, counts, budget, workers)
            owners, bodies = (np.delete(each, together) for each in (owners, bodies))
        n_pairs = n_open = len(owners)
        state = np.empty(n_pairs, np.uint8)

        def task(first: int, last: int) -> None:
            some = owners[first:last], bodies[first:last], last - first, state[first:last]
            parts[first] = _cut_pairs(segments, *some, standing, budget)[0]

        run_chunks(task, n_pairs, budget=budget, workers=workers)
    if n_open:
        left = np.flatnonzero(state[:n_pairs] == OPEN)
        counts.is_beyond[owners[left]] = True
        rest += _cut(segments, owners[left], bodies[left], True, standing, counts, budget, workers)
    return [part for first in sorted(parts) for part in parts[first]] + rest


def _cut_pairs(
    segments: FloatArray, owners: IntArray, bodies: IntArray, n_pairs: int, state: Any, standing: Standing,
    budget: Budget,
) -> tuple[list[Found], int, int]:  # fmt: skip
    """Return the pieces of pairs of a segment and a body, how many these are, -1 for pairs that are to be listed, and
    where they find no room, and how many of them are left; fill their state."""
    parts, n = list[Found](), np.array([0, 0, 0, n_pairs, 0])
    where = standing.where(budget)
    scratch, m = scratch_for(len(where.together.low) + len(where.names)), MOST_MET + 2 * len(owners)
    while True:  # bound: each turn has room for a pair, or prepares what a body wants
        out, names = room_for(m, segments.shape[2]), np.empty(m, np.int64)
        cut = standing.cut(budget)
        entry_of(cut_pairs)(segments, owners, bodies, where, cut, scratch, budget.flag, out, names, state, n)
        budget.check()
        reached, m_found, wanted, n_pairs, n_open = n.tolist()
        if m_found:
            budget.take(_BYTES * m_found)
            found = first_of(out, m_found)
            parts.append(Found(found.source, names[:m_found], *found[1:]))
        if wanted:
            standing.prepare(int(bodies[reached]), wanted, budget)
        elif reached >= n_pairs:
            return parts, n_pairs, n_open


def _cut(
    segments: FloatArray, owners: IntArray, bodies: IntArray, are_left: bool, standing: Standing, counts: Counts,
    budget: Budget, workers: int | None,
) -> list[Found]:  # fmt: skip
    """Return the pieces of pairs of a segment and a body that the kernels left or were not asked, body by body."""
    bodies = standing.names_of(bodies)
    order = np.argsort(bodies, kind="stable")
    owners, bodies = owners[order], bodies[order]
    starts = np.flatnonzero(np.append(True, bodies[1:] != bodies[:-1])[: len(bodies)]).tolist()
    groups = [
        (first, min(first + _MOST_IN_GROUP, last))
        for begin, last in zip(starts, [*starts[1:], len(bodies)])
        for first in range(begin, last, _MOST_IN_GROUP)
    ]
    found: dict[int, Found] = {}

    def task(first: int, last: int) -> None:
        for group in range(first, last):
            begin, end = groups[group]
            body, items = int(bodies[begin]), owners[begin:end]
            pieces, rational = _on_body(segments[items], *standing.placed(body), are_left, budget)
            counts.is_beyond[items[rational]] = counts.is_rational[items[rational]] = True
            m = len(pieces.source)
            if m:
                budget.take(_BYTES * m)
                found[group] = Found(items[pieces.source], np.full(m, body), *pieces[1:])

    run_chunks(task, len(groups), budget=budget, first_chunk=1, workers=workers)
    return [found[group] for group in sorted(found)]


def _on_body(
    segments: FloatArray, solid: Solid, pose: Pose | None, are_left: bool, budget: Budget
) -> tuple[Pieces, Any]:
    """Return the pieces of segments (n, 2, dim) within a placed solid, by source and t, and which of them took rational
    arithmetic: all where some did and it is not told which."""
    n, every, shape = len(segments), np.arange(len(segments)), cast(Any, solid)
    if pose is None and solid.type in ("half_space", "convex", "aabb", "sphere"):
        pieces, _, n_rational = clip_on_convex(segments, shape, cast(Any, method_for(shape)), budget, 1, None)
        return pieces, every[: n * bool(n_rational)]
    if pose is None and solid.type in (("polygon", "triangle") if solid.dimension == 2 else ("polyhedron",)):
        locator = locator_of(solid).chosen(n, budget)
        if not are_left or solid.dimension == 2:
            return clip_chunk(segments, 0, n, shape, locator, budget)
        locator.fill(segments[:, 0].copy(), locations := np.empty(n, np.int8), budget)
        return cut_exactly(segments, every, locations, shape, budget), every
    return settled(segments, every, solid, pose, budget), every
