"""The parity of a segment over eight triangles at once: the entries of a cell side by side, one to a lane.

A group is (14, 8) float32: what cells/entries.py keeps of a triangle, number by number, for eight of them; lanes
without a triangle hold one that is never crossed. One group answers in some 40 vector instructions and no branch, where
a loop over four entries spends most of its time on mispredicted ends. The arithmetic is that of cells/entries.py, plain
products and sums in the same order, and so is the band.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from engine.lanes.lanes import aligned, any_of, bits_of, count_bits, dot, greater, lesser, load, prefetch
from engine.lanes.tracing import LANES, Lanes, Number, Rows, traced
from engine.types import UNDECIDED

BAND: Final = np.float32(2.0**-18)
"""Planes of an entry are this far from a point at least where they decide: derived in cells/entries.py."""
ROWS: Final = 14
"""Numbers a triangle: those of an entry, and 1.0 in the last group of a leaf, else 0.0."""
_LINE: Final = 16
"""Numbers that a line of the cache holds."""


@traced
def group_parity(groups: Rows, group: int, x: Number, y: Number, z: Number) -> int:
    """Return the parity of the segment from R to (x, y, z) over a group of (n, 14, 8) float32, with the bit
    UNDECIDED where a lane is within the band."""
    side, least, most = planes_of(groups, group, (x, y, z))
    is_crossed = (side < -BAND) & ((least > BAND) | (most < -BAND))
    is_apart = (side > BAND) | ((least < -BAND) & (most > BAND))
    return (count_bits(bits_of(is_crossed)) & 1) | any_of(~(is_apart | is_crossed)) * UNDECIDED


def planes_of(groups: Rows, group: int, point: Sequence[Lanes]) -> tuple[Lanes, Lanes, Lanes]:
    """Return where the point is to the planes of the triangles, and to the lowest and highest of their edges."""
    rows = [load(groups, ROWS * group + row) for row in range(ROWS - 1)]
    side = dot(rows[0:3], point) - rows[3]
    a, b, c = dot(rows[4:7], point), dot(rows[7:10], point), dot(rows[10:13], point)
    return side, lesser(lesser(a, b), c), greater(greater(a, b), c)


@traced
def prefetch_group(groups: Rows, group: int) -> None:
    """Ask for a group to be brought near."""
    for place in range(0, ROWS * LANES, _LINE):
        prefetch(groups, ROWS * LANES * group + place)


def groups_of(n_groups: int) -> Any:
    """Return (n_groups, 14, 8) float32, uninitialised, that begins with a line of the cache: a group is seven."""
    return aligned((n_groups, ROWS, LANES), np.float32)
