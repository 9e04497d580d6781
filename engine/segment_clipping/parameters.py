"""Where along a segment: exact numbers (u + v sqrt(w)) / z, compared exactly with each other.

Planes are met at quotients of integers (v = 0), balls at roots of quadratics. Rounding to nearest keeps order, so only
numbers that round alike are looked at closer; then signs of a + b sqrt(m) + c sqrt(n) decide, by squaring.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from engine.predicates.rational import nearest_with_root, sign_of


class Parameter(NamedTuple):
    """The number (u + v sqrt(w)) / z of integers, w >= 0 and z > 0, and the double nearest to it."""

    u: int
    v: int
    w: int
    z: int
    near: float


def parameter(u: int, v: int, w: int, z: int) -> Parameter:
    """Return (u + v sqrt(w)) / z, z not 0."""
    if z < 0:
        u, v, z = -u, -v, -z
    return Parameter(u, v, w, z, nearest_with_root(u, v, w, z))


ZERO: Final = parameter(0, 0, 0, 1)
ONE: Final = parameter(1, 0, 0, 1)


def compare(a: Parameter, b: Parameter) -> int:
    """Return the sign of a - b."""
    if a.near != b.near:
        return 1 if a.near > b.near else -1
    top, root = a.u * b.z - b.u * a.z, _sign_with_root(a.u * b.z - b.u * a.z, a.v * b.z, a.w)
    other = sign_of(-b.v) * sign_of(b.w)
    if root * other >= 0:
        return root or other
    square = top**2 + (a.v * b.z) ** 2 * a.w - (b.v * a.z) ** 2 * b.w
    return root * _sign_with_root(square, 2 * top * a.v * b.z, a.w)


def _sign_with_root(a: int, b: int, m: int) -> int:
    """Return the sign of a + b sqrt(m)."""
    first, second = sign_of(a), sign_of(b) * sign_of(m)
    if first * second >= 0:
        return first or second
    return first * sign_of(a * a - b * b * m)
