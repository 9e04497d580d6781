"""Which elements of a boundary does a segment meet, and how: edges of a polygon, triangles of a polyhedron.

For each segment a tree of boxes (in space: mesh_contacts.py) gives the elements nearby, exact orientation signs sort
them:

    edge a b, segment p q in the plane         triangle a b c, segment p q in space
    a, b on either side of p q and             p, q on either side of the plane of a b c and the line p q
    p, q on either side of a b                 on one side of all three edges
        PROPER: crossed in a point inside of both, the location changes there

Signs that exclude a common point drop the element. A zero sign says that one point is touched, or that both lie on
one line or plane. An undecided one, and triangles that the segment runs in, are DEGENERATE: exact arithmetic looks at
them (exact_pieces.py). A segment whose contacts are all proper needs no other decision than the location of its first
end.

What touches in a point has a code (`code_of`), its bits from the lowest:

    CROSSES   the line beside the segment crosses the element there
    4 bits    place + 2: 0 .. 2 that corner, 3 .. 5 the side from corner place - 3 on, then START, END, WITHIN
    ALONG     the segment runs along an edge of the plane, which is crossed nowhere; others are named before it
    BEGINS    it begins to there
    CEASES    it ends to there

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
    """How a segment and an element meet, where that is no code of `code_of`."""

    APART = 0
    PROPER = 1
    DEGENERATE = UNDECIDED
    ALONG = 32


class Place(IntEnum):
    """Where an element is touched, beside its corners (0 .. 2) and its sides (3 .. 5, from corner place - 3 on)."""

    START = 6
    END = 7
    WITHIN = 8


class Bit(IntEnum):
    """The bits of a code beside the place, which is held plus 2 from the second bit on."""

    CROSSES = 1
    ALONG = Kind.ALONG
    BEGINS = 64
    CEASES = 128


CROSSED: Final = 2 * Place.WITHIN + 5
"""The code of what is met in its open interior, no end of the segment."""
INSIDE_BEFORE: Final = 2
OUTSIDE_BEFORE: Final = -2
"""Locations of a second end that say where the line beside the segment is before its first contact."""
GROUP: Final = 2048
"""Segments that are looked at together at most."""
NO_ROOM: Final = -1
STOPPED: Final = -2
"""Instead of a number of contacts."""


LEAF_SIZE: Final = 4
"""Edges of a leaf, see `build_box_tree`."""
_DEEPEST: Final = 64
"""Places on the traversal's stack: a tree of depth d holds at most d + 1 nodes at once, and d < 60."""
_SLACK: Final = 2.0**-46
"""Bound of the axis test: about 24 roundings of 2^-53, in terms up to 4 times the largest product."""
_TOO_LARGE: Final = 2.0**500
"""Beyond this products may overflow, and only the boxes are compared."""


class Contacts(NamedTuple):
    """Room for the contacts of a group of segments: elements and kinds one segment after another, and offsets."""

    met: Any
    kinds: Any
    offsets: Any
    """(m + 1,) where those of each segment begin."""
    waiting: Any
    """What a traversal works in: (_DEEPEST,) int64, nodes that wait; of a mesh see `Waiting`."""


@allocating
def contacts_for(n_segments: int, n_contacts: int, waiting: Any) -> Contacts:
    """Return room for groups of so many segments at most, and so many contacts of a group."""
    return Contacts(
        np.empty(n_contacts, np.int64), np.empty(n_contacts, np.uint8), np.empty(n_segments + 1, np.int64), waiting
    )


@allocating
def edges_waiting() -> IntArray:
    """Return what a traversal of edges works in."""
    return np.empty(_DEEPEST, np.int64)


@merged
def code_of(place: int, is_crossed: bool) -> int:
    """Return the code of what is touched at a place."""
    return 2 * place + (5 if is_crossed else 4)


@merged
def place_of(code: int) -> int:
    """Return the place that a code tells."""
    return ((code & (Bit.ALONG - 1)) >> 1) - 2


@merged
def axis_of(segments: FloatArray, item: int) -> int:
    """Return the axis along which a segment is longest."""
    best = 0
    for k in range(1, segments.shape[2]):
        length = abs(segments[item, 1, k] - segments[item, 0, k])
        if length > abs(segments[item, 1, best] - segments[item, 0, best]):
            best = k
    return best


@inline
def are_same(points: FloatArray, point: int, others: FloatArray, other: int) -> bool:
    """Tell whether a row of one array (n, dim) and one of another are equal."""
    are_same = True
    for k in range(points.shape[1]):
        are_same &= points[point, k] == others[other, k]
    return are_same


@inline
def are_one(elements: FloatArray, first: int, code: int, second: int, other: int) -> bool:
    """Tell whether what two codes say of two elements is one point: an end, or a corner or one side of both."""
    n, m = place_of(code), place_of(other)
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
    """Return the code of an edge a b of the plane that a segment p q touches, by their signs; ALONG where all are on
    one line, if they meet at all, DEGENERATE where a sign is UNDECIDED."""
    if of_a == UNDECIDED or of_b == UNDECIDED or of_p == UNDECIDED or of_q == UNDECIDED:
        return Kind.DEGENERATE
    if of_a == 0 and of_b == 0:
        return Kind.ALONG
    place = Place.START if of_p == 0 else Place.END if of_q == 0 else 0 if of_a == 0 else 1
    return code_of(place, (of_a == 1) != (of_b == 1))


@called
def along_edge(a: Point2, b: Point2, p: Point2, q: Point2) -> int:
    """Return ALONG where a segment p q and an edge a b of one line meet, else APART; DEGENERATE for an edge a = b."""
    if a.x == b.x and a.y == b.y:
        return Kind.DEGENERATE
    if max(a.x, b.x) < min(p.x, q.x) or max(p.x, q.x) < min(a.x, b.x):
        return Kind.APART
    return Kind.APART if max(a.y, b.y) < min(p.y, q.y) or max(p.y, q.y) < min(a.y, b.y) else Kind.ALONG


@inline
def edge_contact(edge: FloatArray, segment: FloatArray) -> int:
    """Return how a segment and an edge of the plane meet, (2, 2) float64 both: what touches by its code."""
    a, b = as_point2(edge, 0), as_point2(edge, 1)
    p, q = as_point2(segment, 0), as_point2(segment, 1)
    of_a, of_b = orient2d(p, q, a), orient2d(p, q, b)
    if of_a == of_b and (of_a == 1 or of_a == -1):
        return Kind.APART
    of_p, of_q = orient2d(a, b, p), orient2d(a, b, q)
    if of_p == of_q and (of_p == 1 or of_p == -1):
        return Kind.APART
    if abs(of_a) == 1 and abs(of_b) == 1 and abs(of_p) == 1 and abs(of_q) == 1:
        return Kind.PROPER  # two different signs each
    code = touched_edge(of_a, of_b, of_p, of_q)
    return code if code != Kind.ALONG else along_edge(a, b, p, q)


@inline
def may_meet(segment: FloatArray, box: FloatArray) -> bool:
    """Tell whether a segment may meet a closed box; False only where some axis surely separates them."""
    n = segment.shape[1]
    largest = 0.0
    for k in range(n):
        p, q, low, high = segment[0, k], segment[1, k], box[0, k], box[1, k]
        if (p < low and q < low) or (p > high and q > high):
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
def append_edges(contacts: Contacts, outline: Any, segment: FloatArray, found: int) -> int:
    """Append the contacts of a segment (2, 2) to the `found` first ones; return how many these are then, or NO_ROOM."""
    n_leaves, n_edges, stack = outline.boxes.shape[0] // 2, outline.order.size, contacts.waiting
    stack[0], depth = 1, 1
    while depth > 0:  # bound: each node enters the stack once
        depth -= 1
        node = stack[depth]
        if not may_meet(segment, outline.boxes[node]):
            continue
        if node < n_leaves:
            stack[depth], stack[depth + 1] = 2 * node + 1, 2 * node
            depth += 2
            continue
        start = (node - n_leaves) * LEAF_SIZE
        for place in range(start, min(start + LEAF_SIZE, n_edges)):
            element = outline.order[place]
            kind = edge_contact(outline.elements[element], segment)
            if kind != Kind.APART:
                if found == contacts.met.size:
                    return NO_ROOM
                contacts.met[found], contacts.kinds[found] = element, kind
                found += 1
    return found


@called
def gather_edges(contacts: Contacts, outline: Any, segments: FloatArray, n: int, stop: FlagArray) -> int:
    """Fill met, kinds and offsets with the contacts of the first n of some segments (m, 2, 2); return how many.

    Those of no length have none. NO_ROOM where they have no room, STOPPED where `stop` (one uint8) is set.
    """
    found = 0
    contacts.offsets[0] = 0
    for i in range(n):
        if not are_same(segments[i], 0, segments[i], 1):
            found = append_edges(contacts, outline, segments[i], found)
        contacts.offsets[i + 1] = found
        if found < 0:
            return NO_ROOM
        if stop[0]:
            return STOPPED
    return found


@allocating_kernel
def find_contacts_2d(segments: FloatArray, outline: Any, stop: FlagArray, room: int) -> tuple[int, Any, Any, Any]:
    """Return how many contacts segments (n, 2, 2) float64 have with the edges of a polygon, and these.

    elements met and kinds, int64 and uint8, one segment after another; offsets (n + 1,) int64, where those of each
    begin. NO_ROOM where there are more than `room`. stop: one uint8, polled.
    """
    contacts = contacts_for(segments.shape[0], room, edges_waiting())
    found = gather_edges(contacts, outline, segments, segments.shape[0], stop)
    return found, contacts.met, contacts.kinds, contacts.offsets
