"""What of a body and of a ball that overlap lies outside the other.

The ball sticks out of the body exactly if a live part of the body's boundary enters the open ball: else the ball is all
inside. The body sticks out of the ball exactly if some point of its live boundary does, and then a vertex of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from engine.collision.exact_images import Vector, image_point
from engine.collision.meshes.live_faces import live_piece
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.planar.outline import live_edges, outline_of, rounded
from engine.collision.result import Parts, Work
from engine.collision.simple.mesh_sphere import Features, mesh_features, moved_piece, outline_features
from engine.predicates.exact_vectors import minus, squared_length
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere


@np.errstate(over="ignore", invalid="ignore")  # an infinite bound only sends a face to the exact test
def body_ball_parts(body: Solid, sphere: Sphere, body_pose: Pose | None, sphere_pose: Pose | None, work: Work) -> Parts:
    """Return it for a polyhedron, polygon, triangle or box (first) and a ball or disc (second)."""
    center = image_point(sphere.center, sphere_pose)
    limit = Fraction(sphere.radius) ** 2
    features = (mesh_features if body.dimension == 3 else outline_features)(body, body_pose, center, work)
    nearest, farthest = features.bounds(features.low, features.high)
    candidates = features.candidates(nearest, limit)
    ball_sticks_out = features.reaches_inside(candidates.tolist(), limit)
    beyond = np.flatnonzero(farthest >= rounded(limit) * (1.0 - 2.0**-50) - 2.0**-1000)
    beyond = beyond[np.argsort(-nearest[beyond], kind="stable")]
    vertices = _live_vertices(body, body_pose, beyond.tolist(), work)
    body_sticks_out = any(squared_length(minus(p, center)) > limit for p in vertices)
    meet = True
    if not (ball_sticks_out and body_sticks_out):
        meet = any(_meets_sphere(features, face, center, limit) for face in np.intersect1d(candidates, beyond).tolist())
    return Parts(body_sticks_out, ball_sticks_out, meet)


def _meets_sphere(features: Features, face: int, center: Vector, limit: Fraction) -> bool:
    """Tell whether a face has a point at the given squared distance from a centre."""
    if features.distance(face) > limit:
        return False
    return any(squared_length(minus(p, center)) >= limit for p in features.corners(face))


def _live_vertices(body: Solid, pose: Pose | None, faces: list[int], work: Work) -> Iterator[Vector]:
    """Yield points whose convex hull holds the live part of the given faces of a body; of a planar body all such."""
    if body.dimension == 2:
        for piece in live_edges(outline_of(body, pose, work.budget), work.budget):
            yield from piece
        return
    mesh = mesh_body_of(body)
    for face in faces:
        work.budget.check()
        piece3 = live_piece(mesh, face, work.budget)
        if piece3 is not None:
            yield from moved_piece(piece3, pose).vertices()
