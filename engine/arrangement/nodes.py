"""Exact points of the plane as integers, without duplicates.

A point is three integers (x, y, w) with w > 0 and gcd 1: it stands for (x / w, y / w) times a power of two common to
all points of a table. Every finite float64 is an integer times a power of two, so points given as floats have w = 1; a
crossing of two segments has w > 1. Equal points are equal tuples, so a dict unites them, and no exponent is out of
range: 1e300 and a denormal together make long integers, not wrong ones.

Each point also has the doubles nearest to its coordinates. Rounding to nearest is monotone, so a strict order of these
doubles is the order of the exact values, and boxes of them are conservative; integers decide ties.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from math import gcd, hypot, inf, lcm, nextafter

from engine.errors import NotRepresentableError
from engine.running.budget import Budget
from engine.types import FloatArray

Homogeneous = tuple[int, int, int]
"""(x, y, w) with w > 0 and gcd 1: the point (x / w, y / w)."""

_POLL = 1024  # points, a microsecond each, between two polls


def nearest_quotient(numerator: int, denominator: int) -> float:
    """Return the double nearest to ``numerator / denominator``, ties to even, zero as +0.0.

    CPython divides integers with one correct rounding, subnormal results included.
    Raises: `NotRepresentableError` where the quotient rounds beyond the largest double.
    """
    try:
        return numerator / denominator + 0.0
    except OverflowError:
        raise NotRepresentableError(
            f"the exact value is about 2**{numerator.bit_length() - denominator.bit_length()}, beyond the largest "
            "float64; scale the input down"
        ) from None


def reduced(x: int, y: int, w: int) -> Homogeneous:
    """Return (x, y, w), w not 0, divided by the common factor, with w > 0."""
    divisor = gcd(x, y, w)
    if w < 0:
        divisor = -divisor
    return x // divisor, y // divisor, w // divisor


class NodeTable:
    """Exact points without duplicates, numbered in the order in which they were added. points[i]: the point as
    `Homogeneous`. xs[i], ys[i]: the doubles nearest to its coordinates. exponent: a coordinate is ``x / w *
    2**exponent``."""

    __slots__ = ("_down", "_index", "_n_floats", "_up", "exponent", "points", "xs", "ys")

    def __init__(self, exponent: int) -> None:
        self.exponent = exponent
        self.points: list[Homogeneous] = []
        self.xs: list[float] = []
        self.ys: list[float] = []
        self._n_floats = 0  # invariant: the points before this number were given as floats
        self._index: dict[Homogeneous, int] = {}
        self._up, self._down = max(exponent, 0), max(-exponent, 0)

    def add(self, point: Homogeneous) -> int:
        """Return the number of `point`, which must be `reduced` and in units of 2**exponent; it is appended if it is
        new."""
        number = self._index.get(point)
        if number is None:
            x, y, w = point
            w <<= self._down
            number = self._new(point, nearest_quotient(x << self._up, w), nearest_quotient(y << self._up, w))
        return number

    def add_float(self, point: Homogeneous, x: float, y: float) -> int:
        """Return the number of `point` as `add` does; x, y: its coordinates, which are doubles."""
        number = self._index.get(point)
        if number is None:
            is_first = self._n_floats == len(self.points)
            number = self._new(point, x + 0.0, y + 0.0)
            self._n_floats += is_first
        return number

    @property
    def all_floats(self) -> bool:
        """Whether all points were added by `add_float`."""
        return self._n_floats == len(self.points)

    def _new(self, point: Homogeneous, x: float, y: float) -> int:
        number = self._index[point] = len(self.points)
        self.points.append(point)
        self.xs.append(x)
        self.ys.append(y)
        return number

    def compare(self, first: int, second: int) -> int:
        """Return -1, 0 or 1 as point `first` is lexicographically (x, then y) less than, equal to or greater than
        `second`."""
        a, b = self.xs[first], self.xs[second]
        if a != b:
            return -1 if a < b else 1
        p, q = self.points[first], self.points[second]
        c, d = p[0] * q[2], q[0] * p[2]
        if c == d:
            c, d = p[1] * q[2], q[1] * p[2]
        return (c > d) - (c < d)

    def exact(self, number: int) -> tuple[Fraction, Fraction]:
        """Return the coordinates of point `number` as fractions."""
        x, y, w = self.points[number]
        return Fraction(x << self._up, w << self._down), Fraction(y << self._up, w << self._down)

    def displacement(self, number: int) -> float:
        """Return the distance between point `number` and its rounded coordinates, rounded up; 0.0 if they are equal."""
        if number < self._n_floats:
            return 0.0
        x, y, w = self.points[number]
        w <<= self._down
        errors = []
        for value, double in ((x << self._up, self.xs[number]), (y << self._up, self.ys[number])):
            numerator, denominator = double.as_integer_ratio()
            errors.append((abs(value * denominator - numerator * w), w * denominator))
        if errors[0][0] == errors[1][0] == 0:
            return 0.0
        # Two quotients and hypot are each off by less than one unit in the last place.
        distance = hypot(*(nearest_quotient(*error) for error in errors))
        return nextafter(nextafter(nextafter(distance, inf), inf), inf)


def float_nodes(coordinates: FloatArray, budget: Budget | None = None) -> tuple[NodeTable, list[int]]:
    """Return a table of the distinct rows of `coordinates`, (n, 2) float64, finite, and the index of each row in it."""
    doubles = [value for row in coordinates.tolist() for value in row]
    ratios = [value.as_integer_ratio() for value in doubles]
    # Denominators are powers of two: the largest is common to all.
    denominator = max((ratio[1] for ratio in ratios), default=1)
    integers = [ratio[0] * (denominator // ratio[1]) for ratio in ratios]
    every_bit = 0
    for value in integers:
        every_bit |= abs(value)
    shift = max((every_bit & -every_bit).bit_length() - 1, 0)
    nodes = NodeTable(shift - denominator.bit_length() + 1)
    numbers = []
    for k in range(0, len(doubles), 2):
        if budget is not None and k % _POLL == 0:
            budget.check()
        point = (integers[k] >> shift, integers[k + 1] >> shift, 1)
        numbers.append(nodes.add_float(point, doubles[k], doubles[k + 1]))
    return nodes, numbers


Rational = int | float | Fraction


def rational_nodes(
    coordinates: Iterable[Sequence[Rational]], budget: Budget | None = None
) -> tuple[NodeTable, list[int]]:
    """Return a table of the distinct points (x, y) of ints, floats or fractions, and the index of each input point in
    it."""
    nodes, numbers = NodeTable(0), []
    for k, (x, y) in enumerate(coordinates):
        if budget is not None and k % _POLL == 0:
            budget.check()
        (p, q), (r, s) = Fraction(x).as_integer_ratio(), Fraction(y).as_integer_ratio()
        w = lcm(q, s)
        numbers.append(nodes.add(reduced(p * (w // q), r * (w // s), w)))
    return nodes, numbers
