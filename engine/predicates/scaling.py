"""Brings a whole scene by one exact power of two into the range in which kernels are exact.

Points are multiplied by 2^-e, offsets of planes too, and each plane row by a power of two of its own: signs, orders and
parameters do not change, coordinates of the result are multiplied by 2^e. A scaling that would round any number is not
done; the kernels then leave items outside of their range open. Results that scaling back rounds to a subnormal number,
or up to the smallest normal one, would be rounded twice, so they are settled again by rational arithmetic.
"""

from __future__ import annotations

from math import frexp
from typing import Final

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray, read_only
from engine.predicates.expansion import LARGEST, SMALLEST

COMFORTABLE: Final = 64
"""Scenes whose largest coordinate lies within 2^-64 .. 2^64 stay as they are; kernels are exact to 2^-120 .. 2^120."""
SMALLEST_NORMAL: Final = 2.0**-1022


def largest_of(*arrays: FloatArray) -> float:
    """Return the largest magnitude of any coordinate, no finite number where one is none."""
    return max((max(array.max().item(), -array.min().item()) for array in arrays if array.size), default=0.0)


def are_all_safe(numbers: FloatArray) -> bool:
    """Tell whether every number is what `is_safe` wants."""
    sizes = np.abs(numbers)
    return bool(((sizes == 0.0) | ((sizes >= SMALLEST) & (sizes <= LARGEST))).all())


def exponent_of(*arrays: FloatArray) -> int:
    """Return e such that the largest coordinate is below 2^e, and 0 where no scaling is needed."""
    return exponent_above(largest_of(*arrays))


def exponent_above(largest: float) -> int:
    """Return e such that a coordinate is below 2^e, and 0 where no scaling is needed."""
    exponent = frexp(largest)[1]
    return 0 if largest == 0.0 or abs(exponent) <= COMFORTABLE else exponent


def shifted(array: FloatArray, exponent: int | IntArray) -> FloatArray | None:
    """Return array 2^exponent, read-only as the arrays of callers are, if that is exact for every number, else None."""
    if isinstance(exponent, int) and exponent == 0:
        return read_only(array)
    with np.errstate(all="ignore"):
        result: FloatArray = np.ldexp(array, exponent)
        result.setflags(write=False)
        return result if bool((np.ldexp(result, -exponent) == array).all()) else None


def balanced_rows(rows: FloatArray, exponent: int) -> FloatArray | None:
    """Return plane rows for points multiplied by 2^-exponent, each times a power of two; None if that is not exact."""
    offsets = shifted(rows[:, -1], -exponent)
    if offsets is None:
        return None
    result = rows.copy()
    result[:, -1] = offsets
    own = np.frexp(np.abs(rows[:, :-1]).max(axis=1))[1].astype(np.int64)
    own[np.abs(own) <= COMFORTABLE] = 0
    if not own.any():
        return result
    for i_row in np.flatnonzero(own):
        better = shifted(result[i_row], -int(own[i_row]))
        if better is not None:  # else: the row stays outside of the kernels' range
            result[i_row] = better
    return result


def scaled_back(points: FloatArray, exponent: int) -> tuple[FloatArray, BoolArray]:
    """Return points 2^exponent and which of them may have been rounded twice.

    Those are what this rounds: up to the smallest normal number, that one included. Where nothing is rounded here, the
    nearest double of all exponents is the nearest of those that there are.
    """
    with np.errstate(all="ignore"):
        result: FloatArray = np.ldexp(points, exponent)
        doubtful = (np.abs(result) <= SMALLEST_NORMAL) & (np.ldexp(result, -exponent) != points)
    return result, doubtful.any(axis=1)
