"""Sutherland-Hodgman on rationals: contour by contour, one plane after another, a vertex on a plane is inside."""

from __future__ import annotations

from typing import Any

from tests.reference.exact import Vector, along, cross, dot, nearest_double, sub, vector
from tests.reference.solids import Solid, rows, triangles_with_faces, value


def clip_contour(contour: Any, planes: list[Vector]) -> list[Vector]:
    """Return the exact vertices after all planes; vertices that coincide one after another are merged."""
    points = merged([vector(p) for p in contour])
    for row in planes:
        points = merged(_clip_on_plane(points, row))
    return points


def _clip_on_plane(points: list[Vector], row: Vector) -> list[Vector]:
    found = []
    for i, p in enumerate(points):
        r = points[(i + 1) % len(points)]
        at_p, at_r = value(row, p), value(row, r)
        if at_p >= 0:
            found.append(p)
        if at_p * at_r < 0:
            found.append(along(p, r, at_p / (at_p - at_r)))
    return found


def merged(points: list[Vector]) -> list[Vector]:
    """Drop each vertex equal to the one before it, around the ring."""
    kept = [p for i, p in enumerate(points) if p != points[i - 1]]
    return kept or points[:1]


def planes_of(region: Solid) -> list[Vector]:
    """Return the planes in order; of a convex polyhedron one for each face that has some area."""
    if region["type"] != "polyhedron":
        return rows(region)
    found: dict[int, Vector] = {}
    for (a, b, c), face in triangles_with_faces(region):
        normal = tuple(-x for x in cross(sub(b, a), sub(c, a)))  # faces are counter-clockwise from outside
        if any(x != 0 for x in normal):
            found.setdefault(face, (*normal, -dot(normal, a)))
    return list(found.values())


def rounded(points: list[Vector]) -> list[list[float]]:
    return [[nearest_double(x) for x in p] for p in points]


def same_cycle(first: list, second: list) -> bool:
    """Tell whether two rings are equal up to the vertex they start from."""
    return len(first) == len(second) and any(first[i:] + first[:i] == second for i in range(max(1, len(first))))
