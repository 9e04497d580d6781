"""The rings of sections by parallel planes: `sweep.py` finds them; a plane on which they touch is done by itself.

Source: S. McMains, C. Sequin, A coherent sweep plane slicer for layered manufacturing, 1999.
"""

from __future__ import annotations

from collections import defaultdict
from typing import Final

import numpy as np

from engine.compiling.jit import entry_of
from engine.running.budget import Budget
from engine.solid_cutting.caps import Area, Ring, Seen, areas_of, rings_of, seen
from engine.solid_cutting.plane_cut import Plane, Points, cut_triangles
from engine.solid_cutting.shells import outward, shells
from engine.solid_cutting.sweep import chain_faces, count_faces, fill_faces, rank_vertices, turn_rings
from engine.solids.mesh import Polyhedron
from engine.types import BoolArray, FloatArray, IntArray, read_only

Slice = tuple[Seen, Plane, list[Area]]
_BYTES: Final = 100
"""Of a face that crosses a plane."""


def slices_at(
    body: Polyhedron, planes: list[Plane], axis: FloatArray | None, heights: FloatArray, budget: Budget
) -> list[Slice]:
    """Return the sections of a polyhedron by planes; axis: their common normal, if they are at heights along it."""
    n = len(body.vertices)
    if axis is not None and len(planes) > 1:
        unique, first, places = np.unique(heights, return_index=True, return_inverse=True)
        ranks, is_on = np.empty(n, np.int64), np.empty(n, np.bool_)
        is_sure = entry_of(rank_vertices)(body.vertices, axis, read_only(unique), ranks, is_on, budget.flag)
        budget.check()
        if is_sure:
            made = _swept(body, [planes[k] for k in first.tolist()], ranks, is_on, budget)
            return [made[k] for k in places.tolist()]
    made = []
    for plane in planes:
        sides = Points(body.vertices).sides(plane, budget)
        made += _swept(body, [plane], (sides > 0).astype(np.int64), sides == 0, budget)
    return made


def _swept(body: Polyhedron, planes: list[Plane], ranks: IntArray, is_on: BoolArray, budget: Budget) -> list[Slice]:
    """Return the sections by parallel planes, numbered along their normal. ranks, is_on: as for `rank_vertices`."""
    faces, firsts = outward(body, budget), np.zeros(len(planes) + 2, np.int64)
    entry_of(count_faces)(faces, ranks, firsts, budget.flag)
    budget.check()
    np.cumsum(firsts, out=firsts)
    n = int(firsts[-1])
    budget.take(_BYTES * n)
    crossing = np.empty(n, np.int64)
    entry_of(fill_faces)(faces, ranks, firsts, crossing, budget.flag)
    budget.check()
    across, is_open = _across(body, faces, budget), np.ones(len(planes), np.bool_)
    shells_of: dict[int, list[Ring]] = defaultdict(list)
    holes_of: dict[int, list[Ring]] = defaultdict(list)
    points = Points(body.vertices)
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
        leftmost, signs = np.empty(n_rings, np.int64), np.empty(n_rings, np.int8)
        axes = seen(points, planes[0]).axes
        with np.errstate(all="ignore"):
            entry_of(turn_rings)(points.rounded(numbers), *axes, ends, leftmost, signs)
        is_open[of[signs == 0]] = True
        start = 0
        for number, stop, first, sign in zip(of.tolist(), ends.tolist(), leftmost.tolist(), signs.tolist()):
            ring = np.concatenate([numbers[first:stop], numbers[start:first]]).tolist()
            (shells_of if sign > 0 else holes_of)[number].append(ring)
            start = stop
    made: list[Slice] = []
    for number, plane in enumerate(planes):
        budget.check()
        some, holes = shells_of[number], holes_of[number]
        view = seen(points, plane)
        if is_open[number]:
            made.append(_alone(body.vertices, faces[crossing[firsts[number] : firsts[number + 1]]], plane, budget))
        elif holes and len(some) > 1:
            made.append((view, plane, _nested(view, [*some, *holes], budget)))
        else:
            made.append((view, plane, [Area(shell, holes) for shell in some]))
    return made


def _across(body: Polyhedron, faces: IntArray, budget: Budget) -> IntArray | None:
    """Return the face beyond each side of each face (m, 3), cached with the body; None where an edge has more faces, or
    faces meet elsewhere too."""

    def build() -> IntArray | None:
        n, starts, ends = len(body.vertices), faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        sides, turned = starts * n + ends, ends * n + starts
        order, turned_order = np.argsort(sides), np.argsort(turned)
        sides = sides[order]
        is_closed = (sides == turned[turned_order]).all() and (sides[1:] != sides[:-1]).all()
        if shells(body, budget).touches or not is_closed or (starts == ends).any():
            return None
        others = np.empty_like(order)
        others[turned_order] = order
        return read_only(others.reshape(-1, 3) // 3)

    across: IntArray | None = body.prepared("across", build, budget.check)
    return across


def _alone(vertices: FloatArray, faces: IntArray, plane: Plane, budget: Budget) -> Slice:
    """Return the section by a plane of the faces that cross it."""
    used, local = np.unique(faces, return_inverse=True)
    points = Points(vertices[used] if len(used) else vertices[:1])
    view = seen(points, plane)
    chain = cut_triangles(points, local.reshape(-1, 3), plane, budget).chain
    return view, plane, _nested(view, rings_of(view, chain, budget), budget)


def _nested(view: Seen, rings: list[Ring], budget: Budget) -> list[Area]:
    """Return rings as polygons with holes; where there are several and holes, fractions prove which."""
    areas, _ = areas_of(view, rings, budget)
    if len(areas) > 1 and any(area.holes for area in areas):
        areas, _ = areas_of(view, rings, budget, True)
    return areas
