"""The clipping references once more in integers, quick enough for hundreds of thousands of cases.

All numbers of a scene are integers over one power of two; points on the way are integers with a common denominator.
`test_fast.py` holds these against the slow references, which are nearer to the definitions.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import gcd, isqrt
from typing import Any, NamedTuple

from gmpy2 import mpq

from tests.reference.solids import cut_face

Point = tuple[int, ...]
Row = tuple[int, ...]
Contact = tuple[mpq, bool, int]
"""A parameter of the segment, whether the element runs along the segment, and the face or edge it belongs to."""
Piece = tuple[list[float], list[float], list[float], tuple[int, int]]
"""Start, end, (t0, t1), faces."""


def bits_below_one(numbers: Sequence[float]) -> int:
    """Return the smallest k >= 0 such that every number times 2^k is an integer."""
    return max((number.as_integer_ratio()[1].bit_length() for number in numbers), default=1) - 1


def integer(number: float, bits: int) -> int:
    top, bottom = number.as_integer_ratio()
    return top << (bits + 1 - bottom.bit_length())


def nearest(top: int, bottom: int) -> float:
    """Return the double nearest to a quotient; Python rounds the division of integers correctly."""
    return int(top) / int(bottom) + 0.0


def nearest_with_root(u: int, v: int, w: int, z: int) -> float:
    """Return the double nearest to (u + v sqrt(w)) / z, by ever closer bounds unless the root is an integer."""
    root = isqrt(w)
    if v == 0 or root * root == w:
        return nearest(u + v * root, z)
    for bits in range(100, 10_000, 300):
        root = isqrt(w << 2 * bits)
        low, high = (nearest((u << bits) + v * (root + more), z << bits) for more in (0, 1))
        if low == high:
            return low
    raise AssertionError("bounds do not meet")


class FlatFaceError(Exception):
    """A face of a polyhedron has no area: for such solids there is the slow reference."""


class Scene(NamedTuple):
    """A region as integers over 2^bits; rows have their own positive factors."""

    kind: str
    bits: int
    rows: list[Row]
    center: Point
    radius: int
    edges: list[tuple[Point, Point]]
    triangles: list[tuple[Point, Point, Point, Row, int]]


def scene_of(region: dict[str, Any], segments: list[list[list[float]]]) -> Scene:
    """Return the region on a scale that holds the segments too."""
    kind = region["type"]
    numbers = [x for segment in segments for point in segment for x in point]
    rows: list[list[float]] = []
    rings: list[list[list[float]]] = []
    match kind:
        case "half_space":
            rows = [[*region["normal"], region["offset"]]]
        case "convex":
            rows = region["planes"]
        case "aabb":
            numbers += [*region["min"], *region["max"]]
        case "sphere":
            numbers += [*region["center"], region["radius"]]
        case "polygon":
            rings = region["rings"]
            numbers += [x for ring in rings for point in ring for x in point]
        case "polyhedron":
            numbers += [x for point in region["vertices"] for x in point]
    bits = bits_below_one(numbers)

    def point_of(point: list[float]) -> Point:
        return tuple(integer(x, bits) for x in point)

    found = []
    for row in rows:
        own = bits_below_one(row)
        found.append((*(integer(x, own) for x in row[:-1]), integer(row[-1], own) << bits))
    if kind == "aabb":
        low, high = point_of(region["min"]), point_of(region["max"])
        for axis, (least, most) in enumerate(zip(low, high, strict=True)):
            unit = [int(axis == k) for k in range(len(low))]
            found += [(*unit, -least), (*(-x for x in unit), most)]
    edges = [pair for ring in rings for pair in pairwise([*map(point_of, ring), point_of(ring[0])])]
    triangles = []
    if kind == "polyhedron":
        points = [point_of(point) for point in region["vertices"]]
        for i_face, face in enumerate(region["faces"]):
            for part in cut_face(points, list(face)):
                a, b, c = (points[i] for i in part)
                row = plane_through(a, b, c)
                if not any(row[:3]):
                    raise FlatFaceError
                triangles.append((a, b, c, row, i_face))
    is_ball = kind == "sphere"
    center = point_of(region["center"]) if is_ball else ()
    return Scene(kind, bits, found, center, integer(region["radius"], bits) if is_ball else 0, edges, triangles)


def plane_through(a: Point, b: Point, c: Point) -> Row:
    u, v = [y - x for x, y in zip(a, b)], [y - x for x, y in zip(a, c)]
    n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    return (*n, -(n[0] * a[0] + n[1] * a[1] + n[2] * a[2]))


def clip_segments(segments: list[list[list[float]]], region: dict[str, Any]) -> list[tuple[int, Piece]]:
    """Return (source, piece) for every piece, by source and then by t, all numbers correctly rounded."""
    scene = scene_of(region, segments)
    found = []
    for source, segment in enumerate(segments):
        p, r = (tuple(integer(x, scene.bits) for x in point) for point in segment)
        found += [(source, piece) for piece in clip_segment(p, r, scene)]
    return found


def clip_segment(p: Point, r: Point, scene: Scene) -> list[Piece]:
    if scene.kind == "sphere":
        return clip_on_ball(p, r, scene)
    if scene.rows:
        spans = span_on_rows(p, r, scene.rows)
    else:
        spans = spans_on_boundary(p, r, scene)

    def at(t: mpq) -> list[float]:
        top, bottom = int(t.numerator), int(t.denominator)
        return [nearest(x * (bottom - top) + y * top, bottom << scene.bits) for x, y in zip(p, r)]

    return [
        (at(low), at(high), [nearest(t.numerator, t.denominator) for t in (low, high)], faces)
        for low, high, faces in spans
    ]


def span_on_rows(p: Point, r: Point, rows: list[Row]) -> list[tuple[mpq, mpq, tuple[int, int]]]:
    """Return the part of [0, 1] on which every row is not negative: the first of several planes at one point counts."""
    low, high, entered, left = mpq(0), mpq(1), -1, -1
    for i_row, row in enumerate(rows):
        at_p, at_r = (sum(a * x for a, x in zip(row, point)) + row[-1] for point in (p, r))
        if at_p >= 0 and at_r >= 0:
            continue
        if at_p < 0 and at_r < 0:
            return []
        t = mpq(at_p, at_p - at_r)
        if at_p < 0 and (t > low or entered < 0):
            low, entered = t, i_row
        if at_r < 0 and (t < high or left < 0):
            high, left = t, i_row
    return [(low, high, (entered, left))] if low <= high else []


def clip_on_ball(p: Point, r: Point, scene: Scene) -> list[Piece]:
    """Solve |p - c + t u|^2 = radius^2, that is a t^2 + 2 h t + c = 0."""
    u = [y - x for x, y in zip(p, r)]
    f = [x - m for x, m in zip(p, scene.center)]
    a, h = sum(x * x for x in u), sum(x * y for x, y in zip(u, f))
    at_p = sum(x * x for x in f) - scene.radius**2
    at_r, radicand = at_p + a + 2 * h, h * h - a * at_p
    keeps_p, keeps_r = at_p <= 0, at_r <= 0
    if not keeps_p and not keeps_r and not (radicand >= 0 and -h > 0 and -h < a):
        return []  # no root, or both on one side of [0, 1]: they lie around -h / a
    own = [[nearest(x, 1 << scene.bits) for x in point] for point in (p, r)]

    def root(sign: int) -> tuple[float, list[float]]:
        z = a << scene.bits
        point = [nearest_with_root(x * a - h * d, sign * d, radicand, z) for x, d in zip(p, u)]
        return nearest_with_root(-h, sign, radicand, a), point

    t0, start = (0.0, own[0]) if keeps_p else root(-1)
    t1, end = (1.0, own[1]) if keeps_r else root(1)
    return [(start, end, [t0, t1], (-1 if keeps_p else 0, -1 if keeps_r else 0))]


def spans_on_boundary(p: Point, r: Point, scene: Scene) -> list[tuple[mpq, mpq, tuple[int, int]]]:
    """Return the maximal parts of [0, 1] that lie inside or on the boundary."""
    if p == r:
        is_kept = inside(p, 1, scene) or any(contacts_of_point(p, scene))
        return [(mpq(0), mpq(1), (-1, -1))] if is_kept else []
    contacts = contacts_on_edges(p, r, scene) if scene.edges else contacts_on_triangles(p, r, scene)
    at: dict[mpq, list[tuple[bool, int]]] = {}
    for t, runs_along, face in contacts:
        at.setdefault(t, []).append((runs_along, face))
    cuts = sorted({mpq(0), mpq(1), *at})
    runs = running_spans(contacts)
    spans: list[tuple[mpq, mpq]] = []
    is_open = False  # whether the part before this cut is kept
    for i_cut, t in enumerate(cuts):
        following = cuts[i_cut + 1] if i_cut + 1 < len(cuts) else None
        goes_on = following is not None and keeps_between(p, r, t, following, runs, scene)
        if is_open:
            spans[-1] = (spans[-1][0], t)
        elif t in at or goes_on:
            spans.append((t, t))
        is_open = goes_on
    return [
        (low, high, (-1 if low == 0 else min(at[low])[1], -1 if high == 1 else min(at[high])[1])) for low, high in spans
    ]


def running_spans(contacts: list[Contact]) -> list[tuple[mpq, mpq]]:
    """Return the spans on which elements run along the segment: their contacts come in pairs."""
    along = [t for t, runs_along, _ in contacts if runs_along]
    return list(zip(along[::2], along[1::2], strict=True))


def keeps_between(p: Point, r: Point, t: mpq, following: mpq, runs: list[tuple[mpq, mpq]], scene: Scene) -> bool:
    if any(low <= t and following <= high for low, high in runs):
        return True
    middle = (t + following) / 2
    top, bottom = int(middle.numerator), int(middle.denominator)
    return inside(tuple(x * (bottom - top) + y * top for x, y in zip(p, r)), bottom, scene)


def inside(point: Point, w: int, scene: Scene) -> bool:
    """Tell whether the ray along +x (+y in the plane) from point / w, which is on no element, meets an odd number."""
    odd = False
    if scene.edges:
        x, y = point
        for a, b in scene.edges:
            if (a[0] * w <= x) != (b[0] * w <= x):
                side = (b[0] - a[0]) * (y - a[1] * w) - (b[1] - a[1]) * (x - a[0] * w)
                odd ^= (side < 0) == (b[0] > a[0]) and side != 0
        return odd
    _, y, z = point
    for a, b, c, row, _ in scene.triangles:
        hit = False
        for d, e in ((a, b), (b, c), (c, a)):
            if (d[1] * w <= y) != (e[1] * w <= y):
                side = (e[1] - d[1]) * (z - d[2] * w) - (e[2] - d[2]) * (y - d[1] * w)
                hit ^= side != 0 and (side < 0) == (e[1] > d[1])
        if hit:
            value = row[0] * point[0] + row[1] * y + row[2] * z + row[3] * w
            odd ^= (value < 0) == (row[0] > 0)
    return odd


def contacts_of_point(p: Point, scene: Scene) -> list[bool]:
    """Return for each element whether it holds the point."""
    if scene.edges:
        return [
            (b[0] - a[0]) * (p[1] - a[1]) == (b[1] - a[1]) * (p[0] - a[0])
            and all(min(a[k], b[k]) <= p[k] <= max(a[k], b[k]) for k in (0, 1))
            for a, b in scene.edges
        ]
    return [
        value_at(row, p) == 0 and in_triangle(p, 1, (a, b, c), *flat_axes(row)) for a, b, c, row, _ in scene.triangles
    ]


def contacts_on_edges(p: Point, r: Point, scene: Scene) -> list[Contact]:
    u = (r[0] - p[0], r[1] - p[1])
    found: list[Contact] = []
    for i_edge, (a, b) in enumerate(scene.edges):
        v, w = (b[0] - a[0], b[1] - a[1]), (a[0] - p[0], a[1] - p[1])
        across = u[0] * v[1] - u[1] * v[0]
        off = w[0] * u[1] - w[1] * u[0]
        if across:
            s, t = mpq(off, across), mpq(w[0] * v[1] - w[1] * v[0], across)
            if 0 <= s <= 1 and 0 <= t <= 1:
                found.append((t, False, i_edge))
        elif off == 0:  # on one line (or an edge without length on it): the common part
            k = 0 if u[0] else 1
            low, high = sorted(mpq(x[k] - p[k], u[k]) for x in (a, b))
            low, high = max(low, mpq(0)), min(high, mpq(1))
            if low <= high:
                found += [(low, True, i_edge), (high, True, i_edge)]
    return found


def value_at(row: Row, p: Point) -> int:
    return row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3]


def flat_axes(row: Row) -> tuple[int, int]:
    """Return two axes onto which the plane projects one to one."""
    lost = max(range(3), key=lambda k: abs(row[k]))
    return (lost + 1) % 3, (lost + 2) % 3


def turns(p: Point, w: int, corners: tuple[Point, Point, Point], i: int, j: int) -> list[int]:
    a, b, c = corners
    return [(e[i] - d[i]) * (p[j] - d[j] * w) - (e[j] - d[j]) * (p[i] - d[i] * w) for d, e in ((a, b), (b, c), (c, a))]


def in_triangle(p: Point, w: int, corners: tuple[Point, Point, Point], i: int, j: int) -> bool:
    """Tell whether the point p / w of the triangle's plane lies in the closed triangle."""
    values = turns(p, w, corners, i, j)
    return min(values) >= 0 or max(values) <= 0


def contacts_on_triangles(p: Point, r: Point, scene: Scene) -> list[Contact]:
    found: list[Contact] = []
    for a, b, c, row, face in scene.triangles:
        at_p, at_r = value_at(row, p), value_at(row, r)
        if (at_p > 0 and at_r > 0) or (at_p < 0 and at_r < 0):
            continue
        axes = flat_axes(row)
        if at_p != at_r:
            top, bottom = (at_p, at_p - at_r) if at_p > at_r else (-at_p, at_r - at_p)
            point = tuple(x * (bottom - top) + y * top for x, y in zip(p, r))
            if in_triangle(point, bottom, (a, b, c), *axes):
                found.append((mpq(top, bottom), False, face))
            continue
        values = [turns(x, 1, (a, b, c), *axes) for x in (p, r)]  # in the plane: clip on the three sides
        if row[3 - sum(axes)] < 0:
            values = [[-x for x in each] for each in values]
        rows = [(at_start, at_end) for at_start, at_end in zip(*values)]
        low, high = mpq(0), mpq(1)
        for at_start, at_end in rows:
            if at_start < 0 and at_end < 0:
                low = mpq(2)
            elif at_start < 0:
                low = max(low, mpq(at_start, at_start - at_end))
            elif at_end < 0:
                high = min(high, mpq(at_start, at_start - at_end))
        if low <= high:
            found += [(low, True, face), (high, True, face)]
    return found


Vertex = tuple[int, ...]
"""(x, y[, z], w), w > 0, no common divisor: equal points are equal tuples."""


def reduced(vertex: Sequence[int]) -> Vertex:
    divisor = gcd(*vertex)
    return tuple(x // divisor for x in vertex)


def merged(contour: list[Vertex]) -> list[Vertex]:
    """Drop each vertex that equals the one before it around the ring; of all equal ones one stays."""
    kept = [vertex for i, vertex in enumerate(contour) if vertex != contour[i - 1]]
    return kept or contour[:1]


def planes_of(region: dict[str, Any]) -> list[Row]:
    """Return the planes in clipping order for vertices (x, y[, z], 1); of a convex polyhedron those of its triangles.

    A face of four vertices that rounding has bent has two planes: the solid is what its triangles bound. Rounding may
    turn a small one inside out, too: its faces then run clockwise.
    """
    scene = scene_of(region, [])
    if scene.kind != "polyhedron":
        return [(*(x << scene.bits for x in row[:-1]), row[-1]) for row in scene.rows]
    (*normal, offset), corners = scene.triangles[0][3], [p for triangle in scene.triangles for p in triangle[:3]]
    sign = 1 if any(sum(a * x for a, x in zip(normal, p)) + offset > 0 for p in corners) else -1
    rows = [(*(sign * x << scene.bits for x in row[:3]), sign * row[3]) for *_, row, _ in scene.triangles]
    return list(dict.fromkeys(tuple(x // gcd(*row) for x in row) for row in rows))


def clip_polygon(rings: list[list[list[float]]], planes: list[Row]) -> tuple[list[list[list[float]]], bool]:
    """Return what Sutherland-Hodgman leaves of each contour, correctly rounded, and whether bridges are possible.

    They are where contours that lost a vertex to a plane met it in more than two points, all contours together.
    """
    bits = bits_below_one([x for ring in rings for point in ring for x in point])
    contours = [merged([reduced((*(integer(x, bits) for x in point), 1 << bits)) for point in ring]) for ring in rings]
    may_have_bridges = False
    for row in planes:
        n_met, has_dropped = 0, False
        for i_ring, contour in enumerate(contours):
            values = [sum(a * x for a, x in zip(row, vertex)) for vertex in contour]
            n_met += values.count(0)
            if not values or min(values) >= 0:
                continue
            has_dropped = True
            kept: list[Vertex] = []
            for i, (q, at_q) in enumerate(zip(contour, values)):
                p, at_p = contour[i - 1], values[i - 1]
                if at_p * at_q < 0:
                    kept.append(reduced([abs(at_p) * y + abs(at_q) * x for x, y in zip(p, q)]))
                    n_met += 1
                if at_q >= 0:
                    kept.append(q)
            contours[i_ring] = merged(kept)
        may_have_bridges |= has_dropped and n_met > 2
    left = [[[nearest(x, vertex[-1]) for x in vertex[:-1]] for vertex in contour] for contour in contours]
    return left, may_have_bridges and any(contours)
