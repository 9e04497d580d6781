"""Segments against placed meshes: crossed triangles by tree traversal, crossings in order; compiled. See posed_cut.py.

Doubles of p' and p' + e', off by `blur` at most, select the triangles; without a pose they are the segment's own ends,
and exact signs settle what the filter leaves open. A closed mesh flips the location at each crossing, so only the
location of the first end, by a vertical ray in the same frame, is needed besides.
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
from engine.predicates.error_free import dd_div, dd_sub
from engine.scenes.near_boxes import MOST_MET, Scratch, scratch_at
from engine.scenes.posed_cut import in_frame
from engine.segment_clipping.on_boundary.boundary_cut import sort_crossings
from engine.segment_clipping.on_boundary.contacts import CROSSED, Bit, Kind, Place, are_same_point, decode_place
from engine.segment_clipping.on_boundary.crossing_values import Vector, cross_exactly, dot, is_item_safe, normal_of
from engine.segment_clipping.on_boundary.mesh_contacts import Waiting, append_contacts
from engine.segment_clipping.on_boundary.triangle_contacts import are_flush, corner, triangle_at
from engine.segment_clipping.pieces import put_point, slack_of
from engine.types import UNDECIDED, FlagArray, FloatArray, IntArray, Point3

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
    waiting = Waiting(scratch.stack, scratch.entered, cuts.order, cuts.faces)
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
    """Merge those of n sorted crossings that are one point; return the number of crossings left, or UNSURE. is_in: the
    segment starts inside. Where the location does not flip, the segment touches a closed mesh from outside in a point
    (written twice, the second time with face -2 - face), or stays inside (left out). At least two crossings make such a
    point, so 4 n places suffice."""
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
    """Compute t and point of crossing ``place``, equal to an earlier one in the same corner or edge; return whether all
    are proven nearest doubles. frame: of `in_frame`."""
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
    """Return the ends p' and p' + e' of a segment in the pose frame, as doubles, and a bound on the error of their
    coordinates, 0.0 unless is_placed. own, along: p', e' of `in_frame`; blur, along_blur: their error bounds."""
    p = Point3(own[0][0], own[1][0], own[2][0])
    q = Point3(p.x + along[0][0], p.y + along[1][0], p.z + along[2][0])
    size = max(abs(p.x), abs(p.y), abs(p.z), abs(q.x), abs(q.y), abs(q.z))
    return p, q, (2.0**-51 * size + 2.0 * (blur + along_blur) if is_placed else 0.0)


@inline
def crossings_in(
    body: IntArray, segments: FloatArray, item: int, is_any: bool, words: IntArray, stop: FlagArray
) -> tuple[int, bool]:
    """Compute the crossings of a segment with a placed mesh, in order; return their number, and whether its start is
    inside. body: row (4,) of a `Table`; words: work space of `scratch_for`. The number may be UNSURE, or WANTS_BODY or
    WANTS_TREE for what must be prepared. With `is_any` any positive number means that there is a crossing."""
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
            at, _ = locate_in_tree(_tree_of(body[2]), p, 2.0 * blur, scratch.stack, stop)
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
    """Return whether point p, each coordinate known to +- `blur`, may lie in the box of a mesh. numbers: its MESH_WORDS
    as float64."""
    low, high = PLACES + 7, PLACES + 10
    is_out = (p.x + blur < numbers[low]) | (p.x - blur > numbers[high])
    is_out |= (p.y + blur < numbers[low + 1]) | (p.y - blur > numbers[high + 1])
    return not (is_out | (p.z + blur < numbers[low + 2]) | (p.z - blur > numbers[high + 2]))
