"""Where a point lies: on a face by an exact test, else by the parity of a random rational half-line.

A half-line that meets an edge, a vertex or a face edge-on is thrown away and another is drawn: in rational arithmetic
the textbook's own "find another half line" is exact, since every degeneracy is recognised.
"""

from __future__ import annotations

import random
from typing import Any

from tests.reference.exact import Q, Vector, cross, dot, q, sign, square, sub, vector
from tests.reference.solids import Solid, edges, image, preimage, rows, triangles, value

INSIDE, BOUNDARY, OUTSIDE = 1, 0, -1


def locate(point: Any, solid: Solid, pose: Solid | None = None) -> int:
    """Return 1 inside, 0 boundary, -1 outside."""
    p = vector(point)
    match solid["type"]:
        case "sphere" | "implicit":
            return _locate_smooth(preimage(p, pose) if solid["type"] == "implicit" else p, solid, pose)
        case "half_space" | "aabb" | "convex":
            return min(sign(value(row, p)) for row in rows(solid, pose))
        case "polygon":
            return locate_by_edges(p, edges(solid, pose))
        case "triangle":
            p = preimage(p, pose)
            return locate_by_edges(p, edges(solid)) if len(p) == 2 else _locate_in_prism(p, solid)
        case "polyhedron":
            return locate_by_triangles(p, triangles(solid, pose))
        case "csg":
            found = [locate(p, operand, pose) for operand in solid["operands"]]
            if solid["operation"] == "difference":
                return min(found[0], *(-other for other in found[1:]))
            return max(found) if solid["operation"] == "union" else min(found)
    raise ValueError(f"no inside: {solid['type']}")


def locate_many(points: Any, solid: Solid, pose: Solid | None = None) -> list[int]:
    """Return the location of each point; the faces of a polyhedron are read once."""
    if solid["type"] == "polyhedron":
        faces = triangles(solid, pose)
        return [locate_by_triangles(vector(point), faces) for point in points]
    return [locate(point, solid, pose) for point in points]


def _locate_smooth(p: Vector, solid: Solid, pose: Solid | None) -> int:
    if solid["type"] == "sphere":
        return sign(q(solid["radius"]) ** 2 - square(sub(p, image(solid["center"], pose))))
    total = Q(0)
    for term in solid["terms"]:
        product = q(term["coefficient"])
        for x, power in zip(p, term["powers"], strict=True):
            product *= x ** int(power)
        total += product
    return sign(total)


def _locate_in_prism(p: Vector, solid: Solid) -> int:
    """Return the location in the infinite prism over a triangle of space, by its three side planes."""
    a, b, c = (vector(v) for v in solid["vertices"])
    normal = cross(sub(b, a), sub(c, a))  # zero without area: then the formula says BOUNDARY everywhere
    return min(sign(dot(cross(sub(e, s), sub(p, s)), normal)) for s, e in ((a, b), (b, c), (c, a)))


def on_segment(p: Vector, a: Vector, b: Vector) -> bool:
    """Tell whether p lies on the closed segment ab (possibly a point), in any dimension."""
    ab, ap = sub(b, a), sub(p, a)
    if any(x != 0 for x in cross(ab, ap)):
        return False
    return 0 <= dot(ap, ab) <= square(ab) if square(ab) else p == a


def on_triangle(p: Vector, a: Vector, b: Vector, c: Vector) -> bool:
    """Tell whether p lies on the closed triangle abc of space, which may be a segment or a point."""
    normal = cross(sub(b, a), sub(c, a))
    if square(normal) == 0:
        return on_segment(p, a, b) or on_segment(p, b, c) or on_segment(p, c, a)
    if dot(normal, sub(p, a)) != 0:
        return False
    return all(dot(cross(sub(e, s), sub(p, s)), normal) >= 0 for s, e in ((a, b), (b, c), (c, a)))


def locate_by_edges(p: Vector, segments: list[tuple[Vector, Vector]]) -> int:
    """Return the even-odd location of p with respect to closed rings given as edges."""
    near = [(a, b) for a, b in segments if min(a[0], b[0]) <= p[0] <= max(a[0], b[0])]
    if any(on_segment(p, a, b) for a, b in near):
        return BOUNDARY
    source = random.Random(1)
    while True:
        u = (Q(source.randint(1, 10**6)), Q(source.randint(-(10**6), 10**6)))
        parity = _parity_in_plane(p, u, segments)
        if parity is not None:
            return INSIDE if parity else OUTSIDE


def _parity_in_plane(p: Vector, u: Vector, segments: list[tuple[Vector, Vector]]) -> int | None:
    """Return the parity of the edges that the half-line p + s u meets, None where it meets an end point."""
    parity = 0
    for a, b in segments:
        side_a, side_b = cross(u, sub(a, p))[0], cross(u, sub(b, p))[0]
        if (side_a == 0 and dot(u, sub(a, p)) > 0) or (side_b == 0 and dot(u, sub(b, p)) > 0):
            return None
        if side_a * side_b < 0:
            ahead = dot(u, sub(a, p)) * side_b - dot(u, sub(b, p)) * side_a
            parity ^= ahead * (side_b - side_a) > 0
    return int(parity)


def locate_by_triangles(p: Vector, faces: list[tuple[Vector, Vector, Vector]]) -> int:
    """Return the even-odd location of p with respect to a closed set of triangles of space."""
    for a, b, c in faces:
        if all(min(a[k], b[k], c[k]) <= p[k] <= max(a[k], b[k], c[k]) for k in range(3)) and on_triangle(p, a, b, c):
            return BOUNDARY
    source = random.Random(1)
    while True:
        u = tuple(Q(source.randint(-1000, 1000)) for _ in range(3))
        parity = _parity_in_space(p, u, faces)
        if parity is not None:
            return INSIDE if parity else OUTSIDE


def _parity_in_space(p: Vector, u: Vector, faces: list[tuple[Vector, Vector, Vector]]) -> int | None:
    """Return the parity of the triangles that p + s u, s > 0, meets; None where it meets an edge or runs in a plane."""
    parity = 0
    for a, b, c in faces:
        pa, pb, pc = sub(a, p), sub(b, p), sub(c, p)
        normal = cross(sub(b, a), sub(c, a))
        if square(normal) == 0:
            continue  # no area: a generic half-line misses it, and p on it was found before
        slope, height = dot(normal, u), dot(normal, pa)
        # the three volumes of the line with the edges: one sign for a crossing, a zero for meeting an edge's line
        volumes = [dot(u, cross(pa, pb)), dot(u, cross(pb, pc)), dot(u, cross(pc, pa))]
        if min(volumes) >= 0 or max(volumes) <= 0:
            if slope == 0 and height != 0:
                continue  # parallel to the plane and beside it
            if slope == 0 or 0 in volumes:
                if slope == 0 or height / slope > 0:
                    return None
                continue
            parity ^= height / slope > 0
    return int(parity)
