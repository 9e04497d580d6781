"""Polygons that a union does not need, because others hide them.

Of n polygons that lie on each other, edges cross up to n^2 times, and few of these crossings are on the boundary of
their union. So neighbours are united by groups first, and of each group only the polygons that bound its union stay.
They may have a smaller union (a hole that a dropped polygon fills), so they are united again: both unions are the same
set if their rings pass the same sources, which are exact, in the same order. Otherwise the whole group stays.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.bounding.morton import morton_codes
from engine.polygon_overlay.compiled.ring_nesting import Nesting, Rule
from engine.polygon_overlay.implicit_rings import NO_RINGS, edges_along
from engine.polygon_overlay.pair_arrays import PairResults, PolygonArrays
from engine.polygon_overlay.run import SELECTED_ARRAYS, run_kernel
from engine.running.budget import Budget
from engine.solids.ragged import summed
from engine.types import OPEN, BoolArray, FloatArray, IntArray, read_only

_GROUP: Final = 24
_GROWS: Final = 4
"""Polygons of the first groups; how much larger groups become that leave out few."""
_DEEP: Final = 160.0
"""Number of boxes that meet a box from which groups pay."""
_BITS: Final = 16
"""Bits of each coordinate in the Morton code."""
_SAMPLE: Final = 16
_MOST_TESTED: Final = 4096
"""How many boxes are tested for that, against at most how many others."""
_PAYS: Final = 0.75
_FUTILE: Final = 0.9
"""Largest fraction of polygons that stay of groups of the right size (also the largest part of all in one group), and
of groups that may become larger."""


def without_hidden(polygons: PolygonArrays, budget: Budget) -> PolygonArrays:
    """Return the polygons, number by number, with some that their union does not need without rings; the union is the
    same set. Raises as `Budget.check`."""
    numbers = np.flatnonzero(polygons.sizes())
    if len(numbers) < _DEEP:
        return polygons
    low, high = polygons.boxes(numbers)
    if _depth(low, high) < _DEEP:
        return polygons
    numbers = numbers[np.argsort(morton_codes(low, high, _BITS), kind="stable")]
    size = _GROUP
    while size < _PAYS * len(numbers):  # bound: each turn leaves out a quarter, or makes groups larger
        is_needed = _bounds_its_group(polygons.take(numbers), size, budget)
        numbers = numbers[is_needed]
        if is_needed.mean() > _FUTILE:
            break
        size *= 1 if is_needed.mean() < _PAYS else _GROWS
    stays = np.zeros(len(polygons.polygon_offsets) - 1, np.bool_)
    stays[numbers] = True
    return polygons.restricted(stays)


def _depth(low: FloatArray, high: FloatArray) -> float:
    """Return an estimate of how many of the boxes a box meets, from some of them."""
    n = len(low)
    some, others = np.arange(0, n, -(-n // _SAMPLE)), np.arange(0, n, -(-n // _MOST_TESTED))
    meets = (low[some, None] <= high[others]) & (high[some, None] >= low[others])
    return float(meets.all(axis=2).mean()) * n


def _bounds_its_group(polygons: PolygonArrays, size: int, budget: Budget) -> BoolArray:
    """Return, by polygon, none of them without rings: False if it is left out. size: of a group of consecutive ones."""
    n = len(polygons.polygon_offsets) - 1
    groups = np.append(np.arange(0, n, size), n)
    whole, rows = _unions(polygons, groups, budget)
    of_vertices = np.repeat(np.arange(n), polygons.sizes())
    bounds = np.zeros(n, np.bool_)
    bounds[of_vertices[rows[:, 1]]] = True
    stays = np.flatnonzero(bounds)
    part, fewer_rows = _unions(polygons.take(stays), np.searchsorted(stays, groups), budget)
    are_same = _are_same(whole, rows, part, np.flatnonzero(bounds[of_vertices])[fewer_rows])
    return bounds | np.repeat(~are_same, np.diff(groups))


def _unions(polygons: PolygonArrays, groups: IntArray, budget: Budget) -> tuple[PairResults, IntArray]:
    """Return the union of each group k, polygons groups[k] .. groups[k + 1] - 1, and what each of its vertices is: rows
    (e, the edge along which the ring continues, f) for the crossing of edges e and f, with f = e for the first vertex
    of e; edges by the numbers of their first vertices."""
    n_rings = np.diff(polygons.polygon_offsets)
    number = np.arange(len(n_rings)) - np.repeat(groups[:-1], np.diff(groups))
    nesting = Nesting(np.repeat(number, n_rings), np.zeros(0), int(Rule.ANY))
    none = PolygonArrays(*NO_RINGS, read_only(np.zeros(len(groups), np.int64)))
    made = run_kernel(polygons.merged(groups), none, SELECTED_ARRAYS["union"], budget, nesting)
    first, second = made.sources[:, 0], made.sources[:, 1]
    rows = np.stack([first, edges_along(made.sources), np.where(second < 0, first, second)], axis=1).astype(np.int64)
    begins = polygons.ring_offsets[polygons.polygon_offsets[groups[:-1]]]
    return made, rows + np.repeat(begins, made.counts[:, 2])[:, None]


def _are_same(whole: PairResults, rows: IntArray, part: PairResults, part_rows: IntArray) -> BoolArray:
    """Return, by group, whether both unions are known and their rings have equal rows."""
    n_rings, n_rows = summed(whole.counts[:, 1]), summed(whole.counts[:, 2])
    n_part_rings, n_part_rows = summed(part.counts[:, 1]), summed(part.counts[:, 2])
    sizes, part_sizes = np.diff(whole.ring_offsets), np.diff(part.ring_offsets)
    are_same = (whole.status != OPEN) & (part.status != OPEN)
    for k in np.flatnonzero(are_same).tolist():
        rings, part_rings = slice(*n_rings[k : k + 2]), slice(*n_part_rings[k : k + 2])
        found, part_found = rows[slice(*n_rows[k : k + 2])], part_rows[slice(*n_part_rows[k : k + 2])]
        are_same[k] = np.array_equal(sizes[rings], part_sizes[part_rings]) and np.array_equal(found, part_found)
    return are_same
