"""Volume, area and centroid in integers: the definition, the exact fallback of the kernels, and cells of the table of
solids for boxes, balls, convex regions and polygons.

A sum of square roots of integers is irrational unless every one of them is whole (square roots of different square-free
integers are independent over the rationals, and here none is subtracted), so it is never in the middle of two doubles
then: enough digits decide. The same holds for multiples of pi.

Source: A. S. Besicovitch, On the linear independence of fractional powers of integers, 1940; J. Machin's formula, 1706;
double description of the corners of a convex region: Motzkin et al. 1953.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from functools import cmp_to_key
from itertools import pairwise
from math import isqrt, lcm, prod
from typing import Any, Final, NamedTuple

import numpy as np

from engine.bounding.double_description import corners_of_half_spaces
from engine.errors import EmptyGeometryError, NotRepresentableError, UnsupportedSolidError, WrongDimensionError
from engine.polygon_overlay.overlay import union_all
from engine.predicates.rational import (
    Number,
    cross,
    dot,
    largest_axis,
    minus,
    nearest_float,
    nearest_with_root,
    scaled_integers,
    sign_of,
    squared_length,
)
from engine.running.budget import Budget, polled
from engine.solids.polygon import Polygon
from engine.solids.primitives import Aabb, Convex, Sphere, Triangle
from engine.types import FloatArray, IntArray

Point = tuple[int, ...]
Triple = tuple[int, int, int]


class ExactMesh(NamedTuple):
    """A closed mesh in integers: points over a common denominator `w`, triangles counter-clockwise seen from outside;
    in the plane, edges."""

    points: list[Point]
    w: int
    faces: list[tuple[int, ...]]


def exact_mesh(points: Sequence[Sequence[Number]], faces: Iterable[tuple[int, ...]]) -> ExactMesh:
    """Return a mesh with its coordinates as integers."""
    size = len(points[0]) if points else 3
    ratios = [x.as_integer_ratio() for point in polled(list(points)) for x in point]
    w = lcm(*{bottom for _, bottom in ratios})
    numbers = [top * (w // bottom) for top, bottom in polled(ratios)]
    return ExactMesh([tuple(numbers[k : k + size]) for k in range(0, len(numbers), size)], w, list(faces))


def exact_volume(mesh: ExactMesh) -> Fraction:
    """Return the volume of a mesh, or the area of a ring, whose faces look outwards."""
    points, total = mesh.points, 0
    if points and len(points[0]) == 2:
        total = sum(points[i][0] * points[j][1] - points[j][0] * points[i][1] for i, j in polled(mesh.faces))
        return Fraction(total, 2 * mesh.w**2)
    total = sum(dot(points[i], cross(points[j], points[k])) for i, j, k in polled(mesh.faces))
    return Fraction(total, 6 * mesh.w**3)


def exact_centroid(mesh: ExactMesh) -> list[Fraction]:
    """Return the centroid of what a mesh, or a ring, encloses. Raises: EmptyGeometryError if it has no volume."""
    points, volume = mesh.points, 0
    size = len(points[0]) if points else 3
    sums = [0] * size
    for face in polled(mesh.faces):
        corners = [points[k] for k in face]
        part = dot(corners[0], cross(*corners[1:])) if size == 3 else _cross(*corners)
        volume += part
        for k in range(size):
            sums[k] += part * sum(corner[k] for corner in corners)
    if volume == 0:
        raise EmptyGeometryError("a solid without volume has no centroid; average its vertices", ("solid",))
    return [Fraction(total, (size + 1) * volume * mesh.w) for total in sums]


def _cross(u: Sequence[int], v: Sequence[int]) -> int:
    return u[0] * v[1] - u[1] * v[0]


def area_in_roots(mesh: ExactMesh) -> float:
    """Return the double nearest to the area of the triangles of a mesh of space."""
    squares = []
    for i, j, k in polled(mesh.faces):
        a, b, c = mesh.points[i], mesh.points[j], mesh.points[k]
        squares.append(squared_length(cross(minus(b, a), minus(c, a))))
    return nearest_sum_of_roots(squares, Fraction(1, 2 * mesh.w**2))


def nearest_sum_of_roots(squares: Sequence[int], factor: Fraction) -> float:
    """Return the double nearest to factor times the sum of the square roots of integers."""
    if all(isqrt(square) ** 2 == square for square in polled(list(squares))):
        return nearest_float(factor * sum(map(isqrt, squares)))
    bits = 64
    while True:  # bound: the sum is irrational, see the head of this file
        bits *= 2
        low = sum(isqrt(square << 2 * bits) for square in polled(list(squares)))
        ends = [nearest_float(factor * Fraction(total, 1 << bits)) for total in (low, low + len(squares))]
        if ends[0] == ends[1]:
            return ends[0]


def nearest_root_over(v: int, w: int, z: int) -> float:
    """Return the double nearest to v sqrt(w) / z, for w, z > 0. Raises: NotRepresentableError beyond the largest."""
    try:
        return nearest_with_root(0, v, w, z)
    except OverflowError:
        raise NotRepresentableError("a length or area is beyond the largest float64; scale the input down") from None


def nearest_multiple_of_pi(factor: Fraction) -> float:
    """Return the double nearest to factor times pi, factor >= 0 exact."""
    bits = 64
    while factor:  # bound: pi is irrational
        bits *= 2
        one = 1 << bits
        pi = 16 * _arctangent(5, one) - 4 * _arctangent(239, one)
        slack = 40 * bits
        ends = [nearest_float(factor * Fraction(pi + off, one)) for off in (-slack, slack)]
        if ends[0] == ends[1]:
            return ends[0]
    return 0.0


def _arctangent(inverse: int, one: int) -> int:
    """Return arctan(1 / inverse) in units of 1 / one, each term rounded down."""
    power, total, n = one // inverse, 0, 1
    while power:  # bound: it falls to 0
        total += power // n if n % 4 == 1 else -(power // n)
        power //= inverse * inverse
        n += 2
    return total


def mesh_of_half_spaces(rows: Sequence[Sequence[Number]], budget: Budget) -> ExactMesh | None:
    """Return the boundary of an intersection of half-spaces, None if it has no interior. rows: normal and offset, exact
    numbers. Raises: UnsupportedSolidError if it is unbounded."""
    made = faces_of_half_spaces(rows, budget)
    return None if made is None else made[0]._replace(faces=[face for some in made[1] for face in some])


def faces_of_half_spaces(
    rows: Sequence[Sequence[Number]], budget: Budget
) -> tuple[ExactMesh, list[list[tuple[int, ...]]]] | None:
    """Return the corners of an intersection of half-spaces, and of each face the triangles around its first corner, as
    `mesh_of_half_spaces` does."""
    integers = [scaled_integers(row) for row in rows]
    corners = corners_of_half_spaces(integers, budget)
    if not corners.is_bounded:
        more = "this region reaches to infinity, so it has no volume; add the planes that close it"
        raise UnsupportedSolidError(more, ("solid", "planes"))
    size = len(integers[0]) - 1
    if len(corners.points) <= size:
        return None
    mesh = exact_mesh(corners.points, [])
    faces: dict[frozenset[int], list[tuple[int, ...]]] = {}
    for *normal, offset in integers:
        budget.check()
        values = [dot(tuple(normal), point) + offset * mesh.w for point in mesh.points]
        on = [k for k, value in enumerate(values) if value == 0]
        if len(on) == len(mesh.points):
            return None
        if len(on) >= size and frozenset(on) not in faces:
            faces[frozenset(on)] = _around(mesh.points, on, normal)
    return mesh, list(faces.values())


def _around(points: list[Point], on: list[int], normal: list[int]) -> list[tuple[int, ...]]:
    """Return the triangles of a face of a convex body, whose corners are `on` and whose inner normal is given; in the
    plane its edge."""
    first, *others = on
    if len(normal) == 2:
        run = _cross(minus(points[others[0]], points[first]), normal)
        return [(first, others[0])] if run > 0 else [(others[0], first)]
    axis = largest_axis(tuple(normal))

    def compare(i: int, j: int) -> int:
        turn = cross(minus(points[i], points[first]), minus(points[j], points[first]))[axis] * normal[axis]
        return sign_of(turn)

    ring = sorted(others, key=cmp_to_key(compare))
    return [(first, i, j) for i, j in pairwise(ring)]


class Measures(NamedTuple):
    """The functions (solid, budget) -> (value, whether it took integers) of one type of solid; None: refused."""

    volume: Callable[[Any, Budget], tuple[float, bool]] | None = None
    area: Callable[[Any, Budget], tuple[float, bool]] | None = None
    centroid: Callable[[Any, Budget], tuple[FloatArray, bool]] | None = None


def exact_faces(vertices: FloatArray, faces: IntArray) -> ExactMesh:
    """Return triangles (m, 3) of vertices (n, 3) in integers."""
    used, flat = np.unique(faces, return_inverse=True)
    return exact_mesh(vertices[used].tolist(), map(tuple, flat.reshape(-1, 3).tolist()))


def sides_of(*boxes: Aabb) -> tuple[list[int], int]:
    """Return the lengths of the sides of what boxes have in common, at least 0, times a number, and that number."""
    k = boxes[0].dimension
    *numbers, w = scaled_integers([*(x for box in boxes for end in (box.min, box.max) for x in end.tolist()), 1])
    ends = [numbers[first : first + k] for first in range(0, len(numbers), k)]
    return [max(0, min(high) - max(low)) for low, high in zip(zip(*ends[::2]), zip(*ends[1::2]))], w


def volume_of_boxes(*boxes: Aabb) -> Fraction:
    """Return the exact volume, in the plane the area, of what boxes have in common."""
    sides, w = sides_of(*boxes)
    return Fraction(prod(sides), w ** len(sides))


def _area_of_box(solid: Aabb, _: Budget) -> tuple[float, bool]:
    sides, w = sides_of(solid)
    total = prod(sides) if len(sides) == 2 else 2 * sum(sides[k] * sides[k - 1] for k in range(3))
    return nearest_float(Fraction(total, w * w)), True


def _middle_of_box(solid: Aabb, _: Budget) -> tuple[FloatArray, bool]:
    ends = zip(solid.min.tolist(), solid.max.tolist())
    return np.array([nearest_float((Fraction(a) + Fraction(b)) / 2) for a, b in ends]), True


def _of_ball(solid: Sphere, power: int, factor: Fraction) -> tuple[float, bool]:
    return nearest_multiple_of_pi(factor * Fraction(solid.radius) ** power), True


def _of_convex(solid: Convex, budget: Budget, what: str) -> tuple[Any, bool]:
    mesh = solid.prepared("exact_mesh", lambda: mesh_of_half_spaces(solid.planes.tolist(), budget), budget.check)
    if what == "centroid":
        if mesh is None:
            raise EmptyGeometryError("a solid without volume has no centroid; average its vertices", ("solid",))
        return np.array([nearest_float(x) for x in exact_centroid(mesh)]), True
    if mesh is None:
        return 0.0, True
    if what == "area" and solid.dimension == 3:
        return area_in_roots(mesh), True
    return nearest_float(exact_volume(mesh)), True


def _area_of_rings(solid: Polygon, budget: Budget) -> tuple[float, bool]:
    rings = union_all([solid], deadline=budget.left(), cancel=budget.cancel)
    return rings.area, False


def _centroid_of_rings(solid: Polygon, budget: Budget) -> tuple[FloatArray, bool]:
    exact = union_all([solid], deadline=budget.left(), cancel=budget.cancel).exact
    points: list[tuple[Fraction, ...]] = []
    edges: list[tuple[int, ...]] = []
    for ring in exact.exact_rings().places():
        first = len(points)
        points += ring
        edges += [(k, k + 1 if k + 1 < len(points) else first) for k in range(first, len(points))]
    if not points:
        raise EmptyGeometryError("a polygon without area has no centroid; average its vertices", ("solid",))
    return np.array([nearest_float(x) for x in exact_centroid(exact_mesh(points, edges))]), True


def _as_polygon(solid: Triangle, what: str, budget: Budget) -> tuple[Any, bool]:
    if solid.dimension == 2:
        rings = Polygon([solid.vertices])
        return (_area_of_rings if what == "area" else _centroid_of_rings)(rings, budget)
    mesh = exact_mesh(solid.vertices.tolist(), [(0, 1, 2)])
    if what == "area":
        return area_in_roots(mesh), True
    raise WrongDimensionError("a triangle of space has no volume, so no centroid; average its vertices", ("solid",))


BOX: Final = Measures(lambda solid, _: (nearest_float(volume_of_boxes(solid)), True), _area_of_box, _middle_of_box)
BALL: Final = Measures(
    lambda solid, _: _of_ball(solid, 3, Fraction(4, 3)),
    lambda solid, _: _of_ball(solid, 2, Fraction(4)) if solid.dimension == 3 else _of_ball(solid, 2, Fraction(1)),
    lambda solid, _: (solid.center.copy(), False),
)
CONVEX: Final = Measures(
    lambda solid, budget: _of_convex(solid, budget, "volume"),
    lambda solid, budget: _of_convex(solid, budget, "area"),
    lambda solid, budget: _of_convex(solid, budget, "centroid"),
)
RINGS: Final = Measures(area=_area_of_rings, centroid=_centroid_of_rings)
TRIANGLE: Final = Measures(
    area=lambda solid, budget: _as_polygon(solid, "area", budget),
    centroid=lambda solid, budget: _as_polygon(solid, "centroid", budget),
)
"""Cells of the table of solids (`engine/registry.py`)."""
