"""What a search for the nearest triangles sees and holds; of two blocks, which pairs of triangles may be the nearest.

All numbers are those of the two bodies under poses that `place_pair` moved together, times a power of two that brings
them near 1.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final, NamedTuple

import numpy as np

from engine.arrays import Float32Array, FloatArray
from engine.collision.meshes.mesh_arrays import MeshArrays, triangle_of
from engine.collision.meshes.near_triangles import nearest_points, rounding_of, seen_from
from engine.collision.meshes.placement import Placement, placed
from engine.collision.meshes.triangle_triangle import Facet
from engine.compiling.jit import inline, merged
from engine.lanes.boxes import BOX_ROWS, EMPTY, FRAME_ROWS
from engine.lanes.discs import DISC_ROWS
from engine.lanes.gaps import FIXED_ROWS, GAP_ROWS, near_triangle, place_triangles
from engine.lanes.lanes import lowest_bit
from engine.lanes.tracing import LANES
from engine.types import Point3

ROOT: Final = -1
"""In place of a lane: the whole tree."""
_BELOW_ONE: Final = 1.0 - 2.0**-50


class View(NamedTuple):
    """A body as the search sees it: its mesh, where it is, and the power of two that its numbers are taken times."""

    mesh: MeshArrays
    place: Placement
    unit: float


Heap = namedtuple("Heap", "bounds lanes")
"""Pairs of boxes that wait, the least bound first: bounds (room,), lanes (room, 2) int64, eight a node, or ROOT."""

Candidates = namedtuple("Candidates", "pairs bounds")
"""Pairs of triangles: pairs (room, 4) int64, two triangles and two features; bounds (room,) float64 from below."""

Room = namedtuple("Room", "heap found limits points frames work fixed")
"""Work space of searches, one at a time.

limits (2,): of a search (traversal.py). points (2, 3): the nearest. frames, work, fixed: of `lanes/gaps.py`.
"""


def new_room(room: int) -> Room:
    """Return work space for so many pairs."""
    heap, found = Heap(np.empty(room), np.empty((room, 2), np.int64)), np.empty((room, 4), np.int64)
    return Room(
        heap, Candidates(found, np.empty(room)), np.empty(2),
        np.empty((2, 3)), np.empty((2, FRAME_ROWS, LANES), np.float32), np.empty((GAP_ROWS, LANES), np.float32),
        np.empty((FIXED_ROWS, LANES), np.float32),
    )  # fmt: skip


class Search(NamedTuple):
    """One question: both bodies, a bound on the rounding of points of both together, and work space."""

    a: View
    b: View
    error: float
    room: Room


@merged
def scaled(p: Point3, unit: float) -> Point3:
    """Return a point times the unit; order: before any product, which would be lost where coordinates are denormal."""
    return Point3(p.x * unit, p.y * unit, p.z * unit)


@inline
def fix(view: View, at: int, fixed: Float32Array) -> None:
    """Write box and disc of a lane, or what holds the whole tree, to the first column of `fixed`."""
    if at == ROOT:
        for row in range(FIXED_ROWS):
            fixed[row, 0] = 4.0 if row > 11 else (2.0 if 3 <= row < 6 else (1.0 if row == 9 else 0.0))
        return
    for row in range(BOX_ROWS):
        fixed[row, 0] = view.mesh.boxes[at >> 3, row, at & 7]
    for row in range(DISC_ROWS):
        fixed[BOX_ROWS + row, 0] = view.mesh.discs[at >> 3, row, at & 7]


@merged
def size_of(view: View) -> float:
    """Return the unit of a body's tree."""
    return float(view.mesh.scale * view.unit)


DONE: Final = 0
FULL: Final = 1
CLOSER: Final = 2
INTERRUPTED: Final = 3
"""How a search ended: with all pairs; without room for more pairs of boxes or triangles; with two points nearer than
asked; by the flag."""
_ABOVE_ONE: Final = 1.0 + 2.0**-22


@merged
def _triangle(view: View, item: int) -> Facet:
    """Return a placed triangle, rounded, times the unit."""
    t, place, unit = triangle_of(view.mesh, item), view.place, view.unit
    return Facet(scaled(placed(t.p, place), unit), scaled(placed(t.q, place), unit), scaled(placed(t.r, place), unit))


@inline
def _measure(s: Facet, t: Facet, error: float, most: float) -> tuple[float, float, tuple[int, int]]:
    """Return bounds on the distance of two triangles, from below and above, and the features of nearly nearest
    points; of any where the lower bound is above `most`.

    error: bound on the distance of a point from its rounded one, both bodies together.
    """
    origin = s.p
    s, t = seen_from(origin, s), seen_from(origin, t)
    slack = rounding_of(s, t) + error
    best, across = nearest_points(s, t, most + slack)
    return max(across.low - slack, 0.0), across.size + slack, (best.first, best.second)


@inline
def keep_below(found: Candidates, n: int, most: float) -> int:
    """Leave out the candidates above the bound; return how many there are."""
    n_kept = 0
    for item in range(n):
        if found.bounds[item] <= most:
            found.bounds[n_kept] = found.bounds[item]
            for column in range(4):
                found.pairs[n_kept, column] = found.pairs[item, column]
            n_kept += 1
    return n_kept


@merged
def measure_blocks(s: Search, i: int, j: int, n_found: int, limits: FloatArray) -> tuple[int, int]:
    """Add the pairs of triangles of two blocks that may be the nearest; return how that ended, and their number.

    limits: as in `find_nearest`; the first falls.
    """
    frames, work, found, per_size = s.room.frames, s.room.work, s.room.found, _ABOVE_ONE / size_of(s.a)
    place_triangles(s.b.mesh.blocks, j, frames, work)
    for k in range(LANES):
        own = int(s.a.mesh.child[i, k])
        if own == EMPTY:
            break
        bits = near_triangle(s.a.mesh.blocks, i, k, frames, limits[0] * per_size, work)
        t = _triangle(s.a, -1 - own)
        while bits != 0:  # bound: each turn takes a bit
            their = int(s.b.mesh.child[j, lowest_bit(bits)])
            bits &= bits - 1
            if their == EMPTY:
                break
            low, high, features = _measure(t, _triangle(s.b, -1 - their), s.error, limits[0])
            if high < limits[1]:
                return CLOSER, 0
            if high < limits[0]:
                limits[0] = high
            if low > limits[0]:
                continue
            if n_found == len(found.bounds):
                n_found = keep_below(found, n_found, limits[0])
                if 2 * n_found > len(found.bounds):
                    return FULL, 0
            found.bounds[n_found] = low
            found.pairs[n_found, 0], found.pairs[n_found, 1] = -1 - own, -1 - their
            found.pairs[n_found, 2], found.pairs[n_found, 3] = features
            n_found += 1
    return DONE, n_found
