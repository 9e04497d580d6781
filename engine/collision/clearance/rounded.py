"""The doubles nearest to a distance sqrt(q) - r and to the points at its ends, from integers: all times one scale."""

from __future__ import annotations

from fractions import Fraction
from typing import Final, NamedTuple

import numpy as np

from engine.collision.clearance.exact import Gap, Rational
from engine.collision.clearance.result import Clearance, Feature
from engine.errors import NotRepresentableError
from engine.predicates.rational import nearest, nearest_with_root

_SMALLEST: Final = 5e-324


class ScaledGap(NamedTuple):
    """A gap between bodies that have no common point, and the radii about its ends, all times `scale`."""

    gap: Gap
    radii: tuple[int, int]
    scale: int

    def clearance(self, features: tuple[Feature, Feature], dimension: int) -> Clearance:
        """Return distance, points and features, of `dimension` coordinates."""
        p, q, distance = self.gap.p, self.gap.q, self.distance()
        try:
            ends = self._toward(p, q, self.radii[0]), self._toward(q, p, self.radii[1])
        except OverflowError:
            raise NotRepresentableError(
                "a nearest point is beyond the largest double, 1.8e308; scale both bodies down by a power of two", ()
            ) from None
        points = np.array(ends)[:, :dimension]
        points.setflags(write=False)
        return Clearance(distance, points, features)

    def distance(self) -> float:
        """Return the double nearest to the distance, the smallest denormal where that would be 0.

        Times scale the distance is sqrt(top / bottom) - radii = (sqrt(top bottom) - radii bottom) / bottom.
        Raises: NotRepresentableError beyond the largest double.
        """
        top, bottom = self.gap.top, self.gap.bottom
        try:
            return nearest_with_root(-sum(self.radii) * bottom, 1, top * bottom, bottom * self.scale) or _SMALLEST
        except OverflowError:
            raise NotRepresentableError(
                "the distance is beyond the largest double, 1.8e308; scale both bodies down by a power of two", ()
            ) from None

    def is_at_least(self, least: Fraction) -> bool:
        """Tell whether the distance is so much or more: top / bottom >= (radii + least scale)^2."""
        reach = sum(self.radii) * least.denominator + least.numerator * self.scale
        return self.gap.top * least.denominator**2 >= reach * reach * self.gap.bottom

    def _toward(self, p: Rational, q: Rational, radius: int) -> list[float]:
        """Return p + radius (q - p) / |q - p|; with n, q - p times both denominators, that is radius n / sqrt(top)."""
        if not radius:
            return [nearest(x, p.denominator * self.scale) for x in p.numerators]
        n = (y * p.denominator - x * q.denominator for x, y in zip(p.numerators, q.numerators))
        top, size = self.gap.top, p.denominator * self.gap.top * self.scale
        return [nearest_with_root(x * top, radius * y * p.denominator, top, size) for x, y in zip(p.numerators, n)]
