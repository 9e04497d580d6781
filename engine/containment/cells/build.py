"""Builds the cells of a polyhedron, level by level, with the budget of the call that pays for it.

Cost: linear in the faces and the entries, 2 to 3 us a face on one thread; some 300 to 900 bytes a face.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import frexp, ldexp
from typing import Final, NamedTuple

import numpy as np

from engine.arrays import Float32Array, FloatArray, Int8Array, Int32Array, IntArray, read_only
from engine.containment.cells.lattice import LEVELS, PARTS, SPLIT, Lattice, list_parts, list_top
from engine.containment.cells.locate import CODE_SHIFT, INSIDE_CELL, OPEN_CELL, OUTSIDE_CELL
from engine.containment.cells.status import (
    OPEN,
    fill_leaves,
    label_empty,
    locate_parts,
    reference_points,
)
from engine.containment.methods.polyhedron_ray_parity import locate_by_columns
from engine.containment.prepared import Columns, columns_of
from engine.lanes.cells import LANES, groups_of
from engine.parallel import Budget
from engine.solids.polyhedron import Polyhedron

_LONG: Final = (8, 32)
"""Lists longer than this are cut into parts, on levels 0 and 1: more than one group, or four: finer
parts take more memory than they save time."""
_MOST_ENTRIES: Final = 24
"""Entries a face (and 2^14 more) above which a level is not cut further."""
_RANGE: Final = 2.0**400
"""Largest extent, and 1 / smallest, of a solid that gets cells: products of three stay far from its ends."""
_AT_ONCE: Final = 4096
_WANTED: Final = 4.0
_MOST_CELLS: Final = 96.0
"""Along the longest axis on level 0: more than fit the cache cost uniform points more than they save."""
_PAYS_FROM: Final = 1 << 14
_PAYS_PER_FACE: Final = 5


class Cells(NamedTuple):
    """What `locate_by_cells` reads."""

    lattice: Lattice
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    """The solid's box: beyond it all is outside."""
    statuses: Int8Array
    """(n + 1,) of level 0: the location of all points of a cell, UNDECIDED where its code says more, and last that of
    points beyond the lattice; small enough to stay in the cache."""
    codes: Int32Array
    """Level 0, then 64 a brick."""
    groups: Float32Array
    """(n, 14, 8): what leaves keep of their triangles (lanes/cells.py)."""


@dataclass
class _Level:
    """The cells of one level that have lists."""

    index: IntArray
    """(m,) place among all cells of the level."""
    places: Int32Array
    """(m, 3) indices on the level."""
    firsts: IntArray
    lists: Int32Array
    statuses: Int8Array
    """(m,) side of the reference point, OPEN if it is not known."""
    all_statuses: Int8Array
    """The same for all cells, those without lists included."""


def can_have_cells(solid: Polyhedron) -> bool:
    """Tell whether the coordinates are in the range of the cells; all but scenes near the ends of the exponents are."""
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    with np.errstate(over="ignore"):
        extent = (high - low).max()
    return bool(1.0 / _RANGE < extent < _RANGE and np.abs(solid.vertices).max() < _RANGE)


def cells_if_they_pay(solid: Polyhedron, n_points: int, budget: Budget) -> Cells | None:
    """Return the cells of `solid` if they are there, or if the points asked so far would have paid for building them.

    The answers are the same either way. Building takes about 10 us a face, a vertical ray 0.2 us (1,000 faces) to 3 us
    (100,000); a solid that is asked about few points never gets cells.
    """
    seen = solid.prepared("points_seen", lambda: [0], budget.check)
    seen[0] += n_points
    if seen[0] < _PAYS_FROM + _PAYS_PER_FACE * len(solid.triangles):
        return None
    if not solid.prepared("can_have_cells", lambda: can_have_cells(solid)):
        return None
    return solid.prepared("cells", lambda: build_cells(solid, budget), budget.check)


def build_cells(solid: Polyhedron, budget: Budget) -> Cells:
    """Return the cells of `solid`. Raises what `Budget.check` raises."""
    columns = columns_of(solid, budget.check)
    triangles = columns.triangles
    lattice = _make_lattice(columns)
    level = _top_level(columns, lattice, budget)
    n_top = lattice.n[0] * lattice.n[1] * lattice.n[2]
    codes, leaves = [], []
    n_groups = n_bricks = 0
    for depth in range(LEVELS):
        lengths = np.diff(level.firsts)
        is_cut = np.zeros(len(lengths), np.bool_)
        if depth < LEVELS - 1:
            is_cut = lengths > _LONG[depth]
            if len(level.lists) > _MOST_ENTRIES * len(triangles) + (1 << 14):
                is_cut[:] = False
        parents = np.flatnonzero(is_cut)
        kept = np.flatnonzero(~is_cut & (level.statuses != OPEN))
        code = np.full(len(level.all_statuses), OPEN_CELL, np.int32)
        code[level.all_statuses == -1] = OUTSIDE_CELL
        code[level.all_statuses == 1] = INSIDE_CELL
        code[level.index] = OPEN_CELL
        sizes = (lengths[kept] + LANES - 1) // LANES
        starts = n_groups + np.cumsum(sizes) - sizes
        code[level.index[kept]] = 4 * starts + 2 * (level.statuses[kept] > 0)
        code[level.index[parents]] = 2 * (n_bricks + np.arange(len(parents))) + 1
        n_groups, n_bricks = n_groups + int(sizes.sum()), n_bricks + len(parents)
        codes.append(code)
        leaves.append((kept, level.places, level.firsts, level.lists, depth, starts))
        if not len(parents):
            break
        level = _next_level(columns, lattice, level, parents, depth + 1, budget)
    groups = groups_of(n_groups)
    for of_level in leaves:
        fill_leaves(columns.vertices, triangles, lattice, *of_level, groups, budget.flag)
        budget.check()
    low, high = columns.boxes[:, 0::2].min(axis=0), columns.boxes[:, 1::2].max(axis=0)
    assert len(codes[0]) == n_top
    return Cells(
        lattice,
        (float(low[0]), float(low[1]), float(low[2])),
        (float(high[0]), float(high[1]), float(high[2])),
        np.append(np.minimum(codes[0], OPEN_CELL) + CODE_SHIFT, -1).astype(np.int8),
        np.concatenate(codes),
        groups,
    )


def _make_lattice(columns: Columns) -> Lattice:
    """Return level 0: some cells to each triangle of a cube, by powers of two, flat axes in one cell."""
    low, high = columns.boxes[:, 0::2].min(axis=0), columns.boxes[:, 1::2].max(axis=0)
    extent = high - low
    largest = float(extent.max())
    wanted = min(_MOST_CELLS, max(8.0, _WANTED * len(columns.triangles) ** (1.0 / 3.0)))
    size = _power_of_two(largest / wanted)
    sizes = [size if float(e) >= size else _power_of_two(max(float(e), largest * 2.0**-40)) for e in extent]
    lows = tuple(float(low[k]) - sizes[k] * (95.0 / 256.0) for k in range(3))
    n = tuple(int((float(high[k]) - lows[k]) / sizes[k]) + 1 for k in range(3))
    return Lattice(
        (lows[0], lows[1], lows[2]),
        (1.0 / sizes[0], 1.0 / sizes[1], 1.0 / sizes[2]),
        (sizes[0], sizes[1], sizes[2]),
        (n[0], n[1], n[2]),
    )


def _power_of_two(value: float) -> float:
    """Return the power of two next above or equal to value."""
    mantissa, exponent = frexp(value)
    return ldexp(1.0, exponent - 1 if mantissa == 0.5 else exponent)


def _by_rays(columns: Columns, points: FloatArray, budget: Budget) -> Int8Array:
    """Return locations by vertical rays; what they leave undecided is OPEN, and so is the boundary."""
    found = np.empty(len(points), np.int8)
    for start in range(0, len(points), _AT_ONCE):
        stop = start + _AT_ONCE
        locate_by_columns(read_only(points[start:stop]), *columns, found[start:stop], budget.flag)
        budget.check()
    found[np.abs(found) != 1] = OPEN
    return found


def _ask(columns: Columns, lattice: Lattice, places: Int32Array, level: int, budget: Budget) -> Int8Array:
    """Return the sides of the reference points of cells, OPEN where they are not in their cell."""
    points, is_valid = np.empty((len(places), 3)), np.empty(len(places), np.bool_)
    reference_points(lattice, places, level, points, is_valid)
    found = _by_rays(columns, points, budget)
    found[~is_valid] = OPEN
    return found


def _compact(counts: IntArray, ends: IntArray) -> tuple[IntArray, IntArray]:
    """Return the cells that have lists, and where each begins, with the end of the last."""
    index = np.flatnonzero(counts)
    return index, np.append(ends[index] - counts[index], ends[-1] if len(ends) else 0)


def _top_level(columns: Columns, lattice: Lattice, budget: Budget) -> _Level:
    nx, ny, nz = lattice.n
    counts = np.zeros(nx * ny * nz, np.int64)
    list_top(columns.vertices, columns.triangles, lattice, counts, np.empty(0, np.int32), False, budget.flag)
    budget.check()
    ends = np.cumsum(counts)
    lists = np.empty(int(ends[-1]), np.int32)
    list_top(columns.vertices, columns.triangles, lattice, ends - counts, lists, True, budget.flag)
    budget.check()
    index, firsts = _compact(counts, ends)
    labels = np.empty(len(counts), np.int64)
    label_empty(counts, nx, ny, nz, labels)
    asked = np.flatnonzero(labels == np.arange(len(labels)))
    places = np.stack([asked % nx, asked // nx % ny, asked // (nx * ny)], axis=1).astype(np.int32)
    found = np.zeros(len(counts), np.int8)
    found[asked] = _ask(columns, lattice, places, 0, budget)
    found = found[labels]
    own = np.searchsorted(asked, index)
    return _Level(index, places[own], firsts, lists, found[index], found)


def _next_level(
    columns: Columns, lattice: Lattice, above: _Level, parents: IntArray, depth: int, budget: Budget
) -> _Level:
    mesh = (columns.vertices, columns.triangles, lattice)
    of_parents = (parents, above.places, above.firsts, above.lists, depth)
    counts = np.zeros(len(parents) * PARTS, np.int64)
    list_parts(*mesh, *of_parents, counts, np.empty(0, np.int32), False, budget.flag)
    budget.check()
    ends = np.cumsum(counts)
    lists = np.empty(int(ends[-1]), np.int32)
    list_parts(*mesh, *of_parents, ends - counts, lists, True, budget.flag)
    budget.check()
    found = np.empty(len(counts), np.int8)
    work = groups_of(int(np.diff(above.firsts)[parents].max() + LANES - 1) // LANES)
    locate_parts(
        *mesh,
        parents,
        above.places,
        above.statuses,
        above.firsts,
        above.lists,
        depth,
        counts,
        work,
        found,
        budget.flag,
    )
    budget.check()
    unknown = np.flatnonzero(found == OPEN)
    found[unknown] = _ask(columns, lattice, _part_places(above.places[parents], unknown), depth, budget)
    index, firsts = _compact(counts, ends)
    places = _part_places(above.places[parents], index)
    return _Level(index, places, firsts, lists, found[index], found)


def _part_places(places: Int32Array, parts: IntArray) -> Int32Array:
    """Return the indices of parts on their level, given those of their parents on the level above."""
    part = parts % PARTS
    offset = np.stack([part % SPLIT, part // SPLIT % SPLIT, part // (SPLIT * SPLIT)], axis=1)
    return np.ascontiguousarray(places[parts // PARTS] * SPLIT + offset, np.int32)
