"""The rings of sections by parallel planes, all in one sweep; a plane on which they touch is done by itself.

Planes are numbered along their normal. Each vertex has a rank, the number of planes that it is strictly beyond, so a
face crosses the planes from its least rank to its greatest. Two faces share each edge; so from a face that crosses a
plane its section goes on, across the side that runs from what is outside to what is inside, to the face on its other
side, until it is back at the first. A corner on a plane is outside, and the sides that end there are cut at it; a plane
where a section comes to a corner again is done by itself (`is_open`).

Source: S. McMains, C. Sequin, A coherent sweep plane slicer for layered manufacturing, 1999.
"""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise
from typing import Final

import numpy as np

from engine.compiling.jit import entry_of, kernel
from engine.predicates.side import side_of_plane
from engine.predicates.vectors import as_point3
from engine.running.budget import Budget
from engine.solid_cutting.boundary import Boundary, boundary
from engine.solid_cutting.caps import Area, Ring, Seen, areas_of, oriented, rings_of, seen
from engine.solid_cutting.plane_cut import Plane, Points, cut_triangles
from engine.solids.mesh import Polyhedron
from engine.types import UNDECIDED, BoolArray, FlagArray, FloatArray, HalfSpace3, IntArray, read_only

_POLL = 0xFFF


@kernel
def rank_vertices(
    vertices: FloatArray, normal: FloatArray, heights: FloatArray, ranks: IntArray, is_on: BoolArray, flag: FlagArray
) -> bool:
    """Fill ranks (n,) with the number of heights (ascending) below normal . vertex, and is_on (n,) with whether the
    next height equals it; return whether all were decided."""
    for vertex in range(vertices.shape[0]):
        if vertex & _POLL == 0 and flag[0] != 0:
            return False
        low, high, point = 0, heights.shape[0], as_point3(vertices, vertex)
        is_on[vertex] = False
        while low < high:  # bound: the range is halved
            middle = (low + high) // 2
            side = side_of_plane(HalfSpace3(normal[0], normal[1], normal[2], -heights[middle]), point)
            if side == UNDECIDED:
                return False
            if side > 0:
                low = middle + 1
            else:
                high = middle
                is_on[vertex] = side == 0
                if side == 0:
                    low = middle
        ranks[vertex] = low
    return True


@kernel
def sort_faces(
    triangles: IntArray, ranks: IntArray, is_counting: bool, places: IntArray, crossing: IntArray, flag: FlagArray
) -> None:
    """Add to places (planes + 2,) the faces that cross plane k at k + 2, if is_counting; else fill crossing with the
    faces that cross each plane, plane by plane, ascending, those of plane k from where places has k + 1, which is moved
    to where they end."""
    for face in range(triangles.shape[0]):
        if face & _POLL == 0 and flag[0] != 0:
            return
        a, b, c = ranks[triangles[face, 0]], ranks[triangles[face, 1]], ranks[triangles[face, 2]]
        for plane in range(min(a, b, c), max(a, b, c)):
            if is_counting:
                places[plane + 2] += 1
            else:
                crossing[places[plane + 1]] = face
                places[plane + 1] += 1


@kernel
def chain_faces(
    triangles: IntArray, across: IntArray, ranks: IntArray, is_on: BoolArray, firsts: IntArray, crossing: IntArray,
    marks: IntArray, vertex_marks: IntArray, cuts: IntArray, ring_ends: IntArray, ring_planes: IntArray,
    is_open: BoolArray, flag: FlagArray,
) -> int:  # fmt: skip
    """Write the rings of all planes; return how many there are.

    across (m, 3): the face beyond side k. firsts: where the faces of each plane begin in `crossing`. marks (m,),
    vertex_marks (n,): scratch, 0. cuts (k, 3), by point of a ring: the end inside, the end outside, or the corner on
    the plane and -1; the plane. ring_ends: where rings end in cuts. is_open: planes that are left to the caller.
    """
    n_points, n_rings = 0, 0
    for plane in range(is_open.shape[0]):
        if flag[0] != 0:
            break
        for item in range(firsts[plane], firsts[plane + 1]):
            first = crossing[item]
            if marks[first] == plane + 1:
                continue
            face, start, last, ring_first, is_back = first, n_points, -1, -1, False
            for _ in range(firsts[plane + 1] - firsts[plane]):
                marks[face] = plane + 1
                side = 0
                for k in range(3):
                    is_up = ranks[triangles[face, k]] <= plane and ranks[triangles[face, (k + 1) % 3]] > plane
                    side = k if is_up else side
                outside, inside = triangles[face, side], triangles[face, (side + 1) % 3]
                is_corner = is_on[outside] and ranks[outside] == plane
                is_again = is_corner and vertex_marks[outside] == plane + 1
                if is_again and last != outside:
                    is_open[plane] = is_open[plane] or outside != ring_first
                    is_back = True
                elif not is_again:
                    is_open[plane] = is_open[plane] or is_back
                    if is_corner:
                        vertex_marks[outside] = plane + 1
                        ring_first = outside if n_points == start else ring_first
                    cuts[n_points, 0], cuts[n_points, 1] = (
                        outside if is_corner else inside,
                        -1 if is_corner else outside,
                    )
                    cuts[n_points, 2] = plane
                    n_points += 1
                last = outside if is_corner else -1
                face = across[face, side]
                if face == first:
                    break
            is_open[plane] = is_open[plane] or face != first
            if n_points - start < 3:  # there and back
                n_points = start
            else:
                ring_ends[n_rings], ring_planes[n_rings] = n_points, plane
                n_rings += 1
    return n_rings


Slice = tuple[Seen, Plane, list[Area]]
_BYTES: Final = 100
"""Of a face that crosses a plane."""


def slices_at(
    body: Polyhedron, planes: list[Plane], axis: FloatArray | None, heights: FloatArray, budget: Budget
) -> list[Slice]:
    """Return the sections of a polyhedron by planes; axis: their common normal, if they are at heights along it."""
    given, n = boundary(body, budget), len(body.vertices)
    if axis is not None and len(planes) > 1 and len(given.points) == n:
        unique, first, places = np.unique(heights, return_index=True, return_inverse=True)
        ranks, is_on = np.empty(n, np.int64), np.empty(n, np.bool_)
        is_sure = entry_of(rank_vertices)(body.vertices, axis, read_only(unique), ranks, is_on, budget.flag)
        budget.check()
        if is_sure:
            made = _swept(body, given, [planes[k] for k in first.tolist()], ranks, is_on, budget)
            return [made[k] for k in places.tolist()]
    made = []
    for plane in planes:
        sides = given.points.sides(plane, budget)
        made += _swept(body, given, [plane], (sides > 0).astype(np.int64), sides == 0, budget)
    return made


def _swept(
    body: Polyhedron, given: Boundary, planes: list[Plane], ranks: IntArray, is_on: BoolArray, budget: Budget
) -> list[Slice]:
    """Return the sections by parallel planes, numbered along their normal, of a body whose boundary is `given`. ranks,
    is_on: as for `rank_vertices`."""
    faces, firsts = given.triangles, np.zeros(len(planes) + 2, np.int64)
    entry_of(sort_faces)(faces, ranks, True, firsts, firsts[:0], budget.flag)
    budget.check()
    np.cumsum(firsts, out=firsts)
    n = int(firsts[-1])
    budget.take(_BYTES * n)
    crossing = np.empty(n, np.int64)
    entry_of(sort_faces)(faces, ranks, False, firsts, crossing, budget.flag)
    budget.check()
    across, is_open = _across(body, given, budget), np.ones(len(planes), np.bool_)
    shells_of: dict[int, list[Ring]] = defaultdict(list)
    holes_of: dict[int, list[Ring]] = defaultdict(list)
    points = given.points.copy()
    if across is not None:
        is_open[:] = False
        cuts, ends, of = np.empty((n, 3), np.int64), np.empty(n // 3 + 1, np.int64), np.empty(n // 3 + 1, np.int64)
        marks = np.zeros(len(faces), np.int64), np.zeros(len(ranks), np.int64)
        rows = ranks, is_on, firsts, crossing, *marks, cuts, ends, of, is_open
        n_rings = entry_of(chain_faces)(faces, across, *rows, budget.flag)
        budget.check()
        ends, of = ends[:n_rings], of[:n_rings]
        cuts = cuts[: int(ends[-1])] if n_rings else cuts[:0]
        crosses = cuts[:, 1] >= 0
        numbers = cuts[:, 0].copy()
        numbers[crosses] = np.arange(len(points), len(points) + int(crosses.sum()))
        points.add(np.ascontiguousarray(cuts[crosses, :2]), planes, cuts[crosses, 2], budget)
        listed = numbers.tolist()
        rings = [listed[start:stop] for start, stop in pairwise([0, *ends.tolist()])]
        for number, ring, sign in zip(of.tolist(), *oriented(seen(points, planes[0]), rings)):
            is_open[number] |= sign == 0
            (shells_of if sign > 0 else holes_of)[number].append(ring)
    made: list[Slice] = []
    for number, plane in enumerate(planes):
        budget.check()
        some, holes = shells_of[number], holes_of[number]
        view = seen(points, plane)
        if is_open[number]:
            made.append(_alone(given.points, faces[crossing[firsts[number] : firsts[number + 1]]], plane, budget))
        elif holes and len(some) > 1:
            made.append((view, plane, _nested(view, [*some, *holes], budget)))
        else:
            made.append((view, plane, [Area(shell, holes) for shell in some]))
    return made


def _across(body: Polyhedron, given: Boundary, budget: Budget) -> IntArray | None:
    """Return the face beyond each side of each face (m, 3) of a boundary, cached with the body; None where an edge has
    more faces, or faces as given meet elsewhere too."""

    def build() -> IntArray | None:
        faces = given.triangles
        n, starts, ends = len(body.vertices), faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        sides, turned = starts * n + ends, ends * n + starts
        order, turned_order = np.argsort(sides), np.argsort(turned)
        sides = sides[order]
        is_closed = (sides == turned[turned_order]).all() and (sides[1:] != sides[:-1]).all()
        if given.touches or not is_closed:
            return None
        others = np.empty_like(order)
        others[turned_order] = order
        return read_only(others.reshape(-1, 3) // 3)

    across: IntArray | None = body.prepared("across", build, budget.check)
    return across


def _alone(points: Points, faces: IntArray, plane: Plane, budget: Budget) -> Slice:
    """Return the section by a plane of the faces that cross it."""
    if len(points) == points.n_given and len(faces):
        used, local = np.unique(faces, return_inverse=True)
        points, faces = Points(points.vertices[used]), local.reshape(-1, 3)
    else:
        points = points.copy()
    view = seen(points, plane)
    chain = cut_triangles(points, faces, plane, budget).chain
    return view, plane, _nested(view, rings_of(view, chain, budget), budget)


def _nested(view: Seen, rings: list[Ring], budget: Budget) -> list[Area]:
    """Return rings as polygons with holes; where there are several and holes, fractions prove which."""
    areas, _ = areas_of(view, rings, budget)
    if len(areas) > 1 and any(area.holes for area in areas):
        areas, _ = areas_of(view, rings, budget, True)
    return areas
