"""A body with faces or edges (mesh, box, polygon, triangle) against a ball, by distances, or a half-space, by signs.

**Ball.** Is everything strictly inside the ball (the farthest vertex)? Does the boundary meet the ball, and does the
part of it beside the open interior reach into the open ball (the nearest live face)? Where the boundary keeps clear of
the ball, is the centre inside? Boxes of faces give float64 bounds of the distances; only faces whose bounds allow a
contact are measured, in rationals, nearest first.

**Half-space.** A linear function is largest and smallest over a body at vertices. What of the body lies beyond the
half-space is told by its faces with vertices there; the half-space always sticks out of the body.
"""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, TOUCHING
from engine.collision.exact_images import HalfSpaceImage, Vector, image_half_space, image_point, rounded, value_at
from engine.collision.meshes.face_state import state_at
from engine.collision.meshes.live_faces import simplex_distance
from engine.collision.meshes.mesh_arrays import STATE_STACKED, mesh_body_of
from engine.collision.result import FIRST_WITHIN, NO_CONTACT, SECOND_WITHIN, Collision, Parts, Poses, Witness, Work
from engine.collision.simple.ball_on_mesh import relate_ball
from engine.collision.simple.boundary import Boundary, boundary_of, signs_of
from engine.containment.rational_locate import rational_location
from engine.direct import entry_of
from engine.predicates.exact_vectors import minus, squared_length
from engine.solids.base import Solid
from engine.solids.bounds import own_box
from engine.solids.half_space import HalfSpace
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.types import Location, Relation


def collide_body_sphere(body: Solid, ball: Sphere, poses: Poses, work: Work) -> Collision:
    """Return the relation of a body with a boundary of faces or edges (first) and a ball or disc (second), exact."""
    pose, ball_pose = poses
    if pose is None:
        center = [rounded(c) for c in image_point(ball.center, ball_pose)]
        if _is_ball_beside(body, center, ball.radius):
            return NO_CONTACT
        if body.dimension == 3:
            answer = _by_floats(body, center, ball_pose is not None, ball.radius, work)
            if answer is not None:
                return answer
    with np.errstate(over="ignore", invalid="ignore"):  # an infinite bound only sends a face to the exact test
        return _by_distances(body, ball, poses, work)


def _is_ball_beside(body: Solid, center: list[float], radius: float) -> bool:
    """Tell whether a ball surely keeps clear of the box around a body; three roundings of 2^-53 are below 2^-50."""
    reach = radius * (1.0 + 2.0**-50)
    low, high, _ = own_box(body)
    for c, a, b in zip(center, low.tolist(), high.tolist()):
        if max(a - c, c - b) - 2.0**-50 * (abs(c) + max(abs(a), abs(b))) > reach:
            return True
    return False


def _by_floats(body: Solid, center: list[float], is_rounded: bool, radius: float, work: Work) -> Collision | None:
    """Return the relation of a mesh and a ball about a point, rounded maybe, where floats prove it."""
    mesh = mesh_body_of(body)
    error = 2.0**-52 * max(map(abs, center)) + 2.0**-1074 if is_rounded else 0.0
    relation, triangle = entry_of(relate_ball)(mesh.arrays, *center, error, float(radius), work.budget.flag)
    work.budget.check()
    if relation == OVERLAPPING and state_at(mesh.arrays, triangle) == STATE_STACKED:
        return None
    if relation in (OVERLAPPING, TOUCHING):
        face = int(mesh.faces[triangle])
        return Collision(Relation(relation), Witness("surface", face, piercing=relation == TOUCHING))
    return _WITHIN.get(relation)


_WITHIN = {DISJOINT: NO_CONTACT, FIRST_INSIDE_SECOND: FIRST_WITHIN, SECOND_INSIDE_FIRST: SECOND_WITHIN}


def _by_distances(body: Solid, ball: Sphere, poses: Poses, work: Work) -> Collision:
    pose, ball_pose = poses
    center, limit = image_point(ball.center, ball_pose), Fraction(ball.radius) ** 2
    boundary = boundary_of(body, pose, work)
    near = boundary.near(center, ball.radius)
    candidates = near[_candidates(boundary.face_bounds(center, near)[0], limit)]
    touched, entered = -1, candidates[:0]
    for count, face in enumerate(candidates.tolist()):
        work.budget.check()
        distance = simplex_distance(center, boundary.corners(face))
        if distance < limit:
            entered = candidates[count:]
            break
        if distance == limit and touched < 0:
            touched = face
    work.n_beyond_filter += len(candidates) > 0
    work.n_rational += len(candidates) > 0
    enters = len(entered) > 0
    if touched < 0 and not enters:
        return NO_CONTACT if not boundary.is_inside(center) else SECOND_WITHIN
    if enters and _all_vertices_within(boundary, center, limit, work):
        return FIRST_WITHIN
    face = boundary.number(int(entered[0]) if enters else touched)
    if ball.radius > 0.0 and boundary.has_inside:
        if enters:
            overlaps = _enters(boundary, entered, center, limit)
            overlaps = overlaps or _is_within_walls(body, pose, center, ball.radius, work)
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
    some = boundary.floats(np.arange(4) * n // 4)
    if (boundary.bounds(center, some, some)[0] > rounded(limit) * (1.0 + 2.0**-50)).any():
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
def body_sphere_parts(body: Solid, ball: Sphere, poses: Poses, work: Work) -> Parts:
    """Return what of a body (first) and a ball or disc (second) that overlap lies outside the other.

    The ball sticks out of the body exactly if a live part of the body's boundary enters the open ball: else the ball is
    all inside. The body sticks out of the ball exactly if some point of its live boundary does, and then a vertex.
    """
    center, limit = image_point(ball.center, poses[1]), Fraction(ball.radius) ** 2
    boundary = boundary_of(body, poses[0], work)
    nearest, farthest = boundary.face_bounds(center)
    candidates = _candidates(nearest, limit)
    ball_sticks_out = _enters(boundary, candidates, center, limit)
    beyond = np.flatnonzero(farthest >= rounded(limit) * (1.0 - 2.0**-50) - 2.0**-1000)
    beyond = beyond[np.argsort(-nearest[beyond], kind="stable")]
    body_sticks_out = boundary.has_live(beyond, lambda piece: piece.farthest(center) > limit)
    meet = ball_sticks_out and body_sticks_out
    if not meet:
        meet = any(  # of a face, some part is as near as the sphere, and some corner as far
            simplex_distance(center, corners) <= limit <= max(squared_length(minus(p, center)) for p in corners)
            for corners in map(boundary.corners, np.intersect1d(candidates, beyond).tolist())
        )
    return Parts(body_sticks_out, ball_sticks_out, meet)


def collide_half_space_body(space: HalfSpace, body: Solid, poses: Poses, work: Work) -> Collision:
    """Return the relation of a half-space (first) and a body with vertices (second), exact."""
    if poses[0] is None and poses[1] is None and (side := _side_of_box(space, body)) != 0:
        return SECOND_WITHIN if side > 0 else NO_CONTACT
    plane = image_half_space(space, poses[0])
    low, high, _ = own_box(body)
    corners = np.array(list(itertools.product(*zip(low.tolist(), high.tolist()))))
    signs = signs_of(plane, corners, poses[1], work)  # of a linear function: one side with these is one with the body
    if not ((signs < 0).all() or (signs > 0).all()):
        boundary = boundary_of(body, poses[1], work)
        signs = boundary.signs(plane)
    if (signs < 0).all():
        return NO_CONTACT
    if (signs > 0).all():
        return SECOND_WITHIN
    enters = bool((signs > 0).any())
    face = boundary.number_at(int(np.argmax(signs > 0 if enters else signs == 0)))
    if enters and boundary.has_inside and _reaches(boundary, boundary.faces_at(signs > 0), plane, 1):
        return Collision(Relation.OVERLAPPING, Witness("surface", second_face=face))
    return Collision(Relation.TOUCHING, Witness("surface", second_face=face, piercing=enters))


def _side_of_box(half_space: HalfSpace, body: Solid) -> int:
    """Return the side of a plane, 1 or -1, on which the box around a body surely lies, 0 where it may meet it.

    The largest and the smallest of n . p + d over a box are sums of products of its bounds: seven roundings of at most
    2^-53 of the sum of magnitudes, far below 2^-48 of it; what underflows is below 2^-1000.
    """
    low, high, _ = own_box(body)
    least = most = half_space.offset
    size = abs(half_space.offset)
    for n, a, b in zip(half_space.normal.tolist(), low.tolist(), high.tolist()):
        least += min(n * a, n * b)
        most += max(n * a, n * b)
        size += abs(n) * max(abs(a), abs(b))
    slack = 2.0**-48 * size + 2.0**-1000
    return int(least > slack) - int(most < -slack)


def _reaches(boundary: Boundary, faces: IntArray, plane: HalfSpaceImage, side: int) -> bool:
    """Tell whether something live of these faces lies on one side, 1 or -1, of a plane."""
    return boundary.has_live(faces, lambda piece: any(side * value_at(plane, p) > 0 for p in piece.vertices()))


def half_space_body_parts(space: HalfSpace, body: Solid, poses: Poses, work: Work) -> Parts:
    """Return what of a half-space and a body with vertices (second) that overlap lies outside the other."""
    boundary, plane = boundary_of(body, poses[1], work), image_half_space(space, poses[0])
    signs = boundary.signs(plane)
    sticks_out = _reaches(boundary, boundary.faces_at(signs < 0), plane, -1)
    meet = np.intersect1d(boundary.faces_at(signs <= 0), boundary.faces_at(signs >= 0), assume_unique=True)
    return Parts(True, sticks_out, len(meet) > 0)
