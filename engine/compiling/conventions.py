"""How compiled functions call each other: an array is its data and shape, and who cannot raise is not asked.

numba hands over an array as seven numbers or more, and asks after each call whether the other has raised.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from llvmlite import ir
from llvmlite.ir.instructions import InsertValue
from numba import types
from numba.core import cgutils
from numba.core.callconv import RETCODE_OK, CPUCallConv
from numba.core.datamodel import ArgPacker
from numba.core.funcdesc import PythonFunctionDescriptor
from numba.core.imputils import user_function

from engine.compiling.values import DATA, SHAPE, Parts, is_plain, part, plain_array

CANNOT_RAISE: set[str] = set()
"""Names of inner functions that always return."""


class PlainDescriptor(PythonFunctionDescriptor):  # type: ignore[misc] # numba carries no types
    """What numba notes of a function, of one whose arguments are handed over as `_Packing` does."""

    __slots__ = ()


class _Packing:
    """Hands over arguments as a flat list, arrays as data and shape; it stands in for numba's ArgPacker."""

    def __init__(self, context: Any, kinds: Any) -> None:
        self._context, self._kinds = context, kinds

    @property
    def argument_types(self) -> list[Any]:
        return [kind for given in self._kinds for kind in self._types(given)]

    def _types(self, kind: Any) -> Iterator[Any]:
        if isinstance(kind, types.BaseTuple):
            for inner in kind:
                yield from self._types(inner)
        elif is_plain(kind):
            array = self._context.get_value_type(kind)
            yield array.elements[DATA]
            yield from [array.elements[SHAPE].element] * kind.ndim
        else:
            yield from self._other(kind).argument_types

    def _other(self, kind: Any) -> ArgPacker:
        return ArgPacker(self._context.data_model_manager, [kind])

    def as_arguments(self, builder: Any, values: Any) -> list[Any]:
        return [item for kind, value in zip(self._kinds, values) for item in self._flat(builder, kind, value)]

    def _flat(self, builder: Any, kind: Any, value: Any) -> Iterator[Any]:
        if isinstance(kind, types.BaseTuple):
            for index, inner in enumerate(kind):
                yield from self._flat(builder, inner, part(builder, value, index))
        elif is_plain(kind):
            yield part(builder, value, DATA)
            for axis in range(kind.ndim):
                yield part(builder, value, SHAPE, axis)
        else:
            yield from self._other(kind).as_arguments(builder, [value])

    def from_arguments(self, builder: Any, arguments: Any) -> list[Any]:
        rest = iter(arguments)
        return [self._value(builder, kind, rest) for kind in self._kinds]

    def _value(self, builder: Any, kind: Any, rest: Iterator[Any]) -> Any:
        if isinstance(kind, types.BaseTuple):
            inner = [self._value(builder, one, rest) for one in kind]
            return Parts(self._context.get_value_type(kind), inner)
        if is_plain(kind):
            return plain_array(self._context, builder, kind, next(rest), [next(rest) for _ in range(kind.ndim)])
        other = self._other(kind)
        return other.from_arguments(builder, [next(rest) for _ in other.argument_types])[0]

    def assign_names(self, arguments: Any, names: Any) -> None:
        """Leave them their numbers."""


class Convention(CPUCallConv):  # type: ignore[misc]
    """numba's own, that notes which functions may raise, and stores what is returned part by part."""

    def _return_errcode_raw(self, builder: Any, code: Any) -> None:
        if code is not RETCODE_OK:
            builder.function.may_raise = True
        super()._return_errcode_raw(builder, code)

    def return_value(self, builder: Any, value: Any) -> None:
        place = self._get_return_argument(builder.function)
        while isinstance(value, InsertValue) and len(value.indices) == 1:
            builder.store(value.value, cgutils.gep_inbounds(builder, place, 0, value.indices[0]))
            value = value.aggregate
        if not (isinstance(value, ir.Constant) and value.constant is ir.Undefined):
            builder.store(value, place)
        self._return_errcode_raw(builder, RETCODE_OK)


class PlainConvention(Convention):
    """The convention of calls to inner functions."""

    def _get_arg_packer(self, kinds: Any) -> _Packing:
        return _Packing(self.context, kinds)


def calling(descriptor: PlainDescriptor, libraries: Any) -> Callable[..., Any]:
    """Return what writes a call of an inner function, whoever the caller is."""
    usual = user_function(descriptor, libraries)

    def call(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        convention = PlainConvention(context)
        function = declare(convention, builder.module, descriptor)
        if descriptor.mangled_name not in CANNOT_RAISE:
            status, value = convention.call_function(builder, function, descriptor.restype, descriptor.argtypes, values)
            with cgutils.if_unlikely(builder, status.is_error):
                context.call_conv.return_status_propagate(builder, status)
            return value
        place = cgutils.alloca_once(builder, function.args[0].type.pointee)
        handed = convention._get_arg_packer(descriptor.argtypes).as_arguments(builder, values)
        builder.call(function, [place, ir.Constant(function.args[1].type, None), *handed])
        return context.get_returned_value(builder, descriptor.restype, builder.load(place))

    call.signature, call.libs = usual.signature, usual.libs  # type: ignore[attr-defined]
    return call


def declare(convention: Any, module: Any, descriptor: Any) -> Any:
    """Return an inner function as a module knows it, to be written or called."""
    kind = convention.get_function_type(descriptor.restype, descriptor.argtypes)
    function = cgutils.get_or_insert_function(module, kind, descriptor.mangled_name)
    convention.decorate_function(function, descriptor.args, descriptor.argtypes)
    if descriptor.inline:
        function.attributes.add("alwaysinline")
    return function
