"""The axis-aligned bounding box ``min <= p <= max`` on each axis."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from engine.arrays import FloatArray, read_only
from engine.errors import MinAboveMaxError
from engine.solids.base import Solid
from engine.solids.checks import as_vector, digits


class Aabb(Solid):
    """All points with ``min <= p <= max`` on each axis, in 2D or 3D.

    Parameters: min, max, 2 or 3 numbers each. Boundary: the points with some coordinate equal to its bound.
    Degenerate: min = max on an axis gives a flat box, all boundary.
    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError, MinAboveMaxError.

    >>> Aabb(min=[0, 0, 0], max=[1, 2, 3])
    Aabb(min=[0.0, 0.0, 0.0], max=[1.0, 2.0, 3.0])
    """

    __slots__ = ("max", "min")

    type: ClassVar[str] = "aabb"
    _pickled: ClassVar[tuple[str, ...]] = ("min", "max")
    min: FloatArray
    max: FloatArray

    def __init__(self, min: object, max: object) -> None:
        low = as_vector(min, None, ("min",))
        high = as_vector(max, len(low), ("max",))
        if (low > high).any():
            axis = int(np.argmax(low > high))
            raise MinAboveMaxError(
                f"min[{axis}] = {float(low[axis])!r} is above max[{axis}] = {float(high[axis])!r}; swap them",
                ("min", axis),
            )
        self._set(dimension=len(low), min=low, max=high)

    @property
    def rows(self) -> FloatArray:
        """``(2 dimension, dimension + 1)``: its planes, in the order xmin, xmax, ymin, ymax, zmin, zmax."""
        return rows_between(self.min, self.max)

    def __repr__(self) -> str:
        return f"Aabb(min={digits(self.min)}, max={digits(self.max)})"


def rows_between(low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the planes of a box, see `Aabb.rows`."""
    unit = np.eye(len(low))
    rows = np.empty((2 * len(low), len(low) + 1))
    rows[0::2, :-1], rows[1::2, :-1], rows[0::2, -1], rows[1::2, -1] = unit, -unit, -low, high
    return read_only(rows + 0.0)
