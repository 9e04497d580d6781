"""The ball (2D: disk) ``distance(center, p) <= radius``."""

from __future__ import annotations

from typing import ClassVar

from engine.arrays import FloatArray
from engine.errors import NegativeRadiusError
from engine.solids.base import Solid
from engine.solids.checks import as_number, as_vector, digits


class Sphere(Solid):
    """All points no farther than `radius` from `center`, in 2D or 3D.

    Parameters: center, 2 or 3 numbers; radius, a number >= 0. Boundary: the points at exactly that distance.
    Degenerate: radius 0 is the single point `center`, all boundary.
    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError, NegativeRadiusError.

    >>> Sphere([1, 2], 0.5)
    Sphere(center=[1.0, 2.0], radius=0.5)
    """

    __slots__ = ("center", "radius")

    type: ClassVar[str] = "sphere"
    _pickled: ClassVar[tuple[str, ...]] = ("center", "radius")
    center: FloatArray
    radius: float

    def __init__(self, center: object, radius: object) -> None:
        vector = as_vector(center, None, ("center",))
        number = as_number(radius, ("radius",)) + 0.0
        if number < 0.0:
            raise NegativeRadiusError(f"radius is {number!r}; it must be 0.0 or more", ("radius",))
        self._set(dimension=len(vector), center=vector, radius=number)

    def __repr__(self) -> str:
        return f"Sphere(center={digits(self.center)}, radius={self.radius!r})"
