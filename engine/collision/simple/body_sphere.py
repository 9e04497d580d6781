"""A body with faces or edges (mesh, box, polygon, triangle) against a ball: squared distances to its boundary.

Three questions decide. Is everything strictly inside the ball (the farthest vertex)? Does the boundary meet the ball,
and does the part of it beside the open interior reach into the open ball (the nearest live face)? Where the boundary
keeps clear of the ball, is the centre inside? Boxes of faces give float64 bounds of the distances; only faces whose
bounds allow a contact are measured, in rationals, nearest first.
"""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.collision.exact_images import Vector, image_point, rounded
from engine.collision.result import Collision, Parts, Witness, Work
from engine.collision.simple.boundary import Boundary, boundary_of
from engine.containment.rational_locate import rational_location
from engine.predicates.exact_vectors import minus, squared_length
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.types import Location, Relation


@np.errstate(over="ignore", invalid="ignore")  # an infinite bound only sends a face to the exact test
def collide_body_sphere(
    body: Solid, sphere: Sphere, body_pose: Pose | None, sphere_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of a body with a boundary of faces or edges (first) and a ball or disc (second), exact."""
    center, limit = image_point(sphere.center, sphere_pose), Fraction(sphere.radius) ** 2
    boundary = boundary_of(body, body_pose, work)
    near = boundary.near(center, sphere.radius)
    candidates = near[_candidates(boundary.face_bounds(center, near)[0], limit)]
    touched, entered = -1, candidates[:0]
    for count, face in enumerate(candidates.tolist()):
        work.budget.check()
        distance = boundary.distance(face, center)
        if distance == limit and touched < 0:
            touched = face
        if distance < limit:
            entered = candidates[count:]
            break
    work.n_beyond_filter += len(candidates) > 0
    work.n_rational += len(candidates) > 0
    enters = len(entered) > 0
    if touched < 0 and not enters:
        if not boundary.is_inside(center):
            return Collision(Relation.DISJOINT)
        return Collision(Relation.SECOND_INSIDE_FIRST, Witness("containment", containing="first"))
    if enters and _all_vertices_within(boundary, center, limit, work):
        return Collision(Relation.FIRST_INSIDE_SECOND, Witness("containment", containing="second"))
    face = boundary.number(int(entered[0]) if enters else touched)
    if sphere.radius > 0.0 and boundary.has_inside:
        if enters:
            overlaps = _enters(boundary, entered, center, limit)
            overlaps = overlaps or _is_within_walls(body, body_pose, center, sphere.radius, work)
        else:
            overlaps = boundary.is_inside(center)
        if overlaps:
            return Collision(Relation.OVERLAPPING, Witness("surface", first_face=face))
    return Collision(Relation.TOUCHING, Witness("surface", first_face=face, piercing=enters))


def _candidates(nearest: FloatArray, limit: Fraction) -> IntArray:
    """Return the faces that may come as near as a squared distance, by lower bounds of theirs, nearest first."""
    found = np.flatnonzero(nearest <= rounded(limit) * (1.0 + 2.0**-50) + 2.0**-1000)
    return found[np.argsort(nearest[found], kind="stable")]


def _enters(boundary: Boundary, faces: IntArray, center: Vector, limit: Fraction) -> bool:
    """Tell whether something live of these faces comes nearer to the centre than a squared distance."""
    return len(faces) > 0 and boundary.has_live(faces, lambda piece: piece.squared_distance(center) < limit)


def _is_within_walls(body: Solid, pose: Pose | None, center: Vector, radius: float, work: Work) -> bool:
    """Tell whether a ball into which nothing live reaches, walls that cancel at most, is inside else.

    Off those walls the ball is all inside or all outside, so any point of it will do. The points tried lie on the curve
    (t, t^2, t^3) from the centre, which meets no plane more than three times: one of them is on no wall.
    """
    location = rational_location(center, body, pose, work.budget.check)
    if location != Location.BOUNDARY:
        return location == Location.INSIDE
    for k in itertools.count(2):  # bound: three turns a face
        q = tuple(c + Fraction(radius) / 2 / k**power for power, c in enumerate(center, 1))
        location = rational_location(q, body, pose, work.budget.check)
        if location != Location.BOUNDARY:
            return location == Location.INSIDE
    raise AssertionError("unreachable")


def _all_vertices_within(boundary: Boundary, center: Vector, limit: Fraction, work: Work) -> bool:
    """Tell whether every vertex lies strictly inside the ball; the farthest by float64 bounds are asked first."""
    n = int(boundary.ends.max()) + 1 if len(boundary.ends) else 0
    if any(squared_length(minus(boundary.exact(n * k // 4), center)) >= limit for k in range(4)):
        return False
    floats = boundary.floats(slice(None))
    lower, upper = boundary.bounds(center, floats, floats)
    unsure = np.flatnonzero(~(upper < rounded(limit) * (1.0 - 2.0**-50)))
    for vertex in unsure[np.argsort(-lower[unsure], kind="stable")].tolist():
        work.budget.check()
        if squared_length(minus(boundary.exact(vertex), center)) >= limit:
            return False
    return True


@np.errstate(over="ignore", invalid="ignore")
def body_sphere_parts(
    body: Solid, sphere: Sphere, body_pose: Pose | None, sphere_pose: Pose | None, work: Work
) -> Parts:
    """Return what of a body (first) and a ball or disc (second) that overlap lies outside the other.

    The ball sticks out of the body exactly if a live part of the body's boundary enters the open ball: else the ball is
    all inside. The body sticks out of the ball exactly if some point of its live boundary does, and then a vertex.
    """
    center, limit = image_point(sphere.center, sphere_pose), Fraction(sphere.radius) ** 2
    boundary = boundary_of(body, body_pose, work)
    nearest, farthest = boundary.face_bounds(center)
    candidates = _candidates(nearest, limit)
    ball_sticks_out = _enters(boundary, candidates, center, limit)
    beyond = np.flatnonzero(farthest >= rounded(limit) * (1.0 - 2.0**-50) - 2.0**-1000)
    beyond = beyond[np.argsort(-nearest[beyond], kind="stable")]
    body_sticks_out = boundary.has_live(beyond, lambda piece: piece.farthest(center) > limit)
    meet = ball_sticks_out and body_sticks_out
    if not meet:
        both = np.intersect1d(candidates, beyond).tolist()
        meet = any(_meets_sphere(boundary, face, center, limit) for face in both)
    return Parts(body_sticks_out, ball_sticks_out, meet)


def _meets_sphere(boundary: Boundary, face: int, center: Vector, limit: Fraction) -> bool:
    """Tell whether a face has a point at the given squared distance from a centre."""
    if boundary.distance(face, center) > limit:
        return False
    return any(squared_length(minus(p, center)) >= limit for p in boundary.corners(face))
