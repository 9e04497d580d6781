"""Classical snap rounding: every vertex to a lattice point, every edge through the hot pixels that it passes.

A pixel is the half-open square of one lattice spacing about a lattice point; it is hot if a vertex lies in it. An edge
is replaced by the chain of centres of the hot pixels it passes, in that order. Edges that met in vertices only then
meet in vertices only again (or coincide), and no edge moves by more than half a pixel's diagonal. So the result needs
no further rounding, which the finer way (round, arrange again, round, ...) cannot promise.

Source: J. D. Hobby, Practical segment intersection with finite precision output, 1999; L. J. Guibas and D. H. Marimont,
Rounding arrangements dynamically, 1998.
"""

from __future__ import annotations

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
    low, high = Fraction(0), Fraction(1)
    low_open = high_open = False
    for a, b, centre in zip(start, end, pixel):
        near, far = centre - _HALF, centre + _HALF  # near <= value < far
        if a == b:
            if not near <= a < far:
                return None
            continue
        enters, leaves = (near - a) / (b - a), (far - a) / (b - a)
        enters_open, leaves_open = False, True
        if b < a:
            enters, leaves, enters_open, leaves_open = leaves, enters, True, False
        if enters > low or (enters == low and enters_open):
            low, low_open = enters, enters_open
        if leaves < high or (leaves == high and leaves_open):
            high, high_open = leaves, leaves_open
    if low < high or (low == high and not low_open and not high_open):
        return low, high
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
    hot = sorted({(floor(x + _HALF), floor(y + _HALF)) for ring in scaled for x, y in ring})
    centres = np.array(hot, np.float64).reshape(-1, 2)
    result = []
    for ring in scaled:
        chain: list[Pixel] = []
        for start, end in zip(ring, [*ring[1:], *ring[:1]]):
            budget.check()
            passed = []
            for number in _candidates(centres, start, end):
                through = _passage(start, end, hot[number])
                if through is not None:
                    passed.append((*through, hot[number]))
            for *_, pixel in sorted(passed):
                if not chain or chain[-1] != pixel:
                    chain.append(pixel)
        while len(chain) > 1 and chain[0] == chain[-1]:
            chain.pop()
        result.append([(ldexp(x, spacing_exponent), ldexp(y, spacing_exponent)) for x, y in chain])
    return result


def _candidates(centres: np.ndarray, start: Point, end: Point) -> list[int]:
    """Return the pixels that the segment may pass: those near its box and near its line, generously."""
    a, b = np.array(start, np.float64), np.array(end, np.float64)
    # bound: below 2**53 the rounded ends are off by at most 1/2, so differences by at most 1 1/2.
    near = np.flatnonzero(((centres >= np.minimum(a, b) - 2) & (centres <= np.maximum(a, b) + 2)).all(axis=1))
    along, offset = b - a, centres[near] - a
    distance = np.abs(along[0] * offset[:, 1] - along[1] * offset[:, 0])
    reach = 4 * (np.abs(along).sum() + np.abs(offset).sum(axis=1) + 1) * (1 + 2.0**-40)
    # rounding of the two products: 2**-50 of their size is more than enough.
    reach += 2.0**-50 * (np.abs(along[0] * offset[:, 1]) + np.abs(along[1] * offset[:, 0]))
    return near[distance <= reach].tolist()
