"""The planes of a box as rows, for the exact routines that know planes only."""

from __future__ import annotations

import numpy as np

from engine.arrays import FloatArray
from engine.solids.aabb import Aabb


def box_rows(region: Aabb) -> FloatArray:
    """Return the rows of a box in the order xmin, xmax, ymin, ymax, zmin, zmax."""
    unit = np.eye(region.dimension)
    rows = np.empty((2 * region.dimension, region.dimension + 1))
    rows[0::2, :-1], rows[1::2, :-1], rows[0::2, -1], rows[1::2, -1] = unit, -unit, -region.min, region.max
    rows += 0.0
    return rows
