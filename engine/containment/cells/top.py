"""Level 0 of the cells of a polyhedron: the lattice, and on which side of the surface its cells lie.

By itself it serves scenes: cheap to build, and small, it tells the location of most points at once.
"""

from __future__ import annotations

from math import frexp, ldexp
from typing import Final, NamedTuple

import numpy as np

from engine.arrays import FloatArray, Int8Array, Int32Array, IntArray, read_only
from engine.containment.cells.lattice import UNKNOWN, Lattice, Mesh, list_top
from engine.containment.cells.status import label_empty, reference_points
from engine.containment.methods.polyhedron_ray_parity import locate_by_tree
from engine.containment.prepared.triangle_tree import TriangleTree, tree_of
from engine.running.budget import Budget
from engine.solids.polyhedron import Polyhedron
from engine.types import UNDECIDED

MOST_FACES: Final = 1 << 14
"""Of a solid whose level 0 serves scenes: for a larger one all levels are better."""
_PAYS_FROM: Final = 1 << 10
_PAYS_PER_FACE: Final = 2
_WANTED: Final = 4.0
"""Cells along an axis for each triangle along an edge of a cube, and at most."""
_MOST_CELLS: Final = 64.0
_MOST_OF_ALL: Final = 96.0
"""Where finer levels follow: more than fit the cache cost uniform points more than they save."""
_FEWEST_CELLS: Final = 12
_MOST_ENTRIES: Final = 12.0
_FEW_ENTRIES: Final = 1 << 16
"""Cells that list a triangle, in the mean, and in all, from which level 0 is made coarser, to so many along an axis at
least."""
_SAMPLE: Final = 1024
_RANGE: Final = 2.0**400
"""Largest extent, and 1 / smallest, of a solid that gets cells: products of three stay far from its ends."""
_AT_ONCE: Final = 4096


class TopCells(NamedTuple):
    """What `side_in_cell` reads."""

    frame: FloatArray
    """``(6,)``: the low corner of the lattice, and cells to a unit."""
    place: tuple[int, int, int, int]
    """Address of `sides`, and cells along each axis."""
    sides: Int8Array
    """The location of all points of a cell, UNDECIDED where a triangle may reach into it."""


def can_have_cells(solid: Polyhedron) -> bool:
    """Tell whether the coordinates are in the range of the cells; all but scenes near the ends of the exponents are."""
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    with np.errstate(over="ignore"):
        extent = (high - low).max()
    return bool(1.0 / _RANGE < extent < _RANGE and np.abs(solid.vertices).max() < _RANGE)


def top_cells_if_they_pay(solid: Polyhedron, n_points: int, budget: Budget) -> TopCells | None:
    """Return level 0 of `solid` if it is there, or if the points asked in scenes so far pay for building it.

    Building takes about 0.5 us a face and 10 ns a cell, some 0.5 ms for 1,000 faces; a ray takes 0.2 us. The answers
    are the same either way.
    """
    seen = solid.prepared("scene_points_seen", lambda: [0], budget.check)
    seen[0] += n_points
    n_faces = len(solid.triangles)
    if n_faces > MOST_FACES or seen[0] < _PAYS_FROM + _PAYS_PER_FACE * n_faces:
        return None
    if not solid.prepared("can_have_cells", lambda: can_have_cells(solid)):
        return None
    return solid.prepared("top_cells", lambda: build_top_cells(solid, budget), budget.check)


def build_top_cells(solid: Polyhedron, budget: Budget) -> TopCells:
    """Return level 0 of `solid`. Raises what `Budget.check` raises."""
    tree = tree_of(solid, budget.check)
    lattice = make_lattice(tree, _WANTED, _MOST_CELLS)
    nx, ny, nz = lattice.n
    counts = np.zeros(nx * ny * nz, np.int64)
    mesh = Mesh(tree.vertices, tree.triangles, lattice)
    list_top(mesh, counts, np.empty(0, np.int32), False, budget.flag)
    budget.check()
    sides = top_statuses(tree, lattice, counts, True, budget)
    sides[sides == UNKNOWN] = UNDECIDED
    return TopCells(np.array([*lattice.low, *lattice.scale]), (sides.ctypes.data, nx, ny, nz), sides)


def make_lattice(tree: TriangleTree, wanted: float, most: float) -> Lattice:
    """Return level 0: some cells to each triangle of a cube, by powers of two, flat axes in one cell.

    wanted: cells along the longest axis for each triangle along an edge of a cube; most: cells along it.
    """
    low, high = tree.low, tree.high
    extent = np.subtract(high, low)
    largest = float(extent.max())
    size = _power_of_two(largest / min(most, max(8.0, wanted * len(tree.triangles) ** (1.0 / 3.0))))
    sizes = [size if float(e) >= size else _power_of_two(max(float(e), largest * 2.0**-40)) for e in extent]
    lows = tuple(low[k] - sizes[k] * (95.0 / 256.0) for k in range(3))
    n = tuple(int((high[k] - lows[k]) / sizes[k]) + 1 for k in range(3))
    return Lattice(
        (lows[0], lows[1], lows[2]), (1.0 / sizes[0], 1.0 / sizes[1], 1.0 / sizes[2]), (sizes[0], sizes[1], sizes[2]),
        (n[0], n[1], n[2]),
    )  # fmt: skip


def lattice_of(solid: Polyhedron, budget: Budget) -> tuple[Lattice, float]:
    """Return level 0 of all levels, and how long its lists are in all, as a sample of the triangles says; found once.

    It is finer than that of scenes, as far as it fits the cache, but that long needles and large faces are not listed
    in more than some cells each.
    """
    return solid.prepared("lattice", lambda: _find_lattice(tree_of(solid, budget.check), budget), budget.check)


def _find_lattice(tree: TriangleTree, budget: Budget) -> tuple[Lattice, float]:
    some = tree.triangles[:: len(tree.triangles) // _SAMPLE + 1].copy()
    most = _MOST_OF_ALL
    while True:
        lattice = make_lattice(tree, _WANTED, most)
        counts = np.zeros(lattice.n[0] * lattice.n[1] * lattice.n[2], np.int64)
        list_top(Mesh(tree.vertices, some, lattice), counts, np.empty(0, np.int32), False, budget.flag)
        budget.check()
        entries = float(counts.sum()) / len(some) * len(tree.triangles)
        if entries <= _MOST_ENTRIES * len(tree.triangles) + _FEW_ENTRIES or max(lattice.n) <= _FEWEST_CELLS:
            return lattice, entries
        most = min(most, max(lattice.n)) / 2.0


def _power_of_two(value: float) -> float:
    """Return the power of two next above or equal to value."""
    mantissa, exponent = frexp(value)
    return ldexp(1.0, exponent - 1 if mantissa == 0.5 else exponent)


def top_places(lattice: Lattice, cells: IntArray) -> Int32Array:
    """Return the indices (m, 3) of cells of level 0 along the axes."""
    nx, ny, _ = lattice.n
    return np.stack([cells % nx, cells // nx % ny, cells // (nx * ny)], axis=1).astype(np.int32)


def top_statuses(tree: TriangleTree, lattice: Lattice, counts: IntArray, only_empty: bool, budget: Budget) -> Int8Array:
    """Return the sides of the cells of level 0: of all of an empty one, of the reference point of another one.

    counts: lengths of the cells' lists. only_empty: the other ones are left UNKNOWN.
    """
    labels = np.empty(len(counts), np.int64)
    label_empty(counts, lattice.n[0], lattice.n[1], labels)
    is_asked = labels == np.arange(len(labels))
    if only_empty:
        is_asked &= counts == 0
    asked = np.flatnonzero(is_asked)
    found = np.zeros(len(counts), np.int8)
    found[asked] = ask_cells(tree, lattice, top_places(lattice, asked), 0, budget)
    return found[labels]


def ask_cells(tree: TriangleTree, lattice: Lattice, places: Int32Array, depth: int, budget: Budget) -> Int8Array:
    """Return the sides of the reference points of cells of a level, by vertical rays.

    UNKNOWN where such a point is not in its cell, on the boundary, or not decided by the compiled ray.
    """
    points, is_valid = np.empty((len(places), 3)), np.empty(len(places), np.bool_)
    reference_points(lattice, places, depth, points, is_valid)
    found, blurs = np.empty(len(points), np.int8), np.zeros(len(points))
    for start in range(0, len(points), _AT_ONCE):
        some = slice(start, start + _AT_ONCE)
        with np.errstate(all="ignore"):
            locate_by_tree(read_only(points[some]), blurs[some], tree, found[some], budget.flag)
        budget.check()
    found[(np.abs(found) != 1) | ~is_valid] = UNKNOWN
    return found
