"""A rigid motion: rotation, then translation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, ClassVar, Final

import numpy as np

from engine.errors import EngineError, InvalidArrayError, NotRigidError, WrongDimensionError
from engine.predicates.rational import scaled_integers
from engine.solids.base import Immutable
from engine.solids.checks import (
    as_floats,
    as_number,
    as_vector,
    check_dimension,
    check_given_dimension,
    digits,
    frozen,
    shown,
)
from engine.solids.rotations import (
    MOST_TOLERANCE,
    ROUNDED,
    TOLERANCE,
    USUAL,
    check_rotations,
    exact_defect,
    nearest_rotation,
)
from engine.types import FloatArray, read_only


class Pose(Immutable):
    """A rigid motion ``p -> rotation @ p + translation`` of one body; the map is exact in these float64 numbers.

    Parameters
    ----------
    rotation : array_like, shape (d, d)
        Row-major, d 2 or 3, with det > 0 and ``max|R^T R - I| <= tolerance``, both decided exactly.
    translation : array_like, shape (d,), optional
        Added after the rotation; zero by default.
    tolerance : float, default 1e-12
        From 0 to 0.1: 1e-6 accepts matrices of float32 or of few digits.
    rounded : bool, default False
        The same with a tolerance of 1e-5: accepts a matrix printed with six digits, or of float32.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError, NotRigidError
        For arguments that break a rule.

    Notes
    -----
    Up to a deviation of 1e-12 the body is the image under the matrix as given, though no rotation of floats is quite
    orthogonal. Beyond, `rotation` becomes the rotation nearest to it (the orthogonal factor of its polar form, of the
    least sum of squared differences), each entry the double nearest to the exact one; so lengths are kept, a ball stays
    a ball, and the same matrix gives the same body everywhere. Immutable, picklable, compared by value.

    Examples
    --------
    >>> Pose([[0, -1], [1, 0]], [5, 0])  # a quarter turn, then a step along x
    Pose(rotation=[[0.0, -1.0], [1.0, 0.0]], translation=[5.0, 0.0])
    """

    __slots__ = ("numbers", "rotation", "translation")

    type: ClassVar[str] = "pose"
    rotation: FloatArray
    translation: FloatArray
    numbers: bytes
    """The bytes of rotation and translation, in this order, for joining and comparing many poses."""

    def __init__(
        self, rotation: object, translation: object = None, *, tolerance: float = 1e-12, rounded: bool = False
    ) -> None:
        if rounded is not False:
            tolerance = rounded_tolerance(rounded, tolerance)
        matrix = as_floats(rotation, 2, ("rotation",))
        check_dimension(matrix.shape[0], None, ("rotation",), "rows of")
        if matrix.shape[0] != matrix.shape[1]:
            raise WrongDimensionError(f"rotation must be square, got shape {matrix.shape}", ("rotation",))
        limit = TOLERANCE
        if type(tolerance) is not float or tolerance != USUAL:
            limit = Fraction(checked_tolerance(tolerance))
        check_rotations(matrix[None], ("rotation",), one=True, limit=limit)
        if limit is not TOLERANCE and limit > TOLERANCE and exact_defect(matrix) > TOLERANCE:
            matrix = nearest_rotation(matrix)
        move = np.zeros(len(matrix)) if translation is None else translation
        self._set(frozen(matrix), as_vector(move, len(matrix), ("translation",)))

    def _set(self, rotation: FloatArray, translation: FloatArray) -> None:
        object.__setattr__(self, "rotation", rotation)
        object.__setattr__(self, "translation", translation)
        object.__setattr__(self, "numbers", rotation.tobytes() + translation.tobytes())

    @classmethod
    def identity(cls, dimension: int = 3) -> Pose:
        """Return the motion that leaves everything where it is.

        Parameters
        ----------
        dimension : int, default 3
            2 or 3.

        Returns
        -------
        Pose
            The identity.
        """
        check_given_dimension(dimension)
        return cls(np.eye(dimension), np.zeros(dimension))

    @classmethod
    def from_quaternion(
        cls, wxyz: object = None, translation: object = (0.0, 0.0, 0.0), *, xyzw: object = None
    ) -> Pose:
        """Return the pose of a quaternion and a translation; 3D.

        Parameters
        ----------
        wxyz : array_like, shape (4,)
            ``(w, x, y, z)`` of any length but 0.
        translation : array_like, shape (3,), optional
            Added after the rotation.
        xyzw : array_like, shape (4,), optional
            In place of `wxyz`, in the order of scipy and ROS: ``(x, y, z, w)``.

        Returns
        -------
        Pose
            Each entry of its rotation is the double nearest to that of the exact rotation.

        Examples
        --------
        >>> Pose.from_quaternion([1, 0, 0, 1], [0, 0, 5]).rotation.tolist()  # a quarter turn around z
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
        """
        if (wxyz is None) == (xyzw is None):
            raise InvalidArrayError("give a quaternion as wxyz or as xyzw", ("quaternion",))
        numbers = as_floats(xyzw if wxyz is None else wxyz, 1, ("quaternion",))
        if len(numbers) != 4:
            raise InvalidArrayError(f"quaternion must hold w, x, y, z, got {len(numbers)} numbers", ("quaternion",))
        numbers = np.roll(numbers, 1) if wxyz is None else numbers
        w, x, y, z = scaled_integers(numbers.tolist())
        square = w * w + x * x + y * y + z * z
        if square == 0:
            raise NotRigidError("quaternion has length 0; [1, 0, 0, 0] turns nothing", ("quaternion",))
        rows = [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
        return cls([[entry / square for entry in row] for row in rows], translation)

    @classmethod
    def from_axis_angle(cls, axis: object, angle: float, translation: object = (0.0, 0.0, 0.0)) -> Pose:
        """Return the pose of a turn about an axis through the origin, and a translation; 3D.

        Parameters
        ----------
        axis : array_like, shape (3,)
            Of any length but 0.
        angle : float
            In radians, counter-clockwise seen from where the axis points.
        translation : array_like, shape (3,), optional
            Added after the rotation.

        Returns
        -------
        Pose
            That of the unit quaternion with the sine and cosine of half the angle, rounded.

        Examples
        --------
        >>> Pose.from_axis_angle([0, 0, 2], 0.0)
        Pose(rotation=[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation=[0.0, 0.0, 0.0])
        """
        given = as_vector(axis, 3, ("axis",))
        half = as_number(angle, ("angle",)) / 2.0
        length = math.hypot(*(given / (largest := np.abs(given).max() or 1.0)))
        if length == 0.0:
            raise NotRigidError("axis has length 0; any other vector is one", ("axis",))
        return cls.from_quaternion([math.cos(half), *(math.sin(half) / length * (given / largest))], translation)

    @classmethod
    def from_rpy(cls, rpy: object, translation: object = (0.0, 0.0, 0.0)) -> Pose:
        """Return the pose of roll, pitch and yaw, as URDF and ROS have them, and a translation; 3D.

        Parameters
        ----------
        rpy : array_like, shape (3,)
            Angles in radians about the fixed axes x, y and z, turned about in this order.
        translation : array_like, shape (3,), optional
            Added after the rotation.

        Returns
        -------
        Pose
            That of the product of the three quaternions, whose sines and cosines are rounded.

        Examples
        --------
        >>> Pose.from_rpy([0, 0, 0], [1, 2, 3]).translation.tolist()
        [1.0, 2.0, 3.0]
        """
        roll, pitch, yaw = (as_vector(rpy, 3, ("rpy",)) / 2.0).tolist()
        cr, sr, cp, sp, cy, sy = (turn(angle) for angle in (roll, pitch, yaw) for turn in (math.cos, math.sin))
        wxyz = [
            cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy,
        ]  # fmt: skip
        return cls.from_quaternion(wxyz, translation)

    @classmethod
    def from_matrix(cls, matrix: object, *, tolerance: float = 1e-12, rounded: bool = False) -> Pose:
        """Return the pose of a matrix of homogeneous coordinates.

        Parameters
        ----------
        matrix : array_like, shape (d + 1, d + 1)
            Rotation, translation in the last column, last row 0 ... 0 1.
        tolerance, rounded
            As for `Pose`.

        Returns
        -------
        Pose
            The same motion.

        Examples
        --------
        >>> Pose.from_matrix([[0, -1, 5], [1, 0, 0], [0, 0, 1]]) == Pose([[0, -1], [1, 0]], [5, 0])
        True
        """
        rows = as_floats(matrix, 2, ("matrix",))
        n = len(rows)
        check_dimension(n - 1, None, ("matrix",), "a row more than")
        if rows.shape != (n, n):
            raise WrongDimensionError(f"matrix must be square, got shape {rows.shape}", ("matrix",))
        if rows[-1].tolist() != [0.0] * (n - 1) + [1.0]:
            raise NotRigidError(
                f"matrix[{n - 1}] = {digits(rows[-1])} must be 0 ... 0 1; transpose a matrix whose last column is that",
                ("matrix", n - 1),
            )
        try:
            return cls(rows[:-1, :-1], rows[:-1, -1], tolerance=tolerance, rounded=rounded)
        except EngineError as error:
            error.where = ("matrix",) if error.where[:1] == ("rotation",) else error.where
            raise

    @classmethod
    def of_checked(cls, rotation: FloatArray, translation: FloatArray) -> Pose:
        """Return the pose of copies of these arrays, which must have passed `check_rotations` and a test for NaN."""
        pose = object.__new__(cls)
        pose._set(read_only(rotation + 0.0), read_only(translation + 0.0))  # of -0.0: 0.0
        return pose

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return len(self.translation)

    @property
    def is_identity(self) -> bool:
        """Whether the pose maps every point to itself."""
        return self.numbers in _IDENTITIES

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Pose) and self.numbers == other.numbers  # no -0.0: equal values, equal bytes

    def __hash__(self) -> int:
        return hash(self.numbers)

    def __reduce__(self) -> tuple[Any, ...]:
        return Pose, (self.rotation, self.translation)

    def __repr__(self) -> str:
        text = f"Pose(rotation={digits(self.rotation)}, translation={digits(self.translation)})"
        move = ", ".join(f"{x:.6g}" for x in self.translation.tolist())
        return text if len(text) <= 120 else f"<Pose: {self.dimension}D, a turn and a step of [{move}]>"


def rounded_tolerance(rounded: object, tolerance: float) -> float:
    """Return the tolerance of a pose: `ROUNDED` where rounded is True."""
    if not isinstance(rounded, (bool, np.bool_)):
        raise InvalidArrayError(f"rounded must be True or False, got {shown(rounded)}", ("rounded",))
    return max(ROUNDED, checked_tolerance(tolerance)) if rounded else tolerance


def checked_tolerance(tolerance: object) -> float:
    """Return a tolerance of rotations as a float. Raises: InvalidArrayError unless it is from 0 to `MOST_TOLERANCE`."""
    number = as_number(tolerance, ("tolerance",))
    if not 0.0 <= number <= MOST_TOLERANCE:
        raise InvalidArrayError(f"tolerance is {tolerance!r}; it must be from 0.0 to {MOST_TOLERANCE}", ("tolerance",))
    return number


_STILL: Final = {d: (read_only(np.eye(d)), read_only(np.zeros(d))) for d in (2, 3)}


Motion = tuple[FloatArray, FloatArray]
"""(rotation (d, d), translation (d,)), read-only."""


def motion_of(pose: Pose | None, dimension: int) -> Motion:
    """Return (rotation, translation) of a pose, of the identity for None."""
    return _STILL[dimension] if pose is None else (pose.rotation, pose.translation)


def motions_of(poses: Sequence[Pose | None], dimension: int) -> tuple[FloatArray, FloatArray]:
    """Return rotations (n, d, d) and translations (n, d) of poses, the identity for None; ValueError if a dimension
    differs."""
    joined = b"".join([_IDENTITIES[dimension - 2] if pose is None else pose.numbers for pose in poses])
    rows = np.frombuffer(joined).reshape(len(poses), dimension**2 + dimension)
    return rows[:, : dimension**2].copy().reshape(-1, dimension, dimension), rows[:, dimension**2 :].copy()


_IDENTITIES: Final = tuple(np.eye(d).tobytes() + np.zeros(d).tobytes() for d in (2, 3))
