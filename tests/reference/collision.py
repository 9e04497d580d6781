"""The relation of two bodies, from the five lines of the definition, each tested on its own."""

from __future__ import annotations

from itertools import combinations, pairwise
from typing import Any

from tests.reference.contact import (
    boxes_meet,
    planar_overlap,
    segments_meet,
    squared_distance_to_segment,
    squared_distance_to_triangle,
    triangles_meet,
)
from tests.reference.containment import locate_by_edges, locate_by_triangles
from tests.reference.exact import Q, Vector, cross, dot, q, sign, square, sub
from tests.reference.solids import Solid, dimension, edges, image, rows, triangles, value
from tests.reference.sweep import (
    interiors_meet_in_plane,
    interiors_meet_in_space,
    parities_in_plane,
    parities_in_space,
)

DISJOINT, FIRST_INSIDE_SECOND, SECOND_INSIDE_FIRST, OVERLAPPING, TOUCHING = range(5)
SWAPPED = (DISJOINT, SECOND_INSIDE_FIRST, FIRST_INSIDE_SECOND, OVERLAPPING, TOUCHING)


def relation(first: Solid, second: Solid, first_pose: Solid | None = None, second_pose: Solid | None = None) -> int:
    """Return the relation of two bodies, each with its pose or None; two equal poses count as none."""
    if first_pose == second_pose:
        first_pose = second_pose = None
    order = ("half_space", "sphere")
    kinds = [order.index(s["type"]) if s["type"] in order else 2 for s in (first, second)]
    if kinds[0] > kinds[1]:
        return SWAPPED[relation(second, first, second_pose, first_pose)]
    if kinds == [0, 0]:
        return _half_spaces(rows(first, first_pose)[0], rows(second, second_pose)[0])
    if kinds[0] == 0:
        row = rows(first, first_pose)[0]
        return (
            _half_space_sphere(row, *_ball(second, second_pose))
            if kinds[1] == 1
            else _half_space_body(row, _faces(second, second_pose), dimension(second), second["type"] == "surface")
        )
    if kinds == [1, 1]:
        return _spheres(*_ball(first, first_pose), *_ball(second, second_pose))
    if kinds[0] == 1:
        return _sphere_body(*_ball(first, first_pose), second, second_pose)
    return _bodies(first, second, first_pose, second_pose)


def _ball(solid: Solid, pose: Solid | None) -> tuple[Vector, Q]:
    return image(solid["center"], pose), q(solid["radius"])


def _faces(solid: Solid, pose: Solid | None) -> list[Any]:
    """Return edges in the plane, triangles in space."""
    return edges(solid, pose) if dimension(solid) == 2 else triangles(solid, pose)


def _points(faces: list[Any]) -> list[Vector]:
    return sorted({p for face in faces for p in face})


def _locate(p: Vector, faces: list[Any], is_surface: bool) -> int:
    """Return the location; of a surface only for points known to lie on no face of it."""
    if is_surface:
        return -1
    return locate_by_edges(p, faces) if len(p) == 2 else locate_by_triangles(p, faces)


def are_disjoint(
    first: Solid, second: Solid, first_pose: Solid | None = None, second_pose: Solid | None = None
) -> bool:
    """Tell whether two bodies have no common point, without asking whether interiors meet where faces do."""
    if first_pose == second_pose:
        first_pose = second_pose = None
    if {first["type"], second["type"]} & {"half_space", "sphere"}:
        return relation(first, second, first_pose, second_pose) == DISJOINT
    return _where_no_faces_meet(first, second, _faces(first, first_pose), _faces(second, second_pose)) == DISJOINT


def _is_surface(solid: Solid) -> bool:
    return solid["type"] == "surface" or (solid["type"] == "triangle" and dimension(solid) == 3)


def _where_no_faces_meet(first: Solid, second: Solid, a: list[Any], b: list[Any]) -> int | None:
    """Return the relation of two bodies with faces, None where these meet, or parts of one are in the other."""
    meet = segments_meet if dimension(first) == 2 else triangles_meet
    if any(boxes_meet(one, other) and meet(one, other) for one in a for other in b):
        return None
    a_in_b = [_locate(p, b, _is_surface(second)) > 0 for p in _points(a)]
    b_in_a = [_locate(p, a, _is_surface(first)) > 0 for p in _points(b)]
    if not any(a_in_b) and not any(b_in_a):
        return DISJOINT
    if all(a_in_b) and not any(b_in_a):
        return FIRST_INSIDE_SECOND
    return SECOND_INSIDE_FIRST if all(b_in_a) and not any(a_in_b) else None


def _bodies(first: Solid, second: Solid, first_pose: Solid | None, second_pose: Solid | None) -> int:
    a, b = _faces(first, first_pose), _faces(second, second_pose)
    found = _where_no_faces_meet(first, second, a, b)
    if found is not None:
        return found
    interiors_meet = interiors_meet_in_plane if dimension(first) == 2 else interiors_meet_in_space
    has_interiors = not _is_surface(first) and not _is_surface(second)
    return OVERLAPPING if has_interiors and interiors_meet(a, b) else TOUCHING


def detail(
    first: Solid, second: Solid, first_pose: Solid | None = None, second_pose: Solid | None = None
) -> str | None:
    """Return the name of the relation of RCC-8 of two bodies with faces, None where one has no interior."""
    if first_pose == second_pose:
        first_pose = second_pose = None
    a, b = _faces(first, first_pose), _faces(second, second_pose)
    planar = dimension(first) == 2
    parities, meet = (parities_in_plane, segments_meet) if planar else (parities_in_space, triangles_meet)
    if not parities(a, a) or not parities(b, b):
        return None
    found = parities(a, b)
    boundaries_meet = any(boxes_meet(one, other) and meet(one, other) for one in a for other in b)
    if (1, 1) not in found:
        return "EC" if boundaries_meet or relation(first, second, first_pose, second_pose) != DISJOINT else "DC"
    if (1, 0) in found and (0, 1) in found:
        return "PO"
    if (1, 0) not in found and (0, 1) not in found:
        return "EQ"
    return ("T" if boundaries_meet else "NT") + ("PPi" if (1, 0) in found else "PP")


def _half_spaces(first: Vector, second: Vector) -> int:
    (*n, c), (*m, d) = first, second
    parallel = all(x == 0 for x in cross(tuple(n), tuple(m)))
    if not parallel:
        return OVERLAPPING
    along, k = dot(tuple(n), tuple(m)), next(k for k in range(len(n)) if n[k] != 0)
    ratio = abs(m[k] / n[k])  # |m| / |n|
    if along > 0:
        order = sign(d - c * ratio)  # the second reaches further out where its offset is larger
        return FIRST_INSIDE_SECOND if order > 0 else SECOND_INSIDE_FIRST if order < 0 else OVERLAPPING
    gap = sign(d + c * ratio)
    return OVERLAPPING if gap > 0 else DISJOINT if gap < 0 else TOUCHING


def _half_space_sphere(row: Vector, center: Vector, radius: Q) -> int:
    height = value(row, center)
    beyond = sign(height * height - radius * radius * square(row[:-1]))
    if height < 0 and beyond > 0:
        return DISJOINT
    if height > 0 and beyond > 0:
        return SECOND_INSIDE_FIRST
    if radius > 0 and (height >= 0 or beyond < 0):
        return OVERLAPPING
    return TOUCHING


def _half_space_body(row: Vector, faces: list[Any], n: int, is_surface: bool) -> int:
    heights = [sign(value(row, p)) for p in _points(faces)]
    if max(heights) < 0:
        return DISJOINT
    if min(heights) > 0:
        return SECOND_INSIDE_FIRST
    if not is_surface and _meets_half_space(row, faces, n):
        return OVERLAPPING
    return TOUCHING


def _meets_half_space(row: Vector, faces: list[Any], n: int) -> bool:
    """Tell whether an open half-space meets the open interior: it is replaced by a prism that is large enough."""
    points = _points(faces)
    normal = row[:-1]
    foot = tuple(-x * row[-1] / square(normal) for x in normal)
    reach = 1 + sum((abs(x - y) for p in points for x, y in zip(p, foot, strict=True)), Q(0))
    axes = _frame(normal)

    def corner(*steps: int) -> Vector:
        return tuple(foot[k] + reach * sum(s * axis[k] for s, axis in zip(steps, axes, strict=True)) for k in range(n))

    if n == 2:
        ring = [corner(0, -1), corner(1, -1), corner(1, 1), corner(0, 1)]
        return interiors_meet_in_plane([(ring[k - 1], ring[k]) for k in range(4)], faces)
    corners = [corner(u, v, w) for u in (0, 1) for v in (-1, 1) for w in (-1, 1)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    prism = [tuple(corners[f[j]] for j in part) for f in quads for part in ((0, 1, 2), (0, 2, 3))]
    return interiors_meet_in_space(prism, faces)  # type: ignore[arg-type]


def _frame(normal: Vector) -> list[Vector]:
    """Return `normal` and vectors square to it and to each other, each with a largest component of at least 1."""

    def stretched(v: Vector) -> Vector:
        return tuple(x / max(abs(y) for y in v) for x in v)

    if len(normal) == 2:
        return [stretched(normal), stretched((-normal[1], normal[0]))]
    axis = min(range(3), key=lambda k: abs(normal[k]))
    second = cross(normal, tuple(Q(k == axis) for k in range(3)))
    return [stretched(normal), stretched(second), stretched(cross(normal, second))]


def _spheres(center: Vector, radius: Q, other: Vector, other_radius: Q) -> int:
    gap = square(sub(center, other))
    if gap > (radius + other_radius) ** 2:
        return DISJOINT
    if other_radius > radius and gap < (other_radius - radius) ** 2:
        return FIRST_INSIDE_SECOND
    if radius > other_radius and gap < (other_radius - radius) ** 2:
        return SECOND_INSIDE_FIRST
    if radius > 0 and other_radius > 0 and gap < (radius + other_radius) ** 2:
        return OVERLAPPING
    return TOUCHING


def _sphere_body(center: Vector, radius: Q, solid: Solid, pose: Solid | None) -> int:
    faces = _faces(solid, pose)
    is_surface = solid["type"] == "surface"
    planar = len(center) == 2
    distance = squared_distance_to_segment if planar else lambda p, *face: squared_distance_to_triangle(p, face)
    nearest = min(distance(center, *face) for face in faces)
    location = 0 if nearest == 0 else _locate(center, faces, is_surface)
    if location < 0 and nearest > radius * radius:
        return DISJOINT
    if location > 0 and nearest > radius * radius:
        return FIRST_INSIDE_SECOND
    if all(square(sub(p, center)) < radius * radius for p in _points(faces)):
        return SECOND_INSIDE_FIRST
    if is_surface or radius == 0:
        return TOUCHING
    if location > 0:
        return OVERLAPPING
    walls = _odd_pieces(faces) if planar else _walls(faces)
    if walls and min(distance(center, *face) for face in walls) < radius * radius:
        return OVERLAPPING
    if location == 0:  # on a wall that cancels, so deep that nothing else is near: any point off that wall decides
        for k in range(2, 3 * len(faces) + 3):
            step = radius / 2 / k
            near = _locate(tuple(x + step / k**i for i, x in enumerate(center)), faces, is_surface)
            if near != 0:
                return OVERLAPPING if near > 0 else TOUCHING
    return TOUCHING


def _odd_pieces(segments: list[tuple[Vector, Vector]]) -> list[tuple[Vector, Vector]]:
    """Return the pieces of edges of the plane that an odd number of edges covers: those that bound the interior."""
    found = []
    for a, b in segments:
        if a == b:
            continue
        line = [s for s in segments if s[0] != s[1] and all(cross(sub(b, a), sub(p, a))[0] == 0 for p in s)]
        cuts = sorted({p for s in line for p in s if min(a, b) <= p <= max(a, b)})
        for start, end in pairwise(cuts):
            if sum(min(s) <= start and end <= max(s) for s in line) % 2 == 1:
                found.append((start, end))
    return found


def _walls(faces: list[Any]) -> list[Any]:
    """Return the faces of some area, all of which bound the interior as long as no two overlap in a plane."""
    solid = [face for face in faces if square(cross(sub(face[1], face[0]), sub(face[2], face[0]))) != 0]
    if any(boxes_meet(one, other) and planar_overlap(one, other) for one, other in combinations(solid, 2)):
        raise NotImplementedError("a sphere against faces that overlap in a plane")
    return solid
