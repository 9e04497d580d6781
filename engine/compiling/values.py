"""Parts of what LLVM knows as a whole: a tuple or an array given by what is in it, put together where it must be."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from llvmlite.ir.instructions import InsertValue
from numba import types

NITEMS, ITEMSIZE, DATA, SHAPE, STRIDES = range(2, 7)
"""Where numba keeps what in an array; before them who owns it, and the Python object."""


class Parts(ir.Value):  # type: ignore[misc] # llvmlite carries no types
    """A struct or an array given by what is in it; it is put together where it is used as a whole, if ever."""

    def __init__(self, kind: Any, parts: list[Any]) -> None:
        self.type, self.parts = kind, parts


def known_part(value: Any, index: int) -> Any:
    """Return a part of a value if it can be seen, else None."""
    while isinstance(value, InsertValue):
        if len(value.indices) != 1:
            return None
        if value.indices[0] == index:
            return value.value
        value = value.aggregate
    return value.parts[index] if isinstance(value, Parts) else None


def part(builder: Any, value: Any, *path: int) -> Any:
    """Return a part of a value, of which nothing is written if it can be seen."""
    for index in path:
        found = known_part(value, index)
        value = builder.extract_value(value, index) if found is None else found
    return value


def is_plain(kind: Any) -> bool:
    """Say whether all of an array follows from its data and shape, and its items are plain numbers."""
    if not isinstance(kind, types.Array) or kind.layout != "C" or not kind.aligned:
        return False
    return isinstance(kind.dtype, (types.Integer, types.Float, types.Boolean))


def plain_array(context: Any, builder: Any, kind: Any, data: Any, shape: list[Any]) -> Parts:
    """Return a C array that nobody owns."""
    whole = context.get_value_type(kind)
    size = whole.elements[ITEMSIZE](context.get_abi_sizeof(context.get_data_type(kind.dtype)))
    strides = [size]
    for count in shape[:0:-1]:
        strides.insert(0, builder.mul(strides[0], count))
    items = shape[0]
    for count in shape[1:]:
        items = builder.mul(items, count)
    nobody = [ir.Constant(pointer, None) for pointer in whole.elements[:NITEMS]]
    tuples = [Parts(whole.elements[SHAPE], shape), Parts(whole.elements[STRIDES], strides)]
    return Parts(whole, [*nobody, items, size, data, *tuples])
