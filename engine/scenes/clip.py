"""Segments through a scene: the bodies that each may meet by their boxes, then one body after another, and the order.

Bodies that stand where their solid does are cut by the methods of `clip_segments`; posed ones in their own frame
(posed_cut.py). What these leave, and all of CSG trees and prisms, is settled in exact arithmetic (profiles.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Final, NamedTuple

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.containment.locators import locator_of
from engine.errors import UnsupportedSolidError
from engine.parallel import Budget, run_chunks
from engine.scenes.ends import Found, ScenePieces, in_order, joined, taken
from engine.scenes.parameters import Parameter
from engine.scenes.posed import PosedBody, completed, cut_posed
from engine.scenes.profiles import exact_pieces, unsupported
from engine.segment_clipping.boundary import clip_chunk, cut_at_crossings
from engine.segment_clipping.clip_segments import method_for
from engine.segment_clipping.decide_then_cut import clip_on_convex
from engine.segment_clipping.pieces import Pieces
from engine.segment_clipping.prepared_boundary import boundary_of
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.convex import Convex
from engine.solids.csg import Csg
from engine.solids.half_space import HalfSpace
from engine.solids.implicit import Implicit
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.solids.surface import Surface
from engine.solids.triangle import Triangle

_BYTES: Final = 400
"""Of a piece, in its part, joined and in order."""
_MOST_IN_GROUP: Final = 1 << 13
"""Segments that are cut on one body in one piece of work."""
_NEAR: Final = 1.0 - 2.0**-50
"""Parameters at which boxes are entered are quotients of differences: three roundings."""


class Placed(NamedTuple):
    """A body: its solid, its pose unless that leaves it where it is, and what kernels for posed bodies want of it."""

    solid: Solid
    pose: Pose | None
    posed: Callable[[], PosedBody | None]


class Question(NamedTuple):
    """Segments and the bodies that each may meet: pairs, by segment."""

    segments: FloatArray
    owners: IntArray
    bodies: IntArray
    placed: Callable[[int], Placed]
    """Tells what a body is."""


def check_cut(solids: Sequence[Solid]) -> bool:
    """Return True; raise UnsupportedSolidError for the first solid that no segment is cut on."""
    for body, solid in enumerate(solids):
        waiting = [solid]
        while waiting:  # bound: a tree has so many leaves at most
            node = waiting.pop()
            if isinstance(node, Implicit):
                error: UnsupportedSolidError = unsupported(node)
                raise UnsupportedSolidError(f"solids[{body}]: {error.message}", ("solids", body))
            if isinstance(node, Csg):
                waiting += node.operands
    return True


def clip_all(question: Question, budget: Budget, workers: int | None) -> ScenePieces:
    """Return all pieces."""
    parts = _cut(question, np.arange(len(question.owners)), budget, workers)
    return in_order(joined(parts, question.segments.shape[2]), _exact_ends(question, budget))


def _exact_ends(question: Question, budget: Budget) -> Callable[[int, int, int], tuple[Parameter, Parameter]]:
    def exact(source: int, body: int, number: int) -> tuple[Parameter, Parameter]:
        budget.check()
        p, q = question.segments[source].tolist()
        placed = question.placed(body)
        piece = exact_pieces(p, q, placed.solid, placed.pose, budget)[number]
        return piece.first, piece.last

    return exact


def _cut(question: Question, pairs: IntArray, budget: Budget, workers: int | None) -> list[Found]:
    """Return the pieces of some of the pairs, body by body."""
    bodies = question.bodies[pairs]
    order = np.argsort(bodies, kind="stable")
    pairs, bodies = pairs[order], bodies[order]
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
            body, items = int(bodies[begin]), question.owners[pairs[begin:end]]
            pieces = _on_body(question.segments[items], question.placed(body), budget)
            m = len(pieces.source)
            if m:
                budget.take(_BYTES * m)
                found[group] = Found(items[pieces.source], np.full(m, body), pieces.ends, pieces.t, pieces.faces)

    run_chunks(task, len(groups), budget=budget, first_chunk=1, workers=workers)
    return [found[group] for group in sorted(found)]


def _on_body(segments: FloatArray, body: Placed, budget: Budget) -> Pieces:
    """Return the pieces of segments (n, 2, dim) within a placed solid, by source and t."""
    solid, pose, n = body.solid, body.pose, len(segments)

    def settle(items: IntArray) -> Pieces:
        return _exactly(segments, items, solid, pose, budget)

    if pose is not None:
        posed = body.posed()
        if posed is None:
            return settle(np.arange(n))
        radius = solid.radius if isinstance(solid, Sphere) else 0.0
        return completed(*cut_posed(segments, posed, radius, budget), isinstance(solid, Surface), settle)
    match solid:
        case HalfSpace() | Convex() | Aabb() | Sphere():
            method = method_for(solid)
            return clip_on_convex(segments, method, budget, 1, None)[0]  # type: ignore[arg-type]
        case Surface():
            outside = np.full(n, -1, np.int8)
            return completed(*cut_at_crossings(segments, outside, boundary_of(solid), budget), True, settle)
        case Polygon() | Polyhedron() | Triangle() if solid.dimension == 2 or solid.type == "polyhedron":
            return clip_chunk(segments, 0, n, solid, locator_of(solid).chosen(n, budget), budget)[0]
    return settle(np.arange(n))


def _exactly(segments: FloatArray, items: IntArray, solid: Solid, pose: Pose | None, budget: Budget) -> Pieces:
    """Return the pieces of some segments by exact arithmetic."""
    sources, pieces = [], []
    for item in items.tolist():
        budget.check()
        p, q = segments[item].tolist()
        found = [piece.rounded(p, q) for piece in exact_pieces(p, q, solid, pose, budget)]
        budget.take(_BYTES * len(found))
        pieces += found
        sources += [item] * len(found)
    ends = np.array([(piece.start, piece.end) for piece in pieces], np.float64).reshape(-1, 2, segments.shape[2])
    return Pieces(
        np.array(sources, np.int64),
        np.ascontiguousarray(ends.swapaxes(0, 1)) + 0.0,
        np.array([piece.t for piece in pieces], np.float64).reshape(-1, 2),
        np.array([piece.faces for piece in pieces], np.int64).reshape(-1, 2),
    )


def clip_first(
    question: Question, boxes: FloatArray, budget: Budget, workers: int | None, is_any: bool
) -> ScenePieces | BoolArray:
    """Return the first piece of each segment that meets a body, of those that begin at one point that of the first
    body; where `is_any`, whether it meets one.

    boxes: of the body of each pair. Bodies are asked in the order in which their boxes are entered, one, two, four, ...
    of them at a time, until what is left begins behind the first end found.
    """
    segments, owners = question.segments, question.owners
    if is_any:  # each is as likely to be met as the others
        entered, order = np.zeros(len(owners)), np.arange(len(owners))
    else:
        entered = _entered(segments[owners], boxes)
        order = np.lexsort((entered, owners))
    n, width, parts = len(segments), 1, []
    begins = np.searchsorted(owners, np.arange(n + 1))
    best, reached = np.full(n, np.inf), begins[:-1].copy()
    is_open = reached < begins[1:]
    while is_open.any():  # bound: each turn passes a pair of every open segment, more each time
        left = np.flatnonzero(is_open)
        sizes = np.minimum(width, begins[left + 1] - reached[left])
        places = np.repeat(reached[left] - (np.cumsum(sizes) - sizes), sizes) + np.arange(int(sizes.sum()))
        pairs = order[places]
        some = _cut(question, pairs[entered[pairs] <= best[owners[pairs]]], budget, workers)
        for part in some:
            np.minimum.at(best, part.source, part.t[:, 0])
        parts += some
        reached[left] += sizes
        is_open = reached < begins[1:]
        following = order[np.minimum(reached, len(order) - 1)]
        is_open &= ~np.isfinite(best) if is_any else entered[following] <= best
        width *= 2
    if is_any:
        return np.isfinite(best)
    found = joined(parts, segments.shape[2])
    is_first = np.append(True, (found.source[1:] != found.source[:-1]) | (found.body[1:] != found.body[:-1]))
    pieces = in_order(taken(found, np.flatnonzero(is_first[: len(found.source)])), _exact_ends(question, budget))
    rows = np.flatnonzero(np.append(True, pieces.source[1:] != pieces.source[:-1])[: len(pieces)])
    return ScenePieces(*(getattr(pieces, field.name)[rows] for field in fields(pieces)))


def _entered(segments: FloatArray, boxes: FloatArray) -> FloatArray:
    """Return for pairs of a segment and a box a parameter before which the segment is not in the box."""
    p, q = segments[:, 0], segments[:, 1]
    with np.errstate(all="ignore"):
        low, high = (boxes[:, 0] - p) / (q - p), (boxes[:, 1] - p) / (q - p)
        is_known = (p != q) & ~np.isnan(low) & ~np.isnan(high)
        first = np.where(is_known, np.minimum(low, high), 0.0).max(axis=1, initial=0.0)
    found: FloatArray = np.where(first > 0.0, np.nextafter(first * _NEAR, 0.0), 0.0)
    return found
