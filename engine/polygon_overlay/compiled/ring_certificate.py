"""A certificate that rounding left rings what they were: no vertex came near another edge than its own.

Every vertex moves by less than the unit u of the largest coordinate, on a straight way. Two edges that have no vertex
in common cannot touch on that way if they end more than 2 u apart; nor can two edges fold that have one in common, if
the far end of each ends more than 2 u away from the other. If that holds for every pair with a vertex that moves, the
rings after rounding are the exact ones deformed without a touch: valid, with the same pieces, holes and turns. Where
clearance.py has no doubt about the edges that two of them are parts of, it does.

Distances are computed in floating point. Differences are off by u each, so the distance from a line by less than 12 u
more: `MARGIN` = 16 holds both. A pair that fails proves nothing; the caller then arranges the rounded rings anew.
"""

from __future__ import annotations

from typing import Any, Final

from engine.jit import inline, merged
from engine.polygon_overlay.compiled.chain_rings import MEETS, Rings
from engine.polygon_overlay.compiled.edge_contacts import POLL
from engine.polygon_overlay.compiled.edge_tree import (
    ANYWHERE,
    DOUBTFUL,
    FEW,
    RUN,
    BoxTree,
    begin_pairs,
    boxes_meet,
    build_tree,
    next_pairs,
)
from engine.polygon_overlay.compiled.rounded_crossings import Rounded
from engine.predicates.orientation import orient2d
from engine.types import Point2

MARGIN: Final = 16.0 * 2.0**-52


@merged
def _is_far(px: float, py: float, ax: float, ay: float, bx: float, by: float, square: float) -> bool:
    """Tell whether p is further from the segment ab than the root of ``square``."""
    dx, dy, ex, ey = bx - ax, by - ay, px - ax, py - ay
    along, length = ex * dx + ey * dy, dx * dx + dy * dy
    if along <= 0.0:
        return ex * ex + ey * ey > square
    if along >= length:
        ex, ey = px - bx, py - by
        return ex * ex + ey * ey > square
    across = dx * ey - dy * ex
    return across * across > square * length


@merged
def _is_beside(x: Any, y: Any, a: int, b: int, c: int, d: int, square: float) -> bool:
    """Tell whether c and d are on one side of the line ab, further from it than the root of ``square``."""
    dx, dy = x[b] - x[a], y[b] - y[a]
    side_c, side_d = dx * (y[c] - y[a]) - dy * (x[c] - x[a]), dx * (y[d] - y[a]) - dy * (x[d] - x[a])
    nearest = min(abs(side_c), abs(side_d))
    return ((side_c > 0.0) == (side_d > 0.0)) & (nearest * nearest > square * (dx * dx + dy * dy))


@merged
def _crosses(x: Any, y: Any, a: int, b: int, c: int, d: int) -> bool:
    """Tell whether c and d are on two sides of ab, and a and b on two sides of cd, in floating point."""
    dx, dy = x[b] - x[a], y[b] - y[a]
    side_c, side_d = dx * (y[c] - y[a]) - dy * (x[c] - x[a]), dx * (y[d] - y[a]) - dy * (x[d] - x[a])
    if (side_c > 0.0) == (side_d > 0.0):
        return False
    dx, dy = x[d] - x[c], y[d] - y[c]
    side_a, side_b = dx * (y[a] - y[c]) - dy * (x[a] - x[c]), dx * (y[b] - y[c]) - dy * (x[b] - x[c])
    return (side_a > 0.0) != (side_b > 0.0)


@inline
def segments_are_far(x: Any, y: Any, a: int, b: int, c: int, d: int, square: float) -> bool:
    """Tell whether the segments ab and cd are further apart than the root of ``square``."""
    if _is_beside(x, y, a, b, c, d, square) or _is_beside(x, y, c, d, a, b, square):
        return True
    return (
        _is_far(x[b], y[b], x[c], y[c], x[d], y[d], square)
        and _is_far(x[d], y[d], x[a], y[a], x[b], y[b], square)
        and _is_far(x[a], y[a], x[c], y[c], x[d], y[d], square)
        and _is_far(x[c], y[c], x[a], y[a], x[b], y[b], square)
        and not _crosses(x, y, a, b, c, d)
    )


@merged
def _is_apart(points: Any, x: Any, y: Any, a: int, b: int, c: int, d: int, square: float) -> bool:
    """Tell whether the edges ab and cd cannot touch, or fold, on the way to their rounded places."""
    if points[a] == points[d]:
        c, d = d, c
    elif points[b] == points[c]:
        a, b = b, a
    elif points[b] == points[d]:
        a, b, c, d = b, a, d, c
    elif points[a] != points[c]:
        return segments_are_far(x, y, a, b, c, d, square)
    return _is_far(x[b], y[b], x[c], y[c], x[d], y[d], square) and _is_far(x[d], y[d], x[a], y[a], x[b], y[b], square)


@inline
def has_straight_point(rings: Rings, n_rings: int, rounded: Rounded, stop: Any) -> bool:
    """Tell whether rounding put a point, one where rings do not meet, on a straight line with its neighbours."""
    x, y, moved = rounded.x, rounded.y, rounded.moved
    for ring in range(n_rings):
        first, last = rings.offset[ring], rings.offset[ring + 1]
        i, j = last - 2, last - 1
        for k in range(first, last):
            if k & POLL == 0 and stop[0]:
                return True
            if (moved[i] | moved[j] | moved[k]) and not rings.meets[j] & (MEETS | RUN):
                if orient2d(Point2(x[i], y[i]), Point2(x[j], y[j]), Point2(x[k], y[k])) == 0:
                    return True
            i, j = j, k
    return False


@inline
def certify(
    rings: Rings, n_rings: int, n: int, rounded: Rounded, tree: BoxTree, tails: Any, heads: Any, stop: Any
) -> bool:
    """Tell whether the rings are certainly valid after rounding, no edges near each other that do not meet.

    n: points of ``rings``. tree, tails, heads: scratch for as many. Only edges with the mark DOUBTFUL are looked at:
    clearance.py vouches for pairs of which one has not. What is left out (RUN) is away from all that moves.
    """
    x, y, moved, boxes, pairs = rounded.x, rounded.y, rounded.moved, tree.boxes, tree.pairs
    largest = 0.0
    for k in range(n):
        largest = max(largest, abs(x[k]), abs(y[k]))
    margin = MARGIN * largest
    square = margin * margin
    n_edges = 0
    for ring in range(n_rings):
        first, last = rings.offset[ring], rings.offset[ring + 1]
        for k in range(first, last):
            if k & POLL == 0 and stop[0]:
                return False
            if rings.meets[k] & (DOUBTFUL | RUN) != DOUBTFUL:
                continue
            j = k + 1 if k + 1 < last else first
            tails[n_edges], heads[n_edges], tree.marks[n_edges] = k, j, ANYWHERE
            boxes[n_edges, 0], boxes[n_edges, 1] = min(x[k], x[j]) - margin, max(x[k], x[j]) + margin
            boxes[n_edges, 2], boxes[n_edges, 3] = min(y[k], y[j]) - margin, max(y[k], y[j]) + margin
            n_edges += 1
    if n_edges > FEW:
        build_tree(tree, n_edges, stop)
    depth = begin_pairs(tree, n_edges, stop)
    while depth > 0:  # bound: the walk through the tree
        if stop[0]:
            return False
        found, depth = next_pairs(tree, n_edges, depth)
        for k in range(found):
            i, j = pairs[k, 0], pairs[k, 1]
            a, b, c, d = tails[i], heads[i], tails[j], heads[j]
            if (
                (moved[a] | moved[b] | moved[c] | moved[d])
                and boxes_meet(boxes, i, boxes, j)
                and not _is_apart(rings.point, x, y, a, b, c, d, square)
            ):
                return False
    return True
