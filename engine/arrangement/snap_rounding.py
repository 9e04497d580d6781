"""Classical snap rounding: every vertex to a lattice point, every edge through the hot pixels that it passes.

A pixel is the half-open square of one lattice spacing about a lattice point; it is hot if a vertex lies in it. An edge
is replaced by the chain of centres of the hot pixels it passes, in that order. Edges that met in vertices only then
meet in vertices only again (or coincide), and no edge moves by more than half a pixel's diagonal. So the result needs
no further rounding, which the finer way (round, arrange again, round, ...) cannot promise.

Source: J. D. Hobby, Practical segment intersection with finite precision output, 1999; L. J. Guibas and D. H. Marimont,
Rounding arrangements dynamically, 1998.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from fractions import Fraction
from math import floor, lcm, ldexp

import numpy as np

from engine.parallel import Budget

Point = tuple[Fraction, Fraction]
Pixel = tuple[int, int]

Axis = tuple[int, int, int]
"""Ends of a segment along an axis, and half of the lattice's spacing, as integers in a unit of their own."""

_HALF = Fraction(1, 2)
_FEW = 16
"""Pixels up to which each is looked at instead of an array of them."""


def _axis(start: Fraction, end: Fraction) -> Axis:
    half = lcm(start.denominator, end.denominator)
    return (
        2 * start.numerator * (half // start.denominator),
        2 * end.numerator * (half // end.denominator),
        half,
    )


def _passage(axes: Sequence[Axis], pixel: Pixel) -> tuple[int, int, int, int] | None:
    """Return the parameters between which the segment is in the half-open pixel, None where it is not.

    Both are numerator and denominator, the latter positive.
    """
    low = low_open = high_open = 0
    low_of = high = high_of = 1
    for (a, b, half), centre in zip(axes, pixel):
        near, far = (2 * centre - 1) * half, (2 * centre + 1) * half  # near <= value < far
        if a == b:
            if not near <= a < far:
                return None
            continue
        if a < b:
            enters, leaves, length, is_back = near - a, far - a, b - a, 0
        else:
            enters, leaves, length, is_back = a - far, a - near, a - b, 1
        later, earlier = enters * low_of - low * length, high * length - leaves * high_of
        if later > 0 or (later == 0 and is_back):
            low, low_of, low_open = enters, length, is_back
        if earlier > 0 or (earlier == 0 and not is_back):
            high, high_of, high_open = leaves, length, 1 - is_back
    order = high * low_of - low * high_of
    if order > 0 or (order == 0 and not low_open and not high_open):
        return low, low_of, high, high_of
    return None


def snap_rings(
    rings: Sequence[Sequence[Point]], spacing_exponent: int, budget: Budget | None = None
) -> list[list[tuple[float, float]]]:
    """Return the rings snapped to the lattice of spacing ``2**spacing_exponent``, no vertex repeated in succession.

    rings: exact vertices; the edges of all rings meet only in vertices. Every coordinate must be below ``2**53``
    spacings, so that lattice points are doubles. A ring may shrink to fewer than three vertices.
    """
    budget = budget or Budget()
    unit = Fraction(2) ** spacing_exponent
    scaled = [[(x / unit, y / unit) for x, y in ring] for ring in rings]
    pixels = [[(floor(x + _HALF), floor(y + _HALF)) for x, y in ring] for ring in scaled]
    hot = sorted({pixel for ring in pixels for pixel in ring})
    centres = np.array(hot, np.float64).reshape(-1, 2)
    result = []
    for ring, own in zip(scaled, pixels):
        chain: list[Pixel] = []
        for start, end, first, last in zip(ring, [*ring[1:], *ring[:1]], own, [*own[1:], *own[:1]]):
            budget.check()
            axes = _axis(start[0], end[0]), _axis(start[1], end[1])
            passed = []
            for number in _candidates(hot, centres, start, end):
                pixel = hot[number]
                through = None if pixel in (first, last) else _passage(axes, pixel)
                if through is not None:
                    passed.append((Fraction(*through[:2]), Fraction(*through[2:]), pixel))
            for pixel in (first, *(pixel for *_, pixel in sorted(passed)), last):
                if not chain or chain[-1] != pixel:
                    chain.append(pixel)
        while len(chain) > 1 and chain[0] == chain[-1]:
            chain.pop()
        result.append([(ldexp(x, spacing_exponent), ldexp(y, spacing_exponent)) for x, y in chain])
    return result


def _candidates(hot: Sequence[Pixel], centres: np.ndarray, start: Point, end: Point) -> list[int]:
    """Return the pixels that the segment may pass: those near its box, and of many those near its line, generously.

    hot: sorted; centres: the same as floats.
    """
    (x0, x1), (y0, y1) = (sorted((floor(a), floor(b))) for a, b in zip(start, end))
    first, last = bisect_left(hot, (x0 - 1, y0 - 1)), bisect_left(hot, (x1 + 2, y1 + 3))
    if last - first <= _FEW:
        return [number for number in range(first, last) if y0 - 1 <= hot[number][1] <= y1 + 2]
    a, b = np.array(start, np.float64), np.array(end, np.float64)
    # bound: below 2**53 the rounded ends are off by at most 1/2, so differences by at most 1 1/2.
    among = centres[first:last]
    near = np.flatnonzero((among[:, 1] >= y0 - 1) & (among[:, 1] <= y1 + 2))
    along, offset = b - a, among[near] - a
    distance = np.abs(along[0] * offset[:, 1] - along[1] * offset[:, 0])
    reach = 4 * (np.abs(along).sum() + np.abs(offset).sum(axis=1) + 1) * (1 + 2.0**-40)
    # rounding of the two products: 2**-50 of their size is more than enough.
    reach += 2.0**-50 * (np.abs(along[0] * offset[:, 1]) + np.abs(along[1] * offset[:, 0]))
    return (first + near[distance <= reach]).tolist()
