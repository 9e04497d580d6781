"""Moves points into a posed solid's own frame, with a bound on how far off each may be.

The exact preimage of q is R^-1 (q - t). Floating point gives adj(R) (q - t) / det(R): a pose's entries are at most 1
and its determinant 1, up to 1e-11, so an entry of the inverse is off by less than 32 u (u = 2^-53), and with the
roundings of the difference, the products and the sums a coordinate is off by less than 48 u sum |q - t|. The `blur`
of a point is more than twice that: adding it to a coordinate, or taking it off, in floating point leaves a true
bound.

Where R only turns the axes onto each other and every difference is exact, so is the preimage, and the blur is 0.
"""

from __future__ import annotations

from typing import Any, Final

from engine.jit import kernel
from engine.predicates.error_free import two_diff

BLUR: Final = 128.0 * 2.0**-53
_TINY: Final = 1e-320


@kernel
def move_to_body_frame(points: Any, inverse: Any, translation: Any, is_turn: bool, moved: Any, blurs: Any) -> None:
    """Fill moved (n, dim) and blurs (n,): twice a bound on the error of each coordinate, 0.0 where it is exact.

    inverse: (dim, dim), R^-1 rounded; is_turn: its entries are exactly -1, 0 and 1.
    """
    n_axes = len(translation)
    for item in range(len(points)):
        size, is_exact = 0.0, is_turn
        for axis in range(n_axes):
            moved[item, axis] = 0.0
        for axis in range(n_axes):
            difference, tail = two_diff(float(points[item, axis]), float(translation[axis]))
            size += abs(difference)
            is_exact &= tail == 0.0
            for row in range(n_axes):
                moved[item, row] += inverse[row, axis] * difference
        blurs[item] = 0.0 if is_exact else BLUR * size + _TINY
