"""Area of rings with exact vertices: as a fraction, and as the nearest double without making the fraction.

Twice the area of a ring is the sum of (x_i y_j - x_j y_i) / (w_i w_j) over its edges. As one fraction the denominators
of all crossings multiply, so its length grows with their number; the nearest double is found from sums in fixed point,
whose error is below one unit per term, and the fraction is made only where those cannot settle the rounding.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np

from engine.arrangement.nodes import Homogeneous, nearest_quotient
from engine.arrays import BoolArray, FloatArray, IntArray
from engine.errors import NotRepresentableError

_PRECISIONS = (160, 640)  # bits of the largest term that are kept; the second for sums that nearly cancel


@dataclass(frozen=True, slots=True)
class ExactRings:
    """Rings of exact vertices; a coordinate is ``x / w * 2**exponent``. Clockwise rings count as negative."""

    rings: tuple[tuple[Homogeneous, ...], ...]
    exponent: int

    @property
    def n_rings(self) -> int:
        return len(self.rings)

    def exact_rings(self) -> ExactRings:
        """Return the rings themselves; those of an overlay may first have to be made."""
        return self

    def some(self, rings: Sequence[int]) -> ExactRings:
        """Return some of the rings, by their numbers."""
        return ExactRings(tuple(self.rings[ring] for ring in rings), self.exponent)

    def places(self) -> list[list[tuple[Fraction, Fraction]]]:
        """Return the coordinates of each ring's vertices."""
        up, down = max(self.exponent, 0), max(-self.exponent, 0)
        return [
            [(Fraction(x << up, w << down), Fraction(y << up, w << down)) for x, y, w in ring] for ring in self.rings
        ]

    def _terms(self) -> list[tuple[int, int]]:
        """Return numerators and denominators that add up to twice the area in units of ``4**exponent``."""
        whole = 0
        rest: list[tuple[int, int]] = []
        for ring in self.rings:
            for (ax, ay, aw), (bx, by, bw) in zip(ring, ring[1:] + ring[:1]):
                numerator, denominator = ax * by - bx * ay, aw * bw
                if denominator == 1:
                    whole += numerator
                else:
                    rest.append((numerator, denominator))
        return [(whole, 1), *rest]

    def area(self) -> Fraction:
        """Return the exact area; its length grows with the number of crossings."""
        numerator, denominator = _sum(self._terms())
        return Fraction(numerator, 2 * denominator) * Fraction(4) ** self.exponent

    def nearest_areas(self, groups: IntArray) -> FloatArray:
        """Return (n,) float64, the doubles nearest to the areas of the rings groups[k] .. groups[k + 1] - 1."""
        return np.array([self.some(range(a, b)).nearest_area() for a, b in pairwise(groups.tolist())], np.float64)

    def nearest_area(self) -> float:
        """Return the double nearest to the exact area. Raises `NotRepresentableError` beyond the largest double."""
        terms = self._terms()
        for low, high, shift in _bounds(terms):
            with suppress(NotRepresentableError):  # case: a bound is beyond the doubles, and the area may be none
                ends = {_nearest(end, 1, 2 * self.exponent - 1 - shift) for end in (low, high)}
                if len(ends) == 1:
                    return ends.pop()
        return _nearest(*_sum(terms), 2 * self.exponent - 1)

    def are_shells(self) -> BoolArray:
        """Tell of each ring whether its exact area is positive, also where that is no double."""
        return np.array([_is_positive(self.some([ring])._terms()) for ring in range(self.n_rings)], np.bool_)


def _is_positive(terms: Sequence[tuple[int, int]]) -> bool:
    for low, high, _ in _bounds(terms):
        if low > 0 or high < 0:
            return low > 0
    return _sum(terms)[0] > 0


def _bounds(terms: Sequence[tuple[int, int]]) -> Iterator[tuple[int, int, int]]:
    """Yield a lower and an upper bound of the sum of terms, times 2**shift, and that shift."""
    longest = max(abs(numerator).bit_length() - denominator.bit_length() for numerator, denominator in terms)
    for precision in _PRECISIONS:
        low = sum(_floor(numerator, denominator, precision - longest) for numerator, denominator in terms)
        yield low, low + len(terms), precision - longest


def _floor(numerator: int, denominator: int, shift: int) -> int:
    """Return floor(numerator / denominator * 2**shift)."""
    return (numerator << shift) // denominator if shift >= 0 else numerator // (denominator << -shift)


def _nearest(numerator: int, denominator: int, exponent: int) -> float:
    """Return the double nearest to numerator / denominator * 2**exponent."""
    return nearest_quotient(numerator << max(exponent, 0), denominator << max(-exponent, 0))


def _sum(terms: Iterable[tuple[int, int]]) -> tuple[int, int]:
    """Return the sum of fractions as one, not reduced; halves are added first, so that long numbers meet long ones."""
    level: Sequence[tuple[int, int]] = list(terms)
    while len(level) > 1:  # bound: each turn halves the list
        odd = level[-1:] if len(level) % 2 else []
        level = [(a * d + c * b, b * d) for (a, b), (c, d) in zip(level[0::2], level[1::2])] + list(odd)
    return level[0]
