"""A box of float64 that holds the exact image of a body under its pose; infinite where the body is, or on overflow."""

from __future__ import annotations

import numpy as np

from engine.solids.aabb import Aabb
from engine.solids.base import FloatArray, Solid
from engine.solids.half_space import HalfSpace
from engine.solids.mesh import Mesh
from engine.solids.polygon import Polygon
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.solids.triangle import Triangle


def world_box(body: Solid, pose: Pose | None) -> tuple[FloatArray, FloatArray]:
    """Return low and high ``(d,)`` of a box around the image of `body`, rounded outward.

    With u = 2^-53, centre c and half widths h of the body's own box, and m its largest coordinate, the image is
    R c + t, plus or minus |R| h: d + 2 roundings of terms below 2 m + |t|. The margin 2^-49 (3 m + |t|) + 2^-1060
    covers them, the rounding of c and h, and its own. A posed ball is widened by 2^-38 of its radius: bodies under one
    pose count as unposed, and a rotation may stretch lengths by up to 1.5e-12 (`engine.solids.pose.TOLERANCE`).
    """
    if isinstance(body, HalfSpace):
        return np.full(body.dimension, -np.inf), np.full(body.dimension, np.inf)
    low, high = body.prepared("own_box", lambda: _own_box(body))
    if pose is not None:
        low, high = _placed(low, high, pose)
    if isinstance(body, Sphere):
        with np.errstate(over="ignore"):
            radius = body.radius if pose is None else body.radius * (1.0 + 2.0**-38)
            low = np.nextafter(low - radius, -np.inf)
            high = np.nextafter(high + radius, np.inf)
    return low, high


def _own_box(body: Solid) -> tuple[FloatArray, FloatArray]:
    """Return the box of a body without pose (of a sphere: that of its centre)."""
    if isinstance(body, Sphere):
        return body.center, body.center
    if isinstance(body, Aabb):
        return body.min, body.max
    assert isinstance(body, Mesh | Polygon | Triangle)
    points = body.vertices[np.unique(body.triangles)] if isinstance(body, Mesh) else body.vertices
    return points.min(axis=0), points.max(axis=0)


def _placed(low: FloatArray, high: FloatArray, pose: Pose) -> tuple[FloatArray, FloatArray]:
    with np.errstate(all="ignore"):
        center, half = 0.5 * low + 0.5 * high, 0.5 * high - 0.5 * low
        largest, shift = np.abs([low, high]).max(), np.abs(pose.translation).max()
        margin = 2.0**-49 * (3.0 * largest + shift) + 2.0**-1060
        middle = pose.rotation @ center + pose.translation
        reach = np.abs(pose.rotation) @ half + margin
        low, high = middle - reach, middle + reach
    return np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)
