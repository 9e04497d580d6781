"""How single operations are written: an index by whole numbers, a loop over a `range`, `len`, `min`, `max`.

numba copies all of an array to memory before it takes what an index asks for, and looks at each turn of a loop whether
its step is zero. An index counts from the end where it is negative, as ever, but for variables in `FROM_THE_FIRST`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.types.misc import unliteral

from engine.compiling.values import DATA, SHAPE, Parts, is_plain, part, plain_array

Way = Callable[..., Any] | None
FROM_THE_FIRST: Final = ("engine.polygon_overlay.", "engine.arrangement.")
"""Modules whose functions count no element from the last: an index below zero that is not written out is an error, and
to look for it at each access takes a tenth to a fifth of a small overlay."""


def _place(context: Any, array: Any, index: Any) -> Way:
    """Return what writes where an item, or a row, begins; None if `index` is not of whole numbers alone."""
    kinds = list(map(unliteral, index.types if isinstance(index, types.BaseTuple) else [index]))
    if context.enable_boundscheck or not is_plain(array) or not 0 < len(kinds) <= array.ndim:
        return None
    if not all(isinstance(kind, types.Integer) for kind in kinds):
        return None

    def write(builder: Any, value: Any, indices: Any) -> Any:
        place = None
        for axis in range(array.ndim):
            count = part(builder, value, SHAPE, axis)
            if axis:
                place = builder.mul(place, count)
            if axis < len(kinds):
                at = part(builder, indices, axis) if isinstance(index, types.BaseTuple) else indices
                if kinds[axis].bitwidth < 64:
                    at = (builder.sext if kinds[axis].signed else builder.zext)(at, count.type)
                is_sure = at.constant >= 0 if isinstance(at, ir.Constant) else context.counts_from_the_first
                if kinds[axis].signed and not is_sure:
                    at = builder.select(builder.icmp_signed("<", at, at.type(0)), builder.add(at, count), at)
                place = builder.add(place, at) if axis else at
        return builder.gep(part(builder, value, DATA), [place])

    return write


def getitem(context: Any, signature: Any) -> Way:
    array, index = signature.args
    place, rest = _place(context, array, index), signature.return_type
    if place is None:
        return None
    if not isinstance(rest, types.Array):
        return lambda builder, value, at: context.unpack_value(builder, array.dtype, place(builder, value, at))
    if context.enable_nrt or not is_plain(rest):
        return None

    def write(builder: Any, value: Any, at: Any) -> Any:
        shape = [part(builder, value, SHAPE, axis) for axis in range(array.ndim - rest.ndim, array.ndim)]
        return plain_array(context, builder, rest, place(builder, value, at), shape)

    return write


def setitem(context: Any, signature: Any) -> Way:
    array, index, kind = signature.args
    place = _place(context, array, index)
    is_item = array.ndim == (len(index) if isinstance(index, types.BaseTuple) else 1)
    if place is None or not is_item or not isinstance(unliteral(kind), (types.Number, types.Boolean)):
        return None

    def write(builder: Any, value: Any, at: Any, item: Any) -> None:
        item = context.cast(builder, item, kind, array.dtype)
        context.pack_value(builder, array.dtype, item, place(builder, value, at))

    return write


def _length(context: Any, signature: Any) -> Way:
    plain = is_plain(signature.args[0])
    return (lambda builder, value: part(builder, value, SHAPE, 0)) if plain else None


def _range(context: Any, signature: Any) -> Way:
    kind = context.get_value_type(signature.return_type)
    if len(signature.args) == 1:
        return lambda builder, stop: Parts(kind, [stop.type(0), stop, stop.type(1)])
    if len(signature.args) == 2:
        return lambda builder, start, stop: Parts(kind, [start, stop, stop.type(1)])
    return lambda builder, start, stop, step: Parts(kind, [start, stop, step])


def _getiter(context: Any, signature: Any) -> Way:
    """Begin a loop over a range with a known step: what is next, and how many are left."""
    if not isinstance(signature.args[0], types.RangeType) or not signature.args[0].dtype.signed:
        return None
    kind = context.get_value_type(signature.return_type)

    def write(builder: Any, value: Any) -> Any:
        start, stop, step = (part(builder, value, index) for index in range(3))
        if not isinstance(step, ir.Constant) or not isinstance(step.constant, int) or step.constant == 0:
            return NotImplemented
        way = builder.sub(stop, start) if step.constant > 0 else builder.sub(start, stop)
        count, size = way, abs(step.constant)
        if size > 1:
            count = builder.add(builder.udiv(builder.sub(way, way.type(1)), way.type(size)), way.type(1))
        count = builder.select(builder.icmp_signed(">", way, way.type(0)), count, way.type(0))
        places = [cgutils.alloca_once(builder, start.type) for _ in range(2)]
        builder.store(start, places[0])
        builder.store(count, places[1])
        return Parts(kind, [places[0], stop, step, places[1]])

    return write


def _iternext(context: Any, signature: Any) -> Way:
    kind = signature.args[0]
    if not isinstance(kind, types.RangeIteratorType) or not kind.yield_type.signed:
        return None
    pair = context.get_value_type(signature.return_type)

    def write(builder: Any, value: Any) -> Any:
        item, step, left = (part(builder, value, index) for index in (0, 2, 3))
        count, at = builder.load(left), builder.load(item)
        builder.store(builder.sub(count, count.type(1), flags=["nsw"]), left)
        builder.store(builder.add(at, step), item)
        return Parts(pair, [at, builder.icmp_signed(">", count, count.type(0))])

    return write


def _extreme(sign: str) -> Callable[[Any, Any], Way]:
    """Return the way of `min` or `max`: the first that no other is beyond, and what is no number is beyond nothing."""

    def choose(context: Any, signature: Any) -> Way:
        [given] = signature.args if len(signature.args) == 1 else [signature.args]
        kind = signature.return_type
        if not isinstance(kind, (types.Integer, types.Float)) or any(one != kind for one in given):
            return None

        def write(builder: Any, *values: Any) -> Any:
            is_tuple = len(signature.args) == 1
            first, *others = [part(builder, values[0], index) for index in range(len(given))] if is_tuple else values
            for other in others:
                if isinstance(kind, types.Float):
                    is_beyond = builder.fcmp_ordered(sign, other, first)
                else:
                    is_beyond = (builder.icmp_signed if kind.signed else builder.icmp_unsigned)(sign, other, first)
                first = builder.select(is_beyond, other, first)
            return first

        return write

    return choose


WAYS: dict[Any, Callable[[Any, Any], Way]] = {
    len: _length,
    range: _range,
    "getiter": _getiter,
    "iternext": _iternext,
    min: _extreme("<"),
    max: _extreme(">"),
}
