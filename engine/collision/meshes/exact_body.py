"""Exact posed coordinates of a body, as integers over one power of two, computed per vertex on demand.

A posed coordinate is a sum of products of doubles, so a pair of bodies fits on one lattice of spacing 2^-shift. Signs
of determinants of such integers are exact, need no fractions, and cost a few microseconds.

Two faces on these: their class, for any shape, and the kind of their contact. Slow and complete: it settles what the
kernel leaves UNDECIDED (posed faces near contact, faces without area, exponents out of range). A face without area is
its longest segment, or a point. Corners, edges and faces are simplices, and one predicate serves all: do two of them,
or their relative interiors, have a common point? They do if some weights of the corners, positive or not negative, give
the same point of both. These weights, of equal sums, form a space of at most five dimensions, and Fourier-Motzkin
elimination decides whether one of its points has the required signs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np

from engine.bounding.bvh import STACK, WIDTH
from engine.collision.exact_images import rounded_quotient
from engine.collision.meshes.mesh_arrays import MeshArrays, MeshBody, lattice_shift
from engine.collision.meshes.placement import PoseArrays
from engine.collision.meshes.triangle_triangle import APART, COMMON_AREA, CONTACT, COPLANAR, CROSSING
from engine.collision.result import Kind, Poses
from engine.compiling.jit import allocating_kernel, entry_of, inline
from engine.lanes.boxes import EMPTY
from engine.predicates.rational import cross, dot, largest_axis, minus, sign_of
from engine.solids.pose import Pose
from engine.types import FloatArray, IntArray

Vector = tuple[int, ...]
Plane = tuple[int, ...]
"""(a, b, c, d): a x + b y + c z + d = 0, the normal (a, b, c) as the face is oriented."""
Corners = tuple[Vector, Vector, Vector]


def plane_through(corners: Corners) -> Plane:
    """Return the plane (a, b, c, d) through three points; all zero if these are collinear."""
    p, q, r = corners
    n = cross(minus(q, p), minus(r, p))
    return (*n, -dot(n, p))


def on_lattice(value: float, shift: int) -> int:
    """Return value * 2^shift as an integer; caller guarantees that it is one."""
    numerator, denominator = value.as_integer_ratio()
    return (numerator << shift) // denominator


class ExactBody:
    """A posed body in integers: every posed coordinate times 2^shift, an integer by the choice of shift. Vertices and
    planes are computed on demand."""

    def __init__(self, mesh: MeshBody, pose: Pose | None, shift: int) -> None:
        self.mesh = mesh
        self.pose = mesh.posed(pose)
        self.shift = shift
        self._rotation: list[Vector] | None = None
        if pose is not None:
            self._r_shift = lattice_shift(pose.rotation)
            rows = pose.rotation.tolist()
            self._rotation = [tuple(on_lattice(value, self._r_shift) for value in row) for row in rows]
            self._translation = [on_lattice(value, shift) for value in pose.translation.tolist()]
        self._vertices: dict[int, Vector] = {}
        self._planes: dict[int, Plane] = {}

    def vertex(self, index: int) -> Vector:
        """Return a vertex under the pose, in units of the lattice."""
        point = self._vertices.get(index)
        if point is None:
            p = self.mesh.arrays.vertices[index].tolist()
            if self._rotation is None:
                point = tuple(on_lattice(value, self.shift) for value in p)
            else:
                q = [on_lattice(value, self.shift - self._r_shift) for value in p]
                point = tuple(dot(row, q) + t for row, t in zip(self._rotation, self._translation))
            self._vertices[index] = point
        return point

    def vertices(self, axes: list[int]) -> Any:
        """Return the coordinates of all vertices along some axes, under the pose, in units of the lattice: an array
        (n, len(axes)) of Python's integers."""
        shift = self.shift if self._rotation is None else self.shift - self._r_shift
        rows = [[int(axis == k) for k in range(3)] for axis in axes]
        if self._rotation is not None:
            rows = [list(self._rotation[axis]) for axis in axes]
        read = [k for k in range(3) if any(row[k] for row in rows)]
        points = self.mesh.arrays.vertices[:, read]
        if self.mesh.arrays.extent.reach < math.ldexp(1.0, 1000 - shift):
            whole = np.frompyfunc(int, 1, 1)(np.ldexp(points, shift))
        else:
            whole = np.array([[on_lattice(x, shift) for x in point] for point in points.tolist()], object)
        if self._rotation is None:
            return whole
        moves = np.array([self._translation[axis] for axis in axes], object)
        return whole @ np.array([[row[k] for k in read] for row in rows], object).T + moves

    def corners(self, face: int) -> Corners:
        """Return the three corners of a triangle under the pose, in units of the lattice."""
        a, b, c = self.mesh.arrays.triangles[face].tolist()
        return self.vertex(a), self.vertex(b), self.vertex(c)

    def plane(self, face: int) -> Plane:
        """Return the plane (a, b, c, d) of a triangle, cached; all zero without area."""
        cached = self._planes.get(face)
        if cached is None:
            cached = self._planes[face] = plane_through(self.corners(face))
        return cached

    def axis(self, face: int) -> int:
        """Return the axis (0, 1, 2) of the largest component of a triangle's normal, -1 for a triangle without area."""
        return largest_axis(self.plane(face)[:3])

    def faces_in(self, low: list[float], high: list[float]) -> list[int]:
        """Return, ascending, a superset of the triangles that intersect a closed box, whose bounds may be infinite."""
        faces: list[int] = faces_in(self.mesh.arrays, self.pose, low, high).tolist()
        return faces

    def at(self, point: Sequence[Fraction]) -> tuple[int, ...]:
        """Return a rational point as integers x, y, z, w: its coordinates are x / w, y / w, z / w in units of the
        lattice, 2^-shift."""
        w = math.lcm(*(x.denominator for x in point))
        x, y, z = (int(x * w) << self.shift for x in point)
        return x, y, z, w


def faces_in(arrays: MeshArrays, pose: PoseArrays, low: list[float], high: list[float]) -> IntArray:
    """Return, ascending, a superset of the triangles of a mesh, under the only pose in `pose`, that intersect the
    closed box from low to high."""
    box, hits = np.array([*low, *high]), np.empty(256, np.int64)
    n_hits = entry_of(_faces_in_box)(arrays, pose, box, hits)
    if n_hits > len(hits):
        hits = np.empty(n_hits, np.int64)
        entry_of(_faces_in_box)(arrays, pose, box, hits)
    return np.asarray(np.sort(hits[:n_hits]), np.int64)


def exact_pair(first: MeshBody, second: MeshBody, poses: Poses, shift: int = 0) -> tuple[ExactBody, ExactBody]:
    """Return both bodies under their poses in integers, over one power of two 2^-s: the finest that either needs, and
    at least as fine as 2^-shift."""
    for mesh, pose in zip((first, second), poses):
        own = mesh.shift
        if pose is not None:
            own = max(own + lattice_shift(pose.rotation), lattice_shift(pose.translation))
        shift = max(shift, own)
    return ExactBody(first, poses[0], shift), ExactBody(second, poses[1], shift)


def rounded_outward(numerator: int, denominator: int) -> tuple[float, float]:
    """Return a double below and a double above numerator / denominator; infinite beyond the range of doubles."""
    value = rounded_quotient(numerator, denominator)
    return float(np.nextafter(value, -np.inf)), float(np.nextafter(value, np.inf))


@inline
def _is_lane_apart(mesh: MeshArrays, node: int, lane: int, pose: PoseArrays, margin: float, bounds: FloatArray) -> bool:
    """Return whether the box of child ``lane`` of a node, under the only pose in `pose` and enlarged by ``margin``, is
    proven disjoint from the box ``bounds`` (6,): x, y, z minimum, then maximum. A NaN proves nothing."""
    r, t = pose.rotations[0], pose.translations[0]
    for i in range(3):
        centre, half = t[i], margin
        for k in range(3):
            centre += r[i, k] * (mesh.origin[k] + mesh.scale * float(mesh.boxes[node, k, lane]))
            half += abs(r[i, k]) * (mesh.scale * float(mesh.boxes[node, 3 + k, lane]))
        if centre - half > bounds[3 + i] or centre + half < bounds[i]:
            return True
    return False


@allocating_kernel
def _faces_in_box(mesh: MeshArrays, pose: PoseArrays, bounds: FloatArray, hits: IntArray) -> int:
    """Write the triangles whose posed boxes may intersect ``bounds`` (6,) to ``hits`` (room,); return their number,
    maybe more than the room."""
    t = pose.translations[0]
    shift = max(abs(t[0]), abs(t[1]), abs(t[2]))
    margin = 2.0**-47 * (3.0 * mesh.extent.reach + shift) + 2.0**-1060  # 8 times the error of `placement.py`
    stack = np.empty(STACK, np.int32)
    stack[0] = 0
    n_stack, n_hits = 1, 0
    while n_stack > 0:  # bound: each node enters once
        n_stack -= 1
        node = int(stack[n_stack])
        for lane in range(WIDTH):
            child = int(mesh.child[node, lane])
            if child == EMPTY or _is_lane_apart(mesh, node, lane, pose, margin, bounds):
                continue
            if child >= 0:
                stack[n_stack] = child
                n_stack += 1
                continue
            if n_hits < hits.shape[0]:
                hits[n_hits] = -1 - child
            n_hits += 1
    return n_hits


Flat = tuple[int, int]


def value_at(plane: Plane, p: Vector) -> int:
    """Return a x + b y + c z + d of plane (a, b, c, d) at point p: its sign is the side of p."""
    return plane[0] * p[0] + plane[1] * p[1] + plane[2] * p[2] + plane[3]


def drop_axis(p: Vector, axis: int) -> Flat:
    """Return the two coordinates of p other than ``axis``, in cyclic order."""
    return p[(axis + 1) % 3], p[(axis + 2) % 3]


def as_simplex(t: Corners) -> tuple[Vector, ...]:
    """Return the corners of a face; without area, the two ends of the segment that it is, or its one point."""
    p, q, r = t
    if any(cross(minus(q, p), minus(r, p))):
        return t
    ends = min(t), max(t)  # order: along a line the lexicographic order is the order along it
    return ends if ends[0] != ends[1] else ends[:1]


def _common_weights(s: tuple[Vector, ...], t: tuple[Vector, ...]) -> list[Vector]:
    """Return a row for each corner of s, then of t: its weights in the basis vectors of the space of common weights.

    Common weights: one number for each corner of s and of t, so that the sums over s and over t are equal and so are
    the weighted sums of corners: up to scale, one point written in corners of both."""
    origin, n = s[0], len(s) - 1  # its own weight is what the others of s lack
    vectors = [*(minus(p, origin) for p in s[1:]), *(minus(origin, p) for p in t)]
    rows = [(*vector, *(int(k == i) for k in range(len(vectors)))) for i, vector in enumerate(vectors)]
    for column in range(3):
        pivot = next((row for row in rows if row[column]), None)
        if pivot is not None:
            rows.remove(pivot)
            f = pivot[column]
            rows = [tuple(f * x - row[column] * y for x, y in zip(row, pivot)) if row[column] else row for row in rows]
    return list(zip(*((sum(row[3 + n :]) - sum(row[3 : 3 + n]), *row[3:]) for row in rows)))


def _is_feasible(positive: list[Vector], not_negative: list[Vector]) -> bool:
    """Return whether some vector z gives dot(row, z) > 0 for all rows of `positive`, and >= 0 for all of
    `not_negative`; by Fourier-Motzkin elimination."""
    n = len(positive[0])
    rows = {(*row, True) for row in positive} | {(*row, False) for row in not_negative}
    for k in range(n):  # of rows that grow and fall with z[k], a sum without it
        up, down = [row for row in rows if row[k] > 0], [row for row in rows if row[k] < 0]
        rows = {row for row in rows if row[k] == 0}
        rows |= {(*(p[k] * y - q[k] * x for x, y in zip(p[:n], q)), p[n] or q[n]) for p in up for q in down}
    return not any(row[n] for row in rows)  # 0 > 0


def _simplices_intersect(s: tuple[Vector, ...], t: tuple[Vector, ...], *, within: bool) -> bool:
    """Return whether two closed simplices of 1 to 3 corners have a common point; if `within`, whether their relative
    interiors have one."""
    weights = _common_weights(s, t)
    if not weights:
        return False
    if len(weights[0]) == 1:  # order: nearly always
        signs = {sign_of(weight) for (weight,) in weights}
        return len(signs) == 1 if within else len(signs - {0}) == 1
    return _is_feasible(weights, []) if within else _is_feasible([tuple(map(sum, zip(*weights[: len(s)])))], weights)


def classify_exact(t1: Corners, t2: Corners) -> int:
    """Return the class of two faces, with or without area; never UNDECIDED."""
    plane1, plane2 = plane_through(t1), plane_through(t2)
    sides1, sides2 = [sign_of(value_at(plane2, p)) for p in t1], [sign_of(value_at(plane1, p)) for p in t2]
    s1, s2 = as_simplex(t1), as_simplex(t2)
    if abs(sum(sides1)) == 3 or abs(sum(sides2)) == 3 or not _simplices_intersect(s1, s2, within=False):
        return APART
    if len(s1) < 3 or len(s2) < 3:
        return CONTACT
    if not any(sides2):
        return COMMON_AREA if _simplices_intersect(s1, s2, within=True) else COPLANAR
    both_straddle = {1, -1} <= set(sides1) and {1, -1} <= set(sides2)
    return CROSSING if both_straddle and _simplices_intersect(s1, s2, within=True) else CONTACT


def kind_of_contact(t1: Corners, t2: Corners) -> Kind:
    """Return the kind of contact of two faces that intersect, the strongest one: face_face, edge_face, ...,
    vertex_edge."""
    first, second = _features(as_simplex(t1)), _features(as_simplex(t2))

    def meet(d: int, e: int) -> bool:
        return any(_simplices_intersect(f, g, within=True) for f in first[d] for g in second[e])

    if meet(2, 2) and not any(value_at(plane_through(t1), p) for p in t2):
        return "face_face"
    if meet(1, 2) or meet(2, 1):
        return "edge_face"
    if meet(0, 2) or meet(2, 0):
        return "vertex_face"
    return "edge_edge" if meet(1, 1) else ("vertex_vertex" if meet(0, 0) else "vertex_edge")


def _features(s: tuple[Vector, ...]) -> tuple[list[tuple[Vector, ...]], ...]:
    """Return the corners, the edges and the faces of a simplex of 1 to 3 corners: three lists of tuples of 1, 2 and 3
    points."""
    return tuple(list(combinations(s, n)) for n in (1, 2, 3))
