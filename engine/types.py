"""Small shared types: the kinds of arrays that solids and kernels hold, points and planes as named tuples, three-valued
locations, five relations, signs, the report.

Named tuples carry one item through compiled code (a `Point3` is loaded from a row of an array at the head of a loop);
many items are flat arrays.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Final, Literal, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Float32Array = npt.NDArray[np.float32]
IntArray = npt.NDArray[np.int64]
Int32Array = npt.NDArray[np.int32]
Int8Array = npt.NDArray[np.int8]
"""Mostly codes: locations, relations, statuses."""
FlagArray = npt.NDArray[np.uint8]
BoolArray = npt.NDArray[np.bool_]
Scalar = TypeVar("Scalar", bound=np.generic)


def read_only(array: npt.NDArray[Scalar]) -> npt.NDArray[Scalar]:
    """Return an array as C-contiguous and read-only, the one type for which kernels are compiled: itself, a view, or a
    copy."""
    flags = array.flags
    if flags.c_contiguous and not flags.writeable:
        return array
    array = array.view() if flags.c_contiguous else np.ascontiguousarray(array)
    array.setflags(write=False)
    return array


class Point2(NamedTuple):
    """A point of the plane."""

    x: float
    y: float


class Point3(NamedTuple):
    """A point of space."""

    x: float
    y: float
    z: float


class HalfSpace3(NamedTuple):
    """The half-space a x + b y + c z + d >= 0; (a, b, c) points inward."""

    a: float
    b: float
    c: float
    d: float


UNDECIDED: Final = 2
"""Result of a predicate instead of -1, 0, 1 where a filter cannot prove the sign, or an exponent is out of range."""
OPEN: Final = 2
"""Status of an item that a kernel leaves to the exact fallback."""


class Location(IntEnum):
    """Where a point lies with respect to a solid, a closed set: BOUNDARY counts as contained."""

    OUTSIDE = -1
    BOUNDARY = 0
    INSIDE = 1


class Relation(IntEnum):
    """How two bodies relate; the first line that is true decides. Batches hold these as int8."""

    DISJOINT = 0
    FIRST_INSIDE_SECOND = 1
    SECOND_INSIDE_FIRST = 2
    OVERLAPPING = 3
    TOUCHING = 4

    @property
    def label(self) -> str:
        """The name used in JSON, for example ``first_inside_second``."""
        return self.name.lower()


class Rcc8(IntEnum):
    """The eight relations of the region connection calculus; "inside" and "around" are those of the first body."""

    DC = 0
    EC = 1
    PO = 2
    EQ = 3
    TPP = 4
    NTPP = 5
    TPPI = 6
    NTPPI = 7

    @property
    def label(self) -> str:
        """The usual name, for example ``TPPi``."""
        return self.name.replace("PPI", "PPi")

    @property
    def swapped(self) -> Rcc8:
        """The relation of the second body to the first."""
        swap = {Rcc8.TPP: Rcc8.TPPI, Rcc8.NTPP: Rcc8.NTPPI, Rcc8.TPPI: Rcc8.TPP, Rcc8.NTPPI: Rcc8.NTPP}
        return swap.get(self, self)


@dataclass(frozen=True, slots=True)
class Accuracy:
    """What one call reports of its own accuracy and cost.

    Attributes
    ----------
    decisions : str
        "exact", or "float64" where a caller's own callable decides.
    coordinates_ulp : float or None
        Bound on each constructed coordinate in units in the last place; None where none is constructed.
    n_items : int
        Items asked for (points, segments, poses, pairs, contours).
    n_beyond_filter : int
        Items that the floating-point filter left open (an upper bound where a kernel counts by stages).
    n_rational : int
        Of those, the items that needed rational arithmetic.
    method : str
        The method chosen, a stable short name.
    """

    decisions: Literal["exact", "float64"]
    coordinates_ulp: float | None
    n_items: int
    n_beyond_filter: int
    n_rational: int
    method: str
