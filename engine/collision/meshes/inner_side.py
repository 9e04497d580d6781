"""Compiled: on which side of a clean face its body lies, kept with the mesh.

Beside a clean face (`face_state.py`) no other one covers it, so its body lies on one side of it, all along but for
single points. The faces above a point within it, along an axis that crosses it, tell which: an odd number, above.
"""

from __future__ import annotations

from typing import Any, Final

from engine.collision.meshes.face_state import state_of
from engine.collision.meshes.mesh_arrays import STATE_CLEAN, MeshArrays, triangle_of
from engine.collision.meshes.parity import INSIDE, OUTSIDE, OwnPoint, locate_along
from engine.collision.meshes.triangle_triangle import projected
from engine.jit import allocating, called
from engine.predicates.orientation import orient2d
from engine.predicates.vectors import largest_of
from engine.types import Point3

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
def inner_side(mesh: MeshArrays, face: int, poses: Any) -> int:
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
