"""Data types of the compiled clipping of polygons: polygons, planes, results, and which planes cut."""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final, NamedTuple

from engine.compiling.jit import merged

CLIPPED: Final = 0
EXACT: Final = 1
"""States of a polygon, besides OPEN: CLIPPED, decided by doubles; EXACT, by multi-digit integers."""
DONE: Final = 0
"""Outcome: all polygons are clipped."""
NO_ROOM: Final = -2
"""In place of a number of vertices: they do not fit, or the kernel was stopped."""

Polygons = namedtuple("Polygons", "vertices ring_offsets polygon_offsets")
"""vertices: (m * dim,) float64, flat; offsets of rings and of polygons: see `ClippedPolygons`."""

PlaneTables = namedtuple("PlaneTables", "high low axes at row_heap row_places")
"""Planes for the kernel; prepared once a region where nothing is scaled.

| field | dtype, shape | meaning |
| --- | --- | --- |
| high, low | float64 (planes, dim + 1) | rows as double-doubles, every number zero or in the safe range |
| axes, at | int64, float64 (planes,) | the axis that a plane crosses at one double `at`, else -1 |
| row_heap, row_places | | the rows as multi-digit integers, see digits.py |
"""


class Plane(NamedTuple):
    """One of the planes of the tables. high, low: all rows; number: its row; axis: the axis that it crosses at
    coordinate `place`, -1 for an oblique plane."""

    high: Any
    low: Any
    number: int
    axis: int
    place: float


Clipped = namedtuple("Clipped", "vertices sizes state may_have_bridges")
"""The clipped polygons.

| field | dtype, shape | meaning |
| --- | --- | --- |
| vertices | float64 (room * dim,) | ring after ring |
| sizes | int64 (n_rings,) | vertices left of each ring |
| state | uint8 (n,) | CLIPPED, EXACT or OPEN; an open polygon has sizes 0 and no vertices |
| may_have_bridges | bool (n,) | see `ClippedPolygons` |
"""

Cutting = namedtuple("Cutting", "planes slack contacts dropped")
"""The planes that may cut a polygon, in order. planes: their numbers. slack: error bounds of values in doubles.
contacts: number of points in which all rings together met a plane. dropped: whether a ring lost a vertex to it."""


@merged
def plane_of(planes: PlaneTables, number: int) -> Plane:
    """Return plane ``number`` of the tables."""
    return Plane(planes.high, planes.low, number, planes.axes[number], planes.at[number])


@merged
def has_bridges(cutting: Cutting, n_cutting: int) -> bool:
    """Return whether a plane that dropped a vertex was met in more than two points: bridge edges are possible."""
    may_have = False
    for i in range(n_cutting):
        may_have |= cutting.dropped[i] and cutting.contacts[i] > 2
    return may_have
