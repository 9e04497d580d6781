"""The boundary of one placed body as balls and half-spaces see it: the faces of a mesh, or the edges of an outline."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction

import numpy as np

from engine.arrays import FloatArray, Int8Array, IntArray
from engine.collision.exact_images import HalfSpaceImage, Vector, as_vector, image_map, value_at
from engine.collision.meshes.live_faces import LivePiece, live_piece
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.planar.outline import is_clean, live_edges, outline_of, rounded
from engine.collision.result import Work
from engine.collision.simple.feature_distance import box_distance_bounds, simplex_distance
from engine.predicates.exact_vectors import dot
from engine.predicates.rational import sign_of
from engine.solids.base import Solid
from engine.solids.pose import Pose


class Boundary:
    """What both kinds have in common.

    ends: (n, d) the vertices of each face or edge. floats: (m, d) the rounded posed vertices, each number within
    `error` of the exact one. has_inside: False for surfaces and flat boxes.
    """

    ends: IntArray
    floats: FloatArray
    error: float
    has_inside: bool = True

    def exact(self, vertex: int) -> Vector:
        """Return the exact position of a vertex."""
        raise NotImplementedError

    def number(self, face: int) -> int:
        """Return the caller's number of a face."""
        return face

    def number_at(self, vertex: int) -> int:
        """Return the caller's number of a face at a vertex."""
        return vertex

    def signs(self, plane: HalfSpaceImage) -> Int8Array:
        """Return the exact sign of a plane at each vertex."""
        raise NotImplementedError

    def live(self, faces: Iterable[int]) -> Iterator[LivePiece]:
        """Yield what even-odd leaves of these faces; of an outline maybe of the other edges too."""
        raise NotImplementedError

    def corners(self, face: int) -> tuple[Vector, ...]:
        """Return the exact corners of a face."""
        return tuple(self.exact(vertex) for vertex in self.ends[face].tolist())

    def distance(self, face: int, center: Vector) -> Fraction:
        """Return the exact squared distance from a point to a face."""
        return simplex_distance(center, self.corners(face))

    def face_bounds(self, center: Vector) -> tuple[FloatArray, FloatArray]:
        """Return bounds of the squared distances from a point to what the boxes of the faces hold."""
        points = self.floats[self.ends]
        return self._bounds(center, points.min(axis=1), points.max(axis=1))

    def vertex_bounds(self, center: Vector) -> tuple[FloatArray, FloatArray]:
        """Return bounds of the squared distances from a point to the vertices."""
        return self._bounds(center, self.floats, self.floats)

    def _bounds(self, center: Vector, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        around = np.array([rounded(value) for value in center])
        slack = self.error + 2.0**-50 * float(np.abs(around).max()) + 2.0**-1070
        return box_distance_bounds(around, low - slack, high + slack)

    def reaches_beyond(self, faces: IntArray, plane: HalfSpaceImage, side: int) -> bool:
        """Tell whether something live of these faces lies on one side, 1 or -1, of a plane."""
        return self._has_live(faces, lambda piece: any(side * value_at(plane, p) > 0 for p in piece.vertices()))

    def reaches_nearer(self, faces: IntArray, center: Vector, limit: Fraction) -> bool:
        """Tell whether something live of these faces comes nearer to a point than a squared distance."""
        return self._has_live(faces, lambda piece: piece.squared_distance(center) < limit)

    def reaches_farther(self, faces: IntArray, center: Vector, limit: Fraction) -> bool:
        """Tell whether something live of these faces is farther from a point than a squared distance."""
        return self._has_live(faces, lambda piece: piece.farthest(center) > limit)

    def _has_live(self, faces: IntArray, condition: Callable[[LivePiece], bool]) -> bool:
        return any(map(condition, self.live(faces.tolist())))


class MeshBoundary(Boundary):
    """The triangles of a polyhedron, surface or 3D box."""

    def __init__(self, body: Solid, pose: Pose | None, work: Work) -> None:
        self._mesh, self._pose, self._work = mesh_body_of(body), pose, work
        self._image = image_map(pose)
        arrays = self._mesh.arrays
        self.ends, self.has_inside = arrays.triangles, self._mesh.has_inside
        self.floats, self.error = arrays.vertices, 0.0
        if pose is not None:  # the error is derived in `placement.py`
            shift = float(np.abs(pose.translation).max())
            with np.errstate(all="ignore"):
                self.floats = arrays.vertices @ pose.rotation.T + pose.translation
            self.error = 2.0**-49 * (3.0 * self._mesh.reach + shift) + 2.0**-1060

    def exact(self, vertex: int) -> Vector:
        return self._image(self._mesh.arrays.vertices[vertex].tolist())

    def number(self, face: int) -> int:
        return int(self._mesh.faces[face])

    def number_at(self, vertex: int) -> int:
        return self.number(int(np.argmax((self.ends == vertex).any(axis=1))))

    def signs(self, plane: HalfSpaceImage) -> Int8Array:
        return signs_of(plane, self._mesh.arrays.vertices, self._pose, self._work)

    def live(self, faces: Iterable[int]) -> Iterator[LivePiece]:
        for face in faces:
            self._work.budget.check()
            piece = live_piece(self._mesh, face, self._work.budget)
            if piece is not None:
                yield piece if self._pose is None else piece.moved(self._image)


class OutlineBoundary(Boundary):
    """The edges of a polygon, triangle or 2D box."""

    def __init__(self, body: Solid, pose: Pose | None, work: Work) -> None:
        self._outline, self._work = outline_of(body, pose, work.budget), work
        self.ends, self.floats = self._outline.ends, self._outline.floats
        self.error = 2.0**-52 * float(np.abs(self.floats).max()) + 2.0**-1074

    def exact(self, vertex: int) -> Vector:
        return self._outline.points[vertex]

    def signs(self, plane: HalfSpaceImage) -> Int8Array:
        return np.array([sign_of(value_at(plane, point)) for point in self._outline.points], np.int8)

    def live(self, faces: Iterable[int]) -> Iterator[LivePiece]:
        for edge in faces:
            self._work.budget.check()
            if is_clean(self._outline, edge):
                yield LivePiece(self._outline.edge(edge), None)
        for ends in live_edges(self._outline, self._work.budget):
            yield LivePiece(ends, None)


def boundary_of(body: Solid, pose: Pose | None, work: Work) -> Boundary:
    """Return the boundary of a body that is no ball and no half-space."""
    return (MeshBoundary if body.dimension == 3 else OutlineBoundary)(body, pose, work)


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
