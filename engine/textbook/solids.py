"""Points in solids that are told by signs: implicit solids, half-spaces, convex polyhedra, and CSG trees of anything.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics (figure 22.22, left), for
clipping points section 22.4.2, for CSG trees exercise 22.4-2.

Points in a triangle of space: in the prism over it, or in its projection on a coordinate plane.

    ((b - a) x (p - a)) . n >= 0,  ((c - b) x (p - b)) . n >= 0,  ((a - c) x (p - c)) . n >= 0,  n = (b - a) x (c - a)

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics (figures 22.23 and 22.24). The
textbook calls the prism robust since the point need not lie in the plane exactly. For the projection the vertices are
put in an order with c on the left of ab; then the point must be on the left of ab, bc and ca.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine.compiling.jit import allocating_kernel, inline
from engine.predicates.vectors import as_point3, cross, dot, minus
from engine.types import BoolArray, FloatArray, IntArray, Point2, Point3

Leaf = Callable[[FloatArray], BoolArray]


@allocating_kernel
def in_implicit(points: FloatArray, powers: IntArray, coefficients: FloatArray) -> BoolArray:
    """Return (n,) bool for points (n, dim): whether f(x, y, z), the sum of coefficient x^i y^j z^k over t terms, is >=
    0. powers (t, dim): i, j, k; coefficients (t,). What goes wrong: near the surface f is a small difference of large
    terms, and rounding decides the sign."""
    contained = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        total = 0.0
        for j in range(len(coefficients)):
            term = coefficients[j]
            for k in range(points.shape[1]):
                term *= points[i, k] ** powers[j, k]
            total += term
        contained[i] = total >= 0.0
    return contained


@inline
def signed_distance(point: FloatArray, normal: FloatArray, offset: float) -> float:
    """Return dot(normal, point) + offset: the distance times the length of the normal, which points inward."""
    total = 0.0
    for k in range(len(normal)):
        total += normal[k] * point[k]
    return total + offset


@allocating_kernel
def in_convex(points: FloatArray, planes: FloatArray) -> BoolArray:
    """Return (n,) bool for points (n, dim): whether every plane row (normal, offset) of (m, dim + 1) is >= 0 there.
    What goes wrong: a row computed from rounded vertices is not the face's plane, and the sign is rounded once more: a
    point within a few units in the last place of a plane gets either answer."""
    contained = np.ones(len(points), np.bool_)
    dim = points.shape[1]
    for i in range(len(points)):
        for j in range(len(planes)):
            if signed_distance(points[i], planes[j, :dim], planes[j, dim]) < 0.0:
                contained[i] = False
                break
    return contained


def in_half_space(points: FloatArray, normal: FloatArray, offset: float) -> BoolArray:
    """Return (n,) bool for points (n, dim): whether a point is in the half-space, a convex body of one plane."""
    contained: BoolArray = in_convex(points, np.append(normal, offset)[None])
    return contained


def clip_points(points: FloatArray, normal: FloatArray, offset: float) -> FloatArray:
    """Return those of the points (n, dim) that are in the half-space."""
    kept: FloatArray = points[in_half_space(points, normal, offset)]
    return kept


def in_csg_tree(points: FloatArray, tree: Leaf | tuple[str, Any, Any]) -> BoolArray:
    """Return (n,) bool: whether the tree contains each point; recursive, as deep as the tree. A leaf is a function from
    points (n, dim) to bools (n,); a node is (operation, first, second), its operation applied to their answers. What
    goes wrong: two values cannot tell "on the surface", so the difference of a closed set keeps or loses its wall."""
    if not isinstance(tree, tuple):
        return tree(points)
    operation, first, second = tree
    a, b = in_csg_tree(points, first), in_csg_tree(points, second)
    if operation == "union":
        return a | b
    if operation == "intersection":
        return a & b
    if operation == "difference":
        return a & ~b
    raise ValueError(f"operation must be union, intersection or difference, got {operation!r}")


@inline
def is_in_prism(p: Point3, a: Point3, b: Point3, c: Point3) -> bool:
    """Return whether p is in the infinite prism over triangle abc along its normal, side faces included."""
    n = cross(minus(b, a), minus(c, a))
    return (
        dot(cross(minus(b, a), minus(p, a)), n) >= 0.0
        and dot(cross(minus(c, b), minus(p, b)), n) >= 0.0
        and dot(cross(minus(a, c), minus(p, c)), n) >= 0.0
    )


@allocating_kernel
def by_products(points: FloatArray, triangle: FloatArray) -> BoolArray:
    """Return (n,) bool for points (n, 3): whether a point is in the infinite prism over the triangle (3, 3), by cross
    and scalar products. What goes wrong: near the side faces rounding decides the sign; the triangle's normal
    underflows if it is small (all is inside)."""
    contained = np.zeros(len(points), np.bool_)
    a, b, c = as_point3(triangle, 0), as_point3(triangle, 1), as_point3(triangle, 2)
    for i in range(len(points)):
        contained[i] = is_in_prism(as_point3(points, i), a, b, c)
    return contained


@inline
def is_left(a: Point2, b: Point2, p: Point2) -> bool:
    """Return whether p is left of the line from a to b, or on it."""
    return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) >= 0.0


@inline
def project(p: Point3, axis: int) -> Point2:
    """Return p without its coordinate on `axis`."""
    if axis == 0:
        return Point2(p.y, p.z)
    if axis == 1:
        return Point2(p.z, p.x)
    return Point2(p.x, p.y)


@inline
def axis_of_largest_area(a: Point3, b: Point3, c: Point3) -> int:
    """Return the axis on which the normal of triangle abc has its largest component."""
    n = cross(minus(b, a), minus(c, a))
    if abs(n.x) >= abs(n.y) and abs(n.x) >= abs(n.z):
        return 0
    return 1 if abs(n.y) >= abs(n.z) else 2


@allocating_kernel
def by_projection(points: FloatArray, triangle: FloatArray) -> BoolArray:
    """Return (n,) bool for points (n, 3) in the plane of a triangle (3, 3): whether a point's projection along an axis
    is in the triangle's. What goes wrong: near an edge rounding decides the sign, less often than in space since fewer
    terms are added; points off the plane are answered by their projection."""
    contained = np.zeros(len(points), np.bool_)
    corners = as_point3(triangle, 0), as_point3(triangle, 1), as_point3(triangle, 2)
    axis = axis_of_largest_area(corners[0], corners[1], corners[2])
    a, b, c = project(corners[0], axis), project(corners[1], axis), project(corners[2], axis)
    if not is_left(a, b, c):
        a, b = b, a
    for i in range(len(points)):
        p = project(as_point3(points, i), axis)
        contained[i] = is_left(a, b, p) and is_left(b, c, p) and is_left(c, a, p)
    return contained
