"""A half-space and a body given by vertices (mesh, box, polygon, triangle): the signs of the vertices decide.

A linear function is largest and smallest over a body at vertices. What of the body lies beyond the half-space is told
by its faces with vertices there; the half-space always sticks out of the body.
"""

from __future__ import annotations

import itertools

import numpy as np

from engine.arrays import IntArray
from engine.collision.exact_images import HalfSpaceImage, image_half_space, value_at
from engine.collision.result import Collision, Parts, Witness, Work
from engine.collision.simple.boundary import Boundary, boundary_of, signs_of
from engine.solids.base import Solid
from engine.solids.bounds import own_box
from engine.solids.half_space import HalfSpace
from engine.solids.pose import Pose
from engine.types import Relation


def collide_half_space_body(
    half_space: HalfSpace, body: Solid, half_space_pose: Pose | None, body_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of a half-space (first) and a body with vertices (second), exact."""
    plane = image_half_space(half_space.normal, half_space.offset, half_space_pose)
    low, high, _ = own_box(body)
    corners = np.array(list(itertools.product(*zip(low.tolist(), high.tolist()))))
    signs = signs_of(plane, corners, body_pose, work)  # of a linear function: one side with these is one with the body
    if not ((signs < 0).all() or (signs > 0).all()):
        boundary = boundary_of(body, body_pose, work)
        signs = boundary.signs(plane)
    if (signs < 0).all():
        return Collision(Relation.DISJOINT)
    if (signs > 0).all():
        return Collision(Relation.SECOND_INSIDE_FIRST, Witness("containment", containing="first"))
    enters = bool((signs > 0).any())
    face = boundary.number_at(int(np.argmax(signs > 0 if enters else signs == 0)))
    faces = np.flatnonzero((signs[boundary.ends] > 0).any(axis=1))
    if enters and boundary.has_inside and _reaches(boundary, faces, plane, 1):
        return Collision(Relation.OVERLAPPING, Witness("surface", second_face=face))
    return Collision(Relation.TOUCHING, Witness("surface", second_face=face, piercing=enters))


def _reaches(boundary: Boundary, faces: IntArray, plane: HalfSpaceImage, side: int) -> bool:
    """Tell whether something live of these faces lies on one side, 1 or -1, of a plane."""
    return boundary.has_live(faces, lambda piece: any(side * value_at(plane, p) > 0 for p in piece.vertices()))


def half_space_body_parts(
    half_space: HalfSpace, body: Solid, half_space_pose: Pose | None, body_pose: Pose | None, work: Work
) -> Parts:
    """Return what of a half-space and a body with vertices (second) that overlap lies outside the other."""
    boundary = boundary_of(body, body_pose, work)
    plane = image_half_space(half_space.normal, half_space.offset, half_space_pose)
    signs = boundary.signs(plane)[boundary.ends]
    lowest = signs.min(axis=1)
    sticks_out = _reaches(boundary, np.flatnonzero(lowest < 0), plane, -1)
    return Parts(True, sticks_out, bool(((lowest <= 0) & (signs.max(axis=1) >= 0)).any()))
