"""Certifies that a polyhedron is convex, by one exact orientation sign a face and one an edge.

Let o be a point strictly on one and the same side of the planes of all triangles. The triangles of a closed mesh are
then seen from o, all turned the same way, as a chain of spherical triangles without a border, so every half-line from o
that meets no edge crosses the same number of them; one crossing for one such half-line means one for all. Then the
directions of the triangles tile the sphere, the mesh is the graph of a distance over it, and the even-odd solid is
what lies between o and the graph. Take the function g that is 1 on the mesh and linear on the cone from o over each
triangle: the solid is g <= 1. Where two triangles share an edge, g bends upward or not at all exactly when the far
corner of each does not lie beyond the plane of the other. A segment that avoids the half-lines from o through vertices
only passes such places, so g is convex along it; and g is continuous, so it is convex along every segment. The solid is
convex, and it is the hull of its vertices.

Conversely a convex solid whose triangles all have an area passes, provided o lies strictly inside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine.compiling.jit import allocating, allocating_kernel, entry_of, inline
from engine.predicates.orientation import orient3d
from engine.predicates.vectors import as_point3, corners_of
from engine.solids.mesh import Polyhedron
from engine.types import FloatArray, IntArray, Point3, read_only

_TRIES = 8


@dataclass(frozen=True, slots=True, eq=False)
class Convexity:
    """Certificate that a polyhedron is convex. center: a point strictly inside. is_outward: the faces are
    counter-clockwise seen from outside, else clockwise."""

    center: FloatArray
    is_outward: bool


def convexity(solid: Polyhedron) -> Convexity | None:
    """Return the certificate that a polyhedron is convex; None if it is not, or if that cannot be certified. It cannot
    be certified where a face has no area, the centre rounds out of the solid, or exponents are beyond those of the
    predicates. Cost: the faces up to the first that fails; else all faces and a table of their edges."""
    return solid.prepared("convexity", lambda: _certified(solid))


def _certified(solid: Polyhedron) -> Convexity | None:
    center, side = _center_and_side(solid, True)
    return Convexity(center, side < 0) if side != 0 else None


def _center_and_side(solid: Polyhedron, is_convex: bool) -> tuple[FloatArray, int]:
    """Return the mean corner of all triangles, and what `_certified_side` says."""
    center = np.empty(3)
    with np.errstate(all="ignore"):  # an overflow is not certified; kernels, where they run uncompiled
        return center, entry_of(_certified_side)(
            read_only(solid.vertices), read_only(solid.triangles), is_convex, center
        )


def star_side(solid: Polyhedron) -> int:
    """Return -1 if the mesh of a polyhedron is the graph of a distance over a sphere about its centre, see the head of
    this file, with its faces counter-clockwise seen from outside, 1 with clockwise ones; 0 if that is not certain."""
    return _center_and_side(solid, False)[1]


@allocating_kernel
def _certified_side(vertices: FloatArray, triangles: IntArray, is_convex: bool, center: FloatArray) -> int:
    """Fill center (3,) with the mean corner of all triangles. Return the common side of all triangles on which it lies,
    if some half-line from it crosses one triangle, and, if is_convex, the mesh is convex at each edge; else 0."""
    side = _common_side(vertices, triangles, center)
    if side == 0 or (is_convex and not _is_convex(vertices, triangles, side)):
        return 0
    return side if _is_crossed_once(vertices, triangles, Point3(center[0], center[1], center[2]), side) else 0


@inline
def _common_side(vertices: FloatArray, triangles: IntArray, center: FloatArray) -> int:
    """Fill center (3,) with the mean corner of all triangles; return 1 or -1 if orient3d(a, b, c, center) has that sign
    for all of them, else 0."""
    center[:] = 0.0
    for item in range(triangles.shape[0]):
        for corner in range(3):
            for axis in range(3):
                center[axis] += vertices[triangles[item, corner], axis]
    for axis in range(3):
        center[axis] /= 3 * triangles.shape[0]
    o, side = Point3(center[0], center[1], center[2]), 0
    if not np.isfinite(o.x + o.y + o.z):
        return 0
    for item in range(triangles.shape[0]):
        a, b, c = corners_of(vertices, triangles, item)
        sign = orient3d(a, b, c, o)
        if (sign != 1 and sign != -1) or (side != 0 and sign != side):
            return 0
        side = sign
    return side


@allocating
def _is_convex(vertices: FloatArray, triangles: IntArray, side: int) -> bool:
    """Return whether the mesh is locally convex at every edge, each of which is used once in either direction. side:
    result of `_common_side`. The edge that starts at corner k of triangle i has number 3 i + k; a hash table lists
    them."""
    n_slots = 8
    while n_slots < 6 * triangles.shape[0]:
        n_slots *= 2
    slots = np.full(n_slots, -1, np.int64)
    for edge in range(3 * triangles.shape[0]):
        slot = _slot_of_edge(slots, triangles, triangles[edge // 3, edge % 3], triangles[edge // 3, (edge + 1) % 3])
        if slots[slot] >= 0:
            return False
        slots[slot] = edge
    for edge in range(3 * triangles.shape[0]):
        slot = _slot_of_edge(slots, triangles, triangles[edge // 3, (edge + 1) % 3], triangles[edge // 3, edge % 3])
        other = slots[slot]
        if other < 0:
            return False
        a, b, c = corners_of(vertices, triangles, edge // 3)
        sign = orient3d(a, b, c, as_point3(vertices, triangles[other // 3, (other + 2) % 3])) if other > edge else 0
        if sign != 0 and sign != side:
            return False
    return True


@inline
def _slot_of_edge(slots: IntArray, triangles: IntArray, start: int, end: int) -> int:
    """Return the slot of the edge from one vertex to another in an open-addressing hash table of edges, -1 in free
    slots; the free slot for it if it is not there."""
    last = slots.shape[0] - 1
    place = ((start * 73856093) ^ (end * 19349663)) & last
    while slots[place] >= 0:  # bound: a quarter of the places are free
        edge = slots[place]
        if triangles[edge // 3, edge % 3] == start and triangles[edge // 3, (edge + 1) % 3] == end:
            break
        place = (place + 1) & last
    return place


@inline
def _is_crossed_once(vertices: FloatArray, triangles: IntArray, o: Point3, side: int) -> bool:
    """Return whether a half-line from o that meets no edge crosses exactly one triangle; False if none of up to
    `_TRIES` half-lines avoids all edges. A half-line through q crosses triangle abc if q is on the inner side (the
    opposite of `side`) of the planes oab, obc, oca."""
    for attempt in range(min(_TRIES, triangles.shape[0])):
        a, b, c = corners_of(vertices, triangles, attempt)
        q = Point3(
            0.5 * a.x + 0.3125 * b.x + 0.1875 * c.x,
            0.5 * a.y + 0.3125 * b.y + 0.1875 * c.y,
            0.5 * a.z + 0.3125 * b.z + 0.1875 * c.z,
        )
        n_crossed = _crossings(vertices, triangles, o, q, side)
        if n_crossed >= 0:
            return n_crossed == 1
    return False


@inline
def _crossings(vertices: FloatArray, triangles: IntArray, o: Point3, q: Point3, side: int) -> int:
    """Return how many triangles the half-line from o through q crosses; -1 if it may meet an edge. side: as in
    `_is_crossed_once`."""
    n_crossed = 0
    for item in range(triangles.shape[0]):
        a, b, c = corners_of(vertices, triangles, item)
        first, second, third = orient3d(o, a, b, q), orient3d(o, b, c, q), orient3d(o, c, a, q)
        if first == -side and second == -side and third == -side:
            n_crossed += 1
        elif first != side and second != side and third != side:
            return -1  # on the wrong side of none, and on the plane of some, or undecided
    return n_crossed
