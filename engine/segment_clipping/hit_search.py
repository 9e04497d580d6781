"""Search for the hits of segments and rays on a mesh, compiled: an ordered descent of its tree of boxes.

Boxes are entered about in order, and none that begins behind the first hit so far, if that is all that is wanted
(`_bound_of`). What a kernel does not decide stays OPEN (exact_hits.py).

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
from engine.predicates.error_free import two_diff
from engine.segment_clipping.exact_contacts import exact_codes, put_exact_contact
from engine.segment_clipping.exact_lines import Exact, exact_scratch
from engine.segment_clipping.flat_hits import flat_stretch
from engine.segment_clipping.hit_contacts import ASIDE, BACK, IN_PLANE, Hit, Line, triangle_hit
from engine.segment_clipping.hit_rows import Rows, order_contacts, write_contacts, write_hits
from engine.segment_clipping.on_boundary.boundary_cut import UNSURE, Crossings, allocate_crossings
from engine.segment_clipping.on_boundary.contacts import CODE_BITS, Bit, Kind, Place, decode_place
from engine.segment_clipping.on_boundary.crossing_values import Vector, is_item_safe
from engine.segment_clipping.on_boundary.mesh_contacts import LIMIT, far_end, local_segment, shear_of
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh
from engine.segment_clipping.on_boundary.triangle_contacts import corner, triangle_at
from engine.types import OPEN, FlagArray, FloatArray, IntArray, Point3

ALL, FIRST, ANY, NEAR, CUT, CODES = 0, 1, 2, 3, 4, 5
"""What is searched: all hits, the first, whether there is one; NEAR: the triangles that may be met; CUT: all contacts,
with the points where they are; CODES: the codes of all contacts."""
IS_INSIDE: Final = 4
"""Bit of the state of a segment that is cut: the perturbed line is inside a closed mesh before its first contact."""
SETTLED, MET, NO_ROOM, GOES_ON = 0, 1, -2, -3
_Scratch = namedtuple("_Scratch", "stack keys entered cuts exact")
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
            hit = triangle_hit(mesh.elements, -1 - below, mesh.are_safe, line, best, keep in (ANY, CODES))
            end = n
            if hit.code == IN_PLANE:
                hit, end = _flat_hit(mesh, -1 - below, line, cuts, n)
            if hit.code == Kind.DEGENERATE and line.is_placed:
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
    """Return the contact of a line under a pose with a triangle that filters leave open, as `_flat_hit` does."""
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
def _run(
    lines: FloatArray, placed: FloatArray, blurs: FloatArray, is_ray: bool, mesh: Mesh, rims: FlagArray, keep: int,
    scratch: _Scratch, stop: FlagArray, out: Rows, state: FlagArray, n: IntArray,
) -> None:  # fmt: skip
    """Search for each line, see `find_hits`."""
    row, n[1], n[2], cuts, pose = 0, 0, 0, scratch.cuts, scratch.exact.pose
    for item in range(n[0], lines.shape[0]):
        n[0], state[item] = item, OPEN
        if stop[0]:
            return
        if not (blurs[item] < np.inf if placed.shape[0] > 0 else is_item_safe(lines, item)):
            continue
        line, want, reached, n_met, outcome = _line_of(lines, placed, blurs, item, is_ray), keep, row, 0, 0
        while want >= 0:  # bound: two searches
            n_met = _search(mesh, line, item, want, scratch, stop)
            now, want = want, -1
            if n_met == NO_ROOM or (now != ANY and now != CODES and row + n_met > out.source.size):
                n[2] = 1
                return
            if n_met == GOES_ON:
                want = ALL
            elif now == CODES:
                outcome += IS_INSIDE * (_n_before(cuts, n_met) & 1)
            elif n_met >= 0:
                outcome = MET if n_met > 0 else SETTLED
            if n_met > 0 and now == NEAR:
                for i in range(n_met):
                    out.source[row + i], out.triangle[row + i] = item, cuts.met[i]
                reached = row + n_met
            elif n_met > 0 and now != ANY and now != CODES:
                n_met = order_contacts(mesh, line, item, cuts, n_met, scratch.exact)
                if n_met > 0 and now == CUT:
                    reached = write_contacts(mesh, lines, item, line, cuts, n_met, scratch.exact, out, row)
                    n_met = min(n_met, reached)
                elif n_met > 0:
                    reached = write_hits(mesh, rims, cuts, n_met, now != ALL, item, out, row)
            if n_met >= 0 and now == CUT and pose.shape[0] > _OPEN_ROWS:
                if n_met == 0 or decode_place(cuts.codes[cuts.order[0]]) != Place.START:
                    line, want = _aside(line, pose), CODES
                elif _leaves(cuts, n_met):
                    line, want = _back(line), CODES
        if n_met != UNSURE:
            row, state[item] = reached, outcome
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
    | pose (4 or 8, 3) | of the body, R and t; to CUT on a closed mesh also a vector (scenes/hits.py); none without |
    | rims (k,) uint8 | by triangle, the sides that are rims, as bits |
    | keep | ALL, FIRST, ANY or NEAR; CUT under a pose |
    | room | capacity for the contacts of a line |
    | state (m,) uint8 | out: SETTLED (no hit), MET, or OPEN; CUT: the first two with IS_INSIDE maybe |
    | n (3,) int64 | 0: the first line, on return the next; 1: rows filled; 2: whether room or rows are too few |
    """
    stack, keys, entered = np.empty(STACK, np.int32), np.empty(STACK, np.float32), np.empty((1, WIDTH), np.float32)
    scratch = _Scratch(stack, keys, entered, allocate_crossings(room, 4), exact_scratch(pose))
    _run(lines, placed, blurs, is_ray, mesh, rims, keep, scratch, stop, out, state, n)
