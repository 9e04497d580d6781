"""The exact posed coordinates of a body, as Python integers over one power of two. Computed per vertex, when asked for.

A posed coordinate is a sum of products of doubles, so a whole pair of bodies fits on one lattice of spacing 2^-shift.
Signs of determinants of such integers are exact, need no fractions, and cost a few microseconds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from engine.arrays import IntArray
from engine.bounding.bvh import STACK, WIDTH
from engine.collision.exact_images import rounded_quotient
from engine.collision.meshes.mesh_arrays import MeshArrays, MeshBody, lattice_shift
from engine.collision.meshes.placement import PoseArrays
from engine.collision.result import Poses
from engine.jit import allocating_kernel, inline
from engine.lanes.boxes import EMPTY
from engine.predicates.rational import cross, dot, largest_axis, minus
from engine.solids.pose import Pose

Vector = tuple[int, ...]
Plane = tuple[int, ...]
"""(a, b, c, d): a x + b y + c z + d = 0, the normal (a, b, c) as the face is oriented."""
Corners = tuple[Vector, Vector, Vector]


def plane_through(corners: Corners) -> Plane:
    """Return the plane of three points; all zero if they have no area."""
    p, q, r = corners
    n = cross(minus(q, p), minus(r, p))
    return (*n, -dot(n, p))


def on_lattice(value: float, shift: int) -> int:
    """Return value * 2^shift, which the caller knows to be an integer."""
    numerator, denominator = value.as_integer_ratio()
    return (numerator << shift) // denominator


class ExactBody:
    """One placed body on the lattice of a pair."""

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
        """Return the exact placed vertex."""
        found = self._vertices.get(index)
        if found is None:
            p = self.mesh.arrays.vertices[index].tolist()
            if self._rotation is None:
                found = tuple(on_lattice(value, self.shift) for value in p)
            else:
                q = [on_lattice(value, self.shift - self._r_shift) for value in p]
                found = tuple(dot(row, q) + t for row, t in zip(self._rotation, self._translation))
            self._vertices[index] = found
        return found

    def corners(self, face: int) -> Corners:
        """Return the three exact corners of a triangle."""
        a, b, c = self.mesh.arrays.triangles[face].tolist()
        return self.vertex(a), self.vertex(b), self.vertex(c)

    def plane(self, face: int) -> Plane:
        """Return the exact plane of a triangle."""
        found = self._planes.get(face)
        if found is None:
            found = self._planes[face] = plane_through(self.corners(face))
        return found

    def axis(self, face: int) -> int:
        """Return the axis on which a triangle's normal is largest, -1 if it has no area."""
        return largest_axis(self.plane(face)[:3])

    def faces_in(self, low: list[float], high: list[float]) -> list[int]:
        """Return, ascending, at least the triangles that meet the closed box; bounds may be infinite."""
        faces: list[int] = faces_in(self.mesh.arrays, self.pose, low, high).tolist()
        return faces

    def at(self, point: Sequence[Fraction]) -> tuple[int, ...]:
        """Return any point as x, y, z, w on the lattice."""
        w = math.lcm(*(x.denominator for x in point))
        x, y, z = (int(x * w) << self.shift for x in point)
        return x, y, z, w


def faces_in(arrays: MeshArrays, pose: PoseArrays, low: list[float], high: list[float]) -> IntArray:
    """Return, ascending, at least the triangles of a placed mesh that meet a closed box; bounds may be infinite."""
    box, found = np.array([*low, *high]), np.empty(256, np.int64)
    with np.errstate(all="ignore"):  # uncompiled runs only
        n_found = _faces_in_box(arrays, pose, box, found)
        if n_found > len(found):
            found = np.empty(n_found, np.int64)
            _faces_in_box(arrays, pose, box, found)
    return np.asarray(np.sort(found[:n_found]), np.int64)


def exact_pair(first: MeshBody, second: MeshBody, poses: Poses, shift: int = 0) -> tuple[ExactBody, ExactBody]:
    """Return both bodies on one lattice, of spacing 2^-shift at most."""
    for mesh, pose in zip((first, second), poses):
        own = mesh.shift
        if pose is not None:
            own = max(own + lattice_shift(pose.rotation), lattice_shift(pose.translation))
        shift = max(shift, own)
    return ExactBody(first, poses[0], shift), ExactBody(second, poses[1], shift)


def rounded_outward(numerator: int, denominator: int) -> tuple[float, float]:
    """Return doubles around a rational, infinite where it is beyond them."""
    value = rounded_quotient(numerator, denominator)
    return float(np.nextafter(value, -np.inf)), float(np.nextafter(value, np.inf))


@inline
def _is_lane_apart(mesh: MeshArrays, node: int, lane: int, pose: PoseArrays, margin: float, bounds: Any) -> bool:
    """Tell whether a placed child box surely has no common point with bounds (6,); NaN is never apart."""
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
def _faces_in_box(mesh: MeshArrays, pose: PoseArrays, bounds: Any, found: Any) -> int:
    """Write the triangles whose placed boxes may meet bounds (6,) into found (room,); return their number."""
    t = pose.translations[0]
    shift = max(abs(t[0]), abs(t[1]), abs(t[2]))
    margin = 2.0**-47 * (3.0 * mesh.extent.reach + shift) + 2.0**-1060  # 8 times the error of `placement.py`
    stack = np.empty(STACK, np.int32)
    stack[0] = 0
    n_stack, n_found = 1, 0
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
            if n_found < found.shape[0]:
                found[n_found] = -1 - child
            n_found += 1
    return n_found
