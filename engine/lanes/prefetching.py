"""Asks for memory before it is read, so that a kernel works on one item while those of the next are on their way."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import config as numba_config
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


def plain_prefetch(array: Any, place: int) -> None:
    """Ask for the line of the cache that holds number `place` of a C-contiguous array; beyond its end is harmless."""


def _prefetch_intrinsic(typing_context: Any, array: Any, place: Any) -> Any:
    """Do what `plain_prefetch` does (llvm.prefetch: to read, to be kept)."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        word, pointer = ir.IntType(32), cgutils.voidptr_t
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        there = builder.bitcast(builder.gep(data, [arguments[1]]), pointer)
        kind = ir.FunctionType(ir.VoidType(), [pointer, word, word, word])
        prefetch = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        builder.call(prefetch, [there, *(ir.Constant(word, number) for number in (0, 3, 1))])
        return context.get_dummy_value()

    return types.none(array, types.int64), generate


prefetch: Any = plain_prefetch if numba_config.DISABLE_JIT else intrinsic(_prefetch_intrinsic)
