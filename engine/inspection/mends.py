"""Mends of meshes, each by an option, and each with a sentence that says what it did."""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise

import numpy as np

from engine.bounding.box_grid import pairs_of_boxes
from engine.inspection.nesting import nesting
from engine.running.budget import Budget, polled
from engine.solid_cutting.faults import edges_of, junctions, shells_of
from engine.types import FloatArray, IntArray


def welded(
    points: FloatArray, faces: IntArray, distance: float, budget: Budget, mended: list[str]
) -> tuple[FloatArray, IntArray]:
    """Merge vertices within `distance` of each other, also through chains of such vertices: return the points,
    unchanged, and the faces with the smallest index of each group in place of its members, collapsed faces left out.
    What was done is appended to `mended`."""
    used = np.unique(faces)
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
