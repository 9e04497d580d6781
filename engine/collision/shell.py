"""What collision sees of a body: triangles, their tree, and what is known of each face. Built once per solid, lazily.

A polyhedron and a box are closed shells under even-odd; a surface, and a box that is flat on some axis, have nothing
inside. All arrays are in the body's own coordinates: poses are applied where a query runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine.bounding.bvh import build_bvh
from engine.collision.placement import NO_ROTATION, NO_TRANSLATION, PoseArrays
from engine.collision.triangle_triangle import projected
from engine.jit import inline, kernel
from engine.predicates.loading import as_point3
from engine.predicates.orientation import orient2d
from engine.solids.aabb import Aabb
from engine.solids.base import FloatArray, IntArray, Solid
from engine.solids.mesh import Mesh
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose
from engine.types import Point3

NO_AREA = -1
UNKNOWN_AXIS = -2
"""Values in `axis` beside 0, 1, 2: no projection has an area; a predicate was undecided."""

STATE_UNKNOWN = -1
STATE_CLEAN = 0
STATE_CROSSED = 1
STATE_STACKED = 2
"""Values in `state`: nothing computed yet; no other face of the body meets the relative interior in more than single
points; some other face crosses it along a segment; some other face of the same plane covers part of it (or unsure)."""


class ShellArrays(NamedTuple):
    """The arrays that kernels take. `state` is filled by kernels as needed: any thread writes the same values."""

    vertices: FloatArray
    triangles: IntArray
    axis: npt.NDArray[np.int8]
    state: npt.NDArray[np.int8]
    boxes: FloatArray
    child: IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Shell:
    """Triangles of one body.

    arrays: for kernels. faces: the caller's face of each triangle. has_inside: False for surfaces and flat boxes.
    components: of the triangles connected through vertices, one triangle each, ascending. reach: largest magnitude of a
    coordinate. shift: every coordinate times 2^shift is an integer.
    """

    arrays: ShellArrays
    faces: IntArray
    has_inside: bool
    components: IntArray
    reach: float
    shift: int

    def posed(self, pose: Pose | None) -> PoseArrays:
        """Return the pose as kernels take it."""
        if pose is None:
            return PoseArrays(NO_ROTATION, NO_TRANSLATION, False, True, self.reach)
        rotations = np.ascontiguousarray(pose.rotation).reshape(1, 3, 3)
        translations = np.ascontiguousarray(pose.translation).reshape(1, 3)
        is_exact = is_exact_pose(self.arrays.vertices, pose)
        return PoseArrays(rotations, translations, True, is_exact, self.reach)


def is_exact_pose(points: FloatArray, pose: Pose) -> bool:
    """Tell whether a pose only permutes axes, turns signs and adds without rounding: a lattice moved along itself."""
    if not np.isin(pose.rotation, (-1.0, 0.0, 1.0)).all():
        return False
    with np.errstate(all="ignore"):
        turned = points @ pose.rotation.T
        moved = turned + pose.translation
        back = moved - turned
        lost = (turned - (moved - back)) + (pose.translation - back)
        return bool((lost == 0.0).all())  # overflow: NaN is not zero


def shell_of(solid: Solid) -> Shell:
    """Return the shell of a polyhedron, surface or 3D box, built at the first call."""
    return solid.prepared("collision_shell", lambda: build_shell(solid))


def build_shell(solid: Solid) -> Shell:
    """Return a new shell of a polyhedron, surface or 3D box."""
    if isinstance(solid, Aabb):
        vertices, triangles, faces = _box_triangles(solid)
        has_inside = bool((solid.min < solid.max).all())
    else:
        assert isinstance(solid, Mesh)
        vertices, triangles, faces = solid.vertices, solid.triangles, solid.triangle_faces
        has_inside = isinstance(solid, Polyhedron)
    return shell_of_triangles(vertices, triangles, faces, has_inside)


def shell_of_triangles(vertices: FloatArray, triangles: IntArray, faces: IntArray, has_inside: bool) -> Shell:
    """Return the shell of checked arrays."""
    corners = vertices[triangles]
    boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
    tree = build_bvh(boxes)
    axis = np.empty(len(triangles), np.int8)
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):  # uncompiled runs only
        _find_axes(vertices, triangles, axis)
    parent = np.arange(len(vertices))
    join_vertices(triangles, np.zeros(len(triangles), np.bool_), parent)
    _, first = np.unique(parent[triangles[:, 0]], return_index=True)
    state = np.full(len(triangles), STATE_UNKNOWN, np.int8)
    arrays = ShellArrays(read_only(vertices), read_only(triangles), read_only(axis), state, tree.boxes, tree.child)
    return Shell(arrays, faces, has_inside, np.sort(first), float(np.abs(corners).max()), lattice_shift(vertices))


def lattice_shift(values: FloatArray) -> int:
    """Return k so that every value times 2^k is an integer."""
    exponents = np.frexp(values[values != 0.0])[1]
    return max(0, 53 - int(exponents.min())) if exponents.size else 0


def read_only(array: Any) -> Any:
    """Return a contiguous read-only array, so that every shell has one compiled type."""
    array = np.ascontiguousarray(array)
    if array.flags.writeable:
        array = array.view()
        array.setflags(write=False)
    return array


def _box_triangles(box: Aabb) -> tuple[FloatArray, IntArray, IntArray]:
    """Return the triangles of a box by face (xmin, xmax, ymin, ymax, zmin, zmax); of a flat one each place once."""
    flat = box.min == box.max
    corners = np.array([[(box.min, box.max)[i >> k & 1][k] for k in range(3)] for i in range(8)])
    quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    if flat.any():  # the two faces across a flat axis are one: keep that; a segment or point: any face will do
        quads = [quads[2 * int(np.argmax(flat))]]
        face_numbers = [2 * int(np.argmax(flat))]
    else:
        face_numbers = list(range(6))
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    _, first, merged = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    return corners, first[merged.reshape(-1)][triangles], np.repeat(np.array(face_numbers), 2)


@inline
def axis_of(p: Point3, q: Point3, r: Point3) -> int:
    """Return an axis along which the projection of a triangle has an area, NO_AREA or UNKNOWN_AXIS."""
    ux, uy, uz = q.x - p.x, q.y - p.y, q.z - p.z
    vx, vy, vz = r.x - p.x, r.y - p.y, r.z - p.z
    nx, ny, nz = abs(uy * vz - uz * vy), abs(uz * vx - ux * vz), abs(ux * vy - uy * vx)
    best = 0 if (nx >= ny and nx >= nz) else (1 if ny >= nz else 2)
    found = NO_AREA
    for turn in range(3):
        axis = (best + turn) % 3
        side = orient2d(projected(p, axis), projected(q, axis), projected(r, axis))
        if side == 1 or side == -1:
            return axis
        if side != 0:
            found = UNKNOWN_AXIS
    return found


@kernel
def _find_axes(vertices: Any, triangles: Any, axes: Any) -> None:
    """Fill axes (n,) with the axis of each triangle."""
    for item in range(triangles.shape[0]):
        axes[item] = axis_of(
            as_point3(vertices, triangles[item, 0]),
            as_point3(vertices, triangles[item, 1]),
            as_point3(vertices, triangles[item, 2]),
        )


@inline
def root_of(parent: Any, vertex: int) -> int:
    """Return the representative of a vertex's set, halving the path."""
    while parent[vertex] != vertex:  # bound: parents decrease
        parent[vertex] = parent[parent[vertex]]
        vertex = parent[vertex]
    return vertex


@kernel
def join_vertices(triangles: Any, left_out: Any, parent: Any) -> None:
    """Set parent (n_vertices,) so that vertices connected by triangles not left out have one representative."""
    for vertex in range(parent.shape[0]):
        parent[vertex] = vertex
    for item in range(triangles.shape[0]):
        if left_out[item]:
            continue
        a = root_of(parent, triangles[item, 0])
        for corner in range(1, 3):
            b = root_of(parent, triangles[item, corner])
            if a < b:
                parent[b] = a
            elif b < a:
                parent[a] = b
                a = b
    for vertex in range(parent.shape[0]):
        parent[vertex] = root_of(parent, vertex)
