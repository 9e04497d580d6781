"""A body with faces or edges (mesh, box, polygon, triangle) against a ball, by distances.

Three tests: is everything strictly inside the ball (farthest vertex)? Does the boundary meet the ball, and does a live
part of it reach into the open ball (nearest live face)? Is the centre inside?

**Floats** prove most of it for an unposed mesh. The tree selects the faces near the ball; nearly nearest points and the
slab between a face and the centre (`near_triangles.py`) prove that it enters the open ball, or misses the closed one;
the witness is the entering face with the nearest box. A ray locates a centre that no face is near; a face that no other
one covers has the open interior next to it. Else boxes of faces bound the distances; faces whose bounds allow a contact
are measured, in rationals, nearest first.
"""

from __future__ import annotations

import itertools
from fractions import Fraction
from functools import lru_cache

import numpy as np

from engine.bounding.bvh import STACK
from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, TOUCHING, UNSETTLED
from engine.collision.exact_images import Vector, image_point, rounded
from engine.collision.meshes import parity
from engine.collision.meshes.mesh_arrays import STATE_STACKED, MeshArrays, in_tree, mesh_body_of, triangle_of
from engine.collision.meshes.near_triangles import nearest_points, relative_to, rounding_bound
from engine.collision.meshes.triangle_triangle import Facet
from engine.collision.result import FIRST_WITHIN, NO_CONTACT, SECOND_WITHIN, Collision, Parts, Poses, Witness, Work
from engine.collision.simple.boundary import Boundary, boundary_of, simplex_distance
from engine.compiling.jit import allocating, entry_of, inline, kernel
from engine.containment.methods.rational_locate import rational_location
from engine.predicates.rational import minus as difference
from engine.predicates.rational import squared_length
from engine.predicates.vectors import as_point3, dot, largest_of, minus
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.solids.primitives import Sphere
from engine.solids.registry import own_box
from engine.types import FlagArray, FloatArray, IntArray, Location, Point3, Relation

_MANY = 4096
_SPREAD = 64


@inline
def _box_distance(t: Facet, center: Point3, slack: float) -> float:
    """Return a lower bound on the squared distance of the box around triangle t from the centre of a ball. slack: bound
    on the error of a coordinate. Widened as in `box_distance_bounds`; 0.0 on overflow."""
    square = 0.0
    for c, p, q, r in (
        (center.x, t.p.x, t.q.x, t.r.x), (center.y, t.p.y, t.q.y, t.r.y), (center.z, t.p.z, t.q.z, t.r.z),
    ):  # fmt: skip
        gap = max(max((min(p, q, r) - slack) - c, c - (max(p, q, r) + slack)), 0.0)
        square += gap * gap
    square = square * (1.0 - 2.0**-48) - 2.0**-1000
    return square if np.isfinite(square) else 0.0


@inline
def _enters_ball(t: Facet, own: parity.OwnPoint, radius: float) -> int:
    """Return 1 if triangle t provably has a point in the open ball, 0 if it provably misses the closed ball, else
    UNSETTLED. own: the ball's centre in the triangle's coordinates. error: corners relative to the centre are off by
    its error and a rounding, distances by less than twice that."""
    t, none = relative_to(own.point, t), Point3(0.0, 0.0, 0.0)
    center = Facet(none, none, none)
    slack = 4.0 * rounding_bound(t, center) + 2.0 * own.error + 2.0**-50 * radius
    inner = radius - slack
    if inner > 2.0**-500 and min(dot(t.p, t.p), dot(t.q, t.q), dot(t.r, t.r)) < inner * inner * (1.0 - 2.0**-49):
        return 1
    _, across = nearest_points(center, t, radius + 2.0 * slack)  # order: edges are measured from the ends of the first
    return 1 if across.size < inner else (0 if across.low > radius + slack else UNSETTLED)


@allocating
def _surface_against_ball(
    own: parity.OwnPoint, radius: float, mesh: MeshArrays, is_named: bool, flag: FlagArray
) -> tuple[int, int]:
    """Return (relation, witness) of a mesh's faces to a ball. DISJOINT, TOUCHING (a face enters the open ball) or
    UNSETTLED; the witness is a triangle that enters, -1 for none; if is_named, of these the one with the nearest box,
    the lowest of equal ones. own: the ball's centre in the mesh's coordinates, with its error."""
    center, error = own
    sizes = largest_of(Point3(mesh.origin[0], mesh.origin[1], mesh.origin[2])) + largest_of(center) + radius
    local, slack = in_tree(mesh, center), parity.SLACK + (error + 2.0**-48 * sizes) / mesh.scale
    if not (slack < 1.0 and np.isfinite(local.x + local.y + local.z)):  # case: the ends of the exponent range
        return UNSETTLED, -1
    box, stack = parity.box_between(local, local, radius / mesh.scale + slack), np.empty(STACK, np.int32)
    stack[0] = 0
    best, witness, unsure, box_slack = np.inf, -1, np.inf, 2.0**-50 * largest_of(center) + 2.0**-1070
    reach = (radius + 2.0 * error) * (1.0 + 2.0**-40)
    beyond = reach * reach + 2.0**-990  # farther from the rounded centre is outside the ball
    face, n = parity.next_face(mesh, stack, 1, box)
    while face >= 0:  # bound: the faces of the body
        t = triangle_of(mesh, face)
        square = _box_distance(t, center, box_slack)
        if square <= beyond and (square < best or (square == best and face < witness)):
            how = _enters_ball(t, own, radius)
            if how == 1:
                best, witness = square, face
                if not is_named:
                    return TOUCHING, witness
                within = np.sqrt(square * (1.0 + 2.0**-40) + 2.0**-990)  # of any box that bounds as near
                box = parity.box_between(local, local, within / mesh.scale + slack)
            elif how == UNSETTLED:
                unsure = min(unsure, square)
        if flag[0] != 0:
            return UNSETTLED, -1
        face, n = parity.next_face(mesh, stack, n, box)
    if unsure <= best and unsure < np.inf:
        return UNSETTLED, -1
    return (DISJOINT if witness < 0 else TOUCHING), witness


@inline
def _ball_contains_vertex(vertex: int, own: parity.OwnPoint, radius: float, mesh: MeshArrays) -> int:
    """Return 1 if vertex number ``vertex`` of a mesh provably lies in the open ball, 0 if provably not, else UNSETTLED.
    own: the ball's centre in the mesh's coordinates, with its error."""
    v = minus(as_point3(mesh.vertices, vertex), own.point)
    size = np.sqrt(dot(v, v))
    slack = 2.0**-49 * (size + radius) + 2.0 * own.error + 2.0**-500
    return 1 if size < radius - slack else (0 if size > radius + slack else UNSETTLED)


@inline
def _ball_contains_mesh(own: parity.OwnPoint, radius: float, mesh: MeshArrays, flag: FlagArray) -> int:
    """Return 1 if all vertices of a mesh provably lie in the open ball, 0 if one provably does not, else UNSETTLED.
    own: the ball's centre. A sample spread over the mesh is tested first, since neighbours give the same result."""
    n, result = mesh.vertices.shape[0], 1
    for step in (n // _SPREAD + 1, 1):
        for vertex in range(0, n, step):
            location = _ball_contains_vertex(vertex, own, radius, mesh)
            if location == 0:
                return 0
            if location == UNSETTLED or (vertex % _MANY == 0 and flag[0] != 0):
                result = UNSETTLED
    return result


@inline
def _relate(own: parity.OwnPoint, radius: float, mesh: MeshArrays, is_named: bool, flag: FlagArray) -> tuple[int, int]:
    """Return the relation code of a mesh (first) and a ball, or UNSETTLED, and a triangle that enters the ball, -1 for
    none. own: the ball's centre in the mesh's coordinates, with its error; is_named: the triangle must be the one that
    the answer names."""
    relation, triangle = _surface_against_ball(own, radius, mesh, is_named, flag)
    if relation == DISJOINT:
        where = parity.locate_point(own, mesh) if mesh.has_inside else parity.OUTSIDE
        return (
            SECOND_INSIDE_FIRST if where == parity.INSIDE else (DISJOINT if where == parity.OUTSIDE else UNSETTLED)
        ), -1
    if relation == TOUCHING:
        is_within = _ball_contains_mesh(own, radius, mesh, flag)
        if is_within != 0:
            return (FIRST_INSIDE_SECOND if is_within == 1 else UNSETTLED), -1
        return (OVERLAPPING if mesh.has_inside else TOUCHING), triangle
    return UNSETTLED, -1


@kernel
def relate_balls(
    mesh: MeshArrays, centers: FloatArray, radius: float, is_named: bool, results: IntArray, flag: FlagArray
) -> None:
    """Fill results (n, 2) int64 with the relation of a mesh (first) and a ball about each centre, or UNSETTLED, and a
    witness. centers (n, 4): a point and the error of its coordinates. The witness is a triangle that enters the ball:
    proof of overlapping, unless even-odd cancels it, or of touching; if `is_named`, the one that the answer names.
    """
    for row in range(centers.shape[0]):
        if flag[0] != 0:
            results[row, 0] = UNSETTLED
        else:
            own = parity.OwnPoint(as_point3(centers, row), float(centers[row, 3]))
            results[row, 0], results[row, 1] = _relate(own, radius, mesh, is_named, flag)


Moves = tuple[FloatArray, FloatArray] | None
"""Rotations (n, d, d) and translations (n, d) of a body, None for no pose."""


def collide_body_sphere(body: Solid, ball: Sphere, poses: Poses, work: Work) -> Collision:
    """Return the exact relation of a body with faces or edges (first) and a ball or disc (second): by floats if these
    prove it, else by rational distances."""
    if poses[0] is None or body.dimension == 3:
        is_posed = poses[0] is not None or poses[1] is not None
        row = centers_in_frame(ball, *map(_as_arrays, poses))[0].tolist() if is_posed else [*ball.center.tolist(), 0.0]
        if _is_ball_clear_of_box(body, row, ball.radius):
            return NO_CONTACT
        if body.dimension == 3:
            answer = _by_floats(body, row, ball.radius, work)
            if answer is not None:
                return answer
    with np.errstate(over="ignore", invalid="ignore"):  # an infinite bound only sends a face to the exact test
        return _by_distances(body, ball, poses, work)


def _as_arrays(pose: Pose | None) -> Moves:
    """Return a pose as arrays of one rotation (1, d, d) and one translation (1, d); None for None."""
    return None if pose is None else (pose.rotation[None], pose.translation[None])


def centers_in_frame(ball: Sphere, body_poses: Moves, ball_poses: Moves) -> FloatArray:
    """Return the centre of a ball under n poses in the frame of a body under n poses (or one of either, or None), and
    the error of each coordinate: (n, d + 1).

    **Placed.** A coordinate is the sum of at most three products and a number: seven roundings of 2^-53 of their
    magnitudes, below 2^-50 of the sum of these, and underflow below 2^-1060.

    **In the frame** (pose frame). R^T (c - t) replaces R^-1 (c - t). R^T R is the identity up to 1e-12 an entry, so the
    two differ by less than 2^-38 |c - t|; and R preserves distances up to that part, which for those near the radius is
    that much of it more. A comparison of a distance with the radius, with twice the error as margin, is right about the
    image."""
    d = ball.dimension
    centers, error = ball.center[None], np.zeros((1, 1))
    with np.errstate(all="ignore"):  # what overflows is left open
        if ball_poses is not None:
            products = ball_poses[0] * ball.center
            centers = products.sum(axis=2) + ball_poses[1]
            sizes = np.abs(products).sum(axis=2) + np.abs(ball_poses[1])
            error = 2.0**-50 * sizes.max(axis=1, keepdims=True) + 2.0**-1060
        if body_poses is not None:
            arms = centers - body_poses[1]
            sizes = np.abs(centers).sum(axis=1, keepdims=True) + np.abs(body_poses[1]).sum(axis=1, keepdims=True)
            centers = (arms[:, :, None] * body_poses[0]).sum(axis=1)
            error = 2.0 * error + 2.0**-37 * (sizes + ball.radius) + 2.0**-1060
    placed = np.empty((len(centers), d + 1))
    placed[:, :d], placed[:, d:] = centers, error
    return placed


def _is_ball_clear_of_box(body: Solid, center: list[float], radius: float) -> bool:
    """Return whether a ball provably misses the box around a body; three roundings of 2^-53 are below 2^-50. center:
    coordinates in the body's frame, then a bound on their error.
    """
    *center, error = center  # the last is how far the others may be off
    reach = radius * (1.0 + 2.0**-50) + 2.0 * error
    low, high, _ = own_box(body)
    for c, a, b in zip(center, low.tolist(), high.tolist()):
        if max(a - c, c - b) - 2.0**-50 * (abs(c) + max(abs(a), abs(b))) > reach:
            return True
    return False


def _by_floats(body: Solid, center: list[float], radius: float, work: Work) -> Collision | None:
    """Return the relation of a mesh (first) and a ball with its witness, None if floats do not prove it. center: x, y,
    z in the mesh's coordinates, then a bound on the error of each."""
    mesh, results = mesh_body_of(body), np.empty((1, 2), np.int64)
    entry_of(relate_balls)(mesh.arrays, np.array([center]), float(radius), work.witness, results, work.budget.flag)
    work.budget.check()
    relation, triangle = results[0].tolist()
    if relation == UNSETTLED or (relation == OVERLAPPING and parity.state_at(mesh.arrays, triangle) == STATE_STACKED):
        return None
    return named(relation, int(mesh.faces[triangle]) if relation in (OVERLAPPING, TOUCHING) else -1)


@lru_cache(4096)
def named(relation: int, face: int, is_swapped: bool = False) -> Collision:
    """Return the answer, with its witness, for a relation code of a body (first) and a ball, and a face of the body
    that the ball touches or enters, -1 for none; is_swapped: of the ball and the body."""
    answer = _WITHIN.get(relation)
    if answer is None:
        answer = Collision(Relation(relation), Witness("surface", face, piercing=relation == TOUCHING))
    return answer.swapped() if is_swapped else answer


_WITHIN = {DISJOINT: NO_CONTACT, FIRST_INSIDE_SECOND: FIRST_WITHIN, SECOND_INSIDE_FIRST: SECOND_WITHIN}


def _by_distances(body: Solid, ball: Sphere, poses: Poses, work: Work) -> Collision:
    """Return the exact relation of a body (first) and a ball (second) by rational distances, nearest faces first."""
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
            overlaps = _any_part_enters(boundary, entered, center, limit)
            overlaps = overlaps or _is_within_walls(body, pose, center, ball.radius, work)
        else:
            overlaps = boundary.is_inside(center)
        if overlaps:
            return Collision(Relation.OVERLAPPING, Witness("surface", first_face=face))
    return Collision(Relation.TOUCHING, Witness("surface", first_face=face, piercing=enters))


def _candidates(nearest: FloatArray, limit: Fraction) -> IntArray:
    """Return the faces whose squared distance may be at most `limit`, given lower bounds on it by face, `nearest`;
    nearest first."""
    near = np.flatnonzero(nearest <= rounded(limit) * (1.0 + 2.0**-50) + 2.0**-1000)
    return near[np.argsort(nearest[near], kind="stable")]


def _any_part_enters(boundary: Boundary, faces: IntArray, center: Vector, limit: Fraction) -> bool:
    """Return whether a part of these faces that bounds the interior is nearer to the centre than the radius, exactly;
    limit: squared radius."""
    return len(faces) > 0 and boundary.has_live(faces, lambda corners: simplex_distance(center, corners) < limit)


def _is_within_walls(body: Solid, pose: Pose | None, center: Vector, radius: float, work: Work) -> bool:
    """Return whether an open ball lies inside the body, given that no face enters it but parts that cancel (even-odd).
    Off such parts the ball is all inside or all outside, so any point of it decides. The points tried lie on the curve
    (t, t^2, t^3) from the centre, which meets a plane at most three times: one of them is on no face."""
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
    """Return whether every vertex lies strictly inside the ball, farthest first by float64 bounds; limit: squared
    radius."""
    n = int(boundary.ends.max()) + 1 if len(boundary.ends) else 0
    some = boundary.floats(np.arange(4) * n // 4)
    if (boundary.bounds(center, some, some)[0] > rounded(limit) * (1.0 + 2.0**-50)).any():
        return False
    floats = boundary.floats(slice(None))
    lower, upper = boundary.bounds(center, floats, floats)
    unsure = np.flatnonzero(~(upper < rounded(limit) * (1.0 - 2.0**-50)))
    for vertex in unsure[np.argsort(-lower[unsure], kind="stable")].tolist():
        work.budget.check()
        if squared_length(difference(boundary.exact(vertex), center)) >= limit:
            return False
    return True


@np.errstate(over="ignore", invalid="ignore")
def body_sphere_parts(body: Solid, ball: Sphere, poses: Poses, work: Work) -> Parts:
    """Return which of a body (first) and a ball (second) that overlap has a part outside the other. The ball has one
    exactly if a part of a face that bounds the body's interior enters the open ball: else the ball is all inside. The
    body has one exactly if some point of such a part, and then a vertex, is outside the ball."""
    center, limit = image_point(ball.center, poses[1]), Fraction(ball.radius) ** 2
    boundary = boundary_of(body, poses[0], work)
    nearest, farthest = boundary.face_bounds(center)
    candidates = _candidates(nearest, limit)
    ball_sticks_out = _any_part_enters(boundary, candidates, center, limit)
    beyond = np.flatnonzero(farthest >= rounded(limit) * (1.0 - 2.0**-50) - 2.0**-1000)
    beyond = beyond[np.argsort(-nearest[beyond], kind="stable")]
    body_sticks_out = boundary.has_live(beyond, lambda corners: _farthest(center, corners) > limit)
    meet = ball_sticks_out and body_sticks_out
    if not meet:
        meet = any(  # of a face, some part is as near as the sphere, and some corner as far
            simplex_distance(center, corners) <= limit <= _farthest(center, corners)
            for corners in map(boundary.corners, np.intersect1d(candidates, beyond).tolist())
        )
    return Parts(body_sticks_out, ball_sticks_out, meet)


def _farthest(center: Vector, corners: tuple[Vector, ...]) -> Fraction:
    """Return the largest squared distance of a corner from the centre."""
    return max(squared_length(difference(p, center)) for p in corners)
