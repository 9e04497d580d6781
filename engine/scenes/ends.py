"""Pieces of segments within the bodies of a scene, in the exact order of their ends along each segment.

Parameters are rounded to nearest, which is monotone; if two ends of a segment round alike, exact arithmetic decides
their order, or that they are equal. Compiled: ends that a plane cuts, a row of a body without a pose or a triangle of a
mesh, divide the segment by the distances of its own ends from the plane, as exact expansions; the order of two is a
sign (parameters.py). Ends on equal planes, or of the same piece of equal bodies under one pose, are equal without that.
What is left, balls above all, is UNDECIDED, and decided in integers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cmp_to_key
from itertools import pairwise
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np

from engine.compiling.jit import called, entry_of, inline, kernel
from engine.lanes.lanes import array_at
from engine.predicates.error_free import workspace
from engine.predicates.expansion import Components, grow, grow_product, magnitude
from engine.predicates.parameters import compare_products
from engine.running.budget import UNLIMITED, Budget
from engine.running.joining import join_columns
from engine.running.parallel import run_chunks
from engine.scenes.near_boxes import N_BODIES, NAMES, PLACED, place_in
from engine.scenes.posed_cut import mesh_at
from engine.segment_clipping.exact_pieces import ONE, ZERO, Parameter, compare
from engine.segment_clipping.on_boundary.crossing_values import MOST_COMPONENTS, PLANE, is_item_safe, size_at
from engine.segment_clipping.pieces import point_of
from engine.solids.columns import Columns
from engine.solids.registry import BodyKind
from engine.types import UNDECIDED, BoolArray, FlagArray, FloatArray, IntArray

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
    if i != j and bodies[i] == bodies[j]:
        return 1 if i > j else -1  # they are in order, and apart
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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ScenePieces(Columns):
    """The pieces of segments within bodies, by source, then by where they start, then by body.

    Attributes
    ----------
    source, body : ndarray of int64, shape (m,)
        The segment each piece is a part of, and the body it lies in.
    start, end : ndarray of float64, shape (m, dim)
        Each coordinate the double nearest to the exact one.
    t : ndarray of float64, shape (m, 2)
        The parameters of both ends, each the nearest double; equal for a single point.
    faces : ndarray of int64, shape (m, 2)
        The plane or face crossed at either end, -1 where the end is the segment's own.
    ranks : ndarray of int64, shape (m, 2)
        The exact order of all ends of the pieces of a segment: equal ranks are one point, so that two pieces overlap,
        touch or leave a gap exactly as their ranks do.
    """

    _rows: ClassVar[str] = "pieces"
    source: IntArray
    body: IntArray
    start: FloatArray
    end: FloatArray
    t: FloatArray
    faces: IntArray
    ranks: IntArray

    def __iter__(self) -> Iterator[tuple[int, int, FloatArray, FloatArray]]:
        """Yield of each piece its segment, the body that it lies in, its start and its end."""
        return zip(self.source.tolist(), self.body.tolist(), self.start, self.end)


class LoosePieces(NamedTuple):
    """Pieces of segments, unsorted, but those of one segment in one body in order.

    | field | shape | meaning |
    |---|---|---|
    | source, body | (m,) | the segment, the body |
    | are_long | (m,) | 1 if longer than a point, 0 if not; UNDECIDED possible if both ends round alike |
    | ends | (2, m, dim) | first and last points |
    | t, faces | (m, 2) | parameters and faces of both ends |
    """

    source: Any
    body: Any
    are_long: Any
    ends: Any
    t: Any
    faces: Any


Exact = Callable[[int, int, int], tuple[Parameter, Parameter]]
"""Function of source, body and index of a piece among those of both: returns its exact parameters."""


def merge_parts(
    parts: list[LoosePieces], dimension: int, budget: Budget = UNLIMITED, workers: int | None = 1
) -> LoosePieces:
    """Return all pieces, unordered."""
    if len(parts) == 1:
        return parts[0]
    none = np.empty(0, np.int64)
    nothing = LoosePieces(none, none, none, np.empty((2, 0, dimension)), np.empty((0, 2)), np.empty((0, 2), np.int64))
    return LoosePieces(*join_columns([nothing, *parts], budget, workers, (0, 0, 0, 1, 0, 0)))


def take_pieces(pieces: LoosePieces, rows: IntArray) -> LoosePieces:
    """Return the pieces with indices ``rows``."""
    source, body, are_long, ends, t, faces = pieces
    return LoosePieces(source[rows], body[rows], are_long[rows], ends[:, rows], t[rows], faces[rows])


def sort_pieces(
    pieces: LoosePieces, segments: FloatArray, words: IntArray, exact: Callable[[], Exact], budget: Budget = UNLIMITED,
    workers: int | None = 1,
) -> ScenePieces:  # fmt: skip
    """Return pieces of segments (n, 2, dim) sorted by segment and exact start. Caller guarantees that those of one
    segment and body are in order. words: of the scene (`words_of`). exact: makes the function that gives exact
    parameters, called if kernels do not decide."""
    m, n_sources = len(pieces.source), len(segments)
    numbers, ends = np.empty((2, m), np.int64), np.empty((2, m, pieces.ends.shape[2]))
    out = *numbers, *ends, np.empty((m, 2)), *np.empty((2, m, 2), np.int64)
    order, ranks, offsets = np.empty(4 * m, np.int64), np.empty((m, 2), np.int64), np.zeros(n_sources + 2, np.int64)
    given = pieces.source, pieces.body, pieces.are_long, pieces.ends[0], pieces.ends[1], pieces.t, pieces.faces
    is_tied = np.zeros(n_sources, np.bool_)
    arrays = tuple(map(np.ascontiguousarray, given))
    entry_of(group_by_source)(arrays[0], offsets, order)
    are_exact: list[bool] = []

    def task(first: int, last: int) -> None:
        are_exact.append(
            entry_of(sort_rounded)(
                arrays, segments, words, offsets, order, ranks, is_tied, out, first, last, budget.flag
            )
        )

    if budget is UNLIMITED:
        task(0, n_sources)
    else:
        run_chunks(task, n_sources, budget=budget, workers=workers)
    if not all(are_exact):
        rows, some = np.flatnonzero(is_tied[out[0]]), take_pieces(pieces, np.flatnonzero(is_tied[pieces.source]))
        for array, looked_at in zip(out, _sort_exactly(some, exact())):
            array[rows] = looked_at
    return ScenePieces(*out)


def _sort_exactly(pieces: LoosePieces, exact: Exact) -> tuple[Any, ...]:
    """Return the arrays of `ScenePieces` for pieces of segments whose ends round alike, sorted by exact parameters.
    exact: gives the parameters of both ends of a piece, by source, body and number."""
    pieces, ranks = (
        take_pieces(pieces, np.lexsort((pieces.body, pieces.source))),
        np.empty((len(pieces.source), 2), np.int64),
    )
    sources, bodies, are_long, t, faces = (each.tolist() for each in (*pieces[:3], *pieces[4:]))
    numbers = [0] * len(sources)  # of a piece among those of its source and body

    def value(end: int) -> Parameter:
        """Return the exact parameter of an end, 2 * piece + side."""
        piece, side = divmod(end, 2)
        is_own = faces[piece][side] < 0
        return (ZERO, ONE)[side] if is_own else exact(sources[piece], bodies[piece], numbers[piece])[side]

    def difference(first: int, second: int) -> int:
        (i, side), (j, other) = divmod(first, 2), divmod(second, 2)
        if t[i][side] != t[j][other]:
            return -1 if t[i][side] < t[j][other] else 1
        is_known = i == j and are_long[i] != UNDECIDED
        return (side - other) * are_long[i] if is_known else compare(value(first), value(second))

    begin = 0
    for piece in range(1, len(sources) + 1):
        if piece < len(sources) and sources[piece] == sources[begin]:
            numbers[piece] = numbers[piece - 1] + 1 if bodies[piece] == bodies[piece - 1] else 0
            continue
        ends = sorted(range(2 * begin, 2 * piece), key=cmp_to_key(difference))
        steps = [0, *(difference(*pair) != 0 for pair in pairwise(ends))]
        ranks.reshape(-1)[ends], begin = np.cumsum(steps), piece
    by_start = np.lexsort((pieces.body, ranks[:, 0], pieces.source))
    pieces = take_pieces(pieces, by_start)
    return pieces.source, pieces.body, pieces.ends[0], pieces.ends[1], pieces.t, pieces.faces, ranks[by_start]


@kernel
def group_by_source(source: IntArray, offsets: IntArray, order: IntArray) -> None:
    """Set offsets (n + 2,), zeros before, to the first piece of each of n sources, and order (4 m,) to their ends.

    The ends, 2 * piece + side, of the pieces of source i are order[2 offsets[i] : 2 offsets[i + 1]] afterwards.
    """
    for piece in range(source.size):
        offsets[source[piece] + 2] += 1
    for item in range(2, offsets.size):
        offsets[item] += offsets[item - 1]
    for piece in range(source.size):
        place = offsets[source[piece] + 1]
        offsets[source[piece] + 1] += 1
        order[2 * place], order[2 * place + 1] = 2 * piece, 2 * piece + 1


@kernel
def sort_rounded(
    given: Any, segments: FloatArray, words: IntArray, offsets: IntArray, order: IntArray, ranks: IntArray,
    is_tied: BoolArray, out: Any, begin: int, end: int, flag: FlagArray,
) -> bool:  # fmt: skip
    """Fill the rows of `out`, the arrays of `ScenePieces`, of sources begin .. end - 1 in order of parameters.

    given: the arrays before the last, and `are_long`. is_tied: (n,) zeros, set for sources whose order `compare_ends`
    leaves undecided. offsets, order: of `group_by_source`. ranks: (m, 2), scratch. Returns whether no source is tied.
    Polls `flag`.
    """
    source, body, _, start, stop, t, faces = given
    are_exact = True
    for item in range(begin, end):
        if flag[0]:
            break
        first, last = 2 * offsets[item], 2 * offsets[item + 1]
        _sort_ends(order, first, last, body, t)
        for place in range(first + 1, last):  # of ends that round alike: mostly they are equal
            moved, j = order[place], place
            while j > first and t[order[j - 1] // 2, order[j - 1] % 2] == t[moved // 2, moved % 2]:
                sign = compare_ends(order[j - 1], moved, given, segments, words)
                is_tied[item] |= sign == UNDECIDED
                if sign != 1:
                    break
                order[j], j = order[j - 1], j - 1
            order[j] = moved
        are_exact &= not is_tied[item]
        rank, n_starts = -1, offsets[item]
        for place in range(first, last):
            piece, side, before = order[place] // 2, order[place] % 2, order[max(first, place - 1)]
            is_equal = place > first and t[before // 2, before % 2] == t[piece, side]
            rank += not is_equal or compare_ends(before, order[place], given, segments, words) != 0
            ranks[piece, side] = rank
            if side == 0:
                order[2 * source.size + n_starts] = piece
                n_starts += 1
        for place in range(offsets[item], offsets[item + 1]):
            piece = order[2 * source.size + place]
            out[0][place], out[1][place] = source[piece], body[piece]
            for k in range(start.shape[1]):
                out[2][place, k], out[3][place, k] = start[piece, k], stop[piece, k]
            for k in range(2):
                out[4][place, k], out[5][place, k], out[6][place, k] = t[piece, k], faces[piece, k], ranks[piece, k]
    return are_exact


@inline
def _sort_ends(order: IntArray, first: int, last: int, body: IntArray, t: FloatArray) -> None:
    """Sort order[first:last], ends coded as 2 * piece + side (0: start), by parameter t (m, 2), body (m,) and piece."""
    gap = (last - first) // 2
    while gap > 0:  # bound: gap is halved; Shell's sort, n^1.5 steps
        for i in range(first + gap, last):
            moved, j = order[i], i
            at, name = t[moved // 2, moved % 2], body[moved // 2]
            while j >= first + gap:
                other = order[j - gap]
                value, its = t[other // 2, other % 2], body[other // 2]
                if value < at or (value == at and (its < name or (its == name and other < moved))):
                    break
                order[j] = other
                j -= gap
            order[j] = moved
        gap //= 2
