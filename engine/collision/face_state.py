"""How a face lies among the other faces of its own body: clean, crossed or stacked (see `shell.py`).

A strict crossing of two faces proves that two interiors overlap if nothing else of the two bodies cancels or fans out
along it. Near a general point of the crossing line a body whose face is clean there is a half-space; the other body's
face, not stacked, changes its inside on both sides of the first plane: so one of its two changes lies in that
half-space. Hence the rule `proves_overlap`. The state of a face does not depend on a pose, is computed on demand from
exact signs of the unposed coordinates, and kept.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.bounding.bvh import MAX_DEPTH
from engine.collision.placement import Box, Placement, are_apart, orient2d_near, orient3d_near, placed_box
from engine.collision.shell import (
    STATE_CLEAN,
    STATE_CROSSED,
    STATE_STACKED,
    STATE_UNKNOWN,
    ShellArrays,
)
from engine.collision.triangle_triangle import (
    CROSSING,
    Triangle3,
    classify_pair,
    is_straddling,
    outside_an_edge,
    projected,
    separation,
)
from engine.jit import inline, kernel
from engine.predicates.loading import as_point3
from engine.types import UNDECIDED, Point3

_NO_PLACE = Placement(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, False, 0.0, 0.0)


@inline
def _box_of(t: Triangle3) -> Box:
    return Box(
        min(t.p.x, t.q.x, t.r.x),
        min(t.p.y, t.q.y, t.r.y),
        min(t.p.z, t.q.z, t.r.z),
        max(t.p.x, t.q.x, t.r.x),
        max(t.p.y, t.q.y, t.r.y),
        max(t.p.z, t.q.z, t.r.z),
    )


@inline
def triangle_of(shell: ShellArrays, item: int) -> Triangle3:
    """Load a triangle in the body's own coordinates."""
    return Triangle3(
        as_point3(shell.vertices, shell.triangles[item, 0]),
        as_point3(shell.vertices, shell.triangles[item, 1]),
        as_point3(shell.vertices, shell.triangles[item, 2]),
    )


@inline
def edge_meets_inside(t: Triangle3, axis: int, a: Point3, b: Point3) -> bool:
    """Tell whether the segment a b in the plane of t may meet its relative interior (True where unsure)."""
    p, q, r = projected(t.p, axis), projected(t.q, axis), projected(t.r, axis)
    s, e = projected(a, axis), projected(b, axis)
    if orient2d_near(p, q, r, 0.0) < 0:
        q, r = r, q
    how = outside_an_edge(p, q, r, s, e, e)
    if how >= 0:  # 0, 1: some edge has the segment outside or on it
        return how == UNDECIDED
    p_side, q_side, r_side = (
        orient2d_near(s, e, p, 0.0),
        orient2d_near(s, e, q, 0.0),
        orient2d_near(s, e, r, 0.0),
    )
    above = p_side > 0 or q_side > 0 or r_side > 0  # UNDECIDED counts for either
    below = p_side < 0 or q_side < 0 or r_side < 0
    unsure = p_side == UNDECIDED or q_side == UNDECIDED or r_side == UNDECIDED
    return unsure or (above and below)


@inline
def state_by(shell: ShellArrays, face: int, other: int) -> int:
    """Return what one other face of the body makes of the state of `face` (which has an area)."""
    if shell.axis[other] == -1:
        return STATE_CLEAN
    if shell.axis[other] < 0:
        return STATE_STACKED
    t, o = triangle_of(shell, face), triangle_of(shell, other)
    axis = int(shell.axis[face])
    p = orient3d_near(t.p, t.q, t.r, o.p, 0.0)
    q = orient3d_near(t.p, t.q, t.r, o.q, 0.0)
    r = orient3d_near(t.p, t.q, t.r, o.r, 0.0)
    if p == UNDECIDED or q == UNDECIDED or r == UNDECIDED:
        return STATE_STACKED
    if p == 0 and q == 0 and r == 0:
        how = separation(t, o, axis)
        return STATE_STACKED if (how < 0 or how == UNDECIDED) else STATE_CLEAN
    if is_straddling(p, q, r):
        how = classify_pair(t, o, axis, 0.0)
        if how == UNDECIDED:
            return STATE_STACKED
        return STATE_CROSSED if how == CROSSING else STATE_CLEAN
    if p == 0 and q == 0:
        return STATE_CROSSED if edge_meets_inside(t, axis, o.p, o.q) else STATE_CLEAN
    if q == 0 and r == 0:
        return STATE_CROSSED if edge_meets_inside(t, axis, o.q, o.r) else STATE_CLEAN
    if r == 0 and p == 0:
        return STATE_CROSSED if edge_meets_inside(t, axis, o.r, o.p) else STATE_CLEAN
    return STATE_CLEAN


@inline
def state_of(shell: ShellArrays, face: int) -> int:
    """Return the state of a face, computed at the first question; a face without area counts as stacked."""
    known = int(shell.state[face])
    if known != STATE_UNKNOWN:
        return known
    state = STATE_STACKED
    if shell.axis[face] >= 0:
        state = STATE_CLEAN
        t = triangle_of(shell, face)
        box = _box_of(t)
        stack = np.empty(MAX_DEPTH + 2, np.int64)
        stack[0] = 0
        n_stack = 1
        while n_stack > 0 and state != STATE_STACKED:  # bound: each node enters once
            n_stack -= 1
            node = stack[n_stack]
            if are_apart(box, placed_box(shell.boxes, node, _NO_PLACE)):
                continue
            child = shell.child[node]
            if child >= 0:
                stack[n_stack] = child
                stack[n_stack + 1] = child + 1
                n_stack += 2
            elif -1 - child != face:
                state = max(state, state_by(shell, face, -1 - child))
    shell.state[face] = state
    return state


@inline
def proves_overlap(first: ShellArrays, i: int, second: ShellArrays, j: int) -> bool:
    """Tell whether a strict crossing of these two faces proves that the open interiors of two solids meet."""
    a = state_of(first, i)
    if a == STATE_STACKED:
        return False
    b = state_of(second, j)
    return b != STATE_STACKED and (a == STATE_CLEAN or b == STATE_CLEAN)


@kernel
def find_states(shell: ShellArrays, faces: Any, states: Any) -> None:
    """Fill states (n,) with the state of each of `faces` (n,)."""
    for item in range(faces.shape[0]):
        states[item] = state_of(shell, faces[item])
