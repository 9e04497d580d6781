"""A half-space and a body given by vertices (mesh, box, polygon, triangle): the signs of the vertices decide.

A linear function is largest and smallest over a body at vertices. Signs come from a float64 filter over all vertices at
once; what it leaves open, and every vertex under a pose that it leaves open, is settled in rationals.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from engine.arrays import FloatArray, Int8Array, IntArray
from engine.collision.exact_images import HalfSpaceImage, as_vector, image_half_space, image_map, value_at
from engine.collision.meshes.live_faces import live_piece
from engine.collision.meshes.mesh_arrays import MeshBody, mesh_body_of
from engine.collision.planar.outline import Outline, is_clean, live_edges, outline_of
from engine.collision.result import Collision, Witness, Work
from engine.predicates.exact_vectors import dot
from engine.predicates.rational import sign_of
from engine.solids.base import Solid
from engine.solids.half_space import HalfSpace
from engine.solids.pose import Pose
from engine.types import Relation


def collide_half_space_mesh(
    half_space: HalfSpace, body: Solid, half_space_pose: Pose | None, body_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of a half-space (first) and a polyhedron, surface or 3D box (second), exact."""
    mesh = mesh_body_of(body)
    used = np.unique(mesh.arrays.triangles)
    plane = image_half_space(half_space.normal, half_space.offset, half_space_pose)
    signs = signs_of(plane, mesh.arrays.vertices[used], body_pose, work)

    def reaches_inside() -> bool:
        if not mesh.has_inside:
            return False
        positive = np.zeros(len(mesh.arrays.vertices), np.bool_)
        positive[used[signs > 0]] = True
        faces = np.flatnonzero(positive[mesh.arrays.triangles].any(axis=1))
        return live_faces_reach(mesh, faces, plane, 1, body_pose, work)

    lowest = int(np.argmax(signs > 0)) if (signs > 0).any() else int(np.argmax(signs == 0))
    face = int(np.argmax((mesh.arrays.triangles == used[lowest]).any(axis=1)))
    return _relation(signs, reaches_inside, int(mesh.faces[face]))


def collide_half_space_outline(
    half_space: HalfSpace, body: Solid, half_space_pose: Pose | None, body_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of a half-plane (first) and a polygon, triangle or 2D box (second), exact."""
    outline = outline_of(body, body_pose, work.budget)
    plane = image_half_space(half_space.normal, half_space.offset, half_space_pose)
    signs = signs_of_outline(outline, plane)

    def reaches_inside() -> bool:
        for edge in np.flatnonzero((signs[outline.ends] > 0).any(axis=1)).tolist():
            work.budget.check()
            if is_clean(outline, edge):
                return True
        return live_edges_reach(outline, plane, 1, work)

    edge = int(np.argmax(signs > 0)) if (signs > 0).any() else int(np.argmax(signs == 0))
    return _relation(signs, reaches_inside, edge)


def _relation(signs: Int8Array, reaches_inside: Callable[[], bool], face: int) -> Collision:
    if (signs < 0).all():
        return Collision(Relation.DISJOINT)
    if (signs > 0).all():
        return Collision(Relation.SECOND_INSIDE_FIRST, Witness("containment", containing="first"))
    enters = bool((signs > 0).any())
    if enters and reaches_inside():
        return Collision(Relation.OVERLAPPING, Witness("surface", second_face=face))
    return Collision(Relation.TOUCHING, Witness("surface", second_face=face, piercing=enters))


def live_faces_reach(
    mesh: MeshBody, faces: IntArray, plane: HalfSpaceImage, side: int, pose: Pose | None, work: Work
) -> bool:
    """Tell whether some of what is live of these faces lies on one side, 1 or -1, of a plane."""
    image = image_map(pose)
    for face in faces.tolist():
        work.budget.check()
        piece = live_piece(mesh, face, work.budget)
        if piece is not None and any(side * value_at(plane, image(p)) > 0 for p in piece.vertices()):
            return True
    return False


def live_edges_reach(outline: Outline, plane: HalfSpaceImage, side: int, work: Work) -> bool:
    """Tell whether some of what is live of an outline lies on one side, 1 or -1, of a line."""
    return any(side * value_at(plane, end) > 0 for piece in live_edges(outline, work.budget) for end in piece)


def signs_of_outline(outline: Outline, plane: HalfSpaceImage) -> Int8Array:
    """Return the exact sign of a line at each vertex."""
    return np.array([sign_of(value_at(plane, point)) for point in outline.points], np.int8)


def signs_of(plane: HalfSpaceImage, points: FloatArray, pose: Pose | None, work: Work) -> Int8Array:
    """Return the exact sign of the plane at the image of each of ``(n, 3)`` points.

    The function is pulled back: with N = n R and D = n . t + d, both rational, it is N . p + D. Scaled so that the
    largest of N and D is about 1, their rounded values have an error of u each (or 2^-1075 where they are denormal),
    and the sum of k products one of (k + 2) u of the sum of magnitudes: 2^-49 of it, 2^-1073 of the sum of coordinates
    (for the denormal weights) and 2^-1000 more are not exceeded.
    """
    normal, offset = _pulled_back(plane, pose)
    largest = max(abs(value) for value in (*normal, offset))
    weights = np.array([float(value / largest) for value in normal])
    shift = float(offset / largest)
    with np.errstate(all="ignore"):
        values = points @ weights + shift
        bounds = 2.0**-49 * (np.abs(points) @ np.abs(weights) + abs(shift)) + 2.0**-1000
        bounds += 2.0**-1073 * np.abs(points).sum(axis=1)
        signs = np.where(values > bounds, 1, np.where(values < -bounds, -1, 0)).astype(np.int8)
        open_items = np.flatnonzero(~(np.abs(values) > bounds) | ~np.isfinite(bounds))
    work.n_beyond_filter += len(open_items)
    work.n_rational += len(open_items)
    for count, item in enumerate(open_items.tolist()):
        if count % 64 == 0:
            work.budget.check()
        signs[item] = sign_of(dot(normal, as_vector(points[item].tolist())) + offset)
    return signs


def _pulled_back(plane: HalfSpaceImage, pose: Pose | None) -> HalfSpaceImage:
    if pose is None:
        return plane
    normal, offset = plane
    pulled = tuple(dot(normal, as_vector(column)) for column in pose.rotation.T.tolist())
    return pulled, offset + dot(normal, as_vector(pose.translation.tolist()))
