"""Small JSON solids used by several tests."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

Solid = dict[str, Any]


def box(low: Sequence[float], high: Sequence[float]) -> Solid:
    """Return a box of space as a polyhedron of twelve triangles, counter-clockwise seen from outside."""
    vertices = [[(high if i >> k & 1 else low)[k] for k in range(3)] for i in range(8)]
    quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    return {"type": "polyhedron", "vertices": vertices, "faces": cut_quads(quads)}


def cut_quads(quads: Iterable[Sequence[int]]) -> list[list[int]]:
    return [[f[0], f[j], f[j + 1]] for f in quads for j in range(1, len(f) - 1)]


def union_of(*solids: Solid) -> Solid:
    """Return the polyhedron that has the faces of all, under even-odd."""
    vertices: list[Any] = []
    faces: list[list[int]] = []
    for solid in solids:
        faces += [[i + len(vertices) for i in face] for face in solid["faces"]]
        vertices += solid["vertices"]
    return {"type": "polyhedron", "vertices": vertices, "faces": faces}


def reversed_faces(solid: Solid) -> Solid:
    return {**solid, "faces": [face[::-1] for face in solid["faces"]]}


def tetrahedron(*vertices: Sequence[float]) -> Solid:
    """Return the polyhedron on four vertices; the orientation is as given, possibly inside out."""
    faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    return {"type": "polyhedron", "vertices": [list(v) for v in vertices], "faces": faces}


def polygon(*rings: Sequence[Sequence[float]]) -> Solid:
    return {"type": "polygon", "rings": [[list(p) for p in ring] for ring in rings]}


def rectangle(low: Sequence[float], high: Sequence[float]) -> Solid:
    return polygon([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])


def sphere(center: Sequence[float], radius: float) -> Solid:
    return {"type": "sphere", "center": list(center), "radius": radius}


def half_space(normal: Sequence[float], offset: float) -> Solid:
    return {"type": "half_space", "normal": list(normal), "offset": offset}


def aabb(low: Sequence[float], high: Sequence[float]) -> Solid:
    return {"type": "aabb", "min": list(low), "max": list(high)}
