"""Proofs that rounding the crossings to doubles keeps the topology of rings; and the nearest double of each crossing.

Before rounding. Every crossing moves by less than the unit u of the largest coordinate, every vertex stays. Rings of
the arrangement keep their topology if, by a margin of some units,

- two edges that have no point in common are apart;
- on an edge that crosses another in X, every node but X is away from the other's line: the distance from that line
  grows evenly from X on, so it is enough that the nodes next to X (the ends of the edge among them) are;
- where edges follow each other, the nodes next to their common vertex are away from the other edge.

Then two stretches between nodes are apart, or meet in a node with the far end of each away from the other, during the
whole motion to their rounded places: no stretch touches, passes or folds onto another. This holds for all edges, so for
those of any result. No edge may be shorter than the margin either: edges of a run that heads for one quadrant are not
tested pair by pair (edge_tree.py), and two of them are as far apart as each edge between them is long.

After rounding, where that fails, the rounded rings of the result are tested. Every vertex moves by less than u on a
straight line. Two edges without a common vertex cannot touch on the way if they end more than 2 u apart; two edges with
one cannot fold if the far end of each ends more than 2 u away from the other. If that holds for every pair with a moved
vertex, the rounded rings are the exact ones deformed without a touch: valid, with the same pieces, holes and turns.

Margins, distances being floating point:

    after rounding     distance from a line off by < 12 u, + 2 u      -> MARGIN = 16 units
    before rounding    orientation off by 3 u a length: < 12 u, + 2 u -> CLEARANCE = 64 units

Rounding a crossing. With the weights w_a and w_b of the ends of the first edge (crossing_signs.py), known to a relative
r: ``x = (a |w_b| + b |w_a|) / (|w_a| + |w_b|)``. Products add 2 u^2, their sum and the sum of weights 4 u^2 each, the
quotient 16 u^2: ``error <= (28 u^2 + 2 r) max(|a|, |b|)``; 40 u^2 + 2.5 r covers higher orders for r < 0.01. Where the
bound leaves two doubles, or the value may be a double itself, signs of the exact difference to the double and to the
midpoints with its neighbours decide. Where the value may be less than 2^55 bounds, so that the double-double may miss
its neighbours, it is computed from expansions: the quotient of their two leading components is within 2^-100 of it.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final, NamedTuple

import numpy as np

from engine.compiling.jit import called, inline, merged
from engine.polygon_overlay.compiled.chain_rings import MEETS, Rings
from engine.polygon_overlay.compiled.crossing_signs import (
    Edges,
    Ends,
    crossing_against,
    exact_cross,
    exact_weight,
    flushed,
    weight_of,
)
from engine.polygon_overlay.compiled.edge_contacts import Events, is_far, segments_are_far
from engine.polygon_overlay.compiled.edge_events import Along
from engine.polygon_overlay.compiled.edge_tree import (
    ANYWHERE,
    FEW,
    OFTEN,
    POLL,
    RUN,
    BoxTree,
    begin_pairs,
    build_tree,
    next_pairs,
)
from engine.predicates.error_free import (
    U2,
    dd_add,
    dd_div,
    dd_scale,
    even_of,
    fast_two_sum,
    is_correctly_rounded,
    workspace,
)
from engine.predicates.expansion import add_scaled, compress, is_safe, sign
from engine.predicates.orientation import orient2d
from engine.types import UNDECIDED, FlagArray, FloatArray, Int32Array, Point2

CUT_BOUND: Final = 40.0 * U2
LOST: Final = -1.0
"""Error bound of a coordinate of which the nearest double is not determined: the pair takes the exact fallback."""
_NOT_YET: Final = -2.0
"""Error bound of a crossing that is not rounded yet."""

Rounded = namedtuple("Rounded", "x y moved crossing_x crossing_y error")
"""x, y, moved: by point of rings, its nearest doubles, and 1 if they differ from the point (uint8); crossing_x,
crossing_y, error: by crossing, its nearest doubles and a bound of its displacement."""


class _Cut(NamedTuple):
    """Crossing of edges e and f. ah + al, bh + bl: |orient| of the first and second end of e against the line of f, as
    double-doubles; sum_h + sum_l: the sum of both; relative: 2.5 r, r a bound of their relative errors."""

    e: int
    f: int
    ah: float
    al: float
    bh: float
    bl: float
    sum_h: float
    sum_l: float
    relative: float


@merged
def _abs2(h: float, low: float) -> tuple[float, float]:
    """Return the absolute value of the double-double h + low."""
    return (h, low) if h >= 0.0 else (-h, -low)


@called
def round_crossing(edges: Edges, e: int, f: int) -> tuple[float, float, float, float]:
    """Return (x, y, x_error, y_error): the doubles nearest to the crossing of edges e and f, and a bound on the
    rounding error of each. Error 0.0: the double is the coordinate itself. LOST: the nearest double is not determined.
    """
    ends, others = _ends_of(edges, e), _ends_of(edges, f)
    (x, has_x), (y, has_y) = common_places(ends, others)
    if has_x and has_y:
        return x, y, 0.0, 0.0
    ah, al, bh, bl, relative = weights_of(ends, others)
    sum_h, sum_l = dd_add(ah, al, bh, bl)
    cut = _Cut(e, f, ah, al, bh, bl, sum_h, sum_l, relative)
    x_error = y_error = 0.0
    if not has_x:
        x, x_error = _coordinate(edges, cut, 0, ends[0], ends[2])
    if not has_y:
        y, y_error = _coordinate(edges, cut, 1, ends[1], ends[3])
    return x, y, x_error, y_error


@merged
def _ends_of(edges: Edges, e: int) -> Ends:
    """Return ax, ay, bx, by: the coordinates of the first end a and the second end b of edge e."""
    return edges.x[e], edges.y[e], edges.x[edges.after[e]], edges.y[edges.after[e]]


@merged
def common_places(first: Ends, second: Ends) -> tuple[tuple[float, bool], tuple[float, bool]]:
    """Return (x, has_x), (y, has_y) for two edges: has_x tells whether one is vertical, so that x is the x of a
    crossing exactly; has_y and y likewise for a horizontal one. Without has_x, x is any number."""
    ax, ay, bx, by = first
    cx, cy, dx, dy = second
    return ((ax if ax == bx else cx), (ax == bx) | (cx == dx)), ((ay if ay == by else cy), (ay == by) | (cy == dy))


@merged
def weights_of(ends: Ends, others: Ends) -> tuple[float, float, float, float, float]:
    """Return (ah, al, bh, bl, 2.5 r): |orient| of both ends a, b of an edge against the line of ``others``, as
    double-doubles, and a bound r of the relative error of both. They come from expansions where r would exceed 0.001,
    if exponents allow."""
    ax, ay, bx, by = ends
    cx, cy, dx, dy = others
    ah, al, ae = weight_of(cx, cy, dx, dy, ax, ay)
    bh, bl, be = weight_of(cx, cy, dx, dy, bx, by)
    ah, al = _abs2(ah, al)
    bh, bl = _abs2(bh, bl)
    if ae > 0.001 * ah or be > 0.001 * bh:
        is_in_range = True
        for k in range(4):
            is_in_range &= is_safe(ends[k]) & is_safe(others[k])
        if is_in_range:
            ah, al = _weight_from_expansion(ax, ay, others)
            bh, bl = _weight_from_expansion(bx, by, others)
            ae, be = 4.0 * U2 * ah, 4.0 * U2 * bh
    return ah, al, bh, bl, 2.5 * max(ae / ah, be / bh)


@called
def _weight_from_expansion(x: float, y: float, others: Ends) -> tuple[float, float]:
    """Return |orient(c, d, (x, y))| as a double-double (high, low), computed with an expansion; c and d are the ends
    ``others``."""
    e = workspace(16)
    h, low = leading(e, exact_cross(others, (others[0], others[1], x, y), e))
    return _abs2(h, low)


@inline
def leading(e: Any, n: int) -> tuple[float, float]:
    """Return the sum of an expansion e of n components as a double-double (high, low): its two leading ones."""
    n = compress(e, n)
    if n == 0:
        return 0.0, 0.0
    return (e[0], 0.0) if n == 1 else fast_two_sum(e[n - 1], e[n - 2])


@merged
def _coordinate(edges: Edges, cut: _Cut, axis: int, p: float, q: float) -> tuple[float, float]:
    """Return the double nearest to one coordinate of a crossing, and a bound on its rounding error: 0.0 if they are
    equal, LOST if it is not determined. axis: 0 for x, 1 for y. p, q: that coordinate of the first and second end of
    edge ``cut.e``."""
    rh, rl = dd_scale(cut.bh, cut.bl, p)
    sh, sl = dd_scale(cut.ah, cut.al, q)
    nh, nl = dd_add(rh, rl, sh, sl)
    h, low = dd_div(nh, nl, cut.sum_h, cut.sum_l)
    bound = (CUT_BOUND + cut.relative) * max(abs(p), abs(q))
    if abs(low) > bound and is_correctly_rounded(h, low, bound):
        return h + 0.0, abs(low) + bound
    return _round_exactly(edges, cut.e, cut.f, axis, h, bound)


@called
def _round_exactly(edges: Edges, e: int, f: int, axis: int, h: float, bound: float) -> tuple[float, float]:
    """Return the double nearest to one coordinate of the crossing of edges e and f, by exact signs, and a bound on its
    rounding error: 0.0 if they are equal, LOST if it is not determined. axis: 0 for x, 1 for y. h: a double near the
    coordinate; bound: on |h - coordinate|."""
    if bound > 2.0**-55 * abs(h):  # case: a crossing on an axis, or so near that h may be many doubles off
        h = _from_expansions(edges, e, f, axis)
    side = crossing_against(edges, e, f, axis, h, 0.0)
    if side == 0:
        return h + 0.0, 0.0
    # bound: h is the nearest double or a neighbour of it, else the double is lost
    for _ in range(2):
        other = np.nextafter(h, np.inf if side > 0 else -np.inf)
        half = (other - h) / 2.0
        beyond = crossing_against(edges, e, f, axis, h, half)
        if beyond == 0:  # case: a tie; of two neighbours the one with an even last bit is nearer to nothing else
            return even_of(h, other) + 0.0, abs(half)
        if beyond != side:
            return h + 0.0, abs(half)
        h = other
        side = crossing_against(edges, e, f, axis, h, 0.0)
        if side == 0:
            return h + 0.0, 0.0
        if side != beyond:
            return h + 0.0, abs(half)
    return h, LOST


@called
def _from_expansions(edges: Edges, e: int, f: int, axis: int) -> float:
    """Return a coordinate (axis 0: x, 1: y) of the crossing of edges e and f, computed with expansions, with an error
    below one unit in its last place."""
    z = edges.x if axis == 0 else edges.y
    a, b, fb = e, edges.after[e], edges.after[f]
    wa, wb = workspace(16), workspace(16)
    na, nb = exact_weight(edges, f, fb, a, wa), exact_weight(edges, f, fb, b, wb)
    factor = 1.0 if sign(wa, na) > 0 else -1.0  # the weights are of opposite signs
    above, below = workspace(64), workspace(64)  # 2 * 16 components for each of two products
    p, q = flushed(z[a]), flushed(z[b])
    n = add_scaled(above, add_scaled(above, 0, wa, na, factor * q), wb, nb, -factor * p)
    m = add_scaled(below, add_scaled(below, 0, wa, na, factor), wb, nb, -factor)
    nh, nl = leading(above, n)
    dh, dl = leading(below, m)
    h, _ = dd_div(nh, nl, dh, dl)
    return h + 0.0


@merged
def distance_of(error_x: float, error_y: float) -> float:
    """Return ``hypot(error_x, error_y)``, rounded up."""
    return np.sqrt(error_x * error_x + error_y * error_y) * (1.0 + 2.0**-50)  # two squares, their sum, a root


@inline
def round_points(
    edges: Edges, events: Events, points: Int32Array, n: int, n_crossings: int, n_points: int, rounded: Rounded,
    stop: FlagArray,
) -> float:  # fmt: skip
    """Fill ``rounded`` with the nearest doubles of the n_points points of all rings: points[k] is input vertex v < n,
    or crossing c as n + c. Returns the largest displacement of a point, or LOST if one is not determined."""
    x, y, error = edges.x, edges.y, rounded.error
    error[:n_crossings] = _NOT_YET
    farthest = 0.0
    lost = False
    for k in range(n_points):
        if k & OFTEN == 0 and stop[0]:
            return LOST
        point = points[k]
        if point < n:
            rounded.x[k], rounded.y[k], rounded.moved[k] = x[point] + 0.0, y[point] + 0.0, 0
        else:
            c = point - n
            if error[c] == _NOT_YET:
                cx, cy, ex, ey = round_crossing(edges, events.first[c], events.second[c])
                lost = lost or ex < 0.0 or ey < 0.0
                rounded.crossing_x[c], rounded.crossing_y[c], error[c] = cx, cy, distance_of(ex, ey)
                farthest = max(farthest, error[c])
            rounded.x[k], rounded.y[k] = rounded.crossing_x[c], rounded.crossing_y[c]
            rounded.moved[k] = error[c] > 0.0
    return LOST if lost else farthest


CLEARANCE: Final = 64.0 * 2.0**-52
MARGIN: Final = 16.0 * 2.0**-52
"""The margins before rounding (CLEARANCE) and after it (MARGIN), as multiples of the largest coordinate."""


@inline
def _corner_is_clear(edges: Edges, v: int, share_before: float, share_after: float, margin: float) -> bool:
    """Return whether the next node on either edge at vertex v is further than the margin from the other of these edges.
    share_before: the part, 0 .. 1, of the edge that arrives at v between its last node and v; share_after: that of the
    edge that leaves v, between v and its first node."""
    x, y = edges.x, edges.y
    p, q = edges.before[v], edges.after[v]
    ux, uy, wx, wy = x[p] - x[v], y[p] - y[v], x[q] - x[v], y[q] - y[v]
    if ux * wx + uy * wy <= 0.0:  # v is what is nearest to each
        return share_before * max(abs(ux), abs(uy)) > margin and share_after * max(abs(wx), abs(wy)) > margin
    turn = abs(ux * wy - uy * wx)
    return share_before * turn > margin * (abs(wx) + abs(wy)) and share_after * turn > margin * (abs(ux) + abs(uy))


@inline
def corners_are_clear(edges: Edges, n: int, along: Along, margin: float, stop: FlagArray) -> bool:
    """Return whether, at each of n vertices, the next events on its two edges are further than the margin from the
    other edge. along: filled by `sort_events`. False also if ``stop`` is set."""
    starts, keys = along.starts, along.keys
    for e in range(n):
        if e & POLL == 0 and stop[0]:
            return False
        first, last = starts[e], starts[e + 1]
        if first == last:
            continue
        before, after = edges.before[e], edges.after[e]
        share_before = share_after = 1.0
        if starts[before] < starts[before + 1]:
            share_before = 1.0 - keys[starts[before + 1] - 1]
        if starts[after] < starts[after + 1]:
            share_after = keys[starts[after]]
        if not _corner_is_clear(edges, e, share_before, keys[first], margin):
            return False
        if not _corner_is_clear(edges, after, 1.0 - keys[last - 1], share_after, margin):
            return False
    return True


@merged
def _is_apart(points: Int32Array, x: FloatArray, y: FloatArray, a: int, b: int, c: int, d: int, square: float) -> bool:
    """Return whether edges ab and cd are proven not to meet, even if each end moves by a part of the margin (module
    docstring). a, b, c, d: indices into x and y; where ``points`` has equal numbers at two of them, they are a shared
    end, at which the edges must not fold onto each other. square: the margin, squared."""
    if points[a] == points[d]:
        c, d = d, c
    elif points[b] == points[c]:
        a, b = b, a
    elif points[b] == points[d]:
        a, b, c, d = b, a, d, c
    elif points[a] != points[c]:
        return segments_are_far(x, y, a, b, c, d, square)
    if points[b] == points[d]:  # one edge, of two parts
        return True
    return is_far(x[b], y[b], x[c], y[c], x[d], y[d], square) and is_far(x[d], y[d], x[a], y[a], x[b], y[b], square)


@inline
def has_straight_point(rings: Rings, n_rings: int, rounded: Rounded, stop: FlagArray) -> bool:
    """Return whether rounding made a point of the n_rings rings collinear with both neighbours in its ring; points
    where rings meet, and RUN edges, are exempt. True also if ``stop`` is set."""
    x, y, moved = rounded.x, rounded.y, rounded.moved
    for ring in range(n_rings):
        first, last = rings.offset[ring], rings.offset[ring + 1]
        i, j = last - 2, last - 1
        for k in range(first, last):
            if k & POLL == 0 and stop[0]:
                return True
            if (moved[i] | moved[j] | moved[k]) and not rings.meets[j] & (MEETS | RUN):
                turn = orient2d(Point2(x[i], y[i]), Point2(x[j], y[j]), Point2(x[k], y[k]))
                if turn == 0 or turn == UNDECIDED:
                    return True
            i, j = j, k
    return False


@inline
def certify(
    rings: Rings, n_rings: int, n: int, rounded: Rounded, tree: BoxTree, tails: Int32Array, heads: Int32Array,
    stop: FlagArray,
) -> bool:  # fmt: skip
    """Return whether floats prove the rounded rings valid: no two edges without a common point are within MARGIN of
    each other, and none folds onto its neighbour. n: number of points in ``rings``; tree, tails, heads: scratch of that
    size. Edges marked RUN are not tested: nothing that moves is near them. False also if ``stop`` is set."""
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
            if rings.meets[k] & RUN:
                continue
            j = k + 1 if k + 1 < last else first
            tails[n_edges], heads[n_edges], tree.marks[n_edges] = k, j, ANYWHERE
            boxes[n_edges, 0], boxes[n_edges, 1] = min(x[k], x[j]) - margin, max(x[k], x[j]) + margin
            boxes[n_edges, 2], boxes[n_edges, 3] = min(y[k], y[j]) - margin, max(y[k], y[j]) + margin
            n_edges += 1
    if n_edges > FEW:
        build_tree(tree, n_edges, stop)
    depth = begin_pairs(tree)
    while depth > 0:  # bound: the walk through the tree
        if stop[0]:
            return False
        n_pairs, depth = next_pairs(tree, n_edges, depth)
        for k in range(n_pairs):
            i, j = pairs[k, 0], pairs[k, 1]
            a, b, c, d = tails[i], heads[i], tails[j], heads[j]
            if (moved[a] | moved[b] | moved[c] | moved[d]) and not _is_apart(rings.point, x, y, a, b, c, d, square):
                return False
    return True
