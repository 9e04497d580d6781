"""Rounded rings as they are: repeated points and rings without area left out, and nothing made valid.

Pieces, holes and vertices are put in their order again, which rounding may have changed.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray, read_only
from engine.budget import Budget
from engine.polygon_overlay.compiled.kernel import MAY_CROSS
from engine.polygon_overlay.found import NO_PAIRS, Found, joined, one_pair, taken
from engine.polygon_overlay.implicit_rings import edges_along, rings_alone
from engine.polygon_overlay.result import Exact, Lost, Overlay
from engine.polygon_overlay.rounds import SettledPairs, overlay_of
from engine.solids.ragged import next_in_rings

_Ring = tuple[list[tuple[float, float]], list[int]]
"""Places of vertices, and their numbers among those given."""


class NearestRings(NamedTuple):
    """Rings that have area, as those of `Overlay`; numbers: which of the vertices given each is; lost_pieces,
    lost_holes: numbers of the other rings."""

    vertices: FloatArray
    ring_offsets: IntArray
    piece_offsets: IntArray
    numbers: IntArray
    lost_pieces: list[int]
    lost_holes: list[int]


def nearest_rings(
    vertices: FloatArray, ring_offsets: IntArray, piece_offsets: IntArray, budget: Budget
) -> NearestRings:
    """Return rounded rings without those that have no area, in their order; with a shell its holes go."""
    have_area = _have_area(vertices, ring_offsets)
    shells = np.repeat(piece_offsets[:-1], np.diff(piece_offsets))
    stays, is_hole = have_area & have_area[shells], shells != np.arange(len(shells))
    kept = np.flatnonzero(
        (vertices != vertices[next_in_rings(ring_offsets)]).any(axis=1)
    )  # of equal ones the last, whose edge goes on
    starts = np.searchsorted(kept, ring_offsets)
    pieces: list[list[_Ring]] = []
    for shell, end in pairwise(piece_offsets.tolist()):
        budget.check()
        there = (shell + np.flatnonzero(stays[shell:end])).tolist()
        rings = [_from_first(vertices, kept[starts[ring] : starts[ring + 1]]) for ring in there]
        if rings:
            pieces.append([rings[0], *sorted(rings[1:])])
    pieces.sort()
    ordered = [ring for piece in pieces for ring in piece]
    numbers = np.array([number for _, own in ordered for number in own], np.int64)
    return NearestRings(
        vertices[numbers], np.cumsum([0, *(len(own) for _, own in ordered)]), np.cumsum([0, *map(len, pieces)]),
        numbers, np.flatnonzero(~have_area & ~is_hole).tolist(), np.flatnonzero(~stays & is_hole).tolist(),
    )  # fmt: skip


def _from_first(vertices: FloatArray, numbers: IntArray) -> _Ring:
    """Return a ring from its leftmost, then lowest vertex; if that is passed more than once, so that it comes first."""
    places, own = list(map(tuple, vertices[numbers].tolist())), numbers.tolist()
    low = min(places)
    start = min((k for k, place in enumerate(places) if place == low), key=lambda k: places[k:] + places[:k])
    return places[start:] + places[:start], own[start:] + own[:start]


def _have_area(vertices: FloatArray, ring_offsets: IntArray) -> BoolArray:
    """Tell of each ring whether its signed area is not zero, exactly."""
    rings = rings_alone(vertices, ring_offsets)
    areas, _ = rings.sure_areas(np.arange(len(ring_offsets)))
    for ring in np.flatnonzero(np.isnan(areas)).tolist():
        areas[ring] = rings.some([ring]).area() != 0
    return areas != 0.0


def leave_nearest(first: Found, exact: Exact, budget: Budget) -> Overlay:
    """Return rounded rings that stay as they are, and what rounding left without area."""
    found = nearest_rings(first.vertices, first.ring_offsets, first.piece_offsets, budget)
    displacement = float(first.displacement[0])
    return overlay_of(
        one_pair(*found[:3], displacement, 0), first, exact, output="nearest", may_be_invalid=displacement > 0.0,
        _edges=read_only(edges_along(first.sources)[found.numbers]), rounds=int(displacement > 0.0),
        largest_displacement=displacement, _lost=Lost(exact, first.piece_offsets, found.lost_pieces, found.lost_holes),
    )  # fmt: skip


def nearest_pairs(first: Found, budget: Budget) -> SettledPairs:
    """Leave the rings of the pairs of ``first`` that are MAY_CROSS as they are, but those without area."""
    pairs = np.flatnonzero(first.status == MAY_CROSS)
    found = [NO_PAIRS]
    for pair in range(len(pairs)):
        one = taken(first, pairs[pair : pair + 1])
        rings = nearest_rings(one.vertices, one.ring_offsets, one.piece_offsets, budget)
        found.append(one_pair(*rings[:3], float(one.displacement[0]), int(one.counts[0, 3])))
    return SettledPairs(pairs, joined(found), 0.5)
