"""How a face lies among the other faces of its own body: clean, crossed or stacked (see `mesh_arrays.py`); and on which
side of a clean one the body lies. Neither depends on a pose; both are computed on demand and kept with the mesh.

A strict crossing of two faces proves that two interiors overlap if nothing else of the two bodies cancels or fans out
along it. Near a general point of the crossing line a body whose face is clean there is a half-space; the other body's
face, not stacked, changes its inside on both sides of the first plane: so one of its two changes lies in that
half-space. Hence the rule `proves_overlap`. The state is computed from exact signs of the coordinates as given.

Beside a clean face no other one covers it, so its body lies on one side of it, all along but for single points. The
faces above a point within it, along an axis that crosses it, tell which: an odd number, above.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.arrays import FloatArray, Int8Array, IntArray
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
from engine.collision.meshes.parity import INSIDE, OUTSIDE, SLACK, OwnPoint, box_between, locate_along, next_face
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
from engine.compiling.direct import entry_of
from engine.compiling.jit import allocating, allocating_kernel, called, inline
from engine.predicates.orientation import orient2d, orient3d
from engine.predicates.vectors import largest_of
from engine.types import UNDECIDED, Point3


@inline
def side_of_corner(mesh: MeshArrays, face: int, t: Facet, other: int, k: int, p: Point3) -> int:
    """Return the side of the plane of a face on which a corner of another one lies, 0 at once for one of its own."""
    return 0 if is_corner(mesh, face, other, k) else orient3d(t.p, t.q, t.r, p)


@inline
def state_by(mesh: MeshArrays, face: int, other: int, poses: FloatArray) -> int:
    """Return what one other face of the body makes of the state of `face` (which has an area)."""
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
    """Tell whether a corner of another face is one of this face too."""
    vertex, corners = mesh.triangles[other, k], mesh.triangles
    return bool(vertex == corners[face, 0] or vertex == corners[face, 1] or vertex == corners[face, 2])


@inline
def state_of(mesh: MeshArrays, face: int, poses: FloatArray) -> int:
    """Return the state of a face, kept once computed; stacked without area. poses: any (n, 12), nothing has a pose."""
    if mesh.state[face] == STATE_UNKNOWN:
        mesh.state[face] = state_among(mesh, face, poses) if mesh.axis[face] >= 0 else STATE_STACKED
    return int(mesh.state[face])


@allocating
def state_among(mesh: MeshArrays, face: int, poses: FloatArray) -> int:
    """Return what the other faces of the body make of the state of a face with area."""
    t = triangle_of(mesh, face)
    p, q, r = in_tree(mesh, t.p), in_tree(mesh, t.q), in_tree(mesh, t.r)
    low = Point3(min(p.x, q.x, r.x), min(p.y, q.y, r.y), min(p.z, q.z, r.z))
    high = Point3(max(p.x, q.x, r.x), max(p.y, q.y, r.y), max(p.z, q.z, r.z))
    box, stack, state = box_between(low, high, SLACK), np.empty(STACK, np.int32), STATE_CLEAN
    stack[0] = 0
    other, n = next_face(mesh, stack, 1, box)
    while other >= 0 and state != STATE_STACKED:  # bound: the faces of the body
        if other != face:
            state = max(state, state_by(mesh, face, other, poses))
        other, n = next_face(mesh, stack, n, box)
    return state


@inline
def proves_overlap(first: MeshArrays, i: int, second: MeshArrays, j: int, poses: FloatArray) -> bool:
    """Tell whether a strict crossing of these two faces proves that the open interiors of two solids meet."""
    a = state_of(first, i, poses)
    if a == STATE_STACKED:
        return False
    b = state_of(second, j, poses)
    return b != STATE_STACKED and (a == STATE_CLEAN or b == STATE_CLEAN)


def states_of(mesh: MeshArrays, faces: IntArray) -> Int8Array:
    """Return the state of each of `faces` (n,)."""
    states = np.empty(len(faces), np.int8)
    entry_of(_find_states)(mesh, faces, states)
    return states


def state_at(mesh: MeshArrays, face: int) -> int:
    """Return the state of one face, at once where it is known."""
    state = mesh.state[face]
    return int(states_of(mesh, np.array([face]))[0] if state == STATE_UNKNOWN else state)


@allocating_kernel
def _find_states(mesh: MeshArrays, faces: IntArray, states: Int8Array) -> None:
    """Fill states (n,) with the state of each of `faces` (n,)."""
    poses = np.zeros((1, 12))
    for item in range(faces.shape[0]):
        states[item] = state_of(mesh, faces[item], poses)


UNTOLD: Final = 2
"""In place of a side: the face is not clean, or another one comes near each of the points within."""


@called
def point_within(mesh: MeshArrays, face: int, item: int) -> OwnPoint:
    """Return one of three points within a face; its weights are (1, 1, 1), (1, 1, 2) or (2, 1, 1)."""
    t = triangle_of(mesh, face)
    u, v = 2.0 if item == 2 else 1.0, 2.0 if item == 1 else 1.0
    w = 3.0 if item == 0 else 4.0
    x, y = u * t.p.x + t.q.x + v * t.r.x, u * t.p.y + t.q.y + v * t.r.y
    z = u * t.p.z + t.q.z + v * t.r.z
    error = 2.0**-50 * max(largest_of(t.p), largest_of(t.q), largest_of(t.r)) + 2.0**-1060
    return OwnPoint(Point3(x / w, y / w, z / w), error)


@allocating
def inner_side(mesh: MeshArrays, face: int, poses: FloatArray) -> int:
    """Return the side of a face, 1 that of its normal or -1, on which its body lies; UNTOLD. poses: as `state_of`."""
    if mesh.inner[face] == 0:
        mesh.inner[face] = _side_of_clean(mesh, face) if state_of(mesh, face, poses) == STATE_CLEAN else UNTOLD
    return int(mesh.inner[face])


@allocating
def _side_of_clean(mesh: MeshArrays, face: int) -> int:
    axis, t = int(mesh.axis[face]), triangle_of(mesh, face)
    turn = orient2d(projected(t.p, axis), projected(t.q, axis), projected(t.r, axis))
    for item in range(3):
        where = locate_along(point_within(mesh, face, item), mesh, axis, face)
        if where in (INSIDE, OUTSIDE):
            return turn * where
    return UNTOLD
