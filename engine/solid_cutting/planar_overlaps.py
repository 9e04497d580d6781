"""Areas that polygons of the plane have in common, and their ratios: one pair, or arrays of many.

Source: M. Cyrus, J. Beck, 1978; G. Green, 1828: see `convex_rings.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, Final

import numpy as np

from engine.compiling.jit import entry_of
from engine.errors import NotRepresentableError, RingTooShortError, UnsupportedPairError, WrongDimensionError
from engine.polygon_overlay.batch import overlay_batch, twice_areas
from engine.polygon_overlay.overlay import overlay
from engine.polygon_overlay.pair_arrays import PolygonSelection, arrays_of
from engine.predicates.rational import nearest_float
from engine.running.budget import Budget
from engine.running.parallel import run_chunks
from engine.solid_cutting.convex_rings import MOST_CORNERS, overlap_rings
from engine.solids.base import Solid
from engine.solids.checks import as_floats
from engine.solids.polygon import Polygon
from engine.solids.primitives import Aabb, Triangle
from engine.types import FloatArray, read_only

_BOX_NUMBERS: Final = 5
_COMFORTABLE: Final = 128
"""Exponents of coordinates up to which areas are far from the least and the largest double."""
_MOST: Final = np.finfo(np.float64).max


def check_same_length(first: Any, second: Any) -> None:
    if len(first) != len(second):
        raise UnsupportedPairError(f"{len(first)} solids and {len(second)}; give as many of each", ("second",))


def overlaps_of_arrays(
    first: Any, second: Any, is_ratio: bool, workers: int | None, budget: Budget
) -> tuple[FloatArray, int]:
    """Return areas, or their ratios, of arrays (n, k, 2) of polygons or (n, 5) of boxes, and how many took overlays."""
    sides = [_corners_of(each, name) for name, each in (("first", first), ("second", second))]
    check_same_length(*sides)
    values = np.full(len(sides[0]), np.nan)
    if all(side.shape[1] <= MOST_CORNERS for side in sides):

        def fill(start: int, stop: int) -> None:
            some = [side[start:stop] for side in sides]
            entry_of(overlap_rings)(*some, is_ratio, values[start:stop], budget.flag)

        run_chunks(fill, len(values), budget=budget, workers=workers)
    rows = np.flatnonzero(np.isnan(values))
    if not len(rows):
        return values, 0
    one, other = (side[rows] for side in sides)
    if is_ratio:
        one, other = _scaled(one, other)
        pairs = (one, other), (one, _around(one)), (other, _around(other))
        values[rows] = _ratios([(_selection(p), _selection(q)) for p, q in pairs], workers, budget)
        return values, len(rows)
    limits: Any = {"deadline": budget.left(), "cancel": budget.cancel, "workers": workers}
    made: Any = overlay_batch(_selection(one), _selection(other), **limits)
    values[rows] = made.areas
    if len(beyond := np.flatnonzero(np.isinf(values))):
        pair = int(beyond[0])
        raise NotRepresentableError(
            f"the area of pair {pair} is beyond the largest float64; scale the input down", ("first", pair)
        )
    return values, len(rows)


def _corners_of(each: Any, name: str) -> FloatArray:
    """Return an array of polygons (n, k, 2), or of boxes (n, 5), as corners."""
    if each.ndim == 2 and each.shape[1] == _BOX_NUMBERS:
        x, y, width, height, angle = as_floats(each, 2, (name,)).T
        along = np.stack([np.cos(angle), np.sin(angle)], axis=1) / 2
        across = np.stack([-along[:, 1], along[:, 0]], axis=1) * height[:, None]
        along = along * width[:, None]
        ways = (-along - across, along - across, along + across, across - along)
        each = np.stack([x, y], axis=1)[:, None] + np.stack(ways, axis=1)
    corners = as_floats(each, 3, (name,))
    if corners.shape[2] != 2:
        raise WrongDimensionError(f"{name} must hold positions of 2 numbers each, got {corners.shape[2]}", (name,))
    if corners.shape[1] < 3:
        raise RingTooShortError(f"{name} has polygons of {corners.shape[1]} corners; give 3 or more", (name,))
    return read_only(corners)


def overlap_of_polygons(first: Solid, second: Solid, moves: tuple[Any, Any], is_ratio: bool, budget: Budget) -> float:
    """Return what polygons have in common. is_ratio: maybe each axis multiplied by a power of two."""
    if moves != (None, None):
        raise UnsupportedPairError("polygons take no pose here; move their vertices", ("first_pose",))
    sides = [_as_polygon(each) for each in (first, second)]
    if not is_ratio:
        return overlay(sides[0], sides[1], deadline=budget.left(), cancel=budget.cancel).area
    if not all(len(each.vertices) for each in sides):
        return 0.0
    places = _scaled(*(each.vertices[None] for each in sides))
    one, other = ([Polygon.of_arrays(read_only(at[0]), each.ring_offsets)] for at, each in zip(places, sides))
    boxes = [[Polygon([_around(at)[0]])] for at in places]
    return float(_ratios([(one, other), (one, boxes[0]), (other, boxes[1])], 1, budget)[0])


def _ratios(pairs: Sequence[tuple[Any, Any]], workers: int | None, budget: Budget) -> FloatArray:
    """Return the nearest doubles of ratios of areas. pairs: of polygons, and of each with a box around, within which it
    has its own area."""
    limits: Any = {"deadline": budget.left(), "cancel": budget.cancel, "workers": workers}
    made: list[Any] = [overlay_batch(*pair, **limits) for pair in pairs]
    sums, values = np.stack([twice_areas(each) for each in made], axis=1), np.empty(len(made[0]))
    for row, parts in enumerate(sums.tolist()):
        budget.check()
        areas: list[list[Fraction]] = []
        if np.isfinite(sums[row]).all():
            middles = [Fraction(h) + Fraction(low) for h, low, _ in parts]
            areas = [[mid + way * Fraction(part[2]) for mid, part in zip(middles, parts)] for way in (-1, 1)]
        ends = [ratio_of(some) for some in extremes(*areas)] if areas else [0.0, 1.0]
        if ends[0] != ends[1]:
            ends = [ratio_of([each[row].area_exact for each in made])]
        values[row] = ends[0]
    return values


def extremes(low: Sequence[Fraction], high: Sequence[Fraction]) -> Any:
    """Return (both, first, second) at which their ratio is least, and greatest: 1 where all may be the same."""
    return (low[0], *high[1:]), (high[0], *low[1:]) if high[0] <= min(low[1:]) else (Fraction(1),) * 3


def ratio_of(volumes: Sequence[Fraction]) -> float:
    """Return the ratio of what two have in common to their union, from that and the volume of each."""
    both, first, second = volumes
    union = first + second - both
    return min(1.0, max(0.0, nearest_float(both / union))) if union > 0 else 0.0


def _selection(corners: FloatArray) -> PolygonSelection:
    """Return an array (n, k, 2) as polygons."""
    n, k = corners.shape[:2]
    arrays = arrays_of(corners.reshape(-1, 2), np.arange(0, n * k + 1, k), np.arange(n + 1))
    return PolygonSelection(arrays, np.arange(n))


def _scaled(*sides: FloatArray) -> list[FloatArray]:
    """Return corners (n, k, 2), each pair multiplied by powers of two by axis, where areas might be too large or too
    small for doubles, and where that is exact."""
    exponents = np.frexp(np.maximum(*(np.abs(each).max(axis=1) for each in sides)))[1]
    exponents[np.abs(exponents) <= _COMFORTABLE] = 0
    if not exponents.any():
        return list(sides)
    up = exponents[:, None]
    made = [np.ldexp(each, -up) for each in sides]
    are_exact = [(np.ldexp(some, up) == each).all(axis=(1, 2)) for some, each in zip(made, sides)]
    return [np.where((are_exact[0] & are_exact[1])[:, None, None], *pair) for pair in zip(made, sides)]


def _around(corners: FloatArray) -> FloatArray:
    """Return a box strictly around each polygon: with that it has its own area in common, crossing no edge."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    width = (high - low).max(axis=1, keepdims=True) + np.abs(low) + 1e-300
    low, high = np.maximum(low - width, -_MOST), np.minimum(high + width, _MOST)
    return np.stack([low, np.c_[high[:, 0], low[:, 1]], high, np.c_[low[:, 0], high[:, 1]]], axis=1)


def _as_polygon(solid: Any) -> Polygon:
    if isinstance(solid, Aabb):
        (a, b), (c, d) = solid.min.tolist(), solid.max.tolist()
        return Polygon([[(a, b), (c, b), (c, d), (a, d)]])
    if isinstance(solid, Triangle):
        return Polygon([solid.vertices])
    if isinstance(solid, Polygon):
        return solid
    raise UnsupportedPairError(f"overlap of a polygon and a {solid.type} is not there; give polygons", ("second",))
