"""An order of boxes or points in which neighbours are near each other: the interleaved bits of their cells.

Source: G. M. Morton, A computer oriented geodetic data base, 1966.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from engine.types import FloatArray


def morton_codes(low: FloatArray, high: FloatArray, bits: int) -> npt.NDArray[np.uint64]:
    """Return the Morton code of the centre of each box low .. high (n, dim), n > 0, with so many bits an axis; for
    points both are these. Any order is correct, a good one is fast."""
    centers = low / 2 + high / 2
    smallest = centers.min(axis=0)
    extent = (centers / 2 - smallest / 2).max(axis=0)
    extent[extent == 0.0] = 1.0
    with np.errstate(all="ignore"):
        cells = np.nan_to_num((centers / 2 - smallest / 2) / extent * (2**bits - 1), nan=0.0)
    cells = np.clip(cells, 0, 2**bits - 1).astype(np.uint64)
    key = np.zeros(len(low), np.uint64)
    dimension = low.shape[1]
    for bit in range(bits):
        for k in range(dimension):
            key |= ((cells[:, k] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(bit * dimension + k)
    return key
