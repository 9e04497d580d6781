"""Contacts of segments with the elements of a boundary: edges of a polygon, triangles of a polyhedron.

For each segment a tree of boxes (in 3D: mesh_contacts.py) gives the elements nearby; exact orientation signs classify
them:

    edge a b, segment p q in the plane         triangle a b c, segment p q in space
    a, b on either side of p q and             p, q on either side of the plane of a b c and the line p q
    p, q on either side of a b                 on one side of all three edges
        PROPER: crossed in a point inside of both, the location changes there

Signs that exclude a common point drop the element. A zero sign means that one point is touched, or that both are
collinear or coplanar. An UNDECIDED sign, and a coplanar triangle without area, are DEGENERATE: the exact fallback
decides them (exact_pieces.py). A segment whose contacts are all proper needs only the location of its first end.

A contact in one point has a code (`code_of`), `CROSSES | place + 2 << 1 | ALONG | BEGINS | CEASES`:

| bits | name | meaning |
|---|---|---|
| 0 | CROSSES | the perturbed line crosses the element there |
| 1-4 | place + 2 | 0 .. 2: that corner; 3 .. 5: the side from corner place - 3 on; then START, END, WITHIN |
| 5 | ALONG | the segment is collinear with the edge, or coplanar with the triangle; it crosses the element nowhere |
| 6 | BEGINS | the overlap begins there |
| 7 | CEASES | the overlap ends there |
| 8 | LATER | of sorted contacts: it is not in the point of the one before |

An overlap longer than a point is two contacts, that of its end after that of its begin.

Source: the separating axes of segment and box stand in C. Ericson, Real-time collision detection, 2005, section 5.3.3.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any, Final, NamedTuple

import numpy as np

from engine.compiling.jit import allocating, allocating_kernel, called, inline, merged
from engine.predicates.orientation import orient2d
from engine.predicates.vectors import as_point2
from engine.types import UNDECIDED, FlagArray, FloatArray, IntArray, Point2


class Kind(IntEnum):
    """How a segment and an element meet: APART (no common point), PROPER (crossed in a point inside of both),
    DEGENERATE (undecided). A contact at a corner, side or end has a code instead (`code_of`)."""

    APART = 0
    PROPER = 1
    DEGENERATE = UNDECIDED


class Place(IntEnum):
    """Where a contact lies: 0 .. 2 at that corner of the element, 3 .. 5 on its side from corner place - 3 on, START or
    END at an end of the segment, WITHIN inside of both."""

    START = 6
    END = 7
    WITHIN = 8


class Bit(IntEnum):
    """Bits of a contact's code 2 (place + 2) + CROSSES, with ALONG, BEGINS or CEASES added for an overlap."""

    CROSSES = 1
    ALONG = 32
    BEGINS = 64
    CEASES = 128
    LATER = 256


CROSSED: Final = 2 * Place.WITHIN + 5
"""Code of an element crossed in its open interior, at no end of the segment."""
CODE_BITS: Final = 8
"""Two codes of one element are packed as first | second << CODE_BITS."""
INSIDE_BEFORE: Final = 2
OUTSIDE_BEFORE: Final = -2
"""In place of the location of a second end on the boundary: the location of the perturbed line before the first
contact."""
GROUP: Final = 2048
"""Most segments of a group."""
NO_ROOM: Final = -1
"""Returned instead of a number of contacts: too many for the arrays, or the flag was set."""


LEAF_SIZE: Final = 4
"""Edges of a leaf of the tree, see `build_box_tree`."""
_DEEPEST: Final = 64
"""Capacity of the traversal stack: a tree of depth d < 60 needs d + 1 nodes."""
_SLACK: Final = 2.0**-46
"""Error bound of the axis test: about 24 roundings of 2^-53, in terms up to 4 times the largest product."""
_TOO_LARGE: Final = 2.0**500
"""Size beyond which products may overflow, and only the boxes are compared."""


class Contacts(NamedTuple):
    """Output for the contacts of a group of segments. met, kinds: by contact the element, and its `Kind` or code;
    offsets: by segment."""

    met: Any
    kinds: Any
    offsets: Any
    """(m + 1,): first contact of each segment."""
    waiting: Any
    """Traversal scratch: (_DEEPEST,) int64 nodes; for a mesh see `Waiting`."""


@allocating
def allocate_contacts(n_segments: int, n_contacts: int, waiting: Any) -> Contacts:
    """Allocate arrays for groups of at most n_segments segments and n_contacts contacts, uninitialised."""
    return Contacts(
        np.empty(n_contacts, np.int64), np.empty(n_contacts, np.uint8), np.empty(n_segments + 1, np.int64), waiting
    )


@allocating
def edge_stack() -> IntArray:
    """Allocate the traversal stack of a tree over edges."""
    return np.empty(_DEEPEST, np.int64)


@merged
def code_of(place: int, is_crossed: bool) -> int:
    """Return the code of a contact at a place (corner, side, START, END, WITHIN): 2 (place + 2) + (1 if is_crossed: the
    perturbed line crosses the element there)."""
    return 2 * place + (5 if is_crossed else 4)


@merged
def decode_place(code: int) -> int:
    """Return the place encoded in a contact's code."""
    return ((code & (Bit.ALONG - 1)) >> 1) - 2


@merged
def axis_of(segments: FloatArray, item: int) -> int:
    """Return the axis (0, 1, 2) along which segment ``item`` is longest."""
    best = 0
    for k in range(1, segments.shape[2]):
        length = abs(segments[item, 1, k] - segments[item, 0, k])
        if length > abs(segments[item, 1, best] - segments[item, 0, best]):
            best = k
    return best


@inline
def are_same(points: FloatArray, point: int, others: FloatArray, other: int) -> bool:
    """Return whether row ``point`` of one array (n, dim) equals row ``other`` of another."""
    are_same = True
    for k in range(points.shape[1]):
        are_same &= points[point, k] == others[other, k]
    return are_same


@inline
def are_same_point(elements: FloatArray, first: int, code: int, second: int, other: int) -> bool:
    """Return whether two contacts of one segment are one point by their codes: an end of the segment, or a common
    corner or side of both elements. first, second: the elements; code, other: the codes of their contacts."""
    n, m = decode_place(code), decode_place(other)
    if n >= Place.START or m >= Place.START:
        return n == m and n <= Place.END
    if (n < 3) != (m < 3):
        return False
    if n < 3:
        return are_same(elements[first], n, elements[second], m)
    a, b, c, d = n - 3, (n - 2) % 3, m - 3, (m - 2) % 3
    p, q = elements[first], elements[second]
    return (are_same(p, a, q, c) and are_same(p, b, q, d)) or (are_same(p, a, q, d) and are_same(p, b, q, c))


@called
def touched_edge(of_a: int, of_b: int, of_p: int, of_q: int) -> int:
    """Return the code of the contact of edge a b and segment p q, where a sign is zero or UNDECIDED; APART if they are
    collinear, DEGENERATE if one is UNDECIDED. of_a, of_b: side of a and b at the line p q; of_p, of_q: side of p and q
    at the line a b."""
    if of_a == UNDECIDED or of_b == UNDECIDED or of_p == UNDECIDED or of_q == UNDECIDED:
        return Kind.DEGENERATE
    if of_a == 0 and of_b == 0:
        return Kind.APART
    place = Place.START if of_p == 0 else Place.END if of_q == 0 else 0 if of_a == 0 else 1
    return code_of(place, (of_a == 1) != (of_b == 1))


@inline
def overlap_code(begin: int, end: int) -> int:
    """Return the packed codes of an overlap from one place to another."""
    first, last = code_of(begin, False) | Bit.BEGINS, code_of(end, False) | Bit.CEASES
    return (first | Bit.ALONG) | (last | Bit.ALONG) << CODE_BITS


@called
def along_edge(a: Point2, b: Point2, p: Point2, q: Point2, of_a: int, of_b: int) -> int:
    """Return the packed codes of the overlap of segment p q and a collinear edge a b, one code if it is a point; APART
    if they do not overlap, DEGENERATE if a = b. of_a, of_b: the places of a and b."""
    if a.x == b.x and a.y == b.y:
        return Kind.DEGENERATE
    k = 0 if abs(q.x - p.x) >= abs(q.y - p.y) else 1
    if p[k] > q[k]:  # case: falling; seen from behind it rises
        a, b, p, q = Point2(-a.x, -a.y), Point2(-b.x, -b.y), Point2(-p.x, -p.y), Point2(-q.x, -q.y)
    if a[k] > b[k]:
        a, b, of_a, of_b = b, a, of_b, of_a
    if a[k] > q[k] or b[k] < p[k]:
        return Kind.APART
    if a[k] == q[k] or b[k] == p[k]:
        return code_of(Place.END if a[k] == q[k] else Place.START, False) | Bit.ALONG
    return overlap_code(Place.START if a[k] <= p[k] else of_a, Place.END if b[k] >= q[k] else of_b)


@merged
def edge_contact(edge: FloatArray, segment: FloatArray, is_before: bool) -> int:
    """Return the `Kind` or the packed codes of the contacts of a segment and an edge, both (2, 2). is_before: instead,
    PROPER if the perturbed line crosses the edge before the segment's start."""
    a, b = as_point2(edge, 0), as_point2(edge, 1)
    p, q = as_point2(segment, 0), as_point2(segment, 1)
    of_a, of_b = orient2d(p, q, a), orient2d(p, q, b)
    if of_a == of_b and (of_a == 1 or of_a == -1):
        return Kind.APART
    of_p, of_q = orient2d(a, b, p), orient2d(a, b, q)
    if is_before and max(of_a, of_b, of_p, of_q) != UNDECIDED:  # it does if the end is farther from the edge's line
        is_crossed = (of_a == 1) != (of_b == 1) and of_p == of_q and of_p == (1 if of_a == 1 else -1)
        return Kind.PROPER if is_crossed else Kind.APART
    if is_before:
        return Kind.DEGENERATE
    if of_p == of_q and (of_p == 1 or of_p == -1):
        return Kind.APART
    if abs(of_a) == 1 and abs(of_b) == 1 and abs(of_p) == 1 and abs(of_q) == 1:
        return Kind.PROPER  # two different signs each
    code = touched_edge(of_a, of_b, of_p, of_q)
    return code if code != Kind.APART else along_edge(a, b, p, q, 0, 1)


@merged
def may_meet(segment: FloatArray, box: FloatArray, is_before: bool) -> bool:
    """Return False if a separating axis proves that a segment (2, 2), or with is_before its line before its start,
    misses the closed box, (2, 2) low and high; else True."""
    n = segment.shape[1]
    largest = 0.0
    for k in range(n):
        p, q, low, high = segment[0, k], segment[1, k], box[0, k], box[1, k]
        is_below, is_above = (q >= p, q <= p) if is_before else (q < low, q > high)
        if (p < low and is_below) or (p > high and is_above):
            return False
        largest = max(largest, abs(p), abs(q), abs(low), abs(high))
    if largest > _TOO_LARGE:
        return True
    for k in range(n):
        for j in range(k):
            u, v = segment[1, j] - segment[0, j], segment[1, k] - segment[0, k]
            center_u, center_v = box[0, j] + box[1, j], box[0, k] + box[1, k]  # twice the centre, and so on
            half_u, half_v = box[1, j] - box[0, j], box[1, k] - box[0, k]
            from_u, from_v = center_u - 2.0 * segment[0, j], center_v - 2.0 * segment[0, k]
            reach = half_u * abs(v) + half_v * abs(u)
            slack = _SLACK * largest * (abs(u) + abs(v)) + 2.0**-1000
            if abs(from_u * v - from_v * u) > reach + slack:
                return False
    return True


@inline
def append_edges(contacts: Contacts, outline: Any, segment: FloatArray, is_before: bool, n_contacts: int) -> int:
    """Append the contacts of a segment (2, 2) with edges to the n_contacts in `contacts`; return their number then, or
    NO_ROOM. outline: the `Outline` of the polygon. is_before: see `edge_contact`."""
    n_leaves, n_edges, stack = outline.boxes.shape[0] // 2, outline.order.size, contacts.waiting
    stack[0], depth = 1, 1
    while depth > 0:  # bound: each node enters the stack once
        depth -= 1
        node = stack[depth]
        if not may_meet(segment, outline.boxes[node], is_before):
            continue
        if node < n_leaves:
            stack[depth], stack[depth + 1] = 2 * node + 1, 2 * node
            depth += 2
            continue
        start = (node - n_leaves) * LEAF_SIZE
        for place in range(start, min(start + LEAF_SIZE, n_edges)):
            element = outline.order[place]
            kind = edge_contact(outline.elements[element], segment, is_before)
            while kind != Kind.APART:  # bound: two codes
                if n_contacts == contacts.met.size:
                    return NO_ROOM
                contacts.met[n_contacts], contacts.kinds[n_contacts] = element, kind & ((1 << CODE_BITS) - 1)
                kind, n_contacts = kind >> CODE_BITS, n_contacts + 1
    return n_contacts


@called
def gather_edges(contacts: Contacts, outline: Any, segments: FloatArray, n: int, stop: FlagArray) -> int:
    """Fill `contacts` with those of the first n of segments (m, 2, 2) and the edges of an `Outline`; return the number
    of segments for which there is room. Segments of zero length have none. Ends early if `stop` (one uint8) is set."""
    n_met = 0
    contacts.offsets[0] = 0
    for i in range(n):
        if not are_same(segments[i], 0, segments[i], 1):
            n_met = append_edges(contacts, outline, segments[i], False, n_met)
        contacts.offsets[i + 1] = n_met
        if n_met < 0 or stop[0]:
            return i
    return n


@allocating_kernel
def find_contacts_2d(segments: FloatArray, outline: Any, stop: FlagArray, room: int) -> tuple[int, Any, Any, Any]:
    """Return (number, met, kinds, offsets): the contacts of segments (n, 2, 2) float64 with the edges of an `Outline`,
    segment by segment. met int64: the elements; kinds uint8: `Kind` or code; offsets (n + 1,) of segments. The number
    is NO_ROOM if there are more than `room`, or `stop` (one uint8) is set."""
    n, contacts = segments.shape[0], allocate_contacts(segments.shape[0], room, edge_stack())
    n_met = contacts.offsets[n] if gather_edges(contacts, outline, segments, n, stop) == n else NO_ROOM
    return n_met, contacts.met, contacts.kinds, contacts.offsets
