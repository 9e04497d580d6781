"""Moves points into a posed solid's own frame, with a bound on how far off each may be.

The exact preimage of q is R^-1 (q - t). Floating point gives adj(R) (q - t) / det(R): a pose's entries are at most 1
and its determinant 1, up to 1e-11, so an entry of the inverse is off by less than 32 u (u = 2^-53), and with the
roundings of the difference, the products and the sums a coordinate is off by less than 48 u sum |q - t|. The `blur`
of a point is more than twice that: adding it to a coordinate, or taking it off, in floating point leaves a true
bound. From 2^1021 on, where a coordinate may overflow that should not, the blur is infinite, and nothing is sure.

Where R only turns the axes onto each other and every difference is exact, so is the preimage, and the blur is 0.
"""

from __future__ import annotations

from typing import Any, Final

from engine.containment.posed.filters import in_space
from engine.jit import inline, kernel
from engine.predicates.error_free import two_diff

_BLUR: Final = 16.0 * 2.0**-53
"""Of eight times the differences: these overflow before a coordinate does."""
_TINY: Final = 1e-320


@inline
def to_frame(frames: Any, frame: int, p: Any) -> Any:
    """Return a point (x, y, z) in the frame of a pose, and its blur: 0.0 where it is exact.

    frames: has inverses (n, 3, 3) of R^-1 rounded, translations (n, 3) and is_turn (n,): whether the entries are
    exactly -1, 0 and 1. frame: which of them, -1 for none.
    """
    if frame < 0:
        return p, 0.0
    inverses, translations = frames.inverses, frames.translations
    dx, x_tail = two_diff(p[0], float(translations[frame, 0]))
    dy, y_tail = two_diff(p[1], float(translations[frame, 1]))
    dz, z_tail = two_diff(p[2], float(translations[frame, 2]))
    x = inverses[frame, 0, 0] * dx + inverses[frame, 0, 1] * dy + inverses[frame, 0, 2] * dz
    y = inverses[frame, 1, 0] * dx + inverses[frame, 1, 1] * dy + inverses[frame, 1, 2] * dz
    z = inverses[frame, 2, 0] * dx + inverses[frame, 2, 1] * dy + inverses[frame, 2, 2] * dz
    if frames.is_turn[frame] and x_tail == 0.0 and y_tail == 0.0 and z_tail == 0.0:
        return (x, y, z), 0.0
    return (x, y, z), _BLUR * (8.0 * abs(dx) + 8.0 * abs(dy) + 8.0 * abs(dz)) + _TINY


@kernel
def move_to_body_frame(points: Any, frames: Any, moved: Any, blurs: Any) -> None:
    """Fill moved (n, dim) and blurs (n,) by the only one of `frames`."""
    for item in range(len(points)):
        p, blurs[item] = to_frame(frames, 0, in_space(points, item))
        moved[item, 0], moved[item, 1] = p[0], p[1]
        if points.shape[1] == 3:
            moved[item, 2] = p[2]
