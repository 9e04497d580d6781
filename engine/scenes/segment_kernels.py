"""Segments through a scene: the pieces within bodies, the first of them, or whether there is one; compiled.

Candidates are the bodies whose boxes a segment enters (near_boxes.py). All pieces: the segment is cut on each. First:
bodies are queried in the order in which the segment enters their boxes, until a box is entered behind the first end so
far. Any: the first body that is provably met ends the search. Parameters are rounded to nearest, which is monotone; a
segment is OPEN if two first pieces round alike, or a body leaves it UNDECIDED.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.compiling.jit import inline, kernel
from engine.lanes.faces import longest_axis
from engine.lanes.lanes import array_at, prefetch
from engine.scenes.near_boxes import (
    MOST_MET,
    N_BODIES,
    PLACED,
    BodyTree,
    Scratch,
    begin_way,
    has_moved,
    name_in,
    near_bodies,
    next_body,
    scratch_at,
    tree_in,
    way_of,
)
from engine.scenes.posed_cut import UNSURE, WANTS_BODY, between_planes, crossings_in, in_ball
from engine.segment_clipping.on_boundary.boundary_cut import SETTLED, Crossings, emit
from engine.segment_clipping.on_boundary.crossing_values import is_item_safe
from engine.segment_clipping.on_boundary.descent import Way
from engine.segment_clipping.pieces import Pieces, put_piece
from engine.solids.registry import BodyKind
from engine.types import OPEN, FlagArray, FloatArray, IntArray

MET: Final = 1
"""State of a segment that meets a body; others: SETTLED, it meets none, and OPEN, undecided."""
AHEAD: Final = 8
"""Segments are prefetched so many ahead."""
Firsts = namedtuple("Firsts", "source body start end t faces ranks")
"""The first piece of each segment; fields as in `ScenePieces`."""


@inline
def _cut_on(
    words: IntArray, name: int, segments: FloatArray, item: int, is_any: bool, scratch: IntArray, stop: FlagArray,
    out: Pieces, row: int,
) -> int:  # fmt: skip
    """Write the pieces of a segment within one body to `out` from row `row` on; return their number, or a code: UNSURE,
    WANTS_BODY, WANTS_TREE. words: both rows of `words_of`; name: number of the body. With `is_any` nothing is written,
    and a positive number means that there are some. A piece of one point has the second face -2 - face."""
    n = words[0, N_BODIES]
    address = words[0, PLACED] + 32 * name if name < n else words[1, PLACED] + 32 * (name - n)
    body = array_at(address, (4,), np.int64)
    kind = body[0]
    if kind <= BodyKind.OTHER:
        return UNSURE if kind == BodyKind.OTHER else WANTS_BODY
    if kind == BodyKind.MESH:
        n_met, is_in = crossings_in(body, segments, item, is_any, scratch, stop)
        if n_met < 0 or is_any:
            return n_met if n_met != 0 else int(is_in)
        cuts = scratch_at(scratch).cuts
        if body[1] == 0:
            return _emit_points(cuts, n_met, item, out, row)
        return emit(segments, item, item, is_in, cuts, n_met, out, row) - row
    if kind == BodyKind.BALL:
        meets, first, last = in_ball(body, segments, item, is_any)
    else:
        meets, first, last = between_planes(body, segments, item, is_any)
    if meets == -1:
        return 0
    return 1 if meets == 1 and (is_any or put_piece(out, row, item, segments, item, first, last)) else UNSURE


@inline
def _emit_points(cuts: Crossings, n: int, source: int, out: Pieces, row: int) -> int:
    """Write each of the n crossings with a surface to `out` from row `row` on, as a one-point piece of segment `source`
    with second face -2 - face; return n."""
    for place in range(n):
        i = cuts.order[place]
        out.source[row + place] = source
        for end in range(2):
            out.t[row + place, end] = cuts.t[i]
            out.faces[row + place, end] = cuts.faces[i] if end == 0 else -2 - cuts.faces[i]
            for k in range(out.ends.shape[2]):
                out.ends[end, row + place, k] = cuts.points[i, k]
    return n


@kernel
def cut_near(
    segments: FloatArray, order: IntArray, last: int, words: IntArray, scratch: IntArray, stop: FlagArray, out: Pieces,
    names: IntArray, left: IntArray, n: IntArray,
) -> None:  # fmt: skip
    """Clip segments order[n[0]:last] to the bodies that they may meet; write pieces to `out`.

    words: both rows of `words_of`. names (2, m): of each piece the body, and whether it is longer than a point. left:
    pairs (segment, body) that are OPEN.

    | n | meaning |
    |---|---|
    | 0, 1 | on entry the first segment and its first candidate, on return where to continue |
    | 2, 3 | number of rows of `out`, of `left`, to which others are appended |
    | 4, 5 | 0, or the code of what must be prepared (WANTS_BODY, WANTS_TREE), and the body |
    | 6 | whether a segment is out of the kernels' range |
    """
    near = scratch_at(scratch).near
    n[4] = 0
    for turn in range(n[0], last):
        item, begin, n[0], n[1] = order[turn], n[1], turn, 0
        prefetch(segments, order[min(turn + AHEAD, last - 1)] * 2 * segments.shape[2])
        is_safe, n_near = is_item_safe(segments, item), near_bodies(segments, item, words, scratch)
        n[6] |= not is_safe
        for place in range(begin, n_near):
            n[1], body, n_pieces = place, near[place], UNSURE
            if stop[0] or n[2] + MOST_MET > names.shape[1] or n[3] == left.shape[0]:
                return
            if is_safe:
                n_pieces = _cut_on(words, body, segments, item, False, scratch, stop, out, n[2])
            if n_pieces < UNSURE:
                n[4], n[5] = n_pieces, body
                return
            if n_pieces == UNSURE:
                left[n[3], 0], left[n[3], 1] = item, body
                n[3] += 1
                continue
            for row in range(n[2], n[2] + n_pieces):
                names[0, row] = name_in(words, body)
                names[1, row] = out.faces[row, 1] >= -1
                if names[1, row] == 0:
                    out.faces[row, 1] = out.faces[row, 0]
            n[2] += n_pieces
        n[1] = 0
    n[0] = last


@inline
def _record_first_hit(scratch: Scratch, name: int) -> None:
    """Store the piece in row 0 of scratch.room as the first piece of the segment, unless one stored begins before it,
    or in the same point with a lower body. name: its body. hit[1] is set if both begin at parameters that round alike.
    """
    room, best, hit = scratch.room, scratch.best, scratch.hit
    t = room.t[0, 0]
    if t > best[0]:
        return
    if t == best[0]:
        are_own = room.faces[0, 0] < 0 and room.faces[MOST_MET, 0] < 0
        hit[1] |= not are_own
        if not are_own or name > hit[0]:
            return
    else:
        hit[1] = 0
    best[0], hit[0] = t, name
    for end in range(2):
        room.t[MOST_MET, end], room.faces[MOST_MET, end] = room.t[0, end], room.faces[0, end]
        for k in range(3):
            room.ends[end, MOST_MET, k] = room.ends[end, 0, k]


@inline
def _write_first_hit(scratch: Scratch, out: Firsts, row: int, item: int) -> None:
    """Write the first piece of segment ``item``, stored in scratch, to row `row` of `out`."""
    piece, is_long = scratch.room, scratch.room.faces[MOST_MET, 1] >= -1
    out.source[row], out.body[row], out.ranks[row, 0], out.ranks[row, 1] = item, scratch.hit[0], 0, is_long
    for k in range(out.start.shape[1]):
        out.start[row, k], out.end[row, k] = piece.ends[0, MOST_MET, k], piece.ends[1, MOST_MET, k]
    for end in range(2):
        out.t[row, end], out.faces[row, end] = piece.t[MOST_MET, end], piece.faces[MOST_MET, end * is_long]


@inline
def _query_body(
    words: IntArray, body: int, segments: FloatArray, item: int, is_any: bool, room: IntArray, stop: FlagArray
) -> int:
    """Clip a segment to body number ``body``, and store its piece if it is the first so far. Returns SETTLED: continue
    with the next body; MET (with `is_any`) or OPEN: end; or WANTS_BODY, WANTS_TREE. words: both rows of `words_of`;
    room: work space of `scratch_for`."""
    scratch = scratch_at(room)
    n_pieces = _cut_on(words, body, segments, item, is_any, room, stop, scratch.room, 0)
    if n_pieces < UNSURE:
        scratch.hit[0] = body
        return n_pieces
    if n_pieces == UNSURE:
        scratch.hit[1] = 1
        return SETTLED if is_any else OPEN
    if n_pieces > 0 and is_any:
        scratch.hit[0] = name_in(words, body)
        return MET
    if n_pieces > 0:
        _record_first_hit(scratch, name_in(words, body))
    return SETTLED


@inline
def _first_hit_bound(scratch: Scratch, bodies: BodyTree, way: Way) -> Any:
    """Return a float32 upper bound on the parameter, along the segment `way` in tree coordinates (-1 .. 1), at which
    the first piece so far begins; 1.0 if there is none. On the longest axis k, t = (x - m) / e for middle m and half e.
    The slack exceeds the rounding of m and e; it is taken twice. That of x, the nearest double, is half an ulp where it
    was computed: much, in the tree, for a scene far from the origin."""
    k = longest_axis(way.half)
    if scratch.hit[0] < 0 or way.half[k] == 0.0:
        return np.float32(1.0)
    place = scratch.room.ends[0, MOST_MET, k] * bodies.inverse
    x, slack = place - bodies.tree.origin[k] * bodies.inverse, 2.0 * way.slack + 2.0**-52 * abs(place)
    t = (x - way.middle[k]) / way.half[k] + slack / abs(way.half[k]) + 2.0**-20
    return np.float32(min(1.0, t))


@inline
def _search_tree(
    words: IntArray, side: int, segments: FloatArray, item: int, is_any: bool, room: IntArray, stop: FlagArray
) -> int:
    """Clip a segment to the bodies of one `BodyTree`, about in order of entry, until none can have an earlier piece.
    side: 0 for the bodies as first placed, 1 for moved ones. Returns SETTLED: continue with the next tree; MET (with
    `is_any`, at the first body met) or OPEN: end; or WANTS_BODY, WANTS_TREE."""
    scratch, bodies, n_before = scratch_at(room), tree_in(words[side], segments.shape[2]), side * words[0, N_BODIES]
    way, last = way_of(segments, item, bodies), np.float32(1.0)
    begin_way(bodies, way, scratch)
    body = next_body(segments, item, False, bodies, way, last, scratch)
    while body >= 0:
        if side == 1 or not has_moved(words, body):
            state = _query_body(words, n_before + body, segments, item, is_any, room, stop)
            if state != SETTLED:
                return state
            if not is_any:
                last = _first_hit_bound(scratch, bodies, way)
        body = next_body(segments, item, False, bodies, way, last, scratch)
    return SETTLED


@kernel
def find_first(
    segments: FloatArray, order: IntArray, last: int, words: IntArray, room: IntArray, is_any: bool, stop: FlagArray,
    state: FlagArray, out: Firsts, n: IntArray,
) -> None:  # fmt: skip
    """Compute the first piece of segments order[n[0]:last]; with `is_any` only whether there is one.

    words: both rows of `words_of`. state: (n,) uint8, SETTLED, MET or OPEN. out: the pieces of those that are MET,
    unless `is_any`. room: of `scratch_for`.

    | n | meaning |
    |---|---|
    | 0 | on entry the first segment, on return where to continue |
    | 1, 2 | 0, or the code of what must be prepared (WANTS_BODY, WANTS_TREE), and the body |
    | 3, 4 | number of MET, of OPEN segments |
    | 5 | whether rows of `out` are filled consecutively, not at the segment's index |
    """
    scratch = scratch_at(room)
    noted, n[1] = scratch.hit, 0
    for turn in range(n[0], last):
        n[0], item = turn, order[turn]
        prefetch(segments, order[min(turn + AHEAD, last - 1)] * 2 * segments.shape[2])
        if stop[0]:
            return
        outcome, scratch.best[0], noted[0], noted[1] = SETTLED, np.inf, -1, 0
        is_safe = is_item_safe(segments, item)
        for side in range(2):
            if outcome == SETTLED and words[side, N_BODIES] > 0:
                outcome = _search_tree(words, side, segments, item, is_any, room, stop) if is_safe else OPEN
        if outcome < 0:
            n[1], n[2] = outcome, noted[0]
            return
        if outcome == SETTLED:
            outcome = OPEN if noted[1] != 0 else MET if noted[0] >= 0 else SETTLED
        if outcome == MET and not is_any:
            _write_first_hit(scratch, out, n[3] if n[5] != 0 else item, item)
        state[item] = outcome
        n[3] += outcome == MET
        n[4] += outcome == OPEN
    n[0] = last
