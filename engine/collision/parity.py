"""Is a vertex of one placed body inside another placed body: crossings of the half-line above it.

The half-line from q upward (z) is moved by (eps, eps^2) in x and y, so that it meets no edge and no upright face: an
orient2d that is exactly zero takes the sign of the first nonzero derivative. A face that the half-line's line meets
counts if it lies above q (orient3d); a zero there means q lies on it. Caller guarantees that no face of the other body
holds q where INSIDE or OUTSIDE is to be relied on; UNDECIDED is settled with exact posed coordinates
(`exact_cells.py`).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.bounding.bvh import MAX_DEPTH
from engine.collision.dual_traversal import placed_triangle
from engine.collision.placement import (
    Placement,
    PoseArrays,
    orient2d_near,
    orient3d_near,
    placed_box,
    placed_point,
    placement_of,
)
from engine.collision.shell import ShellArrays
from engine.collision.triangle_triangle import Triangle3
from engine.jit import inline, kernel
from engine.types import UNDECIDED, Point2, Point3

OUTSIDE = -1
INSIDE = 1
MISSED = 3
"""`half_line_crosses` beside 0 (on the face), 1 (above), -1 (below) and UNDECIDED: the moved line passes by."""


@inline
def moved_side(a: Point3, b: Point3, q: Point3, error: float) -> int:
    """Return the side of the line a b, seen along z, on which q moved by (eps, eps^2) lies; 0 if a and b coincide
    there.

    The derivatives of orient2d(a, b, q) are a.y - b.y along x and b.x - a.x along y.
    """
    side = orient2d_near(Point2(a.x, a.y), Point2(b.x, b.y), Point2(q.x, q.y), error)
    if side != 0:
        return side
    if a.y != b.y:
        return 1 if a.y > b.y else -1
    if a.x != b.x:
        return 1 if b.x > a.x else -1
    return 0


@inline
def half_line_crosses(t: Triangle3, q: Point3, error: float) -> int:
    """Return where the moved vertical line through q meets t: above q 1, below -1, at q 0, else MISSED; or
    UNDECIDED."""
    p_side = moved_side(t.p, t.q, q, error)
    q_side = moved_side(t.q, t.r, q, error)
    r_side = moved_side(t.r, t.p, q, error)
    has_left = p_side == 1 or q_side == 1 or r_side == 1
    has_right = p_side == -1 or q_side == -1 or r_side == -1
    if has_left and has_right:
        return MISSED
    if p_side == UNDECIDED or q_side == UNDECIDED or r_side == UNDECIDED:
        return UNDECIDED
    if p_side == 0 or q_side == 0 or r_side == 0:  # case: two corners above one another, an upright face
        return MISSED
    side = orient3d_near(t.p, t.q, t.r, q, error)  # counter-clockwise from above: 1 if q is above the face
    if side == UNDECIDED or side == 0:
        return side
    return -side if has_left else side


@inline
def locate_point(q: Point3, q_error: float, shell: ShellArrays, place: Placement) -> int:
    """Return INSIDE, OUTSIDE, 0 (on a face) or UNDECIDED for one point."""
    error = max(q_error, place.error)
    reach = 2.0 * q_error  # twice: it covers the rounding of q.x + reach
    stack = np.empty(MAX_DEPTH + 2, np.int64)
    stack[0] = 0
    n_stack, n_above = 1, 0
    unsure, on_face = False, False
    while n_stack > 0:  # bound: each node enters once
        n_stack -= 1
        node = stack[n_stack]
        box = placed_box(shell.boxes, node, place)
        if (
            q.x + reach < box.x0
            or q.x - reach > box.x1
            or q.y + reach < box.y0
            or q.y - reach > box.y1
            or q.z - reach > box.z1
        ):
            continue
        child = shell.child[node]
        if child >= 0:
            stack[n_stack] = child
            stack[n_stack + 1] = child + 1
            n_stack += 2
            continue
        how = half_line_crosses(placed_triangle(shell, -1 - child, place), q, error)
        if how == UNDECIDED:
            unsure = True
        elif how == 0:
            on_face = True
        elif how == 1:
            n_above += 1
    if on_face:
        return 0
    if unsure:
        return UNDECIDED
    return INSIDE if n_above % 2 == 1 else OUTSIDE


@kernel
def locate_vertices(
    source: ShellArrays,
    source_pose: PoseArrays,
    vertices: Any,
    shell: ShellArrays,
    pose: PoseArrays,
    found: Any,
    flag: Any,
) -> None:
    """Fill found (n,) int8 for the vertices (n,) of `source` against `shell`, each under its one pose."""
    a = placement_of(source_pose)
    b = placement_of(pose)
    for item in range(vertices.shape[0]):
        if flag[0] != 0:
            return
        found[item] = locate_point(placed_point(source.vertices, vertices[item], a), a.error, shell, b)
