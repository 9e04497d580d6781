"""A plane that separates two bodies in contact: their open interiors have no common point, so they touch.

Two convex bodies that touch are always separated by a plane through a face in contact, or through two edges that cross
(a face of their Minkowski difference holds the origin); a plane through two crossing edges is the one through the first
and an end of the second. Many bodies that are not convex lie that way too. Where no candidate separates, nothing is
said.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.collision.meshes.dual_traversal import store_pose
from engine.collision.meshes.mesh_arrays import MeshArrays, triangle_of
from engine.collision.meshes.placement import PoseArrays
from engine.collision.meshes.triangle_triangle import PosedTriangle, with_pose
from engine.jit import inline, kernel
from engine.predicates.posed import UNPOSED, PosedPoint3, orient3d_posed, posed_error
from engine.types import UNDECIDED

N_FACES = 32
N_EDGES = 8
"""So many contacts give the planes of their faces, so many those of their edges."""


@inline
def side_of_all(
    poses: Any, a: PosedPoint3, b: PosedPoint3, c: PosedPoint3, vertices: Any, pose: int, error: float
) -> int:
    """Return the closed side (1, -1) of the plane of a, b, c on which all vertices (n, 3) lie, 0 if all lie on it;
    UNDECIDED if they lie on both sides, or where a sign is open."""
    found = 0
    for vertex in range(vertices.shape[0]):
        p = PosedPoint3(vertices[vertex, 0], vertices[vertex, 1], vertices[vertex, 2], pose)
        side = orient3d_posed(poses, a, b, c, p, error)
        if side == UNDECIDED or side * found < 0:
            return UNDECIDED
        if found == 0:
            found = side
    return found


@inline
def separates(
    poses: Any,
    a: PosedPoint3,
    b: PosedPoint3,
    c: PosedPoint3,
    vertices: Any,
    pose: int,
    their_vertices: Any,
    their_pose: int,
    error: float,
) -> bool:
    """Tell whether the plane of a, b, c has the two bodies on different closed sides, not both of them in it."""
    side = side_of_all(poses, a, b, c, vertices, pose, error)
    if side == UNDECIDED:
        return False
    their_side = side_of_all(poses, a, b, c, their_vertices, their_pose, error)
    return their_side != UNDECIDED and side * their_side <= 0 and side != their_side


@inline
def corner(t: PosedTriangle, index: int) -> PosedPoint3:
    """Return a corner by its number modulo 3."""
    index = index % 3
    return t.p if index == 0 else (t.q if index == 1 else t.r)


@kernel
def is_separated(
    first: MeshArrays, first_pose: PoseArrays, second: MeshArrays, second_pose: PoseArrays, contacts: Any, flag: Any
) -> bool:
    """Tell whether a plane through faces or edges of contacts (n, 2) is known to separate the two bodies."""
    poses = np.zeros((2, 12))
    store_pose(poses, 0, first_pose, 0)
    store_pose(poses, 1, second_pose, 0)
    own = 0 if first_pose.is_posed else UNPOSED
    their = 1 if second_pose.is_posed else UNPOSED
    error = max(posed_error(poses, own, first.extent.reach), posed_error(poses, their, second.extent.reach))
    u, v = first.vertices, second.vertices
    for item in range(min(N_FACES, contacts.shape[0])):
        s = with_pose(triangle_of(first, contacts[item, 0]), own)
        if separates(poses, s.p, s.q, s.r, u, own, v, their, error):
            return True
        t = with_pose(triangle_of(second, contacts[item, 1]), their)
        if separates(poses, t.p, t.q, t.r, u, own, v, their, error):
            return True
        if flag[0] != 0:
            return False
    for item in range(min(N_EDGES, contacts.shape[0])):
        s = with_pose(triangle_of(first, contacts[item, 0]), own)
        t = with_pose(triangle_of(second, contacts[item, 1]), their)
        for edge in range(6):
            one, other = (s, t) if edge < 3 else (t, s)
            for end in range(3):
                a, b, c = corner(one, edge), corner(one, edge + 1), corner(other, end)
                if separates(poses, a, b, c, u, own, v, their, error):
                    return True
        if flag[0] != 0:
            return False
    return False
