"""Volumes, centroids and sections of meshes in rationals: faces cut one by one, sums from a point of the plane."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any

Point = Sequence[Fraction]


def points_of(vertices: Any) -> list[list[Fraction]]:
    return [[Fraction(x) for x in vertex] for vertex in vertices.tolist()]


def det(a: Point, b: Point, c: Point) -> Fraction:
    return (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )  # fmt: skip


def signed_volume(points: list[list[Fraction]], faces: Any) -> Fraction:
    return sum((det(*(points[k] for k in face)) for face in faces.tolist()), Fraction(0)) / 6


def moment(points: list[list[Fraction]], faces: Any, axis: int) -> Fraction:
    corners = [[points[k] for k in face] for face in faces.tolist()]
    return sum((det(*some) * sum(corner[axis] for corner in some) for some in corners), Fraction(0)) / 24


def cut_volume(points: list[list[Fraction]], faces: Any, row: Sequence[float]) -> tuple[Fraction, Fraction]:
    """Return the signed volume of a mesh, its faces outwards, within a x + b y + c z + d >= 0, and the square of the
    area of its section: cones from a point of the plane, on which the cap adds nothing."""
    *normal, offset = map(Fraction, row)
    values = [sum(n * x for n, x in zip(normal, point)) + offset for point in points]
    axis = max(range(3), key=lambda k: abs(normal[k]))
    apex = [Fraction(0)] * 3
    apex[axis] = -offset / normal[axis]
    i, j = (axis + 1) % 3, (axis + 2) % 3
    volume, seen = Fraction(0), Fraction(0)
    for face in faces.tolist():
        if max(values[k] for k in face) <= 0:
            continue
        piece: list[list[Fraction]] = []
        for u, v in zip(face, [*face[1:], face[0]]):
            if values[u] >= 0:
                piece.append(points[u])
            if (values[u] > 0 > values[v]) or (values[u] < 0 < values[v]):
                t = values[u] / (values[u] - values[v])
                piece.append([x + t * (y - x) for x, y in zip(points[u], points[v])])
        off = [[x - o for x, o in zip(corner, apex)] for corner in piece]
        volume += sum((det(off[0], b, c) for b, c in pairwise(off[1:])), Fraction(0)) / 6
        on = [sum(n * x for n, x in zip(normal, corner)) + offset == 0 for corner in piece]
        for k in range(len(piece)):
            p, q = piece[k - 1], piece[k]
            if on[k - 1] and on[k]:
                seen += (p[i] * q[j] - p[j] * q[i]) / 2
    return volume, seen**2 * sum(n * n for n in normal) / normal[axis] ** 2


def nearest(value: Fraction) -> float:
    return value.numerator / value.denominator + 0.0


def ring_area(ring: list[list[Fraction]]) -> Fraction:
    return sum((a[0] * b[1] - a[1] * b[0] for a, b in zip(ring, [*ring[1:], ring[0]])), Fraction(0)) / 2


def convex_overlap(first: Any, second: Any) -> Fraction:
    """Return the area that two convex rings have in common, by cutting one at the sides of the other."""
    ring, other = (points if ring_area(points) >= 0 else points[::-1] for points in map(points_of, (first, second)))
    for (ax, ay), (bx, by) in zip(other, [*other[1:], other[0]]):
        sides = [(bx - ax) * (y - ay) - (by - ay) * (x - ax) for x, y in ring]
        left: list[list[Fraction]] = []
        for p, q, v, w in zip(ring, [*ring[1:], *ring[:1]], sides, [*sides[1:], *sides[:1]]):
            if v >= 0:
                left.append(p)
            if v * w < 0:
                left.append([x + v / (v - w) * (y - x) for x, y in zip(p, q)])
        ring = left
    return ring_area(ring) if len(ring) > 2 else Fraction(0)


def convex_overlap_of_space(first: tuple[Any, Any], second: tuple[Any, Any]) -> Fraction:
    """Return the volume that two convex meshes, faces outwards, have in common: the faces of each within the other."""
    total, planes = (
        Fraction(0),
        [[_plane(points, face) for face in faces.tolist()] for points, faces in (first, second)],
    )
    for (points, faces), others, is_second in zip((first, second), planes[::-1], (False, True)):
        for face in faces.tolist():
            if is_second and _plane(points, face) in others:
                continue  # counted once, as a face of the first
            piece = [points[k] for k in face]
            for *normal, offset in others:
                values = [sum(n * x for n, x in zip(normal, point)) - offset for point in piece]
                kept: list[list[Fraction]] = []
                for p, q, v, w in zip(piece, [*piece[1:], *piece[:1]], values, [*values[1:], *values[:1]]):
                    if v <= 0:
                        kept.append(p)
                    if v * w < 0:
                        kept.append([x + v / (v - w) * (y - x) for x, y in zip(p, q)])
                piece = kept
            total += sum((det(piece[0], b, c) for b, c in pairwise(piece[1:])), Fraction(0)) / 6
    return total


def _plane(points: list[list[Fraction]], face: Sequence[int]) -> list[Fraction]:
    """Return normal and offset of a face, the largest part of the normal 1."""
    a, b, c = (points[k] for k in face)
    u, v = ([y - x for x, y in zip(a, other)] for other in (b, c))
    normal = [u[k - 2] * v[k - 1] - u[k - 1] * v[k - 2] for k in range(3)]
    size = max(map(abs, normal))
    unit = [x / size for x in normal]
    return [*unit, sum(n * x for n, x in zip(unit, a))]
