"""Segments through a scene, compiled: the pieces within bodies, the first of them, or whether there is one.

Bodies near a segment are those whose boxes its way down the tree meets (near_boxes.py). All pieces: each is cut on. The
first: they are asked in the order in which the segment enters their boxes, until a box is entered behind the first end
found. Any: the first body that is surely met is enough. Parameters are rounded to nearest, which keeps their order; a
segment whose first piece would be found by two that round alike, or on a body that leaves it UNDECIDED, is OPEN.
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
from engine.scenes.posed_cut import between_planes, in_ball
from engine.scenes.posed_mesh import UNSURE, WANTS_BODY, crossings_in
from engine.segment_clipping.on_boundary.boundary_cut import SETTLED, Crossings, emit
from engine.segment_clipping.on_boundary.crossing_values import is_item_safe
from engine.segment_clipping.on_boundary.mesh_contacts import Way
from engine.segment_clipping.pieces import Pieces, put_piece
from engine.solids.registry import BodyKind
from engine.types import OPEN, FlagArray, FloatArray, IntArray

MET: Final = 1
"""State of a segment, beside SETTLED, which meets nothing, and OPEN."""
AHEAD: Final = 8
"""Segments between the one that memory is asked for and the one worked on."""
Firsts = namedtuple("Firsts", "source body start end t faces ranks")
"""One piece of each segment, as `ScenePieces` has them."""


@inline
def _cut_on(
    words: IntArray, name: int, segments: FloatArray, item: int, is_any: bool, scratch: IntArray, stop: FlagArray,
    out: Pieces, row: int,
) -> int:  # fmt: skip
    """Write the pieces of a segment within a body to the rows of `out` from `row` on; return how many, or why not.
    Where `is_any` nothing is written, and a positive number says that there are some. Of a point the second face is
    -2 - face."""
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
    """Write each crossing of a surface as a piece of one point, as `_join_touches` does; return how many."""
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
    """Cut segments (n, 2, dim), those before `last` in an order (n,), on the bodies that they may meet; names (2, m):
    of each piece the body, and whether it is longer than a point; left: rows of a segment and a body that are OPEN.

    n: the segment to begin with, and which of its bodies, afterwards where to go on; how many rows of `out`, and of
    `left`, are filled; 0, or why the next is not cut (what `crossings_in` wants), and the body; whether a segment is of
    numbers that no kernel takes.
    """
    near = scratch_at(scratch).near
    n[2], n[3], n[4] = 0, 0, 0
    for turn in range(n[0], last):
        item, begin, n[0], n[1] = order[turn], n[1], turn, 0
        prefetch(segments, order[min(turn + AHEAD, last - 1)] * 2 * segments.shape[2])
        is_safe, n_near = is_item_safe(segments, item), near_bodies(segments, item, words, scratch)
        n[6] |= not is_safe
        for place in range(begin, n_near):
            n[1], body, found = place, near[place], UNSURE
            if stop[0] or n[2] + MOST_MET > names.shape[1] or n[3] == left.shape[0]:
                return
            if is_safe:
                found = _cut_on(words, body, segments, item, False, scratch, stop, out, n[2])
            if found < UNSURE:
                n[4], n[5] = found, body
                return
            if found == UNSURE:
                left[n[3], 0], left[n[3], 1] = item, body
                n[3] += 1
                continue
            for row in range(n[2], n[2] + found):
                names[0, row] = name_in(words, body)
                names[1, row] = out.faces[row, 1] >= -1
                if names[1, row] == 0:
                    out.faces[row, 1] = out.faces[row, 0]
            n[2] += found
        n[1] = 0
    n[0] = last


@inline
def _keep_first(scratch: Scratch, name: int) -> None:
    """Keep the first piece of those in a body, unless what is kept begins before it."""
    room, best, found = scratch.room, scratch.best, scratch.found
    t = room.t[0, 0]
    if t > best[0]:
        return
    if t == best[0]:
        are_own = room.faces[0, 0] < 0 and room.faces[MOST_MET, 0] < 0
        found[1] |= not are_own
        if not are_own or name > found[0]:
            return
    else:
        found[1] = 0
    best[0], found[0] = t, name
    for end in range(2):
        room.t[MOST_MET, end], room.faces[MOST_MET, end] = room.t[0, end], room.faces[0, end]
        for k in range(3):
            room.ends[end, MOST_MET, k] = room.ends[end, 0, k]


@inline
def _put_first(scratch: Scratch, out: Firsts, row: int, item: int) -> None:
    """Write the first piece found, that of a segment, to a row."""
    piece, is_long = scratch.room, scratch.room.faces[MOST_MET, 1] >= -1
    out.source[row], out.body[row], out.ranks[row, 0], out.ranks[row, 1] = item, scratch.found[0], 0, is_long
    for k in range(out.start.shape[1]):
        out.start[row, k], out.end[row, k] = piece.ends[0, MOST_MET, k], piece.ends[1, MOST_MET, k]
    for end in range(2):
        out.t[row, end], out.faces[row, end] = piece.t[MOST_MET, end], piece.faces[MOST_MET, end * is_long]


@inline
def _ask(
    words: IntArray, body: int, segments: FloatArray, item: int, is_any: bool, room: IntArray, stop: FlagArray
) -> int:
    """Ask a body for the first piece, or any; return SETTLED to go on, MET or OPEN where that tells all, or what the
    body wants."""
    scratch = scratch_at(room)
    found = _cut_on(words, body, segments, item, is_any, room, stop, scratch.room, 0)
    if found < UNSURE:
        scratch.found[0] = body
        return found
    if found == UNSURE:
        scratch.found[1] = 1
        return SETTLED if is_any else OPEN
    if found > 0 and is_any:
        scratch.found[0] = name_in(words, body)
        return MET
    if found > 0:
        _keep_first(scratch, name_in(words, body))
    return SETTLED


@inline
def _reached(scratch: Scratch, bodies: BodyTree, way: Way) -> Any:
    """Return a parameter of `enter_boxes` behind the start of the first piece found.

    Along the longest axis k it is (x - m) / e. The slack is more than the rounding of m and e; it is taken twice. That
    of x, the nearest double, is half an ulp where it was made: much, in the tree, of a scene far from the origin.
    """
    k = longest_axis(way.half)
    if scratch.found[0] < 0 or way.half[k] == 0.0:
        return np.float32(1.0)
    place = scratch.room.ends[0, MOST_MET, k] * bodies.inverse
    x, slack = place - bodies.tree.origin[k] * bodies.inverse, 2.0 * way.slack + 2.0**-52 * abs(place)
    t = (x - way.middle[k]) / way.half[k] + slack / abs(way.half[k]) + 2.0**-20
    return np.float32(min(1.0, t))


@inline
def _search(
    words: IntArray, side: int, segments: FloatArray, item: int, is_any: bool, room: IntArray, stop: FlagArray
) -> int:
    """Ask the bodies of one `BodyTree` that a segment may meet, about as it enters their boxes, until what was found
    comes before all others; return what `_ask` does."""
    scratch, bodies, n_before = scratch_at(room), tree_in(words[side], segments.shape[2]), side * words[0, N_BODIES]
    way, last = way_of(segments, item, bodies), np.float32(1.0)
    begin_way(bodies, way, scratch)
    body = next_body(segments, item, bodies, way, last, scratch)
    while body >= 0:
        if side == 1 or not has_moved(words, body):
            state = _ask(words, n_before + body, segments, item, is_any, room, stop)
            if state != SETTLED:
                return state
            if not is_any:
                last = _reached(scratch, bodies, way)
        body = next_body(segments, item, bodies, way, last, scratch)
    return SETTLED


@kernel
def find_first(
    segments: FloatArray, order: IntArray, last: int, words: IntArray, room: IntArray, is_any: bool, stop: FlagArray,
    state: FlagArray, out: Firsts, n: IntArray,
) -> None:  # fmt: skip
    """Find the first piece of segments (n, 2, dim), those before `last` in an order (n,), or where `is_any` whether
    there is one.

    state: (n,) uint8, SETTLED, MET or OPEN; out: of those that are MET the piece, unless `is_any`. room: of
    `scratch_for`. n: the segment to begin with, afterwards where to go on; 0, or why it is not asked (what
    `crossings_in` wants), and the body; how many are MET and how many OPEN; whether rows of `out` are filled one after
    another, not each in its segment's place.
    """
    scratch = scratch_at(room)
    noted, n[1] = scratch.found, 0
    for turn in range(n[0], last):
        n[0], item = turn, order[turn]
        prefetch(segments, order[min(turn + AHEAD, last - 1)] * 2 * segments.shape[2])
        if stop[0]:
            return
        found, scratch.best[0], noted[0], noted[1] = SETTLED, np.inf, -1, 0
        is_safe = is_item_safe(segments, item)
        for side in range(2):
            if found == SETTLED and words[side, N_BODIES] > 0:
                found = _search(words, side, segments, item, is_any, room, stop) if is_safe else OPEN
        if found < 0:
            n[1], n[2] = found, noted[0]
            return
        if found == SETTLED:
            found = OPEN if noted[1] != 0 else MET if noted[0] >= 0 else SETTLED
        if found == MET and not is_any:
            _put_first(scratch, out, n[3] if n[5] != 0 else item, item)
        state[item] = found
        n[3] += found == MET
        n[4] += found == OPEN
    n[0] = last
