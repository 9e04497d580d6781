"""What a search for nearest points reads of a mesh, in one argument; and the caller's names of its features."""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final, NamedTuple

import numpy as np

from engine.bounding.aabb import corners_of_box
from engine.bounding.bvh import WIDTH
from engine.collision.meshes.mesh_arrays import BOX_TRIANGLES, MeshArrays
from engine.collision.meshes.near_triangles import FACE
from engine.collision.meshes.placement import PoseArrays
from engine.compiling.jit import inline, kernel, merged
from engine.distance.spreads import AROUND, outline_of
from engine.lanes.boxes import BOX_ROWS
from engine.lanes.faces import CORNER_ROWS
from engine.lanes.lanes import array_at
from engine.solids.mesh import Mesh
from engine.solids.primitives import Triangle
from engine.types import FlagArray, Int8Array, IntArray, Point3, read_only

PointMesh = namedtuple("PointMesh", "vertices triangles axis faces boxes child blocks origin scale reach")
"""What a search reads of a mesh, as in `MeshArrays`; reach: of its extent."""
N_WORDS: Final = 11


def words_of_mesh(mesh: MeshArrays) -> tuple[IntArray, Any]:
    """Return a `PointMesh` as N_WORDS addresses and sizes, and the arrays whose addresses are in it."""
    numbers = np.array([*mesh.origin, mesh.scale, mesh.extent.reach])
    arrays = mesh.vertices, mesh.triangles, mesh.axis, mesh.faces, mesh.boxes, mesh.child, mesh.blocks, numbers
    sizes = len(mesh.vertices), len(mesh.triangles), len(mesh.child)
    return np.array([*(array.ctypes.data for array in arrays), *sizes]), arrays


@merged
def mesh_at(address: int) -> PointMesh:
    """Return the `PointMesh` of the words at an address."""
    w = array_at(address, (N_WORDS,), np.int64)
    n, m, numbers = w[9], w[10], array_at(w[7], (5,), np.float64)
    return PointMesh(
        array_at(w[0], (w[8], 3), np.float64), array_at(w[1], (n, 3), np.int64), array_at(w[2], (n,), np.int8),
        array_at(w[3], (n,), np.int64), array_at(w[4], (m, BOX_ROWS, WIDTH), np.float32),
        array_at(w[5], (m, WIDTH), np.int32), array_at(w[6], (m, CORNER_ROWS, WIDTH), np.float32),
        Point3(numbers[0], numbers[1], numbers[2]), numbers[3], numbers[4],
    )  # fmt: skip


@merged
def pose_at(address: int, is_posed: bool) -> PoseArrays:
    """Return a pose from the address of its rotation, by rows, and translation."""
    rotations, translations = array_at(address, (1, 3, 3), np.float64), array_at(address + 72, (1, 3), np.float64)
    return PoseArrays(rotations, translations, is_posed)


VERTEX, EDGE, WITHIN_FACE, OTHER, NOWHERE = range(5)
KINDS: Final = ("vertex", "edge", "face", "", "inside")
"""Names of features by code; OTHER: the surface of a ball, a plane; NOWHERE: the point itself lies in the solid."""
_MOST_NAMED: Final = 1 << 14
"""Most polygonal faces whose corners are named together; of more only those that are asked for."""


class Features(NamedTuple):
    """What nearest points lie on: face (n,) and numbers (n, 2), filled with -1, kind (n,) with NOWHERE."""

    face: IntArray
    kind: Int8Array
    numbers: IntArray


class CornerNames(NamedTuple):
    """The caller's number of each corner (m, 3) of the triangles of a body, of several vertices of a face at one
    position the first; are_inner (m,): as bits, the sides that are edges of the triangulation only."""

    numbers: IntArray
    are_inner: FlagArray


def corner_names(solid: Any, mesh: MeshArrays) -> CornerNames | None:
    """Return the names of the corners of a solid's mesh; None where `feature_of` has to find each."""
    faces, none = mesh.faces, read_only(np.zeros(len(mesh.faces), np.uint8))
    if solid.type == "lines":
        return CornerNames(read_only(solid.edges[faces][:, [0, 1, 1]]), none)
    if solid.dimension == 2:
        points, following = outline_of(solid)[:2]
        ends = np.where((points[faces] == points[following[faces]]).all(axis=1), faces, following[faces])
        numbers = np.stack([faces, ends, ends], axis=1)
        return CornerNames(read_only(AROUND[numbers] if solid.type == "aabb" else numbers), none)
    if isinstance(solid, Triangle):
        return CornerNames(read_only(np.arange(3)[None]), none)
    if isinstance(solid, Mesh) and len(solid.face_indices) == 3 * len(solid.triangles):
        return CornerNames(read_only(solid.face_indices.reshape(-1, 3)[faces]), none)
    if len(faces) > _MOST_NAMED:
        return None
    if isinstance(solid, Mesh):
        rings, offsets, points = solid.face_indices, solid.face_offsets, solid.vertices
    else:
        rings, offsets = BOX_TRIANGLES.reshape(6, 6)[:, [0, 1, 2, 5]].ravel(), np.arange(0, 25, 4)
        points = corners_of_box(solid.min, solid.max)
    own = np.column_stack([np.repeat(np.arange(len(offsets) - 1), np.diff(offsets)), points[rings]])
    corners = np.column_stack([np.repeat(faces, 3), mesh.vertices[mesh.triangles.ravel()]])
    _, first, place = np.unique(np.concatenate([own, corners]) + 0.0, axis=0, return_index=True, return_inverse=True)
    at = first[place.ravel()[len(own) :]].reshape(-1, 3)  # of equal rows the first is one of a ring
    steps, sizes = abs(at - np.roll(at, -1, axis=1)), np.diff(offsets)[faces, None]
    are_inner = ((steps > 1) & (steps != sizes - 1)) @ np.array([1, 2, 4])
    return CornerNames(read_only(rings[at]), read_only(are_inner.astype(np.uint8)))


@inline
def write_feature(face: int, code: int, corners: Any, inner: int, row: int, features: Features) -> None:
    """Write the feature with code `code` of a triangle of `face` to a row. corners: the numbers of its corners; an edge
    between two corners of one number is a vertex; inner: as `CornerNames.are_inner`."""
    i, j = corners[code % 3], corners[(code + 1) % 3]
    features.face[row] = face
    if code < 3 or (code < FACE and i == j):
        features.kind[row], features.numbers[row, 0] = VERTEX, i
    elif code == FACE or inner >> (code - 3) & 1:
        features.kind[row], features.numbers[row, 0] = WITHIN_FACE, face
    else:
        features.kind[row], features.numbers[row, 0], features.numbers[row, 1] = EDGE, min(i, j), max(i, j)


@kernel
def fill_features(codes: IntArray, faces: IntArray, names: CornerNames, features: Features) -> None:
    """Fill features with codes (n, 2), triangles and codes of features, but for rows whose second code is -1. faces
    (m,): by triangle the caller's number."""
    for row in range(codes.shape[0]):
        triangle, code = codes[row]
        if code >= 0:
            write_feature(faces[triangle], code, names.numbers[triangle], names.are_inner[triangle], row, features)
