"""The parts of a body's faces that even-odd does not cancel: only beside those lies the body's open interior.

Most faces are whole: no other face of the body covers a part of them. A stacked face (see `face_state.py`) is cut, in
the plane it shares with those that cover it, into regions; a region covered an odd number of times is live.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain
from typing import Any

import numpy as np

from engine.arrangement.arrange import arrange
from engine.arrangement.nodes import float_nodes
from engine.arrangement.subdivision import label_faces, subdivide
from engine.budget import Budget
from engine.collision.exact_images import Vector, as_vector
from engine.collision.meshes.face_state import states_of
from engine.collision.meshes.mesh_arrays import NO_AREA, STATE_STACKED, MeshBody
from engine.predicates.rational import (
    common_integers,
    cross,
    dot,
    largest_axis,
    minus,
    orient2d_rational,
    orient3d_rational,
    squared_length,
)

Point2 = tuple[Fraction, Fraction]
IN_FACE, IN_ODD, LIVE = 1, 2, 3


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


@dataclass(frozen=True, slots=True)
class LivePiece:
    """What is live of one face: its corners, and the edges around the live regions (None: the whole face).

    A whole edge of the plane has two corners.
    """

    corners: tuple[Vector, ...]
    edges: list[tuple[Vector, Vector]] | None

    def vertices(self) -> list[Vector]:
        """Return points whose convex hull is that of the live part."""
        return list(self.corners) if self.edges is None else [end for edge in self.edges for end in edge]

    def moved(self, image: Callable[[Vector], Vector]) -> LivePiece:
        """Return the piece with every point replaced by its image."""
        edges = None if self.edges is None else [(image(start), image(end)) for start, end in self.edges]
        return LivePiece(tuple(map(image, self.corners)), edges)

    def farthest(self, point: Vector) -> Fraction:
        """Return the largest squared distance from `point` to the live part."""
        return max(squared_length(minus(p, point)) for p in self.vertices())

    def squared_distance(self, point: Vector) -> Fraction:
        """Return the squared distance from `point` to the live part."""
        if self.edges is None:
            return simplex_distance(point, self.corners)
        a, b, c = self.corners
        normal = cross(minus(b, a), minus(c, a))
        height = dot(normal, minus(point, a)) / squared_length(normal)
        foot, axis = tuple(p - height * n for p, n in zip(point, normal)), largest_axis(normal)
        if _is_within(_flat(foot, axis), [(_flat(start, axis), _flat(end, axis)) for start, end in self.edges]):
            return squared_length(minus(point, foot))
        return min(segment_distance(point, *edge) for edge in self.edges)


def live_piece(mesh: MeshBody, face: int, budget: Budget) -> LivePiece | None:
    """Return what even-odd leaves of one triangle, in the body's own coordinates; None where nothing is left."""
    arrays = mesh.arrays
    if arrays.axis[face] == NO_AREA:
        return None
    a, b, c = arrays.vertices[arrays.triangles[face]].tolist()
    corners = as_vector(a), as_vector(b), as_vector(c)
    if states_of(arrays, np.array([face]))[0] != STATE_STACKED:
        return LivePiece(corners, None)
    edges = _live_edges(mesh, face, corners, budget)
    return LivePiece(corners, edges) if edges else None


def _live_edges(
    mesh: MeshBody, face: int, corners: tuple[Vector, Vector, Vector], budget: Budget
) -> list[tuple[Vector, Vector]]:
    """Return the edges between live and other regions of a stacked face."""
    arrays = mesh.arrays
    points = arrays.vertices[arrays.triangles]
    low, high = points.min(axis=1), points.max(axis=1)
    near = np.flatnonzero((low <= high[face]).all(axis=1) & (high >= low[face]).all(axis=1))
    a, b, c = corners
    normal = cross(minus(b, a), minus(c, a))
    axis = largest_axis(normal)
    covering = [face]
    for other in near.tolist():
        budget.check()
        if other != face and all(orient3d_rational(a, b, c, corner) == 0 for corner in points[other].tolist()):
            covering.append(other)
    kept = [k for k in range(3) if k != axis]
    nodes, numbers = float_nodes(np.ascontiguousarray(points[covering][:, :, kept].reshape(-1, 2)))
    segments = [(numbers[3 * i + k], numbers[3 * i + (k + 1) % 3]) for i in range(len(covering)) for k in range(3)]
    masks = [IN_ODD | (IN_FACE if i < 3 else 0) for i in range(len(segments))]
    subdivision = subdivide(arrange(nodes, segments, masks, budget), budget)
    labels, found = label_faces(subdivision), []
    for edge, (tail, head) in enumerate(zip(subdivision.arrangement.tails, subdivision.arrangement.heads)):
        left, right = labels[subdivision.faces[2 * edge]], labels[subdivision.faces[2 * edge + 1]]
        if (left == LIVE) != (right == LIVE):
            found.append((_lifted(nodes.exact(tail), a, normal, axis), _lifted(nodes.exact(head), a, normal, axis)))
    return found


def _lifted(flat: Point2, origin: Vector, normal: Vector, axis: int) -> Vector:
    """Return the point of the plane through `origin` whose projection along `axis` is `flat`."""
    kept = [k for k in range(3) if k != axis]
    rise = -sum((normal[k] * (value - origin[k]) for k, value in zip(kept, flat)), Fraction(0)) / normal[axis]
    point = dict(zip(kept, flat))
    point[axis] = origin[axis] + rise
    return point[0], point[1], point[2]


def _flat(point: Vector, axis: int) -> Point2:
    x, y = (point[k] for k in range(3) if k != axis)
    return x, y


def _is_within(point: Point2, edges: list[tuple[Point2, Point2]]) -> bool:
    """Tell whether a ray to the right of `point` crosses the closed rings of `edges` an odd number of times."""
    odd = False
    for start, end in edges:
        low, high = (start, end) if start[1] < end[1] else (end, start)
        if low[1] <= point[1] < high[1] and orient2d_rational(low, high, point) > 0:
            odd = not odd
    return odd
