"""Collision mesh of a body: triangles, their tree, and the cached state of each face. Built once per solid, lazily.

A polyhedron and a box are closed meshes under even-odd; a surface, and a box that is flat on some axis, have no inside.
All arrays are in the body's own coordinates: poses are applied where a query runs.
"""

from __future__ import annotations

from collections import namedtuple
from dataclasses import dataclass
from math import frexp, ldexp
from typing import Any

import numpy as np

from engine.arrangement.union_find import root_of, unite
from engine.bounding.aabb import corners_of_box, fill_discs
from engine.bounding.bvh import WIDTH, Bvh
from engine.bounding.large_trees import by_range
from engine.bounding.trees import MANY, boxes_of, build_balanced_bvh
from engine.collision.meshes.placement import Extent, PoseArrays
from engine.collision.meshes.triangle_triangle import Facet, facet_at, projected
from engine.compiling.jit import inline, kernel
from engine.lanes.boxes import DISC_ROWS, EMPTY
from engine.lanes.faces import CORNER_ROWS, NOWHERE
from engine.predicates.orientation import orient2d
from engine.predicates.vectors import cross, minus
from engine.solids.base import Solid
from engine.solids.mesh import Mesh, Polyhedron
from engine.solids.pose import Pose
from engine.solids.primitives import Aabb
from engine.types import BoolArray, Float32Array, FloatArray, Int8Array, Int32Array, IntArray, Point3, read_only

NO_AREA = -1
UNKNOWN_AXIS = -2
"""| value of `axis` | meaning |
|---|---|
| 0, 1, 2 | an axis along which the projection has an area |
| NO_AREA | no projection has an area |
| UNKNOWN_AXIS | a predicate was undecided |
"""

STATE_UNKNOWN = -1
STATE_CLEAN = 0
STATE_CROSSED = 1
STATE_STACKED = 2
"""| value of `state` | meaning |
|---|---|
| STATE_UNKNOWN | not computed yet |
| STATE_CLEAN | other faces of the body meet the relative interior in single points at most |
| STATE_CROSSED | another face crosses it along a segment |
| STATE_STACKED | another face of the same plane covers part of it (or this is unsure) |
"""


_HUGE = 2.0**60
"""Size of a disc that separates nothing."""
_PLACE_SECONDS, _TAKE_SECONDS, _FILL_SECONDS = 2e-8, 2e-8, 1.2e-7
"""Time for each triangle, vertex and triangle."""
STILL = PoseArrays(read_only(np.eye(3)[None]), read_only(np.zeros((1, 3))), False)
"""The identity as pose of a body that has none."""


BOX_TRIANGLES = np.array([[(a, b, c), (a, c, d)] for a, b, c, d in
    ([0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6])])  # fmt: skip
"""Two triangles for each face of a box (6, 2, 3), counter-clockwise from outside; vertices as of `corners_of_box`."""


MeshArrays = namedtuple(
    "MeshArrays",
    "vertices triangles axis state inner boxes child blocks discs origin scale sizes extent components faces "
    "first_face has_inside",
)
"""What kernels take; boxes to scale: the tree (`bvh.py`); sizes: by axis the largest |tree coordinate|; blocks, discs:
what its blocks (`lanes/faces.py`) and its inner nodes (`lanes/boxes.py`) hold besides boxes, the rows of the other kind
not set. `state` is filled by kernels as needed, and `inner`, on which side of a face its body lies (`parity.py`), 0
unknown: any thread writes the same values. components: of triangles connected through vertices, one each, ascending.
faces: the caller's face of each triangle; first_face: the least in the first component. has_inside: False for surfaces
and flat boxes."""


@dataclass(frozen=True, slots=True, eq=False)
class MeshBody:
    """Triangles of one body. arrays: input of kernels; shift: k such that every coordinate times 2^k is an integer."""

    arrays: MeshArrays
    shift: int

    @property
    def faces(self) -> IntArray:
        """The caller's face number of each triangle."""
        return self.arrays.faces

    @property
    def has_inside(self) -> bool:
        """False for surfaces and flat boxes, which have no interior."""
        return self.arrays.has_inside

    def posed(self, pose: Pose | None) -> PoseArrays:
        """Return a pose as kernels take it: arrays of one rotation and one translation, `STILL` for None."""
        if pose is None:
            return STILL
        return PoseArrays(pose.rotation[None], pose.translation[None], True)


def mesh_body_of(solid: Solid) -> MeshBody:
    """Return the mesh of a polyhedron, surface or 3D box, built at the first call and cached with the solid."""
    cached: MeshBody | None = solid.cached("mesh_body")
    return solid.prepared("mesh_body", lambda: _built(solid)) if cached is None else cached


def _built(solid: Solid) -> MeshBody:
    if isinstance(solid, Aabb):
        return mesh_body_of_triangles(*_box_triangles(solid), bool((solid.min < solid.max).all()))
    assert isinstance(solid, Mesh)
    given = solid.vertices, solid.triangles, solid.triangle_faces
    return mesh_body_of_triangles(*given, isinstance(solid, Polyhedron))


def mesh_body_of_triangles(
    vertices: FloatArray, triangles: IntArray, faces: IntArray, has_inside: bool, many: int = MANY
) -> MeshBody:
    """Build the mesh of checked vertices (n, 3) and triangles (m, 3), on threads from `many` triangles on. faces (m,):
    the caller's face number of each triangle; has_inside: False for a surface. Triangles and vertices are copied in the
    order of the tree, so that faces near a contact are close in memory; large meshes under many poses depend on it."""
    vertices, triangles, faces = read_only(vertices), read_only(triangles), read_only(faces)
    n_triangles = len(triangles)
    tree = build_balanced_bvh(boxes_of(vertices, triangles), many)
    child, order = np.empty_like(tree.child), np.empty(n_triangles, np.int64)
    ordered, axis = np.empty((n_triangles, 3), np.int64), np.empty(n_triangles, np.int8)
    number, old = np.full(len(vertices), -1, np.int64), np.empty(len(vertices), np.int64)
    components = np.empty(n_triangles, np.int64)

    def place(nodes: slice, first: int) -> None:
        _list_triangles(triangles, tree.child[nodes], first, child[nodes], order, ordered)

    if above := tree.n_above:
        child[:above] = tree.child[:above]
    tree.each(place, _PLACE_SECONDS)
    n_used, n_components, first_face = _number_vertices(ordered, faces, order, number, old, components)
    used, (reach, lowest_bit, shift) = _taken(vertices, old[:n_used])
    blocks, discs, sizes = _rows_of(tree, child, used, ordered, axis)
    arrays = MeshArrays(
        read_only(used), read_only(ordered), read_only(axis), np.full(n_triangles, STATE_UNKNOWN, np.int8),
        np.zeros(n_triangles, np.int8), tree.boxes, read_only(child), read_only(blocks), read_only(discs), tree.origin,
        tree.scale, sizes,
        Extent(reach, ldexp(1.0, lowest_bit)), components[:n_components].copy(), faces[order], first_face, has_inside,
    )  # fmt: skip
    return MeshBody(arrays, shift)


def _rows_of(
    tree: Bvh, child: Int32Array, vertices: FloatArray, triangles: IntArray, axis: Int8Array
) -> tuple[Float32Array, Float32Array, FloatArray]:
    """Return blocks, discs and sizes, see `MeshArrays`, and fill axis (n,). child: of the tree, triangles renumbered.
    Discs of nodes above the parts of a tree are so large that they separate nothing."""
    blocks = np.empty((len(child), CORNER_ROWS, WIDTH), np.float32)
    discs, each = np.empty((len(child), DISC_ROWS, WIDTH), np.float32), []

    def fill(nodes: slice, _: int) -> None:
        own, some, sizes = child[nodes], blocks[nodes], np.zeros(3)
        _fill_blocks(vertices, triangles, own, tree.origin, tree.scale, some, axis, sizes)
        fill_discs(some, own, tree.boxes[nodes], discs[nodes], nodes.start)
        each.append(sizes)

    if above := tree.n_above:
        discs[:above, :3], discs[:above, 3:6], discs[:above, 6:] = tree.boxes[:above, :3], 1.0, _HUGE
    tree.each(fill, _FILL_SECONDS)
    return blocks, discs, np.max(each, axis=0) if len(each) > 1 else each[0]


def _taken(vertices: FloatArray, old: IntArray) -> tuple[FloatArray, tuple[float, int, int]]:
    """Return the rows `old` of vertices (n, 3), and `_lattice_of` them."""
    used, each = np.empty((len(old), 3)), []

    def take(start: int, stop: int) -> None:
        np.take(vertices, old[start:stop], axis=0, out=used[start:stop], mode="clip")
        each.append(_lattice_of(used[start:stop]))

    by_range(take, len(old), _TAKE_SECONDS)
    if len(each) == 1:
        return used, each[0]
    reaches, bits, shifts = zip(*([own for own in each if own[0] > 0.0] or each))
    return used, (max(reaches), min(bits), max(shifts))


@kernel
def _list_triangles(
    triangles: IntArray, given: Int32Array, first: int, child: Int32Array, order: IntArray, ordered: IntArray
) -> None:
    """Renumber the triangles of some nodes of a tree in the order of its leaves, from `first` on.

    given: children of the nodes. Filled: child, the same with leaf entries renumbered; order (n,), the old number of
    each triangle; ordered (n, 3), its vertices."""
    item = first
    for node in range(len(child)):
        for lane in range(WIDTH):
            entry = given[node, lane]
            child[node, lane] = entry
            if entry < 0 and entry != EMPTY:
                child[node, lane], order[item] = -1 - item, -1 - entry
                for corner in range(3):
                    ordered[item, corner] = triangles[-1 - entry, corner]
                item += 1


@kernel
def _number_vertices(
    ordered: IntArray, faces: IntArray, order: IntArray, number: IntArray, old: IntArray, components: IntArray
) -> tuple[int, int, int]:
    """Renumber the vertices of triangles `ordered` (n, 3) by their first use, and list components: the first triangle
    of each set of triangles connected through vertices.

    number (n_vertices,): -1 on entry, scratch. Filled: old (n_vertices,), the old number of each used vertex;
    components (n,). Returns the number of used vertices, that of components, and the least face number (faces, order:
    as of `_list_triangles`) in the component of the first triangle."""
    n_used = n_components = 0
    for item in range(len(ordered)):
        for corner in range(3):
            vertex = ordered[item, corner]
            if number[vertex] < 0:
                number[vertex], old[n_used] = n_used, vertex
                n_used += 1
            ordered[item, corner] = number[vertex]
    parent = number[:n_used]
    _union(ordered, components[:0], parent)
    first_face, last = faces[order[0]], -1
    for item in range(len(ordered)):
        root = parent[ordered[item, 0]]
        if root == 0:
            first_face = min(first_face, faces[order[item]])
        if root > last:  # components begin in the order of their roots, the least of their vertices
            components[n_components], last = item, root
            n_components += 1
    return n_used, n_components, first_face


@kernel
def _fill_blocks(
    vertices: FloatArray, triangles: IntArray, child: Int32Array, origin: FloatArray, scale: float,
    blocks: Float32Array, axis: Int8Array, sizes: FloatArray,
) -> None:  # fmt: skip
    """Fill blocks (n_nodes, 9, 8) at the leaf nodes of a tree with the corners of their triangles (x, y, z of each),
    one triangle a lane, in tree coordinates (p - origin) / scale; `NOWHERE` in unused lanes. axis (n,): filled with
    `axis_of` of these triangles; sizes (3,): zeros, set to the largest |coordinate| by axis."""
    for node in range(child.shape[0]):
        if child[node, 0] >= 0:
            continue
        for lane in range(WIDTH):
            if child[node, lane] == EMPTY:
                blocks[node, :, lane] = NOWHERE
                continue
            item = -1 - child[node, lane]
            axis[item] = axis_of(facet_at(vertices, triangles[item, 0], triangles[item, 1], triangles[item, 2]))
            for corner in range(3):
                vertex = triangles[item, corner]
                for k in range(3):
                    local = (vertices[vertex, k] - origin[k]) / scale
                    blocks[node, 3 * corner + k, lane], sizes[k] = local, max(sizes[k], abs(local))


@kernel
def _lattice_of(vertices: FloatArray) -> tuple[float, int, int]:
    """Return the largest |coordinate|; the largest k such that 2^k divides all coordinates; and some k >= 0 such that
    every coordinate times 2^k is an integer. All are 0 if all coordinates are."""
    reach, lowest, smallest = 0.0, 2000, 2000
    for vertex in range(vertices.shape[0]):
        for k in range(3):
            value = abs(vertices[vertex, k])
            if value == 0.0:
                continue
            reach = max(reach, value)
            mantissa, exponent = frexp(value)
            whole = int(mantissa * 2.0**53)
            smallest = min(smallest, exponent)
            lowest = min(lowest, exponent - 54 + frexp(float(whole & -whole))[1])
    if smallest == 2000:
        return 0.0, 0, 0
    return reach, lowest, max(0, 53 - smallest)


def lattice_shift(values: FloatArray) -> int:
    """Return some k >= 0 such that every value times 2^k is an integer."""
    exponents = np.frexp(values[values != 0.0])[1]
    return max(0, 53 - int(exponents.min())) if exponents.size else 0


def _box_triangles(box: Aabb) -> tuple[FloatArray, IntArray, IntArray]:
    """Return vertices, triangles and the face number of each triangle (xmin, xmax, ymin, ymax, zmin, zmax) of a box. A
    flat box has the triangles of one face."""
    flat, corners = box.min == box.max, corners_of_box(box.min, box.max)
    faces = np.arange(6)
    if not flat.any():
        return corners, BOX_TRIANGLES.reshape(-1, 3), np.repeat(faces, 2)
    # the two faces across a flat axis are one: unchanged; a segment or point: any face will do
    faces = faces[2 * int(np.argmax(flat)) :][:1]
    _, first, merged = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    return corners, first[merged.reshape(-1)][BOX_TRIANGLES[faces].reshape(-1, 3)], np.repeat(faces, 2)


@inline
def axis_of(t: Facet) -> int:
    """Return an axis (0, 1, 2) along which the projection of a triangle has an area; NO_AREA if there is none,
    UNKNOWN_AXIS if a sign is undecided."""
    n = cross(minus(t.q, t.p), minus(t.r, t.p))
    x, y, z = abs(n.x), abs(n.y), abs(n.z)
    best = 0 if (x >= y and x >= z) else (1 if y >= z else 2)
    result = NO_AREA
    for turn in range(3):
        axis = (best + turn) % 3
        side = orient2d(projected(t.p, axis), projected(t.q, axis), projected(t.r, axis))
        if side == 1 or side == -1:
            return axis
        if side != 0:
            result = UNKNOWN_AXIS
    return result


@inline
def triangle_of(mesh: MeshArrays, item: int) -> Facet:
    """Return triangle ``item`` of a mesh in the body's own coordinates."""
    t = mesh.triangles
    return facet_at(mesh.vertices, t[item, 0], t[item, 1], t[item, 2])


@inline
def in_tree(mesh: MeshArrays, p: Point3) -> Point3:
    """Return a point in the coordinates of a mesh's tree, (p - origin) / scale, rounded; p: in the body's own
    coordinates."""
    o, scale = mesh.origin, mesh.scale
    return Point3((p.x - o[0]) / scale, (p.y - o[1]) / scale, (p.z - o[2]) / scale)


@kernel
def join_vertices(triangles: IntArray, left_out: BoolArray, parent: IntArray) -> None:
    """Set parent (n_vertices,) to one representative vertex, the least, for all vertices connected by triangles (m, 3)
    that are not left out, left_out (m,) being False, or (0,) where none is."""
    _union(triangles, left_out, parent)


@inline
def _union(triangles: IntArray, left_out: Any, parent: IntArray) -> None:
    for vertex in range(parent.shape[0]):
        parent[vertex] = vertex
    for item in range(triangles.shape[0]):
        if len(left_out) > 0 and left_out[item]:
            continue
        for corner in range(1, 3):
            unite(parent, triangles[item, 0], triangles[item, corner])
    for vertex in range(parent.shape[0]):
        parent[vertex] = root_of(parent, vertex)
