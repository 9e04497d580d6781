"""All pairs of faces of two placed bodies that have a common point, or the first pair that settles the question.

Two trees are descended together: a pair of nodes whose boxes have a common point is replaced by the children of the
larger one, a pair of leaves goes to `classify_pair`. Boxes are conservative under a pose, so no contact is missed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.bounding.bvh import MAX_DEPTH
from engine.collision.face_state import proves_overlap, state_of
from engine.collision.placement import (
    Placement,
    PoseArrays,
    are_apart,
    placed_axis,
    placed_box,
    placed_point,
    placement_of,
    size_of,
)
from engine.collision.shell import STATE_CLEAN, ShellArrays
from engine.collision.triangle_triangle import APART, CROSSING, Triangle3, classify_pair
from engine.jit import inline, kernel
from engine.types import UNDECIDED

SEEK_OVERLAP = 0
SEEK_PIERCING_BY_FIRST = 1
SEEK_PIERCING_BY_SECOND = 2
SEEK_CONTACT = 3
SEEK_NOTHING = 4
"""What ends a search early: a crossing that proves overlapping interiors; one that proves that the first (second) body,
a surface, passes through the interior of the other; any contact at all; nothing, all contacts are wanted."""

INTERRUPTED = -2
"""Returned in place of a count when the flag was raised."""

POLL_EVERY = 1024
"""Pairs of leaves or nodes between two looks at the flag: well under a millisecond."""


@inline
def placed_triangle(shell: ShellArrays, item: int, place: Placement) -> Triangle3:
    """Return the rounded posed triangle."""
    return Triangle3(
        placed_point(shell.vertices, shell.triangles[item, 0], place),
        placed_point(shell.vertices, shell.triangles[item, 1], place),
        placed_point(shell.vertices, shell.triangles[item, 2], place),
    )


@inline
def classify_faces(
    first: ShellArrays, i: int, first_place: Placement, second: ShellArrays, j: int, second_place: Placement
) -> int:
    """Return the class of two faces, UNDECIDED where one has no area or rounding could matter."""
    axis = placed_axis(int(first.axis[i]), first_place)
    if axis < 0 or second.axis[j] < 0:
        return UNDECIDED
    error = max(first_place.error, second_place.error)
    return classify_pair(placed_triangle(first, i, first_place), placed_triangle(second, j, second_place), axis, error)


@inline
def settles(seek: int, kind: int, first: ShellArrays, i: int, second: ShellArrays, j: int) -> bool:
    """Tell whether a contact of class `kind` answers what is sought."""
    if seek == SEEK_CONTACT:
        return True
    if kind != CROSSING or seek == SEEK_NOTHING:
        return False
    if seek == SEEK_OVERLAP:
        return proves_overlap(first, i, second, j)
    if seek == SEEK_PIERCING_BY_FIRST:
        return state_of(second, j) == STATE_CLEAN
    return state_of(first, i) == STATE_CLEAN


@inline
def search(
    first: ShellArrays,
    first_place: Placement,
    second: ShellArrays,
    second_place: Placement,
    seek: int,
    stop_when_full: bool,
    pairs: Any,
    kinds: Any,
    flag: Any,
) -> tuple[int, bool]:
    """Write the pairs (i, j) that are not apart and their classes; return their number and whether the last settles.

    Pairs beyond the room in `pairs` are counted, not written; with `stop_when_full` the search ends at the first.
    When a pair settles what is sought it stands at row 0 and the search ends. Returns INTERRUPTED when the flag is
    raised.
    """
    stack = np.empty((4 * MAX_DEPTH, 2), np.int64)
    stack[0, 0], stack[0, 1] = 0, 0
    n_stack, n_pairs, n_turns = 1, 0, 0
    while n_stack > 0:  # bound: each pair of nodes enters once
        n_stack -= 1
        i, j = stack[n_stack, 0], stack[n_stack, 1]
        n_turns += 1
        if n_turns % POLL_EVERY == 0 and flag[0] != 0:
            return INTERRUPTED, False
        a, b = placed_box(first.boxes, i, first_place), placed_box(second.boxes, j, second_place)
        if are_apart(a, b):
            continue
        i_child, j_child = first.child[i], second.child[j]
        if i_child < 0 and j_child < 0:
            i_face, j_face = -1 - i_child, -1 - j_child
            kind = classify_faces(first, i_face, first_place, second, j_face, second_place)
            if kind == APART:
                continue
            if kind != UNDECIDED and settles(seek, kind, first, i_face, second, j_face):
                pairs[0, 0], pairs[0, 1], kinds[0] = i_face, j_face, kind
                return 1, True
            if n_pairs < kinds.shape[0]:
                pairs[n_pairs, 0], pairs[n_pairs, 1], kinds[n_pairs] = i_face, j_face, kind
            n_pairs += 1
            if stop_when_full and n_pairs > kinds.shape[0]:
                return n_pairs, False
        elif j_child < 0 or (i_child >= 0 and size_of(a) >= size_of(b)):
            stack[n_stack, 0], stack[n_stack, 1] = i_child, j
            stack[n_stack + 1, 0], stack[n_stack + 1, 1] = i_child + 1, j
            n_stack += 2
        else:
            stack[n_stack, 0], stack[n_stack, 1] = i, j_child
            stack[n_stack + 1, 0], stack[n_stack + 1, 1] = i, j_child + 1
            n_stack += 2
    return n_pairs, False


@kernel
def find_contacts(
    first: ShellArrays,
    first_pose: PoseArrays,
    second: ShellArrays,
    second_pose: PoseArrays,
    seek: int,
    stop_when_full: bool,
    pairs: Any,
    kinds: Any,
    flag: Any,
) -> tuple[int, bool]:
    """Run `search` for one pose of each body. pairs (room, 2) int64, kinds (room,) int8, room >= 1."""
    a = placement_of(first_pose)
    b = placement_of(second_pose)
    return search(first, a, second, b, seek, stop_when_full, pairs, kinds, flag)
