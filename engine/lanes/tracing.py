"""Functions of eight numbers at once that are written once, and run both in compiled code and in Python.

A `traced` function is plain Python on lanes (`lanes.py`): called from Python it runs on arrays of eight float32. Called
from compiled code it runs once, while the caller is being compiled, and is handed stand-ins for its arguments, whose
operators write one vector instruction each, in the order of the source. Its loops have a number of turns known then,
its lists and tuples leave nothing behind, and the compiler has no types to find out but those of its arguments:

    traced     w = [middle[k] - boxes[k] for k in range(3)]                 stand-in - stand-in, three times
    compiled   %.1 = fsub <8 x float> %m.0, %b.0     %.2 = fsub ...         vsubps, three times

An operation that `lanes.py` defines by `instruction` has two forms, on arrays and on stand-ins. What is annotated says
what compiled code hands over: `Rows` (a C-contiguous float32 array whose last axis has eight numbers), `int`, `Number`
(a float, rounded to float32, in all lanes), `Triple` (three of these), `Lanes` or `Mask`; `Array`: of any numbers.
"""

from __future__ import annotations

import functools
import inspect
import operator
from collections.abc import Callable
from typing import Any, Final, TypeAlias

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import _Intrinsic
from numba.extending import lower_builtin, models, register_model, type_callable

LANES: Final = 8
FLOAT: Final = ir.FloatType()
WORD: Final = ir.IntType(64)
VECTOR: Final = ir.VectorType(FLOAT, LANES)
TRUTHS: Final = ir.VectorType(ir.IntType(1), LANES)

Array: TypeAlias = Any
Rows: TypeAlias = Any
Lanes: TypeAlias = Any
Mask: TypeAlias = Any
Number: TypeAlias = Any
Triple: TypeAlias = tuple[Number, Number, Number]


class Emitted:
    """A stand-in for a value of traced code: the LLVM value, and the builder that appends instructions to the code
    being generated."""

    __array_ufunc__ = None  # numpy leaves the operators to the stand-in

    def __init__(self, builder: Any, value: Any) -> None:
        self.builder, self.value = builder, value

    @classmethod
    def of(cls, builder: Any, number: Any) -> Any:
        """Return `number` unchanged if it is a stand-in of this type already, else as a constant."""
        return number if isinstance(number, cls) else cls(builder, cls.constant(number))

    @staticmethod
    def constant(number: Any) -> Any:
        """Return a Python number as a constant of this type."""
        raise TypeError(f"an array or a mask was expected, not {number!r}")


def _writes(name: str) -> Any:
    """Return a binary operator of stand-ins that emits the LLVM instruction `name` and returns a stand-in of the left
    operand's type."""

    def write(a: Any, b: Any) -> Any:
        return type(a)(a.builder, getattr(a.builder, name)(a.value, a.of(a.builder, b).value))

    return write


def _compares(word: str) -> Any:
    """Return a comparison operator of stand-ins, lane by lane, false for NaN, that returns an `EmittedMask`; word: <,
    <=, > or >=."""

    def write(a: Any, b: Any) -> EmittedMask:
        return EmittedMask(a.builder, a.builder.fcmp_ordered(word, a.value, a.of(a.builder, b).value))

    return write


class EmittedArray(Emitted):
    """A stand-in for a C-contiguous array, represented by its base address."""

    def address(self, place: Any) -> Any:
        """Return the address of element number `place`, counted through all axes."""
        return self.builder.gep(self.value, [EmittedWord.of(self.builder, place).value])


class EmittedWord(Emitted):
    """A stand-in for an int64."""

    __add__, __mul__, __lshift__ = _writes("add"), _writes("mul"), _writes("shl")
    __and__, __or__ = _writes("and_"), _writes("or_")
    __radd__, __rmul__ = __add__, __mul__

    @staticmethod
    def constant(number: Any) -> Any:
        """Return a whole number as an int64 constant."""
        return ir.Constant(WORD, number)


class EmittedMask(Emitted):
    """A stand-in for eight truth values."""

    __and__, __or__ = _writes("and_"), _writes("or_")

    def __invert__(self) -> EmittedMask:
        return EmittedMask(self.builder, self.builder.not_(self.value))


class EmittedLanes(Emitted):
    """A stand-in for eight float32."""

    __add__, __sub__ = _writes("fadd"), _writes("fsub")
    __mul__, __truediv__ = _writes("fmul"), _writes("fdiv")
    __gt__, __lt__, __ge__, __le__ = _compares(">"), _compares("<"), _compares(">="), _compares("<=")

    @staticmethod
    def constant(number: Any) -> Any:
        """Return a constant of eight copies of a number."""
        return ir.Constant(VECTOR, [ir.Constant(FLOAT, float(number))] * LANES)

    def __rsub__(self, other: Any) -> Any:
        return self.of(self.builder, other) - self

    def __neg__(self) -> EmittedLanes:
        return EmittedLanes(self.builder, self.builder.fneg(self.value))

    def __abs__(self) -> EmittedLanes:
        words = ir.VectorType(ir.IntType(32), LANES)
        bits = self.builder.and_(self.builder.bitcast(self.value, words), ir.Constant(words, [0x7FFFFFFF] * LANES))
        return EmittedLanes(self.builder, self.builder.bitcast(bits, VECTOR))


# ---- as types of compiled code --------------------------------------------------------------------------------------


class _LanesType(types.Type):  # type: ignore[misc] # numba carries no types
    pass


class _MaskType(types.Type):  # type: ignore[misc]
    pass


_LANES: Final = _LanesType("Lanes")
_MASK: Final = _MaskType("Mask")
_NUMBERS: Final = types.UniTuple(types.float32, 3)
_TYPES: Final = {
    "int": types.int64,
    "Number": types.float32,
    "Triple": _NUMBERS,
    "Lanes": _LANES,
    "Mask": _MASK,
    "None": types.none,
    "tuple[int, int]": types.UniTuple(types.int64, 2),
}
"""Numba types of annotations; an array keeps its own type."""
_ROUNDED: Final[dict[str, Callable[[Any], Any]]] = {
    "Number": np.float32,
    "Triple": lambda numbers: tuple(map(np.float32, numbers)),
}
"""Conversions of arguments in a call from Python, which compiled callers do by type."""
register_model(_LanesType)(lambda manager, kind: models.PrimitiveModel(manager, kind, VECTOR))
register_model(_MaskType)(lambda manager, kind: models.PrimitiveModel(manager, kind, TRUTHS))


def _stand_in(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Return the stand-in for an argument of a traced function. kind: its Numba type, an array or one of `_TYPES`;
    value: its LLVM value."""
    if isinstance(kind, types.Array):
        return EmittedArray(builder, context.make_array(kind)(context, builder, value).data)
    if kind == _NUMBERS:
        numbers = (builder.extract_value(value, place) for place in range(3))
        return tuple(_stand_in(context, builder, types.float32, number) for number in numbers)
    if kind == types.float32:
        undefined, places = ir.Constant(VECTOR, ir.Undefined), ir.VectorType(ir.IntType(32), LANES)
        one = builder.insert_element(undefined, value, ir.Constant(ir.IntType(32), 0))
        return EmittedLanes(builder, builder.shuffle_vector(one, undefined, ir.Constant(places, [0] * LANES)))
    return {_LANES: EmittedLanes, _MASK: EmittedMask, types.int64: EmittedWord}[kind](builder, value)


class _Traced(_Intrinsic):  # type: ignore[misc]
    """A function that Numba compiles by tracing: while a caller is compiled, it (or `emit` if given) is called once
    with stand-ins (`Emitted`) for its arguments, whose operators append LLVM instructions to the caller's code. Called
    from Python with numpy arrays, it runs as it is."""

    def __init__(self, function: Callable[..., Any], emit: Callable[..., Any] | None = None) -> None:
        signature = inspect.signature(function)
        self._function, self._emit = function, emit or function
        self._kinds = [parameter.annotation for parameter in signature.parameters.values()]
        self._result = _TYPES[signature.return_annotation]

        def typed(context: Any, *arguments: Any) -> Any:
            return self._typed(arguments)

        functools.update_wrapper(typed, function)
        first = inspect.Parameter("context", inspect.Parameter.POSITIONAL_ONLY)
        typed.__signature__ = signature.replace(parameters=[first, *signature.parameters.values()])  # type: ignore[attr-defined]
        super().__init__(function.__name__, typed)
        self._register()

    def __call__(self, *arguments: Any) -> Any:
        """Generate code if an argument is `Emitted`, else run the function on numpy arrays."""
        if any(isinstance(argument, Emitted) for argument in arguments):
            return self._emit(*arguments)
        with np.errstate(all="ignore"):
            return self._function(
                *(_ROUNDED[kind](value) if kind in _ROUNDED else value for kind, value in zip(self._kinds, arguments))
            )

    def _typed(self, arguments: tuple[Any, ...]) -> Any:
        """Return the Numba signature for these argument types and the code generator; None, which Numba reports as a
        type error, if they do not fit the annotations."""
        kinds = [_TYPES.get(kind, given) for kind, given in zip(self._kinds, arguments, strict=True)]
        for kind, given in zip(self._kinds, kinds):
            if kind in ("Array", "Rows") and not (isinstance(given, types.Array) and given.layout == "C"):
                return None
            if kind == "Rows" and given.dtype != types.float32:
                return None

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            emitted = self._emit(*(_stand_in(context, builder, *pair) for pair in zip(signature.args, values)))
            if emitted is None:
                return context.get_dummy_value()
            if isinstance(emitted, tuple):
                return cgutils.pack_array(builder, [part.value for part in emitted])
            return emitted.value

        return self._result(*kinds), generate


def traced(function: Callable[..., Any]) -> Any:
    """Return a function on `Lanes` that runs in Python and generates its code in compiled callers."""
    return _Traced(function)


def instruction(emit: Callable[..., Any]) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator: the function runs in Python, and `emit` generates the code in compiled callers."""
    return lambda function: _Traced(function, emit)


def _define(operation: Any, operands: list[Any], result: Any) -> None:
    """Define an operator on lanes or masks for compiled functions. operands, result: their Numba types."""

    def typed(context: Any) -> Callable[..., Any]:
        if len(operands) == 1:
            return lambda a: result if a == operands[0] else None
        return lambda a, b: result if [a, b] == operands else None

    def lowered(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return operation(*(_stand_in(context, builder, *pair) for pair in zip(operands, values))).value

    type_callable(operation)(typed)
    lower_builtin(operation, *operands)(lowered)


_OPERATORS: tuple[tuple[tuple[Any, ...], list[Any], Any], ...] = (
    ((operator.add, operator.sub, operator.mul), [_LANES, _LANES], _LANES),
    ((operator.neg, abs), [_LANES], _LANES),
    ((operator.gt, operator.lt, operator.ge, operator.le), [_LANES, _LANES], _MASK),
    ((operator.and_, operator.or_), [_MASK, _MASK], _MASK),
    ((operator.invert,), [_MASK], _MASK),
)
for _operations, _operands, _result in _OPERATORS:
    for _operation in _operations:
        _define(_operation, _operands, _result)
