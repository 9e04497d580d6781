"""What remains of a segment in a closed region: exact crossing parameters, then the midpoints between them.

A piece is a maximal connected part of the segment within the region. Every parameter at which the segment can enter or
leave is collected; the points at them and one point between any two are located.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

from tests.reference.contact import part_in_triangle, sides
from tests.reference.containment import locate_by_edges, locate_by_triangles, on_segment, on_triangle
from tests.reference.exact import Q, Vector, along, cross, dot, nearest_double_with_root, q, square, sub, vector
from tests.reference.solids import Solid, dimension, edges, image, rows, triangles_with_faces, value


class Root(NamedTuple):
    """The number a + b sqrt(radicand)."""

    a: Q
    b: Q = Q(0)
    radicand: Q = Q(0)

    def nearest(self) -> float:
        return nearest_double_with_root(self.a, self.b, self.radicand)


class Piece(NamedTuple):
    """One piece: parameters, coordinates of both ends, and the face crossed at each end (-1: an own end)."""

    t: tuple[Root, Root]
    ends: tuple[tuple[Root, ...], tuple[Root, ...]]
    faces: tuple[int, int]

    def rounded(self) -> tuple[list[float], list[float], list[float]]:
        """Return start, end and (t0, t1) as nearest doubles."""
        start, end = ([x.nearest() for x in point] for point in self.ends)
        return start, end, [t.nearest() for t in self.t]


def clip_segment(segment: Any, region: Solid) -> list[Piece]:
    """Return the pieces of a segment in order of t; a zero-length segment in the region has t = (0, 1)."""
    p, r = vector(segment[0]), vector(segment[1])
    if p == r:
        kept = _keeps(p, region)
        point = tuple(Root(x) for x in p)
        return [Piece((Root(Q(0)), Root(Q(1))), (point, point), (-1, -1))] if kept else []
    if region["type"] == "sphere":
        return _clip_on_sphere(p, r, region)
    cuts = sorted({Q(0), Q(1)} | {t for t in _crossings(p, r, region) if 0 <= t <= 1})
    spans: list[list[Q]] = []
    previous_open = False
    for i, t in enumerate(cuts):
        if previous_open:
            spans[-1][1] = t
        elif _keeps(along(p, r, t), region):
            spans.append([t, t])
        previous_open = i + 1 < len(cuts) and _keeps(along(p, r, (t + cuts[i + 1]) / 2), region)
        assert not previous_open or (spans and spans[-1][1] == t), "a closed region holds the ends of what it holds"
    return [_piece(p, r, low, high, region) for low, high in spans]


def _piece(p: Vector, r: Vector, low: Q, high: Q, region: Solid) -> Piece:
    points = [along(p, r, t) for t in (low, high)]
    faces = (
        -1 if low == 0 else _face_at(points[0], sub(r, p), region),
        -1 if high == 1 else _face_at(points[1], sub(p, r), region),
    )
    ends = tuple(tuple(Root(x) for x in point) for point in points)
    return Piece((Root(low), Root(high)), ends, faces)  # type: ignore[arg-type]


def _keeps(point: Vector, region: Solid) -> bool:
    kind = region["type"]
    if kind == "sphere":
        return square(sub(point, image(region["center"], None))) <= q(region["radius"]) ** 2
    if kind == "polyhedron":
        return locate_by_triangles(point, [t for t, _ in triangles_with_faces(region)]) >= 0
    if kind in ("polygon", "triangle"):
        return locate_by_edges(point, edges(region)) >= 0
    return all(value(row, point) >= 0 for row in rows(region))


def _crossings(p: Vector, r: Vector, region: Solid) -> list[Q]:
    """Return every parameter at which p + t (r - p) may enter or leave."""
    kind = region["type"]
    found = []
    if kind == "polyhedron":
        for face, _ in triangles_with_faces(region):
            if square(cross(sub(face[1], face[0]), sub(face[2], face[0]))) != 0:
                found += part_in_triangle((p, r), face) or ()
            else:
                for side in sides(face):
                    found += _crossings_of_edge(p, r, *side)
    elif kind in ("polygon", "triangle"):
        for edge in edges(region):
            found += _crossings_of_edge(p, r, *edge)
    else:
        for row in rows(region):
            at_p, at_r = value(row, p), value(row, r)
            if at_p != at_r:
                found.append(at_p / (at_p - at_r))
    return found


def _crossings_of_edge(p: Vector, r: Vector, a: Vector, b: Vector) -> list[Q]:
    """Return the parameters at which a segment meets an edge; the ends of the overlap where they are collinear."""
    u, v, w = sub(r, p), sub(b, a), sub(a, p)
    normal = cross(u, v)
    if square(normal) != 0:
        return [dot(cross(w, v), normal) / square(normal)]
    return [dot(sub(e, p), u) / square(u) for e in (a, b) if all(x == 0 for x in cross(u, sub(e, p)))]


def _face_at(point: Vector, inward: Vector, region: Solid) -> int:
    """Return the face crossed at an end from which the piece goes `inward`: the first of those that hold the point.

    Of planes those count that the segment enters through; of faces and edges that hold the point, the ones that the
    segment runs along come last.
    """
    kind = region["type"]
    if kind == "polyhedron":
        holding = [
            (_runs_along(inward, face), i) for face, i in triangles_with_faces(region) if on_triangle(point, *face)
        ]
    elif kind in ("polygon", "triangle"):
        holding = [(_runs_along(inward, edge), i) for i, edge in enumerate(edges(region)) if on_segment(point, *edge)]
    else:
        planes = enumerate(rows(region))
        holding = [(False, i) for i, row in planes if value(row, point) == 0 and dot(row[:-1], inward) > 0]
    return min(holding)[1]


def _runs_along(direction: Vector, face: tuple[Vector, ...]) -> bool:
    """Tell whether a direction lies in the plane of a face or on the line of an edge."""
    if len(face) == 2:
        return all(x == 0 for x in cross(direction, sub(face[1], face[0])))
    return dot(direction, cross(sub(face[1], face[0]), sub(face[2], face[0]))) == 0


def _clip_on_sphere(p: Vector, r: Vector, region: Solid) -> list[Piece]:
    """Cut [0, 1] by the roots of |p - c + t u|^2 = radius^2, represented as numbers with one square root."""
    center, u = vector(region["center"]), sub(r, p)
    a, half_b, c = square(u), dot(u, sub(p, center)), square(sub(p, center)) - q(region["radius"]) ** 2
    radicand = half_b * half_b - a * c
    if radicand < 0:
        return []
    low, high = Root(-half_b / a, -1 / a, radicand), Root(-half_b / a, 1 / a, radicand)
    # signs at t = 0 and t = 1: f(0) = c, f(1) = a + 2 half_b + c; f is convex in t
    at_p, at_r = c, a + 2 * half_b + c
    if (at_p > 0 and half_b > 0) or (at_r > 0 and half_b + a < 0):
        return []  # past both roots, or not yet at them
    keeps_p, keeps_r = at_p <= 0, at_r <= 0
    start, face_start = (Root(Q(0)), -1) if keeps_p else (low, 0)
    end, face_end = (Root(Q(1)), -1) if keeps_r else (high, 0)
    if keeps_p and not keeps_r and at_p == 0 and half_b >= 0:
        end = start  # leaves at once: only the first end touches; it is left through the sphere, at t = 0
    if keeps_r and not keeps_p and at_r == 0 and half_b + a <= 0:
        start = end
    ends = tuple(tuple(Root(x + t.a * d, t.b * d, t.radicand) for x, d in zip(p, u, strict=True)) for t in (start, end))
    return [Piece((start, end), (ends[0], ends[1]), (face_start, face_end))]


def clip_segments(segments: Any, region: Solid) -> list[tuple[int, Piece]]:
    """Return (source, piece) for every piece, by source and then by t."""
    assert dimension(region) in (2, 3)
    return [(i, piece) for i, segment in enumerate(segments) for piece in clip_segment(segment, region)]


def length_in(pairs: list[tuple[Q, Q]]) -> Q:
    """Return the total of t1 - t0, for rational parameters."""
    return sum((high - low for low, high in pairs), Q(0))


def is_sorted_and_apart(pairs: list[tuple[Q, Q]]) -> bool:
    return all(a[1] < b[0] for a, b in pairwise(pairs))
