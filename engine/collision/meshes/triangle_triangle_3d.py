"""Batches of triangle pairs in space: closed surfaces, disjoint or touching."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.collision.codes import DISJOINT, TOUCHING, UNSETTLED
from engine.collision.meshes.mesh_arrays import NO_AREA, UNKNOWN_AXIS, axis_of
from engine.collision.meshes.triangle_triangle import APART, Triangle3, classify_exactly, classify_near, with_pose
from engine.jit import inline, kernel
from engine.predicates.loading import as_point3
from engine.types import UNDECIDED


@inline
def as_triangle3(triangles: Any, item: int) -> Triangle3:
    """Load row `item` of (n, 3, 3) triangles."""
    return Triangle3(as_point3(triangles[item], 0), as_point3(triangles[item], 1), as_point3(triangles[item], 2))


@inline
def are_boxes_apart(t: Triangle3, u: Triangle3) -> bool:
    """Tell whether the bounding boxes have no common point."""
    return (
        max(t.p.x, t.q.x, t.r.x) < min(u.p.x, u.q.x, u.r.x)
        or max(u.p.x, u.q.x, u.r.x) < min(t.p.x, t.q.x, t.r.x)
        or max(t.p.y, t.q.y, t.r.y) < min(u.p.y, u.q.y, u.r.y)
        or max(u.p.y, u.q.y, u.r.y) < min(t.p.y, t.q.y, t.r.y)
        or max(t.p.z, t.q.z, t.r.z) < min(u.p.z, u.q.z, u.r.z)
        or max(u.p.z, u.q.z, u.r.z) < min(t.p.z, t.q.z, t.r.z)
    )


@kernel
def relate_triangles_3d(first: Any, second: Any, relations: Any) -> None:
    """Fill relations (n,) int8 for the pairs of rows of two (n, 3, 3) float64 arrays, degenerate ones UNSETTLED."""
    poses = np.zeros((1, 12))  # nothing here has one
    for item in range(relations.shape[0]):
        t, u = as_triangle3(first, item), as_triangle3(second, item)
        relations[item] = UNSETTLED
        if are_boxes_apart(t, u):
            relations[item] = DISJOINT
            continue
        axis, other_axis = axis_of(t.p, t.q, t.r), axis_of(u.p, u.q, u.r)
        if axis in (NO_AREA, UNKNOWN_AXIS) or other_axis in (NO_AREA, UNKNOWN_AXIS):
            continue
        how = classify_near(t, u, 0.0)
        if how == UNDECIDED:
            how = classify_exactly(poses, with_pose(t), with_pose(u), axis, 0.0)
        if how != UNDECIDED:
            relations[item] = DISJOINT if how == APART else TOUCHING
