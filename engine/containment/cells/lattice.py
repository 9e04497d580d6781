"""The uniform grid over a polyhedron, and a conservative list of the triangles that reach into each cell.

Sizes are powers of two. An index is ``int((x - low) * scale)``, each step monotone, so the doubles of a cell are those
between two borders; a triangle is listed in every cell of its index box, unless a separating axis proves that it stays
outside.

A triangle and a cell are apart if they are apart along the triangle's normal, or, seen along an axis, along the normal
of an edge. Each says that a linear function of the cell's centre w is not negative where they may meet,

    a . w + c + margin >= 0,        margin: half the extent of the cell along the axis, widened

so the rows of cells, one after another, are cut by each: a layer (z) by what is seen along x, a row (y, z) by the rest.
The cost is that of the cells that are listed, and of the rows, not of all cells of the triangle's box.

Units are cells, from corner a of the triangle. A border in exact arithmetic may lie off the lattice by the rounding of
x - low, at most 2^-53 times the number of cells along the axis, less than 2^-22: `_MARGIN` widens the cell by more. The
coefficients are products of rounded differences u, v of corners, and |w| is at most their size and two cells more, so
what a function is off by is below 12 units of rounding of size * (size + 4): `_ROUNDING` counts 32. (Rows are counted
from cell 0 of a block, at most 98 cells off: that adds 2^-45 of a slope, which `_MARGIN` covers.) The end of an
interval is a quotient with two roundings, and `_SLACK` is more than these for numbers up to 2^31; one beyond is out of
the lattice either way.
Source: separating axes of a triangle and a box after T. Akenine-Moeller, Fast 3D triangle-box overlap testing, 2001;
listing by rows is a scan conversion.
"""

from __future__ import annotations

from math import ceil, floor, frexp, ldexp
from typing import Any, Final, NamedTuple

import numpy as np

from engine.compiling.jit import inline, kernel
from engine.containment.prepared import TriangleTree, tree_of
from engine.predicates.vectors import corners_of
from engine.running.budget import Budget
from engine.running.parallel import share
from engine.solids.mesh import Polyhedron
from engine.types import FlagArray, FloatArray, Int32Array, IntArray

_MARGIN: Final = 0.5 + 2.0**-20
_ROUNDING: Final = 32.0 * 2.0**-53
_SLACK: Final = 2.0**-16
_FLAT: Final = 2.0**-300
"""Smallest slope that cuts an interval: below it the quotient could overflow."""


class Walls(NamedTuple):
    """Linear functions of the centre w of a cell, relative to corner a of a triangle, each >= 0 where the cell may meet
    the triangle: (slope, slope, constant), the slopes of two coordinates of w."""

    seen_along_z: Any
    """Three functions of (x, y): the edges projected along z."""
    seen_along_x: Any
    """Three functions of (y, z): the edges projected along x."""
    seen_along_y: Any
    """Three functions of (z, x): the edges projected along y."""
    normal: Any
    """Normal of the triangle: |normal . w| <= `reach` where the cell may meet its plane."""
    reach: float


@inline
def walls_of(u: tuple[float, ...], v: tuple[float, ...]) -> Any:
    """Return the `Walls` of the triangle with corners 0, u and v, in units of cells."""
    nx, ny, nz = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    su, sv = abs(u[0]) + abs(u[1]) + abs(u[2]), abs(v[0]) + abs(v[1]) + abs(v[2])
    reach = _MARGIN * (abs(nx) + abs(ny) + abs(nz)) + _ROUNDING * su * sv * (su + sv + 6.0)
    return Walls(
        _edges(u[0], u[1], v[0], v[1]), _edges(u[1], u[2], v[1], v[2]), _edges(u[2], u[0], v[2], v[0]), (nx, ny, nz),
        reach,
    )  # fmt: skip


@inline
def _edges(ux: float, uy: float, vx: float, vy: float) -> Any:
    """Return three linear functions (slope, slope, constant), one for each edge of the planar triangle with corners 0,
    u and v, positive inside; each (0, 0, 1) if its area may be 0."""
    area = ux * vy - uy * vx
    if not abs(area) > _ROUNDING * (abs(ux * vy) + abs(uy * vx)):
        return (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)
    turn = 1.0 if area > 0.0 else -1.0
    size = abs(ux) + abs(uy) + abs(vx) + abs(vy)
    error = _ROUNDING * size * (size + 4.0)
    return (
        _wall(-uy * turn, ux * turn, error),
        _wall(vy * turn, -vx * turn, error),
        _wall((uy - vy) * turn, (vx - ux) * turn, abs(area) + error),
    )


@inline
def _wall(a: float, b: float, c: float) -> tuple[float, float, float]:
    return a, b, c + _MARGIN * (abs(a) + abs(b))


@inline
def _narrowed(low: float, high: float, slope: float, value: float) -> tuple[float, float]:
    """Return the part of an interval of t where slope * t + value may be >= 0; low > high if there is none."""
    if abs(slope) > _FLAT:
        end = -value / slope
        if slope > 0.0:
            return (end - _SLACK if end - _SLACK > low else low), high
        return low, (end + _SLACK if end + _SLACK < high else high)
    if slope == 0.0 and value < 0.0:
        return low, low - 1.0
    return low, high


@inline
def rows_reached(walls: Walls, z: float, y: float, first: int, last: int) -> tuple[int, int]:
    """Return first and last row (y index) of a layer of cells that the triangle may reach into, within first .. last;
    first > last if there is none. z: of the layer's cell centres, y: of the cell centres of row 0, relative to corner
    a."""
    low, high = float(first), float(last)
    for wall in walls.seen_along_x:
        low, high = _narrowed(low, high, wall[0], wall[0] * y + wall[1] * z + wall[2])
    return ceil(low), floor(high)


@inline
def cells_reached(walls: Walls, z: float, y: float, x: float, first: int, last: int) -> tuple[int, int]:
    """Return first and last cell (x index) of a row that the triangle may reach into, within first .. last; first >
    last if there is none. z, y: of the row's cell centres, x: of the centre of cell 0, relative to corner a."""
    low, high = float(first), float(last)
    for wall in walls.seen_along_z:
        low, high = _narrowed(low, high, wall[0], wall[0] * x + wall[1] * y + wall[2])
    for wall in walls.seen_along_y:
        low, high = _narrowed(low, high, wall[1], wall[0] * z + wall[1] * x + wall[2])
    side = walls.normal[0] * x + walls.normal[1] * y + walls.normal[2] * z
    low, high = _narrowed(low, high, walls.normal[0], walls.reach + side)
    low, high = _narrowed(low, high, -walls.normal[0], walls.reach - side)
    return ceil(low), floor(high)


PLACE: Final = (0.5 + 287.0 / 4096.0, 0.5 - 413.0 / 4096.0, 0.5 + 101.0 / 4096.0)
"""Position of the reference point in its cell, from 0 to 1: on no plane of symmetry that faces of a lattice might
share."""
_WANTED: Final = 4.0
"""Cells along an axis for each triangle along an edge of a cube with as many triangles."""
_MOST_CELLS: Final = 160.0
"""Largest number of cells along an axis."""
_IN_A_RANGE: Final = 1 << 17
_MOST_RANGES: Final = 16
"""Triangles of a range that a thread looks at, at least, and number of ranges: each has a row of counts."""
_SECONDS: Final = 6e-8
"""Time for each triangle."""
_FEWEST_CELLS: Final = 12
_MOST_ENTRIES: Final = 12.0
_FEW_ENTRIES: Final = 1 << 16
"""Number of cells that list a triangle, in the mean and over all, from which the grid is made coarser."""
_SAMPLE: Final = 1024
_RANGE: Final = 2.0**400
"""Largest extent, and inverse of the smallest, of a solid with cells: products of three extents stay finite and normal.
"""


class Lattice(NamedTuple):
    """A uniform grid, in the order x, y, z: its low corner, 1 / size, the size of a cell (powers of two), and the
    numbers of cells."""

    low: tuple[float, float, float]
    scale: tuple[float, float, float]
    """1 / size."""
    size: tuple[float, float, float]
    n: tuple[int, int, int]


class Mesh(NamedTuple):
    """A polyhedron's vertices (n, 3) and triangles (m, 3), and its grid."""

    vertices: FloatArray
    triangles: Int32Array
    lattice: Lattice


@inline
def index_of(value: float, low: float, scale: float) -> int:
    """Return the index, along an axis, of the cell that contains `value` >= `low`. low: of the grid; scale: cells per
    unit."""
    return int((value - low) * scale)


@inline
def reference_point(lattice: Lattice, x: int, y: int, z: int) -> Any:
    """Return the coordinates of the reference point of cell (x, y, z): that at the fractions PLACE of its sides."""
    low, size = lattice.low, lattice.size
    return low[0] + (x + PLACE[0]) * size[0], low[1] + (y + PLACE[1]) * size[1], low[2] + (z + PLACE[2]) * size[2]


@inline
def scaled_difference(a: Any, b: Any, scale: tuple[float, ...]) -> Any:
    """Return (a - b) * scale, a difference of points in units of cells; each component is rounded once."""
    return (a[0] - b[0]) * scale[0], (a[1] - b[1]) * scale[1], (a[2] - b[2]) * scale[2]


@inline
def _span(a: float, b: float, c: float, low: float, scale: float, n: int) -> tuple[int, int]:
    """Return first and last cell index, along one axis, of the box of a triangle with corner coordinates a, b, c. low:
    of the grid; scale: cells per unit; n: number of cells."""
    return max(index_of(min(a, b, c), low, scale), 0), min(index_of(max(a, b, c), low, scale), n - 1)


@kernel
def _list_triangles(
    mesh: Mesh, first: int, last: int, ends: IntArray, items: Int32Array, is_fill: bool, flag: FlagArray
) -> None:
    """Count those of triangles first .. last - 1 that may reach into each cell, by ends[cell] += 1; if is_fill, also
    list them, by items[ends[cell]] = triangle before that. Stops if `flag` is set."""
    low, scale, (nx, ny, nz) = mesh.lattice.low, mesh.lattice.scale, mesh.lattice.n
    for triangle in range(first, last):
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
            y_from, y_to = (y_first, y_last) if is_small else rows_reached(walls, z0 + z, y0, y_first, y_last)
            for y in range(y_from, y_to + 1):
                x_from, x_to = x_first, x_last
                if not is_small:
                    x_from, x_to = cells_reached(walls, z0 + z, y0 + y, x0, x_first, x_last)
                for cell in range((z * ny + y) * nx + x_from, (z * ny + y) * nx + x_to + 1):
                    if is_fill:
                        items[ends[cell]] = triangle
                    ends[cell] += 1


def can_have_cells(solid: Polyhedron) -> bool:
    """Return whether extent and coordinates of a polyhedron are within `_RANGE`, in which cells can be built."""
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    with np.errstate(over="ignore"):
        extent = (high - low).max()
    return bool(1.0 / _RANGE < extent < _RANGE and np.abs(solid.vertices).max() < _RANGE)


def lattice_of(solid: Polyhedron, budget: Budget) -> Lattice:
    """Return the grid of a polyhedron, chosen at first use: halved in resolution until a sample shows that few cells
    list the same triangle."""

    def find() -> Lattice:
        tree, most = tree_of(solid, budget.check), _MOST_CELLS
        some = tree.triangles[:: len(tree.triangles) // _SAMPLE + 1].copy()
        while True:  # bound: halved each turn
            lattice = _make_lattice(tree, most)
            entries = count_triangles(Mesh(tree.vertices, some, lattice), budget.flag).sum() / len(some)
            if entries <= _MOST_ENTRIES + _FEW_ENTRIES / len(tree.triangles) or max(lattice.n) <= _FEWEST_CELLS:
                return lattice
            most = min(most, max(lattice.n)) / 2.0

    return solid.prepared("lattice", find, budget.check)


def count_triangles(mesh: Mesh, flag: FlagArray) -> IntArray:
    """Return (n_ranges, n_cells) int64: how many of each range of triangles may reach into each cell."""
    return _in_ranges(mesh, None, np.empty(0, np.int32), flag)


def list_triangles(mesh: Mesh, counts: IntArray, flag: FlagArray) -> tuple[Int32Array, IntArray, IntArray]:
    """Return the triangles that may reach into each cell, ascending, cell by cell; the sizes (n_cells,) of these lists,
    and their ends. counts: of `count_triangles`."""
    sizes = counts.sum(axis=0)
    ends = np.cumsum(sizes)
    starts = np.cumsum(counts, axis=0)
    starts += (ends - sizes) - counts
    lists = np.empty(int(ends[-1]), np.int32)
    _in_ranges(mesh, starts, lists, flag)
    return lists, sizes, ends


def _in_ranges(mesh: Mesh, starts: IntArray | None, lists: Int32Array, flag: FlagArray) -> IntArray:
    """Call `_list_triangles` for ranges of triangles, each with a row of starts, or of new counts; return these."""
    n = len(mesh.triangles)
    n_ranges, (nx, ny, nz) = max(1, min(_MOST_RANGES, n // _IN_A_RANGE)), mesh.lattice.n
    rows = np.zeros((n_ranges, nx * ny * nz), np.int64) if starts is None else starts

    def look(first: int, last: int) -> None:
        for part in range(first, last):
            start, stop = n * part // n_ranges, n * (part + 1) // n_ranges
            _list_triangles(mesh, start, stop, rows[part], lists, starts is not None, flag)

    share(look, n_ranges, _SECONDS * n / n_ranges)
    return rows


def _make_lattice(tree: TriangleTree, most: float) -> Lattice:
    """Return a grid over the triangles of a tree, with at most `most` cells along its longest axis, and one along an
    axis without extent."""
    extent = np.subtract(tree.high, tree.low)
    largest = float(extent.max())
    size = _power_of_two(largest / min(most, max(8.0, _WANTED * len(tree.triangles) ** (1.0 / 3.0))))
    x, y, z = [size if float(e) >= size else _power_of_two(max(float(e), largest * 2.0**-40)) for e in extent]
    low = tuple(low - size * (95.0 / 256.0) for low, size in zip(tree.low, (x, y, z)))
    n: Any = tuple(int((high - least) / size) + 1 for high, least, size in zip(tree.high, low, (x, y, z)))
    return Lattice((low[0], low[1], low[2]), (1.0 / x, 1.0 / y, 1.0 / z), (x, y, z), n)


def _power_of_two(value: float) -> float:
    """Return the smallest power of two >= value."""
    mantissa, exponent = frexp(value)
    return ldexp(1.0, exponent - 1 if mantissa == 0.5 else exponent)
