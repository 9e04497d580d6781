"""One mesh cut by planes one after another: its faces, where new points are, the chain along each plane.

A vertex on the plane counts as outside, as if the plane were moved inwards by less than anything: then it passes
through no vertex, each face has none or two sides that it crosses, and what it leaves of closed shells has closed
chains as its boundary. An edge that ends on the plane is cut at that end.

A new point is where an edge of two earlier points crosses a plane. Its exact place, x w, y w, z w, w in integers, is
computed where a decision or a rounding needs it; nothing is decided on rounded coordinates.

Source: I. E. Sutherland, G. W. Hodgman, Reentrant polygon clipping, 1974, for each face.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from copy import copy
from fractions import Fraction
from typing import Final, NamedTuple

import numpy as np

from engine.bounding.box_grid import all_pairs_of_boxes
from engine.compiling.jit import entry_of
from engine.predicates.rational import (
    Number,
    cross,
    dot,
    largest_axis,
    minus,
    nearest_pair,
    reduced,
    scaled_integers,
    sign_of,
)
from engine.running.budget import Budget
from engine.solid_cutting.face_cuts import cut_edges, find_sides, split_faces
from engine.solids.mesh import first_equal
from engine.types import UNDECIDED, BoolArray, FloatArray, Int8Array, IntArray, read_only

Place = tuple[int, int, int, int]
_MOST_EXPONENT: Final = 200
"""Rows and coordinates of kernels lie within 2^-200 .. 2^200; others go through integers."""


class Plane(NamedTuple):
    """A plane, inside where integers . (x, y, z, 1) > 0. row (4,): the same in doubles, times a positive factor,
    rounded unless `is_exact`."""

    integers: tuple[int, ...]
    row: FloatArray
    is_exact: bool

    @property
    def reversed(self) -> Plane:
        """The plane with its sides exchanged."""
        return Plane(tuple(-x for x in self.integers), read_only(-self.row), self.is_exact)


def plane_of(row: Sequence[Number]) -> Plane:
    """Return the plane of a row of exact numbers, normal and offset."""
    integers = reduced(scaled_integers(row))
    shift = max(x.bit_length() for x in integers)
    scaled = [x / (1 << shift) for x in integers]  # rounded once; no less than 2^-1000 where it counts
    is_exact = all(
        n == 0 or (n.bit_length() - (n & -n).bit_length() < 53 and abs(x) > 2.0**-_MOST_EXPONENT)
        for x, n in zip(scaled, integers)
    )
    return Plane(integers, read_only(np.array(scaled)), is_exact)


def plane_through(values: FloatArray) -> Plane:
    """Return the plane through three points (3, 3), or through a point and at a right angle to a vector (2, 3), exact,
    its normal zero where there is none."""
    numbers = scaled_integers([*values.ravel().tolist(), 1])
    p, q, r, w = numbers[:3], numbers[3:6], numbers[6:-1], numbers[-1]
    normal = tuple(q) if len(values) == 2 else cross(minus(q, p), minus(r, p))
    return plane_of([*(x * w for x in normal), -dot(normal, tuple(p))])


class Points:
    """The vertices of a solid, and those that cuts add; a point is its number.

    n: number of points; high (n, 3): nearest doubles; low (n, 3): the rest, to 2^-84.
    """

    def __init__(self, vertices: FloatArray) -> None:
        self.vertices, self.n_given = read_only(vertices), len(vertices)
        self.high, self.low = np.zeros((0, 3)), np.zeros((0, 3))
        sizes = np.abs(vertices)
        self.size = float(sizes.max())
        self.is_in_range = (
            bool(((sizes == 0.0) | (sizes > 2.0**-_MOST_EXPONENT)).all()) and self.size < 2.0**_MOST_EXPONENT
        )
        self._edges, self._rounded = np.zeros((0, 2), np.int64), self.vertices
        self._planes: list[Plane] = []
        self._plane_of = np.zeros(0, np.int64)
        self._places: dict[int, Place] = {}

    def __len__(self) -> int:
        return self.n_given + len(self.high)

    def copy(self) -> Points:
        """Return the same points, to which others can be added."""
        made = copy(self)
        made._planes, made._places = self._planes.copy(), self._places.copy()
        return made

    def rounded(self, numbers: IntArray | list[int]) -> FloatArray:
        """Return the nearest doubles (n, 3) of points."""
        if len(self._rounded) != len(self):
            self._rounded = np.concatenate([self.vertices, self.high])
        return self._rounded[numbers]

    def at(self, numbers: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (n, 3) of points as double-doubles: the nearest doubles, and the rest."""
        low, is_new = np.zeros((len(numbers), 3)), numbers >= self.n_given
        low[is_new] = self.low[numbers[is_new] - self.n_given]
        return self.rounded(numbers), low

    def exact(self, number: int) -> Place:
        """Return the exact place of a point, homogeneous with w > 0."""
        place = self._places.get(number)
        if place is None:
            k = number - self.n_given
            if k < 0:
                x, y, z, w = scaled_integers([*self.vertices[number].tolist(), 1])
                place = x, y, z, w
            else:
                plane = self._planes[self._plane_of[k]]
                p, q = (self.exact(end) for end in self._edges[k].tolist())
                a, b = value_at(plane, p), value_at(plane, q)
                if a < 0:
                    p, q, a, b = q, p, b, a
                x, y, z, w = reduced([a * s - b * r for r, s in zip(p, q)])
                place = (x, y, z, w) if w > 0 else (-x, -y, -z, -w)
            self._places[number] = place
        return place

    def sides(self, plane: Plane, budget: Budget) -> Int8Array:
        """Return on which side of a plane all points are: 1, 0 or -1 each.

        Numbers of rows and of added points are rounded to 2^-53, and so are products and sums: seven times in all. In
        range, what underflows is below 2^-1074 times a number below 2^201.
        """
        n = self.n_given
        sides = np.empty(len(self), np.int8)
        with np.errstate(all="ignore"):
            entry_of(find_sides)(self.vertices, plane.row, plane.is_exact, sides[:n], budget.flag)
            budget.check()
            values = self.high @ plane.row[:3] + plane.row[3]
            bounds = 2.0**-48 * (np.abs(self.high) @ np.abs(plane.row[:3]) + abs(plane.row[3])) + 2.0**-700
            is_sure = (np.abs(values) > bounds) & self.is_in_range
            sides[n:] = np.where(is_sure, np.sign(values), UNDECIDED)
        for number in np.flatnonzero(sides == UNDECIDED).tolist():
            budget.check()
            sides[number] = self.side(plane, number)
        return sides

    def side(self, plane: Plane, number: int) -> int:
        """Return the exact side of one point."""
        return sign_of(value_at(plane, self.exact(number)))

    def add(self, edges: IntArray, planes: list[Plane], which: IntArray, budget: Budget) -> None:
        """Add the crossings of edges (k, 2) with planes[which[k]], the first end of each edge being inside."""
        first, n = len(self), len(edges)
        high, low, is_nearest = np.empty((n, 3)), np.empty((n, 3)), np.zeros(n, np.bool_)
        self._plane_of = np.concatenate([self._plane_of, which + len(self._planes)])
        self._planes += planes
        self._edges = np.concatenate([self._edges, edges])
        if self.is_in_range and (not n or edges.max() < self.n_given):
            rows = read_only(np.stack([plane.row for plane in planes]))
            with np.errstate(all="ignore"):
                entry_of(cut_edges)(self.vertices, read_only(edges), rows, which, high, low, is_nearest)
            if not all(plane.is_exact for plane in planes):
                is_nearest &= np.array([plane.is_exact for plane in planes])[which]
        for k in np.flatnonzero(~is_nearest).tolist():
            budget.check()
            x, y, z, w = self.exact(first + k)
            for axis, value in enumerate((x, y, z)):
                high[k, axis], low[k, axis] = nearest_pair(value, w)
        self.high, self.low = np.concatenate([self.high, high]), np.concatenate([self.low, low])

    def add_places(self, places: Sequence[tuple[int, ...]], budget: Budget) -> None:
        """Add points at exact places."""
        first, none = len(self), np.full((len(places), 2), -1)
        pairs = np.empty((len(places), 3, 2))
        for k, (x, y, z, w) in enumerate(places):
            budget.check()
            self._places[first + k] = x, y, z, w
            pairs[k] = [nearest_pair(value, w) for value in (x, y, z)]
        self._edges, self._plane_of = np.concatenate([self._edges, none]), np.append(self._plane_of, none[:, 0])
        self.high, self.low = (np.concatenate(rows) for rows in zip((self.high, self.low), np.moveaxis(pairs, 2, 0)))

    def on_sides(self, sides: IntArray, spots: IntArray, budget: Budget) -> dict[tuple[int, int], list[int]]:
        """Return, by side (k, 2), which points of `spots` are in its interior, in their order from its first end on;
        sides without any are left out."""
        ends, at = self.rounded(sides.ravel()).reshape(-1, 2, 3), self.rounded(spots)
        low, high = (np.concatenate([pick(ends, axis=1), at]) for pick in (np.min, np.max))
        pairs, n = all_pairs_of_boxes(low, high, budget), len(sides)
        pairs = pairs[(pairs[:, 0] < n) & (pairs[:, 1] >= n)] - np.array([0, n])
        pairs = pairs[(sides[pairs[:, 0]] != spots[pairs[:, 1]][:, None]).all(axis=1)]
        with np.errstate(all="ignore"):  # positions are off by 2^-53 of the largest
            along, away = ends[pairs[:, 0], 1] - ends[pairs[:, 0], 0], at[pairs[:, 1]] - ends[pairs[:, 0], 0]
            reach = np.abs(along).max(axis=1, initial=0.0)
            bound = 2.0**-48 * reach * (reach + self.size) + 2.0**-1000
            pairs = pairs[~(np.abs(np.cross(along, away)).max(axis=1, initial=0.0) > bound)]
        on: dict[tuple[int, int], list[tuple[Fraction, int]]] = defaultdict(list)
        for row, spot in pairs.tolist():
            budget.check()
            (start, end), number = sides[row].tolist(), int(spots[spot])
            share = _share(*map(self.exact, (start, end, number)))
            if share is not None and 0 < share < 1:
                on[start, end].append((share, number))
        return {side: [number for _, number in sorted(own)] for side, own in on.items()}

    def add_crossings(self, edges: IntArray, on_plane: IntArray, plane: Plane, budget: Budget) -> IntArray:
        """Add the crossings of edges (k, 2) with a plane, the first end inside; return their numbers. Crossings at one
        place get one number, that of a point of `on_plane` if there is one at that place."""
        first, n = len(self), len(edges)
        self.add(edges, [plane], np.zeros(n, np.int64), budget)
        numbers = np.arange(first, first + n)
        known = np.concatenate([on_plane, numbers])
        same = first_equal(np.concatenate([self.rounded(on_plane), self.high[first - self.n_given :]])) if n else None
        if same is not None:
            for k in (np.flatnonzero(same[-n:] != np.arange(len(known) - n, len(known)))).tolist():
                budget.check()
                other = int(known[same[k - n]])
                if self.exact(first + k) == self.exact(other):
                    numbers[k] = other
        return numbers


def stops_of(side: tuple[int, int], on: dict[tuple[int, int], list[int]]) -> list[int]:
    """Return the points of a side from its start to its end; on: those in its interior, as `Points.on_sides` gives them
    for sides whose first end has the lower number."""
    start, end = side
    between = on.get((min(side), max(side)), [])
    return [start, *(between if start < end else between[::-1]), end]


def _share(start: Place, end: Place, at: Place) -> Fraction | None:
    """Return t where a place is start + t (end - start), None if it is not on that line."""
    p, q, r = ([Fraction(x, place[3]) for x in place[:3]] for place in (start, end, at))
    along, away = [b - a for a, b in zip(p, q)], [b - a for a, b in zip(p, r)]
    axis = largest_axis(along)
    share = away[axis] / (along[axis] or 1)
    return share if all(share * x == y for x, y in zip(along, away)) else None


def value_at(plane: Plane, place: Place) -> int:
    """Return the value of a plane at an exact place, times its w."""
    (a, b, c, d), (x, y, z, w) = plane.integers, place
    return a * x + b * y + c * z + d * w


class Cut(NamedTuple):
    """What a plane leaves of triangles. whole: numbers of those that it leaves whole. pieces (k, 3): triangles of the
    others, cut; of (k,): the number of each one's triangle. chain (n, 2): sides of pieces along the plane, with what is
    left on their left seen against the normal. beyond, beyond_of: pieces of what the plane takes away, if asked for,
    with whole triangles among them. splits (j, 3): ends of edges, and the point where each is cut."""

    whole: IntArray
    pieces: IntArray
    of: IntArray
    chain: IntArray
    beyond: IntArray
    beyond_of: IntArray
    splits: IntArray


def cut_triangles(
    points: Points, triangles: IntArray, plane: Plane, budget: Budget, sides: Int8Array | None = None,
    with_beyond: bool = False,
) -> Cut:  # fmt: skip
    """Return, as a `Cut`, what is inside a plane of triangles (m, 3), and with_beyond also what is outside. Crossings
    are added to `points`. sides: of all points at the plane, if known."""
    sides = points.sides(plane, budget) if sides is None else sides
    whole, mixed = np.empty(len(triangles), np.int64), np.empty(len(triangles), np.int64)
    counts = entry_of(split_faces)(read_only(triangles), sides, whole, mixed, budget.flag)
    budget.check()
    whole, mixed = whole[: counts >> 32], mixed[: counts & 0xFFFFFFFF]
    some = triangles[mixed]
    is_in = sides[some] > 0
    is_one = is_in.sum(axis=1) == 1
    lone = np.argmax(is_in == is_one[:, None], axis=1)  # the corner on the other side than the two others
    rows = np.arange(len(some))
    p, q, r = (some[rows, (lone + k) % 3] for k in range(3))
    ends = np.concatenate([np.stack([np.where(is_one, p, x), np.where(is_one, x, p)], axis=1) for x in (q, r)])
    cuts = ends[:, 1].copy()  # an end on the plane is the point itself
    crosses = np.flatnonzero(sides[cuts] < 0)
    keys, numbers = np.unique(ends[crosses, 0] * len(points) + ends[crosses, 1], return_inverse=True)
    edges = np.stack(np.divmod(keys, len(points)), axis=1)
    new = points.add_crossings(edges, np.flatnonzero(sides == 0), plane, budget)
    cuts[crosses] = new[numbers.reshape(-1)]
    a, b = cuts[: len(some)], cuts[len(some) :]
    chain = np.stack([np.where(is_one, a, b), np.where(is_one, b, a)], axis=1)

    def pieces(is_tip: BoolArray) -> tuple[IntArray, IntArray]:
        """Return triangles at the lone corners, where is_tip, else of what is across; and whose they are."""
        tips = np.stack([np.where(is_tip, p, a), np.where(is_tip, a, q), np.where(is_tip, b, r)], axis=1)
        quads = np.flatnonzero(~is_tip & (a != b))
        cut = np.concatenate([tips, np.stack([a[quads], r[quads], b[quads]], axis=1)])
        has_sides = are_different(cut)
        return cut[has_sides], np.concatenate([mixed, mixed[quads]])[has_sides]

    beyond = triangles[:0], mixed[:0]
    if with_beyond:
        beyond, is_out = pieces(~is_one), np.ones(len(triangles), np.bool_)
        is_out[whole], is_out[mixed] = False, False
        beyond = np.concatenate([triangles[is_out], beyond[0]]), np.concatenate([np.flatnonzero(is_out), beyond[1]])
    return Cut(whole, *pieces(is_one), chain[a != b], *beyond, np.column_stack([edges, new]))


def are_different(triangles: IntArray) -> BoolArray:
    """Return whether triangles name three points; others, where points at one place are one, have no boundary."""
    return (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)


def without_repeats(triangles: IntArray) -> IntArray:
    """Return the triangles that name three different points."""
    return triangles[are_different(triangles)]
