"""Triangles cut so that they have corners and edges in common and nothing else, and none lies on another.

Each plane in which faces lie on each other, or an edge lies on a face, is arranged by itself: all edges in it part it
into cells (`engine/arrangement/`). A cell that an odd number of triangles cover is a part of the first of them; of the
others nothing is left. Then every side, of cells and of faces beside them, is cut at all points on it, and what has
more than three corners is cut into triangles (`caps.py`). Faces without area are left out: their corners are points on
their longest side.

New points are crossings of edges, exact. All else stays as it is given.

Source: M. Granados et al., Boolean operations on 3D selective Nef complexes, 2003 (planes arranged one by one).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable
from fractions import Fraction
from itertools import pairwise
from math import lcm
from typing import Final, NamedTuple

import numpy as np

from engine.arrangement.arrange import arrange
from engine.arrangement.nodes import NodeTable, float_nodes
from engine.arrangement.subdivision import label_faces, subdivide
from engine.arrangement.union_find import UnionFind
from engine.polygon_clipping.planes import orientations
from engine.predicates.rational import cross, reduced
from engine.running.budget import Budget, polled
from engine.solid_cutting.caps import Seen, cap_of, seen
from engine.solid_cutting.faults import crossings
from engine.solid_cutting.plane_cut import Plane, Points, are_different, plane_through, stops_of
from engine.solids.ragged import ascending
from engine.types import BoolArray, FloatArray, IntArray

_NO_JUNCTIONS: Final = np.zeros((0, 3), np.int64)
Sides = list[tuple[int, int]]


class Contacts(NamedTuple):
    """How the triangles of a mesh meet besides common corners and edges.

    | field | shape | meaning |
    |---|---|---|
    | flush | (k, 2) | pairs in one plane |
    | along | (k, 4) | a triangle; an edge in its plane, of another that is not, by its two vertices; that other one |
    | crossing | | the first pair that pass through each other, or None |
    | is_flat | (m,) | whether a triangle has no area |
    | touches | | whether there is any contact, in single points too |
    """

    flush: IntArray
    along: IntArray
    crossing: tuple[int, int] | None
    is_flat: BoolArray
    touches: bool


def contacts_of(points: FloatArray, faces: IntArray, is_flat: BoolArray, budget: Budget) -> Contacts:
    """Return how triangles (m, 3) of points meet."""
    pairs = crossings(points, faces, np.flatnonzero(~is_flat), _NO_JUNCTIONS, budget)
    corners = points[faces[pairs]]  # (k, 2, 3, 3): pair, face, corner, axis
    sides = np.zeros((len(pairs), 2, 3), np.int8)
    for k in range(2):
        a, b, c = (corners[:, 1 - k, corner] for corner in range(3))
        for j in range(3):
            budget.check()
            sides[:, k, j] = orientations(a, b, c, corners[:, k, j])
    is_flush = (sides == 0).all(axis=(1, 2))
    straddles = (sides.min(axis=2) < 0) & (sides.max(axis=2) > 0)
    along = [np.zeros((0, 4), np.int64)]
    for k in range(2):
        on = np.flatnonzero((sides[:, k] == 0).sum(axis=1) == 2)
        other = pairs[on, k]
        away = np.argmax(sides[on, k] != 0, axis=1)
        ends = [faces[other, (away + step) % 3] for step in (1, 2)]
        along.append(np.column_stack([pairs[on, 1 - k], *ends, other]))
    crossing = None
    for row in np.flatnonzero(straddles.all(axis=1)).tolist():
        budget.check()
        if _is_crossed(corners[row]):
            crossing = int(pairs[row, 0]), int(pairs[row, 1])
            break
    return Contacts(pairs[is_flush], np.concatenate(along), crossing, is_flat, len(pairs) > 0)


def _is_crossed(corners: FloatArray) -> bool:
    """Return whether two triangles (2, 3, 3), each with corners on both sides of the other's plane, have more than one
    point in common."""
    planes = [plane_through(triangle).integers for triangle in corners]
    way = cross(planes[0][:3], planes[1][:3])
    axis = max(range(3), key=lambda k: abs(way[k]))
    spans = []
    for k in range(2):
        places = [[Fraction(x) for x in corner] for corner in corners[k].tolist()]
        *normal, offset = planes[1 - k]
        values = [sum((n * x for n, x in zip(normal, place)), Fraction(offset)) for place in places]
        at = [place[axis] for place, value in zip(places, values) if value == 0]
        for i in range(3):
            p, q, v, w = places[i - 1][axis], places[i][axis], values[i - 1], values[i]
            if v * w < 0:
                at.append(p + v / (v - w) * (q - p))
        spans.append((min(at), max(at)))
    return max(low for low, _ in spans) < min(high for _, high in spans)


def conformed(points: Points, faces: IntArray, contacts: Contacts, budget: Budget) -> tuple[IntArray, IntArray]:
    """Return (triangles, of): what is left of triangles (m, 3), cut to conform to each other, and of which each is a
    part, in the same direction. Crossings of edges are added to `points`."""
    is_left = ~contacts.is_flat & are_different(faces)
    involved = np.zeros(len(faces), np.bool_)
    involved[np.concatenate([contacts.flush.ravel(), contacts.along[:, [0, 3]].ravel()])] = True
    involved |= contacts.is_flat
    budget.check()
    places = {reduced(points.exact(number)): number for number in polled(ascending(faces[involved]).tolist())}
    cells: list[tuple[int, Sides]] = []
    n_given, n_known = len(points), len(places)

    def number_at(place: tuple[int, ...]) -> int:
        return places.setdefault(place, n_given - n_known + len(places))

    for group, edges in _planes_of(faces, contacts):
        budget.check()
        is_left[group] = False
        if not edges and len(np.unique(np.sort(faces[group], axis=1), axis=0)) == 1:  # one triangle again and again
            is_left[group[0]] = len(group) % 2 == 1
        else:
            cells += _cells(points, faces, group, edges, number_at, budget)
    points.add_places([*places][n_known:], budget)
    sides: IntArray = np.concatenate([faces[involved][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2),
                            np.array([side for _, own in cells for side in own], np.int64).reshape(-1, 2)])  # fmt: skip
    spots = np.concatenate([ascending(faces[involved]), np.arange(n_given, len(points))])
    on = points.on_sides(np.unique(np.sort(sides, axis=1), axis=0), spots, budget)
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    n = len(points)
    is_cut = np.isin(ends[..., 0] * n + ends[..., 1], [low * n + high for low, high in on]).any(axis=1) & is_left
    for face in np.flatnonzero(is_cut).tolist():
        a, b, c = faces[face].tolist()
        cells.append((face, [(a, b), (b, c), (c, a)]))
    of = np.flatnonzero(is_left & ~is_cut)
    made, origins = [faces[of]], [of]
    for face, own in cells:
        budget.check()
        split = [pair for side in own for pair in pairwise(stops_of(side, on))]
        made.append(_filled(points, faces[face], split, budget))
        origins.append(np.full(len(made[-1]), face))
    return np.concatenate(made), np.concatenate(origins)


def _planes_of(faces: IntArray, contacts: Contacts) -> Iterable[tuple[list[int], list[tuple[int, int]]]]:
    """Return, for each plane to be arranged, triangles in it, ascending, and edges of others."""
    joined = UnionFind(len(faces))
    for one, other in contacts.flush.tolist():
        joined.unite(one, other)
    groups: dict[int, list[int]] = defaultdict(list)
    edges: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for face in np.unique(np.concatenate([contacts.flush.ravel(), contacts.along[:, 0]])).tolist():
        groups[joined.find(face)].append(face)
    for face, start, end, _ in contacts.along.tolist():
        edges[joined.find(face)].append((start, end))
    return [(group, edges[root]) for root, group in groups.items()]


def _view(points: Points, face: IntArray) -> tuple[Seen, Plane]:
    plane = plane_through(points.vertices[face])
    return seen(points, plane), plane


def _cells(
    points: Points, faces: IntArray, group: list[int], edges: list[tuple[int, int]],
    number_at: Callable[[tuple[int, ...]], int], budget: Budget,
) -> list[tuple[int, Sides]]:  # fmt: skip
    """Return the cells of a plane that an odd number of its triangles `group` cover: the first of these, and directed
    sides that have the cell on their left, seen as that triangle is counter-clockwise. edges: more in that plane;
    number_at: gives the number of the point at a place."""
    view, plane = _view(points, faces[group[0]])
    own = faces[group]
    segments = np.concatenate(
        [own[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), np.array(edges, np.int64).reshape(-1, 2)]
    )
    used, local = np.unique(segments, return_inverse=True)
    nodes, numbers = float_nodes(points.vertices[used][:, list(view.axes)], budget)
    masks = [frozenset((face,)) for face in group for _ in range(3)] + [frozenset[int]()] * len(edges)
    ends = [(numbers[a], numbers[b]) for a, b in local.reshape(-1, 2).tolist()]
    subdivision = subdivide(arrange(nodes, ends, masks, budget))
    budget.check()
    labels, left_of = label_faces(subdivision), subdivision.faces
    known = dict(zip(numbers, used.tolist()))
    sides: dict[int, Sides] = defaultdict(list)
    for half_edge, cell in enumerate(left_of):
        if len(labels[cell]) % 2 and left_of[half_edge ^ 1] != cell:
            way = [subdivision.arrangement.origin(each) for each in (half_edge, half_edge ^ 1)]
            for node in way:
                if node not in known:
                    known[node] = number_at(_place_of(nodes, node, view, plane))
            sides[cell].append((known[way[0]], known[way[1]]))
    cells = []
    for cell, chain in sides.items():
        face = min(labels[cell])
        is_mirrored = _view(points, faces[face])[0].axes != view.axes
        cells.append((face, [(end, start) for start, end in chain] if is_mirrored else chain))
    return cells


def _place_of(nodes: NodeTable, node: int, view: Seen, plane: Plane) -> tuple[int, ...]:
    """Return the exact place of a node of an arrangement in a plane, reduced."""
    i, j = view.axes
    (x, y), (*normal, offset) = nodes.exact(node), plane.integers
    third = 3 - i - j
    z = -(normal[i] * x + normal[j] * y + offset) / normal[third]
    w = lcm(*(each.denominator for each in (x, y, z)))
    place = [0, 0, 0, w]
    for axis, value in ((i, x), (j, y), (third, z)):
        place[axis] = int(value * w)
    return reduced(place)


def _filled(points: Points, face: IntArray, sides: Sides, budget: Budget) -> IntArray:
    """Return triangles that fill the area on the left of directed sides, seen as `face` is counter-clockwise."""
    if len(sides) == 3:
        (a, b), *others = sides
        return np.array([(a, b, next(end for start, end in others if start == b))])
    return cap_of(_view(points, face)[0], np.array(sides), budget)[:, ::-1]
