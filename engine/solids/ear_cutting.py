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
simple (crossing or touching sides, repeated positions, no area) is refused.

Strictly convex faces, nearly all of real meshes, are certified for many faces at once by floating-point signs with a
proven bound; the others are cut one by one in integer arithmetic.

Source: G. H. Meisters, "Polygons have ears", 1975; H. ElGindy, H. Everett, G. Toussaint, "Slicing an ear using
prune-and-search", 1993. Changed: exact signs, closed triangles, the fixed scan.
"""

from __future__ import annotations

import heapq
from itertools import pairwise
from typing import Final, cast

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.errors import FaceNotSimpleError, TooComplexError
from engine.predicates.rational import scaled_integers
from engine.solids.checks import digits

IntPoint = tuple[int, int]

MAX_LOOKS: Final = 100
"""Most looks for an ear, times the number of corners of a face; real faces need 2 to 5."""

_TINY: Final = 1e-300  # far above what underflow takes from a sum of products (a few times 2^-1075)
_ROUNDOFF: Final = 2.0**-53


def cut_faces(
    vertices: FloatArray, offsets: IntArray, indices: IntArray, merged: IntArray
) -> tuple[IntArray, IntArray]:
    """Return the triangles of all faces (their indices from `merged`, flat) and the face each was cut from.

    offsets, indices: the faces as given; merged: the same corners with equal positions made one index.
    Raises: FaceNotSimpleError.
    """
    counts = np.diff(offsets)
    starts = np.append(np.int64(0), np.cumsum(counts - 2))
    corners = np.empty((int(starts[-1]), 3), np.int64)  # positions in `merged`
    for count in np.unique(counts).tolist():
        faces = np.flatnonzero(counts == count)
        if count == 3:
            corners[starts[faces]] = offsets[faces, None] + np.arange(3)
            continue
        is_convex = _certify_convex(vertices[merged[offsets[faces, None] + np.arange(count)]])
        fan = np.array([(count - 1, tip, tip + 1) for tip in range(count - 2)])
        for i_ear in range(count - 2):
            corners[starts[faces[is_convex]] + i_ear] = offsets[faces[is_convex], None] + fan[i_ear]
        for face in faces[~is_convex].tolist():
            ring = merged[offsets[face] : offsets[face + 1]]
            ears = cut_ring(vertices[ring], face, indices[offsets[face] : offsets[face + 1]])
            corners[starts[face] : starts[face + 1]] = offsets[face] + np.array(ears)
    triangle_faces = np.repeat(np.arange(len(counts)), counts - 2)
    return merged[corners.ravel()], triangle_faces


def _certify_convex(rings: FloatArray) -> BoolArray:
    """Tell for each ring ``(m, k, 3)`` whether it is certainly strictly convex in its projection; False: unsure or not.

    Where rounding leaves open along which axis the area is largest, it must be convex along each that may be: the fan
    is the same.
    """
    n_corners = rings.shape[1]
    # bound: brought to size 1 by a power of two; what that takes from tiny coordinates, 2^-1075, is far below _TINY
    rings = np.ldexp(rings, -np.frexp(np.abs(rings).max())[1])
    area, bound = np.empty((2, 3, len(rings)))
    result: BoolArray = np.ones(len(rings), np.bool_)
    spokes = rings[:, 1:] - rings[:, :1]
    for axis in range(3):
        u, v = spokes[:, :, (axis + 1) % 3], spokes[:, :, (axis + 2) % 3]
        first, second = u[:, :-1] * v[:, 1:], u[:, 1:] * v[:, :-1]
        area[axis] = (first - second).sum(axis=1)
        # bound: 4 roundings a term and at most k in the sum, each below the sum of sizes; doubled
        sizes = (np.abs(first) + np.abs(second)).sum(axis=1)
        bound[axis] = 2.0 * (n_corners + 4) * _ROUNDOFF * sizes + _TINY
    least = (np.abs(area) - bound).max(axis=0)
    for axis in range(3):
        is_smaller = np.abs(area[axis]) + bound[axis] < least
        u, v = rings[:, :, (axis + 1) % 3], rings[:, :, (axis + 2) % 3]
        result &= is_smaller | _turns_once(u, v, np.sign(area[axis]))
    return result


def _turns_once(u: FloatArray, v: FloatArray, way: FloatArray) -> BoolArray:
    """Tell whether each plane ring certainly turns strictly one way at every corner, and around once.

    way: 1 for left turns, -1 for right turns. Around once: the first coordinate rises and falls once (comparisons of
    floats are exact).
    """
    du, dv = np.roll(u, -1, axis=1) - u, np.roll(v, -1, axis=1) - v
    first, second = du * np.roll(dv, -1, axis=1), np.roll(du, -1, axis=1) * dv
    # bound: two differences, a product each, one difference: (1 + eps)^4 - 1 < 4.1 eps; 8 eps is taken
    bound = 8.0 * _ROUNDOFF * (np.abs(first) + np.abs(second)) + _TINY
    is_strict = ((first - second) * way[:, None] > bound).all(axis=1)
    rises = np.sign(du)  # exact: a difference of floats is zero or has the right sign
    for i_corner in range(1, u.shape[1]):  # a vertical side goes on as the one before it did
        rises[:, i_corner] = np.where(rises[:, i_corner] == 0.0, rises[:, i_corner - 1], rises[:, i_corner])
    rises = np.where(rises == 0.0, rises[:, -1:], rises)  # vertical sides at the start follow the last one
    result: BoolArray = is_strict & ((rises != np.roll(rises, 1, axis=1)).sum(axis=1) == 2)
    return result


def cut_ring(points: FloatArray, face: int, names: IntArray) -> list[tuple[int, int, int]]:
    """Return the ears of one face as positions in its ring ``(k, 3)``, in the order they are cut; exact.

    face, names: the number of the face and the caller's indices of its corners, for the message.
    """
    axes = _axes_of_largest_area(_integers(points))
    problem = "has no area in any projection" if axes is None else None
    if axes is not None:
        ring = _Ring(points[:, axes])
        problem = ring.not_simple(names)
    if problem is not None:
        raise FaceNotSimpleError(
            f"faces[{face}] = {names[:12].tolist()}{'...' if len(names) > 12 else ''} {problem}; "
            f"its first vertex is {digits(points[0])}; cut it into triangles",
            ("faces", face),
        )
    ears = ring.ears()
    if ears is None:
        raise TooComplexError(
            f"faces[{face}] has {len(points)} vertices and winds too much to be cut here; cut it into triangles",
            ("faces", face),
        )
    return ears


def _integers(points: FloatArray) -> list[tuple[int, ...]]:
    """Return the points times one power of two that makes all coordinates whole."""
    flat = iter(scaled_integers(points.ravel().tolist()))
    return list(zip(*[flat] * points.shape[1]))


def _axes_of_largest_area(points: list[tuple[int, ...]]) -> list[int] | None:
    """Return the two axes to keep, in the order in which the ring runs counter-clockwise; None if it has no area."""
    area = [0, 0, 0]
    x0, y0, z0 = points[0]
    for (ax, ay, az), (bx, by, bz) in pairwise(points[1:]):
        area[0] += (ay - y0) * (bz - z0) - (by - y0) * (az - z0)
        area[1] += (az - z0) * (bx - x0) - (bz - z0) * (ax - x0)
        area[2] += (ax - x0) * (by - y0) - (bx - x0) * (ay - y0)
    sizes = [abs(component) for component in area]
    axis = sizes.index(max(sizes))  # the first axis on a tie
    if area[axis] == 0:
        return None
    u, v = (axis + 1) % 3, (axis + 2) % 3
    return [u, v] if area[axis] > 0 else [v, u]


def _turn(a: IntPoint, b: IntPoint, c: IntPoint) -> int:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


class _Ring:
    """One counter-clockwise ring of area > 0: integers for signs, the same points as floats for culling by boxes."""

    def __init__(self, flat: FloatArray) -> None:
        self.flat = np.ascontiguousarray(flat.T)
        self.points = cast(list[IntPoint], _integers(flat))

    def not_simple(self, names: IntArray) -> str | None:
        """Return what keeps the ring from being simple, None if nothing does."""
        points, n = self.points, len(self.points)
        for i in range(n):
            a, b, c = points[i - 1], points[i], points[(i + 1) % n]
            ahead = (a[0] - b[0]) * (c[0] - b[0]) + (a[1] - b[1]) * (c[1] - b[1])
            if b == c or (_turn(a, b, c) == 0 and ahead > 0):
                return f"stands still or turns back on itself at vertex {names[i]}"
        ends = np.roll(self.flat, -1, axis=1)
        low, high = np.minimum(self.flat, ends), np.maximum(self.flat, ends)
        for i in range(n - 2):
            others = slice(i + 2, n - 1 if i == 0 else n)  # sides that share no corner with side i
            near = (low[:, others] <= high[:, i : i + 1]) & (high[:, others] >= low[:, i : i + 1])
            for j in (np.flatnonzero(near[0] & near[1]) + i + 2).tolist():
                if _boxed_segments_meet(points[i], points[i + 1], points[j], points[(j + 1) % n]):
                    return (
                        f"is not simple in the projection of largest area: side {names[i]}-{names[i + 1]} "
                        f"meets side {names[j]}-{names[(j + 1) % n]}"
                    )
        return None

    def ears(self) -> list[tuple[int, int, int]] | None:
        """Cut a simple ring; None if that takes more than `MAX_LOOKS` looks for each corner.

        invariant: a corner outside the heap is no ear: it is not strictly convex, or its `blocker` is still there.
        bound: every turn of the loop takes a corner from the heap; a cut, of which there are n - 3, puts back its two
        neighbours and those it blocked; the cap ends rings made to block each other again and again.
        """
        points, n = self.points, len(self.points)
        before, after = [(i - 1) % n for i in range(n)], [(i + 1) % n for i in range(n)]
        is_blunt = np.array([_turn(points[i - 1], points[i], points[(i + 1) % n]) <= 0 for i in range(n)])
        blocked_by: dict[int, list[int]] = {}
        is_there, waiting = [True] * n, list(range(n))
        ears: list[tuple[int, int, int]] = []
        n_looks = 0
        while len(ears) < n - 3:
            tip = heapq.heappop(waiting)
            if not is_there[tip] or is_blunt[tip]:
                continue
            n_looks += 1
            if n_looks > MAX_LOOKS * n:
                return None
            left, right = before[tip], after[tip]
            blocker = self._blocker(left, tip, right, is_blunt)
            if blocker is not None:
                blocked_by.setdefault(blocker, []).append(tip)
                continue
            ears.append((left, tip, right))
            is_there[tip] = False
            after[left], before[right] = right, left
            changed = [left, right]
            for corner in (left, right):
                if is_blunt[corner] and _turn(points[before[corner]], points[corner], points[after[corner]]) > 0:
                    is_blunt[corner] = False
                    changed += blocked_by.pop(corner, [])
            for corner in changed:
                heapq.heappush(waiting, corner)
        first = is_there.index(True)
        return [*ears, (before[first], first, after[first])]

    def _blocker(self, left: int, tip: int, right: int, is_blunt: BoolArray) -> int | None:
        """Return a vertex in the closed triangle of a strictly convex corner, None if there is none.

        Only corners that are not strictly convex need a look: of the vertices in the triangle the one nearest the tip
        has an inner angle of 180 degrees or more. No blunt corner is ever cut, so that none of them is gone.
        """
        corners = self.flat[:, [left, tip, right]]
        (low_u, low_v), (high_u, high_v) = corners.min(axis=1), corners.max(axis=1)
        u, v = self.flat
        near = is_blunt & (u >= low_u) & (u <= high_u) & (v >= low_v) & (v <= high_v)
        a, b, c = self.points[left], self.points[tip], self.points[right]
        for corner in np.flatnonzero(near).tolist():
            if corner != left and corner != right:
                p = self.points[corner]
                if _turn(a, b, p) >= 0 and _turn(b, c, p) >= 0 and _turn(c, a, p) >= 0:
                    return corner
        return None


def _boxed_segments_meet(a: IntPoint, b: IntPoint, c: IntPoint, d: IntPoint) -> bool:
    """Tell whether two closed segments whose boxes overlap have a common point."""
    abc, abd, cda, cdb = _turn(a, b, c), _turn(a, b, d), _turn(c, d, a), _turn(c, d, b)
    apart_on_ab = (abc > 0 and abd > 0) or (abc < 0 and abd < 0)
    apart_on_cd = (cda > 0 and cdb > 0) or (cda < 0 and cdb < 0)
    return not (apart_on_ab or apart_on_cd)  # all four zero: collinear, and their boxes overlap
