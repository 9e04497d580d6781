"""What of a body given by vertices lies beyond a half-space that it overlaps; the half-space always sticks out."""

from __future__ import annotations

import numpy as np

from engine.collision.exact_images import image_half_space
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.planar.outline import outline_of
from engine.collision.result import Parts, Work
from engine.collision.simple.half_space_vertices import live_edges_reach, live_faces_reach, signs_of, signs_of_outline
from engine.solids.base import Solid
from engine.solids.half_space import HalfSpace
from engine.solids.pose import Pose


def half_space_mesh_parts(
    half_space: HalfSpace, body: Solid, half_space_pose: Pose | None, body_pose: Pose | None, work: Work
) -> Parts:
    """Return it for a polyhedron or 3D box (second)."""
    mesh = mesh_body_of(body)
    plane = image_half_space(half_space.normal, half_space.offset, half_space_pose)
    signs = signs_of(plane, mesh.arrays.vertices, body_pose, work)[mesh.arrays.triangles]
    lowest = signs.min(axis=1)
    sticks_out = live_faces_reach(mesh, np.flatnonzero(lowest < 0), plane, -1, body_pose, work)
    return Parts(True, sticks_out, bool(((lowest <= 0) & (signs.max(axis=1) >= 0)).any()))


def half_space_outline_parts(
    half_space: HalfSpace, body: Solid, half_space_pose: Pose | None, body_pose: Pose | None, work: Work
) -> Parts:
    """Return it for a polygon, triangle or 2D box (second)."""
    outline = outline_of(body, body_pose, work.budget)
    plane = image_half_space(half_space.normal, half_space.offset, half_space_pose)
    signs = signs_of_outline(outline, plane)[outline.ends]
    sticks_out = bool((signs < 0).any()) and live_edges_reach(outline, plane, -1, work)
    return Parts(True, sticks_out, bool(((signs.min(axis=1) <= 0) & (signs.max(axis=1) >= 0)).any()))
