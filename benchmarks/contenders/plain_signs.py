"""Our own cells with plain signs: the same code, but no band around zero and nothing exact behind it. Fast and wrong.

The kernel is compiled from the same function, with the one call replaced that decides the signs.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import FunctionType

import numba
import numpy as np

from benchmarks.contenders import Prepared
from engine.containment import locators, segment_parity
from engine.containment.cell_lanes import plain_signs


@cache
def _same_but_for_signs() -> object:
    exact = segment_parity.locate_by_cells.py_func
    changed = FunctionType(exact.__code__, {**exact.__globals__, "group_parity": plain_signs}, "locate_by_plain_signs")
    return numba.njit(nogil=True, error_model="numpy")(changed)  # as engine.jit, without a cache


def with_plain_signs(ours: Prepared) -> Prepared:
    """Return our own contender, whose cells are built, with plain signs."""
    plain = _same_but_for_signs()

    def ask(points: np.ndarray) -> np.ndarray:
        exact, locators.locate_by_cells = locators.locate_by_cells, plain
        try:
            return ours.ask(points)
        finally:
            locators.locate_by_cells = exact

    return replace(ours, ask=ask)
