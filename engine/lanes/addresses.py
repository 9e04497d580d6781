"""Arrays by their address: lets one kernel go through the prepared arrays of thousands of solids.

A table of addresses is made for one call, by the solids that hold the arrays, and is forgotten with it. Compiled code
makes an array of an address in no time; with the compiler disabled a plain twin does the same by ctypes.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, types
from numba import config as numba_config
from numba.extending import intrinsic

from engine.jit import inline


def plain_array_at(address: int, shape: Any, dtype: Any) -> Any:
    """Return the C-contiguous array of a shape and type that begins at `address`."""
    n_bytes = int(np.prod(shape)) * np.dtype(dtype).itemsize
    if n_bytes == 0:
        return np.empty(shape, dtype)
    return np.frombuffer((ctypes.c_char * n_bytes).from_address(int(address)), dtype).reshape(shape)


def _pointer_intrinsic(typing_context: Any, address: Any) -> Any:
    """Return an address as a pointer."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], ir.IntType(8).as_pointer())

    return types.voidptr(types.int64), generate


_pointer: Any = intrinsic(_pointer_intrinsic)


def _compiled_array_at(address: int, shape: Any, dtype: Any) -> Any:
    return carray(_pointer(address), shape, dtype)


array_at: Any = plain_array_at if numba_config.DISABLE_JIT else inline(_compiled_array_at)


def plain_int8_at(address: int, place: int) -> int:
    """Return one number of the int8 array that begins at `address`: also below a bare kernel, which makes no array."""
    return ctypes.c_int8.from_address(int(address) + int(place)).value


def _int8_intrinsic(typing_context: Any, address: Any, place: Any) -> Any:
    """Return what `plain_int8_at` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        there = builder.inttoptr(builder.add(*arguments), ir.IntType(8).as_pointer())
        return builder.sext(builder.load(there), ir.IntType(64))

    return types.int64(types.int64, types.int64), generate


int8_at: Any = plain_int8_at if numba_config.DISABLE_JIT else intrinsic(_int8_intrinsic)
