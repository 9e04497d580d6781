"""The triangle: itself in 2D, the infinite prism over it in 3D (flat for bounds)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from engine.arrays import FloatArray, IntArray, read_only
from engine.errors import InvalidArrayError
from engine.solids.base import Solid
from engine.solids.checks import as_floats, check_dimension, digits, frozen


class Triangle(Solid):
    """A triangle of three vertices in either order; in 3D `locate` asks for the prism over it, as the textbook does.

    Parameters: vertices, 3 positions of 2 or 3 numbers.
    Degenerate: three collinear or equal vertices are accepted.
    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError.

    >>> Triangle([[0, 0], [1, 0], [0, 1]])
    Triangle([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    """

    __slots__ = ("vertices",)

    type: ClassVar[str] = "triangle"
    _pickled: ClassVar[tuple[str, ...]] = ("vertices",)
    vertices: FloatArray
    ring_offsets: ClassVar[IntArray] = read_only(np.array([0, 3], np.int64))
    """Of the plane's: those of its one ring."""

    def __init__(self, vertices: object) -> None:
        points = as_floats(vertices, 2, ("vertices",))
        if len(points) != 3:
            raise InvalidArrayError(
                f"vertices must hold the 3 vertices of a triangle, got {len(points)}", ("vertices",)
            )
        check_dimension(points.shape[1], None, ("vertices",))
        self._set(dimension=points.shape[1], vertices=frozen(points))

    def __repr__(self) -> str:
        return f"Triangle({digits(self.vertices)})"
