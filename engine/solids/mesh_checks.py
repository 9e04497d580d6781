"""Mesh validation in linear time: equal vertices, repeated indices, open edges.

The kernels poll `flag` and return early when it is set: the caller checks its budget before it uses their results.
``indices[offsets[i] : offsets[i + 1]]`` are the vertices of face i, all in range.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.compiling.jit import allocating, allocating_kernel, called, inline
from engine.types import FlagArray, Int8Array, IntArray

_POLL: Final = 0x3FFF
"""Mask of the counter: the flag is polled where (counter & _POLL) is 0, every fraction of a millisecond."""
_FREE: Final = -1
_ODD: Final = np.uint64(0x9E3779B97F4A7C15)
_ODD_TOO: Final = np.uint64(0xBF58476D1CE4E5B9)
"""Constants of splitmix64; products wrap around."""
_HALF: Final = np.uint64(32)
_ODD_USES: Final = 1
_TURNED: Final = 2


@inline
def _mixed(bits: Any, row: int) -> Any:
    """Return a hash, uint64, of row `row` of bits (n, 3) uint64."""
    mixed = bits[row, 0] * _ODD
    for column in range(1, 3):
        mixed = (mixed ^ (mixed >> _HALF)) + bits[row, column]
        mixed *= _ODD_TOO
    return (mixed ^ (mixed >> _HALF)) * _ODD


@allocating
def _find_equal_rows(bits: Any, first: IntArray, flag: FlagArray) -> int:
    """Set first[i] to the first row of bits (n, 3) uint64 that equals row i; return the number of distinct rows. Hash
    table with open addressing, of at least 2 n slots."""
    n, n_different, n_bits = bits.shape[0], 0, 1
    while (1 << n_bits) < 2 * n:  # bound: the bits of a number
        n_bits += 1
    slots, last = np.empty(1 << n_bits, np.int64), (1 << n_bits) - 1
    shift = np.uint64(64 - n_bits)
    for place in range(last + 1):
        if place & _POLL == 0 and flag[0] != 0:
            return 0
        slots[place] = _FREE
    for row in range(n):
        if row & _POLL == 0 and flag[0] != 0:
            break
        slot: Any = np.int64(_mixed(bits, row) >> shift)
        first[row] = row
        for tried in range(n):  # bound: every row before is met once at most
            if tried & _POLL == _POLL and flag[0] != 0:
                break
            other = slots[slot]
            if other == _FREE:
                slots[slot] = row
                n_different += 1
                break
            if bits[other, 0] == bits[row, 0] and bits[other, 1] == bits[row, 1] and bits[other, 2] == bits[row, 2]:
                first[row] = other
                break
            slot = (slot + 1) & last
    return n_different


@allocating
def _find_repeat(offsets: IntArray, indices: IntArray, n_vertices: int, flag: FlagArray) -> int:
    """Return the first face that has a vertex twice, or -1. offsets, indices: the faces."""
    last_face = np.full(n_vertices, -1, np.int64)
    for face in range(offsets.shape[0] - 1):
        if face & _POLL == 0 and flag[0] != 0:
            break
        for corner in range(offsets[face], offsets[face + 1]):
            if last_face[indices[corner]] == face:
                return face
            last_face[indices[corner]] = face
    return -1


@inline
def _following(offsets: IntArray, face: int, corner: int) -> int:
    """Return the position of the corner that follows `corner` in face `face`; both are positions in the flat list of
    corners."""
    return corner + 1 if corner + 1 < offsets[face + 1] else offsets[face]


@called
def _group_edges(offsets: IntArray, indices: IntArray, starts: IntArray, ends: IntArray, flag: FlagArray) -> None:
    """Group the edges of all faces (offsets, indices) by their lower vertex v: ends[starts[v] : starts[v + 1]]. ends:
    h, the higher vertex, for an edge directed from v to h; ~h for one directed from h to v. starts: zeros, (n_vertices
    + 2,). An edge from a vertex to itself is skipped."""
    for is_second in range(2):
        for face in range(offsets.shape[0] - 1):
            if face & _POLL == 0 and flag[0] != 0:
                return
            for corner in range(offsets[face], offsets[face + 1]):
                start, end = indices[corner], indices[_following(offsets, face, corner)]
                if start != end:
                    low = min(start, end)
                    if is_second == 0:
                        starts[low + 2] += 1
                    else:
                        ends[starts[low + 1]] = end if end > start else ~start
                        starts[low + 1] += 1
        if is_second == 0:
            for vertex in range(2, starts.shape[0]):
                starts[vertex] += starts[vertex - 1]


@allocating
def _count_unbalanced(starts: IntArray, ends: IntArray, marks: Int8Array, flag: FlagArray) -> tuple[int, int]:
    """Return how many edges are used an odd number of times, and how many others are used more often in one direction.
    starts, ends: from `_group_edges`. marks (len(ends),): filled with _ODD_USES or _TURNED at every use of such an
    edge, else 0."""
    uses, n_odd, n_turned = np.zeros(starts.shape[0], np.int64), 0, 0
    for low in range(starts.shape[0] - 2):
        if low & _POLL == 0 and flag[0] != 0:
            break
        for place in range(starts[low], starts[low + 1]):
            end = ends[place]
            if end >= 0:
                uses[end] += 1
            else:
                uses[~end] -= 1
        for place in range(starts[low], starts[low + 1]):
            net = uses[max(ends[place], ~ends[place])]
            marks[place] = 0 if net == 0 else _ODD_USES if net & 1 == 1 else _TURNED
        for place in range(starts[low], starts[low + 1]):
            high = max(ends[place], ~ends[place])
            if uses[high] & 1 == 1:
                n_odd += 1
            elif uses[high] != 0:
                n_turned += 1
            uses[high] = 0
    return n_odd, n_turned


@allocating
def _name_unbalanced(
    offsets: IntArray, corners: IntArray, starts: IntArray, ends: IntArray, marks: Int8Array, wanted: int,
    named: IntArray, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill named (k, 5) with the first k edges marked `wanted`: face, position of the corner where it starts, of that
    where it ends, number of uses in this direction, number in the other. corners: vertex at each position."""
    places = np.empty_like(starts)
    for vertex in range(len(starts)):
        places[vertex] = starts[vertex]
    n_named = 0
    for face in range(offsets.shape[0] - 1):
        if face & _POLL == 0 and flag[0] != 0:
            return
        for corner in range(offsets[face], offsets[face + 1]):
            following = _following(offsets, face, corner)
            start, end = corners[corner], corners[following]
            low, high = min(start, end), max(start, end)
            place = places[low]
            if start != end:
                places[low] += 1  # the uses of its edges stand in the order of the faces
            if start != end and marks[place] == wanted:
                up, down = 0, 0
                for other in range(starts[low], starts[low + 1]):
                    up += ends[other] == high
                    down += ends[other] == ~high
                    if ends[other] == high or ends[other] == ~high:
                        marks[other] = 0  # named once
                named[n_named, 0], named[n_named, 1], named[n_named, 2] = face, corner, following
                named[n_named, 3], named[n_named, 4] = (up, down) if start == low else (down, up)
                n_named += 1
                if n_named == named.shape[0]:
                    return


@allocating_kernel
def check_topology(
    bits: Any, offsets: IntArray, indices: IntArray, must_close: bool, merged: IntArray, named: IntArray,
    flag: FlagArray,
) -> tuple[int, int, int, int]:  # fmt: skip
    """Return the first face that has a vertex twice (-1: none), the number of distinct vertices, and the two counts of
    `_count_unbalanced` (0, 0 unless must_close).

    bits: the vertices (n, 3), viewed as uint64; offsets, indices: the faces. merged: filled with the first of all equal
    vertices at each corner, if two are equal. named: filled by `_name_unbalanced` with edges of the first kind that
    occurs.
    """
    n = bits.shape[0]
    repeated = _find_repeat(offsets, indices, n, flag)
    if repeated >= 0 or flag[0] != 0:
        return repeated, n, 0, 0
    first = np.empty(n, np.int64)
    n_different = _find_equal_rows(bits, first, flag)
    if n_different < n:
        for corner in range(indices.shape[0]):
            if corner & _POLL == 0 and flag[0] != 0:
                break
            merged[corner] = first[indices[corner]]
    if not must_close or flag[0] != 0:
        return -1, n_different, 0, 0
    corners = merged if n_different < n else indices
    starts, ends = np.zeros(n + 2, np.int64), np.empty(indices.shape[0], np.int64)
    _group_edges(offsets, corners, starts, ends, flag)
    marks = np.empty(indices.shape[0], np.int8)
    n_odd, n_turned = _count_unbalanced(starts, ends, marks, flag)
    if n_odd + n_turned > 0:
        _name_unbalanced(offsets, corners, starts, ends, marks, _ODD_USES if n_odd > 0 else _TURNED, named, flag)
    return -1, n_different, n_odd, n_turned
