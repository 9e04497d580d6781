"""The grid of cells over a polyhedron, and which triangles reach into which cell.

Sizes are powers of two. An index is ``int((x - low) * scale)``, each step monotone, so the doubles of a cell are those
between two borders; a triangle is listed in every cell from the index of its least to that of its largest coordinate,
but where a separating axis proves that it stays outside (reach.py). The lists are conservative.
"""

from __future__ import annotations

from math import frexp, ldexp
from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import FlagArray, FloatArray, Int32Array, IntArray
from engine.compiling.jit import inline, kernel
from engine.containment.cells.reach import layer_reached, row_reached, walls_of
from engine.containment.prepared.triangle_tree import TriangleTree, tree_of
from engine.predicates.vectors import corners_of
from engine.running.budget import Budget
from engine.solids.polyhedron import Polyhedron

PLACE: Final = (0.5 + 287.0 / 4096.0, 0.5 - 413.0 / 4096.0, 0.5 + 101.0 / 4096.0)
"""Where the reference point lies in its cell: no symmetry that faces of a lattice might share."""
_WANTED: Final = 4.0
"""Cells along an axis for each triangle along an edge of a cube."""
_MOST_CELLS: Final = 160.0
"""Along an axis."""
_FEWEST_CELLS: Final = 12
_MOST_ENTRIES: Final = 12.0
_FEW_ENTRIES: Final = 1 << 16
"""Cells that list a triangle, in the mean, and in all, from which the grid is made coarser, to so many along an axis at
least."""
_SAMPLE: Final = 1024
_RANGE: Final = 2.0**400
"""Largest extent, and 1 / smallest, of a solid that gets cells: products of three stay far from its ends."""


class Lattice(NamedTuple):
    """A grid of cells; sizes are powers of two."""

    low: tuple[float, float, float]
    scale: tuple[float, float, float]
    """1 / size."""
    size: tuple[float, float, float]
    n: tuple[int, int, int]


class Mesh(NamedTuple):
    """A polyhedron and its lattice."""

    vertices: FloatArray
    triangles: Int32Array
    lattice: Lattice


@inline
def index_of(value: float, low: float, scale: float) -> int:
    """Return the index of a value that is not below `low`."""
    return int((value - low) * scale)


@inline
def reference_point(lattice: Lattice, x: int, y: int, z: int) -> Any:
    """Return the reference point of a cell."""
    low, size = lattice.low, lattice.size
    return low[0] + (x + PLACE[0]) * size[0], low[1] + (y + PLACE[1]) * size[1], low[2] + (z + PLACE[2]) * size[2]


@inline
def scaled_difference(a: Any, b: Any, scale: tuple[float, ...]) -> Any:
    """Return a - b in units of cells: one rounding each."""
    return (a[0] - b[0]) * scale[0], (a[1] - b[1]) * scale[1], (a[2] - b[2]) * scale[2]


@inline
def _span(a: float, b: float, c: float, low: float, scale: float, n: int) -> tuple[int, int]:
    """Return the first and the last index that the coordinates of a triangle's corners reach."""
    return max(index_of(min(a, b, c), low, scale), 0), min(index_of(max(a, b, c), low, scale), n - 1)


@kernel
def list_triangles(mesh: Mesh, ends: IntArray, items: Int32Array, is_fill: bool, flag: FlagArray) -> None:
    """Count (ends[cell] += 1) or list (items[ends[cell]] = triangle) what reaches into each cell."""
    low, scale, (nx, ny, nz) = mesh.lattice.low, mesh.lattice.scale, mesh.lattice.n
    for triangle in range(len(mesh.triangles)):
        if flag[0]:
            break
        a, b, c = corners_of(mesh.vertices, mesh.triangles, triangle)
        x_first, x_last = _span(a.x, b.x, c.x, low[0], scale[0], nx)
        y_first, y_last = _span(a.y, b.y, c.y, low[1], scale[1], ny)
        z_first, z_last = _span(a.z, b.z, c.z, low[2], scale[2], nz)
        is_small = (x_last - x_first) + (y_last - y_first) + (z_last - z_first) <= 1  # nothing helps in two cells
        walls = walls_of(scaled_difference(b, a, scale), scaled_difference(c, a, scale))
        base = scaled_difference(low, a, scale)
        x0, y0, z0 = base[0] + 0.5, base[1] + 0.5, base[2] + 0.5
        for z in range(z_first, z_last + 1):
            y_from, y_to = (y_first, y_last) if is_small else layer_reached(walls, z0 + z, y0, y_first, y_last)
            for y in range(y_from, y_to + 1):
                x_from, x_to = x_first, x_last
                if not is_small:
                    x_from, x_to = row_reached(walls, z0 + z, y0 + y, x0, x_first, x_last)
                for cell in range((z * ny + y) * nx + x_from, (z * ny + y) * nx + x_to + 1):
                    if is_fill:
                        items[ends[cell]] = triangle
                    ends[cell] += 1


def can_have_cells(solid: Polyhedron) -> bool:
    """Tell whether the coordinates are in the range of the cells; all but scenes near the ends of the exponents are."""
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    with np.errstate(over="ignore"):
        extent = (high - low).max()
    return bool(1.0 / _RANGE < extent < _RANGE and np.abs(solid.vertices).max() < _RANGE)


def lattice_of(solid: Polyhedron, budget: Budget) -> Lattice:
    """Return the grid, prepared once: so coarse that needles and large faces are not listed in more than some cells."""

    def find() -> Lattice:
        tree, most = tree_of(solid, budget.check), _MOST_CELLS
        some = tree.triangles[:: len(tree.triangles) // _SAMPLE + 1].copy()
        while True:  # bound: halved each turn
            lattice = _make_lattice(tree, most)
            entries = count_triangles(Mesh(tree.vertices, some, lattice), budget).sum() / len(some)
            if entries <= _MOST_ENTRIES + _FEW_ENTRIES / len(tree.triangles) or max(lattice.n) <= _FEWEST_CELLS:
                return lattice
            most = min(most, max(lattice.n)) / 2.0

    return solid.prepared("lattice", find, budget.check)


def count_triangles(mesh: Mesh, budget: Budget) -> IntArray:
    """Return of each cell how many triangles reach into it."""
    nx, ny, nz = mesh.lattice.n
    counts = np.zeros(nx * ny * nz, np.int64)
    list_triangles(mesh, counts, np.empty(0, np.int32), False, budget.flag)
    budget.check()
    return counts


def _make_lattice(tree: TriangleTree, most: float) -> Lattice:
    """Return a grid of at most so many cells along the longest axis; flat axes are in one cell."""
    extent = np.subtract(tree.high, tree.low)
    largest = float(extent.max())
    size = _power_of_two(largest / min(most, max(8.0, _WANTED * len(tree.triangles) ** (1.0 / 3.0))))
    x, y, z = [size if float(e) >= size else _power_of_two(max(float(e), largest * 2.0**-40)) for e in extent]
    low = tuple(low - size * (95.0 / 256.0) for low, size in zip(tree.low, (x, y, z)))
    n: Any = tuple(int((high - least) / size) + 1 for high, least, size in zip(tree.high, low, (x, y, z)))
    return Lattice((low[0], low[1], low[2]), (1.0 / x, 1.0 / y, 1.0 / z), (x, y, z), n)


def _power_of_two(value: float) -> float:
    """Return the power of two next above or equal to value."""
    mantissa, exponent = frexp(value)
    return ldexp(1.0, exponent - 1 if mantissa == 0.5 else exponent)
