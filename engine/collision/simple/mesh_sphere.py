"""A mesh (polyhedron, surface, 3D box) or a planar outline against a ball: squared distances to faces or edges.

Three questions decide. Is everything strictly inside the ball (the farthest vertex)? Does the boundary meet the ball,
and does the part of it beside the open interior reach into the open ball (the nearest live face)? Where the boundary
keeps clear of the ball, is the centre inside? Boxes of faces give float64 bounds of the distances; only faces whose
bounds allow a contact are measured, in rationals, nearest first.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.collision.exact_images import Vector, image_map, image_point
from engine.collision.meshes.live_faces import LivePiece, live_piece
from engine.collision.meshes.mesh_arrays import MeshBody, mesh_body_of
from engine.collision.planar.outline import is_clean, live_edges, outline_of, rounded
from engine.collision.result import Collision, Witness, Work
from engine.collision.simple.feature_distance import box_distance_bounds, segment_distance, triangle_distance
from engine.containment.rational_locate import rational_location
from engine.predicates.exact_vectors import minus, squared_length
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.solids.surface import Surface
from engine.types import Location, Relation


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """What a ball is measured against.

    low, high: (n, d) float64 boxes that hold the faces or edges. vertices: (m, d) float64. Each number is within
    `error` of the exact one. center: of the ball. distance: exact squared distance from there to a face. corners: of a
    face, exact. vertex: an exact position. reaches_inside: whether what is live of the boundary comes nearer than a
    squared distance. faces: the caller's number of each.
    """

    low: FloatArray
    high: FloatArray
    vertices: FloatArray
    error: float
    center: Vector
    distance: Callable[[int], Fraction]
    corners: Callable[[int], tuple[Vector, ...]]
    vertex: Callable[[int], Vector]
    reaches_inside: Callable[[list[int], Fraction], bool]
    faces: Callable[[int], int]
    has_inside: bool

    def bounds(self, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return bounds of the squared distances from the centre to what boxes of these bounds hold."""
        around = np.array([rounded(value) for value in self.center])
        slack = self.error + 2.0**-50 * float(np.abs(around).max()) + 2.0**-1070
        return box_distance_bounds(around, low - slack, high + slack)

    def candidates(self, nearest: FloatArray, limit: Fraction) -> IntArray:
        """Return the faces that may come as near as a squared distance, by these bounds, nearest first."""
        found = np.flatnonzero(nearest <= rounded(limit) * (1.0 + 2.0**-50) + 2.0**-1000)
        return found[np.argsort(nearest[found], kind="stable")]


def collide_mesh_sphere(
    body: Solid, sphere: Sphere, body_pose: Pose | None, sphere_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of a polyhedron, surface or 3D box (first) and a ball (second), exact."""
    center = image_point(sphere.center, sphere_pose)
    return _relation(mesh_features(body, body_pose, center, work), body, body_pose, sphere.radius, work)


def collide_outline_sphere(
    body: Solid, sphere: Sphere, body_pose: Pose | None, sphere_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of a polygon, triangle or 2D box (first) and a disc (second), exact."""
    center = image_point(sphere.center, sphere_pose)
    return _relation(outline_features(body, body_pose, center, work), body, body_pose, sphere.radius, work)


@np.errstate(over="ignore", invalid="ignore")  # an infinite bound only sends a face to the exact test
def _relation(features: Features, body: Solid, pose: Pose | None, radius: float, work: Work) -> Collision:
    center = features.center
    limit = Fraction(radius) ** 2
    candidates = features.candidates(features.bounds(features.low, features.high)[0], limit)
    touched, entered = -1, []
    for count, face in enumerate(candidates.tolist()):
        work.budget.check()
        distance = features.distance(face)
        if distance == limit and touched < 0:
            touched = face
        if distance < limit:
            entered = candidates[count:].tolist()
            break
    work.n_beyond_filter += len(candidates) > 0
    work.n_rational += len(candidates) > 0
    location = Location.OUTSIDE
    if not isinstance(body, Surface):
        location = Location(rational_location(center, body, pose, work.budget.check))
    if touched < 0 and not entered:
        if location == Location.OUTSIDE:
            return Collision(Relation.DISJOINT)
        return Collision(Relation.SECOND_INSIDE_FIRST, Witness("containment", containing="first"))
    if entered and _all_vertices_within(features, limit, work):
        return Collision(Relation.FIRST_INSIDE_SECOND, Witness("containment", containing="second"))
    face = features.faces(entered[0] if entered else touched)
    witness = Witness("surface", first_face=face)
    if radius > 0.0 and features.has_inside:
        if location == Location.INSIDE or (entered and features.reaches_inside(entered, limit)):
            return Collision(Relation.OVERLAPPING, witness)
        if location == Location.BOUNDARY and _is_within_walls(body, pose, center, radius, work):
            return Collision(Relation.OVERLAPPING, witness)
    return Collision(Relation.TOUCHING, Witness("surface", first_face=face, piercing=bool(entered)))


def _is_within_walls(body: Solid, pose: Pose | None, center: Vector, radius: float, work: Work) -> bool:
    """Tell whether a ball whose centre lies on walls that cancel, and into which nothing live reaches, is inside else.

    Off those walls the ball is all inside or all outside, so any point of it will do. The points tried lie on the curve
    (t, t^2, t^3) from the centre, which meets no plane more than three times: one of them is on no wall.
    """
    for k in itertools.count(2):  # bound: three turns a face
        q = tuple(c + Fraction(radius) / 2 / k**power for power, c in enumerate(center, 1))
        location = rational_location(q, body, pose, work.budget.check)
        if location != Location.BOUNDARY:
            return location == Location.INSIDE
    raise AssertionError("unreachable")


def _all_vertices_within(features: Features, limit: Fraction, work: Work) -> bool:
    """Tell whether every vertex lies strictly inside the ball; the farthest by float64 bounds are asked first."""
    lower, upper = features.bounds(features.vertices, features.vertices)
    unsure = np.flatnonzero(~(upper < rounded(limit) * (1.0 - 2.0**-50)))
    for vertex in unsure[np.argsort(-lower[unsure], kind="stable")].tolist():
        work.budget.check()
        if squared_length(minus(features.vertex(vertex), features.center)) >= limit:
            return False
    return True


def mesh_features(body: Solid, pose: Pose | None, center: Vector, work: Work) -> Features:
    """Return what a ball is measured against, of a polyhedron, surface or 3D box."""
    mesh = mesh_body_of(body)
    arrays = mesh.arrays
    used = np.unique(arrays.triangles)
    vertices, error = _placed(arrays.vertices, pose, mesh.reach)
    points, image = vertices[arrays.triangles], image_map(pose)

    def exact(index: int) -> Vector:
        return image(arrays.vertices[index].tolist())

    def corners(face: int) -> tuple[Vector, ...]:
        return tuple(exact(vertex) for vertex in arrays.triangles[face].tolist())

    def distance(face: int) -> Fraction:
        a, b, c = corners(face)
        return triangle_distance(center, a, b, c)

    def reaches_inside(candidates: list[int], limit: Fraction) -> bool:
        return any(piece_distance < limit for piece_distance in _live_distances(mesh, pose, candidates, center, work))

    return Features(
        points.min(axis=1),
        points.max(axis=1),
        vertices[used],
        error,
        center,
        distance,
        corners,
        lambda item: exact(int(used[item])),
        reaches_inside,
        lambda face: int(mesh.faces[face]),
        mesh.has_inside,
    )


def _live_distances(
    mesh: MeshBody, pose: Pose | None, faces: Iterable[int], center: Vector, work: Work
) -> Iterable[Fraction]:
    for face in faces:
        work.budget.check()
        piece = live_piece(mesh, face, work.budget)
        if piece is not None:
            distance = moved_piece(piece, pose).squared_distance(center)
            if distance is not None:
                yield distance


def moved_piece(piece: LivePiece, pose: Pose | None) -> LivePiece:
    """Return the exact image of a live piece."""
    if pose is None:
        return piece
    image = image_map(pose)
    return piece.moved({p: image(p) for p in (*piece.corners, *piece.vertices())})


def _placed(vertices: FloatArray, pose: Pose | None, reach: float) -> tuple[FloatArray, float]:
    """Return the rounded posed vertices and a bound on their error on each axis (derived in `placement.py`)."""
    if pose is None:
        return vertices, 0.0
    shift = float(np.abs(pose.translation).max())
    with np.errstate(all="ignore"):
        return vertices @ pose.rotation.T + pose.translation, 2.0**-49 * (3.0 * reach + shift) + 2.0**-1060


def outline_features(body: Solid, pose: Pose | None, center: Vector, work: Work) -> Features:
    """Return what a disc is measured against, of a polygon, triangle or 2D box."""
    outline = outline_of(body, pose, work.budget)
    vertices = np.array([[rounded(value) for value in point] for point in outline.points])

    def reaches_inside(candidates: list[int], limit: Fraction) -> bool:
        for edge in candidates:
            work.budget.check()
            if is_clean(outline, edge) and segment_distance(center, *outline.edge(edge)) < limit:
                return True
        return any(segment_distance(center, *piece) < limit for piece in live_edges(outline, work.budget))

    return Features(
        outline.low,
        outline.high,
        vertices,
        2.0**-52 * float(np.abs(vertices).max()) + 2.0**-1074,
        center,
        lambda edge: segment_distance(center, *outline.edge(edge)),
        outline.edge,
        lambda vertex: outline.points[vertex],
        reaches_inside,
        lambda edge: edge,
        True,
    )
