"""The intersection of half-spaces, given by the rows of their planes."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from engine.arrays import FloatArray
from engine.errors import ZeroNormalError
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.checks import as_floats, check_dimension, check_not_empty, digits, frozen
from engine.solids.half_space import HalfSpace


class Convex(Solid):
    """All points on the inner side of every plane, in 2D or 3D; may be unbounded, flat or empty.

    Parameters: planes, rows ``[a, b, c, d]`` with a x + b y + c z + d >= 0 inside (2D: ``[a, b, c]``), at least one.
    Boundary: the points of the solid where some row is exactly zero.
    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError, EmptyGeometryError (no rows), ZeroNormalError.

    >>> Convex([[1, 0, 0], [0, 1, 0], [-1, -1, 1]])  # the triangle (0, 0), (1, 0), (0, 1)
    Convex(3 planes, 2D)
    """

    __slots__ = ("planes",)

    type: ClassVar[str] = "convex"
    _pickled: ClassVar[tuple[str, ...]] = ("planes",)
    planes: FloatArray

    def __init__(self, planes: object) -> None:
        rows = as_floats(planes, 2, ("planes",))
        check_not_empty(rows.shape[0], "row", ("planes",))
        check_dimension(rows.shape[1] - 1, None, ("planes",), "rows of a normal and an offset, the normal of")
        is_zero = ~rows[:, :-1].any(axis=1)
        if is_zero.any():
            i_row = int(np.argmax(is_zero))
            raise ZeroNormalError(
                f"planes[{i_row}] = {digits(rows[i_row])} has a zero normal; leave the row out or give its direction",
                ("planes", i_row),
            )
        self._set(dimension=rows.shape[1] - 1, planes=frozen(rows))

    def __repr__(self) -> str:
        return f"Convex({len(self.planes)} planes, {self.dimension}D)"


def rows_of(solid: HalfSpace | Aabb | Convex) -> FloatArray:
    """Return the rows ``(m, dimension + 1)`` of the planes that bound a solid; of a box xmin, xmax, ymin, ymax, ..."""
    return solid.row[None] if isinstance(solid, HalfSpace) else solid.rows if isinstance(solid, Aabb) else solid.planes


def rows_in_space(rows: FloatArray) -> FloatArray:
    """Return rows as ``(m, 4)``: those of the plane with 0 in the third place."""
    return rows if rows.shape[1] == 4 else np.insert(rows, 2, 0.0, axis=1)
