"""Segments through a scene: what the kernels settle (through.py), and what they leave.

A body that stands where its solid does then cuts a segment as `clip_segments` does; posed ones, CSG trees and prisms in
exact arithmetic (profiles.py).
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any, Final

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.containment.locators import locator_of
from engine.direct import entry_of
from engine.parallel import Budget, run_chunks
from engine.scenes.bodies import Bodies
from engine.scenes.broad_phase import candidates
from engine.scenes.ends import Exact, Found, ScenePieces, in_order, joined
from engine.scenes.posed_mesh import MOST_MET, scratch_for
from engine.scenes.standing import Layer, Standing
from engine.scenes.through import MET, cut_pairs, find_first
from engine.segment_clipping.boundary import clip_chunk, cut_exactly
from engine.segment_clipping.boundary_cut import SETTLED
from engine.segment_clipping.clip_segments import method_for
from engine.segment_clipping.decide_then_cut import clip_on_convex
from engine.segment_clipping.parameters import Parameter
from engine.segment_clipping.pieces import Pieces, first_of, room_for
from engine.segment_clipping.profiles import ExactPiece, exact_pieces, settled
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.convex import Convex
from engine.solids.half_space import HalfSpace
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.solids.surface import Surface
from engine.solids.triangle import Triangle
from engine.types import OPEN

_BYTES: Final = 400
"""Of a piece, in its part, joined and in order."""
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
    parts = [
        part
        for layer in standing.layers_near(segments, budget)
        for part in _of_layer(segments, layer, counts, budget, workers)
    ]
    return in_order(joined(parts, segments.shape[2]), _exact_ends(segments, standing, budget))


def _exact_ends(segments: FloatArray, standing: Standing, budget: Budget) -> Exact:
    """Return what tells the exact parameters of a piece; those of the pieces asked about last are kept."""
    asked, known = (-1, -1), list[ExactPiece]()

    def exact(source: int, body: int, number: int) -> tuple[Parameter, Parameter]:
        nonlocal asked, known
        budget.check()
        if asked != (source, body):
            p, q = segments[source].tolist()
            known = exact_pieces(p, q, *standing.placed(body), budget)
            asked = (source, body)
        return known[number].first, known[number].last

    return exact


def clip_first(
    segments: FloatArray, standing: Standing, counts: Counts, budget: Budget, workers: int | None
) -> ScenePieces:
    """Return the first piece of each segment that meets a body, of those that begin at one point that of the first."""
    state, bodies, out = _searched(segments, standing, False, budget, workers)
    left, met = np.flatnonzero(state == OPEN), np.flatnonzero(state == MET)
    ranks = np.stack([np.zeros(len(met), np.int64), np.ones(len(met), np.int64)], axis=1)
    for place in np.flatnonzero(out.t[met, 0] == out.t[met, 1]).tolist():  # what was settled of others has a length
        ranks[place, 1] = not isinstance(standing.base.solids[bodies[met[place]]], Surface)
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
    for layer in standing.layers_near(segments[left], budget) if len(left) else ():
        for part in _of_layer(segments[left], layer, more, budget, workers):
            found[left[part.source]] = True
    counts.take(left, more)
    return found


def _searched(
    segments: FloatArray, standing: Standing, is_any: bool, budget: Budget, workers: int | None
) -> tuple[Any, IntArray, Pieces]:
    """Return of each segment the state, and where it is MET a body and, unless `is_any`, in its row the first piece."""
    n, dimension = len(segments), segments.shape[2]
    best: Any = None
    for layer in standing.layers_near(segments, budget):
        found = np.empty(n, np.uint8), np.empty(n, np.int64), room_for(0 if is_any else n, dimension)

        def task(first: int, last: int, layer: Layer = layer, found: Any = found) -> None:
            _search(segments, layer, is_any, first, last, found, budget)

        run_chunks(task, n, budget=budget, workers=workers)
        if layer.names is not None:
            found = found[0], layer.names[found[1]], found[2]
        best = found if best is None else _better(best, found, is_any)
    return best


def _search(
    segments: FloatArray, layer: Layer, is_any: bool, first: int, last: int, found: Any, budget: Budget
) -> None:
    """Fill rows first .. last - 1 of what `_searched` finds in one layer."""
    tree, table = layer.bodies.tree(budget), layer.bodies.table(budget)
    n, room = np.array([first, 0, 0]), room_for(0 if is_any else MOST_MET, segments.shape[2])
    scratch = scratch_for(len(tree.boxes))
    while n[0] < last:  # bound: each turn reaches the end, or prepares what a body wants
        entry_of(find_first)(
            segments,
            last,
            tree,
            layer.is_away,
            table.of_kernels,
            scratch,
            is_any,
            budget.flag,
            *found,
            room,
            n,
        )
        budget.check()
        if n[1] < 0:
            layer.bodies.prepare(int(n[2]), int(n[1]), budget)


def _better(one: Any, other: Any, is_any: bool) -> Any:
    """Return what is found first in one of two layers: of ends that round alike only the segment's own are known to be
    equal."""
    (state, bodies, out), (more, names, room) = one, other
    is_open = (state == OPEN) | (more == OPEN)
    are_met = (state == MET) & (more == MET)
    if is_any:
        return np.where((state == MET) | (more == MET), MET, np.where(is_open, OPEN, SETTLED)), bodies, out
    t, u = out.t[:, 0], room.t[:, 0]
    are_own = (out.faces[:, 0] < 0) & (room.faces[:, 0] < 0)
    is_open |= are_met & (t == u) & ~are_own
    takes = (more == MET) & ((state != MET) | (u < t) | ((u == t) & (names < bodies)))
    for mine, theirs in ((bodies, names), (out.t, room.t), (out.faces, room.faces)):
        mine[takes] = theirs[takes]
    out.ends[:, takes] = room.ends[:, takes]
    return np.where(is_open, OPEN, np.maximum(state, more)), bodies, out


def _of_layer(segments: FloatArray, layer: Layer, counts: Counts, budget: Budget, workers: int | None) -> list[Found]:
    """Return the pieces within the bodies of one layer."""
    owners, bodies = candidates(layer.bodies.tree(budget), segments, budget, workers)
    if len(layer.is_away):
        stays = ~layer.is_away[bodies]
        owners, bodies = owners[stays], bodies[stays]
    table, rest = layer.bodies.table(budget), list[Found]()
    if len(segments) >= _CROWD:
        is_crowded = (np.bincount(bodies, minlength=len(table.are_streamed)) >= _CROWD) & table.are_streamed
        together = np.flatnonzero(is_crowded[bodies])
        rest = _cut(segments, owners[together], bodies[together], False, layer.bodies, counts, budget, workers)
        owners, bodies = (np.delete(each, together) for each in (owners, bodies))
    state, parts = np.empty(len(owners), np.uint8), dict[int, list[Found]]()

    def named(places: IntArray) -> IntArray:
        return places if layer.names is None else layer.names[places]

    def task(first: int, last: int) -> None:
        parts[first], n, scratch = [], np.zeros(3, np.int64), scratch_for(0)
        mine, theirs = owners[first:last], bodies[first:last]
        while n[0] < last - first:  # bound: each turn has room for a pair, or prepares what a body wants
            out = room_for(MOST_MET + 2 * (last - first - int(n[0])), segments.shape[2])
            of_some = state[first:last]
            entry_of(cut_pairs)(segments, mine, theirs, table.of_kernels, scratch, budget.flag, out, of_some, n)
            budget.check()
            if n[2] < 0:
                layer.bodies.prepare(int(theirs[n[0]]), int(n[2]), budget)
            budget.take(_BYTES * int(n[1]))
            found = first_of(out, int(n[1]))
            pairs = found.source
            parts[first].append(Found(mine[pairs], named(theirs[pairs]), *found[1:]))

    run_chunks(task, len(owners), budget=budget, workers=workers)
    left = np.flatnonzero(state == OPEN)
    if len(left):
        counts.is_beyond[owners[left]] = True
        rest += _cut(segments, owners[left], bodies[left], True, layer.bodies, counts, budget, workers)
    done = [part for first in sorted(parts) for part in parts[first] if len(part.source)]
    return done + [part._replace(body=named(part.body)) for part in rest]


def _cut(
    segments: FloatArray,
    owners: IntArray,
    bodies: IntArray,
    are_left: bool,
    placed: Bodies,
    counts: Counts,
    budget: Budget,
    workers: int | None,
) -> list[Found]:
    """Return the pieces of pairs of a segment and a body that the kernels left or were not asked, body by body."""
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
            pieces, rational = _on_body(segments[items], *placed.placed(body), are_left, budget)
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
    n = len(segments)
    every = np.arange(n)
    if pose is None:
        match solid:
            case HalfSpace() | Convex() | Aabb() | Sphere():
                method = method_for(solid)
                pieces, _, n_rational = clip_on_convex(segments, solid, method, budget, 1, None)  # type: ignore[arg-type]
                return pieces, every[: n * bool(n_rational)]
            case Polygon() | Polyhedron() | Triangle() if solid.dimension == 2 or solid.type == "polyhedron":
                locator = locator_of(solid).chosen(n, budget)
                if not are_left or solid.dimension == 2:
                    return clip_chunk(segments, 0, n, solid, locator, budget)
                locator.fill(segments[:, 0].copy(), locations := np.empty(n, np.int8), budget)
                return cut_exactly(segments, every, locations, solid, budget), every
    return settled(segments, every, solid, pose, budget), every
