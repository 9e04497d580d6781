"""Builds the cells of a polyhedron: a uniform grid with a reference point of known location in each cell.

Adjacent cells without triangles lie on one side of the surface. So one cell of each connected group, the first in
scanning order, is located by a vertical ray, and the others copy its side (flood fill). The reference point of a cell
with triangles is located by a ray of its own.

Cost: linear in the faces and the entries of the lists, some 0.5 us a face on one thread and 150 to 500 bytes.

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
from engine.running.parallel import share
from engine.solids.mesh import Polyhedron
from engine.types import UNDECIDED, FlagArray, Float32Array, FloatArray, Int8Array, Int32Array, IntArray, read_only

MIXED_CELL: Final = -1
"""Code of a cell whose points go to the tree: its reference point is undecided, or its list costs more than the tree.
"""
_UNKNOWN: Final = 0
_GROUP: Final = 8.0
"""Nanoseconds that a point takes for one group of eight triangles."""
_FEWEST_GROUPS: Final = 32
MOST_FACES: Final = 1 << 14
"""Number of faces up to which scenes build `Sides`."""
_PAYS_FROM, _PAYS_PER_FACE = 1 << 10, 2
_GROUP_SECONDS, _RAY_SECONDS = 1.5e-6, 1e-6
"""Time to fill a group, and for each ray."""


class Cells(NamedTuple):
    """Grid, cell statuses and triangle lists of a polyhedron: the argument of `locate_by_cells`."""

    lattice: Lattice
    statuses: Int8Array
    """(n + 1,): location of all points of each cell, UNDECIDED if a triangle may reach into it; the last entry is for
    points outside the grid."""
    codes: Int32Array
    """(n,): of an UNDECIDED cell 2 * index of its first group + (1 if its reference point is inside), or MIXED_CELL."""
    groups: Float32Array
    """(n_groups, 14, 8): the triangles listed in the cells, in the layout of lanes/cells.py."""


class Sides(NamedTuple):
    """Grid and cell statuses of a polyhedron without lists: the argument of `side_in_cell`."""

    frame: FloatArray
    """``(6,)``: low corner of the grid, and cells per unit of length on each axis."""
    place: tuple[int, int, int, int]
    """Address of `statuses`, and number of cells along each axis."""
    statuses: Int8Array
    """As in `Cells`."""


def cells_of(solid: Polyhedron, budget: Budget) -> Cells:
    """Return the `Cells` of a polyhedron, built at first use. Caller guarantees `can_have_cells`."""
    return solid.prepared("cells", lambda: build_cells(solid, budget), budget.check)


def build_cells(solid: Polyhedron, budget: Budget) -> Cells:
    """Build the cells of `solid`. Raises: DeadlineExceededError, CancelledError."""
    tree, lattice = tree_of(solid, budget.check), lattice_of(solid, budget)
    mesh = Mesh(tree.vertices, tree.triangles, lattice)
    lists, counts, ends = list_triangles(mesh, count_triangles(mesh, budget.flag), budget.flag)
    sides = _sides_by_rays(tree, lattice, counts, False, budget)
    longest = LANES * max(_FEWEST_GROUPS, cost_in_tree(solid) / _GROUP)
    leaves = np.flatnonzero((counts > 0) & (sides != _UNKNOWN) & (counts <= longest))
    last_groups = np.cumsum((counts[leaves] + LANES - 1) // LANES)
    starts = np.append(0, last_groups)[:-1]
    codes = np.full(len(counts), MIXED_CELL, np.int32)
    codes[leaves] = 2 * starts + (sides[leaves] > 0)
    groups = groups_of(int(last_groups[-1]) if len(leaves) else 0)
    firsts, ends = (ends - counts)[leaves], ends[leaves]

    def fill(first: int, last: int) -> None:
        some = slice(first, last)
        fill_groups(mesh, leaves[some], starts[some], firsts[some], ends[some], lists, groups, budget.flag)

    share(fill, len(leaves), _GROUP_SECONDS * len(groups) / max(1, len(leaves)))
    return Cells(lattice, _statuses(sides, counts), codes, groups)


def sides_if_profitable(solid: Polyhedron, n_points: int, budget: Budget) -> Sides | None:
    """Return the `Sides` of a polyhedron, built at first use; None until scenes have located enough points (n_points
    more now) to pay for them, or if they cannot be built. Construction takes about 0.5 us a face and 10 ns a cell, some
    0.5 ms for 1,000 faces; a ray takes 0.2 us."""
    seen = solid.prepared("scene_points_seen", lambda: [0], budget.check)
    seen[0] += n_points
    n_faces = len(solid.triangles)
    if n_faces > MOST_FACES or seen[0] < _PAYS_FROM + _PAYS_PER_FACE * n_faces:
        return None
    if not solid.prepared("can_have_cells", lambda: can_have_cells(solid)):
        return None
    return solid.prepared("sides", lambda: build_sides(solid, budget), budget.check)


def build_sides(solid: Polyhedron, budget: Budget) -> Sides:
    """Build the `Sides` of a polyhedron. Raises: DeadlineExceededError, CancelledError."""
    tree, lattice = tree_of(solid, budget.check), lattice_of(solid, budget)
    counts = count_triangles(Mesh(tree.vertices, tree.triangles, lattice), budget.flag).sum(axis=0)
    statuses = _statuses(_sides_by_rays(tree, lattice, counts, True, budget), counts)
    return Sides(np.array([*lattice.low, *lattice.scale]), (statuses.ctypes.data, *lattice.n), statuses)


def _statuses(sides: Int8Array, counts: IntArray) -> Int8Array:
    return np.append(np.where((counts > 0) | (sides == _UNKNOWN), UNDECIDED, sides), -1).astype(np.int8)


@kernel
def label_empty_cells(counts: IntArray, nx: int, ny: int, labels: IntArray) -> None:
    """Fill labels (nz * ny * nx,) int64 with the number of a cell on the same side of the surface (flood fill in
    scanning order): an empty cell takes the label of an empty neighbour before it; the first of a group, and a cell
    with triangles, its own number. counts: triangles listed in each cell."""
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


def _sides_by_rays(
    tree: TriangleTree, lattice: Lattice, counts: IntArray, only_empty: bool, budget: Budget
) -> Int8Array:
    """Return, by cell, the side (1 inside, -1 outside) of an empty cell, or of the reference point of another, by
    vertical rays. _UNKNOWN: the reference point rounds out of its cell, is on the boundary, or is UNDECIDED. counts:
    triangles listed in each cell. only_empty: skip cells with triangles."""
    (nx, ny, _), labels = lattice.n, np.empty(len(counts), np.int64)
    label_empty_cells(counts, nx, ny, labels)
    queried = np.flatnonzero((labels == np.arange(len(labels))) & ((counts == 0) | (not only_empty)))
    sides = np.zeros(len(counts), np.int8)

    def ask(first: int, last: int) -> None:
        cells = queried[first:last]
        places = np.stack([cells % nx, cells // nx % ny, cells // (nx * ny)], axis=1)
        points, locations = np.array(lattice.low) + (places + PLACE) * lattice.size, np.empty(len(cells), np.int8)
        with np.errstate(all="ignore"):
            locate_by_tree(read_only(points), np.zeros(len(cells)), tree, locations, budget.flag)
        is_in_cell = (((points - lattice.low) * lattice.scale).astype(np.int64) == places).all(axis=1)
        sides[cells] = np.where(is_in_cell & (np.abs(locations) == 1), locations, _UNKNOWN)

    share(ask, len(queried), _RAY_SECONDS)
    return sides[labels]


@kernel
def fill_groups(
    mesh: Mesh, leaves: IntArray, starts: IntArray, firsts: IntArray, ends: IntArray, lists: Int32Array,
    groups: Float32Array, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill groups (n, 14, 8) with the triangles of the cells ``leaves[item]``, eight a group: those listed in
    lists[firsts[item] : ends[item]] go to the groups from starts[item] on."""
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
    """Write the triangles of one cell to groups from `first_group` on, relative to the cell's reference point, in units
    of cells."""
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
