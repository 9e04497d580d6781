"""Solids given by a few numbers: half-space, ball, box, intersection of half-spaces, triangle."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from engine.errors import InvalidArrayError, MinAboveMaxError, NegativeRadiusError, ZeroNormalError
from engine.solids.base import Solid
from engine.solids.checks import as_floats, as_number, as_vector, check_dimension, check_not_empty, digits, frozen
from engine.solids.columns import brief
from engine.types import FloatArray, IntArray, read_only


class HalfSpace(Solid):
    """All points with ``dot(normal, p) + offset >= 0``, in 2D or 3D.

    Parameters
    ----------
    normal : array_like, shape (2,) or (3,)
        Points into the solid; of any length but zero.
    offset : float
        Over the length of the normal: how far inside the origin lies.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError, ZeroNormalError
        For arguments that break a rule.

    Notes
    -----
    Boundary: the points where the sum is exactly zero.

    Examples
    --------
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
        return brief(f"HalfSpace(normal={digits(self.normal)}, offset={self.offset!r})")


class Sphere(Solid):
    """All points at most `radius` away from `center`, in 2D or 3D.

    Parameters
    ----------
    center : array_like, shape (2,) or (3,)
        The centre.
    radius : float
        Zero or more.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError, NegativeRadiusError
        For arguments that break a rule.

    Notes
    -----
    Boundary: the points at exactly that distance. Degenerate: radius 0 is the single point `center`, all boundary.

    Examples
    --------
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
        return brief(f"Sphere(center={digits(self.center)}, radius={self.radius!r})")


class Aabb(Solid):
    """All points with ``min <= p <= max`` on each axis, in 2D or 3D.

    Parameters
    ----------
    min, max : array_like, shape (2,) or (3,)
        The corners with the least and the greatest coordinates.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError, MinAboveMaxError
        For arguments that break a rule.

    Notes
    -----
    Boundary: the points with some coordinate equal to its bound. Degenerate: min = max on an axis gives a flat box, all
    boundary.

    Examples
    --------
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
        return brief(f"Aabb(min={digits(self.min)}, max={digits(self.max)})")


def rows_between(low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the plane rows (2 d, d + 1) of the box from low to high, in the order xmin, xmax, ymin, ymax, ..."""
    unit = np.eye(len(low))
    rows = np.empty((2 * len(low), len(low) + 1))
    rows[0::2, :-1], rows[1::2, :-1], rows[0::2, -1], rows[1::2, -1] = unit, -unit, -low, high
    return read_only(rows + 0.0)


class Convex(Solid):
    """All points on the inner side of every plane, in 2D or 3D; may be unbounded, flat or empty.

    Parameters
    ----------
    planes : array_like, shape (n, 4) or (n, 3)
        Rows ``[a, b, c, d]`` with a x + b y + c z + d >= 0 inside (2D: ``[a, b, c]``), at least one.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError, EmptyGeometryError, ZeroNormalError
        For rows that break a rule; EmptyGeometryError where there are none.

    Notes
    -----
    Boundary: the points of the solid where some row is exactly zero.

    Examples
    --------
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
    """Return the plane rows ``(m, dimension + 1)`` of a solid; of a box in the order xmin, xmax, ymin, ymax, ..."""
    return solid.row[None] if isinstance(solid, HalfSpace) else solid.rows if isinstance(solid, Aabb) else solid.planes


def rows_in_space(rows: FloatArray) -> FloatArray:
    """Return plane rows as ``(m, 4)``; in the plane a third coefficient 0 is inserted."""
    return rows if rows.shape[1] == 4 else np.insert(rows, 2, 0.0, axis=1)


class Triangle(Solid):
    """A triangle of three vertices in either order; in 3D `locate` tests the prism over it, as the textbook does.

    Parameters
    ----------
    vertices : array_like, shape (3, 2) or (3, 3)
        Three collinear or equal vertices are accepted.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError
        For vertices that break a rule.

    Examples
    --------
    >>> Triangle([[0, 0], [1, 0], [0, 1]])
    Triangle([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    """

    __slots__ = ("vertices",)

    type: ClassVar[str] = "triangle"
    _pickled: ClassVar[tuple[str, ...]] = ("vertices",)
    vertices: FloatArray
    ring_offsets: ClassVar[IntArray] = read_only(np.array([0, 3], np.int64))
    """Offsets of the single ring of a planar triangle."""

    def __init__(self, vertices: object) -> None:
        points = as_floats(vertices, 2, ("vertices",))
        if len(points) != 3:
            raise InvalidArrayError(
                f"vertices must hold the 3 vertices of a triangle, got {len(points)}", ("vertices",)
            )
        check_dimension(points.shape[1], None, ("vertices",))
        self._set(dimension=points.shape[1], vertices=frozen(points))

    def __repr__(self) -> str:
        return brief(f"Triangle({digits(self.vertices)})")
