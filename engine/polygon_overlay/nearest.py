"""Rounded rings as they are: repeated points and rings without area left out, and nothing made valid.

What exact/rounding.py's `round_to_nearest` leaves, from rings that are rounded already.
"""

from __future__ import annotations

import itertools
from typing import Final, NamedTuple

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.parallel import Budget
from engine.polygon_overlay.exact.rounding import Ring, has_area, in_order, without_repeats
from engine.polygon_overlay.implicit_rings import ImplicitRings
from engine.polygon_overlay.rounds import RoundedRings, Settled, collapses

_UNIT: Final = 2.0**-52
_TINY: Final = 2.0**-1070


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


def leave_nearest(first: RoundedRings, exact: ImplicitRings, budget: Budget) -> Settled:
    """Return rounded rings that stay as they are, and what rounding left without area."""
    found = nearest_rings(first.vertices, first.ring_offsets, first.piece_offsets, budget)
    vertices, ring_offsets, piece_offsets = found.arrays()
    return Settled(
        rings=RoundedRings(
            vertices=vertices,
            ring_offsets=ring_offsets,
            piece_offsets=piece_offsets,
            evidence=first.evidence,
            displacement=first.displacement,
            is_valid=False,
            has_crossings=first.has_crossings,
        ),
        rounds=1,
        displacement=first.displacement,
        snapped=False,
        vertices_moved=0,
        collapsed=collapses(first, exact, found.lost_pieces, found.lost_holes, budget),
        pieces_joined=0,
        pieces_parted=0,
        holes_joined=0,
        holes_parted=0,
    )


def _surely_have_area(vertices: FloatArray, ring_offsets: IntArray) -> BoolArray:
    """Tell of each ring whether its signed area is not zero; False where floating point does not tell.

    Twice the area is the sum of x_i y_j - x_j y_i over its edges, coordinates counted from its first vertex. Each is
    off by half a unit u = 2^-52 of itself, so each product by less than 2 u, and adding 2 m products up by less than
    m u of the sum of their sizes; and by the least double wherever a product underflows. Nothing overflows: coordinates
    are below 2^121.
    """
    starts, sizes = ring_offsets[:-1], np.diff(ring_offsets)
    if len(starts) == 0:
        return np.zeros(0, np.bool_)
    after = np.arange(1, len(vertices) + 1)
    after[ring_offsets[1:] - 1] = starts
    x, y = (vertices - np.repeat(vertices[starts], sizes, axis=0)).T
    left, right = x * y[after], x[after] * y
    doubled = np.add.reduceat(left - right, starts)
    bound = np.add.reduceat(np.abs(left) + np.abs(right), starts) * ((sizes + 8) * _UNIT) + sizes * _TINY
    return np.abs(doubled) > bound
