"""Rows of polygons that were cut at the antimeridian, joined: pieces that share an edge there become one again.

Pieces on the east side (x = -180) are moved by 360, exactly as fractions; edges that both sides share then vanish from
the arrangement. Longitudes of the result are those that the vertices had: a ring that crosses jumps from 180 to -180.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np

from engine.arrangement.nodes import rational_nodes
from engine.layers.limits import Limits
from engine.layers.rows import LayerRows, concatenate_rows
from engine.polygon_overlay.pair_arrays import PolygonArrays
from engine.polygon_overlay.split import pieces_between
from engine.running.budget import Budget
from engine.solids.ragged import next_in_rings, summed
from engine.types import FloatArray

Ring = list[tuple[float, float]]


def joined_rows(rows: LayerRows, limits: Limits) -> LayerRows:
    """Return rows whose pieces that meet along the antimeridian are joined, with `limits.wrap`; a row with a piece that
    reaches from one side of it around the earth to the other stays as it is."""
    if not limits.wrap or not len(rows.vertices):
        return rows
    x, following = rows.vertices[:, 0], next_in_rings(rows.ring_offsets)
    rings = np.repeat(np.arange(len(rows.ring_offsets) - 1), np.diff(rows.ring_offsets))
    piece = np.searchsorted(rows.piece_offsets, rings, side="right") - 1
    row = np.searchsorted(rows.row_offsets, piece, side="right") - 1
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
            made = _joined([(rings, j in east) for rings, j, m in zip(pieces, own, meet) if m], budget)
            every = [rings for rings, m in zip(pieces, meet) if not m] + made
            parts.append(_row(every, int(rows.left[k]), int(rows.right[k])))
            order[k] = len(rows) + number
    del row
    return replace(concatenate_rows(parts).take(order), touching=rows.touching)


def _rings(rows: LayerRows, piece: int) -> list[FloatArray]:
    ends = rows.ring_offsets[rows.piece_offsets[piece] : rows.piece_offsets[piece + 1] + 1]
    return [rows.vertices[i:j] for i, j in pairwise(ends.tolist())]


def _joined(pieces: list[tuple[list[FloatArray], bool]], budget: Budget) -> list[list[FloatArray]]:
    """Return the union of pieces, given with whether they are east of the antimeridian, that meet there alone."""
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
