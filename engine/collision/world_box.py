"""Boxes of float64 that hold the exact images of bodies under poses; infinite where a body is, or on overflow."""

from __future__ import annotations

import numpy as np

from engine.solids.aabb import Aabb
from engine.solids.base import FloatArray, Solid
from engine.solids.half_space import HalfSpace
from engine.solids.mesh import Mesh
from engine.solids.polygon import Polygon
from engine.solids.sphere import Sphere
from engine.solids.triangle import Triangle


def own_box(body: Solid) -> tuple[FloatArray, FloatArray]:
    """Return low and high ``(d,)`` of a body without pose; of a sphere: its centre twice."""
    if isinstance(body, HalfSpace):
        return np.full(body.dimension, -np.inf), np.full(body.dimension, np.inf)
    if isinstance(body, Sphere):
        return body.center, body.center
    if isinstance(body, Aabb):
        return body.min, body.max
    assert isinstance(body, Mesh | Polygon | Triangle)
    return body.prepared("own_box", lambda: _box_of_vertices(body))


def _box_of_vertices(body: Mesh | Polygon | Triangle) -> tuple[FloatArray, FloatArray]:
    points = body.vertices[body.triangles.ravel()] if isinstance(body, Mesh) else body.vertices
    return points.min(axis=0), points.max(axis=0)


def placed_boxes(
    low: FloatArray, high: FloatArray, rotations: FloatArray, translations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return low and high ``(n, d)`` of boxes around the images of boxes, rounded outward.

    With u = 2^-53, centre c and half widths h of a box, and m its largest coordinate, the image is R c + t, plus or
    minus |R| h: d + 2 roundings of terms below 2 m + |t|. The margin 2^-49 (3 m + |t|) + 2^-1060 covers them, the
    rounding of c and h, and its own. A posed ball must be widened by 2^-38 of its radius: bodies under one pose count
    as unposed, and a rotation may stretch lengths by up to 1.5e-12 (`engine.solids.pose.TOLERANCE`).
    """
    with np.errstate(all="ignore"):
        center, half = 0.5 * low + 0.5 * high, 0.5 * high - 0.5 * low
        largest = np.maximum(np.abs(low), np.abs(high)).max(axis=1)
        margin = 2.0**-49 * (3.0 * largest + np.abs(translations).max(axis=1)) + 2.0**-1060
        middle = (rotations @ center[:, :, None])[:, :, 0] + translations
        reach = (np.abs(rotations) @ half[:, :, None])[:, :, 0] + margin[:, None]
        low, high = middle - reach, middle + reach
    return np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)
