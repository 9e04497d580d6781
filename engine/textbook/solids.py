"""Points in solids that are told by signs: implicit solids, half-spaces, convex polyhedra, and CSG trees of anything.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics (figure 22.22, left), for
clipping points section 22.4.2, for CSG trees exercise 22.4-2.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.compiling.jit import allocating_kernel, inline

Leaf = Callable[[FloatArray], BoolArray]


@allocating_kernel
def in_implicit(points: FloatArray, powers: IntArray, coefficients: FloatArray) -> BoolArray:
    """Tell of each point whether f >= 0, the sum of coefficient x^i y^j z^k.

    points (n, dim), powers (t, dim), coefficients (t,). What goes wrong: near the surface f is a small difference of
    large terms, and rounding decides the sign.
    """
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
    """Return dot(normal, point) + offset: a distance up to the length of the normal, which points inward."""
    total = 0.0
    for k in range(len(normal)):
        total += normal[k] * point[k]
    return total + offset


@allocating_kernel
def in_convex(points: FloatArray, planes: FloatArray) -> BoolArray:
    """Tell of each point (n, dim) whether every row (normal, offset) of planes (m, dim + 1) is >= 0 there.

    What goes wrong: a row computed from rounded vertices is not the face's plane, and the sign is rounded once more: a
    point within a few units in the last place of a plane gets either answer.
    """
    contained = np.ones(len(points), np.bool_)
    dim = points.shape[1]
    for i in range(len(points)):
        for j in range(len(planes)):
            if signed_distance(points[i], planes[j, :dim], planes[j, dim]) < 0.0:
                contained[i] = False
                break
    return contained


def in_half_space(points: FloatArray, normal: FloatArray, offset: float) -> BoolArray:
    """Tell of each point (n, dim) whether it is in the half-space: a convex body of one plane."""
    contained: BoolArray = in_convex(points, np.append(normal, offset)[None])
    return contained


def clip_points(points: FloatArray, normal: FloatArray, offset: float) -> FloatArray:
    """Return the points that the half-space holds: each is either removed or preserved."""
    kept: FloatArray = points[in_half_space(points, normal, offset)]
    return kept


def in_csg_tree(points: FloatArray, tree: Leaf | tuple[str, Any, Any]) -> BoolArray:
    """Tell of each point whether the tree holds it; recursive, as deep as the tree.

    A leaf is a function from points (n, dim) to bools (n,); a node is (operation, first, second), its operation applied
    to their answers. What goes wrong: two values cannot tell "on the surface", so the difference of a closed set keeps
    or loses its wall.
    """
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
