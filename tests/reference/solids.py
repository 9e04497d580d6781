"""Reads a JSON solid into exact numbers, maps it by a pose, and cuts it into the simplices of its boundary."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from tests.reference.exact import Q, Vector, add, cross, dot, q, sign, solve, sub, vector

Solid = dict[str, Any]


def dimension(solid: Solid) -> int:
    """Return 2 or 3."""
    match solid["type"]:
        case "half_space":
            return len(solid["normal"])
        case "sphere":
            return len(solid["center"])
        case "aabb":
            return len(solid["min"])
        case "convex":
            return len(solid["planes"][0]) - 1
        case "triangle":
            return len(solid["vertices"][0])
        case "polygon":
            return 2
        case "implicit":
            return len(solid["terms"][0]["powers"])
        case "csg":
            return dimension(solid["operands"][0])
    return 3


def image(point: Vector, pose: Solid | None) -> Vector:
    """Return R p + t."""
    point = vector(point)
    if pose is None:
        return point
    rotated = tuple(dot(vector(row), point) for row in pose["rotation"])
    return add(rotated, vector(pose["translation"]))


def preimage(point: Vector, pose: Solid | None) -> Vector:
    """Return the p with R p + t = point."""
    if pose is None:
        return vector(point)
    found = solve([vector(row) for row in pose["rotation"]], sub(vector(point), vector(pose["translation"])))
    assert found is not None
    return found


def posed_row(row: Vector, pose: Solid | None) -> Vector:
    """Return the row of the image of the half-space dot(n, p) + d >= 0: n R^-1 and d - n R^-1 t."""
    *normal, offset = vector(row)
    if pose is None:
        return (*normal, offset)
    rotation = [vector(line) for line in pose["rotation"]]
    turned = solve(list(zip(*rotation, strict=True)), tuple(normal))  # R^T m = n
    assert turned is not None
    return (*turned, offset - dot(turned, vector(pose["translation"])))


def rows(solid: Solid, pose: Solid | None = None) -> list[Vector]:
    """Return the planes (inward, >= 0) of a half-space, box or convex solid, boxes as xmin, xmax, ymin, ymax, ..."""
    if solid["type"] == "half_space":
        found = [(*vector(solid["normal"]), q(solid["offset"]))]
    elif solid["type"] == "convex":
        found = [vector(row) for row in solid["planes"]]
    else:
        found, n = [], len(solid["min"])
        for axis in range(n):
            unit = tuple(Q(axis == k) for k in range(n))
            found.append((*unit, -q(solid["min"][axis])))
            found.append((*(-x for x in unit), q(solid["max"][axis])))
    return [posed_row(row, pose) for row in found]


def value(row: Vector, point: Vector) -> Q:
    """Return dot(n, p) + d of the row (n, d)."""
    return dot(row[:-1], point) + row[-1]


def rings(solid: Solid, pose: Solid | None = None) -> list[list[Vector]]:
    """Return the rings of a planar polygon, triangle or box, a repeated last vertex dropped."""
    if solid["type"] == "aabb":
        (x, y), (X, Y) = solid["min"], solid["max"]
        found = [[(x, y), (X, y), (X, Y), (x, Y)]]
    elif solid["type"] == "triangle":
        found = [solid["vertices"]]
    else:
        found = solid["rings"]
    exact = [[image(point, pose) for point in ring] for ring in found]
    return [ring[:-1] if ring[0] == ring[-1] and len(ring) > 1 else ring for ring in exact]


def edges(solid: Solid, pose: Solid | None = None) -> list[tuple[Vector, Vector]]:
    """Return the edges of a planar solid's rings."""
    return [pair for ring in rings(solid, pose) for pair in pairwise([*ring, ring[0]])]


BOX_FACES = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
"""Faces of a box whose vertex i has max on axis k where bit k of i is set: xmin, xmax, ymin, ymax, zmin, zmax."""


def triangles(solid: Solid, pose: Solid | None = None) -> list[tuple[Vector, Vector, Vector]]:
    """Return the boundary triangles of a polyhedron, surface, box or triangle in space."""
    return [triangle for triangle, _ in triangles_with_faces(solid, pose)]


def triangles_with_faces(solid: Solid, pose: Solid | None = None) -> list[tuple[tuple[Vector, Vector, Vector], int]]:
    """Return each boundary triangle with the index of the caller's face it belongs to."""
    if solid["type"] == "aabb":
        low, high = vector(solid["min"]), vector(solid["max"])
        points = [tuple((high if i >> k & 1 else low)[k] for k in range(3)) for i in range(8)]
        cut = [((f[0], f[j], f[j + 1]), i) for i, f in enumerate(BOX_FACES) for j in (1, 2)]
    elif solid["type"] == "triangle":
        points, cut = [vector(p) for p in solid["vertices"]], [((0, 1, 2), 0)]
    else:
        points = [vector(p) for p in solid["vertices"]]
        cut = [(part, i) for i, face in enumerate(solid["faces"]) for part in cut_face(points, list(face))]
    posed = [image(point, pose) for point in points]
    return [(tuple(posed[i] for i in part), face) for part, face in cut]  # type: ignore[misc]


def cut_face(points: list[Vector], face: list[int]) -> list[tuple[int, int, int]]:
    """Cut a polygonal face into triangles: repeatedly the first strictly convex empty ear from its first vertex.

    The orientation is that of the projection along the axis of largest area; an ear is empty when no other vertex of
    what remains lies in its closed triangle, save at the coordinates of the ear's own corners.
    """
    if len(face) == 3:
        return [(face[0], face[1], face[2])]
    normal = [Q(0)] * 3
    for a, b in pairwise([*face, face[0]]):
        normal = [x + y for x, y in zip(normal, cross(points[a], points[b]), strict=True)]
    axis = max(range(3), key=lambda k: abs(normal[k]))
    flat = {i: tuple(points[i][k] for k in ((axis + 1) % 3, (axis + 2) % 3)) for i in face}
    turn = sign(normal[axis])
    found, left = [], list(face)
    while len(left) > 3:
        for j in range(len(left)):
            a, b, c = left[j - 1], left[j], left[(j + 1) % len(left)]
            if _is_ear(flat, left, a, b, c, turn):
                break
        else:
            raise ValueError("face not simple")
        found.append((a, b, c))
        del left[j]
    return [*found, (left[0], left[1], left[2])]


def _is_ear(flat: dict[int, Vector], left: list[int], a: int, b: int, c: int, turn: int) -> bool:
    def side(p: Vector, r: Vector, s: Vector) -> int:
        return turn * sign(cross(sub(r, p), sub(s, p))[0])

    corners = (flat[a], flat[b], flat[c])
    if side(*corners) <= 0:
        return False
    for other in left:
        p = flat[other]
        if other not in (a, b, c) and p not in corners:
            if all(side(corners[k], corners[(k + 1) % 3], p) >= 0 for k in range(3)):
                return False
    return True
