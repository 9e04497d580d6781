"""A rigid motion: rotation, then translation."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, ClassVar, Final

import numpy as np

from engine.arrays import FloatArray, read_only
from engine.errors import InvalidArrayError, NotRigidError, WrongDimensionError
from engine.jit import kernel
from engine.predicates.exact_vectors import determinant
from engine.solids.base import Immutable
from engine.solids.checks import as_floats, as_vector, check_dimension, check_given_dimension, digits, frozen, spell

TOLERANCE: Final = Fraction(1, 10**12)
"""Largest entry of ``R^T R - I`` that is still taken for a rotation; part of the contract, compared exactly."""

_UNSURE: Final = 2.0**-45  # more than 8 roundings of sums of three products of numbers below 1.01


class Pose(Immutable):
    """A rigid motion ``p -> rotation @ p + translation`` of one body; the map is exact in these float64 numbers.

    Parameters: rotation, ``(d, d)`` row-major, d 2 or 3, with det > 0 and ``max|R^T R - I| <= 1e-12`` (both decided
    exactly); translation, d numbers. A rotation of floats is not quite orthogonal: the image is that of the matrix as
    given. Immutable, picklable, compared by value.
    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError, NotRigidError.

    >>> Pose([[0, -1], [1, 0]], [5, 0])  # a quarter turn, then a step along x
    Pose(rotation=[[0.0, -1.0], [1.0, 0.0]], translation=[5.0, 0.0])
    """

    __slots__ = ("numbers", "rotation", "translation")

    type: ClassVar[str] = "pose"
    rotation: FloatArray
    translation: FloatArray
    numbers: bytes
    """The float64 of both, the rotation's first: many poses are joined, and two compared, by these."""

    def __init__(self, rotation: object, translation: object) -> None:
        matrix = as_floats(rotation, 2, ("rotation",))
        check_dimension(matrix.shape[0], None, ("rotation",), "rows of")
        if matrix.shape[0] != matrix.shape[1]:
            raise WrongDimensionError(f"rotation must be square, got shape {matrix.shape}", ("rotation",))
        check_rotations(matrix[None], ("rotation",), one=True)
        self._set(frozen(matrix), as_vector(translation, len(matrix), ("translation",)))

    def _set(self, rotation: FloatArray, translation: FloatArray) -> None:
        object.__setattr__(self, "rotation", rotation)
        object.__setattr__(self, "translation", translation)
        object.__setattr__(self, "numbers", rotation.tobytes() + translation.tobytes())

    @classmethod
    def identity(cls, dimension: int = 3) -> Pose:
        """Return the motion that leaves everything where it is."""
        check_given_dimension(dimension)
        return cls(np.eye(dimension), np.zeros(dimension))

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return len(self.translation)

    @property
    def is_identity(self) -> bool:
        """Whether the motion leaves everything where it is."""
        return self.numbers in _IDENTITIES

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Pose) and self.numbers == other.numbers  # no -0.0: equal values, equal bytes

    def __hash__(self) -> int:
        return hash(self.numbers)

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self.rotation, self.translation)

    def __repr__(self) -> str:
        return f"Pose(rotation={digits(self.rotation)}, translation={digits(self.translation)})"


_IDENTITIES: Final = tuple(np.eye(d).tobytes() + np.zeros(d).tobytes() for d in (2, 3))


def _restored(rotation: FloatArray, translation: FloatArray) -> Pose:
    """Return the pose that was pickled, its arrays read-only again."""
    pose = object.__new__(Pose)
    pose._set(frozen(rotation), frozen(translation))
    return pose


def check_rotations(rotations: FloatArray, where: tuple[str | int, ...] = ("rotations",), *, one: bool = False) -> None:
    """Raise on the first matrix of ``(n, d, d)`` finite float64 that is no rotation.

    Decided exactly: entries of ``R^T R - I`` are computed in float64 for all matrices, and in rationals for those
    within rounding of the limit. Once they pass, det is within 1e-11 of 1 or -1, so that its float64 sign is right.

    one: `rotations` holds a single matrix and `where` is its own path.
    """
    if rotations.ndim != 3 or rotations.shape[1] != rotations.shape[2]:
        raise InvalidArrayError(f"{spell(where)} must have shape (n, d, d), got {rotations.shape}", where)
    is_suspect = np.zeros(len(rotations), np.bool_)
    with np.errstate(all="ignore"):  # huge entries overflow, and are far from orthogonal
        find_suspects(read_only(rotations), float(TOLERANCE) - _UNSURE, is_suspect)
    for index in np.flatnonzero(is_suspect):
        matrix = rotations[index]
        path = where if one else (*where, int(index))
        defect = _exact_defect(matrix)
        if defect > TOLERANCE:
            raise NotRigidError(
                f"{spell(path)} = {digits(matrix)} is no rotation: max|R^T R - I| is {_decimal(defect)}, "
                "the limit 1e-12; make it orthogonal (from a unit quaternion, say)",
                path,
            )
        if determinant([[*map(Fraction, row)] for row in matrix.tolist()]) <= 0:
            raise NotRigidError(
                f"{spell(path)} = {digits(matrix)} is a reflection: its determinant is negative; "
                "change the sign of one row, or mirror the solid itself",
                path,
            )


@kernel
def find_suspects(matrices: Any, limit: float, is_suspect: Any) -> None:
    """Fill is_suspect (n,) for matrices (n, d, d): whether max|R^T R - I| > limit as computed, or det is not positive.

    An entry of the product is a sum of d products, det a sum of d! of d; numbers that overflow are suspect.
    """
    dimension = matrices.shape[1]
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


def _exact_defect(matrix: FloatArray) -> Fraction:
    columns = [[Fraction(value) for value in column] for column in matrix.T.tolist()]
    return max(
        abs(sum((a * b for a, b in zip(first, second)), Fraction(-int(i == j))))
        for i, first in enumerate(columns)
        for j, second in enumerate(columns)
    )


def _decimal(value: Fraction) -> str:
    """Return a few digits of a fraction that may be beyond float64."""
    return repr(float(value)) if value < 10**300 else "above 1e300"
