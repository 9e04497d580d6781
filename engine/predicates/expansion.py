"""Expansion arithmetic, exact: expansions are unevaluated sums of non-overlapping doubles.

An expansion is stored in a workspace `e` of the caller, with `n` components ``e[0] .. e[n - 1]``, all nonzero, of
increasing magnitude, no two sharing a bit position. Its value is their exact sum, its sign that of the last component,
and n = 0 is zero. Every function returns the new length. Zero components are dropped, so that numbers of few bits
(lattices, CAD data) stay short.

Preconditions: nothing overflows, and for products the lowest bits of the operands multiply to at least 2^-1074; then
every operation is exact. The caller guarantees both by scaling, and a workspace with one place for each `grow`.

Source: J. R. Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates, 1997:
grow-expansion (theorem 10), expansion-sum (12), scale-expansion (19). The linear-time sum (13) is left out, because it
needs strongly non-overlapping operands and gains nothing at the lengths that occur.
"""

from __future__ import annotations

from typing import Any, Final

from engine.compiling.jit import called, inline
from engine.predicates.error_free import fast_two_sum, two_prod, two_sum

Components = Any  # a float64 array, or a list of floats when the compiler is disabled
LARGEST: Final = 2.0**120
SMALLEST: Final = 2.0**-120
"""Coordinates of kernels that use double-double or expansions are zero or within these: products of degree four are
exact (multiples of 2^-172 after a difference, of 2^-688 after a product of four)."""


@inline
def is_safe(x: float) -> bool:
    """Return whether x is zero or within SMALLEST .. LARGEST, so that products of degree four are exact expansions."""
    return x == 0.0 or SMALLEST <= abs(x) <= LARGEST


@called
def grow(e: Components, n: int, b: float) -> int:
    """Add the double b to the expansion e of n components in place; return the new length, at most n + 1."""
    q, n_out = b, 0
    for i in range(n):
        q, h = two_sum(q, e[i])
        if h != 0.0:
            e[n_out] = h  # n_out <= i: never ahead of the reading
            n_out += 1
    if q != 0.0:
        e[n_out] = q
        n_out += 1
    return n_out


@inline
def grow_product(e: Components, n: int, a: float, b: float) -> int:
    """Add the product a b to the expansion e of n components in place; return the new length, at most n + 2."""
    for part in two_prod(a, b)[::-1]:  # the tail first; a loop, because two calls compile twice as long
        if part != 0.0:
            n = grow(e, n, part)
    return n


@inline
def add(e: Components, n: int, f: Components, m: int) -> int:
    """Add the expansion f of m components to e of n in place; return the new length, at most n + m."""
    for i in range(m):
        n = grow(e, n, f[i])
    return n


@inline
def add_scaled(e: Components, n: int, f: Components, m: int, b: float) -> int:
    """Add b times the expansion f of m components to e of n in place; return the new length, at most n + 2 m."""
    for i in range(m):
        n = grow_product(e, n, f[i], b)
    return n


@inline
def add_product(e: Components, n: int, f: Components, m: int, g: Components, k: int) -> int:
    """Add the product of expansions f (m components) and g (k) to e of n in place; return the new length, at most n + 2
    m k."""
    for i in range(k):
        n = add_scaled(e, n, f, m, g[i])
    return n


@inline
def scale(f: Components, m: int, b: float, e: Components) -> int:
    """Write the product of the double b and the expansion f of m components to e, another array of 2 m places or more;
    return the number of components (scale-expansion)."""
    n_out = 0
    q = 0.0
    for i in range(m):
        p, tail = two_prod(f[i], b)
        q, h = two_sum(q, tail)
        if h != 0.0:
            e[n_out] = h
            n_out += 1
        q, h = fast_two_sum(p, q)
        if h != 0.0:
            e[n_out] = h
            n_out += 1
    if q != 0.0:
        e[n_out] = q
        n_out += 1
    return n_out


@called
def compress(e: Components, n: int) -> int:
    """Rewrite the expansion e of n components in place with as few components as its bits need; return the new length.
    The last component is then within an ulp of the value."""
    if n < 2:
        return n
    q = e[n - 1]
    bottom = n - 1
    for i in range(n - 2, -1, -1):
        q, low = fast_two_sum(q, e[i])
        if low != 0.0:
            e[bottom] = q
            bottom -= 1
            q = low
    e[bottom] = q
    n_out = 0
    for i in range(bottom + 1, n):
        q, low = fast_two_sum(e[i], q)
        if low != 0.0:
            e[n_out] = low
            n_out += 1
    e[n_out] = q
    return n_out + 1


@inline
def sign(e: Components, n: int) -> int:
    """Return the sign (-1, 0, 1) of an expansion of n components."""
    if n == 0:
        return 0
    return 1 if e[n - 1] > 0.0 else -1


@inline
def magnitude(e: Components, n: int) -> int:
    """Replace the expansion e of n components by its absolute value, compressed; return the new length."""
    n = compress(e, n)
    if sign(e, n) < 0:
        for i in range(n):
            e[i] = -e[i]
    return n
