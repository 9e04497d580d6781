"""Polygons in longitude and latitude that cross the antimeridian: cut there before a question, joined after it.

A step of more than 180 degrees between two vertices of a ring crosses the antimeridian. Counting these steps makes the
ring continuous: longitudes x + 360 k, exact as fractions. It is then split by the lines x = 180 + 360 j, and each piece
is moved back by 360 j: vertices of the input are the doubles that they were, and the latitude of a cut is rounded once,
the same for two features that share the edge. Edges stay straight in longitude and latitude, as RFC 7946 has them.

In an answer the pieces of a row on the two sides are brought together again, exactly as fractions; edges that both
share vanish from their arrangement. Longitudes are those that the vertices had: such a ring jumps from 180 to -180.

Source: RFC 7946, 3.1.9 (Antimeridian Cutting).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from math import floor
from typing import Final

import numpy as np

from engine.arrangement.nodes import rational_nodes
from engine.layers.limits import Limits
from engine.layers.rows import LayerRows, concatenate_rows
from engine.polygon_overlay.pair_arrays import PolygonArrays, arrays_of, concatenate_polygons
from engine.polygon_overlay.split import pieces_between
from engine.running.budget import Budget, note
from engine.solids.ragged import next_in_rings, summed
from engine.types import BoolArray, FloatArray, IntArray

Exact = tuple[Fraction, Fraction]
_FARTHEST: Final = 540.0
"""Largest longitude, a turn beyond 180: there is a cut at each turn."""


def steps_of(vertices: FloatArray, ring_offsets: IntArray) -> IntArray:
    """Return (n,) int: for the edge from each vertex to the next of its ring, 1 if it crosses the antimeridian to the
    east, so that later longitudes are one turn larger, -1 to the west, else 0."""
    x, following = vertices[:, 0], vertices[next_in_rings(ring_offsets), 0]
    with np.errstate(all="ignore"):
        step = following - x
        rest = (following - (step - (step - following))) - (x + (step - following))  # what rounding took of it
    is_east, is_west = (step > 180) | ((step == 180) & (rest > 0)), (step < -180) | ((step == -180) & (rest < 0))
    return is_west.astype(np.int64) - is_east


def _note_steps(vertices: FloatArray, ring_offsets: IntArray) -> None:
    """Warn of rings in longitude and latitude with steps of more than 180 degrees, which are taken as they are."""
    x, y = vertices.T
    if not len(x) or not (x.max() - x.min() > 180 and np.abs(x).max() <= 180 and np.abs(y).max() <= 90):
        return
    n = len(np.unique(np.searchsorted(ring_offsets, np.flatnonzero(steps_of(vertices, ring_offsets)), side="right")))
    if n:
        note(f"{n} rings have steps of more than 180 degrees, taken as they are; wrap=180 cuts at the antimeridian")


def cut_parts(
    parts: PolygonArrays, offsets: IntArray, in_degrees: bool, limits: Limits, refused: Callable[[int, str], Exception]
) -> tuple[PolygonArrays, IntArray]:
    """Return the polygons of features, feature k has offsets[k] .. offsets[k + 1] - 1, with `limits.wrap` cut at the
    antimeridian. in_degrees: whether to warn of such that are not cut. Raises: refused(feature, what is wrong) for a
    ring around a pole, or a longitude that is none."""
    if not limits.wrap:
        if in_degrees:
            _note_steps(parts.vertices, parts.ring_offsets)
        return parts, offsets
    steps = steps_of(parts.vertices, parts.ring_offsets)
    ends = parts.ring_offsets[parts.polygon_offsets]
    is_cut: BoolArray = np.array(
        [bool(steps[i:j].any() or (np.abs(parts.vertices[i:j, 0]) > 180).any()) for i, j in pairwise(ends.tolist())],
        np.bool_,
    )
    if not is_cut.any():
        return parts, offsets
    made, numbers, n_made = [parts], [np.array([k]) for k in range(len(is_cut))], len(is_cut)
    with limits.budget() as budget:
        for k in np.flatnonzero(is_cut).tolist():
            rings = parts.ring_offsets[parts.polygon_offsets[k] : parts.polygon_offsets[k + 1] + 1].tolist()
            feature = int(np.searchsorted(offsets, k, side="right")) - 1
            if (far := float(np.abs(parts.vertices[ends[k] : ends[k + 1], 0]).max())) > _FARTHEST:
                raise refused(feature, f"has a longitude of size {far!r}; with wrap the largest is {_FARTHEST}")
            around = [_unwrapped(parts.vertices[i:j], steps[i:j]) for i, j in pairwise(rings)]
            if None in around:
                raise refused(feature, "has a ring that goes around a pole: add the pole, and the antimeridian twice")
            pieces = _cut([each for each in around if each is not None], budget)
            numbers[k] = np.arange(n_made, n_made + len(pieces))
            n_made += len(pieces)
            made += [_polygon(piece) for piece in pieces]
    note(f"wrap: {int(is_cut.sum())} polygons cross the antimeridian, are cut there, and joined in the answer")
    sizes = [len(each) for each in numbers]
    counts = [sum(sizes[i:j]) for i, j in pairwise(offsets.tolist())]
    return concatenate_polygons(made).take(np.concatenate(numbers)), summed(np.array(counts, np.int64))


def _unwrapped(vertices: FloatArray, steps: IntArray) -> list[Exact] | None:
    """Return the vertices of a ring with continuous longitudes; None if they do not come back."""
    if steps.sum():
        return None
    turns = np.cumsum(np.append(0, steps[:-1])).tolist()
    return [(Fraction(x) + 360 * turn, Fraction(y)) for (x, y), turn in zip(vertices.tolist(), turns)]


def _cut(rings: list[list[Exact]], budget: Budget) -> list[list[list[Exact]]]:
    """Return the pieces between the meridians 180 + 360 j of a shell with holes, each moved to -180 .. 180."""
    low, high = min(x for x, _ in rings[0]), max(x for x, _ in rings[0])
    for k, ring in enumerate(rings[1:], 1):  # a hole may be written a turn beside its shell
        shift = next((n for n in (0, 360, -360) if all(low <= x + n <= high for x, _ in ring)), 0)
        rings[k] = [(x + shift, y) for x, y in ring]
    bottom, top = min(y for ring in rings for _, y in ring), max(y for ring in rings for _, y in ring)
    meridians = [Fraction(180 + 360 * j) for j in range(floor((low - 180) / 360), floor((high - 180) / 360) + 1)]
    flat = [place for ring in rings for place in ring]
    flat += [(x, y) for x in meridians for y in (bottom - 1, top + 1)]
    nodes, numbers = rational_nodes(flat, budget)
    ends = np.cumsum([0, *map(len, rings)]).tolist()
    cuts = list(zip(numbers[ends[-1] :: 2], numbers[ends[-1] + 1 :: 2]))
    arrangement, pieces = pieces_between(nodes, [numbers[i:j] for i, j in pairwise(ends)], cuts, budget)
    made = []
    for piece in pieces:
        exact = [[nodes.exact(arrangement.origin(edge)) for edge in ring] for ring in (piece.shell, *piece.holes)]
        turn = 360 * floor((min(x for x, _ in exact[0]) + 180) / 360)
        made.append([[(x - turn, y) for x, y in ring] for ring in exact])
    return made


def _polygon(rings: list[list[Exact]]) -> PolygonArrays:
    """Return a piece with nearest doubles."""
    places = np.array([(float(x), float(y)) for ring in rings for x, y in ring])
    return arrays_of(places, summed(np.array([*map(len, rings)], np.int64)), np.array([0, len(rings)]))


def joined_rows(rows: LayerRows, limits: Limits) -> LayerRows:
    """Return rows whose pieces that meet along the antimeridian are joined, with `limits.wrap`; a row with a piece that
    reaches from one side of it around the earth to the other stays as it is."""
    if not limits.wrap or not len(rows.vertices):
        return rows
    x, following = rows.vertices[:, 0], next_in_rings(rows.ring_offsets)
    rings = np.repeat(np.arange(len(rows.ring_offsets) - 1), np.diff(rows.ring_offsets))
    piece = np.searchsorted(rows.piece_offsets, rings, side="right") - 1
    west, east = (np.unique(piece[(x == side) & (x[following] == side)]) for side in (180.0, -180.0))
    around = np.intersect1d(west, east)
    owners = np.searchsorted(rows.row_offsets, np.arange(len(rows.piece_offsets) - 1), side="right") - 1
    some = np.setdiff1d(np.intersect1d(owners[west], owners[east]), owners[around])
    if not len(some):
        return rows
    parts, order = [rows], np.arange(len(rows))
    with limits.budget() as budget:
        for number, k in enumerate(some.tolist()):
            own = range(rows.row_offsets[k], rows.row_offsets[k + 1])
            pieces = [_rings(rows, j) for j in own]
            meet = [j in west or j in east for j in own]
            made = _united([(rings, j in east) for rings, j, m in zip(pieces, own, meet) if m], budget)
            every = [rings for rings, m in zip(pieces, meet) if not m] + made
            parts.append(_row(every, int(rows.left[k]), int(rows.right[k])))
            order[k] = len(rows) + number
    return replace(concatenate_rows(parts).take(order), touching=rows.touching)


def _rings(rows: LayerRows, piece: int) -> list[FloatArray]:
    ends = rows.ring_offsets[rows.piece_offsets[piece] : rows.piece_offsets[piece + 1] + 1]
    return [rows.vertices[i:j] for i, j in pairwise(ends.tolist())]


def _united(pieces: list[tuple[list[FloatArray], bool]], budget: Budget) -> list[list[FloatArray]]:
    """Return the union of pieces that meet only along the antimeridian, as polygons (lists of rings). pieces: of each
    its rings, and whether it lies east of the antimeridian."""
    given: dict[tuple[Fraction, Fraction], tuple[float, float]] = {}
    exact = []
    for rings, is_east in pieces:
        for ring in rings:
            exact.append([(Fraction(x) + 360 * is_east, Fraction(y)) for x, y in ring.tolist()])
            for place, (x, y) in zip(exact[-1], ring.tolist()):
                given[place] = (180.0 if abs(x) == 180.0 else x, y)
    nodes, numbers = rational_nodes([place for ring in exact for place in ring], budget)
    ends = np.cumsum([0, *map(len, exact)]).tolist()
    arrangement, made = pieces_between(nodes, [numbers[i:j] for i, j in pairwise(ends)], [], budget)
    return [
        [np.array([given[nodes.exact(arrangement.origin(edge))] for edge in ring]) for ring in (one.shell, *one.holes)]
        for one in made
    ]


def _row(pieces: list[list[FloatArray]], left: int, right: int) -> LayerRows:
    rings = [ring for piece in pieces for ring in piece]
    arrays = PolygonArrays(
        np.concatenate(rings), summed(np.array([*map(len, rings)], np.int64)),
        summed(np.array([*map(len, pieces)], np.int64)),
    )  # fmt: skip
    return LayerRows(np.array([left]), np.array([right]), *arrays, np.array([0, len(pieces)]))
