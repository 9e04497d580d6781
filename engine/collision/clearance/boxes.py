"""What a search for the nearest triangles sees and holds, and lower bounds on the distance of two boxes.

**Bounds.** All numbers are those of the two bodies under poses that `place_pair` moved together, times a power of two
that brings them near 1. A box is the image of eight corners under its body's matrix R, its centre c, so that for any
direction d the interval of d . x over it is d . c -+ sum |d . R_k| h_k; a gap between two intervals, over |d|, is below
the distance. `defect` bounds |R' R - I|: |d| of the axes, and the length of three gaps as that of one vector, are off
by less than twice it. Everything else is rounding: `margin`.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final, NamedTuple

import numpy as np

from engine.collision.meshes.mesh_arrays import MeshArrays
from engine.collision.meshes.placement import Placement, column, defect_of, turned, turned_back
from engine.jit import inline, merged
from engine.lanes.tracing import LANES
from engine.predicates.vectors import dot, largest_of, minus
from engine.types import Point3

MOST_LISTED: Final = 64
"""Blocks of either body that are measured in all pairs."""
ROOT: Final = -1
"""In place of a lane: the whole tree."""
_BOX_ROUNDING: Final = 2.0**-44
"""Of the size of both bodies: what 40 roundings of sums and products of coordinates may come to."""


_BELOW_ONE: Final = 1.0 - 2.0**-50


class View(NamedTuple):
    """A body as the search sees it: its mesh, where it is, and the power of two that its numbers are taken times."""

    mesh: MeshArrays
    place: Placement
    unit: float


class Frame(NamedTuple):
    """From the tree of the second body to the axes of the first: x' = columns x + shift, and what bounds allow for."""

    x: Point3
    y: Point3
    z: Point3
    """Rows of R_a' R_b."""
    shift: Point3
    shrink: float
    """What a length in the axes of a body is at least of that in space."""
    margin: float


Heap = namedtuple("Heap", "bounds lanes")
"""Pairs of boxes that wait, the least bound first: bounds (room,), lanes (room, 2) int64, eight a node, or ROOT."""

Candidates = namedtuple("Candidates", "pairs bounds")
"""Pairs of triangles: pairs (room, 4) int64, two triangles and two features; bounds (room,) float64 from below."""

Room = namedtuple("Room", "heap found limits line kept waiting waiting_bounds listed points")
"""Work space of searches, one at a time.

limits (2,): of a search (traversal.py). line (12,): the direction of the nearest pair so far, not longer than 1, in
the axes of both bodies and in space; where the two origins are along it; how often it turned. kept (n_nodes, 4): of
either body the turn at which `block_reach` was found, and it. waiting, waiting_bounds (n_nodes,), listed (2,
MOST_LISTED): nodes of one body. points (2, 3): the nearest.
"""


def new_room(room: int, n_nodes: int) -> Room:
    """Return work space for so many pairs, and trees of so many nodes."""
    heap, found = Heap(np.empty(room), np.empty((room, 2), np.int64)), np.empty((room, 4), np.int64)
    return Room(
        heap, Candidates(found, np.empty(room)), np.empty(2), np.zeros(12), np.zeros((n_nodes, 4)),
        np.empty(n_nodes + LANES, np.int32), np.empty(n_nodes + LANES), np.empty((2, MOST_LISTED), np.int32),
        np.empty((2, 3)),
    )  # fmt: skip


class Search(NamedTuple):
    """One question: both bodies, the map between them, bound on the distance of a point from its rounded one (both
    bodies together), and work space."""

    a: View
    b: View
    frame: Frame
    error: float
    room: Room


@inline
def frame_of(a: View, b: View) -> Frame:
    """Return the map between two trees."""
    p, q = a.place, b.place
    u, v, w = turned_back(p, column(q, 0)), turned_back(p, column(q, 1)), turned_back(p, column(q, 2))
    origin, other = a.mesh.origin, b.mesh.origin
    there = turned(q, scaled(Point3(other[0], other[1], other[2]), b.unit))
    moved = scaled(minus(q.shift, p.shift), a.unit)
    t = turned_back(p, Point3(there.x + moved.x, there.y + moved.y, there.z + moved.z))
    shift = minus(t, scaled(Point3(origin[0], origin[1], origin[2]), a.unit))
    size = 4.0 * (a.mesh.extent.reach * a.unit + b.mesh.extent.reach * b.unit) + 2.0 * largest_of(moved)
    defect = defect_of(p) + defect_of(q)
    return Frame(
        Point3(u.x, v.x, w.x), Point3(u.y, v.y, w.y), Point3(u.z, v.z, w.z), shift,
        1.0 - 8.0 * defect - 2.0**-40, (_BOX_ROUNDING + 16.0 * defect) * size + 1e-300,
    )  # fmt: skip


@merged
def scaled(p: Point3, unit: float) -> Point3:
    """Return a point times the unit; order: before any product, which would be lost where coordinates are denormal."""
    return Point3(p.x * unit, p.y * unit, p.z * unit)


@merged
def magnitudes(v: Point3) -> Point3:
    return Point3(abs(v.x), abs(v.y), abs(v.z))


@merged
def _gap(value: float, reach: float) -> float:
    return max(abs(value) - reach, 0.0)


@inline
def box_bound(s: Search, most: float, c: Point3, h: Point3, other: Point3, half: Point3) -> float:
    """Return a lower bound on the distance of two boxes, each given by centre and half widths in its own axes.

    most: what is beyond it need not be told by how much.
    """
    f, line = s.frame, s.room.line
    v = Point3(dot(f.x, other) + f.shift.x - c.x, dot(f.y, other) + f.shift.y - c.y, dot(f.z, other) + f.shift.z - c.z)
    d, e = Point3(line[0], line[1], line[2]), Point3(line[3], line[4], line[5])
    along = dot(d, v) - dot(magnitudes(d), h) - dot(magnitudes(e), half)
    if along * f.shrink - f.margin > most:
        return most * 2.0
    mx, my, mz = magnitudes(f.x), magnitudes(f.y), magnitudes(f.z)
    x, y, z = _gap(v.x, h.x + dot(mx, half)), _gap(v.y, h.y + dot(my, half)), _gap(v.z, h.z + dot(mz, half))
    square = x * x + y * y + z * z
    p, q, r = Point3(f.x.x, f.y.x, f.z.x), Point3(f.x.y, f.y.y, f.z.y), Point3(f.x.z, f.y.z, f.z.z)
    w = Point3(dot(p, v), dot(q, v), dot(r, v))
    x = _gap(w.x, half.x + mx.x * h.x + my.x * h.y + mz.x * h.z)
    y = _gap(w.y, half.y + mx.y * h.x + my.y * h.y + mz.y * h.z)
    z = _gap(w.z, half.z + mx.z * h.x + my.z * h.y + mz.z * h.z)
    bound, size = np.sqrt(max(square, x * x + y * y + z * z)), np.sqrt(dot(v, v))
    if size > 0.0:
        bound = max(bound, size - (dot(magnitudes(v), h) + dot(magnitudes(w), half)) / size)
    return max(max(bound, along) * f.shrink - f.margin, 0.0)


@merged
def _in_lane(view: View, at: int, row: int) -> Point3:
    node, lane, b = at >> 3, at & 7, view.mesh.boxes
    p = Point3(float(b[node, row, lane]), float(b[node, row + 1, lane]), float(b[node, row + 2, lane]))
    return scaled(p, view.mesh.scale * view.unit)


@merged
def lane_centre(view: View, at: int) -> Point3:
    """Return the centre of a box in the axes of its body, from the origin of its tree; ROOT is all of the tree."""
    return Point3(0.0, 0.0, 0.0) if at == ROOT else _in_lane(view, at, 0)


@merged
def lane_half(view: View, at: int) -> Point3:
    """Return the half widths of a box."""
    whole = 2.0 * (view.mesh.scale * view.unit)
    return Point3(whole, whole, whole) if at == ROOT else _in_lane(view, at, 3)


@inline
def set_line(line: Any, a: View, b: View, d: Point3) -> None:
    """Keep a direction, not longer than 1, in the axes of either body and in space."""
    d = Point3(_BELOW_ONE * d.x, _BELOW_ONE * d.y, _BELOW_ONE * d.z)
    e, f = turned_back(a.place, d), turned_back(b.place, d)
    line[0], line[1], line[2] = e.x, e.y, e.z
    line[3], line[4], line[5] = f.x, f.y, f.z
    line[6], line[7], line[8] = d.x, d.y, d.z
    line[9] = dot(d, scaled(a.place.shift, a.unit))
    line[10] = dot(d, scaled(b.place.shift, b.unit))
    line[11] += 1.0
