"""Mends of meshes, each by an option, and each with a sentence that says what it did; and which shells face the wrong
way, as they are nested.

A shell is the faces that hang together by edges. Its signed volume should be positive within an even number of other
shells, negative within an odd number.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from engine.bounding.box_grid import all_pairs_of_boxes, pairs_of_boxes
from engine.collision.collide import collide
from engine.containment.locate import locate
from engine.errors import EngineError
from engine.running.budget import Budget, polled
from engine.solid_cutting.faults import edges_of, junctions, shells_of, sign_of_volume
from engine.solids.mesh import Polyhedron
from engine.solids.ragged import ascending
from engine.types import FloatArray, IntArray, Rcc8


def welded(
    points: FloatArray, faces: IntArray, distance: float, budget: Budget, mended: list[str]
) -> tuple[FloatArray, IntArray]:
    """Merge vertices within `distance` of each other, also through chains of such vertices: return the points,
    unchanged, and the faces with the smallest index of each group in place of its members, collapsed faces left out.
    What was done is appended to `mended`."""
    used = ascending(faces)
    spots = points[used]
    with np.errstate(over="ignore"):  # boxes and distances beyond the largest double
        low, high = (np.nextafter(spots + sign * distance / 2, sign * np.inf) for sign in (-1, 1))
        root = np.arange(len(points))
        for block in pairs_of_boxes(low, high, budget):
            budget.check()
            first, second = used[block].T
            is_near = np.sqrt(np.square(points[first] - points[second]).sum(axis=1)) <= distance
            _join(root, first[is_near], second[is_near], budget)
    moved = root != np.arange(len(points))
    made = root[faces]
    remaining = (made != np.roll(made, 1, axis=1)).all(axis=1)
    largest = np.abs(points[moved] - points[root[moved]]).max() if moved.any() else 0.0
    mended.append(
        f"weld: {int(moved.sum())} vertices are made one with another, moved by {float(largest)!r} at most on an axis; "
        f"{int((~remaining).sum())} faces collapsed and are left out"
    )
    return points, made[remaining]


def _join(root: IntArray, first: IntArray, second: IntArray, budget: Budget) -> None:
    """Unite the groups of vertices first[k] and second[k], for each k. root (n,): by vertex the smallest vertex of its
    group, updated."""
    while len(first):  # bound: a group loses its root each turn
        budget.check()
        one, other = root[first], root[second]
        np.minimum.at(root, np.maximum(one, other), np.minimum(one, other))
        while (root[root] != root).any():
            root[:] = root[root]
        apart = root[first] != root[second]
        first, second = first[apart], second[apart]


def filled(points: FloatArray, faces: IntArray, budget: Budget, mended: list[str]) -> IntArray:
    """Return the triangles with open edges split at the vertices on them."""
    edges = edges_of(faces)
    is_open = edges.uses % 2 == 1
    on: dict[tuple[int, int], list[int]] = defaultdict(list)
    for low, high, vertex in polled(junctions(points, edges.ends[is_open], budget).tolist()):
        on[low, high].append(vertex)
    made: list[list[int]] = []
    n_split = n_flat = 0
    for face in polled(faces.tolist()):
        if len(set(face)) < 3 or _is_on_itself(face, on):
            n_flat += 1
            continue
        waiting = [face]
        for k in range(3):
            a, b = face[k], face[(k + 1) % 3]
            between = on.get((min(a, b), max(a, b)), [])
            if between:
                n_split += 1
                path = [a, *(between if a < b else between[::-1]), b]
                whole = next(each for each in waiting if a in each and b in each)
                waiting.remove(whole)
                (apex,) = set(whole) - {a, b}
                waiting += [[start, end, apex] for start, end in pairwise(path)]
        made += waiting
    flat = f"; {n_flat} faces without area, which that leaves nothing of, are left out" if n_flat else ""
    mended.append(f"fill_t_junctions: {n_split} sides of faces are split at the vertices on them{flat}")
    return np.array(made, np.int64).reshape(-1, 3)


def _is_on_itself(face: list[int], on: dict[tuple[int, int], list[int]]) -> bool:
    """Return whether a corner of a triangle lies on its own opposite edge. on: by edge the vertices in its interior."""
    sides = zip(face, [*face[1:], face[0]], [*face[2:], *face[:2]])
    return any(apex in on.get((min(a, b), max(a, b)), ()) for a, b, apex in sides)


def oriented(points: FloatArray, faces: IntArray, budget: Budget, mended: list[str]) -> IntArray:
    """Return the triangles, some turned over: adjacent ones run along their common edge in opposite directions, and
    closed shells face outward or inward as their nesting asks. What was done is appended to `mended`."""
    edges = edges_of(faces)
    users: dict[int, list[int]] = defaultdict(list)
    for face, own in enumerate(polled(edges.of.tolist())):
        for edge in own:
            users[edge].append(face)
    ups = np.roll(faces, -1, axis=1) > faces
    turned = np.full(len(faces), -1)
    for seed in range(len(faces)):
        waiting = [seed] if turned[seed] < 0 else []
        turned[seed] = max(turned[seed], 0)
        while waiting:  # bound: each face enters once
            face = waiting.pop()
            budget.check()
            for side, edge in enumerate(edges.of[face].tolist()):
                for other in users[edge] if len(users[edge]) == 2 else ():
                    if other != face and turned[other] < 0:
                        there = edges.of[other].tolist().index(edge)
                        turned[other] = turned[face] ^ (ups[face, side] == ups[other, there])
                        waiting.append(other)
    made = np.where(turned[:, None] == 1, faces[:, ::-1], faces)
    n_wrong = int((edges_of(made).net != 0).sum())
    for shell, is_turned in [*nesting(points, made, shells_of(edges, budget), budget)]:
        if is_turned:
            made[shell] = made[shell][:, ::-1]
    n_turned = int((made != faces).any(axis=1).sum())
    rest = f"; {n_wrong} edges cannot be: the mesh is open or one-sided there" if n_wrong else ""
    mended.append(f"orient: {n_turned} faces are turned{rest}")
    return made


class _Shell:
    """One shell: the triangles `part` of a mesh; `body` is it as a polyhedron, made at first use."""

    def __init__(self, points: FloatArray, faces: IntArray, part: IntArray) -> None:
        self.points, self.faces, self.part = points, faces[part], part
        self.vertices = ascending(self.faces)
        self.low, self.high = (pick(points[self.vertices], axis=0) for pick in (np.min, np.max))
        self.is_odd = (self.faces == np.roll(self.faces, 1, axis=1)).any(axis=1)
        """Of triangles that name a vertex twice: they use each edge both ways."""
        self._body: Polyhedron | None = None

    def body(self, budget: Budget) -> Polyhedron:
        if self._body is None:
            faces = self.faces[~self.is_odd]
            self._body = Polyhedron(self.points, faces, deadline=budget.left(), cancel=budget.cancel)
        return self._body


def nesting(
    points: FloatArray, faces: IntArray, parts: list[IntArray], budget: Budget
) -> Iterator[tuple[IntArray, bool]]:
    """Yield each closed shell among `parts`, and whether it must be turned over: its signed volume should be positive
    within an even number of other shells, negative within an odd number. Shells may cross here."""
    closed = []
    for shell in (_Shell(points, faces, part) for part in parts):
        budget.check()
        try:
            closed += [shell] if not shell.is_odd.any() and shell.body(budget) else []
        except EngineError:
            budget.check()
    depths = [0] * len(closed)
    low, high = (np.array([getattr(shell, name) for shell in closed]).reshape(-1, 3) for name in ("low", "high"))
    for i, j in all_pairs_of_boxes(low, high, budget).tolist() if closed else ():
        for one, other in ((i, j), (j, i)):
            lies = _lies_within(closed[one], closed[other], budget)
            if lies == 0:  # all its corners are on the other's faces
                lies = _detail_of(closed[one], closed[other], budget) in (Rcc8.TPP, Rcc8.NTPP)
            depths[one] += lies > 0
    for shell, depth in zip(closed, depths):
        volume = sign_of_volume(points, shell.faces, budget)
        yield shell.part, volume != 0 and (volume > 0) is (depth % 2 == 1)


def _detail_of(one: _Shell, other: _Shell, budget: Budget) -> Rcc8 | None:
    limits: Any = {"deadline": budget.left(), "cancel": budget.cancel}
    return collide(one.body(budget), other.body(budget), detail=True, **limits).detail


def _lies_within(one: _Shell, other: _Shell, budget: Budget) -> int:
    """Return 1 if a shell that crosses no other lies within another, -1 if not, 0 if all its vertices are on that."""
    if (one.low < other.low).any() or (other.high < one.high).any():
        return -1
    points = one.points[one.vertices]
    for some in (points[:1], points):
        places = locate(some, other.body(budget), deadline=budget.left(), cancel=budget.cancel)
        if places.any():
            return int(places[np.argmax(places != 0)])
    return 0
