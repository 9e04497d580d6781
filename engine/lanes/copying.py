"""Copies runs of numbers from one flat array to another as memory, which compiled loops over indices do not become."""

from __future__ import annotations

from typing import Any

from numba import config as numba_config
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


def plain_move(target: Any, at: int, source: Any, first: int, n: int) -> None:
    """Set n numbers of `target` from `at` on to those of `source` from `first` on.

    Flat float64 arrays, not the same one; the caller guarantees that both places are within them.
    """
    target[at : at + n] = source[first : first + n]


def _move_intrinsic(typing_context: Any, target: Any, at: Any, source: Any, first: Any, n: Any) -> Any:
    """Do what `plain_move` does (llvm.memcpy)."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        def place(array: int) -> Any:
            data = context.make_array(signature.args[array])(context, builder, arguments[array]).data
            return builder.gep(data, [arguments[array + 1]])

        cgutils.raw_memcpy(builder, place(0), place(2), arguments[4], 8)
        return context.get_dummy_value()

    return types.none(target, types.int64, source, types.int64, types.int64), generate


move: Any = plain_move if numba_config.DISABLE_JIT else intrinsic(_move_intrinsic)
