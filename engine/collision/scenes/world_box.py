"""Boxes of float64 that hold bodies; infinite where a body is."""

from __future__ import annotations

import numpy as np

from engine.arrays import FloatArray
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.half_space import HalfSpace
from engine.solids.mesh import Mesh
from engine.solids.polygon import Polygon
from engine.solids.sphere import Sphere
from engine.solids.triangle import Triangle


def own_box(body: Solid) -> tuple[FloatArray, FloatArray, float]:
    """Return low and high ``(d,)`` of a body without pose, and how far a point of the body is at most from the middle
    as computed; of a sphere: those of its centre."""
    if isinstance(body, HalfSpace):
        return np.full(body.dimension, -np.inf), np.full(body.dimension, np.inf), np.inf
    if isinstance(body, Sphere):
        return body.center, body.center, 0.0
    if isinstance(body, Aabb):
        return body.min, body.max, np.inf
    assert isinstance(body, Mesh | Polygon | Triangle)
    return body.prepared("own_box", lambda: _box_of_vertices(body))


def _box_of_vertices(body: Mesh | Polygon | Triangle) -> tuple[FloatArray, FloatArray, float]:
    """The square loses distances below 2^-537, for which 2^-500 is added; 2^-40 covers some ten roundings."""
    points = body.vertices[body.triangles.ravel()] if isinstance(body, Mesh) else body.vertices
    low, high = points.min(axis=0), points.max(axis=0)
    with np.errstate(all="ignore"):
        aside = points - (0.5 * low + 0.5 * high)
        reach = float(np.sqrt((aside * aside).sum(axis=1).max())) * (1.0 + 2.0**-40) + 2.0**-500
    return low, high, reach
