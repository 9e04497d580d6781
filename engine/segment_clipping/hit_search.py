"""Search for the hits of segments and rays on a mesh, compiled: an ordered descent of its tree of boxes.

Boxes are entered about in order, and none that begins behind the first hit so far, if that is all that is wanted
(`_bound_of`). Contacts at one parameter are one hit. Their parameters are double-doubles, within 2^-67 of themselves:
where that does not prove two apart they must be one point by their codes, else the line stays OPEN (exact_hits.py).

Source: I. Wald, C. Benthin, S. Boulos, Getting rid of packets: efficient SIMD single-ray traversal using
multi-branching BVHs, 2008.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.bounding.bvh import STACK, WIDTH
from engine.compiling.jit import allocating_kernel, called, inline, merged
from engine.lanes.boxes import BOX_ROWS, EMPTY, enter_boxes
from engine.lanes.faces import CORNER_ROWS, longest_axis, near_triangles
from engine.lanes.lanes import lowest_bit, prefetch
from engine.lanes.tracing import LANES
from engine.predicates.error_free import U2, two_diff
from engine.segment_clipping.flat_hits import flat_stretch
from engine.segment_clipping.hit_contacts import IN_PLANE, Hit, Line, triangle_hit
from engine.segment_clipping.on_boundary.boundary_cut import Crossings, allocate_crossings, sort_crossings
from engine.segment_clipping.on_boundary.contacts import Bit, Kind, Place, are_same_point, decode_place
from engine.segment_clipping.on_boundary.crossing_values import is_item_safe
from engine.segment_clipping.on_boundary.mesh_contacts import LIMIT, far_end, local_segment, shear_of
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh
from engine.segment_clipping.on_boundary.triangle_contacts import are_flush, corner, triangle_at
from engine.types import OPEN, FlagArray, FloatArray, IntArray, Point3

ALL, FIRST, ANY, NEAR = 0, 1, 2, 3
"""What is searched: all hits, the first, whether there is one; NEAR: the triangles that may be met."""
ACROSS, TOUCH, RIM, END, ALONG = 0, 1, 2, 3, 4
SETTLED, MET, NO_ROOM, UNSURE, GOES_ON = 0, 1, -1, -2, -3
Rows = namedtuple("Rows", "source t t_end triangle kind barycentric")
"""Hits as columns. Of NEAR only source and triangle."""
_Scratch = namedtuple("_Scratch", "stack keys entered cuts")
_SIDES: Final = (5, 3, 6, 1, 2, 4)
"""The sides, as bits, on which each place of a triangle (corners 0, 1, 2, sides 3, 4, 5) lies."""


@merged
def _line_of(lines: FloatArray, tails: FloatArray, blurs: FloatArray, item: int, is_ray: bool) -> Line:
    """Return a row of lines (n, 2, 3), p and q or p and e. tails, blurs: of lines under a pose, which are p and e, the
    tails and error bounds (n,) of these; no rows without a pose."""
    p, q, is_placed = corner(lines, item, 0), corner(lines, item, 1), tails.shape[0] > 0
    if is_placed:
        at, low = corner(tails, item, 0), corner(tails, item, 1)
        size = max(abs(p.x), abs(p.y), abs(p.z), abs(q.x), abs(q.y), abs(q.z))
        start = (p.x, at.x), (p.y, at.y), (p.z, at.z)
        way = (q.x, low.x), (q.y, low.y), (q.z, low.z)
        return Line(start, way, blurs[item] + 8.0 * U2 * size, p, q, is_ray, True)
    start = (p.x, 0.0), (p.y, 0.0), (p.z, 0.0)
    if is_ray:
        return Line(start, ((q.x, 0.0), (q.y, 0.0), (q.z, 0.0)), 0.0, Point3(0.0, 0.0, 0.0), q, True, False)
    return Line(start, (two_diff(q.x, p.x), two_diff(q.y, p.y), two_diff(q.z, p.z)), 0.0, p, q, False, False)


@merged
def _push(mesh: Mesh, node: int, bits: int, scratch: _Scratch, depth: int) -> int:
    """Push the children of an inner node that are set in `bits`, the first entered on top; return the new depth."""
    stack, keys, bottom = scratch.stack, scratch.keys, depth
    while bits != 0:
        lane = lowest_bit(bits)
        bits &= bits - 1
        below, at = mesh.child[node, lane], depth
        if below < 0:  # case: numbers that are none, which nothing separates
            continue
        while at > bottom and keys[at - 1] < scratch.entered[0, lane]:
            stack[at], keys[at] = stack[at - 1], keys[at - 1]
            at -= 1
        stack[at], keys[at] = below, scratch.entered[0, lane]
        depth += 1
        prefetch(mesh.child, below * WIDTH)
        if below < mesh.n_inner:
            for row in range(0, BOX_ROWS * WIDTH, 16):
                prefetch(mesh.boxes, below * (BOX_ROWS * WIDTH) + row)
        else:
            for row in range(0, CORNER_ROWS * LANES, 16):
                prefetch(mesh.corners, (below - mesh.n_inner) * (CORNER_ROWS * LANES) + row)
    return depth


@inline
def _search(mesh: Mesh, line: Line, keep: int, scratch: _Scratch, stop: FlagArray) -> int:
    """Fill the cuts of `scratch` with the contacts of a line, or those of its first hit; return their number, NO_ROOM,
    or UNSURE. ANY: 1 if there is one. NEAR: cuts.met is filled with all triangles near. FIRST: GOES_ON if the line may
    run along a triangle there, so that the hit has other contacts farther on."""
    x, y, z = mesh.inverse[0], mesh.inverse[1], mesh.inverse[2]
    start = Point3(  # order: the tails are added to what the origin leaves, of which they may be no small part
        line.start[0][0] * x - mesh.origin[0] * x + line.start[0][1] * x,
        line.start[1][0] * y - mesh.origin[1] * y + line.start[1][1] * y,
        line.start[2][0] * z - mesh.origin[2] * z + line.start[2][1] * z,
    )
    way = Point3(line.way[0][0] * x, line.way[1][0] * y, line.way[2][0] * z)
    size, length = max(abs(start.x), abs(start.y), abs(start.z)), max(abs(way.x), abs(way.y), abs(way.z))
    if not (length > 0.0 and (size + 4.0 * LIMIT) / length < np.inf and size + length < np.inf):
        return UNSURE
    far = far_end(start, way, line.is_ray)
    local = local_segment(start, far, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), line.blur * max(x, y, z))
    (i, j, k), place, r, s, across, slack = shear_of(local)
    stack, keys, entered, cuts, last = scratch.stack, scratch.keys, scratch.entered, scratch.cuts, np.float32(1.0)
    n, best, is_open, depth = 0, np.inf, False, int(local.is_near)
    stack[0], keys[0] = 0, np.float32(-1.0)
    while depth > 0:  # bound: each node enters the stack once
        depth -= 1
        node = stack[depth]
        if keys[depth] > last or stop[0]:
            continue
        if node < mesh.n_inner:
            bits = enter_boxes(mesh.boxes, node, local.middle, local.inverse, local.slack, last, entered)
            depth = _push(mesh, node, bits, scratch, depth)
            continue
        bits = near_triangles(mesh.corners, node - mesh.n_inner, i, j, k, place, r, s, across, slack)
        while bits != 0:
            below = mesh.child[node, lowest_bit(bits)]
            bits &= bits - 1
            if below == EMPTY:
                continue
            if n + 2 > cuts.met.size:
                return NO_ROOM
            cuts.met[n] = -1 - below
            if keep == NEAR:
                n += 1
                continue
            hit = triangle_hit(mesh.elements, -1 - below, mesh.are_safe, line, best, keep == ANY)
            end = n
            if hit.code == IN_PLANE:
                hit, end = _flat_hit(mesh, -1 - below, line, cuts, n)
            if hit.code == Kind.APART:
                continue
            if keep == ANY and hit.code != Kind.DEGENERATE:
                return 1
            if hit.code == Kind.DEGENERATE:
                if keep != ANY:
                    return UNSURE
                is_open = True
                continue
            if keep == FIRST:
                if hit.t > best:
                    continue
                if hit.code & Bit.BEGINS != 0:
                    return GOES_ON
                if hit.t < best:
                    best, last, n, end = hit.t, _bound_of(start, way, local, hit.t), 0, 0
            cuts.t[n], cuts.met[n], cuts.codes[n] = hit.t, -1 - below, hit.code
            cuts.points[n, 0], cuts.points[n, 1], cuts.points[n, 2] = hit.first, hit.second, hit.third
            cuts.points[n, 3] = hit.low
            n = end + 1
    return UNSURE if is_open else n


@inline
def _flat_hit(mesh: Mesh, element: int, line: Line, cuts: Crossings, n: int) -> tuple[Hit, int]:
    """Return the contact where a line enters a triangle of its plane, and n + 1 if it leaves it elsewhere, n if not;
    the contact there is put in place n + 1."""
    each = flat_stretch(line, *triangle_at(mesh.elements, element))
    if each.end_code != 0:
        cuts.t[n + 1], cuts.met[n + 1], cuts.codes[n + 1] = each.t_end, element, each.end_code
        cuts.points[n + 1, 3] = each.low_end
    return Hit(each.code, each.t, each.low, each.first, each.second, each.third), n + (each.end_code != 0)


@inline
def _bound_of(start: Point3, way: Point3, local: Any, t: float) -> Any:
    """Return a float32 upper bound on the parameter, along a segment `local` in tree coordinates (-1 .. 1), of the
    point at t, the nearest double: on the longest axis k it is (x - m) / h for middle m and half h, x = p + t e."""
    k = longest_axis(local.half)
    x, size = start[k] + t * way[k], abs(start[k]) + abs(t * way[k])
    slack = 2.0 * local.slack + 2.0**-50 * size
    bound = (x - local.middle[k]) / local.half[k] + slack / abs(local.half[k]) + 2.0**-20
    return np.float32(min(1.0, bound)) if bound == bound else np.float32(1.0)


@inline
def _are_apart(cuts: Crossings, i: int, j: int) -> bool:
    """Return whether two contacts are proven to have different parameters."""
    t, other = cuts.t[i], cuts.t[j]
    return t != other or abs(cuts.points[i, 3] - cuts.points[j, 3]) > 2.0**-65 * abs(t)


@inline
def _sort(cuts: Crossings, n: int) -> None:
    """Sort n contacts along the line into cuts.order; those that are not proven apart by their doubles t anyhow."""
    sort_crossings(cuts, n)
    for at in range(1, n):  # t alone is in order: runs of equal t are short
        i, place, t = cuts.order[at], at, cuts.t[cuts.order[at]]
        while (
            place > 0
            and cuts.t[cuts.order[place - 1]] == t
            and cuts.points[cuts.order[place - 1], 3] > cuts.points[i, 3]
        ):
            cuts.order[place] = cuts.order[place - 1]
            place -= 1
        cuts.order[place] = i


@inline
def _write_hits(
    mesh: Mesh, rims: FlagArray, cuts: Crossings, n: int, keep: int, source: int, out: Rows, row: int
) -> int:
    """Write the hits that n contacts make to `out` from `row` on, with FIRST the first; return the next row, or UNSURE
    if contacts that are not proven apart may be different points. Triangles of one plane in which the line does not lie
    are met in one point."""
    cuts.order[0] = 0
    if n > 1:
        _sort(cuts, n)
    place, n_rows = 0, n if keep == ALL else 1
    while place < n and n_rows > 0:  # bound: each turn passes a contact
        first, n_rows = cuts.order[place], n_rows - 1
        here, best, turns, is_rim, n_along = first, first, 0, False, 0
        while place < n and (n_along > 0 or not _are_apart(cuts, cuts.order[place], here)):
            i = cuts.order[place]
            if _are_apart(cuts, i, here):
                here = i
            element, code, other = cuts.met[i], cuts.codes[i], cuts.codes[here]
            if i != here and not (
                are_same_point(mesh.elements, cuts.met[here], other, element, code)
                or ((code | other) & Bit.ALONG == 0 and are_flush(mesh.elements, cuts.met[here], element))
            ):
                return UNSURE
            turns ^= code & 1
            n_along += (code & Bit.BEGINS != 0) - (code & Bit.CEASES != 0)
            if here == first:
                at = decode_place(code)
                is_rim |= at < Place.START and rims[element] & _SIDES[at] != 0
                if _comes_before(mesh, cuts, i, best):
                    best = i
            place += 1
        is_end = Place.START <= decode_place(cuts.codes[first]) <= Place.END
        out.source[row], out.t[row], out.t_end[row], out.triangle[row] = (
            source,
            cuts.t[first],
            cuts.t[here],
            cuts.met[best],
        )
        out.kind[row] = END if is_end else RIM if is_rim else ACROSS if turns == 1 else TOUCH
        if here != first:
            out.kind[row] = ALONG
        for k in range(3):
            out.barycentric[row, k] = cuts.points[best, k]
        row += 1
    return row


@inline
def _comes_before(mesh: Mesh, cuts: Crossings, i: int, j: int) -> bool:
    """Return whether the triangle of contact i counts before that of contact j at the same point: those in whose plane
    the line lies are the last, then the least face counts."""
    is_along, is_other = cuts.codes[i] & Bit.ALONG, cuts.codes[j] & Bit.ALONG
    if is_along != is_other:
        return is_along < is_other
    face, other = mesh.faces[cuts.met[i]], mesh.faces[cuts.met[j]]
    return face < other or (face == other and cuts.met[i] < cuts.met[j])


@called
def _run(
    lines: FloatArray, tails: FloatArray, blurs: FloatArray, is_ray: bool, mesh: Mesh, rims: FlagArray, keep: int,
    scratch: _Scratch, stop: FlagArray, out: Rows, state: FlagArray, n: IntArray,
) -> None:  # fmt: skip
    """Search for each line, see `find_hits`."""
    row, n[1], n[2] = 0, 0, 0
    for item in range(n[0], lines.shape[0]):
        n[0], state[item] = item, OPEN
        if stop[0]:
            return
        if not is_item_safe(lines, item):
            continue
        line = _line_of(lines, tails, blurs, item, is_ray)
        n_met = _search(mesh, line, keep, scratch, stop)
        if n_met == GOES_ON:
            n_met = _search(mesh, line, ALL, scratch, stop)
        if n_met == NO_ROOM or (keep != ANY and row + n_met > out.source.size):
            n[2] = 1
            return
        state[item] = OPEN if n_met == UNSURE else MET if n_met > 0 else SETTLED
        if n_met > 0 and keep == NEAR:
            for i in range(n_met):
                out.source[row + i], out.triangle[row + i] = item, scratch.cuts.met[i]
            row += n_met
        elif n_met > 0 and keep != ANY:
            reached = _write_hits(mesh, rims, scratch.cuts, n_met, keep, item, out, row)
            if reached == UNSURE:
                state[item] = OPEN
            else:
                row = reached
        n[1] = row
    n[0] = lines.shape[0]


@allocating_kernel
def find_hits(
    lines: FloatArray, tails: FloatArray, blurs: FloatArray, is_ray: bool, mesh: Mesh, rims: FlagArray, keep: int,
    room: int, stop: FlagArray, out: Rows, state: FlagArray, n: IntArray,
) -> None:  # fmt: skip
    """Find the hits of lines (m, 2, 3) on a mesh, in the order of lines and then of t.

    | argument | content |
    |---|---|
    | lines, tails, blurs, is_ray | see `_line_of`; is_ray: they have no far end |
    | rims (k,) uint8 | by triangle, the sides that are rims, as bits |
    | keep | ALL, FIRST, ANY or NEAR |
    | room | capacity for the contacts of a line |
    | state (m,) uint8 | out: SETTLED (no hit), MET, or OPEN |
    | n (3,) int64 | 0: the first line, on return the next; 1: rows filled; 2: whether room or rows are too few |
    """
    stack, keys, entered = np.empty(STACK, np.int32), np.empty(STACK, np.float32), np.empty((1, WIDTH), np.float32)
    scratch = _Scratch(stack, keys, entered, allocate_crossings(room, 4))
    _run(lines, tails, blurs, is_ray, mesh, rims, keep, scratch, stop, out, state, n)
