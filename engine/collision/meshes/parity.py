"""Is a vertex of one placed body inside another placed body: crossings of the half-line above it.

The half-line from q upward along the z axis of the other body's own coordinates is moved by (eps, eps^2) in x and y,
so that it meets no edge and no upright face: an orient2d that is exactly zero takes the sign of the first nonzero
derivative. A face that the half-line's line meets counts if it lies above q (orient3d); a zero there means q lies on
it. Caller guarantees that no face of the other body holds q where INSIDE or OUTSIDE is to be relied on; UNDECIDED is
settled with exact posed coordinates (`exact_regions.py`).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.arrays import FlagArray, Int8Array, Int32Array, IntArray
from engine.bounding.bvh import STACK
from engine.collision.meshes.mesh_arrays import MeshArrays, in_tree, triangle_of
from engine.collision.meshes.placement import (
    Placement,
    PoseArrays,
    defect_of,
    orient2d_near,
    place_pair,
    placed,
    turned_back,
)
from engine.collision.meshes.triangle_triangle import Facet
from engine.compiling.jit import allocating, inline, kernel, merged
from engine.lanes.boxes import inside_box
from engine.lanes.lanes import lowest_bit
from engine.predicates.orientation import orient3d
from engine.predicates.posed import orient3d_rounded
from engine.predicates.ties import tie_sign
from engine.predicates.vectors import as_point3, largest_of, minus
from engine.types import UNDECIDED, Point2, Point3

OUTSIDE = -1
INSIDE = 1
MISSED = 3
"""`half_line_crosses` beside 0 (on the face), 1 (above), -1 (below) and UNDECIDED: the moved line passes by."""


@inline
def moved_side(a: Point3, b: Point3, q: Point3, error: float) -> int:
    """Return the side of the line a b, seen along z, on which q moved by (eps, eps^2) lies; 0 if a and b coincide
    there. See predicates/ties.py."""
    side = orient2d_near(Point2(a.x, a.y), Point2(b.x, b.y), Point2(q.x, q.y), error)
    return side if side != 0 else tie_sign(a.x, a.y, b.x, b.y)


@inline
def half_line_crosses(t: Facet, q: Point3, error: float) -> int:
    """Return where the moved vertical line through q meets t: above q 1, below -1, at q 0; MISSED or UNDECIDED."""
    p_side, q_side = moved_side(t.p, t.q, q, error), moved_side(t.q, t.r, q, error)
    r_side = moved_side(t.r, t.p, q, error)
    has_left = p_side == 1 or q_side == 1 or r_side == 1
    has_right = p_side == -1 or q_side == -1 or r_side == -1
    if has_left and has_right:
        return MISSED
    if p_side == UNDECIDED or q_side == UNDECIDED or r_side == UNDECIDED:
        return UNDECIDED
    if p_side == 0 or q_side == 0 or r_side == 0:  # case: two corners above one another, an upright face
        return MISSED
    # counter-clockwise from above: 1 if q is above the face
    side = orient3d(t.p, t.q, t.r, q) if error == 0.0 else orient3d_rounded(t.p, t.q, t.r, q, error)
    return side if side == UNDECIDED or side == 0 else (-side if has_left else side)


class OwnPoint(NamedTuple):
    """A point in the own coordinates of a body, each coordinate off by at most `error`."""

    point: Point3
    error: float


@inline
def brought_back(p: Point3, source: Placement, target: Placement, defect: float) -> OwnPoint:
    """Return a point of one placed body in the own coordinates of another one placed with it.

    defect: of the target's rotation, `frames.defect_of`; the transpose stands for the inverse, which is off by 3.1
    defect of the vector it turns. A turned vector has components up to 1.74 times as large, and so has its error.
    """
    q = placed(p, source)
    if not target.is_posed:
        return OwnPoint(q, source.error)
    w = minus(q, target.shift)
    own = turned_back(target, w)
    if source.error == 0.0 and target.error == 0.0:  # nothing is rounded on a lattice
        return OwnPoint(own, 0.0)
    off = source.error + target.error + 2.0**-50 * (largest_of(q) + largest_of(w))
    return OwnPoint(own, 2.0 * off + (8.0 * defect + 2.0**-48) * largest_of(w) + 2.0**-1060)


@merged
def _last(p: Point3, axis: int) -> Point3:
    """Return a point with its coordinates turned so that those of an axis come last."""
    return p if axis == 2 else (Point3(p.y, p.z, p.x) if axis == 0 else Point3(p.z, p.x, p.y))


@allocating
def locate_point(own: OwnPoint, mesh: MeshArrays) -> int:
    """Return INSIDE, OUTSIDE, 0 (on a face) or UNDECIDED for one point."""
    where = locate_along(own, mesh, 2, -1)
    for axis in range(2 if where == UNDECIDED else 0):  # another half-line may keep clear of edges
        where = locate_along(own, mesh, axis, -1) if where == UNDECIDED else where
    return where


@allocating
def locate_along(own: OwnPoint, mesh: MeshArrays, axis: int, left_out: int) -> int:
    """Return what `locate_point` does by the half-line along any axis, one face left out."""
    q, error = own.point, own.error
    local, slack = in_tree(mesh, q), SLACK + error / mesh.scale
    if not (slack < 1.0 and np.isfinite(local.x + local.y + local.z)):  # case: the ends of the exponent range
        return UNDECIDED
    if largest_of(local) > 4.0 + slack:
        return OUTSIDE
    far = Point3(
        ABOVE_ALL if axis == 0 else local.x, ABOVE_ALL if axis == 1 else local.y, ABOVE_ALL if axis == 2 else local.z
    )
    box, q, stack = box_between(local, far, slack), _last(q, axis), np.empty(STACK, np.int32)
    stack[0] = 0
    n_above, unsure, on_face = 0, False, False
    face, n = next_face(mesh, stack, 1, box)
    while face >= 0:  # bound: the faces of the body
        t = triangle_of(mesh, face)
        how = half_line_crosses(Facet(_last(t.p, axis), _last(t.q, axis), _last(t.r, axis)), q, error)
        how = MISSED if face == left_out else how
        unsure |= how == UNDECIDED
        on_face |= how == 0
        n_above += how == 1
        face, n = next_face(mesh, stack, n, box)
    if on_face:
        return 0
    return UNDECIDED if unsure else (INSIDE if n_above % 2 == 1 else OUTSIDE)


@kernel
def locate_vertices(
    source: MeshArrays, source_pose: PoseArrays, vertices: IntArray, mesh: MeshArrays, pose: PoseArrays,
    found: Int8Array, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill found (n,) int8 for the vertices (n,) of `source` against `mesh`, each under its one pose."""
    a, b = place_pair(source.extent, source_pose, 0, mesh.extent, pose, 0)
    defect = defect_of(b)
    for item in range(vertices.shape[0]):
        if flag[0] != 0:
            return
        own = brought_back(as_point3(source.vertices, vertices[item]), a, b, defect)
        found[item] = locate_point(own, mesh)


SLACK = 2.0**-20
"""By how much a box in the tree's coordinates is widened for its rounding to float32."""
ABOVE_ALL = 1e6
"""In the coordinates of a tree, which are at most 2."""


@inline
def box_between(a: Point3, b: Point3, slack: float) -> tuple[Any, Any]:
    """Return the ends of the box from a to b, widened, as far as it matters, as triples of float32."""
    x, y, z = max(a.x - slack, -ABOVE_ALL), max(a.y - slack, -ABOVE_ALL), max(a.z - slack, -ABOVE_ALL)
    p, q, r = min(b.x + slack, ABOVE_ALL), min(b.y + slack, ABOVE_ALL), min(b.z + slack, ABOVE_ALL)
    return (np.float32(x), np.float32(y), np.float32(z)), (np.float32(p), np.float32(q), np.float32(r))


@inline
def next_face(mesh: MeshArrays, stack: Int32Array, n: int, box: tuple[Any, Any]) -> tuple[int, int]:
    """Return a face whose box meets a box, -1 if there is none left, and how much waits on the stack (STACK,) int32,
    which begins with the root, 0: nodes, and faces as in `MeshArrays.child`."""
    while n > 0:  # bound: each node and face enters once
        n -= 1
        child = int(stack[n])
        if child < 0:
            return -1 - child, n
        lanes = inside_box(mesh.boxes, child, box[0], box[1])
        while lanes != 0:
            stack[n] = mesh.child[child, lowest_bit(lanes)]
            lanes &= lanes - 1
            n += 1
    return -1, 0
