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
from typing import Final

import numpy as np
import numpy.typing as npt

from engine.errors import FaceNotSimpleError
from engine.solids.base import FloatArray, IntArray
from engine.solids.checks import digits

IntPoint = tuple[int, int]

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


def _certify_convex(rings: FloatArray) -> npt.NDArray[np.bool_]:
    """Tell for each ring ``(m, k, 3)`` whether it is certainly strictly convex in its projection; False: unsure or not.

    Convex is: the sign of every corner is that of the area, and the direction of the sides turns around once (the first
    coordinate rises and falls once; comparisons of floats are exact).
    """
    n_corners = rings.shape[1]
    with np.errstate(all="ignore"):  # overflow ends as "unsure"
        edges = rings[:, 1:] - rings[:, :1]
        area, bound = np.empty((2, len(rings), 3))
        for axis in range(3):
            u, v = edges[:, :, (axis + 1) % 3], edges[:, :, (axis + 2) % 3]
            first, second = u[:, :-1] * v[:, 1:], u[:, 1:] * v[:, :-1]
            area[:, axis] = (first - second).sum(axis=1)
            # bound: 4 roundings a term and at most k in the sum, each below the sum of sizes; doubled
            sizes = (np.abs(first) + np.abs(second)).sum(axis=1)
            bound[:, axis] = 2.0 * (n_corners + 4) * _ROUNDOFF * sizes + _TINY
        largest = np.abs(area).argmax(axis=1)
        rows = np.arange(len(rings))
        others = np.abs(area) + bound
        others[rows, largest] = 0.0
        is_sure = np.abs(area[rows, largest]) - bound[rows, largest] > others.max(axis=1)
        u = np.take_along_axis(rings, ((largest + 1) % 3)[:, None, None], axis=2)[:, :, 0]
        v = np.take_along_axis(rings, ((largest + 2) % 3)[:, None, None], axis=2)[:, :, 0]
        du, dv = np.roll(u, -1, axis=1) - u, np.roll(v, -1, axis=1) - v
        first, second = du * np.roll(dv, -1, axis=1), np.roll(du, -1, axis=1) * dv
        turns = (first - second) * np.sign(area[rows, largest])[:, None]
        # bound: two differences, a product each, one difference: (1 + eps)^4 - 1 < 4.1 eps; 8 eps is taken
        is_sure &= (turns > 8.0 * _ROUNDOFF * (np.abs(first) + np.abs(second)) + _TINY).all(axis=1)
    rises = np.sign(du)  # exact: a difference of floats is zero or has the right sign
    for i_corner in range(1, n_corners):  # a vertical side goes on as the one before it did
        rises[:, i_corner] = np.where(rises[:, i_corner] == 0, rises[:, i_corner - 1], rises[:, i_corner])
    rises = np.where(rises == 0, rises[:, -1:], rises)  # vertical sides at the start follow the last one
    result: npt.NDArray[np.bool_] = is_sure & ((rises != np.roll(rises, 1, axis=1)).sum(axis=1) == 2)
    return result


def cut_ring(points: FloatArray, face: int, names: IntArray) -> list[tuple[int, int, int]]:
    """Return the ears of one face as positions in its ring ``(k, 3)``, in the order they are cut; exact.

    face, names: the number of the face and the caller's indices of its corners, for the message.
    """
    ring = _project(_integers(points))
    problem = "has no area in any projection" if ring is None else _not_simple(ring, names)
    if ring is None or problem is not None:
        raise FaceNotSimpleError(
            f"faces[{face}] = {names[:12].tolist()}{'...' if len(names) > 12 else ''} {problem}; "
            f"its first vertex is {digits(points[0])}; cut it into triangles",
            ("faces", face),
        )
    return _cut_ears(ring)


def _integers(points: FloatArray) -> list[tuple[int, ...]]:
    """Return the points times one power of two that makes all coordinates whole."""
    ratios = [[value.as_integer_ratio() for value in row] for row in points.tolist()]
    scale = max(denominator for row in ratios for _, denominator in row)
    return [tuple(numerator * (scale // denominator) for numerator, denominator in row) for row in ratios]


def _project(points: list[tuple[int, ...]]) -> list[IntPoint] | None:
    """Return the ring in the projection of largest area, turned to run counter-clockwise; None if it has no area."""
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
    if area[axis] < 0:
        u, v = v, u
    return [(point[u], point[v]) for point in points]


def _turn(a: IntPoint, b: IntPoint, c: IntPoint) -> int:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _not_simple(ring: list[IntPoint], names: IntArray) -> str | None:
    """Return what keeps the ring from being simple, None if nothing does."""
    n = len(ring)
    for i_corner in range(n):
        a, b, c = ring[i_corner - 1], ring[i_corner], ring[(i_corner + 1) % n]
        ahead = (a[0] - b[0]) * (c[0] - b[0]) + (a[1] - b[1]) * (c[1] - b[1])
        if b == c or (_turn(a, b, c) == 0 and ahead > 0):
            return f"turns back on itself or stands still at vertex {names[i_corner]}"
    order = sorted(range(n), key=lambda i: min(ring[i][0], ring[(i + 1) % n][0]))
    for position, i in enumerate(order):
        a, b = ring[i], ring[(i + 1) % n]
        right = max(a[0], b[0])
        for j in order[position + 1 :]:
            c, d = ring[j], ring[(j + 1) % n]
            if min(c[0], d[0]) > right:
                break
            if (i + 1) % n == j or (j + 1) % n == i:
                continue
            if _segments_meet(a, b, c, d):
                return (
                    f"is not simple in the projection of largest area: side {names[i]}-{names[(i + 1) % n]} "
                    f"meets side {names[j]}-{names[(j + 1) % n]}"
                )
    return None


def _segments_meet(a: IntPoint, b: IntPoint, c: IntPoint, d: IntPoint) -> bool:
    """Tell whether two closed segments have a common point."""
    if max(c[1], d[1]) < min(a[1], b[1]) or max(a[1], b[1]) < min(c[1], d[1]):
        return False
    if max(c[0], d[0]) < min(a[0], b[0]) or max(a[0], b[0]) < min(c[0], d[0]):
        return False
    abc, abd, cda, cdb = _turn(a, b, c), _turn(a, b, d), _turn(c, d, a), _turn(c, d, b)
    apart_on_ab = (abc > 0 and abd > 0) or (abc < 0 and abd < 0)
    apart_on_cd = (cda > 0 and cdb > 0) or (cda < 0 and cdb < 0)
    return not (apart_on_ab or apart_on_cd)  # all four zero: collinear, and the boxes overlap


def _cut_ears(ring: list[IntPoint]) -> list[tuple[int, int, int]]:
    """Cut a simple counter-clockwise ring. A heap holds the corners to look at, those known as no ears stand by.

    invariant: a corner outside the heap is no ear, because it is not strictly convex or its `blocker` is still there.
    bound: every turn of the loop takes a corner from the heap; a cut, of which there are n - 3, puts back its two
    neighbours and those it blocked.
    """
    n = len(ring)
    before, after = [(i - 1) % n for i in range(n)], [(i + 1) % n for i in range(n)]
    blunt = {i for i in range(n) if _turn(ring[i - 1], ring[i], ring[(i + 1) % n]) <= 0}
    blocked_by: dict[int, list[int]] = {}
    is_there, waiting = [True] * n, list(range(n))
    ears: list[tuple[int, int, int]] = []
    while len(ears) < n - 3:
        tip = heapq.heappop(waiting)
        if not is_there[tip] or tip in blunt:
            continue
        left, right = before[tip], after[tip]
        blocker = _blocker(ring, left, tip, right, blunt)
        if blocker is not None:
            blocked_by.setdefault(blocker, []).append(tip)
            continue
        ears.append((left, tip, right))
        is_there[tip] = False
        after[left], before[right] = right, left
        changed = blocked_by.pop(tip, [])
        for corner in (left, right):
            if corner in blunt and _turn(ring[before[corner]], ring[corner], ring[after[corner]]) > 0:
                blunt.remove(corner)
                changed += blocked_by.pop(corner, [])
            changed.append(corner)
        for corner in changed:
            heapq.heappush(waiting, corner)
    first = is_there.index(True)
    ears.append((before[first], first, after[first]))
    return ears


def _blocker(ring: list[IntPoint], left: int, tip: int, right: int, blunt: set[int]) -> int | None:
    """Return a vertex in the closed triangle of a strictly convex corner, None if there is none.

    Only corners that are not strictly convex need a look: of the vertices in the triangle the one nearest the tip has
    an inner angle of 180 degrees or more.
    """
    a, b, c = ring[left], ring[tip], ring[right]
    for corner in blunt:
        if corner != left and corner != right:
            p = ring[corner]
            if _turn(a, b, p) >= 0 and _turn(b, c, p) >= 0 and _turn(c, a, p) >= 0:
                return corner
    return None
