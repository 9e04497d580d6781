"""Exact fallback: locates one point of any rational coordinates in any solid, posed or not, in integer arithmetic.

Plain Python, one point at a time: for points that compiled kernels leave UNDECIDED, and for points that are no float64
(exact images under a pose, sample points of an arrangement). A common positive denominator does not change a sign, so
every decision is the sign of a polynomial of Python integers.

Source: the sign rules are those of polyhedron_ray_parity.py and polygon_ray_parity.py, without a filter.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np

from engine.bounding.trees import boxes_of
from engine.containment.methods.polyhedron_ray_parity import list_uncertain
from engine.errors import UnsupportedSolidError
from engine.predicates.orientation import tie_sign_exact
from engine.predicates.rational import (
    Number,
    common_integers,
    cross,
    dot,
    minus,
    polynomial_sign_rational,
    scaled_integers,
    side_rational,
    sign_of,
)
from engine.solids.base import Solid
from engine.solids.csg import Csg
from engine.solids.implicit import Implicit
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.pose import Pose
from engine.solids.primitives import Aabb, Convex, HalfSpace, Sphere, Triangle, rows_of
from engine.solids.ragged import next_in_rings
from engine.solids.registry import Row, kind_of, names, row_of
from engine.types import FloatArray, IntArray

Check: TypeAlias = Callable[[], object]
Integers: TypeAlias = tuple[int, ...]

OUTSIDE, BOUNDARY, INSIDE = -1, 0, 1
MISSED, CROSSED, ON_FACE = 0, 1, 2
_CHECK_EVERY = 64
_MOST_UNSURE = 1 << 10


def no_check() -> None:
    """Do nothing: the check of a call without a `Budget`."""


def _orient2d(a: Sequence[int], b: Sequence[int], c: Sequence[int]) -> int:
    """Return 1 for a left turn a, b, c in the plane, -1 for a right turn, 0 if collinear."""
    return sign_of((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _orient3d(a: Sequence[int], b: Sequence[int], c: Sequence[int], d: Sequence[int]) -> int:
    """Return 1 if d is on the side that the normal of triangle abc points to, -1 on the other side, 0 in its plane."""
    return sign_of(dot(cross(minus(b, a), minus(c, a)), minus(d, a)))


def _is_on_closed_triangle(a: Integers, b: Integers, c: Integers, q: Integers) -> bool:
    """Return whether q lies on the closed triangle abc in space, which may be degenerate. For q in the plane of the
    triangle: it is inside exactly if in no projection it is on both sides of the three edges. Off the line of a
    degenerate triangle some projection has both sides, since the three signed areas add up to zero."""
    if any(not min(a[k], b[k], c[k]) <= q[k] <= max(a[k], b[k], c[k]) for k in range(3)):
        return False
    if _orient3d(a, b, c, q) != 0:
        return False
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        flat = [(p[i], p[j]) for p in (a, b, c, q)]
        turns = {_orient2d(flat[e], flat[(e + 1) % 3], flat[3]) for e in range(3)}
        if 1 in turns and -1 in turns:
            return False
    return True


def _cross_upwards(a: Integers, b: Integers, c: Integers, q: Integers) -> int:
    """Return ON_FACE if q lies on triangle abc, CROSSED if the upward ray from q + (eps, eps^2, 0) crosses it, else
    MISSED. All coordinates are integers over one denominator."""
    area = _orient2d(a, b, c)
    if area != 0:
        turns = [_orient2d(p, r, q) for p, r in ((a, b), (b, c), (c, a))]
        if -area in turns:
            return MISSED
        side = _orient3d(a, b, c, q) * area
        if side == 0:
            return ON_FACE
        for turn, (p, r) in zip(turns, ((a, b), (b, c), (c, a))):
            if turn == 0 and tie_sign_exact(*p[:2], *r[:2]) != area:
                return MISSED
        return CROSSED if side < 0 else MISSED
    return ON_FACE if _is_on_closed_triangle(a, b, c, q) else MISSED


def _enclosing_floats(value: Number) -> tuple[float, float]:
    """Return doubles (low, high) with low <= value <= high, equal where value is a double; infinite beyond float64."""
    try:
        near = float(value)
    except OverflowError:
        return (1.7976931348623157e308, math.inf) if value > 0 else (-math.inf, -1.7976931348623157e308)
    if near == value:
        return near, near
    return math.nextafter(near, -math.inf), math.nextafter(near, math.inf)


def triangle_boxes(solid: Polyhedron) -> FloatArray:
    """Return (6, n_triangles): rows xmin, xmax, ymin, ymax, zmin, zmax of the boxes of the triangles, made once."""

    def build() -> FloatArray:
        boxes = boxes_of(solid.vertices, solid.triangles)
        return np.ascontiguousarray(boxes.reshape(-1, 2, 3).transpose(2, 1, 0).reshape(6, -1))

    return solid.prepared("triangle_boxes", build)


def _uncertain_triangles(point: Sequence[Number], solid: Polyhedron) -> tuple[IntArray, bool]:
    """Return the triangles (n, 3) that the upward ray from a point may meet, and whether it crosses an odd number of
    the others: by the tree if it is built, else by comparison with all boxes."""
    near = [_enclosing_floats(value) for value in point]
    tree, uncertain = solid.cached("tree"), np.empty(_MOST_UNSURE, np.int64)
    if tree is not None:
        middle = [low if math.isfinite(low) else high for low, high in near]
        n_uncertain, odd = list_uncertain(tree, *middle, 2.0 * max(high - low for low, high in near), uncertain)
        if n_uncertain >= 0:
            return tree.triangles[uncertain[:n_uncertain]], odd
    boxes = triangle_boxes(solid)
    is_near = (boxes[0] <= near[0][1]) & (boxes[1] >= near[0][0]) & (boxes[2] <= near[1][1])
    is_near &= (boxes[3] >= near[1][0]) & (boxes[5] >= near[2][0])
    return solid.triangles[is_near], False


def in_polyhedron(point: Sequence[Number], solid: Polyhedron, check: Check) -> int:
    """Return the location of a rational point in a polyhedron: INSIDE 1, BOUNDARY 0, OUTSIDE -1."""
    triangles, odd = _uncertain_triangles(point, solid)
    for first in range(0, len(triangles), _CHECK_EVERY):
        check()
        corners = solid.vertices[triangles[first : first + _CHECK_EVERY]].ravel().tolist()
        v = scaled_integers((*corners, *point))
        *vertices, q = zip(v[::3], v[1::3], v[2::3])
        for a, b, c in zip(vertices[::3], vertices[1::3], vertices[2::3]):
            met = _cross_upwards(a, b, c, q)
            if met == ON_FACE:
                return BOUNDARY
            odd ^= met == CROSSED
    return INSIDE if odd else OUTSIDE


def next_in_ring(solid: Polygon | Triangle) -> IntArray:
    """Return (n,) int64: the index of the vertex that follows each vertex in its ring, made once."""
    return solid.prepared("next_in_ring", lambda: next_in_rings(solid.ring_offsets))


def in_polygon(point: Sequence[Number], solid: Polygon | Triangle, check: Check) -> int:
    """Return the location of a rational point in a polygon or planar triangle: INSIDE 1, BOUNDARY 0, OUTSIDE -1."""
    starts, ends = solid.vertices, solid.vertices[next_in_ring(solid)]
    (x_low, _), (y_low, y_high) = _enclosing_floats(point[0]), _enclosing_floats(point[1])
    is_near = (np.minimum(starts[:, 1], ends[:, 1]) <= y_high) & (np.maximum(starts[:, 1], ends[:, 1]) >= y_low)
    is_near &= np.maximum(starts[:, 0], ends[:, 0]) >= x_low
    odd = False
    for turn, index in enumerate(np.flatnonzero(is_near)):
        if turn % _CHECK_EVERY == 0:
            check()
        v = scaled_integers((*starts[index].tolist(), *ends[index].tolist(), *point))
        a, b, q = v[0:2], v[2:4], v[4:6]
        turned = _orient2d(a, b, q)
        if turned == 0 and all(min(a[k], b[k]) <= q[k] <= max(a[k], b[k]) for k in (0, 1)):
            return BOUNDARY
        if (a[1] <= q[1]) != (b[1] <= q[1]):  # the ray to the right, moved up by eps, passes the edge's height
            odd ^= (turned > 0) == (a[1] < b[1])
    return INSIDE if odd else OUTSIDE


def prism_walls(solid: Triangle) -> list[list[int]]:
    """Return three integer plane rows (a, b, c, d), >= 0 in the prism over a triangle in space; zeros for zero area.
    Wall of the edge from p to r: dot(n x (r - p), x - p) >= 0 with n = (b - a) x (c - a), which is the textbook's
    comparison of cross products by their dot product."""

    def build() -> list[list[int]]:
        flat = scaled_integers((*solid.vertices.ravel().tolist(), 1))
        a, b, c = (tuple(flat[k : k + 3]) for k in (0, 3, 6))
        normal = cross(minus(b, a), minus(c, a))
        walls = []
        for p, r in ((a, b), (b, c), (c, a)):
            inward = cross(normal, minus(r, p))
            # in coordinates scaled by flat[9]: dot(inward, flat[9] x - p)
            walls.append([*(n * flat[9] for n in inward), -dot(inward, p)])
        return walls

    return solid.prepared("prism_walls", build)


def in_triangle(point: Sequence[Number], solid: Triangle, check: Check) -> int:
    """Return the location (1, 0, -1) of a rational point in a planar triangle, or in the prism over a triangle in
    space."""
    if solid.dimension == 2:
        return in_polygon(point, solid, check)
    return min(side_rational(wall, point) for wall in prism_walls(solid))


def in_rows(point: Sequence[Number], solid: HalfSpace | Aabb | Convex, _: Check) -> int:
    """Return the location (1, 0, -1) of a rational point in a solid bounded by planes."""
    return min(side_rational(row, point) for row in rows_of(solid).tolist())


def in_sphere(point: Sequence[Number], solid: Sphere, pose: Pose | None, _: Check) -> int:
    """Return the location (1, 0, -1) of a rational point in a ball; a pose moves the centre exactly and keeps the
    radius."""
    center: Sequence[Number] = solid.center.tolist()
    center = center if pose is None else to_world_frame(center, pose)
    *flat, r = scaled_integers((*center, *point, solid.radius))
    dimension = len(point)
    return sign_of(r * r - sum((flat[k] - flat[k + dimension]) ** 2 for k in range(dimension)))


def in_csg(point: Sequence[Number], solid: Csg, pose: Pose | None, check: Check) -> int:
    """Return the location (1, 0, -1) of a rational point in a CSG tree."""
    return int(fold_csg_tree(solid, lambda leaf: rational_location(point, leaf, pose, check), combine))


def in_implicit(point: Sequence[Number], solid: Implicit, _: Check) -> int:
    """Return the location (1, 0, -1) of a rational point in an implicit solid."""
    if solid.function is not None:
        value = np.asarray(solid.function(np.array([[float(x) for x in point]])), dtype=np.float64).ravel()[0]
        return sign_of(float(value))
    return polynomial_sign_rational(solid.powers.tolist(), solid.coefficients.tolist(), point)


def adjugate(r: Sequence[Sequence[Any]]) -> tuple[list[list[Any]], Any]:
    """Return adj(R) and det(R) of a matrix of floats or rationals; R^-1 = adj(R) / det(R)."""
    if len(r) == 2:
        return [[r[1][1], -r[0][1]], [-r[1][0], r[0][0]]], r[0][0] * r[1][1] - r[0][1] * r[1][0]

    def cofactor(i: int, j: int) -> Any:
        (i1, i2), (j1, j2) = ((i + 1) % 3, (i + 2) % 3), ((j + 1) % 3, (j + 2) % 3)
        return r[i1][j1] * r[i2][j2] - r[i1][j2] * r[i2][j1]

    adjugates = [[cofactor(j, i) for j in range(3)] for i in range(3)]
    return adjugates, sum(r[0][k] * adjugates[k][0] for k in range(3))


def to_body_frame(point: Sequence[Number], pose: Pose) -> list[Fraction]:
    """Return R^-1 (point - t), the exact preimage of `point` under `pose`."""
    numbers, common = common_integers((*point, *pose.translation.tolist()))
    moved = [value - shift for value, shift in zip(numbers, numbers[len(point) :])]
    rows, below = exact_inverse(pose)
    return [Fraction(sum(a * x for a, x in zip(row, moved)), below * common) for row in rows]


@functools.lru_cache(maxsize=64)
def exact_inverse(pose: Pose) -> tuple[list[list[int]], int]:
    """Return R^-1 of a pose as integer rows and their common denominator."""
    entries, common = common_integers(pose.rotation.ravel().tolist())
    dimension = len(pose.rotation)
    rows, determinant = adjugate([entries[k : k + dimension] for k in range(0, len(entries), dimension)])
    return [[common * entry for entry in row] for row in rows], determinant  # adj(D R) / D^(n - 1), det(D R) / D^n


def to_world_frame(point: Sequence[Number], pose: Pose) -> list[Fraction]:
    """Return R point + t, the exact image of `point` under `pose`."""
    entries, below = common_integers(pose.rotation.ravel().tolist())
    numbers, common = common_integers((*point, *pose.translation.tolist()))
    n, sums = len(point), [below * shift for shift in numbers[len(point) :]]
    for place, entry in enumerate(entries):
        sums[place // n] += entry * numbers[place % n]
    return [Fraction(total, below * common) for total in sums]


def rational_location(point: Sequence[Number], solid: Solid, pose: Pose | None = None, check: Check = no_check) -> int:
    """Locate one point exactly: 1 inside, 0 on the boundary, -1 outside.

    point: numbers of any exact kind, one per dimension of `solid`. pose: of the solid; vertices, half-spaces and boxes
    are mapped exactly; a sphere keeps its radius. check: called now and then in long work; whatever it raises ends the
    call.

        >>> from fractions import Fraction
        >>> from engine.solids.primitives import Aabb
        >>> rational_location([Fraction(1, 3), 0, 0], Aabb([0, 0, 0], [1, 1, 1]))
        0
    """
    check()
    row = row_of(solid)
    if row.exact_posed is not None:
        return row.exact_posed(point, solid, pose, check)
    if row.exact is None:
        raise unsupported(solid)
    return row.exact(point if pose is None else to_body_frame(point, pose), solid, check)


def combine(operation: str, located: Sequence[Any]) -> Any:
    """Return the location in a union (max), intersection (min) or difference (min(A, -B)) from the locations in the
    operands. located: numbers 1, 0, -1, or int8 arrays of one shape, one for each operand."""
    if operation == "difference":
        first, second = located
        return np.minimum(first, -second)
    return functools.reduce(np.maximum if operation == "union" else np.minimum, located)


def fold_csg_tree(solid: Csg, of_leaf: Callable[[Solid], Any], join: Callable[[str, list[Any]], Any]) -> Any:
    """Evaluate a CSG tree bottom-up: of_leaf(leaf), once for each distinct leaf, and join(operation, results of the
    operands) at each inner node; return the result at the root."""
    known: dict[int, Any] = {}

    def visit(node: Solid) -> Any:
        if id(node) not in known:
            if isinstance(node, Csg):
                known[id(node)] = join(node.operation, [visit(operand) for operand in node.operands])
            else:
                known[id(node)] = of_leaf(node)
        return known[id(node)]

    return visit(solid)


def unsupported(solid: object) -> UnsupportedSolidError:
    """Return the error for an object in which no point can be located, as it has no interior."""
    return UnsupportedSolidError(
        f"nothing is inside a {kind_of(solid)}; a point can be located in a {names(is_located)}. A closed triangle "
        "mesh is a polyhedron; a planar 3D polygon can be asked as triangles",
        ("solid",),
    )


def is_located(row: Row) -> bool:
    """Return whether points can be located in solids of a registry row's type."""
    return row.exact is not None or row.exact_posed is not None
