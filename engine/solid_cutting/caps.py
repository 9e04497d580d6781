"""The chain of sides along a plane as polygons with holes, and these as triangles.

Sides that run both ways between the same points cancel. Where more than two meet in a point each incoming one is
matched with the outgoing one next to it clockwise, as parentheses are, so that rings do not pass through each other;
a ring that comes to a point again is cut there. Rings run counter-clockwise about what is inside, seen against the
normal of the plane: shells counter-clockwise, holes clockwise. Rings may touch each other.

Which shell has a hole, and the triangles, are proposed by floats and checked exactly (`ears.py`); else by fractions.

Source: K. Weiler, P. Atherton, Hidden surface removal using polygon area sorting, 1977 (the walk along the chain).
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from fractions import Fraction
from functools import cmp_to_key
from itertools import chain, pairwise
from typing import Any, Final, NamedTuple

import numpy as np

from engine.compiling.jit import entry_of
from engine.errors import TooComplexError
from engine.predicates.rational import largest_axis, sign_of
from engine.running.budget import Budget
from engine.solid_cutting.ears import bridge_of, clip_ears
from engine.solid_cutting.face_cuts import find_turned, turn_rings
from engine.solid_cutting.plane_cut import Plane, Points, stops_of, without_repeats
from engine.types import FloatArray, IntArray, read_only

Ring = list[int]
_MOST_STEPS: Final = 12
"""How far ears are clipped again around one that is turned: beyond, all are."""


class Seen(NamedTuple):
    """Points projected along the normal of a plane: `axes` are the two coordinates to take, in the order in which
    counter-clockwise is as seen against the normal."""

    points: Points
    axes: tuple[int, int]

    def doubles(self, ring: Sequence[int]) -> FloatArray:
        """Return the rounded positions (n, 2) of points, given by number."""
        return self.points.rounded(np.array(ring, np.int64))[:, list(self.axes)]

    def exact(self, number: int) -> tuple[Fraction, Fraction]:
        """Return the exact position of a point."""
        place = self.points.exact(number)
        return Fraction(place[self.axes[0]], place[3]), Fraction(place[self.axes[1]], place[3])

    def turn(self, i: int, j: int, k: int) -> int:
        """Return the exact sign of the turn at j from i to k."""
        a, b = self.axes
        p, q, r = (self.points.exact(number) for number in (i, j, k))
        ux, uy = q[a] * p[3] - p[a] * q[3], q[b] * p[3] - p[b] * q[3]
        vx, vy = r[a] * p[3] - p[a] * r[3], r[b] * p[3] - p[b] * r[3]
        return sign_of(ux * vy - uy * vx)


class Area(NamedTuple):
    """A polygon of a plane: its shell, and its holes, each ring as the numbers of its points."""

    shell: Ring
    holes: list[Ring]


def seen(points: Points, plane: Plane) -> Seen:
    """Return the projection of points along the normal of a plane."""
    axis = largest_axis(plane.integers[:3])
    i, j = (axis + 1) % 3, (axis + 2) % 3
    return Seen(points, (i, j) if plane.integers[axis] > 0 else (j, i))


def rings_of(view: Seen, chain: IntArray, budget: Budget) -> list[Ring]:
    """Return the closed rings that a chain of directed sides (k, 2) consists of, each as numbers of points, none twice.
    Sides that run there and back cancel."""
    if not len(chain):
        return []
    order = np.argsort(chain[:, 0])
    known = chain[order, 0]
    ends, is_simple = chain, bool((known[1:] != known[:-1]).all())
    if is_simple:
        after = order[np.searchsorted(known, chain[:, 1])].tolist()
    else:
        ends, after = _balanced(view, chain, budget)
    starts, is_done, rings = ends[:, 0].tolist(), [False] * len(ends), []
    for first in range(len(ends)):
        walk: Ring = []
        side = first
        while not is_done[side]:  # bound: each side once
            is_done[side] = True
            walk.append(starts[side])
            side = after[side]
        if walk:
            rings += [walk] if is_simple else _parted(walk)
    return [ring for ring in rings if len(ring) > 2]  # others run there and back


def _parted(walk: Ring) -> list[Ring]:
    """Return the simple rings into which a closed walk falls at the points that it passes more than once."""
    rings: list[Ring] = []
    way: Ring = []
    place: dict[int, int] = {}
    for point in walk:
        if point in place:  # the walk is here again: what it made is a ring of its own
            rings.append(way[place[point] :])
            for other in rings[-1]:
                del place[other]
            del way[len(way) - len(rings[-1]) :]
        place[point] = len(way)
        way.append(point)
    return [*rings, way]


def _balanced(view: Seen, chain: IntArray, budget: Budget) -> tuple[IntArray, list[int]]:
    """Return (ends, after): the directed sides (k, 2) of a chain that remain when opposite ones cancel, and for each
    the number of the side that follows it in its ring."""
    n = int(chain.max()) + 1
    keys, net = np.unique(chain.min(axis=1) * n + chain.max(axis=1), return_inverse=True)
    net = np.bincount(net.reshape(-1), np.sign(chain[:, 1] - chain[:, 0])).astype(np.int64)
    ends = np.stack(np.divmod(keys, n), axis=1)
    ends = np.where(net[:, None] > 0, ends, ends[:, ::-1]).repeat(np.abs(net), axis=0)
    following: dict[int, list[int]] = defaultdict(list)
    for side, (start, _) in enumerate(ends.tolist()):
        following[start].append(side)
    targets = ends[:, 1].tolist()
    after = [following[end][0] for end in targets]
    for point in [point for point, sides in following.items() if len(sides) > 1]:
        budget.check()
        incoming = np.flatnonzero(ends[:, 1] == point).tolist()
        for side, other in _matched(view, point, ends, incoming, following[point]):
            after[side] = other
    return ends, after


def _matched(view: Seen, point: int, ends: IntArray, incoming: list[int], outgoing: list[int]) -> list[tuple[int, int]]:
    """Return pairs (incoming, outgoing) of sides at a point where several rings meet: each incoming side with the
    outgoing one that continues its ring, so that rings do not cross there. ends (k, 2): of all sides."""
    x, y = view.exact(point)
    rays: list[tuple[int, Fraction, Fraction, int, bool]] = []
    for side, other in [(k, int(ends[k, 0])) for k in incoming] + [(k, int(ends[k, 1])) for k in outgoing]:
        u, v = (a - b for a, b in zip(view.exact(other), (x, y)))
        rays.append((0 if v > 0 or (v == 0 and u > 0) else 1, u, v, side, len(rays) < len(incoming)))

    def clockwise(one: Any, other: Any) -> int:
        return int(other[0] - one[0]) or sign_of(one[2] * other[1] - one[1] * other[2]) * -1

    return _parentheses([(side, is_incoming) for *_, side, is_incoming in sorted(rays, key=cmp_to_key(clockwise))])


def _parentheses(ring: list[tuple[int, bool]]) -> list[tuple[int, int]]:
    """Return the pairs (opening, closing) of a cyclic list of (item, whether it opens), matched as parentheses are."""
    waiting: list[int] = []
    pairs: dict[int, int] = {}
    for each, opens in ring + ring:
        if opens and each not in pairs and each not in waiting:
            waiting.append(each)
        elif not opens and waiting and each not in pairs.values():
            pairs[waiting.pop()] = each
    return list(pairs.items())


def areas_of(view: Seen, rings: list[Ring], budget: Budget, is_exact: bool = False) -> tuple[list[Area], list[Ring]]:
    """Return rings as polygons with holes, and the rings without area, each from its leftmost point on. is_exact:
    shells of holes are chosen by fractions, not by rounded positions."""
    rings, signs = oriented(view, rings)
    shells = [ring for ring, sign in zip(rings, signs) if sign > 0]
    areas = [Area(shell, []) for shell in shells]
    holes = [ring for ring, sign in zip(rings, signs) if sign < 0]
    some = map(view.doubles, shells if holes else [])
    boxes = [np.stack([places.min(axis=0), places.max(axis=0)]) for places in some]
    for hole in holes:
        budget.check()
        low, high = (pick(view.doubles(hole), axis=0) for pick in (np.min, np.max))  # rounding is monotonic
        may = [k for k, box in enumerate(boxes) if (box[0] <= low).all() and (high <= box[1]).all()]
        best = may[0] if len(may) == 1 else may[_holder(view, hole, [shells[k] for k in may], is_exact)]
        areas[best].holes.append(hole)
    return areas, [ring for ring, sign in zip(rings, signs) if sign == 0]


def oriented(view: Seen, rings: list[Ring]) -> tuple[list[Ring], list[int]]:
    """Return rings, each from its leftmost point on, the lowest of these, and the exact signs of their areas."""
    sizes, numbers = np.array([len(ring) for ring in rings], np.int64), np.array([*chain(*rings)], np.int64)
    ends, firsts, signs = np.cumsum(sizes), np.empty(len(rings), np.int64), np.empty(len(rings), np.int8)
    with np.errstate(all="ignore"):
        entry_of(turn_rings)(view.points.rounded(numbers), *view.axes, ends, firsts, signs)
    made = [ring[k:] + ring[:k] for ring, k in zip(rings, (firsts - ends + sizes).tolist())]
    for number in np.flatnonzero(signs == 0).tolist():
        corners = [view.exact(point) for point in rings[number]]
        signs[number] = sign_of(sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(corners, corners[1:] + corners[:1])))
    return made, signs.tolist()


def _holder(view: Seen, hole: Ring, shells: list[Ring], is_exact: bool) -> int:
    """Return the index, in `shells`, of the smallest shell around a hole: the first corner of the hole that is not on a
    shell decides; if all are, the shell counts as around it. is_exact: as in `areas_of`."""
    places = [[view.exact(k) for k in ring] if is_exact else view.doubles(ring).tolist() for ring in (hole, *shells)]
    best, least = 0, None
    for number, ring in enumerate(places[1:]):
        size = abs(sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(ring, ring[1:] + ring[:1])))
        if least is not None and size >= least:
            continue
        sides = (_side_of(ring, corner) for corner in places[0])
        if next((side for side in sides if side != 0), 1) > 0:
            best, least = number, size
    return best


def _side_of(ring: list[Any], corner: Any) -> int:
    """Return the location of a position in a ring of positions: 1 inside, 0 on it, -1 outside; exact for fractions."""
    x, y = corner
    is_in = False
    for (ax, ay), (bx, by) in zip(ring, ring[1:] + ring[:1]):
        if (ay > y) != (by > y):
            turn = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
            if turn == 0:
                return 0
            is_in ^= (turn > 0) == (by > ay)
        elif (ay == y == by and min(ax, bx) <= x <= max(ax, bx)) or (ax == x and ay == y):
            return 0
    return 1 if is_in else -1


def cap_of(view: Seen, chain: IntArray, budget: Budget) -> IntArray:
    """Return triangles (k, 3) that close a chain, clockwise seen against the normal of the plane. Raises:
    TooComplexError."""
    rings = rings_of(view, chain, budget)
    areas, flat = areas_of(view, rings, budget)
    try:
        if flat:  # it may run along itself
            raise _TurnedError
        made = [triangles_of(view, area, False, budget) for area in areas]
    except _TurnedError:
        chain, joints = _split_at_contacts(view, chain, budget)
        areas, flat = areas_of(view, rings_of(view, chain, budget), budget, True)
        made = [joints, *(_fan_of(view, ring) for ring in flat)]
        for area in areas:
            try:
                made.append(triangles_of(view, area, False, budget))
            except _TurnedError:
                made.append(triangles_of(view, area, True, budget))
    return without_repeats(np.concatenate([np.zeros((0, 3), np.int64), *made])[:, ::-1])


def _split_at_contacts(view: Seen, chain: IntArray, budget: Budget) -> tuple[IntArray, IntArray]:
    """Return a chain of which each side is split at the points of others that lie on it, and flat triangles between
    the sides before and after: so that sides that lie on each other cancel."""
    on = view.points.on_sides(np.unique(np.sort(chain, axis=1), axis=0), np.unique(chain), budget)
    ways = [stops_of((start, end), on) for start, end in chain.tolist()]
    sides = [pair for way in ways for pair in pairwise(way)]
    joints = [(way[0], j, i) for way in ways for i, j in pairwise(way[1:])]
    return np.array(sides, np.int64), np.array(joints, np.int64).reshape(-1, 3)


def _fan_of(view: Seen, ring: Ring) -> IntArray:
    """Return triangles that close a ring all on one line."""
    rows = [(ring[0], i, j) for i, j in pairwise(ring[1:])]
    if any(view.turn(*row) for row in rows):
        raise _failed(view, Area(ring, []), True)
    return np.array(rows, np.int64).reshape(-1, 3)


class _TurnedError(Exception):
    """Floats could not triangulate a polygon: a triangle is clockwise by exact signs, or ears ran out. The caller tries
    again with sides split at contacts, then with fractions."""


def triangles_of(view: Seen, area: Area, is_exact: bool, budget: Budget) -> IntArray:
    """Return the triangles (n, 3) of a polygon, all exactly counter-clockwise. is_exact: made with fractions where
    floats fail. Raises: _TurnedError where floats do not suffice, TooComplexError where fractions do not either."""
    ring = _joined(view, area, is_exact, budget)
    exponent = math.frexp(view.points.size)[1]
    corners, places = np.array(ring, np.int64), np.ldexp(view.doubles(ring), -exponent)  # no product underflows
    span = float(np.ptp(places, axis=0).max())
    slack = 2.0**-49 * (1.0 + span) * span  # positions are off by 2^-53 of the largest coordinate
    made: IntArray | None = _ears_of(np.ascontiguousarray(places.T), slack, budget)
    if made is not None and (turned := _turned_in(view, corners, made, budget)):
        made = _clipped_again(view, ring, made.tolist(), turned, budget)
    if made is None and is_exact:
        made = _ears_of([*zip(*map(view.exact, ring))], 0, budget)
        made = None if made is None or _turned_in(view, corners, made, budget) else made
    if made is None:
        raise _failed(view, area, is_exact)
    return corners[made]


def _joined(view: Seen, area: Area, is_exact: bool, budget: Budget) -> Ring:
    """Return the shell and the holes of a polygon as one ring: each hole is joined by a bridge, two sides that run
    there and back. is_exact: bridges are found with fractions."""
    if not area.holes:
        return area.shell
    rings = [area.shell, *area.holes]
    if is_exact:
        firsts = [min(range(len(ring)), key=lambda k: view.exact(ring[k])) for ring in rings]
        rings = [ring[k:] + ring[:k] for ring, k in zip(rings, firsts)]
    numbers, ends = [number for ring in rings for number in ring], np.cumsum([*map(len, rings)]).tolist()
    places = [*map(view.exact, numbers)] if is_exact else view.doubles(numbers).tolist()
    starts = sorted((start for start in ends[:-1]), key=places.__getitem__)
    numbers, places = ([*each, *[each[0]] * (2 * len(starts))] for each in (numbers, places))
    x, y = (list(axis) if is_exact else np.array(axis) for axis in zip(*places))
    before, after = (np.arange(len(numbers)) + step for step in (-1, 1))
    before[[0, *ends[:-1]]], after[np.array(ends) - 1] = np.array(ends) - 1, [0, *ends[:-1]]
    bridge: Any = getattr(bridge_of, "py_func", bridge_of) if is_exact else entry_of(bridge_of)
    for end, hole in zip(range(ends[-1], len(numbers), 2), starts):
        budget.check()
        at = bridge(x, y, before, after, 0, hole)
        if at < 0:
            raise _failed(view, area, is_exact)
        for copy, corner in ((end, at), (end + 1, hole)):
            x[copy], y[copy], numbers[copy] = x[corner], y[corner], numbers[corner]
        following, last = after[at], before[hole]
        after[at], before[hole], after[end], before[following] = hole, at, following, end
        after[end + 1], before[end], after[last], before[end + 1] = end, end + 1, end + 1, last
    ring = [0]
    while len(ring) < len(numbers):
        ring.append(int(after[ring[-1]]))
    return [numbers[corner] for corner in ring]


def _ears_of(places: Any, slack: float, budget: Budget) -> IntArray | None:
    """Return the triangles (n - 2, 3) of a ring of n corners, in floats or fractions; None where ears run out."""
    (x, y), n = places, len(places[0])
    before, after, ears = np.arange(-1, n - 1), np.arange(1, n + 1), np.empty((n - 2, 3), np.int64)
    before[0], after[-1] = n - 1, 0
    clip: Any = entry_of(clip_ears) if isinstance(x, np.ndarray) else getattr(clip_ears, "py_func", clip_ears)
    n_ears = clip(x, y, before, after, 0, n, np.empty(n, np.int64), np.zeros(n, np.bool_), slack, ears, budget.flag)
    budget.check()
    return ears if n_ears == n - 2 else None


def _failed(view: Seen, area: Area, is_exact: bool) -> Exception:
    if not is_exact:
        return _TurnedError()
    at = view.points.rounded(area.shell[:1])[0].tolist()
    return TooComplexError(f"the section around {at} is not a polygon whose rings only touch; move the plane a little")


def _turned_in(view: Seen, corners: IntArray, triangles: IntArray, budget: Budget) -> list[int]:
    """Return the rows of triangles (n, 3), indices into `corners` (numbers of points), that are clockwise, exactly."""
    high, low = view.points.at(corners)
    is_open = np.empty(len(triangles), np.bool_)
    axes = read_only(np.array(view.axes))
    with np.errstate(all="ignore"):
        size = 2.0 * view.points.size  # of the ends of edges that were cut
        entry_of(find_turned)(high, low, size, triangles, axes, is_open)
    turned = []
    for row in np.flatnonzero(is_open).tolist():
        budget.check()
        if view.turn(*corners[triangles[row]].tolist()) < 0:
            turned.append(row)
    return turned


def _clipped_again(view: Seen, ring: Ring, rows: list[Ring], turned: list[int], budget: Budget) -> IntArray | None:
    """Return the triangles of a ring, rows of its corners, with ears around those that are clockwise clipped again, by
    fractions, so that none is; None where that fails. Floats made them of points that are close together.

    Triangles of one ring that hang together by edges are a polygon.
    """
    at = {(row[k - 1], row[k]): number for number, row in enumerate(rows) for k in range(3)}
    for number in turned:
        region = {number}
        for _ in range(_MOST_STEPS):
            sides = {(rows[each][k - 1], rows[each][k]) for each in region for k in range(3)}
            after = {u: v for u, v in sides if (v, u) not in sides}
            corners = [rows[number][0]]
            while after[corners[-1]] != corners[0]:  # bound: the corners of the region
                corners.append(after[corners[-1]])
            ears = _ears_of([*zip(*(view.exact(ring[corner]) for corner in corners))], 0, budget)
            made = [] if ears is None else [[corners[k] for k in ear] for ear in ears.tolist()]
            if made and all(view.turn(*(ring[corner] for corner in row)) >= 0 for row in made):
                break
            region |= {at[v, u] for u, v in sides if (v, u) in at}
        else:
            return None
        for each, row in zip(region, made):
            rows[each] = row
            at |= {(row[k - 1], row[k]): each for k in range(3)}
    return np.array(rows, np.int64)
