"""Exact order of two ends of pieces of one segment whose parameters round alike, compiled.

Ends that a plane cuts, a row of a body without a pose or a triangle of a mesh, divide the segment by the distances of
its own ends from the plane, as exact expansions; the order of two is a sign (parameters.py). Ends on equal planes, or
of the same piece of equal bodies under one pose, are equal without that. What is left, balls above all, is UNDECIDED.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.compiling.jit import called, inline
from engine.lanes.lanes import array_at
from engine.predicates.error_free import workspace
from engine.predicates.expansion import Components, grow, grow_product, magnitude
from engine.predicates.parameters import compare_products
from engine.scenes.near_boxes import N_BODIES, NAMES, PLACED, place_in
from engine.scenes.posed_mesh import mesh_at
from engine.segment_clipping.on_boundary.crossing_values import MOST_COMPONENTS, PLANE, is_item_safe, size_at
from engine.segment_clipping.pieces import point_of
from engine.solids.registry import BodyKind
from engine.types import UNDECIDED, FloatArray, IntArray

_FRAME: Final = 21
"""Numbers of a frame (table.py)."""


@called
def compare_ends(first: int, second: int, given: Any, segments: FloatArray, words: IntArray) -> int:
    """Return the sign of the difference of the parameters, equal as doubles, of two ends (2 * piece + side) of pieces
    of one segment; or UNDECIDED. given: as in `sort_rounded`; words: both rows of `words_of`."""
    source, bodies, are_long, _, _, t, faces = given
    (i, side), (j, other) = (first // 2, first % 2), (second // 2, second % 2)
    if i == j and are_long[i] != UNDECIDED:
        return (side - other) * int(are_long[i])
    face, its = faces[i, side], faces[j, other]
    a, b = array_at(_row_of(words, bodies[i]), (4,), np.int64), array_at(_row_of(words, bodies[j]), (4,), np.int64)
    if face >= 0 and its >= 0:
        if min(a[0], b[0]) <= BodyKind.OTHER or not _are_equal(a[3], b[3], _FRAME):
            return UNDECIDED
        are_twins = a[2] == b[2] or (a[0] == BodyKind.BALL and b[0] == BodyKind.BALL and _are_equal(a[2], b[2], 7))
        if are_twins and side == other and t[i, 0] < t[i, 1] and t[j, 0] == t[i, 0] and t[j, 1] == t[i, 1]:
            return 0  # pieces of one body that are longer than a point have different parameters
        if a[0] == BodyKind.ROWS and b[0] == BodyKind.ROWS and _is_one_plane(a[2] + 32 * face, b[2] + 32 * its):
            return 0
    elif face < 0 and its < 0:
        return 0
    if not is_item_safe(segments, source[i]):
        return UNDECIDED
    wp, wq, vp, vq = workspace(192), workspace(192), workspace(192), workspace(192)
    n_wp, n_wq = _put_weights(a, face, side, segments, source[i], wp, wq)
    n_vp, n_vq = _put_weights(b, its, other, segments, source[i], vp, vq)
    if max(n_wp, n_wq, n_vp, n_vq) > MOST_COMPONENTS or n_wp + n_wq == 0 or n_vp + n_vq == 0:
        return UNDECIDED
    return compare_products(wp, n_wp, vq, n_vq, vp, n_vp, wq, n_wq, workspace(576))


@inline
def _row_of(words: IntArray, body: int) -> int:
    """Return the address of the row (4,) of the `Table` of a body, given by its index in the scene."""
    n, moved = words[1, N_BODIES], -1
    if n > 0:
        moved = place_in(array_at(words[1, NAMES], (n,), np.int64), body)
    return int(words[1, PLACED] + 32 * moved if moved >= 0 else words[0, PLACED] + 32 * body)


@inline
def _are_equal(first: int, second: int, n: int) -> bool:
    """Return whether two addresses, or the n doubles there, are equal; 0 is the address of nothing."""
    if first == second or first == 0 or second == 0:
        return first == second
    a, b, are_equal = array_at(first, (n,), np.float64), array_at(second, (n,), np.float64), True
    for k in range(n):
        are_equal &= a[k] == b[k]
    return are_equal


@inline
def _is_one_plane(first: int, second: int) -> bool:
    """Return whether the rows (4,) at two addresses are equal, or opposite."""
    a, b, are_equal, are_opposite = array_at(first, (4,), np.float64), array_at(second, (4,), np.float64), True, True
    for k in range(4):
        are_equal &= a[k] == b[k]
        are_opposite &= a[k] == -b[k]
    return are_equal or are_opposite


@called
def _put_weights(
    body: IntArray, face: int, side: int, segments: FloatArray, item: int, wp: Components, wq: Components
) -> tuple[int, int]:
    """Set expansions wp, wq (192 places) to the distances of both ends of segment ``item`` from the plane of a face, up
    to a common factor, or from its own end `side` if face is -1; return their numbers of components, more than
    MOST_COMPONENTS if the plane is unknown. body: row (4,) of a `Table`."""
    if face < 0:
        wp[0], wq[0] = 1.0, 1.0
        return side, 1 - side
    unknown, is_flat = (MOST_COMPONENTS + 1, 0), segments.shape[2] == 2
    if body[3] != 0 or (body[0] != BodyKind.MESH and body[0] != BodyKind.ROWS):
        return unknown
    if body[0] == BodyKind.MESH:
        mesh = mesh_at(body[2])
        if not (mesh.are_safe and face < mesh.faces.size and mesh.faces[face] == face):
            return unknown
        n_wp = size_at(mesh.elements, face, PLANE, segments, item, 0, wp)
        return n_wp, size_at(mesh.elements, face, PLANE, segments, item, 1, wq)
    row = array_at(body[2] + 32 * face, (4,), np.float64)
    n_wp = _put_distance(row, point_of(segments, item, 0, is_flat), wp)
    return n_wp, _put_distance(row, point_of(segments, item, 1, is_flat), wq)


@inline
def _put_distance(row: FloatArray, point: Any, e: Components) -> int:
    """Set expansion e to |dot(row, (point, 1))|; return its number of components, at most 7."""
    n = grow(e, 0, row[3])
    for k in range(3):
        n = grow_product(e, n, row[k], point[k])
    return magnitude(e, n)
