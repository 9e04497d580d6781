r"""Exact planar arrangement of segments (noding), and snap rounding of rings.

    input          result       Pairs of segments whose boxes intersect (exact for floats, conservative for rationals)
      \  /           \ /        pass a float filter for certain misses; the rest is decided in integers. A crossing
    ---\/----     ----+----     becomes a node; equal nodes are one, so segments through one point meet in one node, and
       /\            / \        collinear segments that overlap share the edges between their nodes.

The filter. For two segments ab and cd four orientations decide, each with the bound of predicates/orientation.py, many
pairs at once. Overflow gives inf or NaN, and both comparisons with the bound then fail: UNDECIDED.

Classical snap rounding: every vertex to a lattice point, every edge through the hot pixels that it passes.

A pixel is the half-open square of one lattice spacing about a lattice point; it is hot if a vertex lies in it. An edge
is replaced by the chain of centres of the hot pixels it passes, in that order. Edges that met in vertices only then
meet in vertices only again (or coincide), and no edge moves by more than half a pixel's diagonal. So the result needs
no further rounding, unlike the finer iteration (round, arrange again, round, ...).

Source: J. D. Hobby, Practical segment intersection with finite precision output, 1999; L. J. Guibas and D. H. Marimont,
Rounding arrangements dynamically, 1998.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cmp_to_key
from itertools import pairwise
from math import floor, lcm, ldexp
from typing import Any, Final

import numpy as np

from engine.arrangement.nodes import Homogeneous, NodeTable, float_nodes, reduced
from engine.bounding.box_grid import all_pairs_of_boxes as pairs_of_boxes
from engine.predicates.orientation import BOUND_2D, GUARD_2D
from engine.predicates.rational import cross
from engine.running.budget import Budget
from engine.types import UNDECIDED, FloatArray, Int8Array, IntArray

Line = tuple[int, int, int]
"""(a, b, c): a x + b y + c w > 0 for points (x, y, w) left of the directed line; its direction is (b, -a)."""

_CHUNK: Final = 1 << 14  # pairs of one step: 3 ms, and temporaries stay in cache

MISS: Final = 0
CROSS: Final = 1
_POLL = 64  # exact steps of some microseconds between two polls


@dataclass(frozen=True, slots=True)
class Arrangement:
    """Edges that meet in their ends only.

    | field | by | meaning |
    | --- | --- | --- |
    | nodes | - | all points; some may belong to no edge |
    | tails, heads | edge | its ends; the tail is lexicographically smaller (x, then y) |
    | lines | edge | the line through it, directed from tail to head |
    | masks | edge | exclusive or of the masks (bits, or frozen sets) of all input segments that contain it |
    | cover | edge | inclusive or of these masks |
    | n_exact | - | number of pairs of segments decided in integers |
    """

    nodes: NodeTable
    tails: list[int]
    heads: list[int]
    lines: list[Line]
    masks: list[Any]
    cover: list[Any]
    n_exact: int

    def origin(self, half_edge: int) -> int:
        """Return the node where a half-edge begins: half-edge 2 e runs from tail to head of edge e, 2 e + 1 from head
        to tail."""
        return (self.heads if half_edge & 1 else self.tails)[half_edge >> 1]


line_through = cross
"""line_through(a, b): the line through two distinct points, directed from a to b."""


def side(line: Line, point: Homogeneous) -> int:
    """Return 1 if `point` is left of `line`, 0 if on it, -1 if right of it."""
    value = line[0] * point[0] + line[1] * point[1] + line[2] * point[2]
    return (value > 0) - (value < 0)


def crossing(first: Line, second: Line) -> Homogeneous:
    """Return the intersection point of two lines that are not parallel."""
    return reduced(*cross(first, second))


def arrange(
    nodes: NodeTable, segments: Sequence[tuple[int, int]], masks: Sequence[Any], budget: Budget | None = None
) -> Arrangement:
    """Return the arrangement of `segments`, pairs of node numbers; the nodes of crossings are added to `nodes`. masks:
    of each segment the set of sources that it bounds, as the bits of an integer or a frozenset. Segments of zero length
    are left out. Cost: the sweep over boxes, 5 us a crossing, 10 us a pair that the filter leaves open."""
    budget = budget or Budget()
    merged: dict[tuple[int, int], list[Any]] = {}
    for count, ((start, end), mask) in enumerate(zip(segments, masks)):
        if count % _POLL == 0:
            budget.check()
        if start != end:
            key = (start, end) if nodes.compare(start, end) < 0 else (end, start)
            known = merged.get(key)
            merged[key] = [mask, mask] if known is None else [known[0] ^ mask, known[1] | mask]
    ends = list(merged)
    lines: list[Line] = []
    for count, (tail, head) in enumerate(ends):
        if count % _POLL == 0:
            budget.check()
        lines.append(line_through(nodes.points[tail], nodes.points[head]))
    on_segment, n_exact = _intersect_all(nodes, ends, lines, budget)
    return _split(nodes, ends, lines, list(merged.values()), on_segment, n_exact, budget)


def _intersect_all(
    nodes: NodeTable, ends: list[tuple[int, int]], lines: list[Line], budget: Budget
) -> tuple[dict[int, set[int]], int]:
    """Return, by number of a segment, the set of nodes in its interior where it meets others (segments without any have
    no entry), and the number of pairs decided in integers. ends: the two nodes of each segment, smaller first; lines:
    the line through them. Crossings are added to `nodes`."""
    on_segment: dict[int, set[int]] = {}
    if not ends:
        return on_segment, 0
    array = np.array(ends, np.int64)
    coordinates = np.column_stack([nodes.xs, nodes.ys])
    first, second = coordinates[array[:, 0]], coordinates[array[:, 1]]
    pairs = pairs_of_boxes(np.minimum(first, second), np.maximum(first, second), budget)
    all_floats, n_exact = nodes.all_floats, 0
    for start in range(0, len(pairs), _CHUNK):
        budget.check()
        some = pairs[start : start + _CHUNK]
        verdicts = np.full(len(some), UNDECIDED, np.int8)
        if all_floats:
            verdicts = classify_pairs(coordinates, array, some)
            some, verdicts = some[verdicts != MISS], verdicts[verdicts != MISS]
        for count, (i, j, verdict) in enumerate(zip(*some.T.tolist(), verdicts.tolist())):
            if count % _POLL == 0:
                budget.check()
            if verdict == CROSS:
                number = nodes.add(crossing(lines[i], lines[j]))
                on_segment.setdefault(i, set()).add(number)
                on_segment.setdefault(j, set()).add(number)
            else:
                n_exact += 1
                _intersect_pair(nodes, ends, lines, i, j, on_segment)
    return on_segment, n_exact


def _orientation(a: FloatArray, b: FloatArray, c: FloatArray) -> Int8Array:
    """Return the signs of orient2d(a, b, c) for the rows of three arrays (n, 2), UNDECIDED where the error bound does
    not prove the sign."""
    left = (a[:, 0] - c[:, 0]) * (b[:, 1] - c[:, 1])
    right = (a[:, 1] - c[:, 1]) * (b[:, 0] - c[:, 0])
    turn = left - right
    bound = BOUND_2D * (np.abs(left) + np.abs(right)) + GUARD_2D
    sign = np.full(len(turn), UNDECIDED, np.int8)
    sign[turn > bound] = 1
    sign[turn < -bound] = -1
    return sign


def classify_pairs(coordinates: FloatArray, segments: IntArray, pairs: IntArray) -> Int8Array:
    """Return for each pair of segments MISS, CROSS (one common point, interior to both) or UNDECIDED. coordinates:
    (n_nodes, 2) float64, exact. segments: (n_segments, 2) int64 nodes. pairs: (n_pairs, 2) int64 segments. Segments
    that share an end and are proven not collinear are a MISS: that end is their only common point.
    """
    first, second = segments[pairs.T]
    a, b, c, d = (coordinates[nodes] for nodes in (first[:, 0], first[:, 1], second[:, 0], second[:, 1]))
    with np.errstate(all="ignore"):
        sides = [_orientation(a, b, c), _orientation(a, b, d), _orientation(c, d, a), _orientation(c, d, b)]
    is_decided = [side != UNDECIDED for side in sides]
    shared = (first[:, :, None] == second[:, None, :]).any(axis=(1, 2))
    one_sided = (is_decided[0] & (sides[0] == sides[1])) | (is_decided[2] & (sides[2] == sides[3]))
    bent = shared & (is_decided[0] | is_decided[1] | is_decided[2] | is_decided[3])
    straddle = is_decided[0] & is_decided[1] & is_decided[2] & is_decided[3] & ~shared
    straddle &= (sides[0] != sides[1]) & (sides[2] != sides[3])
    result = np.full(len(pairs), UNDECIDED, np.int8)
    result[straddle] = CROSS
    result[one_sided | bent] = MISS
    return result


def _intersect_pair(
    nodes: NodeTable, ends: list[tuple[int, int]], lines: list[Line], i: int, j: int, on_segment: dict[int, set[int]]
) -> None:
    """Add to on_segment[i] the nodes in the interior of segment i that lie on segment j too, and vice versa; exact.
    ends, lines: of all segments, as in `_intersect_all`. A crossing becomes a new node."""
    points, (a, b), (c, d) = nodes.points, ends[i], ends[j]
    line_i, line_j = lines[i], lines[j]
    side_c, side_d = side(line_i, points[c]), side(line_i, points[d])
    if side_c == side_d != 0:
        return
    if side_c == 0 == side_d:  # case: collinear; an end of one may lie inside the other
        for segment, (tail, head), others in ((i, (a, b), (c, d)), (j, (c, d), (a, b))):
            for number in others:
                if nodes.compare(tail, number) < 0 < nodes.compare(head, number):
                    on_segment.setdefault(segment, set()).add(number)
        return
    side_a, side_b = side(line_j, points[a]), side(line_j, points[b])
    if side_a == side_b:  # not collinear, so both are on one side
        return
    # The lines meet in one point, and it lies in both closed segments. Where an end of one segment is on the other's
    # line, that end is the point.
    if side_c == 0 or side_d == 0:
        number = c if side_c == 0 else d
    elif side_a == 0 or side_b == 0:
        number = a if side_a == 0 else b
    else:
        number = nodes.add(crossing(line_i, line_j))
    for segment, (tail, head) in ((i, (a, b)), (j, (c, d))):
        if number != tail and number != head:
            on_segment.setdefault(segment, set()).add(number)


def _split(
    nodes: NodeTable, ends: list[tuple[int, int]], lines: list[Line], merged: list[list[Any]],
    on_segment: dict[int, set[int]], n_exact: int, budget: Budget,
) -> Arrangement:  # fmt: skip
    """Return the arrangement of distinct segments, each cut into edges at the nodes in its interior; equal edges of
    several segments become one. ends, lines, on_segment, n_exact: as in `_intersect_all`. merged: by segment its
    `masks` and `cover` (see `Arrangement`), which its edges inherit."""
    by_place = cmp_to_key(nodes.compare)
    edges: dict[tuple[int, int], list[Any]] = {}
    carriers: list[Line] = []
    for segment, (tail, head) in enumerate(ends):
        if segment % _POLL == 0:
            budget.check()
        inside = on_segment.get(segment)
        stops = [tail, *(sorted(inside, key=by_place) if inside else ()), head]
        mask, cover = merged[segment]
        for key in pairwise(stops):
            known = edges.get(key)
            if known is None:
                edges[key] = [mask, cover]
                carriers.append(lines[segment])
            else:
                known[0] ^= mask
                known[1] |= cover
    return Arrangement(
        nodes=nodes, tails=[tail for tail, _ in edges], heads=[head for _, head in edges], lines=carriers,
        masks=[mask for mask, _ in edges.values()], cover=[cover for _, cover in edges.values()], n_exact=n_exact,
    )  # fmt: skip


def arrange_rings(
    coordinates: FloatArray, ring_offsets: Sequence[int], ring_masks: Sequence[Any] | None, budget: Budget | None = None
) -> Arrangement:
    """Return the arrangement of closed rings. coordinates: (n_vertices, 2) float64, ring after ring, no first vertex
    repeated. ring_offsets: where each ring begins, and n_vertices last. ring_masks: the set of sources that each ring
    bounds, as in `arrange`; None: the mask of an edge is the frozenset with the number of its first vertex."""
    nodes, numbers = float_nodes(coordinates, budget)
    segments: list[tuple[int, int]] = []
    masks: list[Any] = [] if ring_masks is not None else [frozenset((k,)) for k in range(len(numbers))]
    for ring, (start, stop) in enumerate(pairwise(ring_offsets)):
        own = numbers[start:stop]
        segments += zip(own, own[1:] + own[:1])
        if ring_masks is not None:
            masks += [ring_masks[ring]] * len(own)
    return arrange(nodes, segments, masks, budget)


Point = tuple[Fraction, Fraction]
Pixel = tuple[int, int]

_HALF = Fraction(1, 2)


class _Segment:
    """A segment with integer coordinates: `ends` is ax, ay, bx, by with ax <= bx, in units of 1 / `unit` of the lattice
    spacing."""

    def __init__(self, start: Point, end: Point) -> None:
        (ax, ay), (bx, by) = (start, end) if start[0] <= end[0] else (end, start)
        self.unit = 2 * lcm(ax.denominator, ay.denominator, bx.denominator, by.denominator)
        self.ends = [value.numerator * (self.unit // value.denominator) for value in (ax, ay, bx, by)]

    def passes(self, pixel: Pixel) -> bool:
        """Return whether the segment meets the half-open pixel about a lattice point: their boxes meet, and the pixel
        has corners on both sides of the segment's line."""
        ax, ay, bx, by = self.ends
        left, low = ((2 * centre - 1) * (self.unit // 2) for centre in pixel)
        right, high = left + self.unit, low + self.unit
        if not (bx >= left and ax < right and max(ay, by) >= low and min(ay, by) < high):
            return False
        if ax == bx or ay == by:
            return True

        def turn(x: int, y: int) -> int:
            return (bx - ax) * (y - ay) - (by - ay) * (x - ax)

        return turn(left, high) > 0 > turn(right, low) if by > ay else turn(left, low) <= 0 < turn(right, high)


def snap_rings(
    rings: Sequence[Sequence[Point]], spacing_exponent: int, budget: Budget | None = None
) -> tuple[list[list[tuple[float, float]]], list[int]]:
    """Return rings snapped to the lattice of spacing ``2**spacing_exponent``, and by vertex the input edge it starts.

    The second list has, for each vertex of the result, the index of the input vertex (over all ``rings``) whose edge
    the ring follows from there. Repeated vertices are left out; a ring may shrink to fewer than three. rings: exact
    vertices; edges meet only in vertices. Every coordinate must be below ``2**53`` spacings, so that lattice points are
    doubles.
    """
    budget = budget or Budget()
    unit = Fraction(2) ** spacing_exponent
    scaled = [[(x / unit, y / unit) for x, y in ring] for ring in rings]
    pixels = [[(floor(x + _HALF), floor(y + _HALF)) for x, y in ring] for ring in scaled]
    hot = sorted({pixel for ring in pixels for pixel in ring})
    centres = np.array(hot, np.float64).reshape(-1, 2)
    result, edges, edge = [], [], -1
    for ring, own in zip(scaled, pixels):
        chain: list[Pixel] = []
        along: list[int] = []
        for start, end, first, last in zip(ring, [*ring[1:], *ring[:1]], own, [*own[1:], *own[:1]]):
            budget.check()
            edge, segment = edge + 1, _Segment(start, end)
            near = [hot[number] for number in _candidates(hot, centres, start, end)]
            passed = [pixel for pixel in near if pixel not in (first, last) and segment.passes(pixel)]
            ways = [(b > a) - (b < a) for a, b in zip(start, end)]  # order: it never goes back to the left, or down
            passed.sort(key=lambda pixel: ways[0] * pixel[0] + ways[1] * pixel[1])
            for pixel in (first, *passed, last):
                if not chain or chain[-1] != pixel:
                    chain.append(pixel)
                    along.append(edge)
                along[-1] = edge
        while len(chain) > 1 and chain[0] == chain[-1]:
            chain.pop()
        result.append([(ldexp(x, spacing_exponent), ldexp(y, spacing_exponent)) for x, y in chain])
        edges += along[: len(chain)]
    return result, edges


def _candidates(hot: Sequence[Pixel], centres: np.ndarray, start: Point, end: Point) -> list[int]:
    """Return the indices in `hot` of the pixels that the segment from start to end may pass, with some that it does
    not. hot: the centres of hot pixels, sorted, in units of the spacing; centres: the same as a float64 array (n, 2).
    """
    (x0, x1), (y0, y1) = (sorted((floor(a), floor(b))) for a, b in zip(start, end))
    first, last = bisect_left(hot, (x0 - 1, y0 - 1)), bisect_left(hot, (x1 + 2, y1 + 3))
    a, b = np.array(start, np.float64), np.array(end, np.float64)
    # bound: below 2**53 the rounded ends are off by at most 1/2, so differences by at most 1 1/2.
    among = centres[first:last]
    near = np.flatnonzero((among[:, 1] >= y0 - 1) & (among[:, 1] <= y1 + 2))
    along, offset = b - a, among[near] - a
    distance = np.abs(along[0] * offset[:, 1] - along[1] * offset[:, 0])
    reach = 4 * (np.abs(along).sum() + np.abs(offset).sum(axis=1) + 1) * (1 + 2.0**-40)
    # rounding of the two products: 2**-50 of their size is more than enough.
    reach += 2.0**-50 * (np.abs(along[0] * offset[:, 1]) + np.abs(along[1] * offset[:, 0]))
    return (first + near[distance <= reach]).tolist()
