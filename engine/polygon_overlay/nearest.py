"""Rounded rings as they are: repeated points and rings without area left out, and nothing made valid.

Pieces, holes and vertices are put in their order again, which rounding may have changed.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from engine.arrays import FloatArray, IntArray, read_only
from engine.parallel import Budget
from engine.polygon_overlay.compiled.loading import RingArrays
from engine.polygon_overlay.found import Found, one_pair
from engine.polygon_overlay.implicit_rings import NOTHING, ImplicitRings, edges_along
from engine.polygon_overlay.result import Overlay
from engine.polygon_overlay.rounds import Exact, collapses, overlay_of

Vertex = tuple[float, float, int]
"""Its place, and its number among those given."""
Ring = list[Vertex]


class NearestRings(NamedTuple):
    """pieces: shell and holes of each, in their order; lost_pieces, lost_holes: numbers of their rings."""

    pieces: list[list[Ring]]
    lost_pieces: list[int]
    lost_holes: list[int]

    def arrays(self) -> tuple[FloatArray, IntArray, IntArray]:
        """Return vertices, ring offsets and piece offsets, as those of `Overlay`."""
        rings = [ring for piece in self.pieces for ring in piece]
        vertices = np.array([vertex[:2] for ring in rings for vertex in ring], np.float64).reshape(-1, 2)
        return vertices, np.cumsum([0, *map(len, rings)]), np.cumsum([0, *map(len, self.pieces)])

    def numbers(self) -> IntArray:
        """Return which of the vertices given each is."""
        return np.array([vertex[2] for piece in self.pieces for ring in piece for vertex in ring], np.int64)


def nearest_rings(
    vertices: FloatArray, ring_offsets: IntArray, piece_offsets: IntArray, budget: Budget
) -> NearestRings:
    """Return rounded rings without those that have no area; with a shell its holes go."""
    places = [(x, y, k) for k, (x, y) in enumerate(vertices.tolist())]
    have_area = _have_area(vertices, ring_offsets)
    rings: list[Ring] = []
    for start, stop in itertools.pairwise(ring_offsets.tolist()):
        budget.check()
        rings.append(without_repeats(places[start:stop]))
    pieces: list[list[Ring]] = []
    lost_pieces: list[int] = []
    lost_holes: list[int] = []
    for shell, end in itertools.pairwise(piece_offsets.tolist()):
        budget.check()
        stays = have_area[shell]
        kept = [ring for ring in range(shell + 1, end) if stays and have_area[ring]]
        lost_holes += sorted({*range(shell + 1, end)} - {*kept})
        if stays:
            pieces.append([rings[ring] for ring in (shell, *kept)])
        else:
            lost_pieces.append(shell)
    return NearestRings(in_order(pieces), lost_pieces, lost_holes)


def leave_nearest(first: Found, exact: Exact, budget: Budget) -> Overlay:
    """Return rounded rings that stay as they are, and what rounding left without area."""
    found = nearest_rings(first.vertices, first.ring_offsets, first.piece_offsets, budget)
    displacement = float(first.displacement[0])
    edges = edges_along(first.sources)[found.numbers()]
    return overlay_of(
        one_pair(*found.arrays(), displacement, 0),
        first,
        exact,
        "nearest",
        _edges=read_only(edges),
        rounds=int(displacement > 0.0),
        largest_displacement=displacement,
        collapsed=collapses(first, exact, found.lost_pieces, found.lost_holes, budget),
    )


def without_repeats(vertices: Iterable[Vertex]) -> Ring:
    """Return a ring, none of its vertices repeated in succession: of equal ones the last is left."""
    result: Ring = []
    for vertex in vertices:
        if result and result[-1][:2] == vertex[:2]:
            result.pop()
        result.append(vertex)
    while len(result) > 1 and result[0][:2] == result[-1][:2]:
        result[0] = result.pop()
    return result


def in_order(pieces: Iterable[list[Ring]]) -> list[list[Ring]]:
    """Return pieces and their holes in lexicographic order, each ring from its leftmost, then lowest vertex.

    A ring that passes that vertex more than once, as rounding may leave it, begins so that it comes first in the order.
    """
    turned = [[_from_first(ring) for ring in piece] for piece in pieces]
    pieces = [[shell, *sorted(holes, key=_places)] for shell, *holes in turned]
    return sorted(pieces, key=lambda piece: [_places(ring) for ring in piece])


def _places(ring: Ring) -> list[tuple[float, float]]:
    return [vertex[:2] for vertex in ring]


def _from_first(ring: Ring) -> Ring:
    places = _places(ring)
    first = min(places)
    if places.count(first) == 1:
        start = places.index(first)
    else:
        start = min((k for k, place in enumerate(places) if place == first), key=lambda k: places[k:] + places[:k])
    return ring[start:] + ring[:start]


def _have_area(vertices: FloatArray, ring_offsets: IntArray) -> list[bool]:
    """Tell of each ring whether its signed area is not zero, exactly."""
    sources = np.full((len(vertices), 2), -1, np.int32)
    sources[:, 0] = np.arange(len(vertices))
    own = RingArrays(read_only(vertices), read_only(ring_offsets))
    rings = ImplicitRings(own, NOTHING, read_only(sources), own.offsets)
    areas, _ = rings.sure_areas(np.arange(len(ring_offsets)))
    return [rings.some([k]).area() != 0 if area != area else area != 0.0 for k, area in enumerate(areas.tolist())]
