"""Segments through a scene, compiled: the pieces within bodies, the first of them, or whether there is one.

Bodies near a segment are those whose boxes its way down the tree meets (near_boxes.py). All pieces: each is cut on. The
first: they are asked in the order in which the segment enters their boxes, until a box is entered behind the first end
found. Any: the first body that is surely met is enough. Parameters are rounded to nearest, which keeps their order; a
segment whose first piece would be found by two that round alike, or on a body that leaves it UNDECIDED, is OPEN.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.jit import bare_kernel, inline
from engine.scenes.near_boxes import near_bodies
from engine.scenes.posed_cut import between_planes, in_ball, put_piece
from engine.scenes.posed_mesh import MOST_MET, UNSURE, WANTS_BODY, crossings_in
from engine.segment_clipping.boundary_cut import SETTLED, Crossings, emit, sort_crossings
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


class BodyTable(NamedTuple):
    """What kernels read of the bodies of a scene."""

    kinds: Any
    """(n,) int8."""
    begins: Any
    """(n,) int64: of a ball its row in centers, of rows the first, of a mesh its row in meshes."""
    ends: Any
    """(n,) int64: of rows the one behind the last; of a mesh whether it is closed."""
    frames: Any
    """(n,) int64: row of a body's pose in the next two, -1 for none."""
    inverses: Any
    """(m, 3, 3, 2): R^-1 as double-doubles; those of the plane with z = z."""
    shifts: Any
    """(m, 3)."""
    rows: Any
    """(k, 4)."""
    centers: Any
    """(b, 3, 2): in the world, double-doubles."""
    radii: Any
    """(b,)."""
    meshes: Any
    trees: Any
    """`Lines`: of a mesh (`PlacedMesh`), and of the tree that points are located by (`tree_at`)."""


@inline
def _cut_on(
    table: Any, body: int, segments: Any, item: int, source: int, scratch: Any, stop: Any, out: Pieces, row: int
) -> int:
    """Write the pieces of a segment within a body to the rows of `out` from `row` on; return how many, or why not."""
    kind = table.kinds[body]
    if kind <= OTHER:
        return UNSURE if kind == OTHER else WANTS_BODY
    if kind == MESH:
        n_met, is_in = crossings_in(table, body, segments, item, False, scratch, stop)
        if n_met < 0:
            return n_met
        if table.ends[body] == 0:
            return _emit_points(scratch.cuts, n_met, source, out, row)
        return emit(segments, item, source, is_in, scratch.cuts, 0, n_met, out, row) - row
    if kind == BALL:
        meets, first, last = in_ball(table, body, segments, item)
    else:
        meets, first, last = between_planes(table, body, segments, item)
    if meets == -1:
        return 0
    return 1 if meets == 1 and put_piece(out, row, source, segments, item, first, last) else UNSURE


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
def _meets(table: Any, body: int, segments: Any, item: int, scratch: Any, stop: Any) -> int:
    """Return 1 or 0 for a segment that meets a body or not, or why that is not known."""
    kind = table.kinds[body]
    if kind <= OTHER:
        return UNSURE if kind == OTHER else WANTS_BODY
    if kind == MESH:
        n_met, is_in = crossings_in(table, body, segments, item, True, scratch, stop)
        return n_met if n_met < 0 else 1 if n_met > 0 or is_in else 0
    if kind == BALL:
        meets, _, _ = in_ball(table, body, segments, item)
    else:
        meets, _, _ = between_planes(table, body, segments, item)
    return 0 if meets == -1 else 1 if meets == 1 else UNSURE


@bare_kernel
def cut_pairs(
    segments: Any,
    owners: Any,
    bodies: Any,
    table: Any,
    scratch: Any,
    stop: Any,
    out: Pieces,
    state: Any,
    n: Any,
) -> None:
    """Cut pairs of a segment (n, 2, dim) and a body; the source of a piece is its pair.

    state: of each pair SETTLED or OPEN. n: the pair to begin with, afterwards where to go on; how many rows of `out`
    are filled; and 0, or why the next is not cut: what `crossings_in` wants. There is to be room for MOST_MET pieces.
    """
    n[1], n[2] = 0, 0
    for pair in range(n[0], owners.size):
        n[0] = pair
        if stop[0] or n[1] + MOST_MET > out.source.size:
            return
        item, found = owners[pair], UNSURE
        if is_item_safe(segments, item):
            found = _cut_on(table, bodies[pair], segments, item, pair, scratch, stop, out, n[1])
        if found < UNSURE:
            n[2] = found
            return
        state[pair] = OPEN if found == UNSURE else SETTLED
        n[1] += max(found, 0)
    n[0] = owners.size


@inline
def _entered(segments: Any, item: int, box: Any) -> float:
    """Return a parameter before which a segment is not in a box."""
    first = 0.0
    for k in range(box.shape[1]):
        p, d = segments[item, 0, k], segments[item, 1, k] - segments[item, 0, k]
        if d != 0.0:
            entered = (box[0 if d > 0.0 else 1, k] - p) / d
            first = entered if entered > first else first
    return first * NEAR


@inline
def _ask_for_first(
    segments: Any, item: int, near: Crossings, n: int, table: Any, scratch: Any, stop: Any, room: Any, out: Any
) -> tuple[int, int]:
    """Set row `item` of `out` to the first piece of a segment within n bodies, by where their boxes are entered; return
    the state and the body, or what a body wants and that."""
    sort_crossings(near, 0, n)
    best, best_body, is_open = np.inf, -1, False
    for place in range(n):
        i = near.order[place]
        if near.t[i] > best:
            break
        body = near.faces[i]
        found = _cut_on(table, body, segments, item, item, scratch, stop, room, 0)
        if found < UNSURE:
            return found, body
        if found == UNSURE:
            return OPEN, -1
        if found == 0 or room.t[0, 0] > best:
            continue
        if room.t[0, 0] == best:
            are_own = room.faces[0, 0] < 0 and out.faces[item, 0] < 0
            is_open |= not are_own
            if not are_own or body > best_body:
                continue
        else:
            is_open = False
        best, best_body, out.source[item] = room.t[0, 0], body, item
        for end in range(2):
            out.t[item, end], out.faces[item, end] = room.t[0, end], room.faces[0, end]
            for k in range(segments.shape[2]):
                out.ends[end, item, k] = room.ends[end, 0, k]
    return (OPEN if is_open else SETTLED if best_body < 0 else MET), best_body


@inline
def _ask_for_any(
    segments: Any, item: int, near: Crossings, n: int, table: Any, scratch: Any, stop: Any
) -> tuple[int, int]:
    """Return the state of a segment, or what a body wants and that; balls and convex bodies are asked before meshes."""
    is_open = False
    for turn in range(2):
        for i in range(n):
            body = near.faces[i]
            if (table.kinds[body] == MESH) != (turn == 1):
                continue
            found = _meets(table, body, segments, item, scratch, stop)
            if found < UNSURE:
                return found, body
            if found == 1:
                return MET, body
            is_open |= found == UNSURE
    return (OPEN if is_open else SETTLED), -1


@inline
def _that_stay(bodies: Any, n: int, is_away: Any) -> int:
    """Leave out those of n bodies that are away; return how many are left."""
    n_left = 0
    for place in range(n):
        bodies[n_left] = bodies[place]
        n_left += not is_away[bodies[place]]
    return n_left


@bare_kernel
def find_first(
    segments: Any,
    last: int,
    tree: Any,
    is_away: Any,
    table: Any,
    scratch: Any,
    is_any: bool,
    stop: Any,
    state: Any,
    bodies: Any,
    out: Pieces,
    room: Pieces,
    n: Any,
) -> None:
    """Find the first piece of segments (n, 2, dim) before `last`, or where `is_any` whether there is one.

    tree: a `BodyTree`. is_away: of each body whether it is left out, or (0,)
    where none is. state: (n,) uint8, SETTLED, MET or OPEN; bodies, out: of those that are MET the body and in row i
    the piece. room: for MOST_MET pieces. n: the segment to begin with, afterwards where to go on; and 0, or why it
    is not asked (what `crossings_in` wants), and the body.
    """
    near = scratch.near
    n[1] = 0
    for item in range(n[0], last):
        n[0] = item
        if stop[0]:
            return
        n_near = near_bodies(segments, item, tree, scratch.stack, near.faces)
        if is_away.size > 0:
            n_near = _that_stay(near.faces, n_near, is_away)
        found, body = SETTLED, -1
        if n_near > 0 and not is_item_safe(segments, item):
            found = OPEN
        elif n_near > 0 and is_any:
            found, body = _ask_for_any(segments, item, near, n_near, table, scratch, stop)
        elif n_near > 0:
            for i in range(n_near):
                near.t[i] = _entered(segments, item, tree.boxes[near.faces[i]])
            found, body = _ask_for_first(segments, item, near, n_near, table, scratch, stop, room, out)
        if found < 0:
            n[1], n[2] = found, body
            return
        state[item], bodies[item] = found, body
    n[0] = last
