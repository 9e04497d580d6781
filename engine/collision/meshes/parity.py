"""Ray parity and self-intersection state of a mesh: point location, states of faces, inner sides of faces.

**Points.** The ray from q upward along the z axis of the body's own coordinates is moved by (eps, eps^2) in x and y, so
that it meets no edge and no upright face (orientation.py). A face on the ray's line counts if it lies above q
(orient3d); a zero there means that q lies on it. Caller guarantees that no face contains q if INSIDE or OUTSIDE is
relied on; UNDECIDED is settled with exact posed coordinates (`exact_regions.py`).

**Faces** are clean, crossed or stacked (`mesh_arrays.py`), by exact signs of the unposed coordinates; computed on
demand and cached in the mesh. A strict crossing of two faces proves that two interiors overlap if nothing else of the
two bodies cancels or fans out along it. Near a general point of the crossing line a body whose face is clean there is a
half-space; the other body's face, not stacked, flips its inside on both sides of the first plane: so one of its two
flips lies in that half-space. Hence the rule `proves_overlap`.

**Sides.** No other face covers a clean face, so its body lies on one side of it except at single points. The faces
above a point within it, along an axis that crosses it, decide which: an odd number, above.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.bounding.bvh import STACK
from engine.collision.meshes.mesh_arrays import (
    STATE_CLEAN,
    STATE_CROSSED,
    STATE_STACKED,
    STATE_UNKNOWN,
    MeshArrays,
    in_tree,
    triangle_of,
)
from engine.collision.meshes.placement import (
    Placement,
    PoseArrays,
    defect_of,
    orient2d_near,
    place_pair,
    placed,
    rotate_back,
)
from engine.collision.meshes.triangle_triangle import (
    CROSSING,
    Facet,
    classify,
    classify_near,
    corner,
    is_straddling,
    passes_within,
    projected,
    separation,
    with_pose,
)
from engine.compiling.jit import allocating, allocating_kernel, called, entry_of, inline, kernel, merged
from engine.lanes.boxes import inside_box
from engine.lanes.lanes import lowest_bit
from engine.predicates.orientation import orient2d, orient3d, tie_sign
from engine.predicates.posed import orient3d_rounded
from engine.predicates.vectors import as_point3, largest_of, minus
from engine.types import UNDECIDED, FlagArray, FloatArray, Int8Array, Int32Array, IntArray, Point2, Point3

OUTSIDE = -1
INSIDE = 1
MISSED = 3
"""Result of `ray_crosses` if the perturbed line misses the face; other results: 0 on the face, 1 above, -1 below,
UNDECIDED."""


@inline
def perturbed_side(a: Point3, b: Point3, q: Point3, error: float) -> int:
    """Return the side (1 left, -1 right) of the line a b, seen along z, on which q moved by (eps, eps^2) lies; 0 if a =
    b in x, y; UNDECIDED. error: of each coordinate of q."""
    side = orient2d_near(Point2(a.x, a.y), Point2(b.x, b.y), Point2(q.x, q.y), error)
    return side if side != 0 else tie_sign(a.x, a.y, b.x, b.y)


@inline
def ray_crosses(t: Facet, q: Point3, error: float) -> int:
    """Return where the vertical line through q, moved by (eps, eps^2), intersects t. 1: above q, -1: below q, 0: at q;
    MISSED or UNDECIDED. error: bound on each coordinate of q."""
    p_side, q_side = perturbed_side(t.p, t.q, q, error), perturbed_side(t.q, t.r, q, error)
    r_side = perturbed_side(t.r, t.p, q, error)
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
    """A point in the own coordinates of a body, before its pose; each coordinate is off by at most `error`."""

    point: Point3
    error: float


@inline
def to_local_frame(p: Point3, source: Placement, target: Placement, defect: float) -> OwnPoint:
    """Return a point p of the body placed by `source`, given before that placement, in the own coordinates of the body
    placed by `target` (its pose frame). defect: `defect_of` target; the transpose replaces the inverse rotation, with
    an error of 3.1 defect relative to the vector. A rotated vector has components up to 1.74 times as large, and so has
    its error."""
    q = placed(p, source)
    if not target.is_posed:
        return OwnPoint(q, source.error)
    w = minus(q, target.shift)
    own = rotate_back(target, w)
    if source.error == 0.0 and target.error == 0.0:  # nothing is rounded on a lattice
        return OwnPoint(own, 0.0)
    off = source.error + target.error + 2.0**-50 * (largest_of(q) + largest_of(w))
    return OwnPoint(own, 2.0 * off + (8.0 * defect + 2.0**-48) * largest_of(w) + 2.0**-1060)


@merged
def _rotate_axis_last(p: Point3, axis: int) -> Point3:
    """Return a point with its coordinates rotated cyclically so that coordinate ``axis`` comes last."""
    return p if axis == 2 else (Point3(p.y, p.z, p.x) if axis == 0 else Point3(p.z, p.x, p.y))


@allocating
def locate_point(own: OwnPoint, mesh: MeshArrays) -> int:
    """Return the location of a point in a mesh by ray parity: INSIDE, OUTSIDE, 0 (on a face) or UNDECIDED. own: the
    point in the mesh's own coordinates."""
    where = locate_along(own, mesh, 2, -1)
    for axis in range(2 if where == UNDECIDED else 0):  # another ray may miss the edges
        where = locate_along(own, mesh, axis, -1) if where == UNDECIDED else where
    return where


@allocating
def locate_along(own: OwnPoint, mesh: MeshArrays, axis: int, left_out: int) -> int:
    """Return INSIDE, OUTSIDE, 0 (on a face) or UNDECIDED: the location of a point in a mesh, by the parity of the faces
    on the ray from it along ``axis``, upward. left_out: a face that is not counted, -1 for none."""
    q, error = own.point, own.error
    local, slack = in_tree(mesh, q), SLACK + error / mesh.scale
    if not (slack < 1.0 and np.isfinite(local.x + local.y + local.z)):  # case: the ends of the exponent range
        return UNDECIDED
    if largest_of(local) > 4.0 + slack:
        return OUTSIDE
    z = ABOVE_ALL if axis == 2 else local.z
    far = Point3(ABOVE_ALL if axis == 0 else local.x, ABOVE_ALL if axis == 1 else local.y, z)
    box, q, stack = box_between(local, far, slack), _rotate_axis_last(q, axis), np.empty(STACK, np.int32)
    stack[0] = 0
    n_above, unsure, on_face = 0, False, False
    face, n = next_face(mesh, stack, 1, box)
    while face >= 0:  # bound: the faces of the body
        t = triangle_of(mesh, face)
        how = ray_crosses(
            Facet(_rotate_axis_last(t.p, axis), _rotate_axis_last(t.q, axis), _rotate_axis_last(t.r, axis)), q, error
        )
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
    locations: Int8Array, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill locations (n,) int8 with INSIDE, OUTSIDE, 0 (on a face) or UNDECIDED for n vertices, given by index, of mesh
    `source` in `mesh`, each under the only pose of its pose arrays. Stops early when the flag is set."""
    a, b = place_pair(source.extent, source_pose, 0, mesh.extent, pose, 0)
    defect = defect_of(b)
    for item in range(vertices.shape[0]):
        if flag[0] != 0:
            return
        own = to_local_frame(as_point3(source.vertices, vertices[item]), a, b, defect)
        locations[item] = locate_point(own, mesh)


SLACK = 2.0**-20
"""Enlargement of a box in tree coordinates that covers its rounding to float32."""
ABOVE_ALL = 1e6
"""A number above all tree coordinates, whose magnitude is at most 2."""


@inline
def box_between(a: Point3, b: Point3, slack: float) -> tuple[Any, Any]:
    """Return the low and the high corner, as triples of float32, of the box from a to b in tree coordinates, enlarged
    by slack and cut off at ABOVE_ALL."""
    x, y, z = max(a.x - slack, -ABOVE_ALL), max(a.y - slack, -ABOVE_ALL), max(a.z - slack, -ABOVE_ALL)
    p, q, r = min(b.x + slack, ABOVE_ALL), min(b.y + slack, ABOVE_ALL), min(b.z + slack, ABOVE_ALL)
    return (np.float32(x), np.float32(y), np.float32(z)), (np.float32(p), np.float32(q), np.float32(r))


@inline
def next_face(mesh: MeshArrays, stack: Int32Array, n: int, box: tuple[Any, Any]) -> tuple[int, int]:
    """Return the next face of a mesh whose box intersects ``box`` (in tree coordinates), -1 if there is none left, and
    the new height of the stack of n entries. stack (STACK,) int32: nodes, and faces coded as in `MeshArrays.child`; on
    entry the root, 0."""
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


@inline
def side_of_corner(mesh: MeshArrays, face: int, t: Facet, other: int, k: int, p: Point3) -> int:
    """Return the side of the plane of face ``face``, with corners t, on which p lies, corner k of face ``other`` of the
    same mesh: the sign of orient3d; 0 without arithmetic if that corner is a vertex of ``face``."""
    return 0 if is_corner(mesh, face, other, k) else orient3d(t.p, t.q, t.r, p)


@inline
def update_state(mesh: MeshArrays, face: int, other: int, poses: FloatArray) -> int:
    """Return the state that ``face``, which has an area, would have if ``other`` were the only other face of the body:
    STATE_CLEAN, STATE_CROSSED or STATE_STACKED (also if a sign is undecided). poses: any (n, 12) array, not read."""
    if mesh.axis[other] == -1:
        return STATE_CLEAN
    if mesh.axis[other] < 0:
        return STATE_STACKED
    t, o = triangle_of(mesh, face), triangle_of(mesh, other)
    axis = int(mesh.axis[face])
    p, q = side_of_corner(mesh, face, t, other, 0, o.p), side_of_corner(mesh, face, t, other, 1, o.q)
    r = side_of_corner(mesh, face, t, other, 2, o.r)
    if p == UNDECIDED or q == UNDECIDED or r == UNDECIDED:
        return STATE_STACKED
    if p == 0 and q == 0 and r == 0:
        how = separation(poses, with_pose(t), with_pose(o), axis, 0.0)
        return STATE_STACKED if (how < 0 or how == UNDECIDED) else STATE_CLEAN
    if is_straddling(p, q, r):
        how = classify_near(t, o, 0.0)
        if how == UNDECIDED:
            how = classify(poses, with_pose(t), with_pose(o), axis, 0.0)
        return STATE_STACKED if how == UNDECIDED else (STATE_CROSSED if how == CROSSING else STATE_CLEAN)
    sides = (p, q, r)
    for k in range(3):
        end = (k + 1) % 3
        if sides[k] == 0 and sides[end] == 0:
            is_own_edge = is_corner(mesh, face, other, k) and is_corner(mesh, face, other, end)
            if is_own_edge:
                return STATE_CLEAN
            u, v = with_pose(t), with_pose(o)
            how = passes_within(poses, corner(v, k), corner(v, end), u, u.p, axis, 0.0)
            return STATE_CLEAN if how == 0 else STATE_CROSSED
    return STATE_CLEAN


@inline
def is_corner(mesh: MeshArrays, face: int, other: int, k: int) -> bool:
    """Return whether vertex k of face ``other`` is also a vertex of ``face``."""
    vertex, corners = mesh.triangles[other, k], mesh.triangles
    return bool(vertex == corners[face, 0] or vertex == corners[face, 1] or vertex == corners[face, 2])


@inline
def state_of(mesh: MeshArrays, face: int, poses: FloatArray) -> int:
    """Return the state (STATE_...) of a face, computed at first use; STATE_STACKED without area. poses: any (n, 12)
    array, not read."""
    if mesh.state[face] == STATE_UNKNOWN:
        mesh.state[face] = state_among(mesh, face, poses) if mesh.axis[face] >= 0 else STATE_STACKED
    return int(mesh.state[face])


@allocating
def state_among(mesh: MeshArrays, face: int, poses: FloatArray) -> int:
    """Compute the state of a face with area: the worst that any other face of the body whose box intersects its box
    gives it."""
    t = triangle_of(mesh, face)
    p, q, r = in_tree(mesh, t.p), in_tree(mesh, t.q), in_tree(mesh, t.r)
    low = Point3(min(p.x, q.x, r.x), min(p.y, q.y, r.y), min(p.z, q.z, r.z))
    high = Point3(max(p.x, q.x, r.x), max(p.y, q.y, r.y), max(p.z, q.z, r.z))
    box, stack, state = box_between(low, high, SLACK), np.empty(STACK, np.int32), STATE_CLEAN
    stack[0] = 0
    other, n = next_face(mesh, stack, 1, box)
    while other >= 0 and state != STATE_STACKED:  # bound: the faces of the body
        if other != face:
            state = max(state, update_state(mesh, face, other, poses))
        other, n = next_face(mesh, stack, n, box)
    return state


@inline
def proves_overlap(first: MeshArrays, i: int, second: MeshArrays, j: int, poses: FloatArray) -> bool:
    """Return whether the strict crossing of face i of the first and face j of the second mesh proves that the open
    interiors intersect: neither is STATE_STACKED (partly covered by another face of its body), and one is STATE_CLEAN
    (other faces of its body meet it in common vertices and edges at most). poses: any (n, 12) array, not read."""
    a = state_of(first, i, poses)
    if a == STATE_STACKED:
        return False
    b = state_of(second, j, poses)
    return b != STATE_STACKED and (a == STATE_CLEAN or b == STATE_CLEAN)


def states_of(mesh: MeshArrays, faces: IntArray) -> Int8Array:
    """Return the state (STATE_CLEAN, STATE_CROSSED, STATE_STACKED) of each of `faces` (n,)."""
    states = np.empty(len(faces), np.int8)
    entry_of(_fill_states)(mesh, faces, states)
    return states


def state_at(mesh: MeshArrays, face: int) -> int:
    """Return the state (STATE_CLEAN, STATE_CROSSED, STATE_STACKED) of one face, computed at first use."""
    state = mesh.state[face]
    return int(states_of(mesh, np.array([face]))[0] if state == STATE_UNKNOWN else state)


@allocating_kernel
def _fill_states(mesh: MeshArrays, faces: IntArray, states: Int8Array) -> None:
    """Fill states (n,) with the state of each of `faces` (n,)."""
    poses = np.zeros((1, 12))
    for item in range(faces.shape[0]):
        states[item] = state_of(mesh, faces[item], poses)


SIDE_UNKNOWN: Final = 2
"""In place of a side: the face is not clean, or other faces come near each sampled point of it."""


@called
def point_within(mesh: MeshArrays, face: int, item: int) -> OwnPoint:
    """Return a point inside a face, rounded, with the bound on its error. item: 0, 1 or 2, for corner weights (1, 1,
    1), (1, 1, 2) or (2, 1, 1)."""
    t = triangle_of(mesh, face)
    u, v = 2.0 if item == 2 else 1.0, 2.0 if item == 1 else 1.0
    w = 3.0 if item == 0 else 4.0
    x, y = u * t.p.x + t.q.x + v * t.r.x, u * t.p.y + t.q.y + v * t.r.y
    z = u * t.p.z + t.q.z + v * t.r.z
    error = 2.0**-50 * max(largest_of(t.p), largest_of(t.q), largest_of(t.r)) + 2.0**-1060
    return OwnPoint(Point3(x / w, y / w, z / w), error)


@allocating
def inner_side(mesh: MeshArrays, face: int, poses: FloatArray) -> int:
    """Return the side of a face on which its body lies: 1 that of its normal, -1 the other, SIDE_UNKNOWN for a face
    that is not clean or where no sample point decides. Cached. poses: any (n, 12) array, not read."""
    if mesh.inner[face] == 0:
        mesh.inner[face] = _side_of_clean(mesh, face) if state_of(mesh, face, poses) == STATE_CLEAN else SIDE_UNKNOWN
    return int(mesh.inner[face])


@allocating
def _side_of_clean(mesh: MeshArrays, face: int) -> int:
    """Compute `inner_side` of a face of STATE_CLEAN (not crossed or covered by others): 1, -1 or SIDE_UNKNOWN, by ray
    parity from points inside it."""
    axis, t = int(mesh.axis[face]), triangle_of(mesh, face)
    turn = orient2d(projected(t.p, axis), projected(t.q, axis), projected(t.r, axis))
    for item in range(3):
        where = locate_along(point_within(mesh, face, item), mesh, axis, face)
        if where in (INSIDE, OUTSIDE):
            return turn * where
    return SIDE_UNKNOWN
