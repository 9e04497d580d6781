"""Error-free transformations (sums and products of two doubles), and double-double arithmetic with proven error bounds.

The only file of the engine that needs compiler intrinsics: `fma` (one instruction where the CPU has it, else the C
library's) and `workspace` (a few doubles on the stack, so that exact stages allocate nothing). Each has a plain twin
with the same results, used when the compiler is disabled.

Preconditions. Sums are exact whenever the result does not overflow: an addition never underflows. A product a b is
exact when it does not overflow and ulp(a) ulp(b) >= 2^-1074; |a b| >= 2^-967 is enough, and so is a = 0 or b = 0.

Source: T. J. Dekker, A floating-point technique for extending the available precision, 1971; D. E. Knuth, The Art of
Computer Programming 2, section 4.2.2; J. R. Shewchuk, Adaptive precision floating-point arithmetic and fast robust
geometric predicates, 1997, section 2.

A double-double is a pair (h, l) with h = fl(h + l), 106 bits, passed as two arguments and returned as a tuple. With
u = 2^-53, and provided nothing overflows or underflows (callers scale their input), relative errors are

    dd_add    3 u^2 of |a + b|  (4 u^2 is used, for the terms of third order)
    dd_mul    5 u^2 of |a b|
    dd_div   16 u^2 of |a / b|

Callers add these up to a running bound, and end with `is_correctly_rounded`: whether the double nearest to the true
value is certain. A double-double never decides anything by itself.

Source: M. Joldes, J.-M. Muller, V. Popescu, Tight and rigorous error bounds for basic building blocks of double-word
arithmetic, 2017 (algorithms AccurateDWPlusDW, DWTimesDW2, DWDivDW2).
"""

from __future__ import annotations

import math
from typing import Any, Final

from llvmlite import ir
from numba import config as numba_config
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from engine.compiling.jit import inline


def plain_fma(a: float, b: float, c: float) -> float:
    """Return a b + c rounded once, in plain Python: the twin of `fma`, right for every input."""
    if not (math.isfinite(a) and math.isfinite(b)):
        return a * b + c
    if not math.isfinite(c):
        return c  # case: a * b alone could overflow to the opposite infinity
    (a_top, a_bottom), (b_top, b_bottom) = float(a).as_integer_ratio(), float(b).as_integer_ratio()
    c_top, c_bottom = float(c).as_integer_ratio()
    top, bottom = a_top * b_top * c_bottom + c_top * a_bottom * b_bottom, a_bottom * b_bottom * c_bottom
    if top == 0:
        return a * b + c if a_top * b_top == 0 else 0.0  # signs of zero as IEEE 754 has them
    try:
        return top / bottom  # Python rounds a quotient of integers correctly
    except OverflowError:
        return math.inf if top > 0 else -math.inf


def plain_workspace(size: int) -> list[float]:
    """Return a list of `size` zeros: the twin of `workspace` in plain Python."""
    return [0.0] * size


def _fma_intrinsic(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    """Typing and code of `fma` for numba: a b + c rounded once (llvm.fma.f64)."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        double = ir.DoubleType()
        function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(double, [double] * 3), "llvm.fma.f64")
        return builder.call(function, arguments)

    if (a, b, c) != (types.float64,) * 3:
        return None
    return types.float64(types.float64, types.float64, types.float64), generate


def _workspace_intrinsic(typing_context: Any, size: Any) -> Any:
    """Typing and code of `workspace` for numba: an uninitialised float64 array on the caller's stack, not to be
    returned. size: a literal."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        from numba.np.arrayobj import make_array, populate_array  # 0.1 s to import, and only the compiler needs it

        word = context.get_value_type(types.intp)
        array_type = signature.return_type
        data = cgutils.alloca_once(builder, ir.DoubleType(), size=word(size.literal_value))
        array = make_array(array_type)(context, builder)
        populate_array(
            array, data=data, shape=(word(size.literal_value),), strides=(word(8),), itemsize=word(8), meminfo=None
        )
        return array._getvalue()

    if not isinstance(size, types.IntegerLiteral):
        return None
    return types.Array(types.float64, 1, "C")(size), generate


fma: Any = plain_fma if numba_config.DISABLE_JIT else intrinsic(_fma_intrinsic)
workspace: Any = plain_workspace if numba_config.DISABLE_JIT else intrinsic(prefer_literal=True)(_workspace_intrinsic)


@inline
def two_sum(a: float, b: float) -> tuple[float, float]:
    """Return (s, e): s = fl(a + b), and s + e = a + b exactly."""
    s = a + b
    b_part = s - a
    a_part = s - b_part
    return s, (a - a_part) + (b - b_part)


@inline
def fast_two_sum(a: float, b: float) -> tuple[float, float]:
    """Return (s, e): s = fl(a + b), and s + e = a + b exactly; caller guarantees |a| >= |b| or a = 0."""
    s = a + b
    return s, b - (s - a)


@inline
def two_diff(a: float, b: float) -> tuple[float, float]:
    """Return (s, e): s = fl(a - b), and s + e = a - b exactly."""
    return two_sum(a, -b)


@inline
def two_prod(a: float, b: float) -> tuple[float, float]:
    """Return (p, e): p = fl(a b), and p + e = a b exactly (precondition: see the module)."""
    p = a * b
    return p, fma(a, b, -p)


U2: Final = 2.0**-106
"""u^2, the unit in which errors of double-double operations are counted."""


@inline
def dd_add(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Return a + b of two double-doubles, as a double-double."""
    sh, sl = two_sum(ah, bh)
    th, tl = two_sum(al, bl)
    vh, vl = fast_two_sum(sh, sl + th)
    return fast_two_sum(vh, tl + vl)


@inline
def dd_sub(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Return a - b of two double-doubles, as a double-double."""
    return dd_add(ah, al, -bh, -bl)


@inline
def dd_mul(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Return the product of two double-doubles, as a double-double."""
    ch, cl = two_prod(ah, bh)
    return fast_two_sum(ch, cl + fma(ah, bl, al * bh))


@inline
def dd_scale(ah: float, al: float, b: float) -> tuple[float, float]:
    """Return a double-double times a double b, as a double-double (error 2 u^2)."""
    ch, cl = two_prod(ah, b)
    return fast_two_sum(ch, fma(al, b, cl))


@inline
def dd_div(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Return the quotient of two double-doubles, as a double-double; b is not zero."""
    th = ah / bh
    rh, rl = dd_scale(bh, bl, th)
    return fast_two_sum(th, ((ah - rh) + (al - rl)) / bh)


@inline
def is_correctly_rounded(h: float, low: float, bound: float) -> bool:
    """Return whether every number within `bound` of h + low rounds to fl(h + low).

    Rounding to nearest is monotonic, so it is enough that both ends round alike. The bound includes 2 u^2 |h| for the
    rounding of ``low - bound`` and ``low + bound``. Ties and zeros are only accepted if the bound is zero; False for
    NaN.
    """
    return h + (low - bound) == h + (low + bound)


@inline
def even_of(x: float, other: float) -> float:
    """Return whichever of two adjacent doubles has the even significand."""
    half = 0.5 * (x / abs(other - x))
    return x if math.floor(half) == half else other
