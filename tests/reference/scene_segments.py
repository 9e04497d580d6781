"""What of a segment lies within each body of a scene: every parameter at which anything may change, then locations.

Roots of spheres are computed to 6,000 bits: parameters of small numbers that agree so far are equal.
"""

from __future__ import annotations

from math import isqrt
from typing import Any, NamedTuple

from tests.reference.containment import locate, on_triangle
from tests.reference.exact import Q, Vector, along, cross, dot, nearest_double, q, square, sub, vector
from tests.reference.segments import _crossings_of_edge
from tests.reference.solids import Solid, edges, image, preimage, rows, triangles, value

_CLOSE = Q(1, 2**5500)


class Piece(NamedTuple):
    """A piece in a body: its parameters, to 6,000 bits where they are roots."""

    body: int
    first: Q
    last: Q


def pieces_in_scene(segment: Any, bodies: list[tuple[Solid, Solid | None]]) -> list[Piece]:
    """Return the pieces of one segment within all bodies, each a solid and a pose, by start and then by body."""
    found = [Piece(i, *span) for i, body in enumerate(bodies) for span in _spans(segment, *body)]
    found.sort(key=lambda piece: piece.body)
    ordered: list[Piece] = []
    for piece in found:  # a sort that takes close parameters for equal
        at = len(ordered)
        while at and ordered[at - 1].first > piece.first + _CLOSE:
            at -= 1
        ordered.insert(at, piece)
    return ordered


def rounded_point(segment: Any, t: Q) -> list[float]:
    """Return the nearest doubles of the point at a parameter."""
    return [nearest_double(x) for x in along(vector(segment[0]), vector(segment[1]), t)]


def ranks(pieces: list[Piece]) -> list[list[int]]:
    """Return the rank of either end of each piece among all ends."""
    ends = sorted(t for piece in pieces for t in (piece.first, piece.last))
    distinct: list[Q] = []
    for t in ends:
        if not distinct or t > distinct[-1] + _CLOSE:
            distinct.append(t)

    def rank(t: Q) -> int:
        return next(i for i, other in enumerate(distinct) if abs(other - t) <= _CLOSE)

    return [[rank(piece.first), rank(piece.last)] for piece in pieces]


def _spans(segment: Any, solid: Solid, pose: Solid | None) -> list[tuple[Q, Q]]:
    p, r = vector(segment[0]), vector(segment[1])
    if p == r:
        return [(Q(0), Q(1))] if _located(p, solid, pose) >= 0 else []
    cuts: list[tuple[Q, set[int]]] = []  # a parameter, and the leaves, by id, of which it is an irrational root
    for t, leaf in sorted([(Q(0), 0), (Q(1), 0), *_cuts(p, r, solid, pose)]):
        if 0 <= t <= 1 and not (cuts and abs(cuts[-1][0] - t) <= _CLOSE):
            cuts.append((t, set()))
        if 0 <= t <= 1 and leaf:
            cuts[-1][1].add(leaf)
    spans: list[tuple[Q, Q]] = []
    is_open = False
    for i, (t, leaves) in enumerate(cuts):
        beside = along(p, r, (t + (cuts[i + 1][0] if i + 1 < len(cuts) else cuts[i - 1][0])) / 2)
        at = _located_on(leaves, beside, solid, pose) if leaves else _located(along(p, r, t), solid, pose)
        if not is_open and at >= 0:
            spans.append((t, t))
        if is_open:
            spans[-1] = (spans[-1][0], t)
        is_open = i + 1 < len(cuts) and _located(along(p, r, (t + cuts[i + 1][0]) / 2), solid, pose) >= 0
    return spans


def _located(point: Vector, solid: Solid, pose: Solid | None) -> int:
    if solid["type"] == "surface":
        return 0 if any(on_triangle(point, *face) for face in triangles(solid, pose)) else -1
    return locate(point, solid, pose)


def _located_on(leaves: set[int], beside: Vector, solid: Solid, pose: Solid | None) -> int:
    """Return the location where only the surfaces of some balls are met: beside it, but for these balls."""
    if id(solid) in leaves:
        return 0
    if solid["type"] != "csg":
        return _located(beside, solid, pose)
    found = [_located_on(leaves, beside, operand, pose) for operand in solid["operands"]]
    if solid["operation"] == "difference":
        return min(found[0], -found[1])
    return max(found) if solid["operation"] == "union" else min(found)


def _cuts(p: Vector, r: Vector, solid: Solid, pose: Solid | None) -> list[tuple[Q, int]]:
    kind = solid["type"]
    if kind == "csg":
        return [cut for operand in solid["operands"] for cut in _cuts(p, r, operand, pose)]
    if kind == "sphere":
        return _cuts_of_sphere(p, r, solid, pose)
    found: list[Q] = []
    if kind in ("polyhedron", "surface"):
        for face in triangles(solid, pose):
            normal = cross(sub(face[1], face[0]), sub(face[2], face[0]))
            at_p, at_r = dot(normal, sub(p, face[0])), dot(normal, sub(r, face[0]))
            if at_p != at_r:
                found.append(at_p / (at_p - at_r))
            for a, b in zip(face, (*face[1:], face[0])):
                found += _crossings_of_edge(p, r, a, b)
    elif kind == "polygon" or (kind == "triangle" and len(p) == 2):
        for a, b in edges(solid, pose):
            found += _crossings_of_edge(p, r, a, b)
    else:
        if kind == "triangle":
            p, r, pose = preimage(p, pose), preimage(r, pose), None
        for row in _walls(solid) if kind == "triangle" else rows(solid, pose):
            at_p, at_r = value(row, p), value(row, r)
            if at_p != at_r:
                found.append(at_p / (at_p - at_r))
    return [(t, 0) for t in found]


def _walls(solid: Solid) -> list[Vector]:
    a, b, c = (vector(v) for v in solid["vertices"])
    normal = cross(sub(b, a), sub(c, a))
    inward = [(cross(normal, sub(e, s)), s) for s, e in ((a, b), (b, c), (c, a))]
    return [(*n, -dot(n, s)) for n, s in inward]


def _cuts_of_sphere(p: Vector, r: Vector, solid: Solid, pose: Solid | None) -> list[tuple[Q, int]]:
    d, f = sub(r, p), sub(p, image(solid["center"], pose))
    a, b, c = square(d), dot(d, f), square(f) - q(solid["radius"]) ** 2
    radicand = b * b - a * c
    if radicand < 0:
        return []
    top, bottom = int(radicand.numerator), int(radicand.denominator)
    root = isqrt(top * bottom)
    if root * root == top * bottom:
        return [((-b + sign * Q(root, bottom)) / a, 0) for sign in (-1, 1)]
    near = Q(isqrt(top * bottom << 12000), bottom << 6000)
    return [((-b + sign * near) / a, id(solid)) for sign in (-1, 1)]
