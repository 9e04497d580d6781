"""Whether the open interiors of two even-odd bodies meet: every cell of their common subdivision is sampled.

In space a plane x = const is put between any two consecutive x at which the subdivision can have a vertex: a vertex of
a face, a crossing of two edges or of an edge and a face, or a common point of three faces. What it cuts out is planar;
the same is done there with lines y = const, and on the line with points. An open set that is not empty has an extent
in x between two vertices of its boundary, so some sample falls into it. No location test is used: parity is counted
along the line.
"""

from __future__ import annotations

from itertools import combinations, pairwise

from tests.reference.contact import Segment, Triangle, boxes_meet, crossing_of_lines, part_in_triangle, sides
from tests.reference.exact import Q, Vector, along, cross, dot, solve, square, sub


def interiors_meet_in_space(first: list[Triangle], second: list[Triangle]) -> bool:
    """Tell whether the open interiors of two closed triangle sets meet."""
    first, second = [_with_area(faces) for faces in (first, second)]
    if not first or not second:
        return False
    low, high = _common_range(first, second, 0)
    cuts = sorted({x for x in _critical(first + second) if low <= x <= high} | {low, high}) if low < high else []
    for left, right in pairwise(cuts):
        x = (left + right) / 2
        if interiors_meet_in_plane(_slice(first, x), _slice(second, x)):
            return True
    return False


def parities_in_space(first: list[Triangle], second: list[Triangle]) -> set[tuple[int, int]]:
    """Return the parities (in the first, in the second) that some open set has, outside of both aside."""
    first, second = [_with_area(faces) for faces in (first, second)]
    found: set[tuple[int, int]] = set()
    for left, right in pairwise(sorted(_critical(first + second))):
        x = (left + right) / 2
        found |= parities_in_plane(_slice(first, x), _slice(second, x))
    return found - {(0, 0)}


def parities_in_plane(first: list[Segment], second: list[Segment]) -> set[tuple[int, int]]:
    """Return the same for two closed edge sets of the plane."""
    first, second = [[s for s in edges if s[0] != s[1]] for edges in (first, second)]
    cuts = {p[0] for edge in first + second for p in edge}
    for one, other in combinations(first + second, 2):
        point = crossing_of_lines(one, other)
        if point is not None:
            cuts.add(point[0])
    found: set[tuple[int, int]] = set()
    for left, right in pairwise(sorted(cuts)):
        found |= _parities_on_line(first, second, (left + right) / 2)
    return found - {(0, 0)}


def _with_area(faces: list[Triangle]) -> list[Triangle]:
    return [face for face in faces if square(cross(sub(face[1], face[0]), sub(face[2], face[0]))) != 0]


def _common_range(first: list, second: list, axis: int) -> tuple[Q, Q]:
    ends = [[p[axis] for face in faces for p in face] for faces in (first, second)]
    return max(min(ends[0]), min(ends[1])), min(max(ends[0]), max(ends[1]))


def _critical(faces: list[Triangle]) -> set[Q]:
    """Return the x of every point that may be a vertex of the subdivision by `faces`."""
    found = {p[0] for face in faces for p in face}
    for one, other in combinations(faces, 2):
        if boxes_meet(one, other):
            for triangle, against in ((one, other), (other, one)):
                for side in sides(triangle):
                    part = part_in_triangle(side, against)
                    if part is not None:
                        found.update(along(*side, t)[0] for t in part)
            found.update(p[0] for p in (_edge_crossings(one, other)))
    planes: dict[tuple, list[Triangle]] = {}
    for face in faces:
        planes.setdefault(_plane(face), []).append(face)
    for rows in combinations(planes, 3):
        point = solve([row[:3] for row in rows], tuple(row[3] for row in rows))
        if point is not None and all(_holds(planes[row], point) for row in rows):
            found.add(point[0])
    return found


def _edge_crossings(one: Triangle, other: Triangle) -> list[Vector]:
    points = [crossing_of_lines(a, b) for a in sides(one) for b in sides(other)]
    return [p for p in points if p is not None]


def _plane(face: Triangle) -> tuple:
    """Return the plane normal . x = offset of a face, scaled so that equal planes are equal."""
    normal = cross(sub(face[1], face[0]), sub(face[2], face[0]))
    lead = next(x for x in normal if x != 0)
    normal = tuple(x / lead for x in normal)
    return (*normal, dot(normal, face[0]))


def _holds(faces: list[Triangle], point: Vector) -> bool:
    return any(all(min(p[k] for p in f) <= point[k] <= max(p[k] for p in f) for k in range(3)) for f in faces)


def _slice(faces: list[Triangle], x: Q) -> list[Segment]:
    """Return the segments (y, z) in which the plane at x, which holds no vertex, cuts the faces."""
    found = []
    for face in faces:
        ends = []
        for a, b in sides(face):
            if (a[0] - x) * (b[0] - x) < 0:
                ends.append(along(a, b, (x - a[0]) / (b[0] - a[0]))[1:])
        if ends:
            found.append((ends[0], ends[1]))
    return found


def interiors_meet_in_plane(first: list[Segment], second: list[Segment]) -> bool:
    """Tell whether the open interiors of two closed edge sets of the plane meet."""
    first, second = [[s for s in edges if s[0] != s[1]] for edges in (first, second)]
    if not first or not second:
        return False
    low, high = _common_range(first, second, 0)
    if low >= high:
        return False
    every = first + second
    cuts = {p[0] for edge in every for p in edge}
    for one, other in combinations(every, 2):
        point = crossing_of_lines(one, other)
        if point is not None:
            cuts.add(point[0])
    for left, right in pairwise(sorted(x for x in cuts if low <= x <= high)):
        if _meet_on_line(first, second, (left + right) / 2):
            return True
    return False


def _meet_on_line(first: list[Segment], second: list[Segment], x: Q) -> bool:
    return (1, 1) in _parities_on_line(first, second, x)


def _parities_on_line(first: list[Segment], second: list[Segment], x: Q) -> set[tuple[int, int]]:
    """Walk up the line at x, which holds no end point, and count the parity of both bodies between crossings."""
    events, found = [], set()
    for body, edges in enumerate((first, second)):
        for a, b in edges:
            if (a[0] - x) * (b[0] - x) < 0:
                events.append((along(a, b, (x - a[0]) / (b[0] - a[0]))[1], body))
    events.sort()
    parity = [0, 0]
    for (y, body), (after, _) in pairwise(events):
        parity[body] ^= 1
        if after > y:
            found.add((parity[0], parity[1]))
    return found
