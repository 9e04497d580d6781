"""A plane that separates two bodies in contact: their open interiors have no common point, so they touch.

Two convex bodies that touch are always separated by a plane through a face in contact, or through two edges that cross
(a face of their Minkowski difference holds the origin); a plane through two crossing edges is the one through the first
and an end of the second. Many bodies that are not convex lie that way too. Where no candidate separates, nothing is
said.
"""

from __future__ import annotations

from typing import Any

from engine.collision.meshes.mesh_arrays import MeshArrays, triangle_of
from engine.collision.meshes.triangle_triangle import corner, sign_of_four, with_pose
from engine.jit import called
from engine.predicates.posed import PosedPoint3
from engine.types import UNDECIDED

N_FACES = 32
N_EDGES = 8
"""So many contacts give the planes of their faces, so many those of their edges."""
_SAMPLED = 16


@called
def side_of_all(
    poses: Any, a: PosedPoint3, b: PosedPoint3, c: PosedPoint3, vertices: Any, pose: int, error: float, n_samples: int
) -> int:
    """Return the closed side (1, -1) of the plane of a, b, c on which about so many of vertices (n, 3) lie, 0 if they
    lie on it; UNDECIDED if they lie on both sides, or where a sign is open."""
    found = 0
    for vertex in range(0, vertices.shape[0], max(1, vertices.shape[0] // n_samples)):
        p = PosedPoint3(vertices[vertex, 0], vertices[vertex, 1], vertices[vertex, 2], pose)
        side = sign_of_four(poses, a, b, c, p, error)
        if side == UNDECIDED or side * found < 0:
            return UNDECIDED
        if found == 0:
            found = side
    return found


@called
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
    for n_samples in (_SAMPLED, max(len(vertices), len(their_vertices))):  # most planes cut the bodies in the middle
        side = side_of_all(poses, a, b, c, vertices, pose, error, n_samples)
        if side == UNDECIDED:
            return False
        their_side = side_of_all(poses, a, b, c, their_vertices, their_pose, error, n_samples)
        if their_side == UNDECIDED or side * their_side > 0:
            return False
    return side != their_side


@called
def are_separated(
    poses: Any, first: MeshArrays, own: int, second: MeshArrays, their: int, contacts: Any, error: float, flag: Any
) -> bool:
    """Tell whether a plane through faces or edges of contacts (n, 2) is known to separate the two bodies.

    own, their: the numbers of their poses, error: the larger `posed_error`.
    """
    u, v = first.vertices, second.vertices
    for item in range(min(N_FACES, contacts.shape[0])):
        s = with_pose(triangle_of(first, contacts[item, 0]), own)
        t = with_pose(triangle_of(second, contacts[item, 1]), their)
        if separates(poses, s.p, s.q, s.r, u, own, v, their, error):
            return True
        if separates(poses, t.p, t.q, t.r, u, own, v, their, error):
            return True
        if flag[0] != 0:
            return False
    for item in range(min(N_EDGES, contacts.shape[0])):  # order: a plane of a face is likelier, and tried with all
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
