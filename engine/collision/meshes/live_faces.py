"""The parts of a body's faces that even-odd does not cancel: only beside those lies the body's open interior.

Most faces are whole: no other face of the body covers a part of them. A stacked face (see `face_state.py`) is cut into
cells (`exact_regions.py`); one with the open interior on one side is live. Also how far a point is from a face.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import chain, pairwise
from typing import Any

from engine.budget import Budget
from engine.collision.exact_images import Vector, as_vector
from engine.collision.meshes.exact_body import ExactBody
from engine.collision.meshes.exact_regions import cells_of, sides_at
from engine.collision.meshes.face_state import state_at
from engine.collision.meshes.mesh_arrays import NO_AREA, STATE_STACKED, MeshBody
from engine.predicates.rational import common_integers, cross, dot, minus, squared_length


def segment_distance(point: Sequence[Any], a: Sequence[Any], b: Sequence[Any]) -> Fraction:
    """Return the squared distance from `point` to the closed segment a b, which may be a point."""
    along, to_point = minus(b, a), minus(point, a)
    length, t = squared_length(along), dot(to_point, along)
    if t <= 0 or t >= length:
        return Fraction(squared_length(minus(point, b) if t > 0 else to_point))
    return squared_length(to_point) - Fraction(t * t, length)


def simplex_distance(point: Vector, corners: Sequence[Vector]) -> Fraction:
    """Return the squared distance from `point` to the closed segment or triangle of these corners, degenerate or not.

    Over an open triangle it is the distance to the plane, elsewhere that to the nearest edge. In integers, with a
    twentieth of the time that fractions take.
    """
    d, (numbers, scale) = len(point), common_integers([*point, *chain(*corners)])
    q, *ends = [tuple(numbers[at : at + d]) for at in range(0, len(numbers), d)]
    if len(ends) == 2:
        return segment_distance(q, *ends) / scale**2
    edges = list(zip(ends, (*ends[1:], ends[0])))
    normal = cross(minus(ends[1], ends[0]), minus(ends[2], ends[0]))
    if any(normal) and all(dot(cross(minus(b, a), minus(q, a)), normal) >= 0 for a, b in edges):
        return Fraction(dot(normal, minus(q, ends[0])) ** 2, squared_length(normal) * scale**2)
    return min(segment_distance(q, a, b) for a, b in edges) / scale**2


def live_parts(mesh: MeshBody, face: int, budget: Budget) -> Iterator[tuple[Vector, ...]]:
    """Yield the corners of triangles that together are what even-odd leaves of one face, in the body's own coordinates:
    of a whole face its own."""
    if mesh.arrays.axis[face] == NO_AREA:
        return
    if state_at(mesh.arrays, face) != STATE_STACKED:
        yield tuple(map(as_vector, mesh.arrays.vertices[mesh.arrays.triangles[face]].tolist()))
        return
    body = ExactBody(mesh, None, mesh.shift)
    for middle, corners in cells_of(body, face, budget):
        sides = sides_at(body, middle, body.axis(face))
        if sides.above != sides.below:
            a, *others = (tuple(Fraction(x, w << mesh.shift) for x in xyz) for *xyz, w in corners)
            yield from ((a, *pair) for pair in pairwise(others))
