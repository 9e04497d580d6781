"""A half-space and a body given by vertices (mesh, box, polygon, triangle): the signs of the vertices decide.

A linear function is largest and smallest over a body at vertices. Signs come from a float64 filter over all vertices at
once; what it leaves open, and every vertex under a pose that it leaves open, is settled in rationals.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np

from engine.arrays import FloatArray, Int8Array
from engine.collision.exact_images import Vector, dot, image_half_space
from engine.collision.meshes.live_faces import live_piece
from engine.collision.meshes.mesh_arrays import shell_of
from engine.collision.planar.outline import is_clean, live_edges, outline_of
from engine.collision.result import Collision, Witness, Work
from engine.predicates.rational import sign_of
from engine.solids.base import Solid
from engine.solids.half_space import HalfSpace
from engine.solids.pose import Pose
from engine.types import Relation


def collide_half_space_mesh(
    half_space: HalfSpace, body: Solid, half_space_pose: Pose | None, body_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of a half-space (first) and a polyhedron, surface or 3D box (second), exact."""
    shell = shell_of(body)
    used = np.unique(shell.arrays.triangles)
    plane = image_half_space(half_space.normal, half_space.offset, half_space_pose)
    signs = signs_of(plane, shell.arrays.vertices[used], body_pose, work)

    def reaches_inside() -> bool:
        if not shell.has_inside:
            return False
        positive = np.zeros(len(shell.arrays.vertices), np.bool_)
        positive[used[signs > 0]] = True
        for face in np.flatnonzero(positive[shell.arrays.triangles].any(axis=1)).tolist():
            work.budget.check()
            piece = live_piece(shell, face, work.budget)
            if piece is not None and any(value_at_image(plane, p, body_pose) > 0 for p in piece.vertices()):
                return True
        return False

    lowest = int(np.argmax(signs > 0)) if (signs > 0).any() else int(np.argmax(signs == 0))
    face = int(np.argmax((shell.arrays.triangles == used[lowest]).any(axis=1)))
    return _relation(signs, reaches_inside, int(shell.faces[face]))


def collide_half_space_outline(
    half_space: HalfSpace, body: Solid, half_space_pose: Pose | None, body_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of a half-plane (first) and a polygon, triangle or 2D box (second), exact."""
    outline = outline_of(body, body_pose, work.budget)
    plane = image_half_space(half_space.normal, half_space.offset, half_space_pose)
    signs = np.array([sign_of(dot(plane[0], point) + plane[1]) for point in outline.points], np.int8)

    def reaches_inside() -> bool:
        for edge in np.flatnonzero((signs[outline.ends] > 0).any(axis=1)).tolist():
            work.budget.check()
            if is_clean(outline, edge):
                return True
        return any(dot(plane[0], end) + plane[1] > 0 for piece in live_edges(outline, work.budget) for end in piece)

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


def value_at_image(plane: tuple[Vector, Fraction], point: Vector, pose: Pose | None) -> Fraction:
    """Return normal . image(point) + offset for a point of rational coordinates."""
    normal, offset = plane
    if pose is not None:
        rows = [tuple(map(Fraction, row)) for row in pose.rotation.tolist()]
        point = tuple(dot(row, point) + Fraction(shift) for row, shift in zip(rows, pose.translation.tolist()))
    return dot(normal, point) + offset


def signs_of(plane: tuple[Vector, Fraction], points: FloatArray, pose: Pose | None, work: Work) -> Int8Array:
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
        signs[item] = sign_of(dot(normal, tuple(map(Fraction, points[item].tolist()))) + offset)
    return signs


def _pulled_back(plane: tuple[Vector, Fraction], pose: Pose | None) -> tuple[Vector, Fraction]:
    if pose is None:
        return plane
    normal, offset = plane
    columns = [tuple(map(Fraction, column)) for column in pose.rotation.T.tolist()]
    shift = dot(normal, tuple(map(Fraction, pose.translation.tolist())))
    return tuple(dot(normal, column) for column in columns), offset + shift
