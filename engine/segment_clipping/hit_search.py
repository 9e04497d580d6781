"""Search for the hits of segments and rays on a mesh, compiled: an ordered descent of its tree of boxes (descent.py).

No box is entered that begins behind the first hit so far, if that is all that is wanted (`_bound_of`). What a kernel
does not decide stays OPEN (exact_hits.py).

Source: I. Wald, C. Benthin, S. Boulos, Getting rid of packets: efficient SIMD single-ray traversal using
multi-branching BVHs, 2008.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.compiling.jit import allocating_kernel, called, inline, merged
from engine.lanes.boxes import EMPTY
from engine.lanes.faces import longest_axis, near_triangles
from engine.lanes.lanes import lowest_bit
from engine.predicates.error_free import two_diff
from engine.segment_clipping.exact_contacts import exact_codes, put_exact_contact
from engine.segment_clipping.exact_lines import Exact, exact_scratch
from engine.segment_clipping.flat_hits import flat_stretch
from engine.segment_clipping.hit_contacts import ASIDE, BACK, IN_PLANE, Hit, Line, triangle_hit
from engine.segment_clipping.hit_rows import Rows, order_contacts, write_contacts, write_hits
from engine.segment_clipping.on_boundary.boundary_cut import UNSURE, Crossings, allocate_crossings
from engine.segment_clipping.on_boundary.contacts import CODE_BITS, Bit, Kind, Place, decode_place
from engine.segment_clipping.on_boundary.crossing_values import Vector, is_item_safe
from engine.segment_clipping.on_boundary.descent import (
    LIMIT,
    allocate_descent,
    begin_descent,
    far_end,
    local_segment,
    next_leaf,
    shear_of,
)
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh
from engine.segment_clipping.on_boundary.triangle_contacts import corner, triangle_at
from engine.types import OPEN, FlagArray, FloatArray, IntArray, Point3

ALL, FIRST, ANY, NEAR, CUT, CODES = 0, 1, 2, 3, 4, 5
"""What is searched: all hits, the first, whether there is one; NEAR: the triangles that may be met; CUT: all contacts,
with the points where they are; CODES: the codes of all contacts."""
IS_INSIDE: Final = 4
"""Bit of the state of a segment that is cut: the perturbed line is inside a closed mesh before its first contact."""
SETTLED, MET, NO_ROOM, GOES_ON = 0, 1, -2, -3
_Scratch = namedtuple("_Scratch", "descent cuts exact")
_DEGENERATE: Final = int(Kind.DEGENERATE)
_OPEN_ROWS: Final = 4


@merged
def _line_of(lines: FloatArray, placed: FloatArray, blurs: FloatArray, item: int, is_ray: bool) -> Line:
    """Return a row of lines (n, 2, 3), p and q or p and e. placed (n, 4, 3), blurs (n,): of lines under a pose p and e
    in the frame of the body, heads and tails of double-doubles, and error bounds of these, infinite for none; no rows
    without a pose."""
    p, q = corner(lines, item, 0), corner(lines, item, 1)
    if placed.shape[0] > 0:
        return Line(_pairs(placed[item], 0), _pairs(placed[item], 1), blurs[item], p, q, is_ray, True, 0)
    start = (p.x, 0.0), (p.y, 0.0), (p.z, 0.0)
    if is_ray:
        return Line(start, ((q.x, 0.0), (q.y, 0.0), (q.z, 0.0)), 0.0, Point3(0.0, 0.0, 0.0), q, True, False, 0)
    return Line(start, (two_diff(q.x, p.x), two_diff(q.y, p.y), two_diff(q.z, p.z)), 0.0, p, q, False, False, 0)


@inline
def _pairs(numbers: FloatArray, row: int) -> Vector:
    """Return the double-doubles of which the heads are in a row, and the tails two rows later."""
    return (
        (numbers[row, 0], numbers[row + 2, 0]), (numbers[row, 1], numbers[row + 2, 1]),
        (numbers[row, 2], numbers[row + 2, 2]),
    )  # fmt: skip


@inline
def _back(line: Line) -> Line:
    """Return the ray from the start of a segment under a pose away from its end."""
    x, y, z = line.way
    way = (-x[0], -x[1]), (-y[0], -y[1]), (-z[0], -z[1])
    return Line(line.start, way, line.blur, line.p, line.q, True, True, BACK)


@inline
def _aside(line: Line, pose: FloatArray) -> Line:
    """Return the ray from the start of a segment under a pose along the vector of `pose`, see `lines_on`."""
    q, way = Point3(pose[4, 0], pose[4, 1], pose[4, 2]), _pairs(pose, 5)
    return Line(line.start, way, max(line.blur, pose[6, 0]), line.p, q, True, True, ASIDE)


@merged
def _search(mesh: Mesh, line: Line, item: int, keep: int, scratch: _Scratch, stop: FlagArray) -> int:
    """Fill the cuts of `scratch` with the contacts of line number ``item``, or those of its first hit; return their
    number, NO_ROOM, or UNSURE. ANY: 1 if there is one. NEAR: cuts.met is filled with all triangles near. CODES:
    of contacts only the codes. FIRST: GOES_ON if the line may run along a triangle there, so that the hit has other
    contacts farther on."""
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
    if not local.is_near:
        return 0
    (i, j, k), place, r, s, across, slack = shear_of(local)
    cuts, last, n, best, is_open = scratch.cuts, np.float32(1.0), 0, np.inf, False
    begin_descent(scratch.descent)
    while not stop[0]:  # bound: each turn takes a leaf
        node = next_leaf(mesh, local, last, scratch.descent)
        if node == EMPTY:
            break
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
            hit = triangle_hit(mesh.elements, -1 - below, mesh.are_safe, line, best, keep in (ANY, CODES))
            end = n
            if hit.code == IN_PLANE:
                hit, end = _flat_hit(mesh, -1 - below, line, cuts, n)
            if hit.code == Kind.DEGENERATE:
                hit, end = _exact_hit(scratch.exact, mesh, -1 - below, line, item, keep, cuts, n)
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


@called
def _exact_hit(
    exact: Exact, mesh: Mesh, element: int, line: Line, item: int, keep: int, cuts: Crossings, n: int
) -> tuple[Hit, int]:
    """Return the contact of a line with a triangle that all before leave open, as `_flat_hit` does."""
    codes, t, is_sure = exact_codes(exact, mesh.elements, element, line, item), 0.0, True
    code, end_code = codes & ((1 << CODE_BITS) - 1), codes >> CODE_BITS
    if keep in (ANY, CODES):
        end_code = 0
    elif codes != Kind.APART and codes != Kind.DEGENERATE:
        t, is_sure = put_exact_contact(exact, mesh.elements, element, code, cuts.points[n], keep != CUT)
    if end_code != 0:
        cuts.met[n + 1], cuts.codes[n + 1] = element, end_code
        cuts.t[n + 1], is_end_sure = put_exact_contact(
            exact, mesh.elements, element, end_code, cuts.points[n + 1], False
        )
        is_sure &= is_end_sure
    if not is_sure:
        code = _DEGENERATE
    points = cuts.points[n]
    return Hit(code, t, points[3], points[0], points[1], points[2]), n + (end_code != 0)


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
def _leaves(cuts: Crossings, n: int) -> bool:
    """Return whether a segment with n contacts, ordered, leaves the surface before its end."""
    n_along, has_left = 0, False
    for place in range(n):
        code = cuts.codes[cuts.order[place]]
        has_left |= code & Bit.LATER != 0 and n_along == 0
        n_along += (code & Bit.BEGINS != 0) - (code & Bit.CEASES != 0)
    return has_left or (n_along == 0 and decode_place(cuts.codes[cuts.order[n - 1]]) != Place.END)


@inline
def _n_before(cuts: Crossings, n: int) -> int:
    """Return how many triangles the perturbed line crosses before its start, of n contacts with a ray from there."""
    n_crossed = 0
    for i in range(n):
        n_crossed += cuts.codes[i] & Bit.CROSSES if decode_place(cuts.codes[i]) != Place.START else 0
    return n_crossed


@called
def _search_again(mesh: Mesh, line: Line, item: int, keep: int, scratch: _Scratch, stop: FlagArray) -> int:
    """Return what `_search` does: a second search of a line is rare."""
    return _search(mesh, line, item, keep, scratch, stop)


@called
def _location_before(mesh: Mesh, line: Line, item: int, n: int, scratch: _Scratch, stop: FlagArray) -> int:
    """Return whether the perturbed line is inside a closed mesh before the first of n ordered contacts of a segment
    under a pose, as a bit of its state: 0 if that is not asked, else also NO_ROOM or UNSURE."""
    cuts = scratch.cuts
    if n == 0 or decode_place(cuts.codes[cuts.order[0]]) != Place.START:
        n = _search_again(mesh, _aside(line, scratch.exact.pose), item, CODES, scratch, stop)
    elif _leaves(cuts, n):
        n = _search_again(mesh, _back(line), item, CODES, scratch, stop)
    else:
        return 0
    return n if n < 0 else IS_INSIDE * (_n_before(cuts, n) & 1)


@called
def _run(
    lines: FloatArray, placed: FloatArray, blurs: FloatArray, is_ray: bool, mesh: Mesh, rims: FlagArray, keep: int,
    scratch: _Scratch, stop: FlagArray, out: Rows, state: FlagArray, n: IntArray,
) -> None:  # fmt: skip
    """Search for each line, see `find_hits`."""
    row, n[1], n[2], cuts, exact = 0, 0, 0, scratch.cuts, scratch.exact
    for item in range(n[0], lines.shape[0]):
        n[0], state[item] = item, OPEN
        if stop[0]:
            return
        if not (blurs[item] < np.inf if placed.shape[0] > 0 else is_item_safe(lines, item)):
            continue
        line = _line_of(lines, placed, blurs, item, is_ray)
        n_met, reached, bit = _search(mesh, line, item, keep, scratch, stop), row, 0
        if n_met == GOES_ON:
            n_met = _search_again(mesh, line, item, ALL, scratch, stop)
        has_room = n_met != NO_ROOM and (keep == ANY or row + n_met <= out.source.size)
        if n_met > 0 and has_room and keep == NEAR:
            for i in range(n_met):
                out.source[row + i], out.triangle[row + i] = item, cuts.met[i]
            reached = row + n_met
        elif n_met > 0 and has_room and keep != ANY:
            n_met = order_contacts(mesh, line, item, cuts, n_met, exact)
            if n_met > 0 and keep == CUT:
                reached = write_contacts(mesh, lines, item, line, cuts, n_met, exact, out, row)
                n_met = min(n_met, reached)
            elif n_met > 0:
                reached = write_hits(mesh, rims, cuts, n_met, keep != ALL, item, out, row)
        if n_met >= 0 and has_room and keep == CUT and exact.pose.shape[0] > _OPEN_ROWS:
            bit = _location_before(mesh, line, item, n_met, scratch, stop)
        if not has_room or bit == NO_ROOM:
            n[2] = 1
            return
        if n_met >= 0 and bit >= 0:
            row, state[item] = reached, bit + (MET if n_met > 0 else SETTLED)
        n[1] = row
    n[0] = lines.shape[0]


@allocating_kernel
def find_hits(
    lines: FloatArray, placed: FloatArray, blurs: FloatArray, is_ray: bool, pose: FloatArray, mesh: Mesh,
    rims: FlagArray, keep: int, room: int, stop: FlagArray, out: Rows, state: FlagArray, n: IntArray,
) -> None:  # fmt: skip
    """Find the hits of lines (m, 2, 3) on a mesh, in the order of lines and then of t.

    | argument | content |
    |---|---|
    | lines, placed, blurs, is_ray | see `_line_of`; is_ray: they have no far end |
    | pose (4 or 8, 3) | of the body, R and t; for none the identity; CUT on closed meshes: a vector (scenes/hits.py) |
    | rims (k,) uint8 | by triangle, the sides that are rims, as bits |
    | keep | ALL, FIRST, ANY or NEAR; CUT under a pose |
    | room | capacity for the contacts of a line |
    | state (m,) uint8 | out: SETTLED (no hit), MET, or OPEN; CUT: the first two with IS_INSIDE maybe |
    | n (3,) int64 | 0: the first line, on return the next; 1: rows filled; 2: whether room or rows are too few |
    """
    scratch = _Scratch(allocate_descent(), allocate_crossings(room, 4), exact_scratch(pose))
    _run(lines, placed, blurs, is_ray, mesh, rims, keep, scratch, stop, out, state, n)
