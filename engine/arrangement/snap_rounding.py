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
from math import floor, ldexp

import numpy as np

from engine.parallel import Budget

Point = tuple[Fraction, Fraction]
Pixel = tuple[int, int]

_HALF = Fraction(1, 2)


def _passage(start: Point, end: Point, pixel: Pixel) -> tuple[Fraction, Fraction] | None:
    """Return the parameters between which the segment is in the half-open pixel, None where it is not."""
    low, low_open, high, high_open = Fraction(0), False, Fraction(1), False
    for a, b, centre in zip(start, end, pixel):
        if a == b:
            if not centre - _HALF <= a < centre + _HALF:
                return None
            continue
        near, far = ((centre + side - a) / (b - a) for side in (-_HALF, _HALF))
        is_back = a > b
        enters, leaves = (far, near) if is_back else (near, far)  # near belongs to the pixel, far does not
        if enters > low or (enters == low and is_back):
            low, low_open = enters, is_back
        if leaves < high or (leaves == high and not is_back):
            high, high_open = leaves, not is_back
    return (low, high) if low < high or (low == high and not low_open and not high_open) else None


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
            passed = []
            for number in _candidates(hot, centres, start, end):
                pixel = hot[number]
                through = None if pixel in (first, last) else _passage(start, end, pixel)
                if through is not None:
                    passed.append((*through, pixel))
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
