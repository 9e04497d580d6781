"""Which elements of a boundary does a segment meet, and how: edges of a polygon, triangles of a polyhedron.

For each segment a tree of boxes (in space: mesh_streams.py) gives the elements nearby, exact orientation signs sort
them:

    edge a b, segment p q in the plane         triangle a b c, segment p q in space
    a, b on either side of p q and             p, q on either side of the plane of a b c and the line p q
    p, q on either side of a b                 on one side of all three edges
        PROPER: crossed in a point inside of both, the location changes there

Signs that exclude a common point drop the element. Everything else, a zero sign or an undecided one, is DEGENERATE:
exact arithmetic looks at it (exact_pieces.py). A segment whose contacts are all proper needs no other decision than the
location of its first end.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.jit import inline, kernel
from engine.predicates.loading import as_point2
from engine.predicates.orientation import orient2d
from engine.segment_clipping.box_tree import DEEPEST, LEAF_SIZE, may_meet

APART: Final = 0
PROPER: Final = 1
DEGENERATE: Final = 2
GROUP: Final = 2048
"""Segments that are looked at together at most."""


@inline
def edge_contact(edge: Any, segment: Any) -> int:
    """Return how a segment and an edge of the plane meet, (2, 2) float64 both."""
    a, b = as_point2(edge, 0), as_point2(edge, 1)
    p, q = as_point2(segment, 0), as_point2(segment, 1)
    of_a, of_b = orient2d(p, q, a), orient2d(p, q, b)
    if of_a == of_b and (of_a == 1 or of_a == -1):
        return APART
    of_p, of_q = orient2d(a, b, p), orient2d(a, b, q)
    if of_p == of_q and (of_p == 1 or of_p == -1):
        return APART
    if abs(of_a) == 1 and abs(of_b) == 1 and abs(of_p) == 1 and abs(of_q) == 1:
        return PROPER  # two different signs each
    return DEGENERATE


@inline
def gather_edge_contacts(outline: Any, segment: Any, stack: Any, met: Any, kinds: Any, found: int) -> int:
    """Append the contacts of a segment (2, 2) to the `found` first of met and kinds; return how many these are then.

    -1 where there is no room. stack: (DEEPEST,) int64.
    """
    n_leaves, n_edges = outline.boxes.shape[0] // 2, outline.order.size
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
            if kind != APART:
                if found == met.size:
                    return -1
                met[found], kinds[found] = element, kind
                found += 1
    return found


@inline
def is_point(segment: Any) -> bool:
    """Tell whether a segment has no length."""
    are_equal = True
    for k in range(segment.shape[1]):
        are_equal &= segment[0, k] == segment[1, k]
    return are_equal


@inline
def gather_edges(
    segments: Any, first: int, last: int, outline: Any, stop: Any, stack: Any, met: Any, kinds: Any, offsets: Any
) -> int:
    """Find the contacts of ``segments[first:last]`` with the edges of a polygon: see `find_contacts_2d`."""
    found = 0
    offsets[0] = 0
    for i in range(first, last):
        if not is_point(segments[i]):
            after = gather_edge_contacts(outline, segments[i], stack, met, kinds, found)
            if after < 0:
                return i
            found = after
        offsets[i - first + 1] = found
        if stop[0]:
            return i
    return last


@kernel
def find_contacts_2d(
    segments: Any, first: int, last: int, outline: Any, stop: Any, elements_met: Any, kinds: Any, offsets: Any
) -> int:
    """Find the contacts of ``segments[first:last]`` with the edges of a polygon; those of no length have none.

    segments: (n, 2, 2) float64. stop: one uint8, polled. elements_met, kinds: int64 and uint8 of equal length, filled
    with the contacts one segment after another; offsets: (last - first + 1,) int64, those of segment i end before
    offsets[i - first + 1]. Returns the index after the last segment that had room for all its contacts.
    """
    stack = np.empty(DEEPEST, np.int64)
    return gather_edges(segments, first, last, outline, stop, stack, elements_met, kinds, offsets)
