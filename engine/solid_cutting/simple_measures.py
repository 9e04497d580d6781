"""Volume, area and centroid of boxes, balls, convex regions and polygons, from fractions: cells of the table of solids.

Source: double description of the corners of a convex region: Motzkin et al. 1953.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, Final, NamedTuple

import numpy as np

from engine.errors import EmptyGeometryError, WrongDimensionError
from engine.polygon_overlay.overlay import union_all
from engine.predicates.rational import nearest_float
from engine.running.budget import Budget
from engine.solid_cutting.exact_sums import (
    exact_centroid,
    exact_mesh,
    exact_volume,
    mesh_of_half_spaces,
    nearest_area,
    nearest_multiple_of_pi,
)
from engine.solids.polygon import Polygon
from engine.solids.primitives import Aabb, Convex, Sphere, Triangle
from engine.types import FloatArray


class Measures(NamedTuple):
    """The functions (solid, budget) -> (value, whether it took integers) of one type of solid; None: refused."""

    volume: Callable[[Any, Budget], tuple[float, bool]] | None = None
    area: Callable[[Any, Budget], tuple[float, bool]] | None = None
    centroid: Callable[[Any, Budget], tuple[FloatArray, bool]] | None = None


def sides_of(solid: Aabb) -> list[Fraction]:
    """Return the exact lengths of the sides of a box."""
    return [Fraction(b) - Fraction(a) for a, b in zip(solid.min.tolist(), solid.max.tolist())]


def product(factors: list[Fraction]) -> Fraction:
    """Return the product of two or three numbers."""
    return factors[0] * factors[1] * (factors[2] if len(factors) == 3 else 1)


def _area_of_box(solid: Aabb, _: Budget) -> tuple[float, bool]:
    sides = sides_of(solid)
    if len(sides) == 2:
        return nearest_float(product(sides)), True
    return nearest_float(2 * sum(sides[k] * sides[k - 1] for k in range(3))), True


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
        return nearest_area(mesh), True
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
        return nearest_area(mesh), True
    raise WrongDimensionError("a triangle of space has no volume, so no centroid; average its vertices", ("solid",))


BOX: Final = Measures(lambda solid, _: (nearest_float(product(sides_of(solid))), True), _area_of_box, _middle_of_box)
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
