"""What the compiled clipping of polygons hands on: polygons, planes, results, and which planes cut."""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final, NamedTuple

from engine.compiling.jit import merged

CLIPPED: Final = 0
EXACT: Final = 1
"""States of a polygon, beside OPEN: settled by doubles, by whole numbers."""
DONE: Final = 0
"""Outcome of a run that reached its last polygon."""
NO_ROOM: Final = -2
"""Instead of a number of vertices: they have no room, or the kernel was stopped."""

Polygons = namedtuple("Polygons", "vertices ring_offsets polygon_offsets")
"""vertices: (m * dim,) float64, as one row of numbers; offsets of rings and of polygons: see `ClippedPolygons`."""

PlaneTables = namedtuple("PlaneTables", "high low axes at row_heap row_places")
"""Planes as the kernel takes them; prepared once a region where nothing is scaled.

high, low: (planes, dim + 1) float64, rows as double-doubles, every number zero or in the safe range. axes: (planes,)
int64, the axis that a plane cuts across in one known double `at`, else -1. row_heap, row_places: the rows in whole
numbers, see digits.py.
"""


class Plane(NamedTuple):
    """One of the planes: its number, and the axis that it cuts across at `place`, else -1."""

    high: Any
    low: Any
    number: int
    axis: int
    place: float


Clipped = namedtuple("Clipped", "vertices sizes state may_have_bridges")
"""What is left of polygons.

vertices: (room * dim,) float64, rings one after another. sizes: (n_rings,) int64, vertices left of each. state: (n,)
uint8, CLIPPED, EXACT or OPEN; an open polygon has sizes 0 and no vertices. may_have_bridges: (n,) bool.
"""

Cutting = namedtuple("Cutting", "planes slack contacts dropped")
"""The planes that may cut a polygon, in order.

planes: their numbers. slack: how far values in doubles may be wrong. contacts: in how many points all rings together
met a plane. dropped: whether one lost a vertex to it.
"""


@merged
def plane_of(planes: PlaneTables, number: int) -> Plane:
    """Return one of the planes."""
    return Plane(planes.high, planes.low, number, planes.axes[number], planes.at[number])


@merged
def has_bridges(cutting: Cutting, n_cutting: int) -> bool:
    """Tell whether a plane that dropped a vertex was met in more than two points."""
    may_have = False
    for i in range(n_cutting):
        may_have |= cutting.dropped[i] and cutting.contacts[i] > 2
    return may_have
