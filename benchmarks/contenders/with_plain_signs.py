"""Our own kernel of cells with plain signs: the same code, but no band around zero. As fast, and wrong.

The kernel is compiled from the same function, with the one call replaced that decides the signs.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import FunctionType
from typing import Any
from unittest import mock

import numba

from benchmarks.contenders import Prepared, make
from engine.containment import locators
from engine.containment.cells import locate as segment_parity
from engine.lanes.cells import planes_of
from engine.lanes.lanes import bits_of, count_bits
from engine.lanes.tracing import Number, Rows, traced

NAMES = {"": "ours, plain signs"}

_AS_ENGINE: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
"""Options of `engine.jit`, without a cache."""


@traced
def plain_signs(groups: Rows, group: int, x: Number, y: Number, z: Number) -> int:
    """Return what `group_parity` would be if rounding did not matter: parity without a band."""
    side, least, most = planes_of(groups, group, (x, y, z))
    return count_bits(bits_of((side < 0.0) & ((least > 0.0) | (most < 0.0)))) & 1


def _compiled(function: FunctionType, **replaced: object) -> Any:
    return numba.njit(**_AS_ENGINE)(FunctionType(function.__code__, {**function.__globals__, **replaced}))


@cache
def _same_but_for_signs() -> object:
    across = _compiled(segment_parity.parity_across.py_func, group_parity=plain_signs)
    leaves = _compiled(segment_parity.ask_leaves.py_func, parity_across=across)
    return _compiled(segment_parity.locate_by_cells.py_func, ask_leaves=leaves)


def _points(subject: Any, threads: int) -> Prepared:
    """Ours, with one compiled function replaced while it is asked; where a mesh is small, it has no cells."""
    ours, plain = make("ours", "points", subject, threads), _same_but_for_signs()

    def ask(items: Any) -> Any:
        with mock.patch.object(locators, "locate_by_cells", plain):
            return ours.ask(items)

    return replace(ours, ask=ask, share=None)


MAKERS = {"points": _points}
