r"""The union of many polygons by stripes of the plane, side by side on threads.

    stripe 0 | stripe 1 | stripe 2       Within a stripe the union of all polygons is that of the polygons that meet it.
     ___     |          |  ___           So each stripe is arranged alone, and what lies in it is kept: whole rings, and
    /   \____|__________|_/   \          runs of rings that leave it along an edge. A run goes on where the next run in
    \________|__________|_____/          that direction along the edge begins; some stripes are only passed through.

Whatever the kernel decides within a stripe is exact, and a crossing is rounded to the same double in all stripes, so a
vertex is kept by exactly one. Parts of a region in different stripes are one region if a ring that bounds them passes
through both. Rounded rings are proven valid only where all edges are apart by the margin of clearance.py (Rule.PART),
which holds for the whole if it holds in all stripes: edges nearer than that meet a common stripe. Otherwise, and in a
few cases that are rare (a straight or repeated vertex where rings are joined; rings of several stripes that meet, where
a polygon crosses itself), the whole is arranged at once.

The stripes follow from the polygons alone: the result does not depend on the number of threads.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.compiled.loading import LEFT_OUT, RingArrays
from engine.polygon_overlay.compiled.ring_nesting import Nesting, Rule
from engine.polygon_overlay.implicit_rings import NO_RINGS, edges_along, one_polygon
from engine.polygon_overlay.pair_arrays import PairResults, PolygonArrays, one_pair, places_from, places_of
from engine.polygon_overlay.run import BY_VERTEX, SELECTED_ARRAYS, run_kernel
from engine.predicates.orientation import BOUND_2D, GUARD_2D
from engine.running.budget import Budget
from engine.running.joining import join_columns, take_rows
from engine.running.parallel import run_chunks
from engine.solids.ragged import summed
from engine.types import BoolArray, FloatArray, Int32Array, IntArray, read_only

_LEAST: Final = 20_000
_LEAST_IN_ALL: Final = 400_000
"""Vertices of a stripe, and of all polygons, from which stripes cost one thread nothing: their scratch fits the cache.
"""
_MOST: Final = 64
_REPEATED: Final = 1 / 8
"""Most stripes; largest share of vertices in more than one."""
_NEAR: Final = 2.0**-40
"""By how much of the largest coordinate a stripe's polygons may lie beside it: many margins of clearance.py."""
_SECONDS: Final = 300e-9
"""Time of a vertex in the kernel, from which the number of threads is chosen."""
_IN, _THROUGH, _OUT = 0, 1, 2


class _Passages(NamedTuple):
    """Where rings cross the sides of stripes, by passage: the edge, 1 or -1 for the direction along the axis, the
    stripe; _IN, _THROUGH or _OUT; the run that begins or ends there, or the piece whose ring passes through."""

    edge: IntArray
    direction: IntArray
    stripe: IntArray
    kind: IntArray
    number: IntArray


class _Stripe(NamedTuple):
    """What the union has in a stripe. runs: rows (first vertex, one past the last, piece); is_whole: by run, a whole
    ring; is_shell: by run; passages: of the other runs, in their order."""

    vertices: FloatArray
    sources: Int32Array
    runs: IntArray
    is_whole: BoolArray
    is_shell: BoolArray
    passages: _Passages
    n_pieces: int
    displacement: float
    n_exact: int


def union_by_stripes(rings: RingArrays, nesting: Nesting, workers: int | None, budget: Budget) -> PairResults | None:
    """Return the union of sources as `run_kernel` does; None if it is not made by stripes. nesting: under Rule.ANY."""
    n = len(rings.vertices)
    if n < _LEAST_IN_ALL:
        return None
    items = np.append(np.flatnonzero(np.diff(nesting.shells, prepend=-1)), len(rings.offsets) - 1)
    polygons = PolygonArrays(*rings, read_only(items))
    low, high = polygons.boxes(np.arange(len(items) - 1))
    axis = int(np.argmax(high.max(axis=0) - low.min(axis=0)))
    near = _NEAR * max(abs(rings.vertices.min()), abs(rings.vertices.max()))
    low, high = low[:, axis] - near, high[:, axis] + near
    sides = _cuts(low, high, polygons.sizes())
    n_stripes = len(sides) - 1
    if n_stripes < 2:
        return None
    budget.take(BY_VERTEX * n)
    made: dict[int, _Stripe | None] = {}

    def task(first: int, last: int) -> None:
        for k in range(first, last):
            if None not in made.values():  # else the whole is arranged at once
                members = np.flatnonzero((low <= sides[k + 1]) & (high >= sides[k]))
                made[k] = _arrange_stripe(polygons, members, (axis, k, sides[k], sides[k + 1]), budget)

    pace = _SECONDS * n / n_stripes
    run_chunks(task, n_stripes, budget=budget, first_chunk=1, workers=workers, pace=pace)
    stripes = [stripe for k in range(n_stripes) if (stripe := made.get(k)) is not None]
    joined = _join(stripes, budget, workers) if len(stripes) == n_stripes else None
    if joined is None:
        budget.take(-BY_VERTEX * n)  # the whole is charged next
    return joined


def _cuts(low: FloatArray, high: FloatArray, sizes: IntArray) -> FloatArray:
    """Return the sides of stripes that hold about as many vertices each, from -inf to inf. low, high, sizes: of
    polygons, along the axis that stripes divide; those that reach a side are in both stripes."""
    order = np.argsort(low)
    before = np.cumsum(sizes[order])
    n_stripes = min(_MOST, int(before[-1]) // _LEAST)
    while n_stripes > 1:  # bound: it halves
        cuts = np.unique(low[order[np.searchsorted(before, before[-1] * np.arange(1, n_stripes) // n_stripes)]])
        n_repeated = (np.searchsorted(cuts, high, "right") - np.searchsorted(cuts, low)) @ sizes
        if n_repeated <= _REPEATED * before[-1]:
            return np.concatenate([[-np.inf], cuts, [np.inf]])
        n_stripes //= 2
    return np.array([-np.inf, np.inf])


def _arrange_stripe(
    polygons: PolygonArrays, members: IntArray, stripe: tuple[int, int, float, float], budget: Budget
) -> _Stripe | None:
    """Return what the union has in a stripe; None if that is not proven valid. members: the polygons that meet it;
    stripe: its axis, number and sides."""
    axis, number, low, high = stripe
    n_rings, rings = np.diff(polygons.polygon_offsets)[members], places_of(polygons.polygon_offsets, members)
    nesting = Nesting(np.repeat(np.arange(len(members)), n_rings), np.zeros(0), int(Rule.PART))
    own, sizes = places_of(polygons.ring_offsets, rings), np.diff(polygons.ring_offsets)[rings]
    whole = PolygonArrays(read_only(polygons.vertices[own]), summed(sizes), one_polygon(len(rings)))
    made = run_kernel(whole, PolygonArrays(*NO_RINGS, one_polygon(0)), SELECTED_ARRAYS["union"], budget, nesting)
    if made.status[0] != PairStatus.DONE:
        return None
    side = (made.vertices[:, axis] >= high).astype(np.int8) - (made.vertices[:, axis] < low)
    order, offsets = _begin_outside(side != 0, made.ring_offsets)
    side = side[order]
    is_shell = np.zeros(len(offsets) - 1, np.bool_)
    is_shell[made.piece_offsets[:-1]] = True
    piece = np.cumsum(is_shell) - 1
    n_outside = np.add.reduceat(side != 0, offsets[:-1], dtype=np.int64) if len(piece) else np.zeros(0, np.int64)
    whole_rings = np.flatnonzero(n_outside == 0)
    meets = _where_rings_meet(made.sources, np.repeat(nesting.shells, sizes))[order] & (side == 0)
    if meets.any() and meets[np.repeat(n_outside > 0, np.diff(offsets))].any():
        return None

    after = np.arange(1, len(side) + 1)
    after[offsets[1:] - 1] = offsets[:-1]
    passing = np.flatnonzero(side != side[after])
    tail, head = side[passing], side[after[passing]]
    ring = np.searchsorted(offsets, passing, "right") - 1
    begins, ends = passing[head == 0] + 1, passing[tail == 0] + 1
    runs = np.stack([begins, ends, piece[ring[head == 0]]], axis=1)
    kind = np.where(head == 0, _IN, np.where(tail == 0, _OUT, _THROUGH))
    which = np.where(kind == _THROUGH, piece[ring], 0)
    which[kind == _IN] = which[kind == _OUT] = len(whole_rings) + np.arange(len(runs))
    sources = _renumbered(made.sources[order], own)
    passages = _Passages(
        edges_along(sources[passing]), np.sign(head - tail), np.full(len(passing), number), kind, which
    )  # fmt: skip
    return _Stripe(
        made.vertices[order], sources,
        np.concatenate([np.stack([offsets[whole_rings], offsets[whole_rings + 1], piece[whole_rings]], axis=1), runs]),
        np.arange(len(whole_rings) + len(runs)) < len(whole_rings),
        np.append(is_shell[whole_rings], np.zeros(len(runs), np.bool_)), passages, len(made.piece_offsets) - 1,
        float(made.displacement[0]), int(made.counts[0, 3]),
    )  # fmt: skip


def _where_rings_meet(sources: Int32Array, polygon: IntArray) -> BoolArray:
    """Return whether rings meet, by vertex, where all edges are apart by the margin: where a polygon crosses itself, so
    that two opposite quadrants are outside. polygon: by input vertex."""
    first, second = sources.T
    return (second >= 0) & (polygon[first] == polygon[np.maximum(second, 0)])


def _begin_outside(is_outside: BoolArray, offsets: IntArray) -> tuple[IntArray, IntArray]:
    """Return an order of the vertices in which rings with vertices outside begin with one, and the offsets."""
    sizes = np.diff(offsets)
    outside = np.flatnonzero(is_outside)
    first = np.searchsorted(outside, offsets[:-1])
    turned = np.append(outside, 0)[first] - offsets[:-1]
    turned[(first == len(outside)) | (turned >= sizes)] = 0
    return _turned(offsets, turned), offsets


def _turned(offsets: IntArray, turned: IntArray) -> IntArray:
    """Return an order of the vertices of rings in which each begins with its vertex number ``turned``."""
    sizes = np.diff(offsets)
    place = np.arange(offsets[-1]) + np.repeat(turned, sizes)
    return place - np.repeat(sizes, sizes) * (place >= np.repeat(offsets[1:], sizes))


def _renumbered(sources: Int32Array, numbers: IntArray) -> Int32Array:
    """Return sources with vertex k numbered ``numbers[k]``; see `overlay_pairs`."""
    made = np.empty_like(sources)
    made[:, 0] = numbers[sources[:, 0]]
    second = sources[:, 1]
    is_along, named = second < LEFT_OUT, numbers[np.where(second < 0, np.maximum(LEFT_OUT - 1 - second, 0), second)]
    made[:, 1] = np.where(is_along, LEFT_OUT - 1 - named, np.where(second < 0, second, named))
    return made


def _join(stripes: list[_Stripe], budget: Budget, workers: int | None) -> PairResults | None:
    """Return the union from what it has in each stripe; None where that takes more than comparisons of floats."""
    vertices, sources = join_columns([stripe[:2] for stripe in stripes], budget, workers)
    n_vertices, n_runs, n_pieces = (
        summed([each(stripe) for stripe in stripes])
        for each in (lambda s: len(s.vertices), lambda s: len(s.runs), lambda s: s.n_pieces)
    )
    runs = np.concatenate([
        stripe.runs + np.array([start, start, piece]) for stripe, start, piece in zip(stripes, n_vertices, n_pieces)
    ])  # fmt: skip
    is_whole, is_shell = (np.concatenate([stripe[k] for stripe in stripes]) for k in (3, 4))
    passages = _Passages._make(
        np.concatenate([stripe.passages[k] for stripe in stripes]) for k in range(len(_Passages._fields))
    )
    base = np.where(passages.kind == _THROUGH, n_pieces[passages.stripe], n_runs[passages.stripe])
    linked = _link(passages._replace(number=passages.number + base), len(runs))
    if linked is None:
        return None
    after, through = linked
    budget.check()
    ring, order = _cycles(after)
    cut = order[~is_whole[order]]  # runs that are joined, ring after ring
    places = places_of_runs(runs, cut)
    lengths = runs[cut, 1] - runs[cut, 0]
    begins = np.flatnonzero(np.append(True, ring[cut][1:] != ring[cut][:-1])) if len(cut) else cut
    offsets = np.append(summed(lengths)[:-1][begins], len(places))
    made = _canonical(vertices, places, offsets, summed(lengths)[:-1])
    if made is None:
        return None
    places, is_cut_shell = made
    budget.check()
    whole = np.flatnonzero(is_whole)
    regions = _regions(runs, ring, cut, through, int(n_pieces[-1]))
    every = np.concatenate([places_of_runs(runs, whole), places])
    all_offsets = np.concatenate([summed(runs[whole, 1] - runs[whole, 0])[:-1], len(every) - len(places) + offsets])
    region = np.append(regions[runs[whole, 2]], regions[runs[cut[begins], 2]])
    ordered = _ordered(vertices[every[all_offsets[:-1]]], np.append(is_shell[whole], is_cut_shell), region)
    if ordered is None:
        return None
    rings, piece_offsets = ordered
    rows = every[places_of(all_offsets, rings)]
    moved, n_exact = max(stripe.displacement for stripe in stripes), sum(stripe.n_exact for stripe in stripes)
    vertices, sources = take_rows([vertices, sources], rows, budget, workers)
    return one_pair(vertices, summed(np.diff(all_offsets)[rings]), piece_offsets, moved, n_exact, sources)


def places_of_runs(runs: IntArray, numbers: IntArray) -> IntArray:
    """Return the concatenated ranges runs[k, 0] .. runs[k, 1] - 1 for k in ``numbers``."""
    return places_from(runs[numbers, 0], runs[numbers, 1] - runs[numbers, 0])


def _link(passages: _Passages, n_runs: int) -> tuple[IntArray, IntArray] | None:
    """Return, by run, the run after it in its ring (itself where it is whole); and rows (piece, run) of pieces that a
    ring passes through after a run. None if there is no such order of runs."""
    edge, direction, stripe, kind, number = passages
    order = np.lexsort([kind, stripe * direction, direction, edge])
    edge, direction, kind, number = edge[order], direction[order], kind[order], number[order]
    is_same = np.append((edge[1:] == edge[:-1]) & (direction[1:] == direction[:-1]), False)
    goes_on = kind != _IN
    begins_next = ~is_same | (np.append(kind[1:], _OUT) == _OUT)
    if (goes_on == begins_next).any() or (kind[~np.append(False, is_same[:-1])[: len(kind)]] != _OUT).any():
        return None
    after = np.arange(n_runs)
    outs = np.flatnonzero(kind == _OUT)
    after[number[outs]] = number[kind == _IN]
    through = np.flatnonzero(kind == _THROUGH)
    before = outs[np.searchsorted(outs, through) - 1] if len(through) else through
    return after, np.stack([number[through], number[before]], axis=1)


def _cycles(after: IntArray) -> tuple[IntArray, IntArray]:
    """Return, by run, the least run of its ring; and the runs ring after ring, each beginning with its least. after:
    the next run in its ring."""
    least, jump = np.arange(len(after)), after
    left = len(after)
    while left:  # bound: the number of bits; each turn looks twice as far
        least, jump, left = np.minimum(least, least[jump]), jump[jump], left >> 1
    is_last = after == least
    steps, jump, left = (~is_last).astype(np.int64), np.where(is_last, np.arange(len(after)), after), len(after)
    while left:  # bound: as above
        steps, jump, left = steps + steps[jump], jump[jump], left >> 1
    return least, np.lexsort([-steps, least])


def _canonical(
    vertices: FloatArray, places: IntArray, offsets: IntArray, joints: IntArray
) -> tuple[IntArray, BoolArray] | None:
    """Return the places of rings that were joined, each from its least vertex (x, then y) on, and whether they are
    shells; None where a float does not tell. joints: where runs begin, in ``places``, at which rings must turn."""
    if not len(places):
        return places, np.zeros(0, np.bool_)
    x, y = vertices[places].T
    sizes = np.diff(offsets)
    lowest = np.flatnonzero(x == np.repeat(np.minimum.reduceat(x, offsets[:-1]), sizes))
    ring = np.searchsorted(offsets, lowest, "right") - 1
    least = lowest[np.lexsort([y[lowest], ring])][np.append(True, ring[1:] != ring[:-1])]
    before, after = np.arange(-1, len(places) - 1), np.arange(1, len(places) + 1)
    before[offsets[:-1]], after[offsets[1:] - 1] = offsets[1:] - 1, offsets[:-1]
    tested = np.concatenate([least, joints, before[joints]])
    a, b, c = before[tested], tested, after[tested]
    left, right = (x[b] - x[a]) * (y[c] - y[a]), (y[b] - y[a]) * (x[c] - x[a])
    is_sure = abs(left - right) > BOUND_2D * (abs(left) + abs(right)) + GUARD_2D
    if not is_sure.all():
        return None
    return places[_turned(offsets, least - offsets[:-1])], (left > right)[: len(least)]


def _regions(runs: IntArray, ring: IntArray, cut: IntArray, through: IntArray, n_pieces: int) -> IntArray:
    """Return the number of the region by piece: pieces of stripes are one region if one ring bounds both."""
    pieces = np.append(runs[cut, 2], through[:, 0])
    of_rings = n_pieces + np.append(ring[cut], ring[through[:, 1]])
    parent = np.arange(n_pieces + len(runs))
    while True:  # bound: each turn unites some trees
        first, second = parent[pieces], parent[of_rings]
        if (first == second).all():
            return parent[:n_pieces]
        np.minimum.at(parent, np.maximum(first, second), np.minimum(first, second))
        while (parent != (parent := parent[parent])).any():  # bound: the depth of a tree halves
            pass


def _ordered(firsts: FloatArray, is_shell: BoolArray, region: IntArray) -> tuple[IntArray, IntArray] | None:
    """Return the rings in canonical order (ring_order.py), and the offsets of pieces into them; None if a region has
    not one shell. firsts: the least vertex of each ring; no two are equal: rings that meet
    lie in opposite quadrants."""
    x, y = firsts.T
    shells = np.flatnonzero(is_shell)
    shells = shells[np.lexsort([y[shells], x[shells]])]
    rank = np.full(region.max(initial=-1) + 1, -1)
    rank[region[shells]] = np.arange(len(shells))
    rank = rank[region]
    rings = np.lexsort([y, x, ~is_shell, rank])
    if (rank < 0).any() or (rank[shells] != np.arange(len(shells))).any():
        return None
    return rings, np.append(np.flatnonzero(is_shell[rings]), len(rings))
