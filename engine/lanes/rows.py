"""Vectors of eight float32 in compiled code: what the intrinsics of `*_lanes.py` are written with.

Every function here emits instructions; `builder` is llvmlite's.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from llvmlite import ir
from numba.core import cgutils

LANES: Final = 8
FLOAT: Final = ir.FloatType()
WORD: Final = ir.IntType(64)
VECTOR: Final = ir.VectorType(FLOAT, LANES)


def first_row(context: Any, builder: Any, array_type: Any, array: Any, item: Any, n_rows: int) -> Any:
    """Return where item number `item` of an array (n, n_rows, 8) begins."""
    start = builder.bitcast(context.make_array(array_type)(context, builder, array).data, FLOAT.as_pointer())
    return builder.gep(start, [builder.mul(item, ir.Constant(WORD, n_rows * LANES))])


def load_row(builder: Any, first: Any, place: int) -> Any:
    """Return row number `place` behind `first`."""
    there = builder.gep(first, [ir.Constant(WORD, place * LANES)])
    loaded = builder.load(builder.bitcast(there, VECTOR.as_pointer()))
    loaded.align = 4  # of a float: numpy promises no more
    return loaded


def store_row(builder: Any, first: Any, place: int, vector: Any) -> None:
    """Write row number `place` behind `first`."""
    there = builder.gep(first, [ir.Constant(WORD, place * LANES)])
    builder.store(vector, builder.bitcast(there, VECTOR.as_pointer())).align = 4


def spread(builder: Any, vector: Any, lane: int) -> Any:
    """Return one lane of a vector in all lanes."""
    lanes = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [lane] * LANES)
    return builder.shuffle_vector(vector, ir.Constant(VECTOR, ir.Undefined), lanes)


def spread_number(builder: Any, value: Any) -> Any:
    """Return a float32 in all lanes."""
    one = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    return spread(builder, one, 0)


def absolute(builder: Any, vector: Any) -> Any:
    """Return the magnitudes."""
    words = ir.VectorType(ir.IntType(32), LANES)
    bits = builder.and_(builder.bitcast(vector, words), ir.Constant(words, [0x7FFFFFFF] * LANES))
    return builder.bitcast(bits, VECTOR)


def dot(builder: Any, w: list[Any], x: list[Any]) -> Any:
    """Return the products of two triples of vectors, lane by lane."""
    a, b, c = (builder.fmul(left, right) for left, right in zip(w, x, strict=True))
    return builder.fadd(builder.fadd(a, b), c)


def any_above(builder: Any, pairs: list[tuple[Any, Any]]) -> Any:
    """Return in which lanes the first vector of some pair is greater than the second; never where one is no number."""
    found = None
    for greater, less in pairs:
        is_above = builder.fcmp_ordered(">", greater, less)
        found = is_above if found is None else builder.or_(found, is_above)
    return found


def bits_without(builder: Any, lanes: Any) -> Any:
    """Return an int64 with a bit for each of eight lanes that is not set in `lanes`."""
    return builder.zext(builder.bitcast(builder.not_(lanes), ir.IntType(LANES)), WORD)


def bits_by_row(builder: Any, pairs_of: Callable[[int], list[tuple[Any, Any]]]) -> Any:
    """Return two int64 with a byte for each of eight lanes: the lanes in which no pair of ``pairs_of(lane)`` parts."""
    halves = []
    for half in range(2):
        bits = None
        for place in range(4):
            row = bits_without(builder, any_above(builder, pairs_of(4 * half + place)))
            row = builder.shl(row, ir.Constant(WORD, LANES * place))
            bits = row if bits is None else builder.or_(bits, row)
        halves.append(bits)
    return cgutils.pack_array(builder, halves)
