"""The certificate that a polyhedron is convex: one orientation a face and one an edge, all exact.

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

from engine.arrays import FloatArray, IntArray, read_only
from engine.jit import allocating, inline, kernel
from engine.predicates.orientation import orient3d
from engine.predicates.vectors import as_point3, corners_of
from engine.solids.polyhedron import Polyhedron
from engine.types import Point3

_FREE = -1
_TRIES = 8


@dataclass(frozen=True, slots=True, eq=False)
class Convexity:
    """What is known of a polyhedron certified convex.

    center: a point strictly inside. is_outward: whether its faces are counter-clockwise seen from outside.
    """

    center: FloatArray
    is_outward: bool


def convexity(solid: Polyhedron) -> Convexity | None:
    """Return the certificate, None where the solid is not convex or was not certified (a face without area, a centre
    of the vertices that rounds out of the solid, exponents beyond those of the predicates).

    Cost: the faces up to the first that fails; all of them, and a table of their edges, where none does.
    """
    return solid.prepared("convexity", lambda: _certified(solid))


def _certified(solid: Polyhedron) -> Convexity | None:
    with np.errstate(all="ignore"):  # an overflow is not certified; kernels, where they run uncompiled
        center = solid.vertices[solid.triangles.ravel()].mean(axis=0)
        if not np.isfinite(center).all():
            return None
        side = _certify(read_only(solid.vertices), read_only(solid.triangles), center)
    return None if side == 0 else Convexity(center, bool(side < 0))


@kernel
def _certify(vertices: FloatArray, triangles: IntArray, center: FloatArray) -> int:
    """Return the side, 1 or -1, of every face on which the centre of a convex solid lies; 0 where not certified."""
    o = Point3(center[0], center[1], center[2])
    n_faces = triangles.shape[0]
    side = 0
    for item in range(n_faces):
        a, b, c = corners_of(vertices, triangles, item)
        found = orient3d(a, b, c, o)
        if (found != 1 and found != -1) or (side != 0 and found != side):
            return 0
        side = found
    if not _is_locally_convex(vertices, triangles, side) or not _is_crossed_once(vertices, triangles, o, side):
        return 0
    return side


@allocating
def _is_locally_convex(vertices: FloatArray, triangles: IntArray, side: int) -> bool:
    """Tell whether across each edge the next triangle's far corner is on the centre's side of the plane, or on it."""
    n_faces = triangles.shape[0]
    size = 8
    while size < 6 * n_faces:  # bound: doubles
        size *= 2
    table = np.full(size, _FREE, np.int64)  # place of a directed edge: 3 * triangle + corner that it starts from
    for corner in range(3 * n_faces):
        start, end = triangles[corner // 3, corner % 3], triangles[corner // 3, (corner + 1) % 3]
        place = _place(table, triangles, start, end)
        if table[place] != _FREE:
            return False
        table[place] = corner
    for corner in range(3 * n_faces):
        item = corner // 3
        start, end = triangles[item, corner % 3], triangles[item, (corner + 1) % 3]
        other = table[_place(table, triangles, end, start)]
        if other == _FREE:
            return False
        if other < corner:
            continue  # the same four points
        a, b, c = corners_of(vertices, triangles, item)
        found = orient3d(a, b, c, as_point3(vertices, triangles[other // 3, (other + 2) % 3]))
        if found != 0 and found != side:
            return False
    return True


@inline
def _place(table: IntArray, triangles: IntArray, start: int, end: int) -> int:
    """Return where in the table the edge stands, or where it would. The table is at most half full."""
    mask = table.shape[0] - 1
    place = (start * 73856093 ^ end * 19349663) & mask
    for _ in range(table.shape[0]):
        corner = table[place]
        if corner == _FREE:
            break
        if triangles[corner // 3, corner % 3] == start and triangles[corner // 3, (corner + 1) % 3] == end:
            break
        place = (place + 1) & mask
    return place


@inline
def _is_crossed_once(vertices: FloatArray, triangles: IntArray, o: Point3, side: int) -> bool:
    """Tell whether some half-line from o through no edge crosses one triangle only.

    Through q: it crosses the triangle a, b, c where the planes o a b, o b c and o c a have q on the inner side, which
    is the opposite of `side`.
    """
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
    """Return how many triangles the half-line from o through q crosses, -1 where it may meet an edge."""
    n_crossed = 0
    for item in range(triangles.shape[0]):
        a, b, c = corners_of(vertices, triangles, item)
        first, second, third = orient3d(o, a, b, q), orient3d(o, b, c, q), orient3d(o, c, a, q)
        if first == -side and second == -side and third == -side:
            n_crossed += 1
        elif first != side and second != side and third != side:
            return -1  # on the wrong side of none, and on the plane of some, or undecided
    return n_crossed
