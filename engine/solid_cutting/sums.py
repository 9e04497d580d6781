"""Compiled: volume, moments and area of a mesh as double-doubles with a bound, from which the nearest double is proven.

With m = (b - a) x (c - a) along z, twice the area of a triangle abc seen along z, and S x = a.x + b.x + c.x:

    volume       sum of  m S z / 6                                  (divergence theorem for (0, 0, z))
    its x moment sum of  m ((S x)(S z) + a.x a.z + b.x b.z + c.x c.z) / 24            (for (0, 0, x z)), y alike
    its z moment sum of  m ((S z)^2 + a.z^2 + b.z^2 + c.z^2) / 48                     (for (0, 0, z^2 / 2))
    area         sum of  |(b - a) x (c - a)| / 2

Coordinates are taken relative to an origin, as exact pairs. Error bounds, with u = 2^-53 and P the sum of the two
products of m in size: m 24 u^2 P; each sum or product of double-doubles adds at most 8 u^2 of its size; so a term is
within 64 u^2 of `size`, the same expression of magnitudes, and a moment within 128 u^2. A square root of a
double-double adds 8 u^2. The high parts are added without error; the low parts and what the high ones lose are below
2 n u of all sizes at any time, and rounded 2 n times: 4 n^2 u^2 of all sizes. Underflow takes at most `_TINY` a term.

Source: B. Mirtich, Fast and accurate computation of polyhedral mass properties, 1996.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from engine.compiling.jit import inline, kernel
from engine.predicates.error_free import (
    U2,
    dd_add,
    dd_div,
    dd_mul,
    dd_sub,
    fast_two_sum,
    is_correctly_rounded,
    two_diff,
    two_prod,
    two_sum,
)
from engine.types import FlagArray, FloatArray, IntArray

_TINY: Final = 2.0**-1000
LOST_TO_ROOTS: Final = 2.0**-500
"""More than a square that underflows takes from a root."""
_POLL: Final = 0x3FFF


@inline
def cross_of(
    uh: float, ul: float, vh: float, vl: float, sh: float, sl: float, th: float, tl: float
) -> tuple[float, float, float]:
    """Return (h, l, size): u v - s t as a double-double h + l, and size = |u v| + |s t|, to which its error is relative
    (`bound_of`). Each factor is an exact sum of two doubles: u = uh + ul, likewise v, s and t."""
    p, p_low = two_prod(uh, vh)
    q, q_low = two_prod(sh, th)
    h, low = two_diff(p, q)
    low += (p_low - q_low) + ((uh * vl + ul * vh) - (sh * tl + sl * th))
    h, low = fast_two_sum(h, low)
    return h, low, abs(p) + abs(q)


@inline
def _minor(vertices: FloatArray, a: int, b: int, c: int, x: int, y: int) -> tuple[float, float, float]:
    """Return (h, l, size): (b - a) x (c - a) in the projection on axes x and y, as `cross_of` gives it. a, b, c:
    vertices."""
    uh, ul = two_diff(vertices[b, x], vertices[a, x])
    vh, vl = two_diff(vertices[c, y], vertices[a, y])
    sh, sl = two_diff(vertices[b, y], vertices[a, y])
    th, tl = two_diff(vertices[c, x], vertices[a, x])
    return cross_of(uh, ul, vh, vl, sh, sl, th, tl)


@inline
def _sum_of_three(vertices: FloatArray, a: int, b: int, c: int, x: int, origin: float) -> tuple[float, float, float]:
    """Return (h, l, size): the sum of coordinate x of vertices a, b, c, each relative to `origin`, as a double-double,
    and the sum of their magnitudes."""
    ah, al = two_diff(vertices[a, x], origin)
    bh, bl = two_diff(vertices[b, x], origin)
    ch, cl = two_diff(vertices[c, x], origin)
    h, first = two_sum(ah, bh)
    h, second = two_sum(h, ch)
    h, low = fast_two_sum(h, (first + second) + ((al + bl) + cl))
    return h, low, abs(ah) + abs(bh) + abs(ch)


@inline
def _sum_of_squares(
    vertices: FloatArray, a: int, b: int, c: int, x: int, z: int, origin: FloatArray
) -> tuple[float, float, float]:
    """Return (h, l, size): (S x)(S z) + a.x a.z + b.x b.z + c.x c.z relative to the origin, and its size."""
    sh, sl, x_size = _sum_of_three(vertices, a, b, c, x, origin[x])
    th, tl, z_size = _sum_of_three(vertices, a, b, c, z, origin[z])
    h, low = dd_mul(sh, sl, th, tl)
    for vertex in (a, b, c):
        ph, pl = two_diff(vertices[vertex, x], origin[x])
        qh, ql = two_diff(vertices[vertex, z], origin[z])
        ph, pl = dd_mul(ph, pl, qh, ql)
        h, low = dd_add(h, low, ph, pl)
    return h, low, 2.0 * x_size * z_size


@inline
def _add(sums: FloatArray, k: int, h: float, low: float, size: float) -> None:
    """Add a term h + low to row k of sums (4, 3), a double-double and the sum of magnitudes, to which `size` is
    added."""
    sums[k, 0], lost = two_sum(sums[k, 0], h)
    sums[k, 1] += lost + low
    sums[k, 2] += size


@inline
def certified(sums: FloatArray, whole: float, is_ratio: bool) -> float:
    """Return the double nearest to sums[0:3], a double-double with a bound, over `whole`; or to its ratio to sums[3:6]
    less it. NaN where that is not certain, or close to underflow."""
    h, low, bound = sums[0], sums[1], sums[2]
    over_h, over_l, over_bound = whole, 0.0, 0.0
    if is_ratio:
        over_h, over_l = dd_sub(sums[3], sums[4], h, low)
        over_bound = bound + sums[5] + 4.0 * U2 * abs(over_h)
    h, low = dd_div(h, low, over_h, over_l)
    bound = 1.01 * (bound + abs(h) * over_bound) / over_h + 20.0 * U2 * abs(h)
    if h > 2.0**-900 and over_h > 1024.0 * over_bound and is_correctly_rounded(h, low, bound):
        return min(h, 1.0) if is_ratio else h
    return float("nan")


@kernel
def sum_volume(vertices: FloatArray, triangles: IntArray, z0: float, sums: FloatArray, flag: FlagArray) -> None:
    """Add to sums[0] six times the volume, as `_add` does. z0: where z is measured from."""
    total = rest = all_sizes = 0.0
    for item in range(triangles.shape[0]):
        if item & _POLL == 0 and flag[0] != 0:
            return
        a, b, c = triangles[item, 0], triangles[item, 1], triangles[item, 2]
        h, low, size = _minor(vertices, a, b, c, 0, 1)
        sh, sl, z_size = _sum_of_three(vertices, a, b, c, 2, z0)
        h, low = dd_mul(h, low, sh, sl)
        total, lost = two_sum(total, h)
        rest += lost + low
        all_sizes += size * z_size
    sums[0, 0], sums[0, 1], sums[0, 2] = total, rest, all_sizes


@kernel
def sum_moments(
    vertices: FloatArray, triangles: IntArray, origin: FloatArray, sums: FloatArray, flag: FlagArray
) -> None:
    """Add to sums[k], for k = 0, 1, 2, 24, 24 and 48 times the moments of the volume about the origin (3,), as `_add`
    does."""
    for item in range(triangles.shape[0]):
        if item & _POLL == 0 and flag[0] != 0:
            return
        a, b, c = triangles[item, 0], triangles[item, 1], triangles[item, 2]
        h, low, size = _minor(vertices, a, b, c, 0, 1)
        for k in range(3):
            sh, sl, moment = _sum_of_squares(vertices, a, b, c, k, 2, origin)
            sh, sl = dd_mul(h, low, sh, sl)
            _add(sums, k, sh, sl, size * moment)


@kernel
def sum_area(vertices: FloatArray, triangles: IntArray, sums: FloatArray, flag: FlagArray) -> None:
    """Add to sums[0] twice the area of all triangles, as `_add` does; size: that of the products in each minor."""
    for item in range(triangles.shape[0]):
        if item & _POLL == 0 and flag[0] != 0:
            return
        a, b, c = triangles[item, 0], triangles[item, 1], triangles[item, 2]
        h = low = size = 0.0
        for k in range(3):
            mh, ml, product = _minor(vertices, a, b, c, (k + 1) % 3, (k + 2) % 3)
            mh, ml = dd_mul(mh, ml, mh, ml)
            h, low = dd_add(h, low, mh, ml)
            size += product
        root = sqrt(h)
        if root > 0.0:
            ph, pl = two_prod(root, root)
            ph, pl = dd_sub(h, low, ph, pl)
            root, rest = fast_two_sum(root, ph / (2.0 * root))
            _add(sums, 0, root, rest, size)
        else:
            _add(sums, 0, 0.0, 0.0, size)


def bound_of(size: float, n: int) -> float:
    """Return a bound on the error of a sum of n terms in double-double; size: the sum of their magnitudes."""
    return 1.001 * ((192.0 + 4.0 * float(n) ** 2) * U2 * size + n * _TINY)
