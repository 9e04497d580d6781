"""Coordinates of a tree (`bvh.py`): the box around all items, factors along axes, origin and scale."""

from __future__ import annotations

from math import frexp, ldexp
from typing import Any

import numpy as np

from engine.compiling.jit import allocating, called, inline
from engine.types import FloatArray

_SAMPLE = 31
_HUGE = 2.0**1022
"""Half extent from which the origin is the middle: from a point near an end the difference to the other end could
overflow."""

_LEAST_STRETCH, _MOST_STRETCH = 5, 100
"""Exponents: see `choose_stretch`."""
_MOST_STRETCHED = 2.0**900
"""Boxes beyond this size, or below its reciprocal, are not stretched: coordinates could overflow or lose bits."""


@called
def measure(boxes: FloatArray, ends: FloatArray) -> None:
    """Set ends (6,) to the box around boxes (n, 6)."""
    for axis in range(3):
        low, high = np.inf, -np.inf
        for item in range(boxes.shape[0]):
            low, high = min(low, boxes[item, axis]), max(high, boxes[item, 3 + axis])
        ends[axis], ends[3 + axis] = low, high


@inline
def _choose_stretch(ends: FloatArray, stretch: FloatArray) -> None:
    """Set stretch (3,) to powers of two, up to 2^_MOST_STRETCH, for axes that are shorter by more than 2^_LEAST_STRETCH
    than the longest, else 1."""
    longest, size = 0.0, 0.0
    for axis in range(3):
        longest = max(longest, 0.5 * ends[3 + axis] - 0.5 * ends[axis])
        size = max(size, abs(ends[axis]), abs(ends[3 + axis]))
    for axis in range(3):
        extent = 0.5 * ends[3 + axis] - 0.5 * ends[axis]
        if extent > 0.0 and 1.0 / _MOST_STRETCHED < size < _MOST_STRETCHED:
            shorter = min(frexp(longest)[1] - frexp(extent)[1], _MOST_STRETCH)
            stretch[axis] = ldexp(1.0, shorter) if shorter > _LEAST_STRETCH else 1.0


@called
def place_tree(
    boxes: FloatArray,
    ends: FloatArray,
    is_stretched: bool,
    stretch: FloatArray,
    origin: FloatArray,
    factors: FloatArray,
) -> float:
    """Set stretch (3,), factors along the axes, all 1 unless is_stretched; the origin (3,) of the tree in stretched
    coordinates; and factors (5,), of which the first is 1 / sqrt(scale) but for a power of two, the second 1 / scale
    divided by it, and the others the first times stretch. Return the scale, a power of two. ends (6,): the box around
    boxes (n, 6)."""
    half = 0.0
    stretch[0], stretch[1], stretch[2] = 1.0, 1.0, 1.0
    if is_stretched:
        _choose_stretch(ends, stretch)
    for axis in range(3):
        low, high = ends[axis] * stretch[axis], ends[3 + axis] * stretch[axis]
        is_huge = 0.5 * high - 0.5 * low >= _HUGE
        origin[axis] = 0.5 * low + 0.5 * high if is_huge else _middle_of(boxes, axis) * stretch[axis]
        half = max(half, 0.5 * high - 0.5 * origin[axis], 0.5 * origin[axis] - 0.5 * low)
    power = frexp(half)[1] if half > 0.0 else 0  # half: of what is to be at most 2
    factors[0] = ldexp(1.0, -power // 2)
    factors[1] = ldexp(1.0, -power - (-power // 2))  # order: two factors, since 2^-power may be no float
    for axis in range(3):
        factors[2 + axis] = factors[0] * stretch[axis]
    return ldexp(1.0, power)


@inline
def read_item(boxes: FloatArray, item: int, origin: FloatArray, factors: FloatArray, items: Any, place: int) -> None:
    """Write a box in tree coordinates to a place in items. origin, factors: as of `place_tree`."""
    for axis in range(4):
        low, high = 0.0, 0.0
        if axis < 3:
            once, again, moved = factors[2 + axis], factors[1], origin[axis] * factors[0] * factors[1]
            low, high = boxes[item, axis] * once * again - moved, boxes[item, 3 + axis] * once * again - moved
        items.boxes[place, axis], items.boxes[place, 4 + axis] = low, -high


@allocating
def _middle_of(boxes: FloatArray, axis: int) -> float:
    """Return the median, over a sample of boxes, of their centre's coordinate on an axis."""
    n_seen, step = 0, (len(boxes) - 1) // _SAMPLE + 1
    sorted_centres = np.empty(_SAMPLE)
    for item in range(0, len(boxes), step):
        centre, place = 0.5 * boxes[item, axis] + 0.5 * boxes[item, 3 + axis], n_seen
        while place > 0 and sorted_centres[place - 1] > centre:
            sorted_centres[place] = sorted_centres[place - 1]
            place -= 1
        sorted_centres[place] = centre
        n_seen += 1
    return sorted_centres[n_seen // 2]
