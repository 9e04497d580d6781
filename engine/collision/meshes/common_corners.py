"""Pairs of faces that meet in a common corner and nowhere else: told quickly, and few of them kept.

Where many faces of either body share one point, each meets each of the other's there: the square of their number says
no more than that they are in contact. Such a pair names no other witness than a vertex on a vertex, cuts no face and
proves nothing, so a search kept for many contacts lists it only while one of its faces is not known to be in contact,
and keeps aside those that stand first among all, which name the witness.
"""

from __future__ import annotations

from typing import Any

from engine.collision.meshes.contact_kinds import N_NAMED
from engine.collision.meshes.triangle_triangle import Facet, bound_near, corner
from engine.jit import inline, merged
from engine.predicates.posed import surely_same
from engine.predicates.vectors import cross, dot, largest_of, minus
from engine.types import Point3


@inline
def _sides(a: Point3, b: Point3, c: Point3, d: Point3, error: float) -> tuple[int, int]:
    """Return on which sides of the plane of the origin, a and b the points c and d surely lie, 0 where unsure."""
    n, bound = cross(a, b), bound_near(a, b, c, d, d, error)
    one, other = dot(n, c), dot(n, d)
    return int(one > bound) - int(one < -bound), int(other > bound) - int(other < -bound)


@merged
def common_corner(poses: Any, t: Facet, u: Facet, own: Facet, their: Facet, error: float) -> int:
    """Return 3 k + m where corner k of a face surely is corner m of another, and they have no other common point, else
    -1; t, u: the rounded posed triangles, each coordinate off by at most `error`; own, their: before their poses.

    The other corners v, w of one lie strictly on one side of the plane of the other, which it meets in the corner; or
    both straddle, and from the corner leave along the line of the planes in opposite directions. With normals m and n
    that is m x n times the sign of n . v, and n x m times that of m . x, x the corner of the other that stands for v.
    """
    for k in range(3):
        for m in range(3):
            p, q = corner(t, k), corner(u, m)
            if not largest_of(minus(p, q)) <= 2.0 * error:
                continue
            v, w = minus(corner(t, k + 1), p), minus(corner(t, k + 2), p)
            x, y = minus(corner(u, m + 1), q), minus(corner(u, m + 2), q)
            by_x, by_y = _sides(v, w, x, y, error)
            if by_x * by_y != 1:
                by_v, by_w = _sides(x, y, v, w, error)
                if by_v * by_w == 0 or (by_v * by_w < 0 and (by_x * by_y == 0 or by_v != by_x)):
                    return -1
            return 3 * k + m if error == 0.0 or surely_same(poses, corner(own, k), corner(their, m)) else -1
    return -1


@merged
def keep_first(faces: Any, their_faces: Any, pairs: Any, kinds: Any, i: int, j: int, kind: int) -> tuple[int, int, int]:
    """Put a pair among the last N_NAMED rows, in order, those not used -1; return the one that then has no place there,
    -1 where all have."""
    n = kinds.shape[0]
    for place in range(n - N_NAMED if _stands_before(faces, their_faces, i, j, pairs, n - 1) else n, n):
        if _stands_before(faces, their_faces, i, j, pairs, place):
            p, q, other = pairs[place, 0], pairs[place, 1], kinds[place]
            pairs[place, 0], pairs[place, 1], kinds[place] = i, j, kind
            i, j, kind = p, q, int(other)
            if i < 0:
                break
    return i, j, kind


@inline
def _stands_before(faces: Any, their_faces: Any, i: int, j: int, pairs: Any, place: int) -> bool:
    """Tell whether a pair is named before that of a row: by the callers' faces, then by the numbers."""
    p, q = pairs[place, 0], pairs[place, 1]
    return p < 0 or (faces[i], their_faces[j], i, j) < (faces[p], their_faces[q], p, q)
