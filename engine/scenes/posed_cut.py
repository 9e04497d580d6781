"""Segments on placed balls, convex bodies and meshes, compiled: parameters are those of the segment in a body's frame.

A pose x -> R x + t with det R > 0 keeps parameters and all orientation signs. With M = R^-1 as double-doubles and the
exact differences p - t and q - p,

    p' = M (p - t),    e' = M (q - p),    a plane's values s(p') and s(p') + n . e' at the ends

in double-doubles with running bounds (u = 2^-53): an entry of M carries u^2, its product 5 u^2, two sums 3 u^2 each, so
a coordinate of p' is within 32 u^2 sum |p - t|, and one of e' likewise; entries of M are below 1.01. A body without a
pose is one under the identity, whose p' and e' carry no error. A ball stays in the world, about the image of its
centre. What a bound leaves open (a sign, the order of two parameters, a coordinate that may round either way) is
UNDECIDED. Doubles decide whether a body is met, and by which planes; double-doubles seldom decide what doubles leave
open.

**Meshes.** Doubles of p' and p' + e', off by `blur` at most, select the triangles; without a pose they are the
segment's own ends, and exact signs settle what the filter leaves open. A closed mesh flips the location at each
crossing, so only the location of the first end, by a vertical ray in the same frame, is needed besides.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.bounding.bvh import WIDTH
from engine.compiling.jit import inline
from engine.containment.methods.polyhedron_ray_parity import locate_in_tree
from engine.containment.prepared import tree_at
from engine.lanes.boxes import BOX_ROWS
from engine.lanes.faces import CORNER_ROWS
from engine.lanes.lanes import array_at
from engine.lanes.tracing import LANES
from engine.predicates.cut_point import T_BOUND
from engine.predicates.error_free import U2, dd_add, dd_div, dd_mul, dd_scale, dd_sub, two_diff
from engine.scenes.near_boxes import MOST_MET, Scratch, scratch_at
from engine.segment_clipping.ball_cut import Pair, between_roots, difference, meets_ball, sign_of
from engine.segment_clipping.on_boundary.boundary_cut import sort_crossings
from engine.segment_clipping.on_boundary.contacts import CROSSED, Bit, Kind, Place, are_same_point, decode_place
from engine.segment_clipping.on_boundary.crossing_values import Vector, cross_exactly, dot, is_item_safe, normal_of
from engine.segment_clipping.on_boundary.mesh_contacts import Waiting, append_contacts
from engine.segment_clipping.on_boundary.triangle_contacts import are_flush, corner, triangle_at
from engine.segment_clipping.pieces import OWN_END, OWN_START, End, point_of, put_point, slack_of
from engine.types import UNDECIDED, FlagArray, FloatArray, IntArray, Point3

_FRAME_BOUND: Final = 32.0 * U2

Frame = tuple[Vector, float, Vector, float]


@inline
def _row(m: FloatArray, i: int, v: Vector) -> Pair:
    """Return row i of M times the vector v, in double-double. m (3, 7): the frame of a pose, entries of M as
    double-doubles."""
    ah, al = dd_mul(m[i, 0], m[i, 1], v[0][0], v[0][1])
    bh, bl = dd_mul(m[i, 2], m[i, 3], v[1][0], v[1][1])
    ch, cl = dd_mul(m[i, 4], m[i, 5], v[2][0], v[2][1])
    ah, al = dd_add(ah, al, bh, bl)
    return dd_add(ah, al, ch, cl)


@inline
def _turned(m: FloatArray, v: Vector) -> tuple[Vector, float]:
    """Return M v in double-doubles, for exact v, and an error bound of each coordinate. m (3, 7): frame of a pose."""
    bound = _FRAME_BOUND * (abs(v[0][0]) + abs(v[1][0]) + abs(v[2][0]))
    return (_row(m, 0, v), _row(m, 1, v), _row(m, 2, v)), bound


@inline
def in_frame(body: IntArray, segments: FloatArray, item: int) -> Frame:
    """Return (p', bound, e', bound) of segment ``item`` in the pose frame of a body: start and vector in
    double-doubles, each with the error bound of its coordinates. body: row (4,) of a `Table`; without a pose both
    bounds are 0.0."""
    is_flat = segments.shape[2] == 2
    p, q = point_of(segments, item, 0, is_flat), point_of(segments, item, 1, is_flat)
    way = difference(p, q)
    if body[3] == 0:
        return ((p[0], 0.0), (p[1], 0.0), (p[2], 0.0)), 0.0, way, 0.0
    m = array_at(body[3], (3, 7), np.float64)
    own, blur = _turned(m, (two_diff(p[0], m[0, 6]), two_diff(p[1], m[1, 6]), two_diff(p[2], m[2, 6])))
    along, along_blur = _turned(m, way)
    return own, blur, along, along_blur


@inline
def _plane_at(row: FloatArray, v: Vector, offset: float, blur: float) -> tuple[float, float, float]:
    """Return dot(n, v) + offset as a double-double, and its error bound. row: (4,), its first three numbers are n;
    blur: error of each coordinate of v."""
    ah, al = dd_scale(v[0][0], v[0][1], row[0])
    bh, bl = dd_scale(v[1][0], v[1][1], row[1])
    ch, cl = dd_scale(v[2][0], v[2][1], row[2])
    size = abs(ah) + abs(bh) + abs(ch) + abs(offset)
    ah, al = dd_add(ah, al, bh, bl)
    ah, al = dd_add(ah, al, ch, cl)
    ah, al = dd_add(ah, al, offset, 0.0)
    return ah, al, 16.0 * U2 * size + 1.01 * blur * (abs(row[0]) + abs(row[1]) + abs(row[2]))


@inline
def _value(row: FloatArray, v: Vector, offset: float, blur: float) -> tuple[float, float]:
    """Return dot(n, v) + offset in doubles, and its error bound. row: (4,), its first three numbers are n; blur: error
    of each coordinate of v. Three sums, a product and the low part of v: ``|error| <= 5 u (|x| + |y| + |z| +
    |offset|)``, x, y, z the products.
    """
    x, y, z = row[0] * v[0][0], row[1] * v[1][0], row[2] * v[2][0]
    size = abs(x) + abs(y) + abs(z) + abs(offset)
    return x + y + z + offset, 2.0**-50 * size + 1.01 * blur * (abs(row[0]) + abs(row[1]) + abs(row[2]))


@inline
def _planes_cut(rows: FloatArray, frame: Frame) -> tuple[int, int, int]:
    """Return (meets, first, last), by doubles: 1 if a segment provably meets the intersection of the half-spaces rows
    (n, 4), -1 if not, or UNDECIDED; and the rows of the last plane entered and the first one left, -1 for none. A
    parameter t = -s / d has the error r = 1.01 (s' + t d') / |d| + 2^-51 t for bounds s' and d' < |d| / 1000."""
    own, blur, along, along_blur = frame
    enters, leaves, first, last, is_proven = (-1.0, -1.0), (2.0, 2.0), -1, -1, True
    for face in range(rows.shape[0]):
        s, s_bound = _value(rows[face], own, rows[face, 3], blur)
        d, d_bound = _value(rows[face], along, 0.0, along_blur)
        of_p = sign_of(s, s_bound)
        of_q = sign_of(s + d, 1.01 * (s_bound + d_bound) + 2.0**-51 * (abs(s) + abs(d)))
        if of_p == -1 and of_q == -1:
            return -1, -1, -1
        if of_p == 1 and of_q == 1:
            continue
        if of_p == UNDECIDED or of_q == UNDECIDED or d_bound > 2.0**-10 * abs(d):
            is_proven = False
            continue
        t = -s / d
        r = 1.01 * (s_bound + t * d_bound) / abs(d) + 2.0**-51 * t
        if of_p < 0:
            is_proven &= t - r > enters[1] or t + r < enters[0]
            if t > enters[1]:
                first = face
            enters = (max(enters[0], t - r), max(enters[1], t + r))
        else:
            is_proven &= t + r < leaves[0] or t - r > leaves[1]
            if t < leaves[0]:
                last = face
            leaves = (min(leaves[0], t - r), min(leaves[1], t + r))
    if enters[0] > leaves[1]:
        return -1, -1, -1
    return (1 if is_proven and enters[1] < leaves[0] else UNDECIDED), first, last


@inline
def between_planes(body: IntArray, segments: FloatArray, item: int, is_any: bool) -> tuple[int, End, End]:
    """Return 1 if a segment meets a body bounded by planes, -1 if not, or UNDECIDED; and both ends (t, t_low, slack,
    face) of the piece, not computed if is_any. body: row (4,) of a `Table`."""
    frame, rows = in_frame(body, segments, item), array_at(body[2], (body[1], 4), np.float64)
    own, blur, along, along_blur = frame
    meets, entered, left = _planes_cut(rows, frame)
    first, last = OWN_START, OWN_END
    for face in (entered, left):
        if meets == 1 and face >= 0 and not is_any:
            s, s_low, s_bound = _plane_at(rows[face], own, rows[face, 3], blur)
            d, d_low, d_bound = _plane_at(rows[face], along, 0.0, along_blur)
            t, t_low = dd_div(-s, -s_low, d, d_low)
            if face == entered:
                first = (t, t_low, slack_of(s, s_bound, d, d_bound), face)
            else:
                last = (t, t_low, slack_of(s, s_bound, d, d_bound), face)
    return meets, first, last


@inline
def in_ball(body: IntArray, segments: FloatArray, item: int, is_any: bool) -> tuple[int, End, End]:
    """Return whether segment segments[item], of (n, 2, d), meets a posed ball: 1, -1 (not) or UNDECIDED; and both ends
    of its piece, each (t, t_low, slack, face). With is_any, or unless the first is 1, the ends are the segment's own.
    body: row (4,) of a `Table`, whose third number is the address of the ball's posed centre, as double-doubles, and
    radius. The rounding of that centre is within the bounds used."""
    c, is_flat = array_at(body[2], (7,), np.float64), segments.shape[2] == 2
    p, q = point_of(segments, item, 0, is_flat), point_of(segments, item, 1, is_flat)
    along = difference(p, q)
    own = (dd_sub(p[0], 0.0, c[0], c[1]), dd_sub(p[1], 0.0, c[2], c[3]), dd_sub(p[2], 0.0, c[4], c[5]))
    blur = 8.0 * U2 * max(abs(p[0]), abs(p[1]), abs(p[2]), abs(c[0]), abs(c[2]), abs(c[4]))
    meets, of_p, of_q = meets_ball(along, own, blur, c[6])
    if meets != 1 or is_any:
        return meets, OWN_START, OWN_END
    if of_p == UNDECIDED or of_q == UNDECIDED:
        return UNDECIDED, OWN_START, OWN_END
    return between_roots(along, own, blur, c[6], of_p, of_q)


UNSURE: Final = -1
WANTS_BODY: Final = -2
WANTS_TREE: Final = -3
"""Codes in place of a number of pieces: UNSURE, undecided; WANTS_BODY, WANTS_TREE: the body, or its location tree, must
be prepared first."""


PlacedMesh = namedtuple("PlacedMesh", "elements faces boxes child origin inverse are_safe n_inner corners")
"""A mesh in its own frame, as kernels here read it: fields of `Mesh` in on_boundary/prepared_boundary.py."""
MESH_WORDS: Final = 41
"""Numbers of a solid: addresses (5,) of its arrays, numbers (3,) of elements, nodes and inner nodes; `tree_row`'s
addresses, 0 without a tree, and sizes (8,); then as doubles origin, inverse, whether all is in range, low and high of
its box (13,), and `tree_row`'s places (12,)."""
TREE, PLACES, TREE_PLACES = 8, 16, 29
"""Offsets of the tree's addresses, of the doubles, and of the tree's places among these numbers."""
_Lines = namedtuple("_Lines", "addresses sizes places")


@inline
def mesh_at(address: int) -> PlacedMesh:
    """Return the mesh encoded in MESH_WORDS numbers (`_words_of`) at an address."""
    lines, numbers = array_at(address, (MESH_WORDS,), np.int64), array_at(address, (MESH_WORDS,), np.float64)
    return PlacedMesh(
        array_at(lines[0], (lines[5], 3, 3), np.float64),
        array_at(lines[1], (lines[5],), np.int64),
        array_at(lines[2], (lines[6], BOX_ROWS, WIDTH), np.float32),
        array_at(lines[3], (lines[6], WIDTH), np.int32),
        (numbers[PLACES], numbers[PLACES + 1], numbers[PLACES + 2]),
        (numbers[PLACES + 3], numbers[PLACES + 4], numbers[PLACES + 5]),
        numbers[PLACES + 6] != 0.0,
        lines[7],
        array_at(lines[4], (lines[6] - lines[7], CORNER_ROWS, LANES), np.float32),
    )


@inline
def _tree_of(address: int) -> Any:
    """Return the location tree of a mesh whose MESH_WORDS numbers are at an address."""
    lines = _Lines(
        array_at(address + 8 * TREE, (1, 5), np.int64),
        array_at(address + 8 * (TREE + 5), (1, 3), np.int64),
        array_at(address + 8 * TREE_PLACES, (1, 12), np.float64),
    )
    return tree_at(lines, 0)


@inline
def _collect_crossings(mesh: PlacedMesh, p: Point3, q: Point3, blur: float, is_any: bool, scratch: Scratch) -> int:
    """Fill cuts.met and cuts.codes of scratch with the triangles that segment p q meets, and the code of each contact;
    return their number, or UNSURE if one is not proven. With `is_any`, the first triangle proven to be met ends the
    search with 1. blur: error of each coordinate of p and q."""
    cuts = scratch.cuts
    waiting = Waiting(scratch.inner, cuts.order, cuts.faces)
    n_met = append_contacts(mesh, p, q, blur, is_any, False, waiting, cuts.met, cuts.codes, 0)
    for i in range(n_met):
        kind = cuts.codes[i]
        if kind == Kind.DEGENERATE or (not is_any and kind & Bit.ALONG != 0):
            return UNSURE
        if not is_any and kind != Kind.PROPER and decode_place(kind) >= Place.START:
            return UNSURE
        cuts.codes[i] = CROSSED if kind == Kind.PROPER else kind
    return max(n_met, UNSURE)


@inline
def _are_one_point(mesh: PlacedMesh, cuts: Any, first: int, second: int) -> bool:
    """Return whether two crossings that round alike are proven to be one point: by their codes, or of triangles in one
    plane, which the segment crosses if it passes the inside of one."""
    code, its = cuts.codes[first], cuts.codes[second]
    if are_same_point(mesh.elements, cuts.met[first], code, cuts.met[second], its):
        return True
    return (code == CROSSED or its == CROSSED) and are_flush(mesh.elements, cuts.met[first], cuts.met[second])


@inline
def _merge_touches(mesh: PlacedMesh, scratch: Scratch, n: int, is_in: bool, is_closed: bool) -> int:
    """Merge those of n sorted crossings that are one point; return the number of crossings left, or UNSURE. Where the
    location does not flip, the segment touches a closed mesh from outside in a point (written twice, the second time
    with face -2 - face), or stays inside (left out). At least two crossings make such a point, so 4 n places suffice.
    """
    cuts, order, n_out, begin = scratch.cuts, scratch.cuts.order, 2 * n, 0
    if 4 * n > MOST_MET:
        return UNSURE
    for place in range(1, n + 1):
        first, turns = order[begin], False
        if place < n and cuts.t[order[place]] == cuts.t[first]:
            other = order[place]
            if not _are_one_point(mesh, cuts, first, other):
                return UNSURE
            continue
        for rank in range(begin, place):
            turns ^= (cuts.codes[order[rank]] & Bit.CROSSES) != 0
            cuts.faces[first] = min(cuts.faces[first], cuts.faces[order[rank]])
        begin = place
        if turns or not is_closed or not is_in:
            order[n_out] = first
            n_out += 1
        if is_closed and not turns and not is_in:
            again = n + n_out
            order[n_out], cuts.t[again], cuts.faces[again] = again, cuts.t[first], -2 - cuts.faces[first]
            for k in range(3):
                cuts.points[again, k] = cuts.points[first, k]
            n_out += 1
        is_in ^= turns
    for place in range(2 * n, n_out):
        order[place - 2 * n] = order[place]
    return n_out - 2 * n


@inline
def _values(at_p: tuple[float, ...], blur: float, normal: Any) -> Any:
    """Return (h, low, bound): the dot product of a normal and a vector, whose coordinates are off by blur, with a bound
    on its error. at_p: the same for the rounded vector, its bound covering 4 u^2; normal: of `normal_of`."""
    h, low, bound = at_p
    return h, low, 1.5 * bound + 1.01 * blur * (normal[0][2] + normal[1][2] + normal[2][2])


@inline
def _cut_at(mesh: PlacedMesh, segments: FloatArray, item: int, place: int, frame: Any, scratch: Scratch) -> bool:
    """Compute t and point of crossing ``place`` (as an earlier one in the same corner or edge); return whether all are
    proven nearest doubles."""
    (own, blur, along, along_blur), cuts, element = frame, scratch.cuts, scratch.cuts.met[place]
    if not (mesh.are_safe or is_item_safe(mesh.elements, element)):
        return False
    cuts.faces[place], code = mesh.faces[element], cuts.codes[place]
    for other in range(place if code != CROSSED else 0):
        if are_same_point(mesh.elements, cuts.met[other], cuts.codes[other], element, code):
            cuts.t[place] = cuts.t[other]
            for k in range(3):
                cuts.points[place, k] = cuts.points[other, k]
            return True
    a, b, c = triangle_at(mesh.elements, element)
    normal = normal_of(a, b, c)
    from_a = (
        dd_sub(own[0][0], own[0][1], a.x, 0.0),
        dd_sub(own[1][0], own[1][1], a.y, 0.0),
        dd_sub(own[2][0], own[2][1], a.z, 0.0),
    )
    s, s_low, s_bound = _values(dot(normal, from_a), blur, normal)
    d, d_low, d_bound = _values(dot(normal, along), along_blur, normal)
    slack = slack_of(s, s_bound, d, d_bound)
    t, low = dd_div(-s, -s_low, d, d_low)
    cuts.t[place], n = t + low, decode_place(code)
    if n > 2:
        is_proven = put_point(cuts.points[place], segments, item, t, low, slack)
    else:
        for k in range(3):
            cuts.points[place, k] = mesh.elements[element, n, k] + 0.0
        bound = (T_BOUND + slack) * abs(t)
        is_proven = slack < 0.001 and t + (low - bound) == t + (low + bound)
    if not is_proven and along_blur == 0.0:  # case: unposed, a coordinate midway between two doubles above all
        cuts.t[place], is_proven = cross_exactly(segments, item, mesh.elements, element, code, cuts.points[place])
    return is_proven


@inline
def _ends_of(own: Vector, blur: float, along: Vector, along_blur: float, is_placed: bool) -> tuple[Point3, Any, float]:
    """Return the ends p' and p' + e' of `in_frame` as doubles, and a bound on the error of their coordinates."""
    p = Point3(own[0][0], own[1][0], own[2][0])
    q = Point3(p.x + along[0][0], p.y + along[1][0], p.z + along[2][0])
    size = max(abs(p.x), abs(p.y), abs(p.z), abs(q.x), abs(q.y), abs(q.z))
    return p, q, (2.0**-51 * size + 2.0 * (blur + along_blur) if is_placed else 0.0)


@inline
def crossings_in(
    body: IntArray, segments: FloatArray, item: int, is_any: bool, words: IntArray, stop: FlagArray
) -> tuple[int, bool]:
    """Compute the crossings of a segment with a placed mesh, in order; return their number, and whether its start is
    inside. The number may be UNSURE, WANTS_BODY or WANTS_TREE. words: of `scratch_for`. With `is_any` any positive
    number means that there is a crossing."""
    is_placed, is_closed, scratch = body[3] != 0, body[1] != 0, scratch_at(words)
    lines, numbers = array_at(body[2], (MESH_WORDS,), np.int64), array_at(body[2], (MESH_WORDS,), np.float64)
    frame = in_frame(body, segments, item)
    p, q, blur = _ends_of(frame[0], frame[1], frame[2], frame[3], is_placed)
    if not is_placed:
        q = corner(segments, item, 1)
    mesh, is_in = mesh_at(body[2]), False
    n_met = _collect_crossings(mesh, p, q, blur, is_any, scratch)
    if n_met < 0 or (is_any and n_met > 0):
        return n_met, False
    if is_closed and _is_near_box(numbers, p, blur):
        if _is_near_box(numbers, q, blur):
            if lines[TREE] == 0:
                return WANTS_TREE, False
            at, _ = locate_in_tree(_tree_of(body[2]), p, 2.0 * blur, scratch.inner.stack, stop)
            if at == UNDECIDED or (at == 0 and not is_any):
                return UNSURE, False
            is_in = at >= 0
        else:
            for i in range(n_met):
                is_in ^= scratch.cuts.codes[i] & Bit.CROSSES != 0
    for i in range(n_met):
        if not _cut_at(mesh, segments, item, i, frame, scratch):
            return UNSURE, False
    touches = not sort_crossings(scratch.cuts, n_met)
    for i in range(n_met):
        touches |= scratch.cuts.codes[i] != CROSSED
    return (_merge_touches(mesh, scratch, n_met, is_in, is_closed) if touches else n_met), is_in


@inline
def _is_near_box(numbers: FloatArray, p: Point3, blur: float) -> bool:
    """Return whether p, known to +- `blur`, may lie in the box of a mesh. numbers: its MESH_WORDS as float64."""
    low, high = PLACES + 7, PLACES + 10
    is_out = (p.x + blur < numbers[low]) | (p.x - blur > numbers[high])
    is_out |= (p.y + blur < numbers[low + 1]) | (p.y - blur > numbers[high + 1])
    return not (is_out | (p.z + blur < numbers[low + 2]) | (p.z - blur > numbers[high + 2]))
