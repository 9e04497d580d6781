"""Volumes, areas and centroids of meshes of points, each the double nearest to the exact value for the input.

Faces of given vertices are summed by the kernels. Corners that are cut points are rational, with denominators of their
own, so a sum of them as one fraction would grow with their number: they are rounded to a number of bits, in integers,
each off by less than one unit. With M the largest coordinate and L the largest difference of two, in units:

    m (a.z + b.z + c.z)     m off by 16 (M + 1), the sum by 6:            120 (M + 1)^2 a face
    |(b - a) x (c - a)|     differences off by 2, products by 4 L + 4:    16 L + 16    a face
    p x q, seen along z     2 products of 2 numbers:                      4 (M + 1)    a side

Both ends of what the total may be must round alike; else there are more bits, and at last exact fractions.

Source: the divergence theorem; interval arithmetic: Moore, Interval Analysis, 1966.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from math import isqrt
from typing import Any, Final

import numpy as np

from engine.compiling.jit import entry_of
from engine.errors import NotRepresentableError
from engine.predicates.rational import cross, minus, nearest_float, squared_length
from engine.running.budget import Budget, polled
from engine.solid_cutting.caps import Area, Seen
from engine.solid_cutting.exact_measures import (
    ExactMesh,
    area_in_roots,
    exact_centroid,
    exact_faces,
    exact_mesh,
    exact_volume,
    nearest_root_over,
)
from engine.solid_cutting.plane_cut import Plane, Points
from engine.solid_cutting.sums import LOST_TO_ROOTS, bound_of, sum_area, sum_moments, sum_volume
from engine.solids.ragged import ascending
from engine.types import FloatArray, IntArray, read_only

_BITS: Final = (80, 128, 512, 2048)
"""Bits of a coordinate that are tried: to the first, points are known without their fractions (`plane_cut.py`)."""
Whole = tuple[int, int, int]


def _cut_off(points: Points, numbers: Iterable[int], bits: int) -> tuple[dict[int, Whole], int, int]:
    """Return (places, k, most): the coordinates of some points, by number, truncated to integers in units of 2^-k; k,
    such that the largest have about `bits` bits; and a bound on their magnitudes."""
    k, numbers = bits - int(np.frexp(points.size)[1]), list(numbers)
    places: dict[int, Whole] = {}
    if bits == _BITS[0] and points.is_in_range:  # points are known to 1 / 8 of a unit
        high, low = (np.ldexp(some, k) for some in points.at(np.array(numbers, np.int64)))
        whole = np.rint(high)
        rest = np.rint((high - whole) + low)
        for number, large, small in polled(zip(numbers, whole.tolist(), rest.tolist())):
            x, y, z = (int(a) + int(b) for a, b in zip(large, small))
            places[number] = x, y, z
        numbers = []
    for number in polled(numbers):
        x, y, z, w = points.exact(number)
        w, up = (w, k) if k >= 0 else (w << -k, 0)
        places[number] = ((x << up) // w, (y << up) // w, (z << up) // w)
    return places, k, max((abs(x) for place in places.values() for x in place), default=0) + 1


Ends = Callable[[int], tuple[Fraction, Fraction]]
"""What a value is between, by the number of bits that are spent on it."""


def narrowed(ends_of: Callable[[int], Any], rounded: Callable[[Any], float] = nearest_float) -> float | None:
    """Return the double to which both ends of an enclosure round, once enough bits are spent; None beyond `MOST_BITS`.
    ends_of(bits): the enclosure; rounded: rounds one end."""
    for bits in _BITS:
        try:
            low, high = map(rounded, ends_of(bits))
            if low == high:
                return low
        except NotRepresentableError:  # an end may be beyond the doubles where the value is not
            pass
    return None


def _parted(points: Points, triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Return the triangles whose corners are all vertices of the solid, which kernels can sum up, and the others."""
    if points.is_in_range and len(points) == points.n_given:
        return read_only(triangles), triangles[:0]
    is_new = (triangles >= points.n_given).any(axis=1) if points.is_in_range else np.ones(len(triangles), np.bool_)
    return read_only(triangles[~is_new]), triangles[is_new]


def nearest_volume(
    points: Points, triangles: IntArray, budget: Budget, factor: Fraction = Fraction(1)
) -> tuple[float, bool]:
    """Return the double nearest to factor times the volume within a closed mesh of points, whose faces look outward,
    and whether fractions decided."""
    value = narrowed(volume_between(points, triangles, budget, factor))
    return (nearest_float(factor * volume_in_fractions(points, triangles)), True) if value is None else (value, False)


def volume_between(points: Points, triangles: IntArray, budget: Budget, factor: Fraction) -> Ends:
    """Return the enclosure of factor times the volume of a closed mesh, as a function of the bits spent on it."""
    given, others = _parted(points, triangles)
    z0 = float(points.vertices[given[0, 0], 2]) if len(given) else 0.0
    sums = np.zeros((1, 3))
    with np.errstate(all="ignore"):
        entry_of(sum_volume)(points.vertices, given, z0, sums, budget.flag)
    budget.check()
    known, off = Fraction(sums[0, 0]) + Fraction(sums[0, 1]), Fraction(bound_of(float(sums[0, 2]), len(given)))
    rows = others.tolist()

    def ends_of(bits: int) -> tuple[Fraction, Fraction]:
        places, k, most = _cut_off(points, ascending(others).tolist(), bits)
        base = Fraction(z0) * Fraction(2) ** k
        z_unit, z_rest = base.numerator // base.denominator, base.denominator
        total = 0
        for i, j, m in polled(rows):
            a, b, c = places[i], places[j], places[m]
            minor = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            total += minor * ((a[2] + b[2] + c[2]) - 3 * z_unit)
        budget.check()
        slack = len(rows) * (120 * (most + abs(z_unit) + 1) ** 2 + (12 * (most + 1) ** 2 if z_rest > 1 else 0))
        unit = Fraction(1, 6) / Fraction(2) ** (3 * k)
        middle, width = known / 6 + total * unit, off / 6 + slack * unit
        return factor * (middle - width), factor * (middle + width)

    return ends_of


def volume_in_fractions(points: Points, triangles: IntArray) -> Fraction:
    """Return the exact volume within a closed mesh of points, whose faces look outward."""
    return exact_volume(_as_fractions(points, triangles)) if len(triangles) else Fraction(0)


def nearest_centroid(points: Points, triangles: IntArray, budget: Budget) -> tuple[FloatArray, bool]:
    """Return the doubles nearest to the centroid of what a closed mesh of points encloses, and whether fractions
    decided. Raises: EmptyGeometryError."""
    given, others = _parted(points, triangles)
    low, high = volume_between(points, triangles, budget, Fraction(1))(_BITS[0]) if len(given) else (0, 0)
    if low > 0 and not len(others):
        sums, origin = np.zeros((3, 3)), read_only(points.vertices[given[0, 0]].copy())
        with np.errstate(all="ignore"):
            entry_of(sum_moments)(points.vertices, given, origin, sums, budget.flag)
        budget.check()
        made: list[float | None] = []
        for k, factor in enumerate((24, 24, 48)):
            moment, off = Fraction(sums[k, 0]) + Fraction(sums[k, 1]), Fraction(bound_of(float(sums[k, 2]), len(given)))
            at = Fraction(float(origin[k]))
            ends = [[at + (moment + way * off) / (factor * v) for v in (low, high)] for way in (-1, 1)]
            made.append(narrowed(lambda _, ends=ends: (min(ends[0]), max(ends[1]))))  # type: ignore[misc]
        if None not in made:
            return np.array(made), False
    return np.array([nearest_float(x) for x in exact_centroid(_as_fractions(points, triangles))]), True


def _as_fractions(points: Points, triangles: IntArray) -> ExactMesh:
    if len(points) == points.n_given:
        return exact_faces(points.vertices, triangles)
    used, local = np.unique(triangles, return_inverse=True)
    places = [points.exact(number) for number in used.tolist()]
    return exact_mesh([[Fraction(x, p[3]) for x in p[:3]] for p in places], map(tuple, local.reshape(-1, 3).tolist()))


def nearest_area(points: Points, triangles: IntArray, budget: Budget) -> tuple[float, bool]:
    """Return the double nearest to the area of triangles of points, and whether fractions decided."""
    given, others = _parted(points, triangles)
    sums = np.zeros((1, 3))
    with np.errstate(all="ignore"):
        entry_of(sum_area)(points.vertices, given, sums, budget.flag)
    budget.check()
    n = len(given)
    known = Fraction(sums[0, 0]) + Fraction(sums[0, 1])
    off = Fraction(bound_of(float(sums[0, 2]), n) + n * LOST_TO_ROOTS)
    rows = others.tolist()

    def ends_of(bits: int) -> tuple[Fraction, Fraction]:
        places, k, most = _cut_off(points, ascending(others).tolist(), bits)
        total = 0
        for i, j, m in polled(rows):
            a = places[i]
            total += isqrt(squared_length(cross(minus(places[j], a), minus(places[m], a))))
        budget.check()
        slack = len(rows) * (32 * most + 33)
        unit = Fraction(1, 2) / Fraction(2) ** (2 * k)
        middle, width = known / 2 + total * unit, off / 2 + slack * unit
        return middle - width, middle + width

    value = narrowed(ends_of)
    return (area_in_roots(_as_fractions(points, triangles)), True) if value is None else (value, False)


def area_of_section(view: Seen, plane: Plane, area: Area, budget: Budget) -> float:
    """Return the area of a polygon of a plane, in the plane."""
    rings = [area.shell, *area.holes]
    a, b = view.axes
    normal = plane.integers[:3]
    tilt = Fraction(squared_length(normal), normal[3 - a - b] ** 2)

    def rounded(seen_area: Fraction) -> float:
        square = max(seen_area, Fraction(0)) ** 2 * tilt
        return nearest_root_over(1, square.numerator * square.denominator, square.denominator)

    def ends_of(bits: int) -> tuple[Fraction, Fraction]:
        places, k, most = _cut_off(view.points, (number for ring in rings for number in ring), bits)
        total, n = 0, 0
        for ring in rings:
            corners = [places[number] for number in ring]
            total += sum(p[a] * q[b] - p[b] * q[a] for p, q in zip(corners, corners[1:] + corners[:1]))
            n += len(ring)
        budget.check()
        unit = Fraction(1, 2) / Fraction(2) ** (2 * k)
        return (total - 4 * n * (most + 1)) * unit, (total + 4 * n * (most + 1)) * unit

    value = narrowed(ends_of, rounded)
    if value is None:
        corners = [[view.exact(number) for number in ring] for ring in rings]
        value = rounded(
            sum((p[0] * q[1] - p[1] * q[0] for c in corners for p, q in zip(c, c[1:] + c[:1])), Fraction(0)) / 2
        )
    return value
