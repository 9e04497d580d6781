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

from engine.running.budget import Budget

Point = tuple[Fraction, Fraction]
Pixel = tuple[int, int]

_HALF = Fraction(1, 2)


class _Segment:
    """A segment in whole parts of a lattice spacing."""

    def __init__(self, start: Point, end: Point) -> None:
        (ax, ay), (bx, by) = (start, end) if start[0] <= end[0] else (end, start)
        self.unit = 2 * lcm(ax.denominator, ay.denominator, bx.denominator, by.denominator)
        self.ends = [value.numerator * (self.unit // value.denominator) for value in (ax, ay, bx, by)]

    def passes(self, pixel: Pixel) -> bool:
        """Tell whether it is in the half-open pixel: unless a corner tells that it enters and leaves on one side."""
        ax, ay, bx, by = self.ends
        left, low = ((2 * centre - 1) * (self.unit // 2) for centre in pixel)
        right, high = left + self.unit, low + self.unit
        if not (bx >= left and ax < right and max(ay, by) >= low and min(ay, by) < high):
            return False
        if ax == bx or ay == by:
            return True

        def turn(x: int, y: int) -> int:
            return (bx - ax) * (y - ay) - (by - ay) * (x - ax)

        return turn(left, high) > 0 > turn(right, low) if by > ay else turn(left, low) <= 0 < turn(right, high)


def snap_rings(
    rings: Sequence[Sequence[Point]], spacing_exponent: int, budget: Budget | None = None
) -> tuple[list[list[tuple[float, float]]], list[int]]:
    """Return the rings snapped to the lattice of spacing ``2**spacing_exponent``, no vertex repeated in succession.

    And for each of their vertices the number of the one, of all of ``rings``, whose edge goes on from there.

    rings: exact vertices; the edges of all rings meet only in vertices. Every coordinate must be below ``2**53``
    spacings, so that lattice points are doubles. A ring may shrink to fewer than three vertices.
    """
    budget = budget or Budget()
    unit = Fraction(2) ** spacing_exponent
    scaled = [[(x / unit, y / unit) for x, y in ring] for ring in rings]
    pixels = [[(floor(x + _HALF), floor(y + _HALF)) for x, y in ring] for ring in scaled]
    hot = sorted({pixel for ring in pixels for pixel in ring})
    centres = np.array(hot, np.float64).reshape(-1, 2)
    result, edges, edge = [], [], -1
    for ring, own in zip(scaled, pixels):
        chain: list[Pixel] = []
        along: list[int] = []
        for start, end, first, last in zip(ring, [*ring[1:], *ring[:1]], own, [*own[1:], *own[:1]]):
            budget.check()
            edge, segment = edge + 1, _Segment(start, end)
            near = [hot[number] for number in _candidates(hot, centres, start, end)]
            passed = [pixel for pixel in near if pixel not in (first, last) and segment.passes(pixel)]
            ways = [(b > a) - (b < a) for a, b in zip(start, end)]  # order: it never goes back to the left, or down
            passed.sort(key=lambda pixel: ways[0] * pixel[0] + ways[1] * pixel[1])
            for pixel in (first, *passed, last):
                if not chain or chain[-1] != pixel:
                    chain.append(pixel)
                    along.append(edge)
                along[-1] = edge
        while len(chain) > 1 and chain[0] == chain[-1]:
            chain.pop()
        result.append([(ldexp(x, spacing_exponent), ldexp(y, spacing_exponent)) for x, y in chain])
        edges += along[: len(chain)]
    return result, edges


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
