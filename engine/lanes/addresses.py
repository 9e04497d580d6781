"""Arrays by their address: lets one kernel go through the prepared arrays of thousands of solids.

A table of addresses is made by what holds the arrays, and kept no longer than these. Compiled code makes an array of an
address in no time; with the compiler disabled a plain twin does the same by ctypes.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numba import config as numba_config
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


def plain_array_at(address: int, shape: Any, dtype: Any) -> Any:
    """Return the C-contiguous array of a shape and type that begins at `address`."""
    n_bytes = int(np.prod(shape)) * np.dtype(dtype).itemsize
    if n_bytes == 0:
        return np.empty(shape, dtype)
    return np.frombuffer((ctypes.c_char * n_bytes).from_address(int(address)), dtype).reshape(shape)


def _array_intrinsic(typing_context: Any, address: Any, shape: Any, dtype: Any) -> Any:
    """Return what `plain_array_at` does; nothing is counted."""
    made = types.Array(dtype.dtype, len(shape), "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        from numba.np.arrayobj import populate_array  # 0.1 s to import, and only the compiler needs it

        array = context.make_array(made)(context, builder)
        sizes = cgutils.unpack_tuple(builder, arguments[1])
        item = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(made.dtype)))
        strides = [item]
        for size in sizes[:0:-1]:
            strides.insert(0, builder.mul(strides[0], size))
        data = builder.inttoptr(arguments[0], array.data.type)
        populate_array(array, data, sizes, strides, item, None)
        return array._getvalue()

    return made(types.int64, shape, dtype), generate


array_at: Any = plain_array_at if numba_config.DISABLE_JIT else intrinsic(_array_intrinsic)
