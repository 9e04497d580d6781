"""Convex bodies as the portal filter (`convex_pair.py`) reads them: few vertices, and starting points for its searches.

A polyhedron certified convex (`engine.solids.convexity`) and a box are the hull of their vertices; a ball is one vertex
with a radius. Bodies without interior (flat boxes, balls of radius 0) are not included.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from engine.bounding.aabb import corners_of_box
from engine.collision.meshes.mesh_arrays import BOX_TRIANGLES
from engine.compiling.jit import entry_of, kernel, merged
from engine.predicates.vectors import cross, length, minus
from engine.solids.base import Solid
from engine.solids.convexity import convexity
from engine.solids.mesh import Polyhedron, used_by_faces
from engine.solids.primitives import Aabb, Sphere
from engine.types import FloatArray, IntArray, Point3, read_only

MOST_FACES = 1 << 16
"""Most triangles of a polyhedron that is tested for convexity: the test takes milliseconds and mostly fails."""

CENTER, ASIDE = 0, 3
RADIUS, REACH, ROUND = 6, 7, 8
N_NUMBERS = 9
"""Columns of the numbers of a body.

| column | meaning |
|---|---|
| CENTER ..., ASIDE ... | two interior points, the second off the symmetric middle |
| RADIUS | distance of the farthest vertex from either, rounded up |
| REACH | largest magnitude of a coordinate, plus the radius |
| ROUND | radius of a ball |
"""

WEIGHTS = tuple(weight / 1024 for weight in (16, 25, 31, 38, 4, 11, 13, 22))
"""Weights by which the second interior point is moved toward the farthest vertex in each octant, different on each
axis."""

_NO_CLAIM = np.inf
_NO_FACES = read_only(np.empty((0, 3), np.int64))


ConvexArrays = namedtuple("ConvexArrays", "points normals triangles firsts numbers")
"""Convex bodies, concatenated into few arrays, because kernels count references to each.

| field | shape | meaning |
|---|---|---|
| points | (3, n) | vertices |
| normals | (4, n_faces) | about unit, outward; row 3: relative error |
| triangles | (n_faces, 3) | vertices of each face |
| firsts | (2, n_bodies + 1) | offsets of vertices and faces |
| numbers | (n_bodies, N_NUMBERS) | columns above |
"""


@dataclass(frozen=True, slots=True, eq=False)
class ConvexBody:
    """One convex body of space, its vertices numbered from 0. points (3, n): vertices; normals (4, n_faces): outward,
    about unit, row 3 a bound on their error; triangles (n_faces, 3): vertices of each face, in the solid's order;
    numbers (N_NUMBERS,): columns above."""

    points: FloatArray
    normals: FloatArray
    triangles: IntArray
    numbers: FloatArray


def convex_body_of(solid: Solid) -> ConvexBody | None:
    """Return the convex body of a solid of space; None if it is not provably convex. Cached."""

    def build() -> ConvexBody | None:
        if isinstance(solid, Sphere) and solid.dimension == 3 and solid.radius > 0.0:
            return _ball(solid)
        if isinstance(solid, Aabb) and solid.dimension == 3 and bool((solid.min < solid.max).all()):
            with np.errstate(all="ignore"):
                center = 0.5 * solid.min + 0.5 * solid.max
            if bool(((solid.min < center) & (center < solid.max)).all()):
                return _hull(corners_of_box(solid.min, solid.max), BOX_TRIANGLES.reshape(-1, 3), center, True)
        if isinstance(solid, Polyhedron) and len(solid.triangles) <= MOST_FACES:
            certificate = convexity(solid)
            if certificate is not None:
                return _hull(*used_by_faces(solid), certificate.center, certificate.is_outward)
        return None

    return solid.prepared("convex_body", build)


def _ball(ball: Sphere) -> ConvexBody:
    """Build the body of a ball: one vertex, and a radius."""
    numbers = np.zeros(N_NUMBERS)
    numbers[CENTER:ASIDE] = numbers[ASIDE:RADIUS] = ball.center
    with np.errstate(over="ignore"):
        numbers[RADIUS], numbers[ROUND] = ball.radius * (1.0 + 2.0**-40), ball.radius
        numbers[REACH] = np.abs(ball.center).max() + ball.radius
    points = ball.center[:, None].copy()
    return ConvexBody(points, np.empty((4, 0)), _NO_FACES, numbers)


def _hull(vertices: FloatArray, triangles: IntArray, center: FloatArray, is_outward: bool) -> ConvexBody:
    """Build the body of a convex hull. vertices (n, 3): all used; triangles (m, 3): caller guarantees that they face
    outward, or all inward; center: an interior point."""
    normals, numbers = np.empty((4, len(triangles))), np.zeros(N_NUMBERS)
    numbers[CENTER:ASIDE] = center
    points, triangles = np.ascontiguousarray(vertices.T), read_only(triangles)
    with np.errstate(all="ignore"):  # an overflow makes a claim impossible, not wrong
        entry_of(_fill_arrays)(points, triangles, is_outward, normals, numbers)
    return ConvexBody(points, normals, triangles, numbers)


@merged
def point_of(points: FloatArray, point: int) -> Point3:
    """Return vertex ``point`` of points (3, n)."""
    return Point3(points[0, point], points[1, point], points[2, point])


@kernel
def _fill_arrays(
    points: FloatArray, triangles: IntArray, is_outward: bool, normals: FloatArray, numbers: FloatArray
) -> None:
    """Fill normals (4, n_faces) and numbers (N_NUMBERS,) of a hull; CENTER, an interior point, is given. points (3, n):
    vertices; triangles (n_faces, 3), counter-clockwise from outside if is_outward, else clockwise. A face that is too
    thin gets a zero normal with an infinite error.

    error of a normal: rounded differences and products are off by less than 14 u |v| |w| for the edges v, w; 2^-48 |v|
    |w| also covers the scaling to unit length, as long as it is small against the length.
    """
    n_points = points.shape[1]
    for item in range(triangles.shape[0]):
        a, b, c = triangles[item, 0], triangles[item, 1], triangles[item, 2]
        v, w = minus(point_of(points, b), point_of(points, a)), minus(point_of(points, c), point_of(points, a))
        n, sides = cross(v, w) if is_outward else cross(w, v), length(v) * length(w)
        normals[:3, item], normals[3, item] = 0.0, _NO_CLAIM
        if length(n) > 2.0**-30 * sides and 2.0**-900 < length(n) < 2.0**900:
            normals[0, item], normals[1, item], normals[2, item] = n.x / length(n), n.y / length(n), n.z / length(n)
            normals[3, item] = 2.0**-48 * sides / length(n)
    for axis in range(3):
        numbers[ASIDE + axis] = numbers[CENTER + axis]
    for octant in range(8):
        best, outermost = -np.inf, 0
        for point in range(n_points):
            value = 0.0
            for axis in range(3):
                value += points[axis, point] if octant >> axis & 1 else -points[axis, point]
            if value > best:
                best, outermost = value, point
        for axis in range(3):
            numbers[ASIDE + axis] += WEIGHTS[octant] * (points[axis, outermost] - numbers[CENTER + axis])
    reach = 0.0
    for axis in range(3):
        for point in range(n_points):
            reach = max(reach, abs(points[axis, point]))
    radius = 0.0
    for place in range(CENTER, RADIUS, 3):
        for point in range(n_points):
            square = 0.0
            for axis in range(3):
                square += (points[axis, point] - numbers[place + axis]) * (points[axis, point] - numbers[place + axis])
            radius = max(radius, np.sqrt(square))
    numbers[RADIUS] = radius * (1.0 + 2.0**-40) + 2.0**-50 * reach
    numbers[REACH] = reach


def pool_of_one(body: ConvexBody) -> ConvexArrays:
    """Return the pool of one body; it shares the body's arrays."""
    offsets = np.array([[0, body.points.shape[1]], [0, len(body.triangles)]])
    return ConvexArrays(body.points, body.normals, body.triangles, offsets, body.numbers[None])


def pool_bodies(bodies: Sequence[ConvexBody]) -> ConvexArrays:
    """Concatenate bodies into the arrays that kernels take; body k of the pool is bodies[k]."""
    first_point = _offsets([body.points.shape[1] for body in bodies])
    first_face = _offsets([len(body.triangles) for body in bodies])
    return ConvexArrays(
        np.ascontiguousarray(np.concatenate([np.empty((3, 0)), *(body.points for body in bodies)], axis=1)),
        np.ascontiguousarray(np.concatenate([np.empty((4, 0)), *(body.normals for body in bodies)], axis=1)),
        read_only(np.concatenate([_NO_FACES, *(body.triangles + at for body, at in zip(bodies, first_point))])),
        np.stack([first_point, first_face]),
        np.concatenate([np.empty(0), *(body.numbers for body in bodies)]).reshape(-1, N_NUMBERS),
    )


def _offsets(counts: list[int]) -> IntArray:
    """Return the offsets (n + 1,) of n consecutive parts of the given sizes; the last one is the total."""
    return np.append(np.int64(0), np.cumsum(np.array(counts, np.int64)))
