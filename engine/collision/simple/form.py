"""Boxes along the axes that are not flat, and balls, as kernels take them: a few numbers in one array."""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.arrays import FloatArray, read_only
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.sphere import Sphere

HIGH: Final = 3
RADIUS: Final = 6
IS_BALL: Final = 7
N_NUMBERS: Final = 8
"""Of a form: low and high on three axes, the radius, and whether it is a ball (1.0)."""
FORMS: Final = ("aabb", "sphere")


def form_of(solid: Solid) -> FloatArray | None:
    """Return a box that is not flat or a ball as kernels take it, None for others."""
    if solid.type not in FORMS:
        return None
    return solid.prepared("form", lambda: _form(solid))


def _form(solid: Solid) -> FloatArray | None:
    d, form = solid.dimension, np.zeros(N_NUMBERS)
    if isinstance(solid, Sphere):
        form[:d] = form[HIGH : HIGH + d] = solid.center
        form[RADIUS:] = solid.radius, 1.0
        return read_only(form)
    if isinstance(solid, Aabb) and bool((solid.min < solid.max).all()):
        form[:d], form[HIGH : HIGH + d] = solid.min, solid.max
        return read_only(form)
    return None
