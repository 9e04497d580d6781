"""Segments on placed meshes, compiled: triangles met by their tree, crossings in order; see posed_cut.py.

Doubles of p' and p' + e', off by `blur` at most, find the triangles; without a pose they are the segment's own ends,
and exact signs settle what the filter leaves. A closed mesh turns the location over at each crossing, so that of the
first end, by a vertical ray in the same frame, is all that is wanted beside them.
"""

from __future__ import annotations

import threading
from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.bounding.bvh import STACK, WIDTH
from engine.containment.methods.polyhedron_ray_parity import locate_in_tree
from engine.containment.scene.trees import tree_at
from engine.jit import inline
from engine.lanes.addresses import array_at
from engine.lanes.boxes import BOX_ROWS, EMPTY, near_segment
from engine.lanes.lanes import lowest_bit
from engine.lanes.tracing import LANES
from engine.lanes.triangles import AXES_BEFORE, CORNER_ROWS, longest_axis, near_triangles
from engine.predicates.double_double import dd_div, dd_sub
from engine.scenes.posed_cut import in_frame, put_point, slack_of
from engine.segment_clipping.boundary_cut import Crossings, sort_crossings
from engine.segment_clipping.contacts import APART, PROPER, TOUCHING
from engine.segment_clipping.crossing_values import Vector, dot, is_item_safe, normal_of
from engine.segment_clipping.mesh_contacts import local_segment
from engine.segment_clipping.triangle_contact import contact_filter, corner, exact_contact
from engine.types import UNDECIDED, Point3

MOST_MET: Final = 512
"""Triangles that a segment crosses; with more it is UNDECIDED."""
UNSURE: Final = -1
WANTS_BODY: Final = -2
WANTS_TREE: Final = -3
"""In place of a number of pieces: UNDECIDED, or the body, or the tree that points are located by, is not prepared."""


_here: Final = threading.local()
_MOST_KEPT: Final = 1 << 14
"""Bodies of a scene whose room is kept: some 800 kB a thread."""


Lines = namedtuple("Lines", "addresses sizes places")
"""Prepared arrays of solids, by row: their addresses (n, k), 0 where they are not prepared, sizes and numbers."""
PlacedMesh = namedtuple("PlacedMesh", "elements faces boxes child origin inverse are_safe n_inner corners")
"""What of `Mesh` is read here."""
Scratch = namedtuple("Scratch", "stack met cuts near")
"""Room for the work on one segment; cuts, near: `Crossings`, of the bodies near it by where it enters their boxes."""


def scratch_for(n_bodies: int) -> Scratch:
    """Return room for the work on one segment at a time; each thread keeps its own."""
    found: Scratch | None = getattr(_here, "scratch", None)
    if found is None or len(found.near.t) <= n_bodies:
        cuts, near = (
            Crossings(np.empty(n), np.empty((n, 3)), np.empty(n, np.int64), np.empty(n, np.int64))
            for n in (MOST_MET, n_bodies + 1)
        )
        found = Scratch(np.empty(STACK, np.int32), np.empty(MOST_MET, np.int64), cuts, near)
        if n_bodies <= _MOST_KEPT:
            _here.scratch = found
    return found


@inline
def _mesh_at(lines: Any, row: int) -> PlacedMesh:
    addresses, sizes, places = lines.addresses, lines.sizes, lines.places
    return PlacedMesh(
        array_at(addresses[row, 0], (sizes[row, 0], 3, 3), np.float64),
        array_at(addresses[row, 1], (sizes[row, 0],), np.int64),
        array_at(addresses[row, 2], (sizes[row, 1], BOX_ROWS, WIDTH), np.float32),
        array_at(addresses[row, 3], (sizes[row, 1], WIDTH), np.int32),
        (places[row, 0], places[row, 1], places[row, 2]),
        places[row, 3],
        places[row, 4] != 0.0,
        sizes[row, 2],
        array_at(addresses[row, 4], (sizes[row, 1] - sizes[row, 2], CORNER_ROWS, LANES), np.float32),
    )


@inline
def _contact(mesh: PlacedMesh, element: int, p: Point3, q: Point3, blur: float) -> int:
    """Return what `exact_contact` does, or UNDECIDED, for a triangle and a segment known to `blur` a coordinate."""
    a, b, c = corner(mesh.elements, element, 0), corner(mesh.elements, element, 1), corner(mesh.elements, element, 2)
    kind = contact_filter(a, b, c, p, q, blur)
    return exact_contact(a, b, c, p, q) if kind == UNDECIDED and blur == 0.0 else kind


@inline
def _gather(mesh: PlacedMesh, p: Point3, q: Point3, blur: float, is_any: bool, scratch: Scratch) -> int:
    """Fill met with the triangles that a segment crosses; return how many, UNSURE where one may be met otherwise. Where
    `is_any` one that is surely met is enough."""
    stack, met = scratch.stack, scratch.met
    middle, half, slack, tiny, is_near = local_segment(p, q, mesh.origin, mesh.inverse)
    if not is_near:
        return 0
    room = 64.0 * blur * mesh.inverse
    slack_32, tiny_32 = np.float32(slack + room), np.float32(tiny + room)
    k = longest_axis(half)
    i, j, double = (
        AXES_BEFORE[k],
        AXES_BEFORE[k + 1],
        np.float32(2.0 * (slack + room)),
    )  # see `_load` of mesh_streams.py
    place, r, s, reach = (middle[i], middle[j], middle[k]), half[i] / half[k], half[j] / half[k], abs(half[k]) + double
    n_met, depth, is_unsure = 0, 1, False
    stack[0] = 0
    while depth > 0:  # bound: each node enters the stack once
        depth -= 1
        node = stack[depth]
        if node >= mesh.n_inner:
            bits = near_triangles(mesh.corners, node - mesh.n_inner, i, j, k, place, r, s, reach, double)
        else:
            bits = near_segment(mesh.boxes, node, middle, half, slack_32, tiny_32)
        while bits != 0:
            below = mesh.child[node, lowest_bit(bits)]
            bits &= bits - 1
            if below == EMPTY:
                continue
            if below >= 0:
                stack[depth] = below
                depth += 1
                continue
            kind = _contact(mesh, -1 - below, p, q, blur)
            if kind == APART:
                continue
            if is_any and kind in (PROPER, TOUCHING):
                return 1
            if kind != PROPER or n_met == met.size:
                if not is_any:
                    return UNSURE
                is_unsure = True
                continue
            met[n_met] = -1 - below
            n_met += 1
    return UNSURE if is_unsure else n_met


@inline
def _values(at_p: Any, blur: float, normal: Any) -> Any:
    """Return what `dot` does of a vector that is known to `blur` a coordinate, and lost 4 u^2 of it in its rounding."""
    h, low, bound = at_p
    return h, low, 1.5 * bound + 1.01 * blur * (normal[0][2] + normal[1][2] + normal[2][2])


@inline
def _cut_at(mesh: PlacedMesh, segments: Any, item: int, element: int, frame: Any, cuts: Crossings, place: int) -> bool:
    """Make a crossing; tell whether all is surely nearest."""
    own, blur, along, along_blur = frame
    if not (mesh.are_safe or is_item_safe(mesh.elements, element)):
        return False
    a, b, c = corner(mesh.elements, element, 0), corner(mesh.elements, element, 1), corner(mesh.elements, element, 2)
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
    cuts.t[place], cuts.faces[place] = t + low, mesh.faces[element]
    return put_point(cuts.points[place], segments, item, t, low, slack)


@inline
def _ends_of(own: Vector, blur: float, along: Vector, along_blur: float, is_placed: bool) -> tuple[Point3, Any, float]:
    """Return doubles of both ends of a segment in a frame, and how far a coordinate may be off."""
    p = Point3(own[0][0], own[1][0], own[2][0])
    q = Point3(p.x + along[0][0], p.y + along[1][0], p.z + along[2][0])
    size = max(abs(p.x), abs(p.y), abs(p.z), abs(q.x), abs(q.y), abs(q.z))
    return p, q, (2.0**-51 * size + 2.0 * (blur + along_blur) if is_placed else 0.0)


@inline
def crossings_in(
    table: Any, body: int, segments: Any, item: int, is_any: bool, scratch: Scratch, stop: Any
) -> tuple[int, bool]:
    """Make the crossings of a segment with a placed mesh, in order; return how many, or why not, and whether the first
    end lies in it. Where `is_any` they are not made, and any positive number says that there is one."""
    slot, is_placed, is_closed = table.begins[body], table.frames[body] >= 0, table.ends[body] != 0
    frame = in_frame(table, body, segments, item)
    p, q, blur = _ends_of(frame[0], frame[1], frame[2], frame[3], is_placed)
    if not is_placed:
        q = corner(segments, item, 1)
    mesh, is_in = _mesh_at(table.meshes, slot), False
    n_met = _gather(mesh, p, q, blur, is_any, scratch)
    if n_met < 0 or (is_any and n_met > 0):
        return n_met, False
    if is_closed and _is_near_box(table.meshes.places, slot, p, blur):
        if table.trees.addresses[slot, 0] == 0:
            return WANTS_TREE, False
        at, _ = locate_in_tree(tree_at(table.trees, slot), p, 2.0 * blur, scratch.stack, stop)
        if at == UNDECIDED or (at == 0 and not is_any):
            return UNSURE, False
        is_in = at >= 0
    for i in range(n_met):
        if not _cut_at(mesh, segments, item, scratch.met[i], frame, scratch.cuts, i):
            return UNSURE, False
    if n_met > 0 and not sort_crossings(scratch.cuts, 0, n_met):
        return UNSURE, False
    return n_met, is_in


@inline
def _is_near_box(places: Any, slot: int, p: Point3, blur: float) -> bool:
    """Tell whether a point known to `blur` a coordinate may lie in the box of a mesh."""
    is_out = (p.x + blur < places[slot, 5]) | (p.x - blur > places[slot, 8])
    is_out |= (p.y + blur < places[slot, 6]) | (p.y - blur > places[slot, 9])
    return not (is_out | (p.z + blur < places[slot, 7]) | (p.z - blur > places[slot, 10]))
