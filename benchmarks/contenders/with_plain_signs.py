"""Our own kernels with plain signs: the same code, but no band around zero. Fast and wrong.

Cells: the kernel is compiled from the same function, with the one call replaced that decides the signs. Pairs of faces:
likewise, with the one line replaced that sets the bound, so that a sign is left open only where it is 0.0.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from textwrap import dedent
from types import FunctionType
from typing import Any

import numba

from benchmarks.contenders import Prepared, make
from engine.collision.meshes import dual_traversal, pose_batch, triangle_triangle
from engine.containment import locators
from engine.containment.cells import locate as segment_parity
from engine.lanes.cells import planes_of
from engine.lanes.lanes import bits_of, count_bits
from engine.lanes.tracing import Number, Rows, traced

_AS_ENGINE: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
"""Options of `engine.jit`, without a cache."""


@traced
def plain_signs(groups: Rows, group: int, x: Number, y: Number, z: Number) -> int:
    """Return what `group_parity` would be if rounding did not matter: parity without a band."""
    side, least, most = planes_of(groups, group, (x, y, z))
    return count_bits(bits_of((side < 0.0) & ((least > 0.0) | (most < 0.0)))) & 1


@cache
def _same_but_for_signs() -> object:
    across = _compiled(segment_parity.parity_across.py_func, group_parity=plain_signs)
    leaves = _compiled(segment_parity.ask_leaves.py_func, parity_across=across)
    return _compiled(segment_parity.locate_by_cells.py_func, ask_leaves=leaves)


def _swapped(kind: str, module: Any, name: str, other: Callable[[], Any]) -> Callable[..., Prepared]:
    """Return the maker of ours with one compiled function of a module replaced while it is asked."""

    def maker(subject: Any, threads: int) -> Prepared:
        ours, plain = make("ours", kind, subject, threads), other()

        def ask(items: Any) -> Any:
            exact = getattr(module, name)
            setattr(module, name, plain)
            try:
                return ours.ask(items)
            finally:
                setattr(module, name, exact)

        return replace(ours, ask=ask, share=None)

    return maker


@cache
def _poses_by_plain_signs() -> Any:
    source = dedent(inspect.getsource(triangle_triangle.classify_near.py_func))
    start = source.index("def ")
    bound = next(line for line in source.splitlines() if line.lstrip().startswith("bound ="))
    space = dict(vars(triangle_triangle))
    exec(source[start:].replace(bound, "    bound = 0.0"), space)
    changed = _compiled(dual_traversal.search.py_func, classify_near=numba.njit(**_AS_ENGINE)(space["classify_near"]))
    return _compiled(pose_batch.relate_poses.py_func, search=changed)


def _compiled(function: FunctionType, **replaced: object) -> Any:
    return numba.njit(**_AS_ENGINE)(FunctionType(function.__code__, {**function.__globals__, **replaced}))


MAKERS = {  # where a mesh is small, it has no cells; the package's name of collide_poses stands for the function
    "points": _swapped("points", locators, "locate_by_cells", _same_but_for_signs),
    "relations": _swapped(
        "relations", sys.modules["engine.collision.collide_poses"], "relate_poses", _poses_by_plain_signs
    ),
}
