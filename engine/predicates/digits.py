"""Exact multi-digit integers in compiled code, for what doubles and double-doubles do not decide.

A number is a place in one int64 array, the heap:

    heap[a]        n, the number of digits; 0 for zero
    heap[a + 1]    e, the exponent
    heap[a + 2 ..] digits, the lowest first: 0 .. 2^28 - 1, but the last, which is not zero and has the sign

with the value ``sum(digit[i] * 2^(28 (e + i)))``. Every double is such a number of at most three digits. The product
of two digits is below 2^56, so 127 of them add up before a carry is due: sums of products are formed without one, as
long as the shorter factors have at most `MOST_SUMMED` digits together.

Source: D. E. Knuth, The Art of Computer Programming 2, section 4.3.1, with a signed leading digit.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from engine.compiling.jit import inline
from engine.predicates.error_free import U2, dd_add, dd_div, even_of, is_correctly_rounded
from engine.types import IntArray

BITS: Final = 28
MOST: Final = 60
"""Most digits of a stored number, so that its value at a plane of at most `MOST_OF_ROW` digits fits a `SLOT`."""
MOST_OF_ROW: Final = 30
MOST_SUMMED: Final = 120
SLOT: Final = 128
"""Size of an intermediate number on the heap: two entries, and the digits of a sum of products."""
MOST_DIGITS: Final = SLOT - 4
QUOTIENT_BOUND: Final = 128.0 * U2
"""Relative error bound of a quotient of numbers known by five leading digits (2^-6 u^2), each read with five dd_add (20
u^2)."""
FARTHEST: Final = 900
"""Doubles made from numbers lie within 2^-900 .. 2^900, so that none is subnormal."""
_MASK: Final = (1 << BITS) - 1
_BASE: Final = 2.0**BITS


@inline
def normalise(heap: IntArray, a: int) -> None:
    """Carry the digits of the number at index a of the heap so that each is in its range, and drop zeros at both ends;
    caller guarantees room for a carry."""
    n, first, carry = heap[a], a + 2, 0
    for i in range(first, first + n):
        total = heap[i] + carry
        carry = total >> BITS
        heap[i] = total & _MASK
    if carry != 0:
        heap[first + n] = carry
        n += 1
    while n > 0 and heap[first + n - 1] == 0:
        n -= 1
    while n > 1 and heap[first + n - 1] == -1:  # the digit below takes the sign over: it is at most -1 then
        n -= 1
        heap[first + n - 1] -= 1 << BITS
    heap[a] = n
    zeros = 0
    while zeros < n and heap[first + zeros] == 0:
        zeros += 1
    if zeros > 0:
        for i in range(first, first + n - zeros):
            heap[i] = heap[i + zeros]
        heap[a] = n - zeros
        heap[a + 1] += zeros


@inline
def store_double(heap: IntArray, a: int, x: float) -> None:
    """Store a finite double as a number at index a of the heap."""
    fraction, exponent = math.frexp(x)
    whole, exponent = int(fraction * 2.0**53), exponent - 53
    place = exponent // BITS
    shift = exponent - place * BITS
    heap[a], heap[a + 1] = 3, place
    heap[a + 2], heap[a + 3], heap[a + 4] = (whole & _MASK) << shift, (whole >> BITS) << shift, 0
    normalise(heap, a)


@inline
def sign_of(heap: IntArray, a: int) -> int:
    """Return the sign (-1, 0, 1) of the number at index a of the heap."""
    n = heap[a]
    if n == 0:
        return 0
    return 1 if heap[a + 1 + n] > 0 else -1


@inline
def sum_products(heap: IntArray, terms: IntArray, n_terms: int, c: int) -> bool:
    """Store the sum of ``factor * a * b`` over the first n_terms rows ``terms[i] = (a, b, factor)`` at index c of the
    heap; False if it would be too long. a, b: indices of numbers. factor: 1 or -1."""
    bottom, top, n_summed = 0, 0, 0
    for i in range(n_terms):
        a, b = terms[i, 0], terms[i, 1]
        if heap[a] == 0 or heap[b] == 0:
            continue
        lowest = heap[a + 1] + heap[b + 1]
        highest = lowest + heap[a] + heap[b] + 1
        bottom, top = (min(bottom, lowest), max(top, highest)) if n_summed > 0 else (lowest, highest)
        n_summed += min(heap[a], heap[b])
    size = top - bottom
    if size > MOST_DIGITS or n_summed > MOST_SUMMED:
        return False
    heap[c], heap[c + 1] = size, bottom
    for i in range(c + 2, c + 2 + size):
        heap[i] = 0
    for i in range(n_terms):
        a, b = terms[i, 0], terms[i, 1]
        if heap[a] == 0 or heap[b] == 0:
            continue
        start = c + 2 + heap[a + 1] + heap[b + 1] - bottom - (b + 2)
        last = b + 2 + heap[b]
        for j in range(heap[a]):
            digit = heap[a + 2 + j] * terms[i, 2]
            if digit != 0:
                for place in range(b + 2, last):
                    heap[start + j + place] += digit * heap[place]
    normalise(heap, c)
    return True


@inline
def negate(heap: IntArray, a: int) -> None:
    """Negate the number at index a of the heap."""
    for i in range(a + 2, a + 2 + heap[a]):
        heap[i] = -heap[i]
    normalise(heap, a)


@inline
def leading(heap: IntArray, a: int) -> tuple[float, float, int]:
    """Return (h, l, e) for the number at index a of the heap: its five leading digits, or fewer, are the double-double
    h + l, in units of 2^(28 e)."""
    n = heap[a]
    h, low, taken = 0.0, 0.0, min(n, 5)
    for i in range(taken):
        h, low = dd_add(h * _BASE, low * _BASE, float(heap[a + 1 + n - i]), 0.0)
    return h, low, heap[a + 1] + n - taken


@inline
def nearest_quotient(heap: IntArray, terms: IntArray, x: int, w: int, one: int, free: int) -> tuple[float, bool]:
    """Return the double nearest to x / w, ties to even, for w > 0, and whether it is certain: False if it is out of
    range or too long. x, w, one: indices of numbers on the heap, one that of 1. terms (3, 3): scratch; free: index of
    three free slots."""
    if heap[x] == 0:
        return 0.0, True
    xh, xl, x_place = leading(heap, x)
    wh, wl, w_place = leading(heap, w)
    h, low = dd_div(xh, xl, wh, wl)
    exponent = BITS * (x_place - w_place)
    if abs(exponent + math.frexp(h)[1]) > FARTHEST:
        return h, False
    double = math.ldexp(h, int(exponent))
    if is_correctly_rounded(h, low, QUOTIENT_BOUND * abs(h)):
        return double, True
    side = 1.0 if low > 0.0 else -1.0
    other = np.nextafter(double, side * np.inf)
    store_double(heap, free, double)
    store_double(heap, free + SLOT, 0.5 * (other - double))
    terms[0, 0], terms[0, 1], terms[0, 2] = x, one, 1
    terms[1, 0], terms[1, 1], terms[1, 2] = free, w, -1
    terms[2, 0], terms[2, 1], terms[2, 2] = free + SLOT, w, -1
    if not sum_products(heap, terms, 3, free + 2 * SLOT):
        return double, False
    beyond = side * sign_of(heap, free + 2 * SLOT)
    if beyond == 0.0:
        return even_of(double, other), True
    return (other if beyond > 0.0 else double), True


def packed_numbers(numbers: list[list[int]]) -> tuple[np.ndarray, np.ndarray] | None:
    """Return a heap (n,) of the numbers, row by row, and the index of each (n_rows, n_columns); None if one has more
    than `MOST_OF_ROW` digits."""
    heap: list[int] = []
    places = np.zeros((len(numbers), len(numbers[0])), np.int64)
    for i, row in enumerate(numbers):
        for k, number in enumerate(row):
            places[i, k] = len(heap)
            size = abs(number)
            exponent = ((size & -size).bit_length() - 1) // BITS if size else 0
            size >>= BITS * exponent
            digits = [size >> shift & _MASK for shift in range(0, size.bit_length(), BITS)]
            if len(digits) > MOST_OF_ROW:
                return None
            if number < 0:  # digits of -size, the last one signed
                carry = 0
                for j in range(len(digits)):
                    total = carry - digits[j]
                    digits[j], carry = total & _MASK, total >> BITS
                digits.append(carry)
                while len(digits) > 1 and digits[-1] in (0, -1):
                    top = digits.pop()
                    digits[-1] += top << BITS
            heap += [len(digits), exponent, *digits]
    return np.array(heap, np.int64), places
