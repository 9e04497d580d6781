"""The kinds of arrays that solids and kernels hold, and the one way to make an array read-only."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Float32Array = npt.NDArray[np.float32]
IntArray = npt.NDArray[np.int64]
Int32Array = npt.NDArray[np.int32]
Int8Array = npt.NDArray[np.int8]
"""Of locations, relations and statuses, for the most part."""
FlagArray = npt.NDArray[np.uint8]
BoolArray = npt.NDArray[np.bool_]
Scalar = TypeVar("Scalar", bound=np.generic)


def read_only(array: npt.NDArray[Scalar]) -> npt.NDArray[Scalar]:
    """Return an array of the one kind that kernels are compiled for: itself, a read-only view, or a copy."""
    flags = array.flags
    if flags.c_contiguous and not flags.writeable:
        return array
    array = array.view() if flags.c_contiguous else np.ascontiguousarray(array)
    array.setflags(write=False)
    return array
