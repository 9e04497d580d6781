"""Where two polygons meet without common area: the stretches of border that they share, and single points; and the
lines and points to which rounding collapses an area that they share.

A point of both belongs to their common area, or lies on a line that has one polygon on one side and the other on the
other, or stands alone. All is read from one exact arrangement, whose parts are what lies in the first polygon alone, in
the second alone, and in both:

    .-------a-------.       From a to b runs an edge of both parts, in either direction: a line.
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
from engine.polygon_overlay.pair_arrays import Chosen, Found, chained, places_of, ring_numbers, taken
from engine.polygon_overlay.run import EACH_PART, run_kernel
from engine.running.budget import Budget
from engine.running.parallel import run_chunks
from engine.solids.ragged import next_in_rings, summed
from engine.types import OPEN, BoolArray, FloatArray, IntArray

_FIRST: Final = 1
_SECOND: Final = 2
_BOTH: Final = 3
_OF_A_CROSSING: Final = 3
"""Parts that meet where two edges cross."""
_BLOCK: Final = 1024
"""Pairs that are read together: numpy's calls take as long as some hundred of them."""


class Touching(NamedTuple):
    """Lines and points of some pairs. lines, points: the pair of each. vertices (n, 2) float64 of all lines,
    one after another; offsets of each into them; places (n_points, 2) float64."""

    lines: IntArray
    vertices: FloatArray
    offsets: IntArray
    points: IntArray
    places: FloatArray


_NOWHERE: Final = Touching(
    np.zeros(0, np.int64), np.zeros((0, 2)), np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros((0, 2))
)


def touching(firsts: Chosen, seconds: Chosen, budget: Budget, workers: int | None = None) -> Touching:
    """Return where pairs of polygons, firsts[k] and seconds[k], each even-odd, meet without common area.

    Boundary, degenerate input: polygons are closed sets, the closure of their interior: spikes and rings without area
    are not there, walls between parts are not seen. A line bends where the border does, and ends where lines meet.
    Accuracy: decisions exact. Coordinates are those of the input, but for places where a polygon crosses itself: the
    nearest doubles.
    Cost: as `overlay_batch`; of pairs whose rounded rings need another look, some 10 us per edge more.
    """
    found: dict[int, Touching] = {}

    def task(first_block: int, last_block: int) -> None:
        start, stop = first_block * _BLOCK, min(last_block * _BLOCK, len(firsts))
        some, others = firsts[start:stop], seconds[start:stop]
        arranged = run_kernel(some.together(), others.together(), EACH_PART, budget)
        may_touch, is_done = _may_touch(arranged), arranged.status == PairStatus.DONE
        done = np.flatnonzero(may_touch & is_done)
        parts = arranged.evidence[places_of(summed(arranged.counts[:, 1]), done), 1]
        pairs = np.repeat(start + done, arranged.counts[done, 1])
        arranged = taken(arranged, done)
        read = [_read(arranged, parts, pairs, _numbered(arranged, pairs))]
        for pair in np.flatnonzero(may_touch & ~is_done).tolist():
            first, second = (each[pair : pair + 1].together() for each in (some, others))
            alone, places = parts_exactly(RingArrays(*first[:2]), RingArrays(*second[:2]), budget)
            parts = alone.evidence[:, 1]
            read.append(_read(alone, parts, np.full(len(parts), start + pair), places))
        found[start] = joined_touching(read)

    run_chunks(task, -(-len(firsts) // _BLOCK), budget=budget, first_chunk=1, workers=workers)
    return joined_touching([_NOWHERE, *(found[start] for start in sorted(found))])


def _may_touch(found: Found) -> BoolArray:
    """Tell of pairs whether they may meet without common area: surely not where floats tell every sign, and no edges
    cross but two at a time, one of each polygon.

    Of four wedges round such a crossing three are in parts: two edges are named there three times. Else either a third
    edge is named, twice at most; or, where as many edges pass that wedges opposite each other are in one part, any two
    are named an even number of times.
    """
    pairs = np.repeat(np.arange(len(found.status)), found.counts[:, 2])
    is_crossing = found.sources[:, 1] >= 0
    pairs, edges = pairs[is_crossing], np.sort(found.sources[is_crossing], axis=1).astype(np.int64)
    n = int(edges.max(initial=0)) + 1
    _, places, times = np.unique((n * pairs + edges[:, 0]) * n + edges[:, 1], return_inverse=True, return_counts=True)
    may_touch = (found.status == OPEN) | (found.counts[:, 3] > 0)
    may_touch[pairs[times[places] != _OF_A_CROSSING]] = True
    return may_touch


def _numbered(found: Found, pairs: IntArray) -> IntArray:
    """Return of each vertex the number of its place in its pair; pairs: by ring.

    Rings that are valid once rounded have no two places in one.
    """
    keys = *found.vertices.T, np.repeat(pairs, np.diff(found.ring_offsets))
    order = np.lexsort(keys)
    is_new = np.zeros(len(order), np.bool_)
    for key in keys:
        in_order = key[order]
        is_new[1:] |= in_order[1:] != in_order[:-1]
    numbers = np.empty(len(order), np.int64)
    numbers[order] = np.cumsum(is_new)
    return numbers


def _read(found: Found, parts: IntArray, pairs: IntArray, places: IntArray) -> Touching:
    """Return the lines and points of rings; parts, pairs: by ring; places: by vertex the number of its place."""
    rings, after = ring_numbers(found.ring_offsets), next_in_rings(found.ring_offsets)
    n_places = int(places.max(initial=0)) + 1
    part = parts[rings]
    is_in = [np.bincount(places[part == k], minlength=n_places)[places] > 0 for k in (_SECOND, _BOTH)]
    there, back = n_places * places + places[after], n_places * places[after] + places
    is_line = (part == _FIRST) & np.isin(there, back[part == _SECOND])
    n_lines = np.bincount(np.append(places[is_line], places[after[is_line]]), minlength=n_places)[places]
    alone = np.flatnonzero((part == _FIRST) & is_in[0] & ~is_in[1] & (n_lines == 0))
    alone = alone[np.unique(places[alone], return_index=True)[1]]
    edges, starts = _in_line(found.ring_offsets, rings, is_line, n_lines == 2)
    ends = np.append(starts, len(edges))[1:]
    along = np.insert(edges, ends, after[edges[ends - 1]])
    offsets = summed(ends - starts + 1)
    return Touching(
        pairs[rings[edges[starts]]], found.vertices[along], offsets, pairs[rings[alone]], found.vertices[alone]
    )


def _in_line(offsets: IntArray, rings: IntArray, is_line: BoolArray, goes_on: BoolArray) -> tuple[IntArray, IntArray]:
    """Return the edges of lines, by their first vertices, one line after another, and where each line begins.

    goes_on: by vertex whether no more than two edges of lines meet there.
    """
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


def joined_touching(parts: list[Touching]) -> Touching:
    """Return the lines and points of some pairs, those of one part after another's."""
    lines, vertices, offsets, points, places = zip(*parts)
    return Touching(
        np.concatenate(lines), np.concatenate(vertices), chained(offsets), np.concatenate(points),
        np.concatenate(places),
    )  # fmt: skip


Place = tuple[float, float]


def collapsed(rings: Iterable[tuple[int, list[Place]]], budget: Budget) -> Touching:
    """Return the lines and points that are left of closed rings, each with its pair, that rounding left no area.

    A ring that is one place is a point; else its edges, split where another vertex lies on them, each once, joined to
    lines that bend where edges do and end where lines meet.
    """
    lines: list[tuple[int, list[Place]]] = []
    points: list[tuple[int, Place]] = []
    for pair, ring in rings:
        edges = _noded(ring, budget)
        lines += [(pair, line) for line in _joined_edges(edges)]
        points += [] if edges else [(pair, ring[0])]
    return Touching(
        np.array([pair for pair, _ in lines], np.int64),
        np.array([place for _, line in lines for place in line]).reshape(-1, 2),
        summed([len(line) for _, line in lines]),
        np.array([pair for pair, _ in points], np.int64),
        np.array([place for _, place in points]).reshape(-1, 2),
    )


def _noded(ring: list[Place], budget: Budget) -> list[tuple[Place, Place]]:
    """Return the edges of a ring between neighbouring vertices, decided exactly, each once and in order."""
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


def _joined_edges(edges: list[tuple[Place, Place]]) -> list[list[Place]]:
    """Return edges joined wherever two of them meet and no other."""
    beside: dict[Place, list[Place]] = {}
    for start, end in edges:
        beside.setdefault(start, []).append(end)
        beside.setdefault(end, []).append(start)
    ends = dict.fromkeys(place for place, others in beside.items() if len(others) != 2)
    chains = []
    for start in [*ends, *beside]:  # those from an end first: what is left are closed lines
        while beside[start]:
            line = [start]
            while beside[line[-1]] and (len(line) == 1 or line[-1] not in ends):  # bound: takes an edge each time
                after = beside[line[-1]].pop()
                beside[after].remove(line[-1])
                line.append(after)
            chains.append(line)
    return chains
