"""Eight float32 numbers as one value: arithmetic on `Lanes` is eight items at once, one to a lane.

Code on lanes is written like code on numbers (+, -, *, comparisons, `abs`), and what would be a branch becomes
`select`. A comparison gives a `Mask` of eight truth values (&, |, ~). Compiled, a value is one vector register; with
the compiler disabled it is an array of eight numbers, with the same results.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import config as numba_config
from numba import types
from numba.extending import intrinsic, lower_builtin, models, register_model, type_callable

N_LANES: Final = 8
_FLOAT: Final = ir.FloatType()
_WORD: Final = ir.IntType(64)
_VECTOR: Final = ir.VectorType(_FLOAT, N_LANES)
_BITS: Final = ir.VectorType(ir.IntType(1), N_LANES)


class _Lanes(types.Type):  # type: ignore[misc] # numba carries no types
    def __init__(self) -> None:
        super().__init__(name="Lanes")


class _Mask(types.Type):  # type: ignore[misc]
    def __init__(self) -> None:
        super().__init__(name="Mask")


LANES: Final = _Lanes()
MASK: Final = _Mask()


@register_model(_Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


@register_model(_Mask)
class _MaskModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _BITS)


def _define(operation: Any, operands: list[Any], result: Any, emit: Callable[..., Any]) -> None:
    """Give an operator its meaning on lanes or masks: emit(builder, *operands)."""

    def typed(context: Any) -> Callable[..., Any]:
        if len(operands) == 1:
            return lambda a: result if a == operands[0] else None
        return lambda a, b: result if (a, b) == tuple(operands) else None

    def lowered(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return emit(builder, *arguments)

    type_callable(operation)(typed)
    lower_builtin(operation, *operands)(lowered)


def _magnitude(builder: Any, a: Any) -> Any:
    sign = ir.Constant(ir.VectorType(ir.IntType(32), N_LANES), [0x7FFFFFFF] * N_LANES)
    return builder.bitcast(builder.and_(builder.bitcast(a, sign.type), sign), _VECTOR)


def _compared(word: str) -> Callable[..., Any]:
    return lambda builder, a, b: builder.fcmp_ordered(word, a, b)


_define(operator.add, [LANES, LANES], LANES, lambda builder, a, b: builder.fadd(a, b))
_define(operator.sub, [LANES, LANES], LANES, lambda builder, a, b: builder.fsub(a, b))
_define(operator.mul, [LANES, LANES], LANES, lambda builder, a, b: builder.fmul(a, b))
_define(operator.neg, [LANES], LANES, lambda builder, a: builder.fneg(a))
_define(abs, [LANES], LANES, _magnitude)
for _operation, _word in ((operator.gt, ">"), (operator.lt, "<"), (operator.ge, ">="), (operator.le, "<=")):
    _define(_operation, [LANES, LANES], MASK, _compared(_word))
_define(operator.and_, [MASK, MASK], MASK, lambda builder, a, b: builder.and_(a, b))
_define(operator.or_, [MASK, MASK], MASK, lambda builder, a, b: builder.or_(a, b))
_define(operator.invert, [MASK], MASK, lambda builder, a: builder.not_(a))


def plain_spread(value: float) -> Any:
    """Return a number in all lanes."""
    return np.full(N_LANES, value, np.float32)


def plain_load(rows: Any, row: int) -> Any:
    """Return a row of rows (n, 8) float32, C-contiguous."""
    return rows[row].copy()


def plain_store(rows: Any, row: int, value: Any) -> None:
    """Set a row of rows (n, 8) float32, C-contiguous."""
    rows[row] = value


def plain_select(mask: Any, a: Any, b: Any) -> Any:
    """Return a where the mask is true, else b."""
    return np.where(mask, a, b)


def plain_bits(mask: Any) -> int:
    """Return a mask as a number, lane k as bit k."""
    return sum(1 << lane for lane in np.flatnonzero(mask).tolist())


def _spread_intrinsic(typing_context: Any, value: Any) -> Any:
    """Return what `plain_spread` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number = context.cast(builder, arguments[0], signature.args[0], types.float32)
        word = ir.IntType(32)
        one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, ir.Constant(word, 0))
        zeros = ir.Constant(ir.VectorType(word, N_LANES), [0] * N_LANES)
        return builder.shuffle_vector(one, ir.Constant(_VECTOR, ir.Undefined), zeros)

    return LANES(value), generate


def _address(context: Any, builder: Any, rows_type: Any, rows: Any, row: Any) -> Any:
    data = builder.bitcast(context.make_array(rows_type)(context, builder, rows).data, _FLOAT.as_pointer())
    there = builder.gep(data, [builder.mul(row, ir.Constant(_WORD, N_LANES))])
    return builder.bitcast(there, _VECTOR.as_pointer())


def _load_intrinsic(typing_context: Any, rows: Any, row: Any) -> Any:
    """Return what `plain_load` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        loaded = builder.load(_address(context, builder, signature.args[0], *arguments))
        loaded.align = 4  # of a float: numpy promises no more
        return loaded

    return LANES(rows, types.int64), generate


def _store_intrinsic(typing_context: Any, rows: Any, row: Any, value: Any) -> Any:
    """Do what `plain_store` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        stored = builder.store(arguments[2], _address(context, builder, signature.args[0], *arguments[:2]))
        stored.align = 4
        return context.get_dummy_value()

    return types.none(rows, types.int64, value), generate


def _select_intrinsic(typing_context: Any, mask: Any, a: Any, b: Any) -> Any:
    """Return what `plain_select` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.select(*arguments)

    return LANES(mask, a, b), generate


def _bits_intrinsic(typing_context: Any, mask: Any) -> Any:
    """Return what `plain_bits` does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.zext(builder.bitcast(arguments[0], ir.IntType(N_LANES)), _WORD)

    return types.int64(mask), generate


spread: Any = plain_spread if numba_config.DISABLE_JIT else intrinsic(_spread_intrinsic)
load: Any = plain_load if numba_config.DISABLE_JIT else intrinsic(_load_intrinsic)
store: Any = plain_store if numba_config.DISABLE_JIT else intrinsic(_store_intrinsic)
select: Any = plain_select if numba_config.DISABLE_JIT else intrinsic(_select_intrinsic)
bits_of: Any = plain_bits if numba_config.DISABLE_JIT else intrinsic(_bits_intrinsic)
