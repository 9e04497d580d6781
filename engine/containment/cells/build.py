"""Builds the cells of a polyhedron, level by level, with the budget of the call that pays for it.

Cost: linear in the faces and the entries, 0.6 to 1.5 us a face on one thread and 200 to 600 bytes; of needles 7 to
12 us and 2,200 bytes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from engine.arrays import Float32Array, Int8Array, Int32Array, IntArray
from engine.containment.cells.lattice import (
    LEVELS,
    PARTS,
    SPLIT,
    UNKNOWN,
    Lattice,
    Level,
    Mesh,
    keep_of_details,
    list_parts,
    list_top,
)
from engine.containment.cells.locate import CODE_SHIFT, INSIDE_CELL, MIXED_CELL, OUTSIDE_CELL
from engine.containment.cells.status import fill_leaves, locate_parts
from engine.containment.cells.top import ask_cells, lattice_of, top_places, top_statuses
from engine.containment.prepared.triangle_tree import TriangleTree, cost_in_tree, tree_of
from engine.lanes.cells import groups_of
from engine.lanes.tracing import LANES
from engine.running.budget import Budget
from engine.solids.polyhedron import Polyhedron

_LONG_ON_TOP, _LONG_IN_SMALL, _LONG = 24, 8, 32
"""Lists longer than this are cut into parts: on level 0, there in meshes so small that the memory of short lists stays
in the cache, and below. Finer parts take more memory than they save time."""
_SMALL_MESH: Final = 1 << 12
_MOST_ENTRIES: Final = 24
"""Entries a face (and 2^14 more) above which a level is not cut further."""
_GROUP: Final = 8.0
"""Nanoseconds that a group of a list costs a point: lists that cost more than the tree are left to it."""
_FEWEST_GROUPS: Final = 32
_COARSE: Final = 2
"""Cuts that every long list gets: deeper ones are for detail, where most triangles are smaller than the cell. What
meets in a vertex or runs side by side is not told apart by finer cells."""


class Cells(NamedTuple):
    """What `locate_by_cells` reads."""

    lattice: Lattice
    statuses: Int8Array
    """(n + 1,) of level 0: the location of all points of a cell, UNDECIDED where its code says more, and last that of
    points beyond the lattice; small enough to stay in the cache."""
    codes: Int32Array
    """Level 0, then 64 a brick."""
    n_levels: int
    groups: Float32Array
    """(n, 14, 8): what leaves keep of their triangles (lanes/cells.py)."""


def cells_of(solid: Polyhedron, budget: Budget) -> Cells:
    """Return the cells of a solid that can have them, prepared once."""
    return solid.prepared("cells", lambda: build_cells(solid, budget), budget.check)


def build_cells(solid: Polyhedron, budget: Budget) -> Cells:
    """Return the cells of `solid`. Raises what `Budget.check` raises."""
    tree = tree_of(solid, budget.check)
    lattice, _ = lattice_of(solid, budget)
    mesh = Mesh(tree.vertices, tree.triangles, lattice)
    level, index, found = _top_level(tree, mesh, budget)
    codes, leaves = [], []
    long_on_top = _LONG_IN_SMALL if len(tree.triangles) <= _SMALL_MESH else _LONG_ON_TOP
    longest = LANES * max(_FEWEST_GROUPS, cost_in_tree(solid) / _GROUP)
    n_groups = n_bricks = 0
    for depth in range(LEVELS):
        lengths = np.diff(level.firsts)
        is_cut = lengths > (_LONG if depth else long_on_top)
        if depth == LEVELS - 1 or len(level.lists) > _MOST_ENTRIES * len(tree.triangles) + (1 << 14):
            is_cut[:] = False
        elif depth >= _COARSE:
            long = np.flatnonzero(is_cut)
            keep_of_details(mesh, level, long, is_cut, budget.flag)
            budget.check()
        parents = np.flatnonzero(is_cut)
        kept = np.flatnonzero(~is_cut & (level.statuses != UNKNOWN) & (lengths <= longest))
        sizes = (lengths[kept] + LANES - 1) // LANES
        starts = n_groups + np.cumsum(sizes) - sizes
        code = np.full(len(found), MIXED_CELL, np.int32)
        code[found == -1], code[found == 1] = OUTSIDE_CELL, INSIDE_CELL
        code[index] = MIXED_CELL
        code[index[kept]] = 4 * starts + 2 * (level.statuses[kept] > 0)
        code[index[parents]] = 2 * (n_bricks + np.arange(len(parents))) + 1
        n_groups, n_bricks = n_groups + int(sizes.sum()), n_bricks + len(parents)
        codes.append(code)
        leaves.append((level, kept, starts))
        if not len(parents):
            break
        level, index, found = _next_level(tree, mesh, level, parents, budget)
    groups = groups_of(n_groups)
    for of_level in leaves:
        fill_leaves(mesh, *of_level, groups, budget.flag)
        budget.check()
    return Cells(
        lattice, np.append(np.minimum(codes[0], MIXED_CELL) + CODE_SHIFT, -1).astype(np.int8), np.concatenate(codes),
        len(codes), groups,
    )  # fmt: skip


def _listed(
    lister: Callable[[IntArray, Int32Array, bool], object], n: int, budget: Budget
) -> tuple[IntArray, IntArray, IntArray, Int32Array]:
    """Return the lengths of n lists, which of them are not empty, where those begin and the last ends, and the lists.

    lister: counts, then fills, as `list_top` does.
    """
    counts = np.zeros(n, np.int64)
    lister(counts, np.empty(0, np.int32), False)
    budget.check()
    ends = np.cumsum(counts)
    lists = np.empty(int(ends[-1]), np.int32)
    lister(ends - counts, lists, True)
    budget.check()
    index = np.flatnonzero(counts)
    return counts, index, np.append(ends[index] - counts[index], ends[-1]), lists


def _top_level(tree: TriangleTree, mesh: Mesh, budget: Budget) -> tuple[Level, IntArray, Int8Array]:
    """Return level 0, the place of its cells among all, and the statuses of all, those without lists included."""
    nx, ny, nz = mesh.lattice.n
    counts, index, firsts, lists = _listed(lambda *rest: list_top(mesh, *rest, budget.flag), nx * ny * nz, budget)
    found = top_statuses(tree, mesh.lattice, counts, False, budget)
    places = top_places(mesh.lattice, index)
    return Level(0, places, found[index], firsts, lists), index, found


def _next_level(
    tree: TriangleTree, mesh: Mesh, above: Level, parents: IntArray, budget: Budget
) -> tuple[Level, IntArray, Int8Array]:
    """Return the level below `above`, as `_top_level` does, of which all cells are the parts of `parents`."""
    n = len(parents) * PARTS
    counts, index, firsts, lists = _listed(
        lambda *rest: list_parts(mesh, above, parents, *rest, budget.flag), n, budget
    )
    found = np.empty(n, np.int8)
    groups = groups_of(int(np.diff(above.firsts)[parents].max() + LANES - 1) // LANES)
    locate_parts(mesh, above, parents, counts, groups, found, budget.flag)
    budget.check()
    unknown, depth = np.flatnonzero(found == UNKNOWN), above.depth + 1
    found[unknown] = ask_cells(tree, mesh.lattice, _part_places(above.places[parents], unknown), depth, budget)
    return Level(depth, _part_places(above.places[parents], index), found[index], firsts, lists), index, found


def _part_places(places: Int32Array, parts: IntArray) -> Int32Array:
    """Return the indices of parts on their level, given those of their parents on the level above."""
    part = parts % PARTS
    offset = np.stack([part % SPLIT, part // SPLIT % SPLIT, part // (SPLIT * SPLIT)], axis=1)
    return np.ascontiguousarray(places[parts // PARTS] * SPLIT + offset, np.int32)
