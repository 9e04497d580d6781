"""The box of a solid before its pose: what boxes of posed bodies (`bounding/posed_boxes.py`) are made from."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from engine.arrays import FloatArray
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.mesh import Mesh
from engine.solids.polygon import Polygon
from engine.solids.sphere import Sphere
from engine.solids.triangle import Triangle


def own_box(solid: Solid, check: Callable[[], object] | None = None) -> tuple[FloatArray, FloatArray, float]:
    """Return low and high ``(d,)``, of a sphere those of its centre, infinite where a solid may have no bounds; and how
    far a point is at most from the middle as computed. check: as for `Solid.prepared`."""
    if isinstance(solid, Sphere):
        return solid.center, solid.center, 0.0
    if isinstance(solid, Aabb):
        return solid.min, solid.max, np.inf
    if isinstance(solid, Mesh | Polygon | Triangle):
        return solid.prepared("own_box", lambda: _box_of_vertices(solid), check)
    return np.full(solid.dimension, -np.inf), np.full(solid.dimension, np.inf), np.inf


def _box_of_vertices(body: Mesh | Polygon | Triangle) -> tuple[FloatArray, FloatArray, float]:
    """The square loses distances below 2^-537, for which 2^-500 is added; 2^-40 covers some ten roundings."""
    points = body.vertices[body.triangles.ravel()] if isinstance(body, Mesh) else body.vertices
    low, high = points.min(axis=0), points.max(axis=0)
    with np.errstate(all="ignore"):
        aside = points - (0.5 * low + 0.5 * high)
        reach = float(np.sqrt((aside * aside).sum(axis=1).max())) * (1.0 + 2.0**-40) + 2.0**-500
    return low, high, reach
