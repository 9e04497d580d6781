"""Segments through a scene: what the kernels settle (through.py), and what they leave.

A body that stands where its solid does then cuts a segment as `clip_segments` does; posed ones, CSG trees and prisms in
exact arithmetic (profiles.py).
"""

from __future__ import annotations

from dataclasses import fields
from functools import lru_cache
from typing import Any, Final, cast

import numpy as np

from engine.compiling.jit import entry_of
from engine.containment.locators import locator_of
from engine.running.budget import UNLIMITED, Budget
from engine.running.parallel import run_chunks
from engine.scenes.bodies import order_of
from engine.scenes.ends import Exact, Found, ScenePieces, in_order, joined
from engine.scenes.near_boxes import MOST_MET, scratch_for
from engine.scenes.standing import Standing
from engine.scenes.through import MET, Firsts, cut_near, find_first
from engine.segment_clipping.clip_segments import plan_for
from engine.segment_clipping.decide_then_cut import FEW
from engine.segment_clipping.on_boundary.boundary import clip_chunk
from engine.segment_clipping.pieces import Pieces, first_of, room_for
from engine.segment_clipping.profiles import ExactPiece, exact_pieces, settled
from engine.solids.base import Solid
from engine.solids.checks import is_ready
from engine.solids.pose import Pose
from engine.types import OPEN, UNDECIDED, BoolArray, FlagArray, FloatArray, IntArray, read_only

_BYTES: Final = 400
"""Of a piece, in its part, joined and in order."""
_FEW: Final = 1024
"""Segments that are asked about at once, as many as `run_chunks` takes at first."""
_BODIES_KEPT: Final = 16
_LEFT: Final = 16
"""Pairs left for which there is room at once, beside one for each segment."""
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
    found = joined(parts, segments.shape[2])
    return in_order(found, len(segments), lambda: _exact_ends(segments, standing, budget), budget)


def _exact_ends(segments: FloatArray, standing: Standing, budget: Budget) -> Exact:
    """Return what tells the exact parameters of a piece; those of the bodies asked about last are kept."""

    @lru_cache(_BODIES_KEPT)
    def pieces(source: int, body: int) -> list[ExactPiece]:
        budget.check()
        p, q = segments[source].tolist()
        return exact_pieces(p, q, *standing.placed(body), budget)

    return lambda source, body, number: (pieces(source, body)[number].first, pieces(source, body)[number].last)


def answer_few(segments: Any, standing: Standing, keep: str) -> ScenePieces | BoolArray | None:
    """Return what `Scene.clip_segments` does of an array of a few segments, not yet looked at for NaN, in half the time
    that the general way takes; None where nothing is kept of the scene yet, or numbers are none that kernels take."""
    solids = standing.base.solids
    if not solids or not is_ready(segments, 2, solids[0].dimension) or not 0 < len(segments) <= _FEW:
        return None
    if standing.base.kept("words") is None or type(keep) is not str or keep not in ("all", "first", "any"):
        return None
    segments = read_only(segments)  # of the one kind that kernels are compiled for: this may be their first call
    n, is_any, order = len(segments), keep == "any", order_of(segments, 0.5, None)
    if keep == "all":
        parts, left, is_plain = _cut_near(segments, order, 0, n, standing, UNLIMITED)
        if not is_plain:
            return None
        if left:
            parts += _cut(segments, standing, Counts(n), UNLIMITED, 1, *np.concatenate(left).T)
        return in_order(joined(parts, segments.shape[2]), n, lambda: _exact_ends(segments, standing, UNLIMITED))
    words, room, reached = standing.words(UNLIMITED), scratch_for(standing.n_rows), _IN_ROWS.copy()
    state, out = np.empty(n, np.uint8), _NONE if is_any else _firsts_for(n, segments.shape[2])
    entry_of(find_first)(segments, order, n, words, room, is_any, UNLIMITED.flag, state, out, reached)
    _, wanted, _, n_met, n_open, _ = reached.tolist()
    if wanted or (n_open and not np.isfinite(segments).all()):
        return None
    found = out if is_any or n_met == n else [each[:n_met] for each in out]
    if n_open:
        return (meets_any if is_any else clip_first)(segments, standing, Counts(n), UNLIMITED, 1, (state, found))
    return state.view(np.bool_) if is_any else ScenePieces(*found)


def clip_first(
    segments: FloatArray, standing: Standing, counts: Counts, budget: Budget, workers: int | None, found: Any = None
) -> ScenePieces:
    """Return the first piece of each segment that meets a body, of those that begin at one point that of the first.

    found: what `_searched` returns, if it is known.
    """
    state, out = found or _searched(segments, standing, False, budget, workers)
    left, sure = np.flatnonzero(state == OPEN), ScenePieces(*out)
    if not len(left):
        return sure
    more = Counts(len(left))
    some = clip_all(read_only(segments[left]), standing, more, budget, workers)
    counts.take(left, more)
    first = np.flatnonzero(np.append(True, some.source[1:] != some.source[:-1])[: len(some)])
    some.ranks[:, 1] = some.ranks[:, 1] > some.ranks[:, 0]
    some.source[:] = left[some.source]
    joint = [np.concatenate([getattr(sure, field.name), getattr(some, field.name)[first]]) for field in fields(sure)]
    order = np.argsort(joint[0])
    return ScenePieces(*(each[order] for each in joint))


def meets_any(
    segments: FloatArray, standing: Standing, counts: Counts, budget: Budget, workers: int | None, found: Any = None
) -> BoolArray:
    """Return of each segment whether it meets a body; found: what `_searched` returns, if it is known."""
    state, _ = found or _searched(segments, standing, True, budget, workers)
    meets: BoolArray = state == MET
    left = np.flatnonzero(state == OPEN)
    more = Counts(len(left))
    for part in _parts(read_only(segments[left]), standing, more, budget, workers) if len(left) else ():
        meets[left[part.source]] = True
    counts.take(left, more)
    return meets


def _searched(
    segments: FloatArray, standing: Standing, is_any: bool, budget: Budget, workers: int | None
) -> tuple[FlagArray, Any]:
    """Return of each segment the state and, unless `is_any`, the first pieces of those that are MET."""
    n, words, order = len(segments), standing.words(budget), order_of(segments, 0.0, standing.where(budget))
    state, out = np.empty(n, np.uint8), _NONE if is_any else _firsts_for(n, segments.shape[2])

    def task(first: int, last: int) -> None:
        reached, room = np.array([first, 0, 0, 0, 0, 0]), scratch_for(standing.n_rows)
        while True:  # bound: each turn reaches the end, or prepares what a body wants
            entry_of(find_first)(segments, order, last, words, room, is_any, budget.flag, state, out, reached)
            budget.check()
            _, wanted, body, *_ = reached.tolist()
            if wanted == 0:
                break
            standing.prepare(body, wanted, budget)

    run_chunks(task, n, budget=budget, workers=workers)
    met = np.flatnonzero(state == MET)
    return state, out if is_any or len(met) == n else [each.take(met, axis=0) for each in out]


def _firsts_for(n: int, dimension: int) -> Firsts:
    """Return room for the first piece of n segments."""
    ends, pairs = (n, dimension), (n, 2)
    owners, points = (np.empty(n, np.int64), np.empty(n, np.int64)), (np.empty(ends), np.empty(ends))
    return Firsts(*owners, *points, np.empty(pairs), np.empty(pairs, np.int64), np.empty(pairs, np.int64))


_NONE: Final = _firsts_for(0, 3)
_IN_ROWS: Final = read_only(np.array([0, 0, 0, 0, 0, 1]))
"""What `find_first` counts in, where few are asked about."""


def _parts(
    segments: FloatArray, standing: Standing, counts: Counts, budget: Budget, workers: int | None
) -> list[Found]:
    """Return the pieces of segments within all bodies, in no order."""
    n, parts, left = len(segments), dict[int, list[Found]](), dict[int, list[IntArray]]()
    order = order_of(segments, 0.5, standing.where(budget))

    def task(first: int, last: int) -> None:
        parts[first], left[first], _ = _cut_near(segments, order, first, last, standing, budget)

    run_chunks(task, n, budget=budget, workers=workers)
    found = [part for first in sorted(parts) for part in parts[first]]
    pairs = [part for first in sorted(left) for part in left[first]]
    if pairs:
        owners, bodies = np.concatenate(pairs).T
        counts.is_beyond[owners] = True
        found += _cut(segments, standing, counts, budget, workers, owners, bodies)
    return found


def _cut_near(
    segments: FloatArray, order: IntArray, first: int, last: int, standing: Standing, budget: Budget
) -> tuple[list[Found], list[IntArray], bool]:
    """Return the pieces of some segments within the bodies near them, which of these pairs are left (k, 2), and whether
    no segment is of numbers that kernels leave, NaN above all."""
    parts, left, n = list[Found](), list[IntArray](), np.array([first, 0, 0, 0, 0, 0, 0])
    words, n_rows = standing.words(budget), 4 * (last - first) + MOST_MET
    scratch = scratch_for(standing.n_rows)
    while n[0] < last:  # bound: each turn has room for a body, or prepares what one wants
        out, names = room_for(n_rows, segments.shape[2]), np.empty((2, n_rows), np.int64)
        pairs = np.empty((_LEFT + last - first, 2), np.int64)
        entry_of(cut_near)(segments, order, last, words, scratch, budget.flag, out, names, pairs, n)
        budget.check()
        _, _, m, m_left, wanted, body, _ = n.tolist()
        if m:
            budget.take(_BYTES * m)
            found = first_of(out, m)
            parts.append(Found(found.source, names[0, :m], names[1, :m], *found[1:]))
        if m_left:
            left.append(pairs[:m_left])
        if wanted:
            standing.prepare(body, wanted, budget)
    return parts, left, not n[6]


def _cut(
    segments: FloatArray, standing: Standing, counts: Counts, budget: Budget, workers: int | None, owners: IntArray,
    bodies: IntArray,
) -> list[Found]:  # fmt: skip
    """Return the pieces of pairs of a segment and a body that the kernels left, body by body."""
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
            pieces, rational, is_told = _on_body(read_only(segments[items]), *standing.placed(body), budget)
            counts.is_beyond[items[rational]] = counts.is_rational[items[rational]] = True
            m = len(pieces.source)
            if m:
                budget.take(_BYTES * m)
                are_long = np.full(m, UNDECIDED)
                if is_told:  # pieces that kernels made have ends that round alike only if they are one
                    are_sure = ~np.isin(pieces.source, rational) if len(rational) else True
                    are_long = np.where(are_sure, pieces.t[:, 0] != pieces.t[:, 1], UNDECIDED)
                found[group] = Found(items[pieces.source], np.full(m, body), are_long, *pieces[1:])

    run_chunks(task, len(groups), budget=budget, first_chunk=1, workers=workers)
    return [found[group] for group in sorted(found)]


def _on_body(segments: FloatArray, solid: Solid, pose: Pose | None, budget: Budget) -> tuple[Pieces, Any, bool]:
    """Return the pieces of segments (n, 2, dim) within a placed solid, by source and t, and which of them took rational
    arithmetic, all where some did and it is not told which; and whether the others are of boundary_cut.py."""
    n, every, shape = len(segments), np.arange(len(segments)), cast(Any, solid)
    if pose is None and solid.type in ("half_space", "convex", "aabb", "sphere"):
        plan = plan_for(shape)
        pieces, _, n_rational = plan.cut(segments, shape, plan, budget, 1, None)
        return pieces, every[: n * bool(n_rational)], False
    if pose is None and solid.type in (("polygon", "triangle") if solid.dimension == 2 else ("polyhedron",)):
        locator = None if n <= FEW else locator_of(solid).chosen(n, budget)
        return *clip_chunk(segments, 0, n, shape, locator, budget), True
    return settled(segments, every, solid, pose, budget), every, False
