"""The parity of a segment over eight triangles at once: the entries of a cell side by side, one to a lane.

A group is (14, 8) float32: what cells/entries.py keeps of a triangle, number by number, for eight of them; lanes
without a triangle hold one that is never crossed. One group answers in some 40 vector instructions and no branch, where
a loop over four entries spends most of its time on mispredicted ends. The compiler does not find this by itself, hence
the intrinsics; each has a plain twin with the same results, used when the compiler is disabled. The arithmetic is that
of cells/entries.py, plain products and sums in the same order, and so is the band.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import config as numba_config
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

LANES: Final = 8
BAND: Final = np.float32(2.0**-18)
"""Planes of an entry are this far from a point at least where they decide: derived in cells/entries.py."""
ROWS: Final = 14
"""Numbers a triangle: those of an entry, and 1.0 in the last group of a leaf, else 0.0."""
UNSURE: Final = 2
"""Bit of the answer that is set where a lane is within the band."""
_FLOAT: Final = ir.FloatType()
_VECTOR: Final = ir.VectorType(_FLOAT, LANES)
_LINE: Final = 64


def plain_parity(groups: Any, group: int, x: Any, y: Any, z: Any) -> int:
    """Return the parity of the segment from R to (x, y, z) over a group of (n, 14, 8) float32, plus UNSURE."""
    rows = groups[group]
    with np.errstate(invalid="ignore"):
        side = rows[0] * x + rows[1] * y + rows[2] * z - rows[3]
        edges = [rows[k] * x + rows[k + 1] * y + rows[k + 2] * z for k in (4, 7, 10)]
        least, most = np.minimum.reduce(edges), np.maximum.reduce(edges)
        is_apart = (side > BAND) | ((least < -BAND) & (most > BAND))
        is_crossed = (side < -BAND) & ((least > BAND) | (most < -BAND))
    return int(is_crossed.sum() & 1) | (0 if (is_apart | is_crossed).all() else UNSURE)


def plain_prefetch(groups: Any, group: int) -> None:
    """Do nothing: the twin of `prefetch_group`."""


def _first_number(context: Any, builder: Any, array_type: Any, array: Any, group: Any) -> Any:
    data = builder.bitcast(context.make_array(array_type)(context, builder, array).data, _FLOAT.as_pointer())
    return builder.gep(data, [builder.mul(group, ir.Constant(group.type, ROWS * LANES))])


def _parity_intrinsic(typing_context: Any, groups: Any, group: Any, x: Any, y: Any, z: Any) -> Any:
    """Return what `plain_parity` does; groups: C-contiguous."""
    return types.int64(groups, types.int64, types.float32, types.float32, types.float32), _parity_code(float(BAND))


def _parity_code(band: float | None) -> Any:
    """Return what generates the parity beyond a band; None: from plain signs, never UNSURE, for comparison only."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first = _first_number(context, builder, signature.args[0], arguments[0], arguments[1])

        def row(place: int) -> Any:
            there = builder.gep(first, [ir.Constant(ir.IntType(64), place * LANES)])
            loaded = builder.load(builder.bitcast(there, _VECTOR.as_pointer()))
            loaded.align = 4  # of a float: numpy promises no more
            return loaded

        def spread(value: Any) -> Any:
            one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
            return builder.shuffle_vector(
                one, ir.Constant(_VECTOR, ir.Undefined), ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
            )

        point = [spread(value) for value in arguments[2:]]

        def product(place: int) -> Any:
            terms = [builder.fmul(row(place + k), point[k]) for k in range(3)]
            return builder.fadd(builder.fadd(terms[0], terms[1]), terms[2])

        def chosen(how: str, a: Any, b: Any) -> Any:
            return builder.select(builder.fcmp_ordered(how, a, b), a, b)

        above = ir.Constant(_VECTOR, [ir.Constant(_FLOAT, band or 0.0)] * LANES)
        below = ir.Constant(_VECTOR, [ir.Constant(_FLOAT, -(band or 0.0))] * LANES)
        side = builder.fsub(product(0), row(3))
        edges = [product(place) for place in (4, 7, 10)]
        least = chosen("<", chosen("<", edges[0], edges[1]), edges[2])
        most = chosen(">", chosen(">", edges[0], edges[1]), edges[2])
        is_same = builder.or_(builder.fcmp_ordered(">", least, above), builder.fcmp_ordered("<", most, below))
        is_crossed = builder.and_(builder.fcmp_ordered("<", side, below), is_same)
        mask_type, word = ir.IntType(LANES), ir.IntType(64)
        crossed = builder.bitcast(is_crossed, mask_type)
        parity = builder.and_(builder.ctpop(crossed), ir.Constant(mask_type, 1))
        if band is None:
            return builder.zext(parity, word)
        is_split = builder.and_(builder.fcmp_ordered("<", least, below), builder.fcmp_ordered(">", most, above))
        is_apart = builder.or_(builder.fcmp_ordered(">", side, above), is_split)
        sure = builder.bitcast(builder.or_(is_apart, is_crossed), mask_type)
        is_unsure = builder.icmp_unsigned("!=", sure, ir.Constant(mask_type, 2**LANES - 1))
        unsure = builder.shl(builder.zext(is_unsure, word), ir.Constant(word, 1))
        return builder.or_(builder.zext(parity, word), unsure)

    return generate


def _prefetch_intrinsic(typing_context: Any, groups: Any, group: Any) -> Any:
    """Ask for a group to be brought near; never faults."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first = _first_number(context, builder, signature.args[0], arguments[0], arguments[1])
        byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(ir.VoidType(), [byte, number, number, number]), "llvm.prefetch.p0i8"
        )
        for place in range(0, ROWS * LANES * 4, _LINE):
            there = builder.bitcast(builder.gep(first, [ir.Constant(ir.IntType(64), place // 4)]), byte)
            builder.call(function, [there, *(ir.Constant(number, value) for value in (0, 3, 1))])
        return context.get_dummy_value()

    return types.none(groups, types.int64), generate


group_parity: Any = plain_parity if numba_config.DISABLE_JIT else intrinsic(_parity_intrinsic)


def _plain_signs(typing_context: Any, groups: Any, group: Any, x: Any, y: Any, z: Any) -> Any:
    """Return the parity without a band."""
    return types.int64(groups, types.int64, types.float32, types.float32, types.float32), _parity_code(None)


plain_signs: Any = plain_parity if numba_config.DISABLE_JIT else intrinsic(_plain_signs)
"""What `group_parity` would be if rounding did not matter: the benchmark measures against it what certainty costs."""
prefetch_group: Any = plain_prefetch if numba_config.DISABLE_JIT else intrinsic(_prefetch_intrinsic)


def groups_of(n_groups: int) -> Any:
    """Return (n_groups, 14, 8) float32, uninitialised, that begins with a line of the cache: a group is seven."""
    numbers = n_groups * ROWS * LANES
    room = np.empty(numbers + _LINE // 4, np.float32)
    skipped = (-room.ctypes.data // 4) % (_LINE // 4)
    return room[skipped : skipped + numbers].reshape(n_groups, ROWS, LANES)
