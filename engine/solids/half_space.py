"""The half-space ``dot(normal, p) + offset >= 0``; the normal points inward."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from engine.arrays import FloatArray
from engine.errors import ZeroNormalError
from engine.solids.base import Solid
from engine.solids.checks import as_number, as_vector, digits


class HalfSpace(Solid):
    """All points with ``dot(normal, p) + offset >= 0``, in 2D or 3D.

    Parameters: normal, 2 or 3 numbers, of any length but zero, pointing into the solid; offset, a number.
    Boundary: the points where the sum is exactly zero.
    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError, ZeroNormalError.

    >>> HalfSpace(normal=[0.0, 0.0, 1.0], offset=-2.0).row.tolist()
    [0.0, 0.0, 1.0, -2.0]
    """

    __slots__ = ("normal", "offset", "row")

    type: ClassVar[str] = "half_space"
    _pickled: ClassVar[tuple[str, ...]] = ("normal", "offset")
    normal: FloatArray
    offset: float
    row: FloatArray
    """``(dimension + 1,)``: the normal, then the offset."""

    def __init__(self, normal: object, offset: object) -> None:
        vector = as_vector(normal, None, ("normal",))
        if not vector.any():
            raise ZeroNormalError(f"normal is {digits(vector)}; give the direction that points inward", ("normal",))
        number = as_number(offset, ("offset",)) + 0.0
        row = np.append(vector, number)
        row.setflags(write=False)
        self._set(dimension=len(vector), normal=vector, offset=number, row=row)

    def __repr__(self) -> str:
        return f"HalfSpace(normal={digits(self.normal)}, offset={self.offset!r})"
