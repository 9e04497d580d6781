"""What of a body given by vertices lies beyond a half-space that it overlaps; the half-space always sticks out."""

from __future__ import annotations

import numpy as np

from engine.collision.exact_images import dot, image_half_space
from engine.collision.meshes.live_faces import live_piece
from engine.collision.meshes.mesh_arrays import shell_of
from engine.collision.planar.outline import live_edges, outline_of
from engine.collision.result import Parts, Work
from engine.collision.simple.half_space_vertices import signs_of, value_at_image
from engine.predicates.rational import sign_of
from engine.solids.base import Solid
from engine.solids.half_space import HalfSpace
from engine.solids.pose import Pose


def half_space_mesh_parts(
    half_space: HalfSpace, body: Solid, half_space_pose: Pose | None, body_pose: Pose | None, work: Work
) -> Parts:
    """Return it for a polyhedron or 3D box (second)."""
    shell = shell_of(body)
    arrays = shell.arrays
    plane = image_half_space(half_space.normal, half_space.offset, half_space_pose)
    signs = signs_of(plane, arrays.vertices, body_pose, work)[arrays.triangles]
    lowest = signs.min(axis=1)
    sticks_out = False
    for face in np.flatnonzero(lowest < 0).tolist():
        work.budget.check()
        piece = live_piece(shell, face, work.budget)
        if piece is not None and any(value_at_image(plane, p, body_pose) < 0 for p in piece.vertices()):
            sticks_out = True
            break
    return Parts(True, sticks_out, bool(((lowest <= 0) & (signs.max(axis=1) >= 0)).any()))


def half_space_outline_parts(
    half_space: HalfSpace, body: Solid, half_space_pose: Pose | None, body_pose: Pose | None, work: Work
) -> Parts:
    """Return it for a polygon, triangle or 2D box (second)."""
    outline = outline_of(body, body_pose, work.budget)
    normal, offset = image_half_space(half_space.normal, half_space.offset, half_space_pose)
    signs = np.array([sign_of(dot(normal, point) + offset) for point in outline.points], np.int8)[outline.ends]
    sticks_out = bool((signs < 0).any()) and any(
        dot(normal, end) + offset < 0 for piece in live_edges(outline, work.budget) for end in piece
    )
    return Parts(True, sticks_out, bool(((signs.min(axis=1) <= 0) & (signs.max(axis=1) >= 0)).any()))
