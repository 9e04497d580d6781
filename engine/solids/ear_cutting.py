"""Cuts polygonal faces into triangles by one fixed rule, so that a face that is not plane still bounds one solid.

The rule. Project the face along the axis on which its vector area is largest (on a tie the first of x, y, z). Scan the
ring from its first vertex for the first ear: a strictly convex corner whose closed triangle holds no other vertex of
the ring. Cut it, scan again from the first vertex that is left, until three are left. Every sign is exact; vertices in
the middle of a straight side are kept.

    3-----2     ears (3, 0, 1), then (3, 1, 2): a strictly convex face becomes
    |   / |     a fan about its last vertex
    | /   |     (each triangle is written: vertex before the tip, tip, vertex after)
    0-----1

Every simple polygon has such an ear: in a triangulation that uses all its vertices the dual tree has leaves, and no
vertex lies in or on the triangle of a leaf but its own corners; what is left is simple again. A projection that is not
simple (crossing or touching sides, repeated positions, no area) is refused; every other face is cut, in n^2 at most.

Strictly convex faces, nearly all of real meshes, are certified by floating-point signs with a proven bound; the others
are looked at one by one and cut (`ears.py`). Where rounding leaves open along which axis the area of
a face is largest, it must be convex along each that may be: the fan is the same. A ring turns strictly one way at every
corner and around once if every turn has that sign and the first coordinate rises and falls once (comparisons of floats
are exact).

**Bounds.** A face is brought to size 1 by a power of two; what that takes from tiny coordinates, 2^-1075, is far below
`_TINY`. A product of differences carries three roundings, a term four, a sum of k terms at most k more, each below the
sum of sizes; doubled.

Source: G. H. Meisters, "Polygons have ears", 1975; H. ElGindy, H. Everett, G. Toussaint, "Slicing an ear using
prune-and-search", 1993. Changed: exact signs, closed triangles, the fixed scan.
"""

from __future__ import annotations

from math import frexp, ldexp
from typing import Final

import numpy as np

from engine.arrays import FlagArray, FloatArray, Int8Array, IntArray
from engine.direct import entry_of
from engine.errors import FaceNotSimpleError
from engine.jit import inline, kernel
from engine.predicates.rational import orient2d_rational, scaled_integers
from engine.running.budget import Budget
from engine.solids.checks import digits
from engine.solids.ears import ENDED_EARLY, SIMPLE, TURNS_BACK, Corners, Ring, cut_ears, find_meeting

CONVEX, UNSURE = 0, 4
_TINY: Final = 1e-300  # far above what underflow takes from a sum of products (a few times 2^-1075)
_ROUNDOFF: Final = 2.0**-53
_POLL: Final = 0x3FF


def cut_faces(
    vertices: FloatArray, offsets: IntArray, indices: IntArray, merged: IntArray, budget: Budget
) -> tuple[IntArray, IntArray]:
    """Return the triangles of all faces (their indices from `merged`, flat) and the face each was cut from.

    offsets, indices: the faces as given; merged: the same corners with equal positions made one index.
    Raises: FaceNotSimpleError, DeadlineExceededError, CancelledError.
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
    """Return the ears (k - 2, 3) of one face as positions in its ring ``(k, 3)``, in the order they are cut; exact.

    projection: of `cut_convex_faces`. face, names: the number of the face and the caller's indices of its corners, for
    the message. budget: polled.
    """
    if projection == UNSURE:
        projection = _projection_of_largest_area(points)
    axis = abs(projection) - 1
    axes = [(axis + 1) % 3, (axis + 2) % 3] if projection > 0 else [(axis + 2) % 3, (axis + 1) % 3]
    if projection == 0:
        raise _not_simple(points, face, names, "has no area in any projection")
    n, flat = len(points), points[:, axes]
    x, y = np.ascontiguousarray(flat[:, 0]), np.ascontiguousarray(flat[:, 1])
    found, ears = np.zeros(2, np.int64), np.empty((n - 2, 3), np.int64)
    settled = np.empty((0, 4), np.int64)
    while True:  # bound: each turn settles a sign that is asked for once
        ring = Ring(x, y, settled, np.zeros(4, np.int64))
        result = find_meeting(ring, found, budget.flag)
        if result == SIMPLE and cut_ears(ring, Corners(*np.empty((6, n), np.int64)), ears, budget.flag) == n - 2:
            return ears
        budget.check()
        if ring.wanted[0] == 0:
            break
        i, j, k = ring.wanted[1:].tolist()
        sign = orient2d_rational(*flat[[i, j, k]].tolist())
        settled = np.concatenate([settled, [[i, j, k, sign]]])
    assert result not in (SIMPLE, ENDED_EARLY), "a simple ring without an ear"
    first, second = found.tolist()
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
    """Return the number from 1 of the axis along which the area is largest, of equal ones the first, negative where
    that is negative; 0 if the ring has no area."""
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
    """Return twice the area along an axis of the face of the corners from the first up to the last, and a bound on its
    error."""
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
    """Tell whether a face certainly turns strictly one way at every corner, and around once."""
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
    """Return CONVEX, or the number from 1 of the axis along which the area is largest, negative where that is negative;
    UNSURE where rounding leaves that open."""
    largest, least, found, is_convex = 0.0, -1.0, 0, True
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
            found = UNSURE if found != 0 or abs(area) <= bound else axis + 1 if area > 0.0 else -axis - 1
    return CONVEX if is_convex else found


@kernel
def cut_convex_faces(
    vertices: FloatArray, offsets: IntArray, merged: IntArray, starts: IntArray, corners: IntArray,
    projections: Int8Array, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill corners (starts[-1], 3) with positions in `merged`: the triangles of face i from starts[i] on, fans about
    the last corner; faces that are not certainly convex are left out. projections (m,) int8: see `_projection`."""
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
