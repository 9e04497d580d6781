"""On which sides of a plane the vertices of a mesh lie, from floats, where those prove it."""

from __future__ import annotations

from typing import Any

from engine.collision.meshes.mesh_arrays import MeshArrays
from engine.jit import inline, kernel
from engine.predicates.vectors import as_point3, dot
from engine.types import Point3

_BLOCK = 64
_MANY = 64 * _BLOCK


@inline
def _side(mesh: MeshArrays, vertex: int, plane: Any) -> int:
    """Return 1 or -1 where that is sure, else 0.

    Each weight may be off by 2^-50 of its size, which is no less than the weight, and 2^-1070; the sum of three
    products and a number by 2^-50 of the sum of magnitudes more.
    """
    p = as_point3(mesh.vertices, vertex)
    around = Point3(abs(p.x), abs(p.y), abs(p.z))
    value = dot(as_point3(plane, 0), p) + plane[2, 0]
    size = dot(as_point3(plane, 1), around) + plane[2, 1]
    slack = 2.0**-48 * size + 2.0**-1060 * (around.x + around.y + around.z) + 2.0**-1000
    return int(value > slack) - int(value < -slack)


@kernel
def scan_sides(mesh: MeshArrays, plane: Any, unsure: Any, flag: Any) -> tuple[int, int, int]:
    """Look along the vertices of a mesh until one lies surely beyond a plane and one surely before it.

    plane: (3, 3), the weights of the coordinates; their sizes, which bound their errors; the offset and its size.
    Returns: the first vertex surely beyond, and surely before, -1 where there is none; and how many passed on the way
    are unsure: the first of them are listed in `unsure` (n,) int64. One more than fit there where the flag was raised.
    """
    beyond, before, n_unsure, n = -1, -1, 0, mesh.vertices.shape[0]
    for start in range(0, n, _BLOCK):  # many vertices at once, without branches
        stop, n_beyond, n_before = min(start + _BLOCK, n), 0, 0
        for vertex in range(start, stop):
            side = _side(mesh, vertex, plane)
            n_beyond += side > 0
            n_before += side < 0
        is_sure = n_beyond + n_before == stop - start
        if is_sure and (n_beyond == 0 or beyond >= 0) and (n_before == 0 or before >= 0):
            continue
        for vertex in range(start, stop):
            side = _side(mesh, vertex, plane)
            if side > 0 and beyond < 0:
                beyond = vertex
            elif side < 0 and before < 0:
                before = vertex
            elif side == 0:
                if n_unsure < len(unsure):
                    unsure[n_unsure] = vertex
                n_unsure += 1
            if beyond >= 0 and before >= 0:
                return beyond, before, n_unsure
        if n_unsure > len(unsure) or (start % _MANY == 0 and flag[0] != 0):
            return beyond, before, len(unsure) + 1
    return beyond, before, n_unsure


@kernel
def first_triangle_at(mesh: MeshArrays, vertex: int) -> int:
    """Return the first triangle with a vertex."""
    for triangle in range(mesh.triangles.shape[0]):
        t = triangle
        if mesh.triangles[t, 0] == vertex or mesh.triangles[t, 1] == vertex or mesh.triangles[t, 2] == vertex:
            return triangle
    return -1
