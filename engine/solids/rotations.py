"""What is a rotation, decided exactly, and the rotation nearest to a matrix that almost is."""

from __future__ import annotations

from fractions import Fraction
from typing import Final

import numpy as np

from engine.compiling.jit import entry_of, kernel
from engine.errors import InvalidArrayError, NotRigidError
from engine.predicates.rational import cross, determinant
from engine.running.budget import Budget
from engine.running.parallel import run_chunks
from engine.solids.checks import digits, spell
from engine.types import BoolArray, FloatArray, read_only

TOLERANCE: Final = Fraction(1, 10**12)
"""Largest |entry| of ``R^T R - I`` of a rotation; part of the contract, compared exactly."""

USUAL: Final = float(TOLERANCE)
"""`TOLERANCE` as a float, for the filter and as a default, since a Fraction would be slow."""
MOST_TOLERANCE: Final = 0.1
ROUNDED: Final = 1e-5
"""Tolerance of entries with six digits: each is wrong by 5e-7, an entry of R^T R by 2 sqrt(3) times that at most."""

_UNSURE: Final = 2.0**-45  # more than 8 roundings of sums of three products of numbers below 1.01


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
    is right; within the widest, |det| > 0.5. where: the path of the argument; one: it is that of a single matrix.
    limit: largest magnitude of an entry of ``R^T R - I``, at most 0.1.
    """
    if rotations.ndim != 3 or rotations.shape[1] != rotations.shape[2]:
        raise InvalidArrayError(f"{spell(where)} must have shape (n, d, d), got {rotations.shape}", where)
    sure = (USUAL if limit is TOLERANCE else float(limit)) - _UNSURE
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
        defect = exact_defect(matrix)
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
    """Return whether floats prove that a read-only ``(1, d, d)`` float64 is a rotation; if False, `check_rotations`
    decides."""
    return not entry_of(find_suspects)(matrix, USUAL - _UNSURE, _UNREAD)


_MANY: Final = 1 << 12
"""Number of matrices from which on several threads check them."""
_UNREAD: Final = np.empty(1, np.bool_)


@kernel
def find_suspects(matrices: FloatArray, limit: float, is_suspect: BoolArray) -> int:
    """Set is_suspect (n,) for the matrices (n, d, d) that may be no rotations: computed max|R^T R - I| > limit, or det
    <= 0; return the number of True. An entry of the product is a sum of d products, det a sum of d! products of d
    factors; matrices whose numbers overflow are suspect."""
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


def exact_defect(matrix: FloatArray) -> Fraction:
    columns = [[Fraction(value) for value in column] for column in matrix.T.tolist()]
    return max(
        abs(sum((a * b for a, b in zip(first, second)), Fraction(-int(i == j))))
        for i, first in enumerate(columns)
        for j, second in enumerate(columns)
    )


def nearest_rotation(matrix: FloatArray) -> FloatArray:
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
    """Return the orthogonal factor of the polar decomposition of a matrix, as rows of integers in units of 2^-bits, by
    Newton's iteration X <- (X + X^-T) / 2, which squares the error. Source: N. Higham, Computing the polar
    decomposition, with applications, 1986."""
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
