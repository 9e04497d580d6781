"""Eight float32 numbers as one SIMD value: arithmetic on `Lanes` works on eight items at once, one a lane.

Code on lanes is written like code on numbers (+, -, *, comparisons, `abs`), and what would be a branch becomes
`select`. A comparison gives a `Mask` of eight truth values (&, |, ~); what is no number compares false. Constants are
written as they are. Compiled, a value is one vector register; in Python it is an array of eight numbers, with the same
results (`tracing.py`). Rows of an array are counted through all its axes but the last: row k of item i of (n, m, 8) is
m i + k.

Arrays by address let one kernel go through the prepared arrays of thousands of solids.

The owner of the arrays makes a table of their addresses, which must not outlive them. Compiled code makes an array of
an address for free; with the compiler disabled a plain twin does the same by ctypes.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba import config as numba_config
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from engine.compiling.jit import inline
from engine.lanes.tracing import (
    LANES,
    TRUTHS,
    VECTOR,
    WORD,
    Array,
    EmittedArray,
    EmittedLanes,
    EmittedMask,
    EmittedWord,
    Lanes,
    Mask,
    Number,
    Rows,
    _Traced,
    instruction,
)

_ALIGNED = 4  # of a float: numpy promises no more


@instruction(lambda value: value)
def spread(value: Number) -> Lanes:
    """Return eight copies of a number (broadcast)."""
    return np.full(LANES, value, np.float32)


def _emit_load(rows: EmittedArray, row: Any) -> EmittedLanes:
    there = rows.builder.bitcast(rows.address(row * LANES), VECTOR.as_pointer())
    return EmittedLanes(rows.builder, rows.builder.load(there, align=_ALIGNED))


@instruction(_emit_load)
def load(rows: Rows, row: int) -> Lanes:
    """Return row `row` of an array, eight numbers."""
    return rows.reshape(-1, LANES)[row].copy()


def _emit_load_lane(rows: EmittedArray, row: Any, lane: Any) -> EmittedLanes:
    number = rows.builder.load(rows.address(row * LANES + lane))
    one = rows.builder.insert_element(ir.Constant(VECTOR, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    return _emit_lane_of(EmittedLanes(rows.builder, one), 0)


@instruction(_emit_load_lane)
def load_lane(rows: Rows, row: int, lane: int) -> Lanes:
    """Return eight copies of the number in `lane` of row `row`."""
    return spread(rows.reshape(-1, LANES)[row, lane])


def _emit_store(rows: EmittedArray, row: Any, value: EmittedLanes) -> None:
    there = rows.builder.bitcast(rows.address(row * LANES), VECTOR.as_pointer())
    rows.builder.store(value.value, there, align=_ALIGNED)


@instruction(_emit_store)
def store(rows: Rows, row: int, value: Lanes) -> None:
    """Set row `row` of an array to eight numbers."""
    rows.reshape(-1, LANES)[row] = value


def _emit_lane_of(value: EmittedLanes, lane: int) -> EmittedLanes:
    places = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [lane] * LANES)
    return EmittedLanes(
        value.builder, value.builder.shuffle_vector(value.value, ir.Constant(VECTOR, ir.Undefined), places)
    )


@instruction(_emit_lane_of)
def lane_of(value: Lanes, lane: int) -> Lanes:
    """Return eight copies of the number in `lane`, a compile-time constant."""
    return spread(value[lane])


def _emit_across(value: EmittedLanes, step: int) -> EmittedLanes:
    places = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [lane ^ step for lane in range(LANES)])
    return EmittedLanes(
        value.builder, value.builder.shuffle_vector(value.value, ir.Constant(VECTOR, ir.Undefined), places)
    )


@instruction(_emit_across)
def across(value: Lanes, step: int) -> Lanes:
    """Return in each lane the number of lane ^ step; step: a compile-time constant."""
    return value[[lane ^ step for lane in range(LANES)]]


def _emit_select(mask: EmittedMask, a: Any, b: Any) -> EmittedLanes:
    a, b = (EmittedLanes.of(mask.builder, value).value for value in (a, b))
    return EmittedLanes(mask.builder, mask.builder.select(mask.value, a, b))


@instruction(_emit_select)
def select(mask: Mask, a: Lanes, b: Lanes) -> Lanes:
    """Return, lane by lane, a where the mask is true, else b."""
    return np.where(mask, np.float32(a), np.float32(b))


def _emit_root(value: EmittedLanes) -> EmittedLanes:
    function = cgutils.get_or_insert_function(
        value.builder.module, ir.FunctionType(VECTOR, [VECTOR]), f"llvm.sqrt.v{LANES}f32"
    )
    return EmittedLanes(value.builder, value.builder.call(function, [value.value]))


@instruction(_emit_root)
def root(value: Lanes) -> Lanes:
    """Return the square root of each lane."""
    return np.sqrt(value)


def _emit_bits(mask: EmittedMask) -> EmittedWord:
    return EmittedWord(mask.builder, mask.builder.zext(mask.builder.bitcast(mask.value, ir.IntType(LANES)), WORD))


@instruction(_emit_bits)
def bits_of(mask: Mask) -> int:
    """Return a mask as an integer: bit k is lane k."""
    return int(np.packbits(mask, bitorder="little")[0])


def _emit_mask(bits: EmittedWord) -> EmittedMask:
    byte = bits.builder.trunc(bits.value, ir.IntType(LANES))
    return EmittedMask(bits.builder, bits.builder.bitcast(byte, TRUTHS))


@instruction(_emit_mask)
def mask_of(bits: int) -> Mask:
    """Return the mask of the lanes whose bits are set."""
    return np.unpackbits(np.uint8(bits), bitorder="little").astype(bool)


def _emit_any(mask: EmittedMask) -> EmittedWord:
    bits = mask.builder.bitcast(mask.value, ir.IntType(LANES))
    is_some = mask.builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))
    return EmittedWord(mask.builder, mask.builder.zext(is_some, WORD))


@instruction(_emit_any)
def any_of(mask: Mask) -> int:
    """Return 1 if the mask is true in some lane, else 0."""
    return int(np.any(mask))


@instruction(lambda bits: EmittedWord(bits.builder, bits.builder.cttz(bits.value, ir.Constant(ir.IntType(1), 1))))
def lowest_bit(bits: int) -> int:
    """Return the index of the lowest bit set; bits > 0."""
    return (int(bits) & -int(bits)).bit_length() - 1


@instruction(lambda bits: EmittedWord(bits.builder, bits.builder.ctpop(bits.value)))
def count_bits(bits: int) -> int:
    """Return the number of set bits."""
    return int(bits).bit_count()


@inline
def filter_pairs(bits: int, first_lane: int, remaining: _Traced, arguments: Any) -> int:
    """Return the pairs of a 32-bit mask `bits` that pass a filter: byte k holds the partners of lane first_lane + k as
    bits. remaining(lane, *arguments): the mask of the partners that pass for a lane; called where a byte is not 0."""
    left = 0
    while bits != 0:  # bound: each turn ends a lane
        shift = lowest_bit(bits) & -LANES
        lane_bits = bits & 255 << shift
        bits ^= lane_bits
        left |= lane_bits & remaining(first_lane + shift // LANES, *arguments) << shift
    return left


# ---- of memory ------------------------------------------------------------------------------------------------------


def _emit_move(target: EmittedArray, at: Any, source: EmittedArray, first: Any, n: EmittedWord) -> None:
    cgutils.raw_memcpy(target.builder, target.address(at), source.address(first), n.value, 8)


@instruction(_emit_move)
def move(target: Array, at: int, source: Array, first: int, n: int) -> None:
    """Copy source[first : first + n] to target[at : at + n]; both are flat float64 arrays, not the same one. The caller
    guarantees that both ranges are within them."""
    target[at : at + n] = source[first : first + n]


def _emit_prefetch(array: EmittedArray, place: Any) -> None:
    builder, word = array.builder, ir.IntType(32)
    kind = ir.FunctionType(ir.VoidType(), [cgutils.voidptr_t, word, word, word])
    function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
    there = builder.bitcast(array.address(place), cgutils.voidptr_t)
    builder.call(function, [there, *(ir.Constant(word, number) for number in (0, 3, 1))])  # read, keep in cache


@instruction(_emit_prefetch)
def prefetch(array: Array, place: int) -> None:
    """Prefetch the cache line with element `place` of an array; harmless beyond its end."""


def aligned(shape: tuple[int, ...], dtype: Any) -> Any:
    """Return an uninitialised array aligned to a cache line."""
    n_bytes = math.prod(shape) * np.dtype(dtype).itemsize
    room = np.empty(n_bytes + 64, np.uint8)
    start = -room.ctypes.data % 64
    return room[start : start + n_bytes].view(dtype).reshape(shape)


# ---- for traced functions -------------------------------------------------------------------------------------------


def lesser(a: Lanes, b: Lanes) -> Lanes:
    """Return the minimum, lane by lane; b where the two are not ordered."""
    return select(a < b, a, b)


def least_of(value: Lanes) -> Lanes:
    """Return eight copies of the least of eight numbers."""
    for step in (4, 2, 1):
        value = lesser(value, across(value, step))
    return value


def greater(a: Lanes, b: Lanes) -> Lanes:
    """Return the maximum, lane by lane; b where the two are not ordered."""
    return select(a > b, a, b)


def dot(a: Sequence[Lanes], b: Sequence[Lanes]) -> Lanes:
    """Return the dot product of two triples, summed from left to right."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def any_above(pairs: Sequence[tuple[Lanes, Lanes]]) -> Mask:
    """Return the mask of lanes in which a > b for some pair (a, b)."""
    is_any = pairs[0][0] > pairs[0][1]
    for above, below in pairs[1:]:
        is_any |= above > below
    return is_any


def bytes_of(masks: Sequence[Mask]) -> tuple[int, int]:
    """Return eight masks as two 32-bit integers: byte k of the first is masks[k], of the second masks[k + 4]."""
    halves = []
    for first in (0, LANES // 2):
        bits = bits_of(masks[first])
        for place in range(1, LANES // 2):
            bits |= bits_of(masks[first + place]) << LANES * place
        halves.append(bits)
    return halves[0], halves[1]


def plain_array_at(address: int, shape: Any, dtype: Any) -> Any:
    """Return the C-contiguous array of this shape and type at a memory address, in Python."""
    n_bytes = int(np.prod(shape)) * np.dtype(dtype).itemsize
    if n_bytes == 0:
        return np.empty(shape, dtype)
    return np.frombuffer((ctypes.c_char * n_bytes).from_address(int(address)), dtype).reshape(shape)


def _array_intrinsic(typing_context: Any, address: Any, shape: Any, dtype: Any) -> Any:
    """Return Numba signature and code generator of `array_at`, the compiled form of `plain_array_at`: an array that
    does not own its memory, without reference counting."""
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
