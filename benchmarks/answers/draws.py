"""Random numbers, rotations and directions that are the same bits on every machine and with every numpy."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

T = TypeVar("T")
Array = np.ndarray[Any, Any]
Place = tuple[float, float]
"""Scale and offset of a scene."""

HOME: Place = (1.0, 0.0)
NEAR_PLACES: tuple[Place, ...] = (HOME,) * 5 + ((1 / 3, 0.0), (1.0, 1e6), (1e-3, 1e9), (2.0**-30, 0.0), (2.0**100, 0.0))
FAR_PLACES: tuple[Place, ...] = ((1e300, 0.0), (2.0**600, 1.0), (2.0**-950, 0.0), (1e-300, 0.0), (64 * 5e-324, 0.0))
"""Beyond the range of float filters or of expansions: slow, so few questions."""


class Draw:
    """The numbers of a chunk, by its name: raw bits of PCG64, which never change, and arithmetic that rounds alike."""

    def __init__(self, name: str) -> None:
        self._bits = np.random.PCG64(int.from_bytes(hashlib.sha256(name.encode()).digest()[:16], "little"))

    def unit(self, *shape: int) -> Array:
        """Return multiples of 2^-53 in [0, 1)."""
        return (self._raw(shape) >> np.uint64(11)).astype(np.float64) * 2.0**-53

    def uniform(self, low: Any, high: Any, *shape: int) -> Array:
        return low + (high - low) * self.unit(*shape)

    def whole(self, low: int, high: int, *shape: int) -> Array:
        """Return int64 from `low` to `high`, both included."""
        return low + (self._raw(shape) % np.uint64(high - low + 1)).astype(np.int64)

    def one(self, low: int, high: int) -> int:
        return int(self.whole(low, high, 1)[0])

    def chance(self, share: float) -> bool:
        return bool(self.unit(1)[0] < share)

    def pick(self, items: Sequence[T]) -> T:
        return items[self.one(0, len(items) - 1)]

    def order(self, n: int) -> Array:
        return np.argsort(self._raw((n,)), kind="stable")

    def spots(self, n: int, dimension: int) -> Array:
        """Return different positions within 4 of the origin: on a lattice, or anywhere, or both in one."""
        anywhere, lattice = self.uniform(-4.0, 4.0, n, dimension), self.whole(-4, 4, n, dimension).astype(float)
        while len(np.unique(lattice, axis=0)) < n:  # bound: n is far below 9^dimension
            lattice = self.whole(-4, 4, n, dimension).astype(float)
        way = self.one(0, 2)
        return (lattice, anywhere, np.where(self.unit(n, 1) < 0.5, lattice, anywhere))[way]

    def nudged(self, values: Array, most: int = 2) -> Array:
        """Return the numbers, each moved by some ulp or, about half of them, unchanged."""
        steps = self.whole(-most, most, *values.shape) * self.whole(0, 1, *values.shape)
        for turn in range(1, most + 1):
            values = np.where(abs(steps) >= turn, np.nextafter(values, np.where(steps > 0, np.inf, -np.inf)), values)
        return values

    def rotation(self, dimension: int) -> Array:
        """Return a rotation: of the lattice, or one of rationals, correctly rounded."""
        a, b, c, d = self.whole(-9, 9, 4).astype(float)
        a = a or 1.0
        if self.chance(0.4):
            a, b, c, d = self.pick([(1, 0, 0, 0), (1, 1, 0, 0), (1, 0, 0, 1), (1, 1, 1, 1), (0, 0, 1, 0), (0, 0, 0, 1)])
        if dimension == 2:
            a = a or float(d == 0)
            return np.array([[a * a - d * d, -2 * a * d], [2 * a * d, a * a - d * d]]) / (a * a + d * d)
        n = a * a + b * b + c * c + d * d
        rows = [[a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
                [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
                [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d]]  # fmt: skip
        return np.array(rows) / n

    def _raw(self, shape: tuple[int, ...]) -> Array:
        return self._bits.random_raw(int(np.prod(shape))).reshape(shape)


def around(turns: Array) -> Array:
    """Return points (n, 2) of the unit circle at so many quarter turns, without sine and cosine."""
    quarter = np.floor(turns)
    t = turns - quarter
    x, y = (1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t)
    way = quarter.astype(np.int64) % 4
    return np.stack([np.choose(way, [x, -y, -x, y]), np.choose(way, [y, x, -y, -x])], axis=1)


def put(points: Array, place: Place) -> Array:
    """Return points scaled and moved."""
    return points * place[0] + place[1]


def turned(points: Array, rotation: Array) -> Array:
    """Return the rounded images of points (..., d), summed in a fixed order."""
    image = points[..., :1] * rotation[:, 0]
    for axis in range(1, points.shape[-1]):
        image = image + points[..., axis : axis + 1] * rotation[:, axis]
    return image
