"""Planes through faces that separate two bodies, or two nodes of their trees, by exact signs; compiled.

Bounding boxes separate two surfaces only down to what float32 resolves, and never where all faces meet in one point: a
plate 1e-9 above another, two cones whose apexes nearly touch. There the descent would try nearly all pairs of faces,
though the plane of one face separates many at once.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from engine.bounding.bvh import STACK
from engine.collision.meshes.mesh_arrays import MeshArrays
from engine.collision.meshes.placement import Placement, placed
from engine.collision.meshes.triangle_triangle import Facet, sign_of_four
from engine.compiling.jit import called, inline
from engine.lanes.boxes import EMPTY
from engine.lanes.tracing import LANES
from engine.predicates.posed import UNPOSED, PosedPoint3
from engine.predicates.vectors import as_point3
from engine.types import UNDECIDED, FloatArray, Int32Array

_SAMPLED = 16
_N_PLANES = 4
"""Number of faces of a node whose planes are tried."""
_BOTH_SIDES = 5
"""Bits of sides of points at a plane: 1 below, 2 in the plane, 4 above."""


class Vertices(NamedTuple):
    """Vertices of a body as input of exact signs: points (n, 3) before the pose, its placement, and its pose number
    (UNPOSED where placing rounds nothing)."""

    points: Any
    place: Placement
    pose: int


@inline
def vertex_at(v: Vertices, vertex: int) -> PosedPoint3:
    """Return a vertex as input of exact signs: placed if that is exact, else before its pose, with the pose number."""
    p = as_point3(v.points, vertex)
    if v.pose == UNPOSED:
        p = placed(p, v.place)
    return PosedPoint3(p.x, p.y, p.z, v.pose)


@called
def side_of_all(poses: FloatArray, plane: Facet, v: Vertices, error: float, n_samples: int) -> int:
    """Return on which side of the plane through the corners of `plane` a body lies, by about n_samples of its vertices,
    evenly spread (at least that many): 1 or -1 (closed sides), 0 if all lie in the plane, UNDECIDED if they are on both
    sides or a sign is undecided."""
    common_side, n = 0, v.points.shape[0]
    for vertex in range(0, n, max(1, n // n_samples)):
        side = sign_of_four(poses, plane.p, plane.q, plane.r, vertex_at(v, vertex), error)
        if side == UNDECIDED or side * common_side < 0:
            return UNDECIDED
        common_side = side if common_side == 0 else common_side
    return common_side


@called
def separates(poses: FloatArray, plane: Facet, u: Vertices, v: Vertices, error: float) -> bool:
    """Return whether the plane through the corners of `plane` is proven to separate two bodies, by all vertices; both
    may touch it, but not both lie in it."""
    n = max(len(u.points), len(v.points))
    for n_samples in (min(n, _SAMPLED), n):  # most planes cut the bodies in the middle
        side = side_of_all(poses, plane, u, error, n_samples)
        if side == UNDECIDED:
            return False
        their_side = side_of_all(poses, plane, v, error, n_samples)
        if their_side == UNDECIDED or side * their_side > 0:
            return False
        if n_samples == n:
            break
    return side != their_side


@called
def blocks_part(
    poses: FloatArray, first: MeshArrays, u: Vertices, i: int, second: MeshArrays, v: Vertices, j: int, error: float
) -> bool:
    """Return whether the plane of a face of leaf block i of the first tree or j of the second separates the bodies, and
    the other body does not touch it, so that they have no common point."""
    for item in range(2 * LANES):
        mesh, own, other, node = (first, u, v, i) if item < LANES else (second, v, u, j)
        entry = int(mesh.child[node, item % LANES])
        if entry != EMPTY and separates(poses, facet_of(mesh, own, -1 - entry), other, own, error):
            return _touches_nowhere(poses, facet_of(mesh, own, -1 - entry), other, error)
    return False


@inline
def _touches_nowhere(poses: FloatArray, plane: Facet, v: Vertices, error: float) -> bool:
    """Return whether no vertex of a body lies in the plane through the corners of `plane`."""
    for vertex in range(v.points.shape[0]):
        if sign_of_four(poses, plane.p, plane.q, plane.r, vertex_at(v, vertex), error) == 0:
            return False
    return True


@inline
def facet_of(mesh: MeshArrays, v: Vertices, face: int) -> Facet:
    """Return a face as input of exact signs; v: the vertices of its body."""
    t = mesh.triangles
    return Facet(vertex_at(v, t[face, 0]), vertex_at(v, t[face, 1]), vertex_at(v, t[face, 2]))


@inline
def _sides_of_face(poses: FloatArray, plane: Facet, mesh: MeshArrays, v: Vertices, face: int, error: float) -> int:
    """Return bits of the sides of the corners of a face at the plane through the corners of `plane`; all of them if a
    sign is undecided."""
    t, bits = facet_of(mesh, v, face), 0
    for corner in (t.p, t.q, t.r):
        side = sign_of_four(poses, plane.p, plane.q, plane.r, corner, error)
        bits |= 7 if side == UNDECIDED else 1 << side + 1
    return bits


@inline
def _face_below(mesh: MeshArrays, node: int, sample: int) -> int:
    """Return one of _N_PLANES faces below a node of the tree, spread over it."""
    entry = node
    while entry >= 0:  # bound: the depth of the tree
        n = LANES
        while mesh.child[entry, n - 1] == EMPTY:
            n -= 1
        entry = int(mesh.child[entry, sample * n // _N_PLANES])
    return -1 - entry


@called
def _sides_of_node(
    poses: FloatArray, plane: Facet, mesh: MeshArrays, v: Vertices, node: int, stack: Int32Array, error: float
) -> int:
    """Return bits of the sides of all faces below a node at the plane through the corners of `plane`; stops at
    _BOTH_SIDES. stack (STACK, 2): scratch."""
    bits, n = 0, 1
    stack[0, 0] = node
    while n > 0 and bits & _BOTH_SIDES != _BOTH_SIDES:  # bound: each node enters once
        n -= 1
        node = int(stack[n, 0])
        for lane in range(LANES):
            entry = mesh.child[node, lane]
            if entry >= 0:
                stack[n, 0] = entry
                n += 1
            elif entry != EMPTY:
                bits |= _sides_of_face(poses, plane, mesh, v, -1 - entry, error)
    return bits


@called
def nodes_are_separated(
    poses: FloatArray, first: MeshArrays, u: Vertices, i: int, second: MeshArrays, v: Vertices, j: int,
    stack: Int32Array, error: float,
) -> bool:  # fmt: skip
    """Return whether the plane of a face below node i of the first tree or node j of the second is proven to separate
    the faces below both, so that they have no common point. u, v: vertices of the bodies. stack (n, 2): scratch; too
    short a one proves nothing."""
    if stack.shape[0] < STACK:
        return False
    for item in range(2 * _N_PLANES):
        sample = item >> 1
        is_own = item & 1 == 0
        face = _face_below(first, i, sample) if is_own else _face_below(second, j, sample)
        if (first.axis[face] if is_own else second.axis[face]) < 0:
            continue
        plane = facet_of(first, u, face) if is_own else facet_of(second, v, face)
        ours = theirs = 0
        for k in range(_N_PLANES):  # most planes cut the bodies in the middle
            ours |= _sides_of_face(poses, plane, first, u, _face_below(first, i, k), error)
            theirs |= _sides_of_face(poses, plane, second, v, _face_below(second, j, k), error)
        if ours & theirs != 0 or ours & _BOTH_SIDES == _BOTH_SIDES or theirs & _BOTH_SIDES == _BOTH_SIDES:
            continue
        ours = _sides_of_node(poses, plane, first, u, i, stack, error)
        if ours & _BOTH_SIDES == _BOTH_SIDES:
            continue
        theirs = _sides_of_node(poses, plane, second, v, j, stack, error)
        if ours & theirs == 0 and theirs & _BOTH_SIDES != _BOTH_SIDES:
            return True
    return False
