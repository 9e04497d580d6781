"""Compiled: which pairs of triangles of a mesh certainly have no common point but their common corners and edge.

A pair is apart where a plane of one of them has all other corners of the other strictly on one side. Of two that share
an edge the far corner is enough. The filter of orient3d decides; what it leaves open stays a candidate.

Source: S. Gottschalk, Separating axis theorem, 1996: the normal of a face as the first axis.
"""

from __future__ import annotations

from engine.compiling.jit import inline, kernel
from engine.predicates.orientation import orient3d_filter
from engine.predicates.vectors import as_point3, corners_of
from engine.types import UNDECIDED, BoolArray, FloatArray, IntArray


@inline
def _is_beside(points: FloatArray, faces: IntArray, face: int, other: int) -> bool:
    """Return whether all corners of `other` that are not corners of `face` lie strictly on one side of its plane."""
    a, b, c = corners_of(points, faces, face)
    side = 0
    for k in range(3):
        corner = faces[other, k]
        if corner != faces[face, 0] and corner != faces[face, 1] and corner != faces[face, 2]:
            sign = orient3d_filter(a, b, c, as_point3(points, corner))
            if sign == UNDECIDED or (side != 0 and sign != side):
                return False
            side = sign
    return side != 0


@kernel
def find_candidates(points: FloatArray, faces: IntArray, pairs: IntArray, may_meet: BoolArray) -> None:
    """Fill may_meet (n,) with whether pairs (n, 2) of faces may meet besides their common corners."""
    for item in range(pairs.shape[0]):
        first, second = pairs[item, 0], pairs[item, 1]
        is_apart = _is_beside(points, faces, first, second) or _is_beside(points, faces, second, first)
        may_meet[item] = not is_apart
