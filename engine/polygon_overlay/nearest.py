"""Rounded rings as they are: repeated points and rings without area left out, and nothing made valid.

Pieces, holes and vertices are put in their order again, which rounding may have changed.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from engine.arrangement.nodes import float_nodes
from engine.arrays import BoolArray, FloatArray, IntArray
from engine.parallel import Budget
from engine.polygon_overlay.result import Overlay
from engine.polygon_overlay.rounds import Exact, RoundedRings, collapses, overlay_of

_UNIT: Final = 2.0**-52
_TINY: Final = 2.0**-1070
Vertex = tuple[float, float]
Ring = list[Vertex]


class NearestRings(NamedTuple):
    """pieces: shell and holes of each, in their order; lost_pieces, lost_holes: numbers of those without area."""

    pieces: list[list[Ring]]
    lost_pieces: list[int]
    lost_holes: list[int]

    def arrays(self) -> tuple[FloatArray, IntArray, IntArray]:
        """Return vertices, ring offsets and piece offsets, as those of `Overlay`."""
        rings = [ring for piece in self.pieces for ring in piece]
        vertices = np.array([vertex for ring in rings for vertex in ring], np.float64).reshape(-1, 2)
        return vertices, np.cumsum([0, *map(len, rings)]), np.cumsum([0, *map(len, self.pieces)])


def nearest_rings(
    vertices: FloatArray,
    ring_offsets: IntArray,
    piece_offsets: IntArray,
    budget: Budget,
) -> NearestRings:
    """Return rounded rings, as `RoundedRings` has them, without those that have no area; with a shell its holes go."""
    places = list(map(tuple, vertices.tolist()))
    is_sure = _surely_have_area(vertices, ring_offsets).tolist()
    rings: list[Ring] = []
    for start, stop in itertools.pairwise(ring_offsets.tolist()):
        budget.check()
        rings.append(without_repeats(places[start:stop]))
    pieces: list[list[Ring]] = []
    lost_pieces: list[int] = []
    lost_holes: list[int] = []
    for piece, (shell, end) in enumerate(itertools.pairwise(piece_offsets.tolist())):
        budget.check()
        stays = is_sure[shell] or has_area(rings[shell])
        kept = [ring for ring in range(shell + 1, end) if stays and (is_sure[ring] or has_area(rings[ring]))]
        lost_holes += [ring - piece - 1 for ring in sorted({*range(shell + 1, end)} - {*kept})]
        if stays:
            pieces.append([rings[ring] for ring in (shell, *kept)])
        else:
            lost_pieces.append(piece)
    return NearestRings(in_order(pieces), lost_pieces, lost_holes)


def leave_nearest(first: RoundedRings, exact: Exact, budget: Budget) -> Overlay:
    """Return rounded rings that stay as they are, and what rounding left without area."""
    found = nearest_rings(first.vertices, first.ring_offsets, first.piece_offsets, budget)
    vertices, ring_offsets, piece_offsets = found.arrays()
    return overlay_of(
        replace(first, vertices=vertices, ring_offsets=ring_offsets, piece_offsets=piece_offsets),
        first,
        exact,
        "nearest",
        rounds=int(first.displacement > 0.0),
        largest_displacement=first.displacement,
        collapsed=collapses(first, exact, found.lost_pieces, found.lost_holes, budget),
    )


def without_repeats(vertices: Iterable[Vertex]) -> Ring:
    """Return a ring, none of its vertices repeated in succession."""
    result: Ring = []
    for vertex in vertices:
        if not result or result[-1] != vertex:
            result.append(vertex)
    while len(result) > 1 and result[0] == result[-1]:
        result.pop()
    return result


def in_order(pieces: Iterable[list[Ring]]) -> list[list[Ring]]:
    """Return pieces and their holes in lexicographic order, each ring from its leftmost, then lowest vertex.

    A ring that passes that vertex more than once, as rounding may leave it, begins so that it comes first in the order.
    """
    turned = [[_from_first(ring) for ring in piece] for piece in pieces]
    return sorted([shell, *sorted(holes)] for shell, *holes in turned)


def _from_first(ring: Ring) -> Ring:
    first = min(ring)
    if ring.count(first) == 1:
        start = ring.index(first)
    else:
        start = min((k for k, vertex in enumerate(ring) if vertex == first), key=lambda k: ring[k:] + ring[:k])
    return ring[start:] + ring[:start]


def has_area(ring: Ring) -> bool:
    """Tell whether the signed area of `ring` is not zero, exactly."""
    if len(ring) < 3:
        return False
    nodes, numbers = float_nodes(np.array(ring))
    points = [nodes.points[number] for number in numbers]
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(points, points[1:] + points[:1])) != 0


def _surely_have_area(vertices: FloatArray, ring_offsets: IntArray) -> BoolArray:
    """Tell of each ring whether its signed area is not zero; False where floating point does not tell.

    Twice the area is the sum of x_i y_j - x_j y_i over its edges, coordinates counted from its first vertex. Each is
    off by half a unit u = 2^-52 of itself, so each product by less than 2 u, and adding 2 m products up by less than
    m u of the sum of their sizes; and by the least double wherever a product underflows. Where one overflows the bound
    is infinite, or no number.
    """
    starts, sizes = ring_offsets[:-1], np.diff(ring_offsets)
    if len(starts) == 0:
        return np.zeros(0, np.bool_)
    after = np.arange(1, len(vertices) + 1)
    after[ring_offsets[1:] - 1] = starts
    with np.errstate(all="ignore"):
        x, y = (vertices - np.repeat(vertices[starts], sizes, axis=0)).T
        left, right = x * y[after], x[after] * y
        doubled = np.add.reduceat(left - right, starts)
        bound = np.add.reduceat(np.abs(left) + np.abs(right), starts) * ((sizes + 8) * _UNIT) + sizes * _TINY
        return np.abs(doubled) > bound
