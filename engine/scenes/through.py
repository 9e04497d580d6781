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

from engine.jit import bare_kernel, inline, merged
from engine.scenes.near_boxes import name_of, near_bodies
from engine.scenes.posed_cut import between_planes, in_ball, put_piece
from engine.scenes.posed_mesh import MOST_MET, UNSURE, WANTS_BODY, crossings_in
from engine.segment_clipping.boundary_cut import SETTLED, emit, sort_crossings
from engine.segment_clipping.crossing_values import is_item_safe
from engine.segment_clipping.pieces import Pieces
from engine.types import OPEN

UNREADY: Final = -1
OTHER: Final = 0
BALL: Final = 1
ROWS: Final = 2
MESH: Final = 3
"""Kinds of bodies, UNREADY until one is prepared; OTHER ones are cut in exact arithmetic."""
MET: Final = 1
"""State of a segment, beside SETTLED, which meets nothing, and OPEN."""
NEAR: Final = 1.0 - 2.0**-50
"""Parameters at which boxes are entered are quotients of differences: three roundings, and those of an end found."""


BodyTable = namedtuple("BodyTable", "kinds begins ends frames inverses shifts rows centers radii meshes trees")
"""What kernels read of n bodies.

kinds: (n,) int8. begins: (n,) int64, of a ball its row in centers, of rows the first, of a mesh its row in meshes.
ends: (n,) int64, of rows the one behind the last, of a mesh whether it is closed. frames: (n,) int64, row of a body's
pose in inverses (m, 3, 3, 2), R^-1 as double-doubles, those of the plane with z = z, and shifts (m, 3); -1 for none.
rows: (k, 4). centers: (b, 3, 2), in the world, double-doubles. radii: (b,). meshes, trees: `Lines` of a mesh
(`PlacedMesh`), and of the tree that points are located by (`tree_at`).
"""
Cut = namedtuple("Cut", "together moved")
"""The tables of the n bodies of a scene, and of those that moved, which count from n on."""


@merged
def _placed_in(cut: Any, body: int) -> tuple[Any, int]:
    """Return the table that a body stands in, and where."""
    n = cut.together.kinds.size
    return (cut.together, body) if body < n else (cut.moved, body - n)


@inline
def _cut_on(
    cut: Any, body: int, segments: Any, item: int, is_any: bool, scratch: Any, stop: Any, out: Pieces, row: int
) -> int:
    """Write the pieces of a segment within a body to the rows of `out` from `row` on; return how many, or why not.
    Where `is_any` nothing is written, and a positive number says that there are some."""
    table, body = _placed_in(cut, body)
    kind = table.kinds[body]
    if kind <= OTHER:
        return UNSURE if kind == OTHER else WANTS_BODY
    if kind == MESH:
        n_met, is_in = crossings_in(table, body, segments, item, is_any, scratch, stop)
        if n_met < 0 or is_any:
            return n_met if n_met != 0 else int(is_in)
        if table.ends[body] == 0:
            return _emit_points(scratch.cuts, n_met, item, out, row)
        return emit(segments, item, item, is_in, scratch.cuts, 0, n_met, out, row) - row
    if kind == BALL:
        meets, first, last = in_ball(table, body, segments, item)
    else:
        meets, first, last = between_planes(table, body, segments, item)
    if meets == -1:
        return 0
    return 1 if meets == 1 and (is_any or put_piece(out, row, item, segments, item, first, last)) else UNSURE


@inline
def _emit_points(cuts: Any, n: int, source: int, out: Pieces, row: int) -> int:
    """Write each crossing of a surface as a piece of one point; return how many."""
    for place in range(n):
        i = cuts.order[place]
        out.source[row + place] = source
        for end in range(2):
            out.t[row + place, end], out.faces[row + place, end] = cuts.t[i], cuts.faces[i]
            for k in range(out.ends.shape[2]):
                out.ends[end, row + place, k] = cuts.points[i, k]
    return n


@inline
def _list_pairs(segments: Any, owners: Any, bodies: Any, where: Any, scratch: Any) -> int:
    """List segments and the bodies that they may meet; return how many, -1 where there is no room."""
    n_pairs = 0
    for item in range(segments.shape[0]):
        n_near = near_bodies(segments, item, where, scratch.stack, scratch.near.faces)
        if n_pairs + n_near > owners.size:
            return -1
        for place in range(n_near):
            owners[n_pairs], bodies[n_pairs] = item, scratch.near.faces[place]
            n_pairs += 1
    return n_pairs


@bare_kernel
def cut_pairs(
    segments: Any, owners: Any, bodies: Any, where: Any, cut: Any, scratch: Any, stop: Any, out: Pieces, names: Any,
    state: Any, n: Any,
) -> None:  # fmt: skip
    """Cut pairs of a segment (n, 2, dim) and a body of a `Where` and a `Cut`; names: of each piece the body.

    state: of each pair SETTLED or OPEN. n: the pair to begin with, afterwards where to go on; how many rows of `out`
    are filled; 0, or why the next is not cut: what `crossings_in` wants; how many pairs there are, -1 where they are
    to be listed, and afterwards where they found no room; how many are OPEN. There is to be room for MOST_MET pieces.
    """
    n[1], n[2] = 0, 0
    if n[3] < 0:
        n[3] = _list_pairs(segments, owners, bodies, where, scratch)
    for pair in range(n[0], n[3]):
        n[0] = pair
        if stop[0] or n[1] + MOST_MET > names.size:
            return
        item, found = owners[pair], UNSURE
        if is_item_safe(segments, item):
            found = _cut_on(cut, bodies[pair], segments, item, False, scratch, stop, out, n[1])
        if found < UNSURE:
            n[2] = found
            return
        state[pair] = OPEN if found == UNSURE else SETTLED
        n[4] += found == UNSURE
        for row in range(n[1], n[1] + found):
            names[row] = name_of(where, bodies[pair])
        n[1] += max(found, 0)
    n[0] = n[3]


@inline
def _entered(segments: Any, item: int, boxes: Any, body: int) -> float:
    """Return a parameter before which a segment is not in the box of a body of a `BodyTree`."""
    first = 0.0
    for k in range(segments.shape[2]):
        p, d = segments[item, 0, k], segments[item, 1, k] - segments[item, 0, k]
        if d != 0.0:
            entered = ((boxes.low[body, k] if d > 0.0 else boxes.high[body, k]) - p) / d
            first = entered if entered > first else first
    return first * NEAR


@inline
def _ask_for_first(
    segments: Any, item: int, n: int, where: Any, cut: Any, scratch: Any, stop: Any, room: Any, out: Any
) -> tuple[int, int]:
    """Set row `item` of `out` to the first piece of a segment within n bodies, by where their boxes are entered; return
    the state and what the body is called, or what a body wants and that body."""
    near, best, best_name, is_open = scratch.near, np.inf, -1, False
    sort_crossings(near, 0, n)
    for place in range(n):
        i = near.order[place]
        if near.t[i] > best:
            break
        body, name = near.faces[i], name_of(where, near.faces[i])
        found = _cut_on(cut, body, segments, item, False, scratch, stop, room, 0)
        if found < UNSURE:
            return found, body
        if found == UNSURE:
            return OPEN, -1
        if found == 0 or room.t[0, 0] > best:
            continue
        if room.t[0, 0] == best:
            are_own = room.faces[0, 0] < 0 and out.faces[item, 0] < 0
            is_open |= not are_own
            if not are_own or name > best_name:
                continue
        else:
            is_open = False
        best, best_name, out.source[item] = room.t[0, 0], name, item
        for end in range(2):
            out.t[item, end], out.faces[item, end] = room.t[0, end], room.faces[0, end]
            for k in range(segments.shape[2]):
                out.ends[end, item, k] = room.ends[end, 0, k]
    return (OPEN if is_open else SETTLED if best_name < 0 else MET), best_name


@inline
def _ask_for_any(
    segments: Any, item: int, n: int, where: Any, cut: Any, scratch: Any, stop: Any, out: Any
) -> tuple[int, int]:
    """Return the state of a segment, or what a body wants and that; balls and convex bodies are asked before meshes."""
    is_open = False
    for turn in range(2):
        for i in range(n):
            body = scratch.near.faces[i]
            table, place = _placed_in(cut, body)
            if (table.kinds[place] == MESH) != (turn == 1):
                continue
            found = _cut_on(cut, body, segments, item, True, scratch, stop, out, 0)
            if found < UNSURE:
                return found, body
            if found == 1:
                return MET, name_of(where, body)
            is_open |= found == UNSURE
    return (OPEN if is_open else SETTLED), -1


@bare_kernel
def find_first(
    segments: Any, last: int, where: Any, cut: Any, scratch: Any, is_any: bool, stop: Any, state: Any, bodies: Any,
    out: Pieces, room: Pieces, n: Any,
) -> None:  # fmt: skip
    """Find the first piece of segments (n, 2, dim) before `last`, or where `is_any` whether there is one, among the
    bodies of a `Where` and a `Cut`.

    state: (n,) uint8, SETTLED, MET or OPEN; bodies, out: of those that are MET what the body is called, and in row i
    the piece. room: for MOST_MET pieces. n: the segment to begin with, afterwards where to go on; and 0, or why it is
    not asked (what `crossings_in` wants), and the body.
    """
    near, n_together = scratch.near, where.together.low.shape[0]
    n[1] = 0
    for item in range(n[0], last):
        n[0] = item
        if stop[0]:
            return
        n_near = near_bodies(segments, item, where, scratch.stack, near.faces)
        found, body = SETTLED, -1
        if n_near > 0 and not is_item_safe(segments, item):
            found = OPEN
        elif n_near > 0 and is_any:
            found, body = _ask_for_any(segments, item, n_near, where, cut, scratch, stop, out)
        elif n_near > 0:
            for i in range(n_near):
                place = near.faces[i]
                if place < n_together:
                    near.t[i] = _entered(segments, item, where.together, place)
                else:
                    near.t[i] = _entered(segments, item, where.moved, place - n_together)
            found, body = _ask_for_first(segments, item, n_near, where, cut, scratch, stop, room, out)
        if found < 0:
            n[1], n[2] = found, body
            return
        state[item], bodies[item] = found, body
    n[0] = last
