"""Triangulates polygonal faces by ear cutting with one fixed rule, so that a face that is not plane bounds one solid.

**The rule.** Project the face along the axis on which its vector area is largest (on a tie the first of x, y, z). Scan
the ring from its first vertex for the first ear: a strictly convex corner whose closed triangle holds no other vertex
of the ring. Cut it, scan again from the first remaining vertex, until three remain. Every sign is exact; vertices in
the middle of a straight side remain. A strictly convex face becomes a fan about its last vertex. A projection that
is not simple (crossing or touching sides, repeated positions, no area) is refused; every other has an ear.

**Convex faces**, nearly all of real meshes, are certified by floating-point signs with a proven bound. Where rounding
leaves open along which axis the area is largest, the face must be convex along each that may be: the fan is the same. A
ring turns strictly one way and around once if every turn has that sign and the first coordinate rises and falls once.

**Bounds.** A face is brought to size 1 by a power of two; what that takes from tiny coordinates, 2^-1075, is far below
`_TINY`. A product of differences carries three roundings, a term four, a sum of k terms at most k more, each below the
sum of sizes; doubled.

**Ears**, in n^2 at most. A ring is simple if it turns back at no corner and no two sides meet that share none: all
pairs are compared, most by their boxes. A corner is blunt (no left turn: it may become one, never the other way round),
or blocked (a blunt corner lies in its closed triangle: of the corners in a triangle the one nearest the tip is blunt),
or the tip of an ear. While a triangle stays the same, what does not block it never will, so the search for a blocker
goes on where it stopped; a cut changes two triangles. A sign that the compiled predicate leaves UNDECIDED (coordinates
of one axis more than 2^985 apart) is put into `Ring.wanted`; the caller computes it in rationals and begins again.

Source: G. H. Meisters, Polygons have ears, 1975. Changed: exact signs, closed triangles, the fixed scan.
"""

from __future__ import annotations

from math import frexp, ldexp
from typing import Any, Final, NamedTuple

import numpy as np

from engine.compiling.jit import entry_of, inline, kernel
from engine.errors import FaceNotSimpleError
from engine.predicates.orientation import orient2d
from engine.predicates.rational import orient2d_rational, scaled_integers
from engine.running.budget import Budget
from engine.solids.checks import digits
from engine.types import UNDECIDED, FlagArray, FloatArray, Int8Array, IntArray, Point2

SIMPLE, TURNS_BACK, MEETS, ENDED_EARLY = 0, 1, 2, 3
CONVEX, UNSURE = 0, 4
_TINY: Final = 1e-300  # far above what underflow takes from a sum of products (a few times 2^-1075)
_ROUNDOFF: Final = 2.0**-53
_POLL: Final = 0x3FF


class Ring(NamedTuple):
    """A ring of corners and the signs of turns that the compiled predicate cannot decide. x, y (n,): the corners.
    settled (k, 4): three corners and the exact sign of their turn. wanted (4,): (1, i, j, k) for a turn whose sign the
    caller must compute, else 0."""

    x: Any
    y: Any
    settled: Any
    wanted: Any


class Corners(NamedTuple):
    """Scratch of `cut_ears`, by corner of the ring. before, after: its neighbours among the corners not cut yet.
    is_blunt: 1 if it is blunt. blocker: the blunt corner that blocks it, or -1. n_passed: how many of `blunt` it has
    been compared with. blunt: the corners that were blunt at first, one after another."""

    before: Any
    after: Any
    is_blunt: Any
    blocker: Any
    n_passed: Any
    blunt: Any


def cut_faces(
    vertices: FloatArray, offsets: IntArray, indices: IntArray, merged: IntArray, budget: Budget
) -> tuple[IntArray, IntArray]:
    """Return the triangles of all faces as a flat array of vertex indices, taken from `merged`, and the face of each
    triangle. offsets, indices: the faces as given; merged: the same corners with one index for equal positions. Raises:
    FaceNotSimpleError, DeadlineExceededError, CancelledError.
    """
    counts = np.diff(offsets)
    starts = np.append(np.int64(0), np.cumsum(counts - 2))
    corners, projections = np.empty((int(starts[-1]), 3), np.int64), np.empty(len(counts), np.int8)
    entry_of(cut_convex_faces)(vertices, offsets, merged, starts, corners, projections, budget.flag)
    budget.check()
    for face in np.flatnonzero(projections != CONVEX).tolist():
        points, names = (each[offsets[face] : offsets[face + 1]] for each in (merged, indices))
        ears = cut_ring(vertices[points], int(projections[face]), face, names, budget)
        corners[starts[face] : starts[face + 1]] = offsets[face] + ears
    triangle_faces = np.repeat(np.arange(len(counts)), counts - 2)
    return merged[corners.ravel()], triangle_faces


def cut_ring(points: FloatArray, projection: int, face: int, names: IntArray, budget: Budget) -> IntArray:
    """Return the ears (k - 2, 3) of one face with k corners, as indices into its ring, in the order of cutting; exact.
    projection: from `cut_convex_faces`. face, names: number of the face and the caller's indices of its corners, for
    messages."""
    if projection == UNSURE:
        projection = _projection_of_largest_area(points)
    axis = abs(projection) - 1
    axes = [(axis + 1) % 3, (axis + 2) % 3] if projection > 0 else [(axis + 2) % 3, (axis + 1) % 3]
    if projection == 0:
        raise _not_simple(points, face, names, "has no area in any projection")
    n, flat = len(points), points[:, axes]
    x, y = np.ascontiguousarray(flat[:, 0]), np.ascontiguousarray(flat[:, 1])
    sides, ears = np.zeros(2, np.int64), np.empty((n - 2, 3), np.int64)
    settled = np.empty((0, 4), np.int64)
    while True:  # bound: each turn settles one sign
        ring = Ring(x, y, settled, np.zeros(4, np.int64))
        result = find_self_contact(ring, sides, budget.flag)
        if result == SIMPLE and cut_ears(ring, Corners(*np.empty((6, n), np.int64)), ears, budget.flag) == n - 2:
            return ears
        budget.check()
        if ring.wanted[0] == 0:
            break
        i, j, k = ring.wanted[1:].tolist()
        sign = orient2d_rational(*flat[[i, j, k]].tolist())
        settled = np.concatenate([settled, [[i, j, k, sign]]])
    assert result not in (SIMPLE, ENDED_EARLY), "a simple ring without an ear"
    first, second = sides.tolist()
    if result == TURNS_BACK:
        raise _not_simple(points, face, names, f"stands still or turns back on itself at vertex {names[first]}")
    problem = (
        f"is not simple in the projection of largest area: side {names[first]}-{names[(first + 1) % n]} "
        f"meets side {names[second]}-{names[(second + 1) % n]}"
    )
    raise _not_simple(points, face, names, problem)


def _not_simple(points: FloatArray, face: int, names: IntArray, problem: str) -> FaceNotSimpleError:
    return FaceNotSimpleError(
        f"faces[{face}] = {names[:12].tolist()}{'...' if len(names) > 12 else ''} {problem}; "
        f"its first vertex is {digits(points[0])}; cut it into triangles",
        ("faces", face),
    )


def _projection_of_largest_area(points: FloatArray) -> int:
    """Return 1, 2 or 3 for the axis along which the projected area is largest (the first of equals), negative if the
    area is; 0 if all are 0."""
    whole = np.array(scaled_integers(points.ravel().tolist()), object).reshape(-1, 3)
    spokes, area = whole[1:] - whole[0], []
    for axis in range(3):
        u, v = spokes[:, (axis + 1) % 3], spokes[:, (axis + 2) % 3]
        area.append((u[:-1] * v[1:] - u[1:] * v[:-1]).sum())
    sizes = [abs(value) for value in area]
    axis = sizes.index(max(sizes))
    return 0 if area[axis] == 0 else axis + 1 if area[axis] > 0 else -axis - 1


@inline
def _at(vertices: FloatArray, merged: IntArray, corner: int, axis: int, scale: float) -> float:
    return float(vertices[merged[corner], axis]) * scale


@inline
def _area(
    vertices: FloatArray, merged: IntArray, corners: tuple[int, int], axis: int, scale: float
) -> tuple[float, float]:
    """Return twice the area of a face projected along an axis, times scale^2, and an error bound. corners: (first,
    end), the range of the face in `merged`."""
    first, last = corners
    a, b = (axis + 1) % 3, (axis + 2) % 3
    u0, v0 = _at(vertices, merged, first, a, scale), _at(vertices, merged, first, b, scale)
    area, sizes, u, v = 0.0, 0.0, 0.0, 0.0
    for corner in range(first + 1, last):
        next_u, next_v = _at(vertices, merged, corner, a, scale) - u0, _at(vertices, merged, corner, b, scale) - v0
        left, right = u * next_v, next_u * v
        area += left - right
        sizes += abs(left) + abs(right)
        u, v = next_u, next_v
    return area, 2.0 * (last - first + 4) * _ROUNDOFF * sizes + _TINY


@inline
def _turns_once(
    vertices: FloatArray, merged: IntArray, corners: tuple[int, int], axis: int, scale: float, is_left: bool
) -> bool:
    """Return whether a face projected along an axis certainly turns strictly left (is_left) or right at every corner,
    and around once. corners: (first, end), the range of the face in `merged`; scale: brings it to size 1."""
    first, last = corners
    a, b = (axis + 1) % 3, (axis + 2) % 3
    u, v = _at(vertices, merged, last - 1, a, scale), _at(vertices, merged, last - 1, b, scale)
    du = u - _at(vertices, merged, last - 2, a, scale)
    dv = v - _at(vertices, merged, last - 2, b, scale)
    n_changes, rises, first_rises = 0, 0, 0
    for corner in range(first, last):
        next_u, next_v = _at(vertices, merged, corner, a, scale), _at(vertices, merged, corner, b, scale)
        next_du, next_dv = next_u - u, next_v - v
        left, right = du * next_dv, next_du * dv
        turn = left - right if is_left else right - left
        if not turn > 8.0 * _ROUNDOFF * (abs(left) + abs(right)) + _TINY:
            return False
        if next_du != 0.0:  # a vertical side goes on as the one before it did
            way = 1 if next_du > 0.0 else -1
            n_changes += way == -rises
            first_rises = way if first_rises == 0 else first_rises
            rises = way
        u, v, du, dv = next_u, next_v, next_du, next_dv
    return n_changes + (first_rises == -rises) == 2


@inline
def _projection(vertices: FloatArray, merged: IntArray, corners: tuple[int, int]) -> int:
    """Return CONVEX if the face is certainly convex; else 1, 2 or 3 for the axis of largest projected area, negative if
    that area is; UNSURE if rounding leaves the axis open. corners: (first, end), the range of the face in `merged`."""
    largest, least, projection, is_convex = 0.0, -1.0, 0, True
    for corner in range(corners[0], corners[1]):
        for axis in range(3):
            largest = max(largest, abs(vertices[merged[corner], axis]))
    scale = ldexp(1.0, -max(frexp(largest)[1], -1000))
    for axis in range(3):
        area, bound = _area(vertices, merged, corners, axis, scale)
        least = max(least, abs(area) - bound)
    for axis in range(3):
        area, bound = _area(vertices, merged, corners, axis, scale)
        if abs(area) + bound >= least:
            is_convex = is_convex and _turns_once(vertices, merged, corners, axis, scale, area > 0.0)
            projection = UNSURE if projection != 0 or abs(area) <= bound else axis + 1 if area > 0.0 else -axis - 1
    return CONVEX if is_convex else projection


@kernel
def cut_convex_faces(
    vertices: FloatArray, offsets: IntArray, merged: IntArray, starts: IntArray, corners: IntArray,
    projections: Int8Array, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill corners (starts[-1], 3) with the triangles of faces that are certainly convex, a fan about the last corner
    each. Corners are indices into `merged`; the triangles of face i begin at starts[i]. Rows of other faces stay unset.
    projections (m,) int8: result of `_projection` for each face."""
    for face in range(offsets.shape[0] - 1):
        if face & _POLL == 0 and flag[0] != 0:
            return
        first, last, place = offsets[face], offsets[face + 1], starts[face]
        if last - first == 3:
            projections[face] = CONVEX
            corners[place, 0], corners[place, 1], corners[place, 2] = first, first + 1, first + 2
            continue
        projections[face] = _projection(vertices, merged, (first, last))
        for tip in range(first, last - 2 if projections[face] == CONVEX else first):
            corners[place, 0], corners[place, 1], corners[place, 2] = last - 1, tip, tip + 1
            place += 1


@inline
def turn(ring: Ring, i: int, j: int, k: int) -> int:
    """Return the sign of the turn at corner j on the way from corner i to corner k: 1 left, -1 right, 0 straight. 0
    also, with the turn written to `wanted`, if it is neither decided nor settled."""
    x, y = ring.x, ring.y
    side = orient2d(Point2(x[i], y[i]), Point2(x[j], y[j]), Point2(x[k], y[k]))
    if side != UNDECIDED:
        return side
    for row in range(ring.settled.shape[0]):
        if ring.settled[row, 0] == i and ring.settled[row, 1] == j and ring.settled[row, 2] == k:
            return int(ring.settled[row, 3])
    ring.wanted[0], ring.wanted[1], ring.wanted[2], ring.wanted[3] = 1, i, j, k
    return 0


@inline
def _is_before(ring: Ring, i: int, j: int) -> bool:
    """Return whether corner i precedes corner j lexicographically, by x, y, index."""
    x, y = ring.x, ring.y
    return x[i] < x[j] or (x[i] == x[j] and (y[i] < y[j] or (y[i] == y[j] and i < j)))


@inline
def _are_apart(a: float, b: float, c: float, d: float) -> bool:
    """Return whether the intervals [a, b] and [c, d], in any order, are disjoint."""
    return max(a, b) < min(c, d) or max(c, d) < min(a, b)


@kernel
def find_self_contact(ring: Ring, where: IntArray, flag: FlagArray) -> int:
    """Return whether the ring is SIMPLE, or its first self-contact.

    | result | meaning |
    |---|---|
    | SIMPLE | no self-contact |
    | TURNS_BACK | at corner where[0] |
    | MEETS | side where[0] meets side where[1]; side i goes from corner i to the next one |
    | ENDED_EARLY | the flag is set, or floats leave the sign of a turn open: its corners are in `ring.wanted` |
    """
    x, y, n = ring.x, ring.y, ring.x.shape[0]
    for i in range(n):
        before, after = (i - 1) % n, (i + 1) % n
        is_back = _is_before(ring, i, after) == _is_before(ring, i, before) and turn(ring, before, i, after) == 0
        if is_back or (x[i] == x[after] and y[i] == y[after]):
            where[0] = i
            return ENDED_EARLY if ring.wanted[0] != 0 else TURNS_BACK
    for i in range(n - 2):
        if flag[0] != 0:
            return ENDED_EARLY
        for k in range(i + 2, n - 1 if i == 0 else n):
            j, m = i + 1, (k + 1) % n
            if _are_apart(x[i], x[j], x[k], x[m]) or _are_apart(y[i], y[j], y[k], y[m]):
                continue
            # of sides on one line all turns are 0: they meet, as their boxes do
            if turn(ring, i, j, k) * turn(ring, i, j, m) <= 0 and turn(ring, k, m, i) * turn(ring, k, m, j) <= 0:
                where[0], where[1] = i, k
                return ENDED_EARLY if ring.wanted[0] != 0 else MEETS
    return SIMPLE


@kernel
def cut_ears(ring: Ring, corners: Corners, ears: IntArray, flag: FlagArray) -> int:
    """Fill ears (n - 2, 3) with (corner before, tip, corner after) in the order of cutting; return how many were cut.
    Fewer than n - 2 if the flag is set or a turn is wanted. ring: simple, counter-clockwise."""
    before, after, is_blunt, n, n_blunt = corners.before, corners.after, corners.is_blunt, ring.x.shape[0], 0
    for i in range(n):
        before[i], after[i] = (i - 1) % n, (i + 1) % n
        corners.n_passed[i], corners.blocker[i] = 0, -1
        is_blunt[i] = turn(ring, before[i], i, after[i]) <= 0
        if is_blunt[i] != 0:
            corners.blunt[n_blunt] = i
            n_blunt += 1
    for n_ears in range(n - 2):
        tip = 0
        while tip < n and (before[tip] < 0 or is_blunt[tip] != 0 or _is_blocked(ring, corners, tip, n_blunt)):
            tip += 1
            if flag[0] != 0:
                return n_ears
        if tip == n or ring.wanted[0] != 0 or flag[0] != 0:
            return n_ears
        left, right = before[tip], after[tip]
        ears[n_ears, 0], ears[n_ears, 1], ears[n_ears, 2] = left, tip, right
        after[left], before[right], before[tip] = right, left, -1
        for corner in (left, right):
            corners.n_passed[corner], corners.blocker[corner] = 0, -1
            is_blunt[corner] = is_blunt[corner] != 0 and turn(ring, before[corner], corner, after[corner]) <= 0
    return n - 2


@inline
def _is_blocked(ring: Ring, corners: Corners, tip: int, n_blunt: int) -> bool:
    """Return whether a blunt corner lies in the closed triangle at the convex corner `tip`. The search goes on where
    the last one at this corner stopped. n_blunt: length of `corners.blunt`; blunt corners are never cut."""
    left, right, x, y = corners.before[tip], corners.after[tip], ring.x, ring.y
    if corners.blocker[tip] >= 0 and corners.is_blunt[corners.blocker[tip]] != 0:
        return True
    x_low, x_high = min(x[left], x[tip], x[right]), max(x[left], x[tip], x[right])
    y_low, y_high = min(y[left], y[tip], y[right]), max(y[left], y[tip], y[right])
    for place in range(corners.n_passed[tip], n_blunt):
        p = corners.blunt[place]
        if corners.is_blunt[p] == 0 or x[p] < x_low or x[p] > x_high or y[p] < y_low or y[p] > y_high:
            continue
        if p != left and p != right and turn(ring, left, tip, p) >= 0 and turn(ring, tip, right, p) >= 0:
            if turn(ring, right, left, p) >= 0:
                corners.n_passed[tip], corners.blocker[tip] = place + 1, p
                return True
    corners.n_passed[tip] = n_blunt
    return False
