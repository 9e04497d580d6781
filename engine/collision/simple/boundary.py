"""Boundary of one placed body for balls and half-spaces: the faces of a mesh, or the edges of an outline.

The body's open interior is next to exactly the live part of a face, which even-odd does not cancel. Most faces are
whole: no other face of the body covers a part of them. A stacked one (`parity.py`) is cut into cells
(`exact_regions.py`), live or not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial, reduce
from itertools import chain, pairwise
from typing import Any

import numpy as np

from engine.collision.exact_images import (
    HalfSpaceImage,
    Vector,
    as_vector,
    image_point,
    plane_in_frame,
    rounded,
    value_at,
)
from engine.collision.meshes.exact_body import ExactBody, exact_pair, faces_in
from engine.collision.meshes.exact_regions import cells_of, sides_at
from engine.collision.meshes.mesh_arrays import NO_AREA, STATE_STACKED, MeshArrays, MeshBody, mesh_body_of
from engine.collision.meshes.parity import state_at
from engine.collision.outline import is_clean, live_edges, outline_of
from engine.collision.result import Work
from engine.compiling.jit import entry_of, kernel
from engine.containment.methods.rational_locate import rational_location
from engine.predicates.rational import common_integers, cross, dot, minus, sign_of, squared_length
from engine.running.budget import Budget
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.types import BoolArray, FloatArray, Int8Array, IntArray, Location


def box_distance_bounds(point: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds (n,) on the squared distance of `point` from anything that lies in the boxes ``(n,
    d)``.

    The lower bound is the distance to the box, the upper one that to its farthest corner, both widened by 2^-48 of
    themselves and 2^-1000: at most d + 3 roundings of relative size u enter each, and d underflows of 2^-1074. Overflow
    makes them infinite or NaN; NaN lower bounds become 0, NaN upper bounds infinity."""
    with np.errstate(all="ignore"):
        gap = np.maximum(np.maximum(low - point, point - high), 0.0)
        reach = np.maximum(np.abs(low - point), np.abs(high - point))
        lower = (gap * gap).sum(axis=1) * (1.0 - 2.0**-48) - 2.0**-1000
        upper = (reach * reach).sum(axis=1) * (1.0 + 2.0**-48) + 2.0**-1000
    lower[np.isnan(lower) | np.isinf(lower)] = 0.0
    upper[np.isnan(upper)] = np.inf
    return lower, upper


_ALL = slice(None)


@dataclass(frozen=True, slots=True, eq=False)
class Boundary:
    """Faces of a mesh or edges of an outline under a pose, as the tests of balls and half-spaces read them.

    | field | meaning |
    |---|---|
    | ends | (n, d) vertices of each face or edge |
    | floats(vertices) | rounded posed vertices, each number within `error` |
    | near(point, radius) | superset of the faces within the radius of a point, ascending |
    | exact(vertex) | exact position |
    | number(face), number_at(vertex) | the caller's number of a face, and of one at a vertex |
    | signs(plane) | side (-1, 0, 1) of each vertex |
    | live(faces) | parts of these faces with interior on one side only: corners of triangles, or ends of edges |
    | is_inside(point) | whether a point on no face is inside |
    | has_inside | False for surfaces and flat boxes |
    """

    ends: IntArray
    floats: Callable[[IntArray | slice], FloatArray]
    error: float
    near: Callable[[Vector, float], IntArray]
    exact: Callable[[int], Vector]
    number: Callable[[int], int]
    number_at: Callable[[int], int]
    signs: Callable[[HalfSpaceImage], Int8Array]
    live: Callable[[list[int]], Iterator[tuple[Vector, ...]]]
    is_inside: Callable[[Vector], bool]
    has_inside: bool

    def corners(self, face: int) -> tuple[Vector, ...]:
        """Return the exact corners of a face."""
        return tuple(self.exact(vertex) for vertex in self.ends[face].tolist())

    def face_bounds(self, center: Vector, faces: IntArray | slice = _ALL) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper bounds on the squared distances of a point from faces, by their boxes."""
        ends = self.ends[faces]
        points = self.floats(ends.reshape(-1))
        corners = points.reshape(*ends.shape, points.shape[1]).transpose(1, 0, 2)  # numpy is slow along short axes
        return self.bounds(center, reduce(np.minimum, corners), reduce(np.maximum, corners))

    def bounds(self, center: Vector, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper bounds on the squared distance of `center` from what lies in the boxes low, high (n,
        d) of rounded posed coordinates."""
        around = np.array([rounded(value) for value in center])
        slack = self.error + 2.0**-50 * float(np.abs(around).max()) + 2.0**-1070
        return box_distance_bounds(around, low - slack, high + slack)

    def faces_at(self, is_chosen: BoolArray) -> IntArray:
        """Return the faces with a corner among the chosen vertices."""
        return np.flatnonzero(reduce(np.logical_or, is_chosen[self.ends.T]))

    def has_live(self, faces: IntArray, condition: Callable[[tuple[Vector, ...]], bool]) -> bool:
        """Return whether the condition holds for the corners of some part of these faces that has interior on one side
        only; for an outline, those of other edges are tried too."""
        return any(map(condition, self.live(faces.tolist())))


def boundary_of(body: Solid, pose: Pose | None, work: Work) -> Boundary:
    """Return the boundary of a body other than a ball or a half-space."""
    return (_mesh_boundary if body.dimension == 3 else _outline_boundary)(body, pose, work)


def _mesh_boundary(body: Solid, pose: Pose | None, work: Work) -> Boundary:
    """Build the boundary of a polyhedron, surface or 3D box."""
    mesh, image = mesh_body_of(body), partial(image_point, pose=pose)
    vertices, triangles = mesh.arrays.vertices, mesh.arrays.triangles
    error = 0.0
    if pose is not None:  # the error is derived in `placement.py`
        error = 2.0**-49 * (3.0 * mesh.arrays.extent.reach + float(np.abs(pose.translation).max())) + 2.0**-1060

    def floats(where: IntArray | slice) -> FloatArray:
        with np.errstate(all="ignore"):
            return vertices[where] if pose is None else vertices[where] @ pose.rotation.T + pose.translation

    def near(center: Vector, radius: float) -> IntArray:
        around = np.array([rounded(x) for x in center])
        reach = radius + 2.0**-50 * (radius + np.abs(around)) + 2.0**-1070  # four roundings of 2^-53
        return faces_in(mesh.arrays, mesh.posed(pose), (around - reach).tolist(), (around + reach).tolist())

    def is_inside(center: Vector) -> bool:
        exact, _ = exact_pair(mesh, mesh, (pose, pose))
        return mesh.has_inside and sides_at(exact, exact.at(center), 2).at

    def live(faces: list[int]) -> Iterator[tuple[Vector, ...]]:
        for face in faces:
            work.budget.check()
            for corners in live_parts(mesh, face, work.budget):
                yield corners if pose is None else tuple(map(image, corners))

    return Boundary(
        triangles, floats, error, near, lambda vertex: image(vertices[vertex].tolist()),
        lambda face: int(mesh.faces[face]),
        lambda vertex: int(mesh.faces[entry_of(first_triangle_at)(mesh.arrays, vertex)]),
        lambda plane: signs_of(plane, vertices, pose, work), live, is_inside, mesh.has_inside,
    )  # fmt: skip


def _outline_boundary(body: Solid, pose: Pose | None, work: Work) -> Boundary:
    """Build the boundary of a polygon, triangle or box of the plane."""
    outline = outline_of(body, pose, work.budget)

    def live(edges: list[int]) -> Iterator[tuple[Vector, ...]]:
        for edge in edges:
            work.budget.check()
            if is_clean(outline, edge):
                yield outline.edge(edge)
        yield from live_edges(outline, work.budget)

    error = 2.0**-52 * float(np.abs(outline.floats).max()) + 2.0**-1074
    return Boundary(
        outline.ends, lambda where: outline.floats[where], error, lambda center, radius: np.arange(outline.n_edges),
        lambda vertex: outline.points[vertex], lambda edge: edge, lambda vertex: vertex,
        lambda plane: np.array([sign_of(value_at(plane, point)) for point in outline.points], np.int8), live,
        lambda center: rational_location(center, body, pose, work.budget.check) == Location.INSIDE, True,
    )  # fmt: skip


def signs_of(plane: HalfSpaceImage, points: FloatArray, pose: Pose | None, work: Work) -> Int8Array:
    """Return the exact side (-1, 0, 1) at a plane of the image of each of ``(n, 3)`` points under a pose. work: counts
    and deadline.

    The function is pulled back: with N = n R and D = n . t + d, both rational, it is N . p + D. Scaled so that the
    largest of N and D is about 1, their rounded values have an error of u each (or 2^-1075 where they are denormal),
    and the sum of k products one of (k + 2) u of the sum of magnitudes: 2^-49 of it, 2^-1073 of the sum of coordinates
    (for the denormal weights) and 2^-1000 more are not exceeded."""
    (normal, offset), weights, shift = pulled_back(plane, pose)
    with np.errstate(all="ignore"):
        values = points @ weights + shift
        bounds = np.abs(points) @ (2.0**-49 * np.abs(weights) + 2.0**-1073) + (2.0**-49 * abs(shift) + 2.0**-1000)
        signs = np.where(values > bounds, 1, np.where(values < -bounds, -1, 0)).astype(np.int8)
        open_items = np.flatnonzero(~(np.abs(values) > bounds) | ~np.isfinite(bounds))
    work.n_beyond_filter += len(open_items)
    work.n_rational += len(open_items)
    for count, item in enumerate(open_items.tolist()):
        if count % 64 == 0:
            work.budget.check()
        signs[item] = sign_of(dot(normal, as_vector(points[item].tolist())) + offset)
    return signs


def pulled_back(plane: HalfSpaceImage, pose: Pose | None) -> tuple[HalfSpaceImage, FloatArray, float]:
    """Return ((N, D), weights, offset). (N, D): exact, with N . p + D the plane's value at the image of p under the
    pose; weights, offset: N and D as doubles, the largest magnitude scaled to 1."""
    normal, offset = plane_in_frame(plane, pose)
    largest = max(abs(value) for value in (*normal, offset))
    return (normal, offset), np.array([float(value / largest) for value in normal]), float(offset / largest)


def segment_distance(point: Sequence[Any], a: Sequence[Any], b: Sequence[Any]) -> Fraction:
    """Return the squared distance from `point` to the closed segment a b, which may be a point."""
    along, to_point = minus(b, a), minus(point, a)
    length, t = squared_length(along), dot(to_point, along)
    if t <= 0 or t >= length:
        return Fraction(squared_length(minus(point, b) if t > 0 else to_point))
    return squared_length(to_point) - Fraction(t * t, length)


def simplex_distance(point: Vector, corners: Sequence[Vector]) -> Fraction:
    """Return the squared distance of `point` from the closed segment or triangle of these corners, degenerate or not;
    exact. Over an open triangle it is the distance to the plane, elsewhere that to the nearest edge; in integers."""
    d, (numbers, scale) = len(point), common_integers([*point, *chain(*corners)])
    q, *ends = [tuple(numbers[at : at + d]) for at in range(0, len(numbers), d)]
    if len(ends) == 2:
        return segment_distance(q, *ends) / scale**2
    edges = list(zip(ends, (*ends[1:], ends[0])))
    normal = cross(minus(ends[1], ends[0]), minus(ends[2], ends[0]))
    if any(normal) and all(dot(cross(minus(b, a), minus(q, a)), normal) >= 0 for a, b in edges):
        return Fraction(dot(normal, minus(q, ends[0])) ** 2, squared_length(normal) * scale**2)
    return min(segment_distance(q, a, b) for a, b in edges) / scale**2


def live_parts(mesh: MeshBody, face: int, budget: Budget) -> Iterator[tuple[Vector, ...]]:
    """Yield triangles, unposed, that fill the part of a face that even-odd does not cancel: the face itself, unless
    another face of the body covers a part of it; nothing for a face without area."""
    if mesh.arrays.axis[face] == NO_AREA:
        return
    if state_at(mesh.arrays, face) != STATE_STACKED:
        yield tuple(map(as_vector, mesh.arrays.vertices[mesh.arrays.triangles[face]].tolist()))
        return
    body = ExactBody(mesh, None, mesh.shift)
    for middle, corners in cells_of(body, face, budget):
        sides = sides_at(body, middle, body.axis(face))
        if sides.above != sides.below:
            a, *others = (tuple(Fraction(x, w << mesh.shift) for x in xyz) for *xyz, w in corners)
            yield from ((a, *pair) for pair in pairwise(others))


@kernel
def first_triangle_at(mesh: MeshArrays, vertex: int) -> int:
    """Return the first triangle with a given vertex, -1 if there is none."""
    for triangle in range(mesh.triangles.shape[0]):
        t = triangle
        if mesh.triangles[t, 0] == vertex or mesh.triangles[t, 1] == vertex or mesh.triangles[t, 2] == vertex:
            return triangle
    return -1
