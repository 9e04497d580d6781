"""The rings of all polygons of a call as flat arrays: arrays, polygons, lists of rings, or GeoJSON."""

from __future__ import annotations

import functools
from math import isfinite, sqrt
from typing import Any, Final, NamedTuple

import numpy as np

from engine.errors import EmptyGeometryError, InvalidArrayError
from engine.predicates.rational import largest_of
from engine.running.budget import UNLIMITED, Budget, polled
from engine.running.parallel import run_chunks
from engine.solids.checks import as_point_groups, as_points, check_dimension, check_finite
from engine.solids.geometries import geometry_of
from engine.solids.polygon import Polygon
from engine.solids.ragged import summed
from engine.solids.shapes import as_solid, as_solids
from engine.types import FloatArray, IntArray, read_only

FEW: Final = 3072
"""Number of coordinates that are clipped faster than a batch is planned."""
USUAL: Final = (2.0**-100, 2.0**120)
"""Range of the sum of squares of few coordinates, from which the largest follows, in which nothing is scaled.
`numpy.vdot` does not warn on overflow, as `dot` does."""


_LARGE: Final = 1 << 18
"""Numbers in an array from which several threads fill or look through it."""


def equal_rings(n: int, size: int, workers: int | None = 1, budget: Budget = UNLIMITED) -> tuple[IntArray, IntArray]:
    """Return ring offsets and polygon offsets, read-only, of n polygons of one ring of `size` vertices each."""
    if n < _LARGE:
        numbers = np.arange(n + 1)
        return read_only(size * numbers), read_only(numbers)
    offsets, numbers = np.empty(n + 1, np.int64), np.empty(n + 1, np.int64)

    def fill(first: int, last: int) -> None:
        numbers[first:last] = np.arange(first, last)
        np.multiply(numbers[first:last], size, out=offsets[first:last])

    run_chunks(fill, n + 1, budget=budget, workers=workers, first_chunk=1 << 16)
    return read_only(offsets), read_only(numbers)


few_rings = functools.lru_cache(64)(equal_rings)
"""`equal_rings`, cached for arrays that are clipped at once."""


class Contours(NamedTuple):
    """The rings of all polygons of a call."""

    dimension: int
    vertices: FloatArray
    """(m * dim,), flat; zeros of either sign."""
    ring_offsets: IntArray
    polygon_offsets: IntArray
    size: float
    """Largest magnitude of a coordinate; or another number, if both need no scaling."""


def as_contours(polygons: Any, dimension: int, workers: int | None = 1, budget: Budget = UNLIMITED) -> Contours:
    """Return the rings of all polygons of a call: an array (one ring a polygon), a list of polygons or of lists of
    rings, or GeoJSON. An array is not copied.

    No polygons are allowed. Raises: EmptyGeometryError for a polygon without rings or a ring without vertices;
    InvalidArrayError, WrongDimensionError, NotFiniteError; each names the element.
    """
    if isinstance(polygons, np.ndarray):
        array = as_point_groups(polygons, None, dimension, ("polygons",), must_be_finite=False)
        n, size = array.shape[:2]
        if n and not size:
            raise EmptyGeometryError("polygons[0] has no vertices; leave it out", ("polygons", 0))
        flat = array.reshape(-1)
        if not isfinite(largest := _size_of(flat, workers, budget)):
            check_finite(array, ("polygons",))
        return Contours(dimension, flat, *equal_rings(n, size, workers, budget), largest)
    if not isinstance(polygons, (list, tuple)):
        if geometry_of(polygons) is None:
            raise InvalidArrayError(
                f"polygons must be a list of polygons, got {type(polygons).__name__}; put a single one into a list",
                ("polygons",),
            )
        polygons = as_solids(polygons, "polygons")
    if len(polygons) == 1 and type(alone := polygons[0]) is Polygon and alone.dimension == dimension:
        flat, offsets, counted = alone.vertices.reshape(-1), alone.ring_offsets, np.array([0, alone.n_rings])
        return Contours(dimension, flat, offsets, read_only(counted), _size_of(flat, workers, budget))
    rings: list[FloatArray] = []
    counts: list[int] = []
    for i, polygon in enumerate(polled(polygons)):
        if not isinstance(polygon, Polygon) and geometry_of(polygon) is not None:  # pieces of overlays are tuples
            polygon = as_solid(polygon, "polygons", i)
        if isinstance(polygon, Polygon):
            if polygon.dimension != dimension:
                check_dimension(polygon.dimension, dimension, ("polygons", i))
            n_rings = len(polygon.ring_offsets) - 1
            own = [polygon.vertices] if n_rings == 1 else np.split(polygon.vertices, polygon.ring_offsets[1:-1])
        elif isinstance(polygon, (list, tuple)) or (isinstance(polygon, np.ndarray) and polygon.ndim == 3):
            own = [as_points(ring, dimension, ("polygons", i, j)) for j, ring in enumerate(polygon)]
        else:
            raise InvalidArrayError(
                f"polygons[{i}] must be a Polygon or a list of rings, got {type(polygon).__name__}", ("polygons", i)
            )
        if not own:
            raise EmptyGeometryError(f"polygons[{i}] has no rings; leave it out", ("polygons", i))
        for j, ring in enumerate(own):
            if not len(ring):
                raise EmptyGeometryError(f"polygons[{i}][{j}] has no vertices; leave it out", ("polygons", i, j))
        rings += own
        counts.append(len(own))
    vertices = np.concatenate(rings).reshape(-1) if rings else np.zeros(0)
    size = _size_of(vertices, workers, budget)
    return Contours(dimension, vertices, summed([len(ring) for ring in rings]), summed(counts), size)


def _size_of(vertices: FloatArray, workers: int | None, budget: Budget) -> float:
    """Return `Contours.size`; not finite if a number is not."""
    square = np.vdot(vertices, vertices) if len(vertices) <= FEW else 0.0
    if USUAL[0] < square < USUAL[1]:
        return sqrt(square)
    if len(vertices) < _LARGE:
        return largest_of(vertices)
    sizes = [0.0]
    run_chunks(
        lambda first, last: sizes.append(largest_of(vertices[first:last])), len(vertices), budget=budget,
        workers=workers, first_chunk=1 << 18,
    )  # fmt: skip
    return float(np.max(sizes))
