"""Labels of rounded rings that are arranged again: each ring is a source of its own.

A bit of a label says whether a face lies in a ring, even-odd. A face is inside where it lies in a shell and in no hole
of that shell; its evidence names those shells, and that of a face outside the holes that it lies in. Evidence tells,
part by part, what the result came from (exact/rounding.py states the same rule over integers of any length).

    .------------------.         Rings 0 and 2 are shells, 1 is a hole of 0: shells = [0, 0, 2].
    | 0   .-----.      |
    |     |  1  |   .--+---.     label {0}      in a shell, in no hole of it   inside    evidence {0}
    |     '-----'   |  | 2 |           {0, 1}   in the hole of the only shell  outside            {1}
    '---------------+--'   |           {0, 2}   in two shells                  inside             {0, 2}
                    '------'           {}       in none                        outside            {}

Rings whose boxes are apart may share a bit: a face is in one of them at most. Shells that share a bit are apart, so the
holes of one of them are apart from those of another, and these may share bits, for holes of that shell's bit.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from engine.arrays import IntArray
from engine.jit import inline

MOST_BITS: Final = 62
"""Bits of a label."""


class RingBits(NamedTuple):
    """bits: by ring its bit; shells: by bit that of its shells; int64."""

    bits: IntArray
    shells: IntArray


class RingLabels(NamedTuple):
    """shells: by bit the bit of the shells of its rings, its own where they are shells; empty: labels are those of two
    polygons. gathered: evidence by region, that is by cycle; beyond: by ring of the result, that of the regions on the
    other side of it."""

    shells: Any
    gathered: Any
    beyond: Any


@inline
def verdict(shells: Any, label: int) -> tuple[bool, int]:
    """Tell whether a face is inside, and return its evidence."""
    found = blocked = holes = 0
    for bit in range(shells.shape[0]):
        if label >> bit & 1:
            shell = shells[bit]
            if shell == bit:
                found |= 1 << bit
            else:
                blocked |= 1 << shell
                holes |= 1 << bit
    inside = found & ~blocked
    return inside != 0, (inside if inside != 0 else holes)
