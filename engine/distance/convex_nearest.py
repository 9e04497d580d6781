"""Nearest points of two convex bodies: the features that GJK ends at, proven to be the only nearest ones.

If the exact nearest points of the lines or planes of two features lie strictly within these, and all other vertices of
both bodies strictly beyond the planes across them, no other points are as near (`refined.py`). Of a vertex and a face
only the other body's vertices need to: the plane of a face supports its convex body, whichever vertices lie in it, and
of that plane the foot is nearest to the vertex.

Source: E. Gilbert, D. Johnson, S. Keerthi, A fast procedure for computing the distance between complex objects in
three-dimensional space, 1988.
"""

from __future__ import annotations

from collections import namedtuple
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

import numpy as np

from engine.collision.convex_body import (
    N_NUMBERS,
    REACH,
    ConvexArrays,
    ConvexBody,
    convex_body_of,
    point_of,
    pool_of_one,
)
from engine.collision.convex_pair import PlacedBody, placed_body
from engine.collision.meshes.mesh_arrays import STILL
from engine.collision.meshes.near_triangles import FACE
from engine.collision.meshes.placement import PoseArrays, rotate
from engine.collision.result import Clearance, Feature, Poses
from engine.compiling.jit import called, entry_of, inline, kernel, merged
from engine.distance.across_axes import nearest_across
from engine.distance.closed_forms import Wide3, less3
from engine.distance.convex_gaps import (
    FOUND,
    Measured,
    Span,
    difference_of_centers,
    gap_of_convex,
    measure,
    spans_of,
    unit_of,
    walk,
)
from engine.distance.refined import View, write_offset_point
from engine.distance.spreads import feature_of
from engine.predicates.vectors import dot, minus
from engine.running.budget import Budget
from engine.solids.base import Solid
from engine.solids.mesh import Mesh, Polyhedron, used_by_faces
from engine.types import FlagArray, FloatArray, IntArray, Point3, read_only

MOST_TRIANGLES: Final = 2048
"""Most triangles of a body that is searched so: a walk looks at all vertices, a tree leads to few."""

_Named = namedtuple("_Named", "vertices triangles faces")
"""What `feature_of` reads."""

_Vertices = namedtuple("_Vertices", "vertices")


@dataclass(frozen=True, slots=True, eq=False)
class Hull:
    """A convex body, alone in its pool; features: by triangle and code, as far as they were asked for."""

    solid: Solid
    pool: ConvexArrays
    named: _Named
    features: dict[int, Feature]

    def feature(self, triangle: int, code: int) -> Feature:
        """Return the feature with a code of a triangle, in the caller's numbering."""
        key = 8 * triangle + code
        if key not in self.features:
            self.features[key] = feature_of(self.solid, self.named, triangle, code)
        return self.features[key]


def hull_of(solid: Solid) -> Hull | None:
    """Return a body as the kernel reads it; None if it has too many faces, or is not provably convex. Cached."""

    def build() -> Hull | None:
        if isinstance(solid, Polyhedron) and len(solid.triangles) > MOST_TRIANGLES:
            return None
        body = convex_body_of(solid)
        if body is None:
            return None
        faces = solid.triangle_faces if isinstance(solid, Polyhedron) else np.arange(len(body.triangles)) // 2
        return _as_hull(solid, body, faces)

    return solid.prepared("hull", build)


def _as_hull(solid: Solid, body: ConvexBody, faces: IntArray) -> Hull:
    """Return the `Hull` of a body; faces: of its triangles."""
    ascending = read_only(np.array(faces, np.int64))
    return Hull(solid, pool_of_one(body), _Named(body.points.T, body.triangles, ascending), {})


def _mesh_of(solid: Solid) -> Hull | None:
    """Return a body as `hull_of` does, or a mesh of few faces that is not convex. Cached."""

    def build() -> Hull | None:
        if not isinstance(solid, Mesh) or not 0 < len(solid.triangles) <= MOST_TRIANGLES:
            return None
        vertices, triangles = used_by_faces(solid)
        points, numbers = np.ascontiguousarray(vertices.T), np.zeros(N_NUMBERS)
        body = ConvexBody(points, np.empty((4, len(triangles))), read_only(triangles), numbers)
        return _as_hull(solid, body, solid.triangle_faces)

    return hull_of(solid) or solid.prepared("mesh across axes", build)


def nearest_of_hulls(first: Solid, second: Solid, poses: Poses) -> Clearance | None:
    """Return the clearance of two bodies of space under poses; None if they are not proven to be convex, apart and
    with one nearest pair of points, or apart along axes."""
    return _answer(hull_of(first), hull_of(second), poses, True)


def nearest_of_meshes(first: Solid, second: Solid, poses: Poses) -> Clearance | None:
    """Return the clearance of two bodies of space under poses, convex or not; None if they are not proven to be apart
    along axes."""
    return _answer(_mesh_of(first), _mesh_of(second), poses, False)


def _answer(a: Hull | None, b: Hull | None, poses: Poses, are_convex: bool) -> Clearance | None:
    """Return what the kernel says of two bodies, if it proves anything."""
    if a is None or b is None:
        return None
    own, their = (STILL if at is None else PoseArrays(at.rotation[None], at.translation[None], True) for at in poses)
    points, row = np.empty((2, 3)), np.empty(4, np.int64)
    distance = entry_of(nearest_of_convex)(
        a.pool, a.named.faces, own, b.pool, b.named.faces, their, are_convex, points, row
    )
    if not distance > 0.0:
        return None
    points.setflags(write=False)
    i, code, j, their_code = row.tolist()
    return Clearance(distance, points, (a.feature(i, code), b.feature(j, their_code)))


def fill_gaps_of_hulls(
    first: Solid, second: Solid, poses: PoseArrays, least: Fraction | None, answers: FloatArray, budget: Budget
) -> None:
    """Fill answers (n,), NaN on entry, with the distances of two bodies of space under n poses of the second, where
    floats prove them; given `least`, with 0.0 for nearer ones and infinity for others."""
    a, b = hull_of(first), hull_of(second)
    if a is not None and b is not None:
        gap = np.inf if least is None else float(least)
        entry_of(gaps_of_hulls)(a.pool, STILL, b.pool, poses, gap, least is None, answers, budget.flag)
        budget.check()


@kernel
def gaps_of_hulls(
    first: ConvexArrays, own: PoseArrays, second: ConvexArrays, poses: PoseArrays, gap: float, is_measured: bool,
    distances: FloatArray, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill distances (n,) of two convex bodies, the second under n poses, as `gap_of_convex` does. Returns early when
    the flag is set."""
    a, reach = placed_body(first, 0, own, 0), first.numbers[0, REACH] + second.numbers[0, REACH]
    for item in range(distances.shape[0]):
        if flag[0] != 0:
            return
        b = placed_body(second, 0, poses, item)
        start = difference_of_centers(first, 0, a, second, 0, b)
        distances[item] = gap_of_convex(a, b, start, reach, gap, is_measured)


@inline
def _find(triangles: IntArray, s: Span) -> tuple[int, int]:
    """Return the first triangle that has a feature, and its code there; (-1, -1) if there is none."""
    for item in range(triangles.shape[0]):
        for k in range(3):
            i, j = triangles[item, k], triangles[item, (k + 1) % 3]
            if s.code == 0 and i == s.i:
                return item, k
            if s.code == 3 and ((i == s.i and j == s.j) or (i == s.j and j == s.i)):
                return item, 3 + k
            if s.code == FACE and i in (s.i, s.j, s.k) and j in (s.i, s.j, s.k) and triangles[item, (k + 2) % 3] in (
                s.i, s.j, s.k):  # fmt: skip
                return item, FACE
    return -1, -1


@inline
def _is_sure(m: Measured, i: Span, j: Span) -> bool:
    """Return whether measured points are proven to be the only nearest ones; i, j: what they lie on."""
    own, other = m.beyond if i.code == FACE else m.alone, m.other_beyond if j.code == FACE else m.other_alone
    return m.distance > 0.0 and m.error < np.inf and own and other


@merged
def _is_on_plane(f: PlacedBody, triangles: IntArray, item: int, n: Wide3, base: Point3, size: float) -> bool:
    """Return whether all corners of a triangle are about on the plane through `base` across n. size: of coordinates."""
    d = Point3(n.x.h, n.y.h, n.z.h)
    for k in range(3):
        v = minus(rotate(f.place, point_of(f.points, triangles[item, k])), base)
        if abs(dot(d, v)) > 2.0**-40 * size * (abs(d.x) + abs(d.y) + abs(d.z)):
            return False
    return True


@inline
def _measure_on_faces(
    a: PlacedBody, b: PlacedBody, i: Span, j: Span, m: Measured, triangles: IntArray, is_first: bool, unit: float
) -> tuple[Span, Span, Measured]:
    """Return what `measure` says of a vertex of one body and the triangle of the other, with these triangles, in which
    its foot lies, with the spans; the arguments if it lies strictly within none. m: measured between i and j, in the
    plane of the triangle. is_first: whether the triangles are the first body's."""
    f, end = (a, m.p) if is_first else (b, m.q)
    move = minus(b.place.shift, a.place.shift)
    base = Point3(end.x.h / unit, end.y.h / unit, end.z.h / unit)
    base = base if is_first else minus(base, move)
    for item in range(triangles.shape[0]):
        if _is_on_plane(f, triangles, item, less3(m.q, m.p), base, 1.0 / unit):
            face = Span(triangles[item, 0], triangles[item, 1], triangles[item, 2], FACE)
            first, second = (face, j) if is_first else (i, face)
            found = measure(a, b, first, second, unit)
            if _is_sure(found, first, second):
                return first, second, found
    return i, j, m


@kernel
def nearest_of_convex(
    first: ConvexArrays, faces: IntArray, first_pose: PoseArrays, second: ConvexArrays, second_faces: IntArray,
    second_pose: PoseArrays, are_convex: bool, points: FloatArray, row: IntArray,
) -> float:  # fmt: skip
    """Return the distance of two bodies, the nearest double, and fill points (2, 3) with the nearest points and row
    (4,) with a triangle and the code of the feature in it of each body; NaN where any of it is unproven. Of several
    triangles the first is named. faces, second_faces: of the triangles. Of bodies that need not be convex only vertices
    and triangles are read."""
    distance = _only_nearest(first, first_pose, second, second_pose, points, row) if are_convex else np.nan
    if distance > 0.0:
        return distance
    return nearest_across(first, faces, first_pose, second, second_faces, second_pose, points, row)


@called
def _only_nearest(
    first: ConvexArrays, first_pose: PoseArrays, second: ConvexArrays, second_pose: PoseArrays, points: FloatArray,
    row: IntArray,
) -> float:  # fmt: skip
    """As `nearest_of_convex`, where only one pair of points is nearest."""
    a, b = placed_body(first, 0, first_pose, 0), placed_body(second, 0, second_pose, 0)
    how, simplex = walk(a, b, difference_of_centers(first, 0, a, second, 0, b), np.inf, True)
    if how != FOUND:
        return np.nan
    unit = unit_of(a, b, first.numbers[0, REACH] + second.numbers[0, REACH])
    i, j = spans_of(simplex)
    m = measure(a, b, i, j, unit)
    row[0], row[1] = _find(first.triangles, i)
    row[2], row[3] = _find(second.triangles, j)
    if j.code == 0 and m.other_alone and not (m.alone and row[0] >= 0):
        i, j, m = _measure_on_faces(a, b, i, j, m, first.triangles, True, unit)
        row[0], row[1] = _find(first.triangles, i)
    elif i.code == 0 and m.alone and not (m.other_alone and row[2] >= 0):
        i, j, m = _measure_on_faces(a, b, i, j, m, second.triangles, False, unit)
        row[2], row[3] = _find(second.triangles, j)
    if not _is_sure(m, i, j) or (row[0] < 0 and a.round == 0.0) or (row[2] < 0 and b.round == 0.0):
        return np.nan
    own, other = View(_Vertices(a.points.T), a.place, unit), View(_Vertices(b.points.T), b.place, unit)
    origin, move = first_pose.translations[0], second_pose.translations[0]
    known, theirs = (i.i, _or_none(i.j, i.i), _or_none(i.k, i.j)), (j.i, _or_none(j.j, j.i), _or_none(j.k, j.j))
    way, back = less3(m.q, m.p), less3(m.p, m.q)
    is_proven = write_offset_point(own, known, m.p, way, a.round * unit, origin, origin, m.error, points[0])
    if write_offset_point(other, theirs, m.q, back, b.round * unit, origin, move, m.error, points[1]) and is_proven:
        return m.distance
    return np.nan


@merged
def _or_none(vertex: int, other: int) -> int:
    """Return -1 in place of a vertex that repeats the other."""
    return -1 if vertex == other else vertex
