"""Many pairs of triangles that are equally near: parallel plates, bodies along a common axis.

The planes across one gap, at its ends, are its walls (`exact.py`). If all vertices of both bodies lie on the walls or
beyond them, the gap is the distance of the bodies, and the nearest points of any other nearest pair lie on the walls,
one straight across from the other. So only triangles with a corner on a wall count, and of these only those whose
corners there may lie across from each other. Sides of vertices are exact, on whole arrays of Python's integers.
"""

from __future__ import annotations

from itertools import groupby
from typing import Any, Final

import numpy as np

from engine.collision.meshes.exact_body import ExactBody
from engine.collision.meshes.mesh_arrays import MeshBody
from engine.distance.exact import Gap, Wall, nearest_of_triangles, walls
from engine.running.budget import Budget
from engine.types import BoolArray, FloatArray, IntArray

_MOST_TRIES: Final = 256
"""Number of pairs of triangles that are measured in integers until one is as near."""
_FEW: Final = 256
"""Number of pairs that are sooner sorted one by one."""
_TOLERANCE: Final = 2.0**-30
"""Enlargement of boxes in the wall, as part of the coordinates: far above their rounding."""


def ranks(mesh: MeshBody, triangles: IntArray) -> IntArray:
    """Return numbers (n,) that order triangles (n,) by the caller's faces, then by corners, whatever the tree."""
    some, places = np.unique(triangles, return_inverse=True)
    corners = mesh.arrays.vertices[mesh.arrays.triangles[some]].reshape(len(some), 9)
    numbers = np.empty(len(some), np.int64)
    numbers[np.lexsort((*corners.T[::-1], mesh.faces[some]))] = np.arange(len(some))
    return np.asarray(numbers[places.reshape(-1)], np.int64)


def in_order(meshes: tuple[MeshBody, MeshBody], pairs: IntArray) -> IntArray:
    """Return rows (n, 4) that begin with a triangle of each body in the order of ties: by faces, then by corners."""
    a, b = meshes
    faces = list(zip(a.faces[pairs[:, 0]].tolist(), b.faces[pairs[:, 1]].tolist()))
    if len(pairs) <= _FEW and len(set(faces)) == len(faces):
        return pairs[sorted(range(len(faces)), key=faces.__getitem__)]
    keys = ranks(b, pairs[:, 1]), ranks(a, pairs[:, 0]), b.faces[pairs[:, 1]], a.faces[pairs[:, 0]]
    return np.asarray(pairs[np.lexsort(keys)], np.int64)


def nearest_between_walls(bodies: tuple[ExactBody, ExactBody], pairs: IntArray, budget: Budget) -> IntArray | None:
    """Return the row of the nearest pair of two disjoint bodies, of equal ones that with the lowest faces: a triangle
    of each and feature codes. None if the walls of the first of pairs (n, 4) prove nothing. pairs: candidates, likely
    ones first."""
    i, j, *codes = pairs[0].tolist()
    gap = nearest_of_triangles(bodies[0].corners(i), bodies[1].corners(j), *codes)
    own, their = walls(gap)
    sides = _heights(bodies[0], own), _heights(bodies[1], their)
    if any(bool((side > 0).any()) for side in sides):
        return None
    budget.check()
    most = max(map(abs, own[0]))  # beyond the largest double where coordinates are
    axes = np.linalg.svd([[x / most for x in own[0]]])[2][1:]
    live = [_on_wall(body, (side == 0).astype(bool), axes) for body, side in zip(bodies, sides)]
    found = _lowest(bodies, gap, live, budget)
    return None if found is None else np.array([*found, *codes])


def _heights(body: ExactBody, wall: Wall) -> Any:
    """Return an array (n,) of integers: how far the vertices of a body lie before a wall, 0 on it, negative beyond."""
    n, at, size = wall
    axes = [axis for axis in range(3) if n[axis]]
    return body.vertices(axes) @ np.array([n[axis] * size for axis in axes], object) - at


def _on_wall(body: ExactBody, is_on: BoolArray, axes: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return (triangles, boxes): those with a corner on the wall, in the order of ties, and bounds (n, 4) of these
    corners along two axes in the wall, low, low, high, high, enlarged. is_on: whether vertices are on the wall."""
    arrays, pose = body.mesh.arrays, body.pose
    triangles = np.flatnonzero(is_on[arrays.triangles].any(axis=1))
    triangles = triangles[np.argsort(ranks(body.mesh, triangles))]
    corners = arrays.triangles[triangles]
    points = arrays.vertices @ pose.rotations[0].T + pose.translations[0]
    flat = (points @ axes.T)[corners]
    out = ~is_on[corners][:, :, None]
    margin = _TOLERANCE * float(np.abs(points).max(initial=0.0))
    low, high = np.where(out, np.inf, flat).min(axis=1), np.where(out, -np.inf, flat).max(axis=1)
    return triangles, np.concatenate([low - margin, high + margin], axis=1)


def _lowest(
    bodies: tuple[ExactBody, ExactBody], gap: Gap, live: list[tuple[IntArray, FloatArray]], budget: Budget
) -> tuple[int, int] | None:
    """Return the two triangles of the lowest faces that are as near as the gap; None after `_MOST_TRIES` without one.
    live: of either body, what `_on_wall` returns."""
    (own, boxes), (their, others) = live
    faces, their_faces, n_tries = bodies[0].mesh.faces, bodies[1].mesh.faces, 0
    for _, rows in groupby(range(len(own)), key=lambda row: int(faces[own[row]])):
        best: tuple[int, int, int] | None = None
        for row in rows:
            budget.check()
            is_near = (others[:, :2] <= boxes[row, 2:]).all(axis=1) & (others[:, 2:] >= boxes[row, :2]).all(axis=1)
            for at in np.flatnonzero(is_near).tolist():
                face = int(their_faces[their[at]])
                if best is not None and face >= best[0]:
                    break
                n_tries += 1
                if n_tries > _MOST_TRIES:
                    return None
                s, t = bodies[0].corners(int(own[row])), bodies[1].corners(int(their[at]))
                other = nearest_of_triangles(s, t, gap.first, gap.second)
                if not gap.is_less(other):
                    best = face, int(own[row]), int(their[at])
        if best is not None:
            return best[1:]
    return None
