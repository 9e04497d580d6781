"""What collision sees of a body: triangles, their tree, and what is known of each face. Built once per solid, lazily.

A polyhedron and a box are closed shells under even-odd; a surface, and a box that is flat on some axis, have nothing
inside. All arrays are in the body's own coordinates: poses are applied where a query runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine.bounding.bvh import EMPTY, build_bvh
from engine.collision.placement import NO_ROTATION, NO_TRANSLATION, Extent, PoseArrays
from engine.collision.triangle_triangle import Triangle3, projected
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
    """What kernels take; boxes to scale: the tree (`bvh.py`). `state` is filled by kernels as needed: any thread writes
    the same values."""

    vertices: FloatArray
    triangles: IntArray
    axis: npt.NDArray[np.int8]
    state: npt.NDArray[np.int8]
    boxes: npt.NDArray[np.float32]
    child: npt.NDArray[np.int32]
    origin: FloatArray
    scale: float
    extent: Extent


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
            return PoseArrays(NO_ROTATION, NO_TRANSLATION, False)
        return PoseArrays(read_only(pose.rotation[None]), read_only(pose.translation[None]), True)


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
    """Return the shell of checked arrays.

    Triangles and vertices are copied in the order of the tree: the faces near a contact then lie side by side in
    memory, which a large mesh, asked at another place by every pose, needs more than anything else.
    """
    corners = vertices[triangles]
    tree = build_bvh(np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1))
    is_item = (tree.child < 0) & (tree.child != EMPTY)
    order = -1 - tree.child[is_item].astype(np.int64)
    child = tree.child.copy()
    child[is_item] = -1 - np.arange(len(order), dtype=np.int32)
    triangles, faces = triangles[order], faces[order]
    number = np.full(len(vertices), -1, np.int64)
    used = np.empty(len(vertices), np.int64)
    n_used = _renumber(triangles, number, used)
    vertices = np.ascontiguousarray(vertices[used[:n_used]])
    axis = np.empty(len(triangles), np.int8)
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):  # uncompiled runs only
        _find_axes(vertices, triangles, axis)
    parent = np.arange(len(vertices))
    join_vertices(triangles, np.zeros(len(triangles), np.bool_), parent)
    _, first = np.unique(parent[triangles[:, 0]], return_index=True)
    extent = Extent(float(np.abs(vertices).max()), grain_of(vertices))
    state = np.full(len(triangles), STATE_UNKNOWN, np.int8)
    arrays = ShellArrays(
        read_only(vertices),
        read_only(triangles),
        read_only(axis),
        state,
        tree.boxes,
        read_only(child),
        tree.origin,
        tree.scale,
        extent,
    )
    return Shell(arrays, faces, has_inside, np.sort(first), extent.reach, lattice_shift(vertices))


@kernel
def _renumber(triangles: Any, number: Any, used: Any) -> int:
    """Number vertices in the order in which triangles (n, 3) name them, and write that into triangles.

    number (n_vertices,): -1 on entry. Fills used: the old number of each; returns how many there are.
    """
    n_used = 0
    for item in range(triangles.shape[0]):
        for corner in range(3):
            vertex = triangles[item, corner]
            if number[vertex] < 0:
                number[vertex] = n_used
                used[n_used] = vertex
                n_used += 1
            triangles[item, corner] = number[vertex]
    return n_used


def grain_of(values: FloatArray) -> float:
    """Return the largest power of two that divides every value; 1.0 if all are zero."""
    mantissas, exponents = np.frexp(values[values != 0.0])
    if not mantissas.size:
        return 1.0
    whole = np.ldexp(mantissas, 53).astype(np.int64)
    lowest = np.frexp((whole & -whole).astype(np.float64))[1] - 1  # place of the lowest bit set
    return float(np.ldexp(1.0, int((exponents - 53 + lowest).min())))


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


@inline
def triangle_of(shell: ShellArrays, item: int) -> Triangle3:
    """Load a triangle in the body's own coordinates."""
    return Triangle3(
        as_point3(shell.vertices, shell.triangles[item, 0]),
        as_point3(shell.vertices, shell.triangles[item, 1]),
        as_point3(shell.vertices, shell.triangles[item, 2]),
    )


@inline
def in_tree(shell: ShellArrays, p: Point3) -> Point3:
    """Return a point in the coordinates of the body's tree, rounded."""
    return Point3(
        (p.x - shell.origin[0]) / shell.scale,
        (p.y - shell.origin[1]) / shell.scale,
        (p.z - shell.origin[2]) / shell.scale,
    )


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
