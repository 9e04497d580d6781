"""What keeps a mesh from being a closed solid, each thing decided exactly.

Orientations of points (`orientations`) and pairs of triangles (`collide_triangles`) decide. Two triangles with a common
corner s, t = (s, a, b) and u = (s, c, d), have another common point if and only if the edge a b meets u or c d meets t:
from s on through that point one leaves one of them first, by its edge opposite to s.
"""

from __future__ import annotations

from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np

from engine.bounding.box_grid import pairs_of_boxes
from engine.collision.codes import DISJOINT, TOUCHING
from engine.collision.triangles import collide_triangles
from engine.compiling.jit import entry_of
from engine.polygon_clipping.planes import orientations
from engine.predicates.rational import cross, scaled_integers, sign_of
from engine.running.budget import Budget, polled
from engine.solid_cutting.exact_measures import exact_faces, exact_volume
from engine.solid_cutting.face_cuts import find_candidates
from engine.solid_cutting.plane_cut import Points
from engine.solids.ragged import ascending
from engine.types import BoolArray, FloatArray, IntArray, read_only


class Edges(NamedTuple):
    """The distinct edges of a mesh of m triangles.

    | field | shape | meaning |
    |---|---|---|
    | ends | (k, 2) | vertices of each, ascending |
    | of | (m, 3) | the edge of each side of each triangle |
    | uses | (k,) | how many sides are on it |
    | net | (k,) | sides that run from the lower to the higher vertex minus those that run back |
    """

    ends: IntArray
    of: IntArray
    uses: IntArray
    net: IntArray

    def parted(self, is_parted: BoolArray) -> Edges:
        """Return edges as if faces were not joined at some of them."""
        of, n = self.of.copy(), len(self.ends)
        sides = is_parted[of]
        of[sides] = np.arange(n, n + sides.sum())
        return Edges(np.zeros((n + int(sides.sum()), 2), np.int64), of, self.uses, self.net)


def edges_of(faces: IntArray) -> Edges:
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    n = int(faces.max(initial=0)) + 1  # below 2^31: keys are whole
    keys, of, uses = np.unique(sides.min(axis=1) * n + sides.max(axis=1), return_inverse=True, return_counts=True)
    ends, of = np.stack(np.divmod(keys, n), axis=1), of.reshape(-1)
    net = np.bincount(of, np.sign(sides[:, 1] - sides[:, 0]), len(ends)).astype(np.int64)
    uses = np.where(ends[:, 0] == ends[:, 1], 0, uses)  # of a face that names a vertex twice
    return Edges(ends, of.reshape(-1, 3), uses, net)


def are_flat(points: FloatArray, faces: IntArray, budget: Budget) -> Any:
    """Return (m,) bool: whether the corners of a triangle are on one line, exactly."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    with np.errstate(all="ignore"):
        u, v = b - a, c - a
        size = np.abs(u).max(axis=1) * np.abs(v).max(axis=1)
        is_open = ~(np.abs(np.cross(u, v)).max(axis=1) > 1e-15 * 8 * size + 1e-300) | ~np.isfinite(size)
    for item in np.flatnonzero(is_open).tolist():
        budget.check()
        numbers = scaled_integers(np.concatenate([a[item], b[item], c[item]]).tolist())
        p, q, r = numbers[:3], numbers[3:6], numbers[6:]
        sides = [x - y for x, y in zip(q, p)], [x - y for x, y in zip(r, p)]
        is_open[item] = not any(cross(*sides))
    return is_open


def junctions(points: FloatArray, ends: IntArray, budget: Budget) -> IntArray:
    """Return the T-junctions (k, 3) of open edges `ends` (n, 2): an edge, and a vertex of another one that lies exactly
    in its interior; vertices of one edge in their order along it."""
    on = Points(points).on_sides(ends, ascending(ends), budget) if len(ends) else {}
    rows = [(*side, number) for side in sorted(on) for number in on[side]]
    return np.array(rows, np.int64).reshape(-1, 3)


def shells_of(edges: Edges, budget: Budget) -> list[IntArray]:
    """Return the connected parts of a mesh (faces joined by edges), each as the numbers of its faces."""
    labels = np.arange(len(edges.of))
    while True:  # bound: labels only fall; pointers are halved each turn
        budget.check()
        least = np.full(len(edges.ends), len(labels))
        np.minimum.at(least, edges.of.reshape(-1), labels.repeat(3))
        spread = np.minimum(labels, least[edges.of].min(axis=1))
        np.minimum.at(spread, labels, spread.copy())
        spread = spread[spread]
        if (spread == labels).all():
            break
        labels = spread
    order = np.argsort(labels, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(labels[order])) + 1) if len(order) else []


def sign_of_volume(points: FloatArray, faces: IntArray, budget: Budget) -> int:
    """Return the sign of the signed volume of closed triangles, exactly: 1 if they face outward."""
    with np.errstate(all="ignore"):
        corners = points[faces] - points[faces[0, 0]]
        parts = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
        bound = 1e-14 * len(faces) * np.abs(corners).max() ** 3 + 1e-290
        total = float(parts.sum())
    if np.isfinite(bound) and abs(total) > bound * 8:
        return 1 if total > 0 else -1
    budget.check()
    return sign_of(exact_volume(exact_faces(points, faces)))


def crossings(
    points: FloatArray, faces: IntArray, solid_faces: IntArray, at_edges: IntArray, budget: Budget
) -> IntArray:
    """Return the pairs of faces (k, 2) that have a common point besides their common corners and edges. solid_faces:
    the numbers of the faces that have area; at_edges: the T-junctions, whose pairs are left out."""
    a, b, c = (points[faces[solid_faces, k]] for k in range(3))
    at_junctions = _pairs_at(faces, at_edges)
    blocks = [np.zeros((0, 2), np.int64)]
    low, high = (pick(pick(a, b), c) for pick in (np.minimum, np.maximum))
    for block in pairs_of_boxes(low, high, budget, 1 << 14) if len(solid_faces) else ():
        budget.check()
        pairs = solid_faces[block]
        n_common = np.empty(len(pairs), np.int8)
        entry_of(find_candidates)(read_only(points), read_only(faces), read_only(pairs), n_common)
        pairs, n_common = pairs[n_common >= 0], n_common[n_common >= 0]
        meets = n_common == 3
        for n, test in enumerate((_apart_meet, _at_corner_meet, _at_edge_meet)):
            some = np.flatnonzero(n_common == n)
            if len(some):
                first, second = faces[pairs[some, 0]], faces[pairs[some, 1]]
                same = first[:, :, None] == second[:, None, :]
                order = [_common_first(each, same.any(axis=axis)) for each, axis in ((first, 2), (second, 1))]
                meets[some] = test(points[order[0]], points[order[1]], budget)
        hits = pairs[meets]
        blocks.append(hits[[tuple(pair) not in at_junctions for pair in hits.tolist()]] if len(at_junctions) else hits)
    pairs = np.concatenate(blocks)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def _common_first(rows: IntArray, is_common: Any) -> IntArray:
    """Return faces (n, 3), each rotated so that corners that are common (is_common (n, 3)) come first, the smallest of
    them first."""
    order = np.lexsort((rows, ~is_common), axis=1)
    return np.take_along_axis(rows, order, axis=1)


def _pairs_at(faces: IntArray, at_edges: IntArray) -> set[tuple[int, int]]:
    """Return the pairs of faces that meet at T-junctions `at_edges` (an edge, a vertex): one at the edge, one at the
    vertex."""
    at: dict[int, list[int]] = defaultdict(list)
    for number, face in enumerate(polled(faces.tolist() if len(at_edges) else ())):
        for vertex in face:
            at[vertex].append(number)
    pairs = set()
    for low, high, vertex in polled(at_edges.tolist()):
        for one in set(at[low]) & set(at[high]):
            pairs |= {(min(one, other), max(one, other)) for other in at[vertex]}
    return pairs


def _apart_meet(t: FloatArray, u: FloatArray, budget: Budget) -> Any:
    return np.asarray(collide_triangles(t, u, deadline=budget.left(), cancel=budget.cancel)) != DISJOINT


def _at_corner_meet(t: FloatArray, u: FloatArray, budget: Budget) -> Any:
    """Return (n,) bool: whether triangles t and u (n, 3, 3), whose first corners are equal, have another common point
    (see the head of this file)."""
    (s, a, b), (_, c, d) = np.moveaxis(t, 1, 0), np.moveaxis(u, 1, 0)
    sides_of_u = [orientations(s, a, b, x) for x in (c, d)]
    sides_of_t = [orientations(s, c, d, x) for x in (a, b)]
    is_flat = (sides_of_u[0] == 0) & (sides_of_u[1] == 0)
    meets = np.zeros(len(t), np.bool_)
    for (p, q), sides, (v, w) in (((a, b), sides_of_t, (c, d)), ((c, d), sides_of_u, (a, b))):
        some = np.flatnonzero(~is_flat & (sides[0] * sides[1] <= 0))
        around = [orientations(p[some], q[some], *(x[some] for x in pair)) for pair in ((s, v), (v, w), (w, s))]
        meets[some] |= (np.min(around, axis=0) >= 0) | (np.max(around, axis=0) <= 0)
    some = np.flatnonzero(is_flat)
    for p, q, other in ((a, b, u), (c, d, t)):
        edge = np.stack([p[some], q[some], q[some]], axis=1)
        meets[some] |= _in_plane(edge, other[some], other[some], budget) != DISJOINT
    return meets


def _at_edge_meet(t: FloatArray, u: FloatArray, budget: Budget) -> Any:
    """Return (n,) bool: whether triangles t and u (n, 3, 3), which share their first two corners, overlap in one
    plane."""
    meets = np.zeros(len(t), np.bool_)
    some = np.flatnonzero(orientations(t[:, 0], t[:, 1], t[:, 2], u[:, 2]) == 0)
    relations = _in_plane(t[some], u[some], u[some], budget)
    meets[some] = (relations != DISJOINT) & (relations != TOUCHING)
    return meets


def _in_plane(first: FloatArray, second: FloatArray, normal_of: FloatArray, budget: Budget) -> Any:
    """Return the relations of pairs in a plane each, seen along the axis to which it is steepest."""
    relations = np.full(len(first), DISJOINT)
    with np.errstate(all="ignore"):
        normals = np.abs(np.cross(normal_of[:, 1] - normal_of[:, 0], normal_of[:, 2] - normal_of[:, 0]))
    steepest = np.argmax(normals, axis=1) if len(first) else np.zeros(0, np.int64)
    for axis in range(3):
        some = np.flatnonzero(steepest == axis)
        if len(some):
            flat = [np.delete(each[some], axis, axis=2) for each in (first, second)]
            relations[some] = np.asarray(collide_triangles(*flat, deadline=budget.left(), cancel=budget.cancel))
    return relations
