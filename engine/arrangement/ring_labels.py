"""Labels of rounded rings that are arranged again: each ring is a source of its own.

Bit k of a label says whether a face lies in ring k, even-odd. A face is inside where it lies in a shell and in no hole
of that shell; its evidence names those shells, and that of a face outside the holes that it lies in. Evidence tells,
part by part, what the result came from (overlay_rounding.py states the same rule over integers of any length).
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from engine.jit import inline

MOST_RINGS: Final = 62
"""Rings that the bits of a label can name."""


class RingLabels(NamedTuple):
    """Rings first .. last - 1 are the sources; with none, labels are those of two polygons.

    shell: by ring the number, from ``first`` on, of the shell that it belongs to, its own where it is one. gathered:
    evidence by region, that is by cycle; beyond: by ring of the result, that of the regions on the other side of it.
    """

    shell: Any
    first: Any
    last: Any
    gathered: Any
    beyond: Any


@inline
def verdict(rings: RingLabels, label: int) -> tuple[bool, int]:
    """Tell whether a face is inside, and return its evidence."""
    shells = blocked = holes = 0
    for ring in range(rings.first, rings.last):
        if label >> (ring - rings.first) & 1:
            shell = rings.shell[ring]
            if rings.first + shell == ring:
                shells |= 1 << shell
            else:
                blocked |= 1 << shell
                holes |= 1 << (ring - rings.first)
    inside = shells & ~blocked
    return inside != 0, (inside if inside != 0 else holes)
