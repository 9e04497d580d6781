"""The planes of a region for Sutherland-Hodgman: as integer rows, as double-doubles, and those of a convex polyhedron.

The planes of a polyhedron are rarely rows of doubles, so they stay implicit: three vertices each. It is convex if no
vertex lies outside any of its planes (exact orientation) and a point inside all planes is inside it. Then all faces lie
on the hull of the vertices; inside the hull there is no face, so the even-odd location is constant there, and INSIDE
makes every point of the hull's boundary lie on some face: the solid is the hull. All vertices are tested against all
faces only where `engine.solids.convexity`, one test an edge, gives no certificate: faces without area, and solids that
are not convex, so that the error can name the reason.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from itertools import starmap
from typing import Final, NamedTuple

import numpy as np

from engine.containment.methods.rational_locate import rational_location
from engine.errors import UnsupportedSolidError
from engine.polygon_clipping.in_integers import Row, integer_row, plane_through
from engine.polygon_clipping.rings import PlaneTables
from engine.predicates.digits import packed_numbers
from engine.predicates.orientation import orient3d_batch
from engine.predicates.rational import are_all_safe, exponent_above, nearest_pair, orient3d_rational, reduced, shifted
from engine.solids.base import Solid
from engine.solids.checks import digits
from engine.solids.convexity import convexity
from engine.solids.mesh import Polyhedron
from engine.solids.primitives import Aabb, Convex, HalfSpace, rows_of
from engine.solids.ragged import ascending
from engine.solids.registry import refused, row_of
from engine.types import UNDECIDED, FloatArray, Int8Array, IntArray, Location, read_only

Check = Callable[[], object]

_BATCH: Final = 1 << 17  # orientations in one kernel call: a few milliseconds
_CHECK_EVERY: Final = 256
_DEEPEST: Final = -900
"""Scenes below 2^-900 have subnormal results, which the kernel would round twice."""


def orientations(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> Int8Array:
    """Return the exact orient3d of each row of a, b, c, d (n, 3)."""
    signs = np.empty(len(a), np.int8)
    with np.errstate(all="ignore"):
        orient3d_batch(*(read_only(np.ascontiguousarray(points)) for points in (a, b, c, d)), signs)
    for i in np.flatnonzero(signs == UNDECIDED):
        signs[i] = orient3d_rational(a[i].tolist(), b[i].tolist(), c[i].tolist(), d[i].tolist())
    return signs


class Plan(NamedTuple):
    """The planes of a region, cached with it. rows: as integers, in clipping order, without duplicates; tables: for the
    kernel, None if exponents are too far apart."""

    rows: list[Row]
    tables: PlaneTables | None


def plan_of(region: Solid, check: Check) -> Plan:
    """Return the `Plan` of a region, cached with it. Raises UnsupportedSolidError; for a polyhedron that is not convex
    its message names a face and a vertex beyond it."""
    planes = row_of(region).planes
    if planes is None:
        more = " that is convex, or use overlay for polygons in the plane"
        raise refused(region, "clip_polygons does not take", lambda row: row.planes, more, ("region",))

    def build() -> Plan:
        unique: dict[Row, None] = {}
        for turn, row in enumerate(planes(region, check)):
            if turn % _CHECK_EVERY == 0:
                check()
            unique[reduced(row)] = None
        return Plan(list(unique), _plane_tables(list(unique), 0, check))

    return region.prepared("clipping_plan", build, check)


def planes_of_rows(region: HalfSpace | Aabb | Convex, _: Check) -> Iterable[Row]:
    """Return the planes that bound a region as integer rows."""
    return map(integer_row, rows_of(region).tolist())


def planes_of_faces(region: Polyhedron, check: Check) -> Iterable[Row]:
    """Return the planes of the faces of a polyhedron as integer rows. Raises: UnsupportedSolidError if it is not
    convex."""
    return starmap(plane_through, region.vertices[_outward_triangles(region, check)].tolist())


class KernelScene(NamedTuple):
    """Input of the kernel: flat vertices (m * dim,), already times 2^-exponent, and the planes for them."""

    vertices: FloatArray
    exponent: int
    tables: PlaneTables


def kernel_scene(plan: Plan, vertices: FloatArray, largest: float, check: Check) -> KernelScene | None:
    """Return the input of the kernel, scaled if necessary; None if exponents are too far apart. largest: the largest
    |coordinate| of the vertices.
    """
    exponent = exponent_above(largest)
    points = shifted(vertices, -exponent) if exponent else vertices
    if points is None or exponent < _DEEPEST:
        return None
    tables = _plane_tables(plan.rows, exponent, check) if exponent else plan.tables
    return None if tables is None else KernelScene(points, exponent, tables)


def _plane_tables(planes: list[Row], exponent: int, check: Check) -> PlaneTables | None:
    """Return the tables of planes for vertices times 2^-exponent; None without planes, or if exponents are too far
    apart."""
    if not planes:
        return None
    high, low = np.zeros((len(planes), len(planes[0]))), np.zeros((len(planes), len(planes[0])))
    axes, at = np.full(len(planes), -1, np.int64), np.zeros(len(planes))
    rows: list[list[int]] = []
    for i, row in enumerate(planes):
        if i % _CHECK_EVERY == 0:
            check()
        *normal, offset = [x << exponent for x in row[:-1]] + [row[-1]] if exponent > 0 else row
        offset = offset << -exponent if exponent < 0 else offset
        rows.append([*normal, offset])
        shift = max(map(int.bit_length, normal))  # the row is divided by 2^shift: its largest number is about 1
        try:
            for k, number in enumerate([*normal, offset]):
                high[i, k], low[i, k] = _double_double(number, shift)
            across = [k for k, number in enumerate(normal) if number]
            if len(across) == 1:
                place, rest = nearest_pair(-offset, normal[across[0]])
                axes[i], at[i] = (across[0], place) if rest == 0 else (-1, 0.0)
        except OverflowError:
            return None
    packed = packed_numbers(rows) if are_all_safe(high) and are_all_safe(low) else None
    return None if packed is None else PlaneTables(high, low, axes, at, *packed)


def _double_double(number: int, shift: int) -> tuple[float, float]:
    """Return number / 2^shift as a double-double. Raises: OverflowError if the low part underflows."""
    high, low = nearest_pair(number, 1 << shift)
    if low == 0.0 and Fraction(high) * (1 << shift) != number:
        raise OverflowError(number)  # the low part underflows
    return high, low


def _outward_triangles(region: Polyhedron, check: Check) -> IntArray:
    """Return the triangles with area, counter-clockwise from outside; raise if the polyhedron is not convex."""
    vertices, triangles = region.vertices, region.triangles
    if (certificate := convexity(region)) is not None:
        return triangles if certificate.is_outward else triangles[:, ::-1]
    used = ascending(triangles)
    behind, before = np.zeros(len(triangles), bool), np.zeros(len(triangles), bool)
    step = max(1, _BATCH // len(used))
    for first in range(0, len(triangles), step):
        check()
        part = triangles[first : first + step]
        a, b, c = (np.repeat(vertices[part[:, k]], len(used), axis=0) for k in range(3))
        signs = orientations(a, b, c, np.tile(vertices[used], (len(part), 1))).reshape(len(part), len(used))
        behind[first : first + step], before[first : first + step] = (signs < 0).any(1), (signs > 0).any(1)
        for row in np.flatnonzero((behind & before)[first : first + step])[:1]:
            sides = [used[np.argmax(signs[row] == side)] for side in (-1, 1)]
            named = " and ".join(f"{vertex} at {digits(vertices[vertex])}" for vertex in sides)
            raise _not_convex(f"vertices {named} lie on both sides of face", region, first + int(row))
    if not (behind | before).any():
        raise _not_convex("it has no interior, all vertices lie in the plane of face", region, 0)
    if behind.any() and before.any():
        odd = np.argmax(before if behind[np.argmax(behind | before)] else behind)
        raise _not_convex("other faces are turned the other way round than face", region, int(odd))
    oriented = triangles[behind | before]
    oriented = oriented if behind.any() else oriented[:, ::-1]
    a, b, c = (np.tile(vertices[oriented[0, k]], (len(used), 1)) for k in range(3))
    signs = orientations(a, b, c, vertices[used])
    simplex = [*vertices[oriented[0]], vertices[used[np.argmax(signs != 0)]]]
    middle = [sum(map(Fraction, column)) / 4 for column in np.array(simplex).T.tolist()]
    if rational_location(middle, region, None, check) != Location.INSIDE:
        raise _not_convex("its faces cover the hull an even number of times, among them face", region, 0)
    return oriented


def _not_convex(what: str, region: Polyhedron, triangle: int) -> UnsupportedSolidError:
    """Return the error for a polyhedron that is not convex; what: the reason, at this triangle's face."""
    face = int(region.triangle_faces[triangle])
    return UnsupportedSolidError(
        f"the polyhedron is not convex: {what} {face}; clip_polygons takes a half_space, aabb, convex or convex "
        "polyhedron, clip_segments any polyhedron; overlay clips polygons of the plane on concave ones",
        ("region", "faces", face),
    )
