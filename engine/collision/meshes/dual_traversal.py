"""Dual traversal: all pairs of faces of two placed bodies that have a common point, or the first pair that decides.

The two trees are descended together: a pair of nodes is replaced by the pairs of children whose boxes
(`lanes/boxes.py`) and discs may intersect; two blocks of faces by the pairs of faces that neither
boxes nor planes separate (`lanes/faces.py`), which are classified by signs. All tests are conservative under a pose, so
no contact is missed. Pairs beyond the room are counted; the caller enlarges the room and searches again. Of the faces
with a common corner only (`contact_kinds.py`) just enough pairs are listed to know every face in contact.

Source: S. Gottschalk, M. Lin, D. Manocha, OBBTree: a hierarchical structure for rapid interference detection, 1996.
"""

from __future__ import annotations

from collections import namedtuple
from typing import NamedTuple

from engine.bounding.bvh import MAX_DEPTH, STACK
from engine.collision.codes import OVERLAPPING, TOUCHING, UNSETTLED
from engine.collision.meshes.contact_kinds import N_NAMED, common_corner, insert_sorted
from engine.collision.meshes.mesh_arrays import STATE_CLEAN, MeshArrays, triangle_of
from engine.collision.meshes.parity import SIDE_UNKNOWN, inner_side, proves_overlap, state_of
from engine.collision.meshes.placement import Placement, PoseArrays, axis_at, defect_of, place_pair, placed, set_frame
from engine.collision.meshes.separating_planes import Vertices, blocks_part, nodes_are_separated
from engine.collision.meshes.triangle_triangle import (
    APART,
    COMMON_AREA,
    CORNER,
    CROSSING,
    Facet,
    classify,
    classify_near,
    off_plane_point,
    sign_of_four,
    with_pose,
)
from engine.compiling.jit import called, inline, merged
from engine.lanes.boxes import discs_meeting, meeting
from engine.lanes.faces import faces_meeting
from engine.lanes.lanes import lowest_bit
from engine.lanes.tracing import LANES
from engine.predicates.posed import UNPOSED, posed_error
from engine.types import UNDECIDED, FlagArray, FloatArray

SEEK_OVERLAP = 0
SEEK_PIERCING_BY_FIRST = 1
SEEK_PIERCING_BY_SECOND = 2
SEEK_CONTACT = 3
SEEK_CROSSING = 4
PIERCING = SEEK_PIERCING_BY_FIRST, SEEK_PIERCING_BY_SECOND
"""Goals that end a search early: a contact that proves overlapping interiors; a crossing that proves that the first
(second) body, a surface, passes through the interior of the other; any contact; a crossing that proves overlapping
interiors, and so parts of either body outside the other."""

DONE, SETTLED, FULL, INTERRUPTED, PAUSED = range(5)
"""| outcome | meaning |
|---|---|
| DONE | all pairs seen |
| SETTLED | the pair in row 0 decides the query |
| FULL | more pairs than room |
| INTERRUPTED | the flag was set |
| PAUSED | as many pairs as the caller wanted to look at first |
"""
ROOM = 4096
"""Number of pairs of faces in contact for which work space has room; more are rare."""
_N_FIRST, _N_BLOCKS, _N_MORE = 64, 1024, 64
"""After so many pairs of blocks whose faces were classified, and no contact, planes of the last ones are tried on the
bodies; after so many, planes of faces (`separating_planes.py`); after a try that separates nothing, again after so many
more."""

_N_NODES, _N_SAMPLED = 2048, 16
"""After so many pairs of nodes, and no contact, so many blocks are compared with all of the other body."""
STACK_ROWS = LANES * LANES * 2 * MAX_DEPTH + STACK
"""Bound on the pairs of nodes on the stack: a pair is replaced by at most 64, one of its nodes a level deeper."""


Descent = namedtuple("Descent", "stack frames work poses signs")
"""Work space of a search.

| field | shape | meaning |
|---|---|---|
| stack | (STACK_ROWS, 2) int32 | pairs of nodes waiting |
| frames | (2, 22, 8) float32 | see `lanes/boxes.py` |
| work | (28, 8) float32 | of `lanes/boxes.py` and `lanes/faces.py`, for one pair of nodes |
| poses | (2, 12) float64 | rotation and translation of either body, for exact signs |
| signs | (10,) int8 | of `contact_kinds.py` |
"""

Contacts = namedtuple("Contacts", "pairs kinds met")
"""Room for pairs of faces in contact: ``pairs`` (room, 2), and ``kinds`` (room,), their classes; room >= 1. met: empty,
or for all faces of the first, then of the second body, whether a listed pair contains it. If it is not empty,
`contact_kinds.py` selects the pairs to list, and there are N_NAMED rows more."""


class Place(NamedTuple):
    """Placements of two bodies. a, b: as `place_pair` rounds them; error: bound on the rounding of a coordinate placed
    so; posed_error: the same for points under their own poses, as exact signs read them."""

    a: Placement
    b: Placement
    error: float
    posed_error: float


class Search(NamedTuple):
    """One query about two bodies: their meshes and placements, work space, the goal ``seek`` that ends the search early
    (SEEK_...), room for contacts, cancel flag."""

    first: MeshArrays
    second: MeshArrays
    place: Place
    descent: Descent
    seek: int
    contacts: Contacts
    flag: FlagArray


@inline
def capacity_of(contacts: Contacts) -> int:
    """Return how many pairs of faces fit, without the N_NAMED rows added for selected pairs."""
    return len(contacts.kinds) - (N_NAMED if len(contacts.met) > 0 else 0)


@inline
def store_pose(poses: FloatArray, row: int, pose: PoseArrays, item: int) -> None:
    """Write a pose to ``poses[row]`` for exact signs: nine numbers of the rotation by rows, then the translation."""
    for i in range(3):
        for k in range(3):
            poses[row, 3 * i + k] = pose.rotations[item, i, k]
        poses[row, 9 + i] = pose.translations[item, i]


@inline
def place_bodies(
    first: MeshArrays, first_pose: PoseArrays, first_item: int, second: MeshArrays, second_pose: PoseArrays,
    second_item: int, descent: Descent,
) -> tuple[Place, bool]:  # fmt: skip
    """Place two bodies under the poses with the given numbers; fill the frames and poses of `descent`. Returns the
    placements, and whether the boxes around both bodies are proven disjoint."""
    a, b = place_pair(first.extent, first_pose, first_item, second.extent, second_pose, second_item)
    defect = defect_of(a) + defect_of(b)
    is_apart = set_frame(descent.frames[0], a, first, b, second, defect)
    if not is_apart:
        is_apart = set_frame(descent.frames[1], b, second, a, first, defect)
    exact_error = 0.0
    if first_pose.is_posed:
        store_pose(descent.poses, 0, first_pose, first_item)
        exact_error = posed_error(descent.poses, 0, first.extent.reach)
    if second_pose.is_posed:
        store_pose(descent.poses, 1, second_pose, second_item)
        exact_error = max(exact_error, posed_error(descent.poses, 1, second.extent.reach))
    return Place(a, b, max(a.error, b.error), exact_error), is_apart


@inline
def placed_triangle(t: Facet, place: Placement) -> Facet:
    """Return a triangle under its placement, rounded."""
    return Facet(placed(t.p, place), placed(t.q, place), placed(t.r, place))


@inline
def unposed_faces(s: Search, i: int, j: int) -> tuple[Facet, Facet]:
    """Return face i of the first and face j of the second body before their poses, the corners tagged with the row of
    ``descent.poses`` that moves them (0, 1; UNPOSED for none)."""
    own = with_pose(triangle_of(s.first, i), 0 if s.place.a.is_posed else UNPOSED)
    return own, with_pose(triangle_of(s.second, j), 1 if s.place.b.is_posed else UNPOSED)


@inline
def exact_faces(s: Search, i: int, j: int) -> tuple[Facet, Facet, int, int]:
    """Return (t, u, axis, their_axis): faces i and j as input of exact signs, and for each an axis along which its
    projection has an area, negative for none. If placing rounds nothing (error 0) the points are placed; else they
    stand before their poses, tagged with pose numbers, and so do the axes."""
    axis, their_axis = int(s.first.axis[i]), int(s.second.axis[j])
    if s.place.error == 0.0:
        t, u = placed_triangle(triangle_of(s.first, i), s.place.a), placed_triangle(triangle_of(s.second, j), s.place.b)
        return with_pose(t), with_pose(u), axis_at(axis, s.place.a), axis_at(their_axis, s.place.b)
    t, u = unposed_faces(s, i, j)
    return t, u, axis, their_axis


@inline
def exact_error(s: Search) -> float:
    """Return the bound on the rounding of posed coordinates with which exact signs filter the faces that `exact_faces`
    gives: 0.0 if those are placed without rounding."""
    return 0.0 if s.place.error == 0.0 else s.place.posed_error


@merged
def class_of_corner(s: Search, i: int, j: int, t: Facet, u: Facet) -> int:
    """Return CORNER + 3 k + m if corner k of face i and corner m of face j are proven to be their only common point,
    else UNDECIDED. t, u: the faces as placed."""
    if s.first.axis[i] < 0 or s.second.axis[j] < 0:
        return UNDECIDED
    own, their = unposed_faces(s, i, j)
    common = common_corner(s.descent.poses, t, u, own, their, s.place.error)
    return CORNER + common if common >= 0 else UNDECIDED


@merged
def settle_class(s: Search, i: int, j: int) -> int:
    """Return the class of faces i and j by exact signs: APART, CROSSING, CONTACT, COPLANAR or COMMON_AREA; UNDECIDED if
    a face has no area, or exponents are out of range."""
    if s.first.axis[i] < 0 or s.second.axis[j] < 0:
        return UNDECIDED
    own, their, axis, _ = exact_faces(s, i, j)
    return classify(s.descent.poses, own, their, axis, exact_error(s))


@called
def relation_of_flush(s: Search, i: int, j: int) -> int:
    """Return the relation that faces i and j with a common area prove: OVERLAPPING if both bodies lie on one side of
    them, else TOUCHING; UNSETTLED if a face is not clean, or a sign is undecided."""
    t, u, axis, _ = exact_faces(s, i, j)
    poses, error, off = s.descent.poses, exact_error(s), off_plane_point(t, axis)
    by_t, by_u = sign_of_four(poses, t.p, t.q, t.r, off, error), sign_of_four(poses, u.p, u.q, u.r, off, error)
    inner, theirs = inner_side(s.first, i, poses), inner_side(s.second, j, poses)
    if by_t == UNDECIDED or by_u == UNDECIDED or inner == SIDE_UNKNOWN or theirs == SIDE_UNKNOWN:
        return UNSETTLED
    return OVERLAPPING if inner * by_t == theirs * by_u else TOUCHING


@merged
def is_decisive(s: Search, kind: int, i: int, j: int) -> bool:
    """Return whether a contact of class ``kind`` between faces i and j reaches the goal ``s.seek``: any contact, or a
    strict crossing that proves overlapping interiors, or one of a clean face of the body to be pierced, or a common
    area with both bodies on one side."""
    if s.seek == SEEK_CONTACT:
        return True
    if kind == COMMON_AREA and s.seek == SEEK_OVERLAP:
        return relation_of_flush(s, i, j) == OVERLAPPING
    if kind != CROSSING:
        return False
    if s.seek == SEEK_OVERLAP or s.seek == SEEK_CROSSING:
        return proves_overlap(s.first, i, s.second, j, s.descent.poses)
    if s.seek == SEEK_PIERCING_BY_FIRST:
        return state_of(s.second, j, s.descent.poses) == STATE_CLEAN
    return state_of(s.first, i, s.descent.poses) == STATE_CLEAN


@merged
def pop_lowest_bit(low: int, high: int) -> tuple[int, int, int]:
    """Clear the lowest set bit of a 64-bit mask, given as two 32-bit halves (not both 0); return its index and both
    halves."""
    if low != 0:
        return lowest_bit(low), low & (low - 1), high
    return 32 + lowest_bit(high), low, high & (high - 1)


class Progress(NamedTuple):
    """Where a search is: the height of its stack, and of the leaf blocks i and j the mask of pairs of faces still to be
    classified, in two 32-bit halves, bit 8 k + m for lane k of i and lane m of j."""

    n_stack: int
    i: int
    j: int
    low: int
    high: int


START = Progress(-1, 0, 0, 0, 0)


@merged
def classify_faces(s: Search, at: Progress, n_pairs: int, pause: int) -> tuple[int, int, Progress]:
    """Classify pairs of faces, those that `at` names, and append those in contact to ``s.contacts``. n_pairs: number
    listed so far; pause: number at which to pause. Returns the outcome, the new number of pairs, and what is left."""
    pairs, kinds, met = s.contacts
    n_stack, i, j, low, high = at
    room = capacity_of(s.contacts)
    while low != 0 or high != 0:  # bound: each turn takes a bit
        bit, low, high = pop_lowest_bit(low, high)
        i_face, j_face = -1 - int(s.first.child[i, bit >> 3]), -1 - int(s.second.child[j, bit & 7])
        t = placed_triangle(triangle_of(s.first, i_face), s.place.a)
        u = placed_triangle(triangle_of(s.second, j_face), s.place.b)
        kind = class_of_corner(s, i_face, j_face, t, u) if len(met) > 0 else UNDECIDED
        if kind == UNDECIDED:
            kind = classify_near(t, u, s.place.error)
        if kind == UNDECIDED and len(met) == 0:
            kind = class_of_corner(s, i_face, j_face, t, u)
        if kind == UNDECIDED:
            kind = settle_class(s, i_face, j_face)
        if kind >= CORNER and len(met) > 0:
            i_face, j_face, kind = insert_sorted(s.first.faces, s.second.faces, pairs, kinds, i_face, j_face, kind)
            n_first = len(s.first.faces)
            if i_face < 0 or (met[i_face] and met[n_first + j_face]):
                continue
            met[i_face] = met[n_first + j_face] = True
        if kind == APART:
            continue
        if kind != UNDECIDED and is_decisive(s, kind, i_face, j_face):
            pairs[0, 0], pairs[0, 1], kinds[0] = i_face, j_face, kind
            return SETTLED, 1, at
        if n_pairs < room:
            pairs[n_pairs, 0], pairs[n_pairs, 1], kinds[n_pairs] = i_face, j_face, kind
        n_pairs += 1
        if n_pairs > room:
            return FULL, n_pairs, at
        if s.flag[0] != 0:
            return INTERRUPTED, n_pairs, at
        if n_pairs == pause:
            return PAUSED, n_pairs, Progress(n_stack, i, j, low, high)
    return DONE, n_pairs, Progress(n_stack, 0, 0, 0, 0)


@merged
def expand_pair(s: Search, i: int, j: int, n_stack: int) -> tuple[int, int, int]:
    """Push the pairs of children of nodes i and j that may intersect on the stack of n_stack pairs. Returns (n_stack,
    low, high): the new height; for two leaf blocks, of which nothing is pushed, the mask of the pairs of faces that may
    intersect, in two 32-bit halves, else 0."""
    stack, frames, work, _, _ = s.descent
    child, their_child = s.first.child, s.second.child
    i_block, j_block = child[i, 0] < 0, their_child[j, 0] < 0
    if i_block and j_block:
        low, high = faces_meeting(s.first.blocks, i, s.second.blocks, j, frames, work)
        return n_stack, low, high
    low, high = meeting(s.first.boxes, i, s.second.boxes, j, frames)
    if j_block:  # only the lanes of i count
        for lane in range(LANES):
            if (low if lane < 4 else high) >> (8 * (lane & 3)) & 255 != 0:
                stack[n_stack, 0], stack[n_stack, 1] = child[i, lane], j
                n_stack += 1
    elif i_block:
        low |= high
        bits = (low | low >> 8 | low >> 16 | low >> 24) & 255
        while bits != 0:
            stack[n_stack, 0], stack[n_stack, 1] = i, their_child[j, lowest_bit(bits)]
            bits &= bits - 1
            n_stack += 1
    else:
        scales = (s.first.scale, s.second.scale)
        low, high = discs_meeting(low, high, s.first.discs, i, s.second.discs, j, frames, scales, work)
        while low != 0 or high != 0:
            bit, low, high = pop_lowest_bit(low, high)
            stack[n_stack, 0], stack[n_stack, 1] = child[i, bit >> 3], their_child[j, bit & 7]
            n_stack += 1
    return n_stack, 0, 0


@inline
def vertices_of(s: Search) -> tuple[Vertices, Vertices]:
    """Return the vertices of both bodies as input of exact signs: before their poses, unless `exact_faces` gives the
    points as placed, since placing rounds nothing."""
    are_placed, a, b = s.place.error == 0.0, s.place.a, s.place.b
    u = Vertices(s.first.vertices, a, UNPOSED if are_placed or not a.is_posed else 0)
    return u, Vertices(s.second.vertices, b, UNPOSED if are_placed or not b.is_posed else 1)


@called
def are_parted_by_blocks(s: Search, i: int, j: int) -> bool:
    """Return whether the plane of a face of leaf block i of the first or j of the second tree parts the bodies."""
    u, v = vertices_of(s)
    return blocks_part(s.descent.poses, s.first, u, i, s.second, v, j, exact_error(s))


@called
def are_parted(s: Search, i: int, j: int, n_stack: int) -> bool:
    """Return whether the plane of some face separates all faces below node i of the first tree from all below node j of
    the second. n_stack: pairs on the stack of the search, whose free rows are scratch."""
    u, v = vertices_of(s)
    free = s.descent.stack[n_stack:]
    return nodes_are_separated(s.descent.poses, s.first, u, i, s.second, v, j, free, exact_error(s))


@called
def is_decided_by_sample(s: Search, n_stack: int) -> bool:
    """Return whether some faces of the first body and all of the second have a pair that decides the query, and write
    it to row 0 of ``s.contacts``. Where boxes overlap that faces do not, as around two apexes, the descent may come to
    such a pair late. n_stack: pairs on the stack of the search, whose free rows are scratch."""
    child, stack = s.first.child, s.descent.stack
    for k in range(_N_SAMPLED):
        node = k * child.shape[0] // _N_SAMPLED
        while child[node, 0] >= 0:  # bound: the depth of the tree
            node = int(child[node, 0])
        stack[n_stack, 0], stack[n_stack, 1] = node, 0
        top = n_stack + 1
        while top > n_stack and s.flag[0] == 0:  # bound: each node of the second tree enters once
            top -= 1
            i, j = int(stack[top, 0]) + 0, int(stack[top, 1]) + 0
            top, low, high = expand_pair(s, i, j, top)
            how = classify_faces(s, Progress(top, i, j, low, high), 0, -1)[0]
            if how != DONE:
                return how == SETTLED
    return False


@merged
def search(s: Search, start: Progress, n_pairs: int, pause: int) -> tuple[int, int, Progress]:
    """Write all pairs of faces in contact to ``s.contacts``; return the outcome (DONE, ...), the number of pairs, which
    may exceed the room, and how far the search is. SETTLED: the one pair that decides the query stands in row 0. start:
    START, or where a search paused that had listed n_pairs; pause: number of pairs at which to pause."""
    stack, at, n_blocks, next_try, n_nodes = s.descent.stack, start, 0, _N_BLOCKS, 0
    if at.n_stack < 0:
        stack[0, 0], stack[0, 1] = 0, 0
        at = Progress(1, 0, 0, 0, 0)
    while at.n_stack > 0 or at.low != 0 or at.high != 0:  # bound: each pair of nodes enters once
        if s.flag[0] != 0:
            return INTERRUPTED, n_pairs, at
        if at.low == 0 and at.high == 0:
            n_stack = at.n_stack - 1
            i, j = int(stack[n_stack, 0]) + 0, int(stack[n_stack, 1]) + 0  # as 64 bits
            if n_blocks >= next_try and s.first.child[i, 0] >= 0 and s.second.child[j, 0] >= 0:
                if next_try == _N_BLOCKS and n_pairs == 0 and are_parted(s, 0, 0, n_stack):
                    return DONE, 0, at
                next_try = max(n_blocks, _N_BLOCKS + 1)
                if are_parted(s, i, j, n_stack):
                    at = Progress(n_stack, 0, 0, 0, 0)
                    continue
                next_try = n_blocks + _N_MORE
            n_nodes += 1
            if n_nodes == _N_NODES and n_pairs == 0 and len(s.contacts.met) == 0 and n_stack <= STACK:
                if is_decided_by_sample(s, n_stack + 1):
                    return SETTLED, 1, at
            n_stack, low, high = expand_pair(s, i, j, n_stack)
            at = Progress(n_stack, i, j, low, high)
        if at.low != 0 or at.high != 0:
            n_blocks += 1
            if n_blocks == _N_FIRST and n_pairs == 0 and are_parted_by_blocks(s, at.i, at.j):
                return DONE, 0, at
            how, n_pairs, at = classify_faces(s, at, n_pairs, pause)
            if how != DONE:
                return how, n_pairs, at
    pairs, kinds, _ = s.contacts
    room = capacity_of(s.contacts)
    for row in range(room, kinds.shape[0]):  # the pairs that name the witness
        if pairs[row, 0] >= 0:
            if n_pairs < room:
                pairs[n_pairs, 0], pairs[n_pairs, 1], kinds[n_pairs] = pairs[row, 0], pairs[row, 1], kinds[row]
            n_pairs += 1
    return DONE, n_pairs, at
