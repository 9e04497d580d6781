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
simple (crossing or touching sides, repeated positions, no area) is refused; every other face is cut, in n log n.

Strictly convex faces, nearly all of real meshes, are certified for many faces at once by floating-point signs with a
proven bound; the others are looked at one by one (`simple_ring.py`) and cut (`ears.py`).

Source: G. H. Meisters, "Polygons have ears", 1975; H. ElGindy, H. Everett, G. Toussaint, "Slicing an ear using
prune-and-search", 1993. Changed: exact signs, closed triangles, the fixed scan.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.errors import FaceNotSimpleError
from engine.parallel import Budget
from engine.predicates.rational import orient2d_rational, scaled_integers
from engine.solids import ears as ears_of
from engine.solids import simple_ring
from engine.solids.checks import digits
from engine.solids.ears import cut_ears
from engine.solids.simple_ring import ENDED_EARLY, SIMPLE, TURNS_BACK, Ring, find_meeting

_TINY: Final = 1e-300  # far above what underflow takes from a sum of products (a few times 2^-1075)
_ROUNDOFF: Final = 2.0**-53
_CORNERS_AT_ONCE: Final = 1 << 15
_SPREAD: Final = (
    (16, 0x0000FFFF0000FFFF), (8, 0x00FF00FF00FF00FF), (4, 0x0F0F0F0F0F0F0F0F), (2, 0x3333333333333333),
    (1, 0x5555555555555555),
)  # fmt: skip
"""How the bits of a number are moved apart, half the way at a time, and which are kept."""


def cut_faces(
    vertices: FloatArray, offsets: IntArray, indices: IntArray, merged: IntArray, budget: Budget
) -> tuple[IntArray, IntArray]:
    """Return the triangles of all faces (their indices from `merged`, flat) and the face each was cut from.

    offsets, indices: the faces as given; merged: the same corners with equal positions made one index.
    Raises: FaceNotSimpleError, DeadlineExceededError, CancelledError.
    """
    counts = np.diff(offsets)
    starts = np.append(np.int64(0), np.cumsum(counts - 2))
    corners = np.empty((int(starts[-1]), 3), np.int64)  # positions in `merged`
    for count, faces in _groups(counts):
        budget.check()
        if count == 3:
            corners[starts[faces]] = offsets[faces, None] + np.arange(3)
            continue
        is_convex = _certify_convex(vertices[merged[offsets[faces, None] + np.arange(count)]])
        tips = np.arange(count - 2)
        fan = np.stack([np.full(count - 2, count - 1), tips, tips + 1], axis=1)
        corners[starts[faces[is_convex], None] + tips] = offsets[faces[is_convex], None, None] + fan
        for face in faces[~is_convex].tolist():
            ring = merged[offsets[face] : offsets[face + 1]]
            ears = cut_ring(vertices[ring], face, indices[offsets[face] : offsets[face + 1]], budget)
            corners[starts[face] : starts[face + 1]] = offsets[face] + ears
    triangle_faces = np.repeat(np.arange(len(counts)), counts - 2)
    return merged[corners.ravel()], triangle_faces


def _groups(counts: IntArray) -> Iterator[tuple[int, IntArray]]:
    """Yield the faces of every number of corners, so many at a time that each step takes some milliseconds."""
    for count in np.unique(counts).tolist():
        faces = np.flatnonzero(counts == count)
        at_once = _CORNERS_AT_ONCE // count + 1
        for first in range(0, len(faces), at_once):
            yield count, faces[first : first + at_once]


def _certify_convex(rings: FloatArray) -> BoolArray:
    """Tell for each ring ``(m, k, 3)`` whether it is certainly strictly convex in its projection; False: unsure or not.

    Where rounding leaves open along which axis the area is largest, it must be convex along each that may be: the fan
    is the same.
    """
    # bound: brought to size 1 by a power of two; what that takes from tiny coordinates, 2^-1075, is far below _TINY
    rings = np.ldexp(rings, -np.frexp(np.abs(rings).max())[1])
    area, bound = _areas(rings)
    result: BoolArray = np.ones(len(rings), np.bool_)
    least = (np.abs(area) - bound).max(axis=0)
    for axis in range(3):
        is_smaller = np.abs(area[axis]) + bound[axis] < least
        u, v = rings[:, :, (axis + 1) % 3], rings[:, :, (axis + 2) % 3]
        result &= is_smaller | _turns_once(u, v, np.sign(area[axis]))
    return result


def _areas(rings: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return twice the area (3, m) along each axis of rings ``(m, k, 3)`` of numbers up to 1, and bounds on the errors.

    bound: 4 roundings a term and at most k in the sum, each below the sum of sizes; doubled.
    """
    area, bound = np.empty((2, 3, len(rings)))
    for axis, (first, second) in enumerate(_products(rings)):
        area[axis] = (first - second).sum(axis=1)
        sizes = (np.abs(first) + np.abs(second)).sum(axis=1)
        bound[axis] = 2.0 * (rings.shape[1] + 4) * _ROUNDOFF * sizes + _TINY
    return area, bound


def _products(rings: NDArray[Any]) -> Iterator[tuple[NDArray[Any], NDArray[Any]]]:
    """Yield for each axis the products whose differences, ``(m, k - 2)``, add up to twice the area along it."""
    spokes = rings[:, 1:] - rings[:, :1]
    for axis in range(3):
        u, v = spokes[:, :, (axis + 1) % 3], spokes[:, :, (axis + 2) % 3]
        yield u[:, :-1] * v[:, 1:], u[:, 1:] * v[:, :-1]


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
    last = np.maximum.accumulate(np.where(rises == 0.0, 0, np.arange(u.shape[1])), axis=1)
    rises = np.take_along_axis(rises, last, axis=1)  # a vertical side goes on as the one before it did
    rises = np.where(rises == 0.0, rises[:, -1:], rises)  # vertical sides at the start follow the last one
    result: BoolArray = is_strict & ((rises != np.roll(rises, 1, axis=1)).sum(axis=1) == 2)
    return result


def cut_ring(points: FloatArray, face: int, names: IntArray, budget: Budget) -> IntArray:
    """Return the ears (k - 2, 3) of one face as positions in its ring ``(k, 3)``, in the order they are cut; exact.

    face, names: the number of the face and the caller's indices of its corners, for the message. budget: polled.
    """
    axes = _axes_of_largest_area(points)
    if axes is None:
        raise _not_simple(points, face, names, "has no area in any projection")
    n, flat = len(points), points[:, axes]
    x, y = np.ascontiguousarray(flat[:, 0]), np.ascontiguousarray(flat[:, 1])
    by_x, ranks = np.lexsort((y, x)), np.empty((2, n), np.int64)
    ranks[0, by_x] = ranks[1, np.argsort(y, kind="stable")] = np.arange(n)
    found, ears = np.zeros(2, np.int64), np.empty((n - 2, 3), np.int64)
    numbers = np.random.default_rng(0).permutation(n)
    settled = np.empty((0, 4), np.int64)
    while True:  # bound: each turn settles a sign that is asked for once
        ring = Ring(x, y, settled, np.zeros(4, np.int64))
        result = find_meeting(ring, by_x, ranks[0], *simple_ring.room_for(n), found, budget.flag)
        if result == SIMPLE:
            tree, links = ears_of.room_for(flat, np.argsort(_morton(ranks)))
            if cut_ears(ring, tree, links, numbers, np.empty((3, n), np.int64), ears, budget.flag) == n - 2:
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


def _morton(ranks: IntArray) -> IntArray:
    """Return the bits of two rows (2, n) of numbers below 2^31 in turn."""
    for shift, mask in _SPREAD:
        ranks = (ranks | ranks << shift) & mask
    return ranks[0] << 1 | ranks[1]


def _axes_of_largest_area(points: FloatArray) -> list[int] | None:
    """Return the two axes to keep, in the order in which the ring runs counter-clockwise; None if it has no area.

    In floats where their bound says so (that of `_certify_convex`), else in whole numbers.
    """
    areas, bound = _areas(np.ldexp(points, -np.frexp(np.abs(points).max())[1])[None])
    area: list[Any] = areas[:, 0].tolist()
    if (np.abs(areas) + bound >= (np.abs(areas) - bound).max()).sum() > 1:
        whole = np.array(scaled_integers(points.ravel().tolist()), object).reshape(1, -1, 3)
        area = [(first - second).sum() for first, second in _products(whole)]
    sizes = list(map(abs, area))
    axis = sizes.index(max(sizes))  # the first axis on a tie
    if area[axis] == 0:
        return None
    u, v = (axis + 1) % 3, (axis + 2) % 3
    return [u, v] if area[axis] > 0 else [v, u]
