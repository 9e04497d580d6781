"""The grid of cells over a polyhedron: where cells lie, and which triangles reach into them.

Level 0 is a dense grid; a cell with a long list is cut into a brick of 4 x 4 x 4, and so on. Sizes are powers of two,
so an index on the finest level, shifted right, is the index on a coarser one. An index is ``int((x - low) * scale)``,
each step monotone, so the doubles of a cell are those between two borders; a triangle is listed in every cell from the
index of its least to that of its largest coordinate, but where a separating axis proves that it stays outside
(reach.py). The lists are conservative.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from engine.arrays import FlagArray, FloatArray, Int8Array, Int32Array, IntArray
from engine.containment.cells.reach import layer_reached, row_reached, walls_of
from engine.jit import inline, kernel
from engine.predicates.vectors import corners_of
from engine.types import Point3

LEVELS: Final = 12
"""At most: 96 cells cut eleven times have indices below 2^30."""
SPLIT: Final = 4
"""Parts of a cell along each axis."""
PARTS: Final = SPLIT**3
_FINEST: Final = 2.0 ** (2 * (LEVELS - 1))
UNKNOWN: Final = 0
"""Status of a cell that is not known, or whose reference point lies on the surface or in another cell."""
PLACE: Final = (0.5 + 287.0 / 4096.0, 0.5 - 413.0 / 4096.0, 0.5 + 101.0 / 4096.0)
"""Where the reference point lies in its cell: no symmetry that faces of a lattice might share."""


class Lattice(NamedTuple):
    """The cells of level 0; sizes are powers of two."""

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


class Level(NamedTuple):
    """The cells of one level that have lists."""

    depth: int
    places: Int32Array
    """``(m, 3)`` indices on the level."""
    statuses: Int8Array
    """``(m,)`` side of the reference point: -1, 1, or UNKNOWN."""
    firsts: IntArray
    """``(m + 1,)``: where each cell's triangles begin in `lists`."""
    lists: Int32Array


class Block(NamedTuple):
    """Cells of a level side by side: from which index on, how many along the axes, the number of the first."""

    depth: int
    x: int
    y: int
    z: int
    nx: int
    ny: int
    nz: int
    first: int


@inline
def finest(value: float, low: float, scale: float) -> int:
    """Return the index on the finest level of a value that is not below `low`."""
    return int((value - low) * (scale * _FINEST))


@inline
def parts_of(level: int) -> float:
    """Return how many cells of a level there are to one of level 0 along an axis."""
    return 1.0 if level == 0 else 4.0 if level == 1 else 16.0 if level == 2 else float(1 << 2 * level)


@inline
def share_of(level: int) -> float:
    """Return 1 / parts_of(level)."""
    return 1.0 if level == 0 else 0.25 if level == 1 else 0.0625 if level == 2 else 1.0 / parts_of(level)


@inline
def reference_point(lattice: Lattice, x: int, y: int, z: int, level: int) -> Any:
    """Return the reference point of a cell by its indices on a level."""
    low, size, share = lattice.low, lattice.size, share_of(level)
    return (
        low[0] + (x + PLACE[0]) * (size[0] * share),
        low[1] + (y + PLACE[1]) * (size[1] * share),
        low[2] + (z + PLACE[2]) * (size[2] * share),
    )


@inline
def scaled_difference(a: Any, b: Point3, scale: tuple[float, ...], parts: float) -> Any:
    """Return a - b in units of the cells of a level: one rounding each."""
    return ((a[0] - b[0]) * (scale[0] * parts), (a[1] - b[1]) * (scale[1] * parts), (a[2] - b[2]) * (scale[2] * parts))


@inline
def _list_triangle(mesh: Mesh, triangle: int, block: Block, ends: IntArray, items: Int32Array, is_fill: bool) -> None:
    """Count or list a triangle in the cells of a block that it reaches into, in scanning order."""
    low, scale, (depth, x_low, y_low, z_low, nx, ny, nz, first_cell) = mesh.lattice.low, mesh.lattice.scale, block
    parts, shift = parts_of(depth), 2 * (LEVELS - 1 - depth)
    a, b, c = corners_of(mesh.vertices, mesh.triangles, triangle)
    x_first = max((finest(min(a[0], b[0], c[0]), low[0], scale[0]) >> shift) - x_low, 0)
    x_last = min((finest(max(a[0], b[0], c[0]), low[0], scale[0]) >> shift) - x_low, nx - 1)
    y_first = max((finest(min(a[1], b[1], c[1]), low[1], scale[1]) >> shift) - y_low, 0)
    y_last = min((finest(max(a[1], b[1], c[1]), low[1], scale[1]) >> shift) - y_low, ny - 1)
    z_first = max((finest(min(a[2], b[2], c[2]), low[2], scale[2]) >> shift) - z_low, 0)
    z_last = min((finest(max(a[2], b[2], c[2]), low[2], scale[2]) >> shift) - z_low, nz - 1)
    # nothing helps a triangle in one cell, on level 0 in two
    if (x_last - x_first) + (y_last - y_first) + (z_last - z_first) <= (depth == 0):
        for z in range(z_first, z_last + 1):
            for y in range(y_first, y_last + 1):
                for x in range(x_first, x_last + 1):
                    _list_in(triangle, first_cell + (z * ny + y) * nx + x, ends, items, is_fill)
        return
    walls = walls_of(scaled_difference(b, a, scale, parts), scaled_difference(c, a, scale, parts))
    base = scaled_difference(low, a, scale, parts)
    x0, y0, z0 = base[0] + (x_low + 0.5), base[1] + (y_low + 0.5), base[2] + (z_low + 0.5)
    for z in range(z_first, z_last + 1):
        y_from, y_to = layer_reached(walls, z0 + z, y0, y_first, y_last)
        for y in range(y_from, y_to + 1):
            x_from, x_to = row_reached(walls, z0 + z, y0 + y, x0, x_first, x_last)
            for x in range(x_from, x_to + 1):
                _list_in(triangle, first_cell + (z * ny + y) * nx + x, ends, items, is_fill)


@inline
def _list_in(triangle: int, cell: int, ends: IntArray, items: Int32Array, is_fill: bool) -> None:
    if is_fill:
        items[ends[cell]] = triangle
    ends[cell] += 1


@kernel
def list_top(mesh: Mesh, ends: IntArray, items: Int32Array, is_fill: bool, flag: FlagArray) -> None:
    """Count (ends[cell] += 1) or list (items[ends[cell]] = triangle) what reaches into each cell of level 0."""
    nx, ny, nz = mesh.lattice.n
    for triangle in range(len(mesh.triangles)):
        if flag[0]:
            break
        _list_triangle(mesh, triangle, Block(0, 0, 0, 0, nx, ny, nz, 0), ends, items, is_fill)


@kernel
def list_parts(
    mesh: Mesh, level: Level, parents: IntArray, ends: IntArray, items: Int32Array, is_fill: bool, flag: FlagArray
) -> None:
    """Count or list, as `list_top` does, the triangles that reach into the 64 parts of each parent cell.

    level: that of the parents; parents: (p,) some of its cells; ends: (p * 64,).
    """
    for parent in range(len(parents)):
        if flag[0]:
            break
        cell = parents[parent]
        x, y, z = level.places[cell, 0] * SPLIT, level.places[cell, 1] * SPLIT, level.places[cell, 2] * SPLIT
        block = Block(level.depth + 1, x, y, z, SPLIT, SPLIT, SPLIT, parent * PARTS)
        for entry in range(level.firsts[cell], level.firsts[cell + 1]):
            _list_triangle(mesh, level.lists[entry], block, ends, items, is_fill)


@kernel
def keep_of_details(mesh: Any, level: Any, cells: Any, is_kept: Any, flag: Any) -> None:
    """Set is_kept of each of `cells`: whether most triangles of its list are smaller than a cell along each axis."""
    scale, parts = mesh.lattice.scale, parts_of(level.depth)
    for cell in cells:
        if flag[0]:
            break
        first, end, n_small = level.firsts[cell], level.firsts[cell + 1], 0
        for entry in range(first, end):
            a, b, c = corners_of(mesh.vertices, mesh.triangles, level.lists[entry])
            largest = 0.0
            for axis in range(3):
                low, high = min(a[axis], b[axis], c[axis]), max(a[axis], b[axis], c[axis])
                largest = max(largest, (high - low) * (scale[axis] * parts))
            n_small += largest < 1.0
        is_kept[cell] = 2 * n_small > end - first
