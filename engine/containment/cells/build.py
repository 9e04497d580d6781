"""Builds the cells of a polyhedron, with the budget of the call that pays for it.

Two cells without triangles that share a wall lie on one side of the surface, so only the first of each such group, in
scanning order, is asked about, by a vertical ray; the others copy. So are the reference points of the others.

Cost: linear in the faces and the entries, some 0.5 us a face on one thread and 150 to 500 bytes.

Source: C. Ericson, Real-Time Collision Detection, 2005, 7.1 (uniform grids), with a reference point a cell.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.compiling.jit import inline, kernel
from engine.containment.cells.lattice import (
    PLACE,
    Lattice,
    Mesh,
    can_have_cells,
    count_triangles,
    lattice_of,
    list_triangles,
    reference_point,
    scaled_difference,
)
from engine.containment.methods.polyhedron_ray_parity import locate_by_tree
from engine.containment.prepared import TriangleTree, cost_in_tree, tree_of
from engine.lanes.cells import ROWS, groups_of, set_entry, set_nothing
from engine.lanes.tracing import LANES
from engine.predicates.vectors import corners_of
from engine.running.budget import Budget
from engine.solids.mesh import Polyhedron
from engine.types import UNDECIDED, FlagArray, Float32Array, FloatArray, Int8Array, Int32Array, IntArray, read_only

MIXED_CELL: Final = -1
"""Code of a cell that is left to the tree: its side is not known, or its list costs more than the tree."""
_UNKNOWN: Final = 0
_GROUP: Final = 8.0
"""Nanoseconds that a group of a list costs a point."""
_FEWEST_GROUPS: Final = 32
MOST_FACES: Final = 1 << 14
"""Of a solid whose sides serve scenes."""
_PAYS_FROM, _PAYS_PER_FACE = 1 << 10, 2
_AT_ONCE: Final = 4096


class Cells(NamedTuple):
    """What `locate_by_cells` reads."""

    lattice: Lattice
    statuses: Int8Array
    """(n + 1,): the location of all points of a cell, UNDECIDED where a triangle may reach into it, and last that of
    points beyond the lattice."""
    codes: Int32Array
    """(n,): of an UNDECIDED cell its first group, doubled, and whether its reference point is inside; MIXED_CELL."""
    groups: Float32Array
    """(n_groups, 14, 8): what cells keep of their triangles (lanes/cells.py)."""


class Sides(NamedTuple):
    """What `side_in_cell` reads."""

    frame: FloatArray
    """``(6,)``: the low corner of the lattice, and cells to a unit."""
    place: tuple[int, int, int, int]
    """Address of `statuses`, and cells along each axis."""
    statuses: Int8Array
    """As `Cells` has them."""


def cells_of(solid: Polyhedron, budget: Budget) -> Cells:
    """Return the cells of a solid that can have them, prepared once."""
    return solid.prepared("cells", lambda: build_cells(solid, budget), budget.check)


def build_cells(solid: Polyhedron, budget: Budget) -> Cells:
    """Return the cells of `solid`. Raises what `Budget.check` raises."""
    tree, lattice = tree_of(solid, budget.check), lattice_of(solid, budget)
    mesh = Mesh(tree.vertices, tree.triangles, lattice)
    counts = count_triangles(mesh, budget)
    ends = np.cumsum(counts)
    lists = np.empty(int(ends[-1]), np.int32)
    list_triangles(mesh, ends - counts, lists, True, budget.flag)
    budget.check()
    found = _sides_of(tree, lattice, counts, False, budget)
    longest = LANES * max(_FEWEST_GROUPS, cost_in_tree(solid) / _GROUP)
    leaves = np.flatnonzero((counts > 0) & (found != _UNKNOWN) & (counts <= longest))
    last_groups = np.cumsum((counts[leaves] + LANES - 1) // LANES)
    starts = np.append(0, last_groups)[:-1]
    codes = np.full(len(counts), MIXED_CELL, np.int32)
    codes[leaves] = 2 * starts + (found[leaves] > 0)
    groups = groups_of(int(last_groups[-1]) if len(leaves) else 0)
    fill_groups(mesh, leaves, starts, (ends - counts)[leaves], ends[leaves], lists, groups, budget.flag)
    budget.check()
    return Cells(lattice, _statuses(found, counts), codes, groups)


def sides_if_they_pay(solid: Polyhedron, n_points: int, budget: Budget) -> Sides | None:
    """Return the sides of the cells of `solid` if the points asked in scenes so far pay for building them.

    That takes about 0.5 us a face and 10 ns a cell, some 0.5 ms for 1,000 faces; a ray takes 0.2 us.
    """
    seen = solid.prepared("scene_points_seen", lambda: [0], budget.check)
    seen[0] += n_points
    n_faces = len(solid.triangles)
    if n_faces > MOST_FACES or seen[0] < _PAYS_FROM + _PAYS_PER_FACE * n_faces:
        return None
    if not solid.prepared("can_have_cells", lambda: can_have_cells(solid)):
        return None
    return solid.prepared("sides", lambda: build_sides(solid, budget), budget.check)


def build_sides(solid: Polyhedron, budget: Budget) -> Sides:
    """Return the sides of the cells of `solid`. Raises what `Budget.check` raises."""
    tree, lattice = tree_of(solid, budget.check), lattice_of(solid, budget)
    counts = count_triangles(Mesh(tree.vertices, tree.triangles, lattice), budget)
    statuses = _statuses(_sides_of(tree, lattice, counts, True, budget), counts)
    return Sides(np.array([*lattice.low, *lattice.scale]), (statuses.ctypes.data, *lattice.n), statuses)


def _statuses(found: Int8Array, counts: IntArray) -> Int8Array:
    return np.append(np.where((counts > 0) | (found == _UNKNOWN), UNDECIDED, found), -1).astype(np.int8)


@kernel
def label_empty(counts: IntArray, nx: int, ny: int, labels: IntArray) -> None:
    """Fill labels (nz * ny * nx,) int64 with the cell that each empty cell copies from, itself for one that is asked.

    Cells with a list label themselves.
    """
    for cell in range(len(counts)):
        labels[cell] = cell
        if counts[cell] != 0:
            continue
        if cell % nx > 0 and counts[cell - 1] == 0:
            labels[cell] = labels[cell - 1]
        elif cell // nx % ny > 0 and counts[cell - nx] == 0:
            labels[cell] = labels[cell - nx]
        elif cell >= nx * ny and counts[cell - nx * ny] == 0:
            labels[cell] = labels[cell - nx * ny]


def _sides_of(tree: TriangleTree, lattice: Lattice, counts: IntArray, only_empty: bool, budget: Budget) -> Int8Array:
    """Return the sides of cells, by vertical rays: of all of an empty one, of the reference point of another one.

    _UNKNOWN where that point is not in its cell, on the boundary, or not decided by the compiled ray. counts: lengths
    of the cells' lists. only_empty: the other ones are not asked about.
    """
    (nx, ny, _), labels = lattice.n, np.empty(len(counts), np.int64)
    label_empty(counts, nx, ny, labels)
    asked = np.flatnonzero((labels == np.arange(len(labels))) & ((counts == 0) | (not only_empty)))
    sides, no_blurs = np.zeros(len(counts), np.int8), np.zeros(_AT_ONCE)
    for start in range(0, len(asked), _AT_ONCE):
        cells = asked[start : start + _AT_ONCE]
        places = np.stack([cells % nx, cells // nx % ny, cells // (nx * ny)], axis=1)
        points, found = np.array(lattice.low) + (places + PLACE) * lattice.size, np.empty(len(cells), np.int8)
        with np.errstate(all="ignore"):
            locate_by_tree(read_only(points), no_blurs[: len(cells)], tree, found, budget.flag)
        budget.check()
        is_in_cell = (((points - lattice.low) * lattice.scale).astype(np.int64) == places).all(axis=1)
        sides[cells] = np.where(is_in_cell & (np.abs(found) == 1), found, _UNKNOWN)
    return sides[labels]


@kernel
def fill_groups(
    mesh: Mesh, leaves: IntArray, starts: IntArray, firsts: IntArray, ends: IntArray, lists: Int32Array,
    groups: Float32Array, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill groups (n, 14, 8) with the lists of cells, each from the group in `starts`, about its reference point."""
    nx, ny, _ = mesh.lattice.n
    for item in range(len(leaves)):
        if flag[0]:
            break
        cell = leaves[item]
        reference = reference_point(mesh.lattice, cell % nx, cell // nx % ny, cell // (nx * ny))
        _fill_list(mesh, lists[firsts[item] : ends[item]], reference, groups, starts[item])


@inline
def _fill_list(
    mesh: Mesh, triangles: Int32Array, reference: tuple[float, ...], groups: Float32Array, first_group: int
) -> None:
    """Write the groups of a cell's triangles, in units of cells."""
    scale, n_groups = mesh.lattice.scale, (len(triangles) + LANES - 1) // LANES
    for place in range(n_groups * LANES):
        row = groups[first_group + place // LANES, :, place % LANES]
        row[ROWS - 1] = 1.0 if place // LANES == n_groups - 1 else 0.0
        if place >= len(triangles):
            set_nothing(row)
            continue
        a, b, c = corners_of(mesh.vertices, mesh.triangles, triangles[place])
        set_entry(
            row, scaled_difference(a, reference, scale), scaled_difference(b, reference, scale),
            scaled_difference(c, reference, scale), scaled_difference(b, a, scale), scaled_difference(c, a, scale),
        )  # fmt: skip
