"""Where two polygons meet without common area (shared border lines, single points); and the lines and points to which
rounding collapses a common area.

A common point belongs to the common area, or lies on a line between both polygons, or is isolated. All is derived from
one exact arrangement, whose parts are what lies in the first polygon alone, in the second alone, and in both:

    .-------a-------.       From a to b runs an edge of both parts, in opposite directions: a line.
    |       |   2   |       c is a vertex of both, on no line, and not of the third part: a point.
    |   1   b---.   |
    |      /  .-'   |
    |     .--c------'
    '-------'
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.compiled.loading import RingArrays
from engine.polygon_overlay.in_integers import parts_exactly
from engine.polygon_overlay.pair_arrays import (
    PairResults,
    PolygonSelection,
    concatenate_offsets,
    places_of,
    ring_of_vertices,
    take_pairs,
)
from engine.polygon_overlay.run import EACH_PART, run_kernel
from engine.running.budget import Budget
from engine.running.parallel import run_chunks
from engine.solids.ragged import next_in_rings, summed
from engine.types import OPEN, BoolArray, FloatArray, IntArray

_FIRST: Final = 1
_SECOND: Final = 2
_BOTH: Final = 3
_OF_A_CROSSING: Final = 3
"""Number of parts that meet where exactly two edges cross."""
_BLOCK: Final = 1024
"""Pairs evaluated together: the overhead of numpy's calls is that of some hundred pairs."""


class Touching(NamedTuple):
    """Lines and points at which many pairs of polygons touch. lines, points: by line and by point the number of its
    pair. vertices (n, 2) float64: of all lines, polyline after polyline; offsets: of lines into them; places:
    (n_points, 2) float64."""

    lines: IntArray
    vertices: FloatArray
    offsets: IntArray
    points: IntArray
    places: FloatArray


NOWHERE: Final = Touching(
    np.zeros(0, np.int64), np.zeros((0, 2)), np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros((0, 2))
)


def touching(
    firsts: PolygonSelection, seconds: PolygonSelection, budget: Budget, workers: int | None = None
) -> Touching:
    """Return where pairs of polygons, firsts[k] and seconds[k], each even-odd, meet without common area.

    Boundary, degenerate input: polygons are closed sets, the closure of their interior: spikes, rings without area and
    walls between parts are ignored. A line bends where the border does, and ends where lines meet.
    Accuracy: decisions exact. Coordinates are those of the input; self-intersections are the nearest doubles.
    Cost: as `overlay_batch`; for pairs whose rounded rings are doubtful some 10 us per edge more.
    """
    by_block: dict[int, Touching] = {}

    def task(first_block: int, last_block: int) -> None:
        start, stop = first_block * _BLOCK, min(last_block * _BLOCK, len(firsts))
        some, others = firsts[start:stop], seconds[start:stop]
        arranged = run_kernel(some.arrays(), others.arrays(), EACH_PART, budget)
        may_touch, is_done = _may_touch(arranged), arranged.status == PairStatus.DONE
        done = np.flatnonzero(may_touch & is_done)
        parts = arranged.evidence[places_of(summed(arranged.counts[:, 1]), done), 1]
        pairs = np.repeat(start + done, arranged.counts[done, 1])
        arranged = take_pairs(arranged, done)
        read = [_extract(arranged, parts, pairs, _number_places(arranged, pairs))]
        for pair in np.flatnonzero(may_touch & ~is_done).tolist():
            first, second = (each[pair : pair + 1].arrays() for each in (some, others))
            alone, places = parts_exactly(RingArrays(*first[:2]), RingArrays(*second[:2]), budget)
            parts = alone.evidence[:, 1]
            read.append(_extract(alone, parts, np.full(len(parts), start + pair), places))
        by_block[start] = concatenate_touching(read)

    run_chunks(task, -(-len(firsts) // _BLOCK), budget=budget, first_chunk=1, workers=workers)
    return concatenate_touching([NOWHERE, *(by_block[start] for start in sorted(by_block))])


def _may_touch(arranged: PairResults) -> BoolArray:
    """Return, by pair, False if it provably has no common line or isolated point. arranged: the pairs with parts 1
    (first alone), 2 (second alone), 3 (both).

    False where floats prove every sign and edges cross only in pairs of one each. At such a crossing the same two edges
    are sources of three boundary vertices, in three of the four wedges. Otherwise a third edge passes, and a pair of
    edges occurs at most twice; or, where so many edges pass that opposite wedges are in one part, an even number of
    times.
    """
    pairs = np.repeat(np.arange(len(arranged.status)), arranged.counts[:, 2])
    is_crossing = arranged.sources[:, 1] >= 0
    pairs, edges = pairs[is_crossing], np.sort(arranged.sources[is_crossing], axis=1).astype(np.int64)
    n = int(edges.max(initial=0)) + 1
    _, places, times = np.unique((n * pairs + edges[:, 0]) * n + edges[:, 1], return_inverse=True, return_counts=True)
    may_touch = (arranged.status == OPEN) | (arranged.counts[:, 3] > 0)
    may_touch[pairs[times[places] != _OF_A_CROSSING]] = True
    return may_touch


def _number_places(arranged: PairResults, pairs: IntArray) -> IntArray:
    """Return, by vertex, a number that is equal for vertices at one point of one pair. pairs: by ring its pair. Valid
    rounded rings have no two exact points with the same doubles."""
    keys = *arranged.vertices.T, np.repeat(pairs, np.diff(arranged.ring_offsets))
    order = np.lexsort(keys)
    is_new = np.zeros(len(order), np.bool_)
    for key in keys:
        in_order = key[order]
        is_new[1:] |= in_order[1:] != in_order[:-1]
    numbers = np.empty(len(order), np.int64)
    numbers[order] = np.cumsum(is_new)
    return numbers


def _extract(arranged: PairResults, parts: IntArray, pairs: IntArray, places: IntArray) -> Touching:
    """Return the lines and points at which two polygons touch, from their arranged rings. parts, pairs: by ring its
    part (1: first alone, 2: second alone, 3: both) and its pair; places: by vertex the number of its point."""
    rings, after = ring_of_vertices(arranged.ring_offsets), next_in_rings(arranged.ring_offsets)
    n_places = int(places.max(initial=0)) + 1
    part = parts[rings]
    is_in = [np.bincount(places[part == k], minlength=n_places)[places] > 0 for k in (_SECOND, _BOTH)]
    there, back = n_places * places + places[after], n_places * places[after] + places
    is_line = (part == _FIRST) & np.isin(there, back[part == _SECOND])
    n_lines = np.bincount(np.append(places[is_line], places[after[is_line]]), minlength=n_places)[places]
    alone = np.flatnonzero((part == _FIRST) & is_in[0] & ~is_in[1] & (n_lines == 0))
    alone = alone[np.unique(places[alone], return_index=True)[1]]
    edges, starts = _order_lines(arranged.ring_offsets, rings, is_line, n_lines == 2)
    ends = np.append(starts, len(edges))[1:]
    along = np.insert(edges, ends, after[edges[ends - 1]])
    offsets = summed(ends - starts + 1)
    return Touching(
        pairs[rings[edges[starts]]], arranged.vertices[along], offsets, pairs[rings[alone]], arranged.vertices[alone]
    )


def _order_lines(
    offsets: IntArray, rings: IntArray, is_line: BoolArray, goes_on: BoolArray
) -> tuple[IntArray, IntArray]:
    """Return the edges of lines, named by their first vertices, line after line; and the index of the first edge of
    each line. offsets: of rings; rings: by vertex its ring; is_line: by vertex, whether its edge is part of a line;
    goes_on: by vertex, whether exactly two edges of lines meet there."""
    sizes = np.diff(offsets)
    is_head = is_line & ~(is_line[np.arange(len(rings)) - 1] & goes_on)
    firsts = offsets[:-1]
    is_head[firsts] = is_line[firsts] & ~(is_line[offsets[1:] - 1] & goes_on[firsts])
    heads = np.flatnonzero(is_head)[::-1]
    begins = firsts.copy()
    begins[rings[heads]] = heads  # of each ring its first head, written last
    is_head[begins] |= is_line[begins]  # case: a line all around its ring
    edges = np.flatnonzero(is_line)
    turned = (edges - begins[rings[edges]]) % sizes[rings[edges]]
    edges = edges[np.lexsort((turned, rings[edges]))]
    return edges, np.flatnonzero(is_head[edges])


def concatenate_touching(parts: list[Touching]) -> Touching:
    """Concatenate the lines and points of all parts."""
    lines, vertices, offsets, points, places = zip(*parts)
    return Touching(
        np.concatenate(lines), np.concatenate(vertices), concatenate_offsets(offsets), np.concatenate(points),
        np.concatenate(places),
    )  # fmt: skip


Place = tuple[float, float]


def collapsed(rings: Iterable[tuple[int, list[Place]]], budget: Budget) -> Touching:
    """Return the lines and points to which rounding collapsed closed rings, given as (pair, vertices). A ring whose
    vertices are all equal is a point; of others the edges, split at vertices of the ring that lie on them, each taken
    once, are joined to lines."""
    lines: list[tuple[int, list[Place]]] = []
    points: list[tuple[int, Place]] = []
    for pair, ring in rings:
        edges = _node_ring(ring, budget)
        lines += [(pair, line) for line in join_edges(edges)]
        points += [] if edges else [(pair, ring[0])]
    return Touching(
        np.array([pair for pair, _ in lines], np.int64),
        np.array([place for _, line in lines for place in line]).reshape(-1, 2),
        summed([len(line) for _, line in lines]),
        np.array([pair for pair, _ in points], np.int64),
        np.array([place for _, place in points]).reshape(-1, 2),
    )


def _node_ring(ring: list[Place], budget: Budget) -> list[tuple[Place, Place]]:
    """Return the edges of a ring, split at its vertices that lie on them (exact), once each, as sorted pairs."""
    places = np.array(sorted(set(ring)))
    edges: set[tuple[Place, Place]] = set()
    for start, end in zip(ring, ring[1:] + ring[:1]):
        budget.check()
        (a, b), (c, d) = sorted([start, end])
        near = places[((places >= (a, min(b, d))) & (places <= (c, max(b, d)))).all(axis=1)]
        width, height = Fraction(c) - Fraction(a), Fraction(d) - Fraction(b)
        on_edge = [
            (x, y)
            for x, y in near.tolist()
            if width * (Fraction(y) - Fraction(b)) == height * (Fraction(x) - Fraction(a))
        ]
        edges.update(pairwise(on_edge))
    return sorted(edges)


def join_edges(edges: list[tuple[Place, Place]]) -> list[list[Place]]:
    """Return the polylines of edges (pairs of points) that are joined at each point where exactly two meet."""
    neighbours: dict[Place, list[Place]] = {}
    for start, end in edges:
        neighbours.setdefault(start, []).append(end)
        neighbours.setdefault(end, []).append(start)
    ends = dict.fromkeys(place for place, others in neighbours.items() if len(others) != 2)
    chains = []
    for start in [*ends, *neighbours]:  # those from an end first: what is left are closed lines
        while neighbours[start]:
            line = [start]
            while neighbours[line[-1]] and (len(line) == 1 or line[-1] not in ends):  # bound: takes an edge each time
                after = neighbours[line[-1]].pop()
                neighbours[after].remove(line[-1])
                line.append(after)
            chains.append(line)
    return chains
