"""What clearance sees of a body: triangles, and a radius about them. Built once per solid, lazily.

A ball is its centre and its radius; a body of the plane is its edges, in space at z = 0, each a triangle of no area.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.arrays import FloatArray, IntArray, read_only
from engine.bounding.aabb import corners_of_box
from engine.collision.clearance.near_triangles import FACE
from engine.collision.meshes.mesh_arrays import BOX_TRIANGLES, MeshBody, mesh_body_of, mesh_body_of_triangles
from engine.collision.meshes.placement import PoseArrays
from engine.collision.planar.outline_batch import outline_arrays
from engine.collision.result import Feature
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.mesh import Mesh
from engine.solids.sphere import Sphere

BALL: Final = Feature("ball")
_AROUND: Final = (0, 1, 3, 2)
"""Corners of a box of the plane, counted as of one of space, in the order of its outline."""


def spread_of(solid: Solid) -> MeshBody:
    """Return the triangles of a body that is no half-space; of a ball its centre."""
    if solid.dimension == 3 and not isinstance(solid, Sphere):
        return mesh_body_of(solid)
    return solid.prepared("spread", lambda: _built(solid))


def _built(solid: Solid) -> MeshBody:
    points, following = outline_of(solid)[:2]
    vertices = np.zeros((len(points), 3))
    vertices[:, : solid.dimension] = points
    triangles = np.column_stack([np.arange(len(points)), following, following])
    return mesh_body_of_triangles(vertices, triangles, np.arange(len(points)), False)


Outline = tuple[FloatArray, IntArray, float, "_Names"]


def outline_of(solid: Solid) -> Outline:
    """Return the vertices (n, d) of a ball or a body of the plane, for each edge the vertex at its end, the radius, and
    by number the vertices and then the edges as the caller knows them."""
    kept: Outline | None = solid.kept("outline and names")
    return solid.prepared("outline and names", lambda: _outline(solid)) if kept is None else kept


def _outline(solid: Solid) -> Outline:
    if isinstance(solid, Sphere):
        return read_only(solid.center[None]), read_only(np.zeros(1, np.int64)), radius_of(solid), _Names(solid, ())
    vertices, following, _ = outline_arrays(solid)
    return vertices, following, 0.0, _Names(solid, following.tolist())


class _Names(dict[int, Feature]):
    """Of the vertices and edges of an outline; each is named when it is asked for first."""

    def __init__(self, solid: Solid, following: Sequence[int]) -> None:
        self._is_box, self._following = solid.type == "aabb", following

    def __missing__(self, number: int) -> Feature:
        n = len(self._following)
        if not n:
            return BALL
        ends = [number] if number < n else [number - n, self._following[number - n]]
        ends = sorted(_AROUND[end] if self._is_box else end for end in ends)
        self[number] = Feature("vertex" if number < n else "edge", tuple(ends))
        return self[number]


def radius_of(solid: Solid) -> float:
    """Return the radius about the triangles of a body."""
    return float(solid.radius) if isinstance(solid, Sphere) else 0.0


def in_space(rotations: FloatArray, translations: FloatArray) -> PoseArrays:
    """Return poses (n, d, d), (n, d) as poses of space; those of the plane turn about z."""
    n, d = translations.shape
    if d == 3:
        return PoseArrays(read_only(rotations), read_only(translations), True)
    turns, moves = np.zeros((n, 3, 3)), np.zeros((n, 3))
    turns[:, :2, :2], turns[:, 2, 2], moves[:, :2] = rotations, 1.0, translations
    return PoseArrays(read_only(turns), read_only(moves), True)


def feature_of(solid: Solid, mesh: MeshBody, triangle: int, code: int) -> Feature:
    """Return the feature `code` of a triangle (near_triangles.py) as the caller knows it."""
    if isinstance(solid, Sphere):
        return BALL
    face = int(mesh.faces[triangle])
    if code == FACE:
        return Feature("face", (face,))
    corners, vertices = mesh.arrays.triangles[triangle].tolist(), mesh.arrays.vertices
    if isinstance(solid, Mesh) and len(set(corners)) == 3:
        numbers = solid.face_indices[solid.face_offsets[face] : solid.face_offsets[face + 1]].tolist()
        if len(numbers) == 3:  # case: a triangle, its corners in the caller's order
            i, j = numbers[code % 3], numbers[(code + 1) % 3]
            return Feature("vertex", (i,)) if code < 3 else Feature("edge", (min(i, j), max(i, j)))
    numbers, points = _ring(solid, face)
    places = [points.index(vertices[corners[k]].tolist()[: solid.dimension]) for k in (code % 3, (code + 1) % 3)]
    if code < 3 or places[0] == places[1]:
        return Feature("vertex", (named(solid, numbers[places[0]]),))
    if solid.dimension == 3 and abs(places[0] - places[1]) not in (1, len(numbers) - 1):
        return Feature("face", (face,))  # an edge of the triangulation only
    return Feature("edge", tuple(sorted(named(solid, numbers[place]) for place in places)))


def _ring(solid: Solid, face: int) -> tuple[list[int], list[list[float]]]:
    """Return the numbers and the points of the vertices of a face or edge, in order."""
    if isinstance(solid, Mesh):
        indices = solid.face_indices[solid.face_offsets[face] : solid.face_offsets[face + 1]]
        return indices.tolist(), solid.vertices[indices].tolist()
    if isinstance(solid, Aabb) and solid.dimension == 3:
        (a, b, c), (_, _, d) = BOX_TRIANGLES[face].tolist()
        points, numbers = corners_of_box(solid.min, solid.max), [a, b, c, d]
    else:
        points, following = outline_of(solid)[:2]
        numbers = [face, int(following[face])]
    return numbers, points[numbers].tolist()


def named(solid: Solid, number: int) -> int:
    """Return the vertex's number as the caller knows it: a box of the plane counts its corners as one of space."""
    return _AROUND[number] if solid.type == "aabb" and solid.dimension == 2 else number
