"""Settles the candidates that the first pass over a scene left open, grouped by body.

Polyhedra of moderate size are asked all together, by the tree of each (trees.py). What is then still open,
and what is of other kinds, each body locates by itself as `locate` does.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from engine.arrays import FloatArray, Int8Array, IntArray
from engine.bounding.bvh import STACK
from engine.budget import Budget
from engine.containment.cells.order import counting_sort
from engine.containment.cells.top import MOST_FACES, top_cells_if_they_pay
from engine.containment.locators import Counts
from engine.containment.prepared import tree_of
from engine.containment.scene.tables import Scene
from engine.containment.scene.trees import TreeTables, locate_groups, tree_line
from engine.parallel import run_chunks
from engine.solids.polyhedron import Polyhedron
from engine.types import UNDECIDED

_MOST_IN_GROUP: Final = 1 << 14
"""Points that one body locates in one piece of work."""
_FEWEST_FOR_TREES: Final = 64
"""Points that a tree is built for; fewer are left to what `locate` does with few points."""


def settle_rest(
    points: FloatArray, scene: Scene, owners_of: list[IntArray], bodies_of: list[IntArray],
    take: list[Callable[[Int8Array], object]], budget: Budget, workers: int | None,
) -> Counts:  # fmt: skip
    """Locate pairs of a point (owners) and a body, given piece by piece, and hand each piece its locations.

    Returns how many took more than the filter, and how many rational arithmetic.
    """
    owners = np.concatenate([np.zeros(0, np.int64), *owners_of])
    bodies = np.concatenate([np.zeros(0, np.int64), *bodies_of])
    if not len(owners):
        return Counts(0, 0)
    n_bodies = len(scene.owners)
    found, order = np.full(len(owners), UNDECIDED, np.int8), np.empty(len(owners), np.int64)
    sizes = np.bincount(bodies, minlength=n_bodies)
    counting_sort(bodies, np.cumsum(sizes) - sizes, order, budget.flag)
    budget.check()
    tables = _tree_tables(scene, sizes, budget, workers)
    if tables is not None:
        groups = _groups(sizes)

        def by_trees(start: int, stop: int) -> None:
            with np.errstate(all="ignore"):
                locate_groups(
                    points, owners, order, *(each[start:stop] for each in groups), scene.tables, tables, found,
                    np.empty(STACK, np.int32), budget.flag,
                )  # fmt: skip

        run_chunks(by_trees, len(groups[0]), budget=budget, first_chunk=4, workers=workers)
        order = order[found[order] == UNDECIDED]
        sizes = np.bincount(bodies[order], minlength=n_bodies)
    counts = []
    rest = [each.tolist() for each in _groups(sizes)]

    def one_by_one(start: int, stop: int) -> None:
        for begin, end, body in zip(*(each[start:stop] for each in rest)):
            places = order[begin:end]
            located = np.empty(end - begin, np.int8)
            locator = scene.locator(body).chosen(end - begin, budget)
            counts.append(locator.fill(points[owners[places]], located, budget))
            found[places] = located

    run_chunks(one_by_one, len(rest[0]), budget=budget, first_chunk=1, workers=workers)
    ends = np.cumsum([len(each) for each in owners_of])
    for piece, part in zip(take, np.split(found, ends[:-1])):
        piece(part)
    return Counts(sum(each.beyond for each in counts), sum(each.rational for each in counts))


def _groups(sizes: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return begin, end and body of pieces of work, of pairs that are grouped by body."""
    bodies = np.flatnonzero(sizes)
    n_parts = (sizes[bodies] + _MOST_IN_GROUP - 1) // _MOST_IN_GROUP
    lasts = np.cumsum(sizes)[bodies]
    part = np.arange(int(n_parts.sum())) - np.repeat(np.cumsum(n_parts) - n_parts, n_parts)
    begins = np.repeat(lasts - sizes[bodies], n_parts) + part * _MOST_IN_GROUP
    return begins, np.minimum(begins + _MOST_IN_GROUP, np.repeat(lasts, n_parts)), np.repeat(bodies, n_parts)


def _tree_tables(scene: Scene, sizes: IntArray, budget: Budget, workers: int | None) -> TreeTables | None:
    """Return the trees of the polyhedra that are asked often enough, built where they are not there yet."""
    asked = np.bincount(scene.owners, weights=sizes, minlength=len(scene.solids))
    chosen: list[tuple[int, Polyhedron]] = []
    for index in np.flatnonzero(asked).tolist():
        solid = scene.solids[index]
        if isinstance(solid, Polyhedron) and len(solid.triangles) <= MOST_FACES:
            if asked[index] >= _FEWEST_FOR_TREES or solid.kept("tree") is not None:
                chosen.append((index, solid))
    if not chosen:
        return None

    def build(start: int, stop: int) -> None:
        for index, solid in chosen[start:stop]:
            tree_of(solid, budget.check)
            top_cells_if_they_pay(solid, int(asked[index]), budget)

    run_chunks(build, len(chosen), budget=budget, first_chunk=1, workers=workers)
    rows = np.full(len(scene.solids), -1, np.int32)
    rows[[index for index, _ in chosen]] = np.arange(len(chosen))
    lines = [tree_line(tree_of(solid, budget.check)) for _, solid in chosen]
    cells = [solid.kept("top_cells") for _, solid in chosen]
    addresses, sizes_of, places = (np.array(each) for each in zip(*lines))
    return TreeTables(
        rows[scene.owners], addresses, sizes_of, places,
        np.array([(0, 0, 0, 0) if each is None else each.place for each in cells], np.int64),
        np.array([np.zeros(6) if each is None else each.frame for each in cells]),
    )  # fmt: skip
