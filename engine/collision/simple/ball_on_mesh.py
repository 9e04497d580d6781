"""Balls and a mesh without a pose: the relation and its witness from floats, where those prove it.

The faces near the ball are found by the tree. Of each in question nearly nearest points and the slab between them and
the centre (`near_triangles.py`) prove that it enters the open ball, or keeps clear of the closed one; the witness is
the one that enters of which the box is nearest. A centre that no face comes near to lies where a half-line tells, and
a face that no other one covers, as the caller asks, has the open interior beside it. Whatever is not proven is
UNSETTLED.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import FlagArray, FloatArray, IntArray
from engine.bounding.bvh import STACK
from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, TOUCHING, UNSETTLED
from engine.collision.meshes.mesh_arrays import MeshArrays, in_tree, triangle_of
from engine.collision.meshes.near_triangles import nearest_points, rounding_of, seen_from
from engine.collision.meshes.parity import INSIDE, OUTSIDE, SLACK, OwnPoint, box_between, locate_point, next_face
from engine.collision.meshes.triangle_triangle import Facet
from engine.compiling.jit import allocating, inline, kernel
from engine.predicates.vectors import as_point3, dot, largest_of, minus
from engine.types import Point3

_MANY = 4096
_SPREAD = 64


@inline
def _box_distance(t: Facet, center: Point3, slack: float) -> float:
    """Return a lower bound on the square of the distance of a triangle's box, as `box_distance_bounds` does."""
    square = 0.0
    for c, p, q, r in (
        (center.x, t.p.x, t.q.x, t.r.x), (center.y, t.p.y, t.q.y, t.r.y), (center.z, t.p.z, t.q.z, t.r.z),
    ):  # fmt: skip
        gap = max(max((min(p, q, r) - slack) - c, c - (max(p, q, r) + slack)), 0.0)
        square += gap * gap
    square = square * (1.0 - 2.0**-48) - 2.0**-1000
    return square if np.isfinite(square) else 0.0


@inline
def _enters(t: Facet, own: OwnPoint, radius: float) -> int:
    """Tell whether a triangle surely enters the open ball: 1, surely keeps clear of the closed one: 0; else UNSETTLED.

    The corners as seen from the centre are off by its error and a rounding, the distances by less than twice that.
    """
    t, none = seen_from(own.point, t), Point3(0.0, 0.0, 0.0)
    center = Facet(none, none, none)
    slack = 4.0 * rounding_of(t, center) + 2.0 * own.error + 2.0**-50 * radius
    inner = radius - slack
    if inner > 2.0**-500 and min(dot(t.p, t.p), dot(t.q, t.q), dot(t.r, t.r)) < inner * inner * (1.0 - 2.0**-49):
        return 1
    _, across = nearest_points(center, t, radius + 2.0 * slack)  # order: edges are measured from the ends of the first
    return 1 if across.size < inner else (0 if across.low > radius + slack else UNSETTLED)


@allocating
def _first_to_enter(own: OwnPoint, radius: float, mesh: MeshArrays, is_named: bool, flag: FlagArray) -> tuple[int, int]:
    """Return the relation of the surface of a mesh and a ball as far as it is proven, DISJOINT or TOUCHING (a face
    enters the ball), and of the faces that enter any, or where it is to be named the one of the nearest box, of equal
    ones the first."""
    center, error = own
    sizes = largest_of(Point3(mesh.origin[0], mesh.origin[1], mesh.origin[2])) + largest_of(center) + radius
    local, slack = in_tree(mesh, center), SLACK + (error + 2.0**-48 * sizes) / mesh.scale
    if not (slack < 1.0 and np.isfinite(local.x + local.y + local.z)):  # case: the ends of the exponent range
        return UNSETTLED, -1
    box, stack = box_between(local, local, radius / mesh.scale + slack), np.empty(STACK, np.int32)
    stack[0] = 0
    best, found, unsure, box_slack = np.inf, -1, np.inf, 2.0**-50 * largest_of(center) + 2.0**-1070
    reach = (radius + 2.0 * error) * (1.0 + 2.0**-40)
    beyond = reach * reach + 2.0**-990  # what is as far from the rounded centre keeps clear of the ball
    face, n = next_face(mesh, stack, 1, box)
    while face >= 0:  # bound: the faces of the body
        t = triangle_of(mesh, face)
        square = _box_distance(t, center, box_slack)
        if square <= beyond and (square < best or (square == best and face < found)):
            how = _enters(t, own, radius)
            if how == 1:
                best, found = square, face
                if not is_named:
                    return TOUCHING, found
                within = np.sqrt(square * (1.0 + 2.0**-40) + 2.0**-990)  # of any box that bounds as near
                box = box_between(local, local, within / mesh.scale + slack)
            elif how == UNSETTLED:
                unsure = min(unsure, square)
        if flag[0] != 0:
            return UNSETTLED, -1
        face, n = next_face(mesh, stack, n, box)
    if unsure <= best and unsure < np.inf:
        return UNSETTLED, -1
    return (DISJOINT if found < 0 else TOUCHING), found


@inline
def _holds(vertex: int, own: OwnPoint, radius: float, mesh: MeshArrays) -> int:
    """Tell whether a vertex of a mesh surely lies in the open ball: 1, surely does not: 0; else UNSETTLED."""
    v = minus(as_point3(mesh.vertices, vertex), own.point)
    size = np.sqrt(dot(v, v))
    slack = 2.0**-49 * (size + radius) + 2.0 * own.error + 2.0**-500
    return 1 if size < radius - slack else (0 if size > radius + slack else UNSETTLED)


@inline
def _holds_all(own: OwnPoint, radius: float, mesh: MeshArrays, flag: FlagArray) -> int:
    """Tell whether all vertices of a mesh surely lie in the open ball: 1, one surely does not: 0; else UNSETTLED.

    Some that are spread over the mesh are asked first: neighbours are alike.
    """
    n, result = mesh.vertices.shape[0], 1
    for step in (n // _SPREAD + 1, 1):
        for vertex in range(0, n, step):
            held = _holds(vertex, own, radius, mesh)
            if held == 0:
                return 0
            if held == UNSETTLED or (vertex % _MANY == 0 and flag[0] != 0):
                result = UNSETTLED
    return result


@inline
def _relate(own: OwnPoint, radius: float, mesh: MeshArrays, is_named: bool, flag: FlagArray) -> tuple[int, int]:
    relation, triangle = _first_to_enter(own, radius, mesh, is_named, flag)
    if relation == DISJOINT:
        where = locate_point(own, mesh) if mesh.has_inside else OUTSIDE
        return (SECOND_INSIDE_FIRST if where == INSIDE else (DISJOINT if where == OUTSIDE else UNSETTLED)), -1
    if relation == TOUCHING:
        is_within = _holds_all(own, radius, mesh, flag)
        if is_within != 0:
            return (FIRST_INSIDE_SECOND if is_within == 1 else UNSETTLED), -1
        return (OVERLAPPING if mesh.has_inside else TOUCHING), triangle
    return UNSETTLED, -1


@kernel
def relate_balls(
    mesh: MeshArrays, centers: FloatArray, radius: float, is_named: bool, found: IntArray, flag: FlagArray
) -> None:
    """Fill found (n, 2) int64 with the relation of a mesh (first) and a ball about each of centers (n, 4), a point and
    how far each of its coordinates may be off, or UNSETTLED; and a triangle that enters it, where the relation is
    overlapping, unless even-odd cancels that one, or touching; the one that names the contact if `is_named`.
    """
    for row in range(centers.shape[0]):
        if flag[0] != 0:
            found[row, 0] = UNSETTLED
        else:
            own = OwnPoint(as_point3(centers, row), float(centers[row, 3]))
            found[row, 0], found[row, 1] = _relate(own, radius, mesh, is_named, flag)
