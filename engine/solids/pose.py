"""A rigid motion: rotation, then translation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, ClassVar, Final

import numpy as np

from engine.compiling.jit import entry_of, kernel
from engine.errors import InvalidArrayError, NotRigidError, WrongDimensionError
from engine.predicates.rational import cross, determinant, scaled_integers
from engine.running.budget import Budget
from engine.running.parallel import run_chunks
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
    spell,
)
from engine.types import BoolArray, FloatArray, read_only

TOLERANCE: Final = Fraction(1, 10**12)
"""Largest |entry| of ``R^T R - I`` of a rotation; part of the contract, compared exactly."""

_TOLERANCE: Final = float(TOLERANCE)
"""`TOLERANCE` as a float, for the filter and as a default, since a Fraction would be slow."""
MOST_TOLERANCE: Final = 0.1
ROUNDED: Final = 1e-5
"""Tolerance of entries with six digits: each is wrong by 5e-7, an entry of R^T R by 2 sqrt(3) times that at most."""

_UNSURE: Final = 2.0**-45  # more than 8 roundings of sums of three products of numbers below 1.01


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
        if type(tolerance) is not float or tolerance != _TOLERANCE:
            if not 0.0 <= as_number(tolerance, ("tolerance",)) <= MOST_TOLERANCE:
                raise InvalidArrayError(
                    f"tolerance is {tolerance!r}; it must be from 0.0 to {MOST_TOLERANCE}", ("tolerance",)
                )
            limit = Fraction(float(tolerance))
        check_rotations(matrix[None], ("rotation",), one=True, limit=limit)
        if limit is not TOLERANCE and limit > TOLERANCE and _exact_defect(matrix) > TOLERANCE:
            matrix = _nearest_rotation(matrix)
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
        return cls(rows[:-1, :-1], rows[:-1, -1], tolerance=tolerance, rounded=rounded)

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
        return f"Pose(rotation={digits(self.rotation)}, translation={digits(self.translation)})"


def rounded_tolerance(rounded: object, tolerance: float) -> float:
    """Return the tolerance of a pose: `ROUNDED` where rounded is True."""
    if not isinstance(rounded, (bool, np.bool_)):
        raise InvalidArrayError(f"rounded must be True or False, got {shown(rounded)}", ("rounded",))
    return max(ROUNDED, tolerance) if rounded else tolerance


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


def check_rotations(
    rotations: FloatArray,
    where: tuple[str | int, ...] = ("rotations",),
    *,
    one: bool = False,
    limit: Fraction = TOLERANCE,
    workers: int | None = 1,
) -> None:
    """Raise for the first matrix of ``(n, d, d)`` finite float64 that is no rotation.

    Decided exactly: entries of ``R^T R - I`` are computed in float64 for all matrices, and in rationals for those
    within rounding of the limit. A matrix within the usual limit has |det| within 1e-11 of 1, so that its float64 sign
    is right; within the widest, |det| > 0.5. one: `rotations` has a single matrix and `where` is its own path. limit:
    at most 0.1.
    """
    if rotations.ndim != 3 or rotations.shape[1] != rotations.shape[2]:
        raise InvalidArrayError(f"{spell(where)} must have shape (n, d, d), got {rotations.shape}", where)
    sure = (_TOLERANCE if limit is TOLERANCE else float(limit)) - _UNSURE
    is_suspect = np.empty(len(rotations), np.bool_)
    matrices = read_only(rotations)
    if len(rotations) < _MANY:
        has_suspects = entry_of(find_suspects)(matrices, sure, is_suspect)
    else:

        def task(first: int, last: int) -> None:
            entry_of(find_suspects)(matrices[first:last], sure, is_suspect[first:last])

        run_chunks(task, len(rotations), budget=Budget(), workers=workers)
        has_suspects = is_suspect.any()
    for index in np.flatnonzero(is_suspect) if has_suspects else ():
        matrix = rotations[index]
        path = where if one else (*where, int(index))
        defect = _exact_defect(matrix)
        if defect > limit:
            allowed = f", or allow it by tolerance={1.1 * float(defect):.1e}" if defect < Fraction(9, 100) else ""
            allowed += ", or as one of six digits by rounded=True" if defect <= ROUNDED else ""
            raise NotRigidError(
                f"{spell(path)} = {digits(matrix)} is no rotation: max|R^T R - I| is {_decimal(defect)}, "
                f"the limit {float(limit)!r}; make it orthogonal (from a unit quaternion, say){allowed}",
                path,
            )
        if determinant([[*map(Fraction, row)] for row in matrix.tolist()]) <= 0:
            raise NotRigidError(
                f"{spell(path)} = {digits(matrix)} is a reflection: its determinant is negative; "
                "change the sign of one row, or mirror the solid itself",
                path,
            )


def is_certified_rotation(matrix: FloatArray) -> bool:
    """Return whether floats prove that a read-only ``(1, d, d)`` float64 is a rotation; if not, `check_rotations`
    decides."""
    return not entry_of(find_suspects)(matrix, _TOLERANCE - _UNSURE, _UNREAD)


_MANY: Final = 1 << 12
"""Number of matrices from which on several threads check them."""
_UNREAD: Final = np.empty(1, np.bool_)


@kernel
def find_suspects(matrices: FloatArray, limit: float, is_suspect: BoolArray) -> int:
    """Fill is_suspect (n,) for matrices (n, d, d): computed max|R^T R - I| > limit, or det <= 0; return the number of
    True. An entry of the product is a sum of d products, det a sum of d! of d; matrices whose numbers overflow are
    suspect."""
    dimension, n_suspects = matrices.shape[1], 0
    for item in range(matrices.shape[0]):
        suspect = False
        for j in range(dimension):
            for k in range(j + 1):
                defect = -1.0 if j == k else 0.0
                for i in range(dimension):
                    defect += matrices[item, i, j] * matrices[item, i, k]
                suspect |= not abs(defect) <= limit
        if dimension == 2:
            det = matrices[item, 0, 0] * matrices[item, 1, 1] - matrices[item, 0, 1] * matrices[item, 1, 0]
        else:
            det = 0.0
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                minor = matrices[item, 1, j] * matrices[item, 2, k] - matrices[item, 1, k] * matrices[item, 2, j]
                det += matrices[item, 0, i] * minor
        is_suspect[item] = suspect or not det > 0.0
        n_suspects += is_suspect[item]
    return n_suspects


def _exact_defect(matrix: FloatArray) -> Fraction:
    columns = [[Fraction(value) for value in column] for column in matrix.T.tolist()]
    return max(
        abs(sum((a * b for a, b in zip(first, second)), Fraction(-int(i == j))))
        for i, first in enumerate(columns)
        for j, second in enumerate(columns)
    )


def _nearest_rotation(matrix: FloatArray) -> FloatArray:
    """Return the orthogonal factor of the polar decomposition of a matrix with det > 0, entries rounded to nearest.

    It is computed to some units of 2^-300. If that leaves a double open, above all a zero, it is computed to some of
    2^-1200; no entry of a rotation lies in the middle of two doubles, for a power of 4 is the sum of three squares only
    where two of them are 0.
    """
    for bits in (300, 1200):
        rows = _orthogonal_factor(matrix, bits)
        ends = [[[(x + step) / (1 << bits) for x in row] for row in rows] for step in (-64, 64)]
        if ends[0] == ends[1]:
            break
    return np.array([[x / (1 << bits) for x in row] for row in rows])


def _orthogonal_factor(matrix: FloatArray, bits: int) -> list[list[int]]:
    """Return the orthogonal factor in units of 2^-bits by Newton's iteration X <- (X + X^-T) / 2, which squares the
    error. Source: N. Higham, Computing the polar decomposition, with applications, 1986."""
    rows = [[int(Fraction(value) * (1 << bits)) for value in row] for row in matrix.tolist()]
    while True:  # bound: the error is below 1 and squared
        if len(rows) == 2:
            (a, b), (c, d) = rows
            cofactors = [[d, -c], [-b, a]]
        else:
            cofactors = [list(cross(rows[i - 2], rows[i - 1])) for i in range(3)]
        volume = int(determinant(rows))
        moved = [[(x + (c << 2 * bits) // volume) >> 1 for x, c in zip(*pair)] for pair in zip(rows, cofactors)]
        step = max(abs(x - y) for pair in zip(rows, moved) for x, y in zip(*pair))
        rows = moved
        if step < 1 << bits // 2 - 8:
            return rows


def _decimal(value: Fraction) -> str:
    """Return some digits of a fraction, which may exceed float64."""
    return repr(float(value)) if value < 10**300 else "above 1e300"
