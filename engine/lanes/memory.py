"""What compiled loops do not make of memory by themselves: copies of runs, and lines of the cache asked for ahead."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils

from engine.lanes.tracing import Array, EmittedArray, EmittedWord, instruction


def _emit_move(target: EmittedArray, at: Any, source: EmittedArray, first: Any, n: EmittedWord) -> None:
    cgutils.raw_memcpy(target.builder, target.address(at), source.address(first), n.value, 8)


@instruction(_emit_move)
def move(target: Array, at: int, source: Array, first: int, n: int) -> None:
    """Set n numbers of `target` from `at` on to those of `source` from `first` on.

    Flat float64 arrays, not the same one; the caller guarantees that both places are within them.
    """
    target[at : at + n] = source[first : first + n]


def _emit_prefetch(array: EmittedArray, place: Any) -> None:
    builder, word = array.builder, ir.IntType(32)
    kind = ir.FunctionType(ir.VoidType(), [cgutils.voidptr_t, word, word, word])
    function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
    there = builder.bitcast(array.address(place), cgutils.voidptr_t)
    builder.call(function, [there, *(ir.Constant(word, number) for number in (0, 3, 1))])  # to read, to be kept


@instruction(_emit_prefetch)
def prefetch(array: Array, place: int) -> None:
    """Ask for the line of the cache that holds number `place` of an array, so that a kernel works on one item while
    those of the next are on their way; beyond the end is harmless."""
