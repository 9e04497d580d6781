"""All pairs of faces of two placed bodies that have a common point, or the first pair that settles the question.

Two trees are descended together: a pair of nodes is replaced by those pairs of their children whose boxes
(`box_lanes.meeting`) and discs (`lanes/discs.py`) may meet, two blocks of faces by the pairs of faces that neither
boxes nor planes part (`lanes/faces.py`); those are classified by signs. All of these are conservative under a pose, so
no contact is missed.

The search can be left when its room for pairs is full and taken up again: what it still has to do is in `Descent`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.arrays import Float32Array, FloatArray, Int32Array, IntArray
from engine.bounding.bvh import MAX_DEPTH
from engine.collision.meshes.face_state import proves_overlap, state_of
from engine.collision.meshes.frames import defect_of, set_frame
from engine.collision.meshes.mesh_arrays import STATE_CLEAN, ShellArrays, triangle_of
from engine.collision.meshes.placement import (
    Placement,
    PoseArrays,
    place_pair,
    placed,
    placed_axis,
)
from engine.collision.meshes.triangle_triangle import (
    APART,
    CROSSING,
    PosedTriangle,
    Triangle3,
    classify_exactly,
    classify_near,
    unposed,
)
from engine.jit import inline
from engine.lanes.boxes import FRAME_ROWS, meeting
from engine.lanes.discs import discs_meeting
from engine.lanes.faces import WORK_ROWS, faces_meeting
from engine.lanes.lanes import lowest_bit
from engine.lanes.tracing import LANES
from engine.predicates.loading import as_point3
from engine.predicates.posed import UNPOSED, PosedPoint3, posed_error
from engine.types import UNDECIDED

SEEK_OVERLAP = 0
SEEK_PIERCING_BY_FIRST = 1
SEEK_PIERCING_BY_SECOND = 2
SEEK_CONTACT = 3
"""What ends a search early: a crossing that proves overlapping interiors; one that proves that the first (second) body,
a surface, passes through the interior of the other; any contact at all."""

DONE = 0
SETTLED = 1
FULL = 2
INTERRUPTED = 3
"""How a search ended: all pairs seen; the pair at row 0 settles the question; no room for more pairs (go on with the
same `Descent`); the flag was raised."""

STACK_ROWS = LANES * LANES * 2 * MAX_DEPTH
"""A pair of nodes is replaced by at most 64, one of the two nodes a level deeper: bound of what is waiting."""


class Descent(NamedTuple):
    """Work space of a search, and what it still has to do.

    stack (STACK_ROWS, 2) int32: pairs of nodes. rest (5,) int64: pairs waiting; then, of the pair of blocks at hand,
    nodes i, j and the two halves of the bits of `faces_meeting` not looked at yet. frames (2, 22, 8) float32: see
    `lanes/boxes.py`. work (28, 8) float32: of `lanes/discs.py` and `lanes/faces.py`, for one pair of nodes. poses (2,
    12) float64: rotation and translation of either body, for exact signs.
    """

    stack: Int32Array
    rest: IntArray
    frames: Float32Array
    work: Float32Array
    poses: FloatArray


class Place(NamedTuple):
    """Where the two bodies are: rounded placements (`place_pair`), are they posed, and the error of exact signs."""

    a: Placement
    b: Placement
    error: float
    posed_error: float


def new_descent() -> Descent:
    """Return work space for one search at a time."""
    return Descent(
        np.empty((STACK_ROWS, 2), np.int32),
        np.empty(5, np.int64),
        np.empty((2, FRAME_ROWS, LANES), np.float32),
        np.empty((WORK_ROWS, LANES), np.float32),
        np.zeros((2, 12)),
    )


@inline
def store_pose(poses: Any, row: int, pose: PoseArrays, item: int) -> None:
    """Write one pose as exact signs take it: rotation by rows, then translation."""
    for i in range(3):
        for k in range(3):
            poses[row, 3 * i + k] = pose.rotations[item, i, k]
        poses[row, 9 + i] = pose.translations[item, i]


@inline
def start_descent(
    first: ShellArrays,
    first_pose: PoseArrays,
    first_item: int,
    second: ShellArrays,
    second_pose: PoseArrays,
    second_item: int,
    descent: Descent,
) -> Place:
    """Place two bodies and begin a search with their roots; nothing is left to do where they are surely apart."""
    a, b = place_pair(first.extent, first_pose, first_item, second.extent, second_pose, second_item)
    defect = defect_of(a) + defect_of(b)
    is_apart = set_frame(descent.frames[0], a, first.origin, first.scale, b, second.origin, second.scale, defect)
    if not is_apart:
        is_apart = set_frame(descent.frames[1], b, second.origin, second.scale, a, first.origin, first.scale, defect)
    descent.stack[0, 0], descent.stack[0, 1] = 0, 0
    descent.rest[:] = 0
    descent.rest[0] = 0 if is_apart else 1
    error = max(a.error, b.error)
    exact_error = 0.0
    if error != 0.0:
        store_pose(descent.poses, 0, first_pose, first_item)
        store_pose(descent.poses, 1, second_pose, second_item)
        if first_pose.is_posed:
            exact_error = posed_error(descent.poses, 0, first.extent.reach)
        if second_pose.is_posed:
            exact_error = max(exact_error, posed_error(descent.poses, 1, second.extent.reach))
    return Place(a, b, error, exact_error)


@inline
def placed_triangle(t: Triangle3, place: Placement) -> Triangle3:
    """Return the rounded posed triangle."""
    return Triangle3(placed(t.p, place), placed(t.q, place), placed(t.r, place))


@inline
def with_pose(t: Triangle3, pose: int) -> PosedTriangle:
    """Return the triangle before pose number `pose`."""
    return PosedTriangle(
        PosedPoint3(t.p.x, t.p.y, t.p.z, pose),
        PosedPoint3(t.q.x, t.q.y, t.q.z, pose),
        PosedPoint3(t.r.x, t.r.y, t.r.z, pose),
    )


@inline
def corners_of(vertices: Any, triangles: Any, item: int) -> Triangle3:
    """Load a triangle; from arrays, since handing a whole `ShellArrays` on costs more than the test that follows."""
    return Triangle3(
        as_point3(vertices, triangles[item, 0]),
        as_point3(vertices, triangles[item, 1]),
        as_point3(vertices, triangles[item, 2]),
    )


@inline
def settle_class(first: ShellArrays, i: int, second: ShellArrays, j: int, place: Place, poses: Any) -> int:
    """Return the class of two faces that `classify_near` leaves open; UNDECIDED where one has no area or exponents
    leave the range."""
    if first.axis[i] < 0 or second.axis[j] < 0:
        return UNDECIDED
    t, u = triangle_of(first, i), triangle_of(second, j)
    if place.error == 0.0:  # the rounded points are the points
        t, u = placed_triangle(t, place.a), placed_triangle(u, place.b)
        return classify_exactly(poses, unposed(t), unposed(u), placed_axis(int(first.axis[i]), place.a), 0.0)
    t_posed = with_pose(t, 0 if place.a.is_posed else UNPOSED)
    u_posed = with_pose(u, 1 if place.b.is_posed else UNPOSED)
    return classify_exactly(poses, t_posed, u_posed, int(first.axis[i]), place.posed_error)


@inline
def settles(seek: int, kind: int, first: ShellArrays, i: int, second: ShellArrays, j: int, poses: Any) -> bool:
    """Tell whether a contact of class `kind` answers what is sought."""
    if seek == SEEK_CONTACT:
        return True
    if kind != CROSSING:
        return False
    if seek == SEEK_OVERLAP:
        return proves_overlap(first, i, second, j, poses)
    if seek == SEEK_PIERCING_BY_FIRST:
        return state_of(second, j, poses) == STATE_CLEAN
    return state_of(first, i, poses) == STATE_CLEAN


@inline
def search(
    first: ShellArrays,
    second: ShellArrays,
    place: Place,
    descent: Descent,
    seek: int,
    pairs: Any,
    kinds: Any,
    flag: Any,
) -> tuple[int, int]:
    """Write the pairs (i, j) that are not apart and their classes; return how the search ended and their number.

    pairs (room, 2), kinds (room,), room >= 1. A pair that settles what is sought is written to row 0.
    """
    stack, rest, poses = descent.stack, descent.rest, descent.poses
    vertices, triangles, child = first.vertices, first.triangles, first.child
    their_vertices, their_triangles, their_child = second.vertices, second.triangles, second.child
    boxes, their_boxes, frames = first.boxes, second.boxes, descent.frames
    blocks, their_blocks, work = first.blocks, second.blocks, descent.work
    discs, their_discs, scales = first.discs, second.discs, (first.scale, second.scale)
    n_stack, n_pairs = rest[0], 0
    i, j, low, high = rest[1], rest[2], rest[3], rest[4]
    while True:  # bound: each pair of nodes, and each pair of faces, enters once
        for half in range(2):
            bits = low if half == 0 else high
            while bits != 0:
                bit = lowest_bit(bits)
                bits &= bits - 1
                i_face = -1 - int(child[i, 4 * half + (bit >> 3)])
                j_face = -1 - int(their_child[j, bit & 7])
                t = placed_triangle(corners_of(vertices, triangles, i_face), place.a)
                u = placed_triangle(corners_of(their_vertices, their_triangles, j_face), place.b)
                kind = classify_near(t, u, place.error)
                if kind == UNDECIDED:
                    kind = settle_class(first, i_face, second, j_face, place, poses)
                if kind == APART:
                    continue
                if kind != UNDECIDED and settles(seek, kind, first, i_face, second, j_face, poses):
                    pairs[0, 0], pairs[0, 1], kinds[0] = i_face, j_face, kind
                    return SETTLED, 1
                pairs[n_pairs, 0], pairs[n_pairs, 1], kinds[n_pairs] = i_face, j_face, kind
                n_pairs += 1
                if flag[0] != 0:
                    return INTERRUPTED, n_pairs
                if n_pairs == kinds.shape[0]:
                    rest[0], rest[1], rest[2] = n_stack, i, j
                    rest[3], rest[4] = (bits, high) if half == 0 else (0, bits)
                    return FULL, n_pairs
        low = high = 0
        if n_stack == 0:
            rest[0], rest[3], rest[4] = 0, 0, 0
            return DONE, n_pairs
        if flag[0] != 0:
            return INTERRUPTED, n_pairs
        n_stack -= 1
        i, j = int(stack[n_stack, 0]), int(stack[n_stack, 1])
        i_block, j_block = child[i, 0] < 0, their_child[j, 0] < 0
        if i_block and j_block:
            low, high = faces_meeting(blocks, i, their_blocks, j, frames, work)
            continue
        low, high = meeting(boxes, i, their_boxes, j, frames)
        if j_block:  # only the lanes of i count
            for lane in range(LANES):
                if (low if lane < 4 else high) >> (8 * (lane & 3)) & 255 != 0:
                    stack[n_stack, 0], stack[n_stack, 1] = child[i, lane], j
                    n_stack += 1
        elif i_block:
            low |= high
            bits = (low | low >> 8 | low >> 16 | low >> 24) & 255
            while bits != 0:
                stack[n_stack, 0], stack[n_stack, 1] = i, their_child[j, lowest_bit(bits)]
                bits &= bits - 1
                n_stack += 1
        else:
            low, high = discs_meeting(low, high, discs, i, their_discs, j, frames, scales, work)
            for half in range(2):
                bits = low if half == 0 else high
                while bits != 0:
                    bit = lowest_bit(bits)
                    bits &= bits - 1
                    stack[n_stack, 0] = child[i, 4 * half + (bit >> 3)]
                    stack[n_stack, 1] = their_child[j, bit & 7]
                    n_stack += 1
        low = high = 0
