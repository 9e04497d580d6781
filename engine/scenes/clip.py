"""Segments through a scene: the kernels (segment_kernels.py), then the exact fallback for what they leave open.

A mesh then cuts a segment at its contacts (posed_contacts.py). Another unposed body, and one whose posed vertices are
doubles, clips it as `clip_segments`; other posed ones, CSG trees and prisms in exact arithmetic (profiles.py).
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
from engine.scenes.ends import Exact, LoosePieces, ScenePieces, merge_parts, sort_pieces
from engine.scenes.near_boxes import MOST_MET, scratch_for
from engine.scenes.placements import Placements
from engine.scenes.posed_contacts import cut_posed
from engine.scenes.segment_kernels import MET, Firsts, cut_near, find_first
from engine.segment_clipping.clip_segments import plan_for
from engine.segment_clipping.decide_then_cut import FEW
from engine.segment_clipping.on_boundary.boundary import clip_chunk
from engine.segment_clipping.pieces import Pieces, allocate_pieces, first_of
from engine.segment_clipping.profiles import ExactPiece, clip_exactly, exact_pieces
from engine.solids.base import Solid
from engine.solids.checks import is_ready
from engine.solids.pose import Pose
from engine.solids.ragged import parts_of_runs, run_offsets
from engine.solids.registry import row_of
from engine.types import OPEN, UNDECIDED, BoolArray, FlagArray, FloatArray, IntArray, read_only

_BYTES: Final = 400
"""Memory counted for a piece: in its part, concatenated and sorted."""
_FEW: Final = 1024
"""Most segments of a small batch, and the size of the first chunk of `run_chunks`."""
_CACHED_PIECES: Final = 16
_LEFT: Final = 16
"""Initial room for pairs that kernels leave open, besides one for each segment."""
_MOST_IN_GROUP: Final = 1 << 13
"""Most segments clipped to one body in one task."""


class Counts:
    """By segment, whether the kernels left it open, and whether rational arithmetic decided it."""

    def __init__(self, n: int) -> None:
        self.is_beyond, self.is_rational = np.zeros(n, np.bool_), np.zeros(n, np.bool_)

    def take(self, items: IntArray, counts: Counts) -> None:
        """Add the counts of a subset: segments ``items``, all of which a search left open."""
        self.is_beyond[items], self.is_rational[items] = True, counts.is_rational


def clip_all(
    segments: FloatArray, scene: Placements, counts: Counts, budget: Budget, workers: int | None
) -> ScenePieces:
    """Return all pieces of segments (n, 2, dim) within the bodies of a scene, sorted. counts: filled."""
    parts = _parts(segments, scene, counts, budget, workers)
    return sorted_exactly(merge_parts(parts, segments.shape[2], budget, workers), segments, scene, budget, workers)


def loose_pieces(segments: FloatArray, scene: Placements, budget: Budget, workers: int | None) -> LoosePieces:
    """Return all pieces of segments (n, 2, dim) within the bodies of a scene, in no order but along each segment in one
    body."""
    parts = _parts(segments, scene, Counts(len(segments)), budget, workers)
    return merge_parts(parts, segments.shape[2], budget, workers)


def sorted_exactly(
    pieces: LoosePieces, segments: FloatArray, scene: Placements, budget: Budget, workers: int | None
) -> ScenePieces:
    """Return pieces of `loose_pieces` sorted, with exact ranks."""
    words = scene.words(budget)
    return sort_pieces(pieces, segments, words, lambda: _exact_ends(segments, scene, budget), budget, workers)


def _exact_ends(segments: FloatArray, scene: Placements, budget: Budget) -> Exact:
    """Return a function (source, body, number) that gives the exact parameters of both ends of that piece of a segment
    in a body; it caches the pieces computed last."""

    @lru_cache(_CACHED_PIECES)
    def pieces(source: int, body: int) -> list[ExactPiece]:
        budget.check()
        p, q = segments[source].tolist()
        return exact_pieces(p, q, *scene.placed_exactly(body, 0, budget), budget)

    return lambda source, body, number: (pieces(source, body)[number].first, pieces(source, body)[number].last)


def clip_small_batch(segments: Any, scene: Placements, keep: str) -> ScenePieces | BoolArray | None:
    """Clip a small batch of segments without the overhead of the general path; return None if the general path must be
    used. That is: a structure of the scene is still to be built, numbers are out of the kernels' range (NaN is), or
    `keep` is invalid."""
    solids = scene.base.solids
    if not solids or not is_ready(segments, 2, solids[0].dimension) or not 0 < len(segments) <= _FEW:
        return None
    if scene.base.cached("words") is None or type(keep) is not str or keep not in ("all", "first", "any"):
        return None
    segments = read_only(segments)  # of the one kind that kernels are compiled for: this may be their first call
    n, is_any, order = len(segments), keep == "any", order_of(segments, 0.5, None, UNLIMITED, 1)
    if keep == "all":
        parts, left, is_plain = _cut_near(segments, order, 0, n, scene, UNLIMITED)
        if not is_plain:
            return None
        if left:
            parts += _cut(segments, scene, Counts(n), UNLIMITED, 1, *np.concatenate(left).T)
        pieces, words = merge_parts(parts, segments.shape[2]), scene.words(UNLIMITED)
        return sort_pieces(pieces, segments, words, lambda: _exact_ends(segments, scene, UNLIMITED))
    words, room, reached = scene.words(UNLIMITED), scratch_for(scene.n_rows), _IN_ROWS.copy()
    state, out = np.empty(n, np.uint8), _NONE if is_any else firsts_for(n, segments.shape[2])
    entry_of(find_first)(segments, order, n, words, room, is_any, UNLIMITED.flag, state, out, reached)
    _, wanted, _, n_met, n_open, _ = reached.tolist()
    if wanted or (n_open and not np.isfinite(segments).all()):
        return None
    hits = out if is_any or n_met == n else [each[:n_met] for each in out]
    if n_open:
        return (meets_any if is_any else clip_first)(segments, scene, Counts(n), UNLIMITED, 1, (state, hits))
    return state.view(np.bool_) if is_any else ScenePieces(*hits)


def clip_first(
    segments: FloatArray, scene: Placements, counts: Counts, budget: Budget, workers: int | None, searched: Any = None
) -> ScenePieces:
    """Return the first piece of each segment that meets a body; of pieces that begin in one point, that of the lowest
    body. counts: filled; searched: the result of `_first_hits`, if computed already."""
    state, out = searched or _first_hits(segments, scene, False, budget, workers)
    left, sure = np.flatnonzero(state == OPEN), ScenePieces(*out)
    if not len(left):
        return sure
    more = Counts(len(left))
    some = clip_all(read_only(segments[left]), scene, more, budget, workers)
    counts.take(left, more)
    first = run_offsets(some.source)[:-1]
    some.ranks[:, 1] = some.ranks[:, 1] > some.ranks[:, 0]
    some.source[:] = left[some.source]
    joint = [np.concatenate([getattr(sure, field.name), getattr(some, field.name)[first]]) for field in fields(sure)]
    order = np.argsort(joint[0])
    return ScenePieces(*(each[order] for each in joint))


def meets_any(
    segments: FloatArray, scene: Placements, counts: Counts, budget: Budget, workers: int | None, searched: Any = None
) -> BoolArray:
    """Return for each segment whether it meets a body. counts: filled; searched: the result of `_first_hits`, if
    computed already."""
    state, _ = searched or _first_hits(segments, scene, True, budget, workers)
    meets: BoolArray = state == MET
    left = np.flatnonzero(state == OPEN)
    more = Counts(len(left))
    for part in _parts(read_only(segments[left]), scene, more, budget, workers) if len(left) else ():
        meets[left[part.source]] = True
    counts.take(left, more)
    return meets


def _first_hits(
    segments: FloatArray, scene: Placements, is_any: bool, budget: Budget, workers: int | None
) -> tuple[FlagArray, Any]:
    """Return, by segment, its state (MET, OPEN, SETTLED: meets none), and the first pieces of those that are MET, not
    computed if `is_any`."""
    n, words, order = len(segments), scene.words(budget), order_of(segments, 0.0, scene.where(budget), budget, workers)
    state, out = np.empty(n, np.uint8), _NONE if is_any else firsts_for(n, segments.shape[2])

    def task(first: int, last: int) -> None:
        reached, room = np.array([first, 0, 0, 0, 0, 0]), scratch_for(scene.n_rows)
        while True:  # bound: each turn reaches the end, or prepares a body
            entry_of(find_first)(segments, order, last, words, room, is_any, budget.flag, state, out, reached)
            budget.check()
            _, wanted, body, *_ = reached.tolist()
            if wanted == 0:
                break
            scene.prepare(body, wanted, budget)

    run_chunks(task, n, budget=budget, workers=workers)
    met = np.flatnonzero(state == MET)
    return state, out if is_any or len(met) == n else [each.take(met, axis=0) for each in out]


def firsts_for(n: int, dimension: int) -> Firsts:
    """Allocate room for the first piece of n segments."""
    ends, pairs = (n, dimension), (n, 2)
    owners, points = (np.empty(n, np.int64), np.empty(n, np.int64)), (np.empty(ends), np.empty(ends))
    return Firsts(*owners, *points, np.empty(pairs), np.empty(pairs, np.int64), np.empty(pairs, np.int64))


_NONE: Final = firsts_for(0, 3)
_IN_ROWS: Final = read_only(np.array([0, 0, 0, 0, 0, 1]))
"""Initial counters of `find_first` for a small batch."""


def _parts(
    segments: FloatArray, scene: Placements, counts: Counts, budget: Budget, workers: int | None
) -> list[LoosePieces]:
    """Return the pieces of segments within all bodies, unsorted."""
    n, parts, left = len(segments), dict[int, list[LoosePieces]](), dict[int, list[IntArray]]()
    order = order_of(segments, 0.5, scene.where(budget), budget, workers)

    def task(first: int, last: int) -> None:
        parts[first], left[first], _ = _cut_near(segments, order, first, last, scene, budget)

    run_chunks(task, n, budget=budget, workers=workers)
    pieces = [part for first in sorted(parts) for part in parts[first]]
    pairs = [part for first in sorted(left) for part in left[first]]
    if pairs:
        owners, bodies = np.concatenate(pairs).T
        counts.is_beyond[owners] = True
        pieces += _cut(segments, scene, counts, budget, workers, owners, bodies)
    return pieces


def _cut_near(
    segments: FloatArray, order: IntArray, first: int, last: int, scene: Placements, budget: Budget
) -> tuple[list[LoosePieces], list[IntArray], bool]:
    """Return the pieces of segments order[first:last], arrays of the pairs (segment, body) that kernels leave open, and
    whether all numbers are in the kernels' range (NaN is not)."""
    parts, left, n = list[LoosePieces](), list[IntArray](), np.array([first, 0, 0, 0, 0, 0, 0])
    words, n_rows = scene.words(budget), 4 * (last - first) + MOST_MET
    scratch = scratch_for(scene.n_rows)
    while n[0] < last:  # bound: each turn has room for a body
        out, names = allocate_pieces(n_rows, segments.shape[2]), np.empty((2, n_rows), np.int64)
        pairs, wanted = np.empty((_LEFT + last - first, 2), np.int64), -1
        n[2] = n[3] = 0
        while wanted:  # bound: each turn prepares a body
            entry_of(cut_near)(segments, order, last, words, scratch, budget.flag, out, names, pairs, n)
            budget.check()
            _, _, m, m_left, wanted, body, _ = n.tolist()
            if wanted:
                scene.prepare(body, wanted, budget)
        if m:
            budget.take(_BYTES * m)
            pieces = first_of(out, m)
            parts.append(LoosePieces(pieces.source, names[0, :m], names[1, :m], *pieces[1:]))
        if m_left:
            left.append(pairs[:m_left])
    return parts, left, not n[6]


def _cut(
    segments: FloatArray, scene: Placements, counts: Counts, budget: Budget, workers: int | None, owners: IntArray,
    bodies: IntArray,
) -> list[LoosePieces]:  # fmt: skip
    """Return the pieces of open pairs, segment owners[i] and body bodies[i], body by body in exact arithmetic."""
    bodies = scene.names_of(bodies)
    order = np.argsort(bodies, kind="stable")
    owners, bodies = owners[order], bodies[order]
    groups = parts_of_runs(bodies, _MOST_IN_GROUP)
    parts: dict[int, LoosePieces] = {}

    def task(first: int, last: int) -> None:
        for group in range(first, last):
            begin, end = groups[group]
            body, items = int(bodies[begin]), owners[begin:end]
            placed = scene.placed_exactly(body, end - begin, budget)
            pieces, rational, are_long = _on_body(read_only(segments[items]), *placed, budget)
            counts.is_beyond[items[rational]] = counts.is_rational[items[rational]] = True
            m = len(pieces.source)
            if m:
                budget.take(_BYTES * m)
                parts[group] = LoosePieces(items[pieces.source], np.full(m, body), are_long, *pieces[1:])

    run_chunks(task, len(groups), budget=budget, first_chunk=1, workers=workers)
    return [parts[group] for group in sorted(parts)]


def _on_body(segments: FloatArray, solid: Solid, pose: Pose | None, budget: Budget) -> tuple[Pieces, Any, IntArray]:
    """Return the pieces of segments (n, 2, dim) within one placed solid, sorted by source and t; the indices of the
    segments that took rational arithmetic, all if it is unknown which; and of pieces whether they are longer than a
    point (`LoosePieces`)."""
    n, every, shape = len(segments), np.arange(len(segments)), cast(Any, solid)
    if row_of(solid).hits is not None:
        return cut_posed(segments, shape, pose, budget)
    if pose is None and solid.type in ("half_space", "convex", "aabb", "sphere"):
        plan = plan_for(shape)
        pieces, _, n_rational = plan.cut(segments, shape, plan, budget, 1, None)
        return pieces, every[: n * bool(n_rational)], np.full(len(pieces.source), UNDECIDED)
    if pose is None and solid.dimension == 2 and solid.type in ("polygon", "triangle"):
        locator = None if n <= FEW else locator_of(solid).chosen(n, budget)
        pieces, rational = clip_chunk(segments, 0, n, shape, locator, budget)
        # contacts that round alike are one in kernels; an end of a segment may be none
        are_exact = ~np.isin(pieces.source, rational) if len(rational) else True
        differ, own = pieces.t[:, 0] != pieces.t[:, 1], pieces.faces < 0
        return pieces, rational, np.where(are_exact & (differ | (own[:, 0] == own[:, 1])), differ, UNDECIDED)
    pieces = clip_exactly(segments, every, solid, pose, budget)
    return pieces, every, np.full(len(pieces.source), UNDECIDED)
