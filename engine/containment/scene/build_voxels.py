"""Builds the voxels of a polyhedron, with the budget of the call that pays for it."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.arrays import FlagArray, FloatArray, Int8Array, read_only
from engine.containment.methods.polyhedron_ray_parity import locate_by_columns
from engine.containment.prepared import Columns, columns_of
from engine.containment.scene.voxels import OPEN, list_seeds, mark_met, spread_sides
from engine.parallel import Budget
from engine.solids.polyhedron import Polyhedron

MOST_FACES: Final = 1 << 14
"""Of a solid that gets voxels: for a larger one the cells of `locate` are better."""
_PAYS_FROM: Final = 1 << 10
_PAYS_PER_FACE: Final = 2
_WANTED: Final = 3.0
"""Voxels along an axis for each triangle along an edge of a cube."""
_SHIFTS: Final = (3, 6)
_RANGE: Final = 2.0**400
"""Largest coordinate and largest ratio of extents: products of three stay far from the ends of the exponents."""
_AT_ONCE: Final = 4096


class Voxels(NamedTuple):
    """What `side_in_voxels` reads."""

    frame: FloatArray
    """``(6,)``: the low corner of the box, and voxels to a unit."""
    shift: int
    """2^shift voxels along each axis."""
    packed: FlagArray
    address: int
    """Of `packed`."""


def voxels_if_they_pay(solid: Polyhedron, n_points: int, budget: Budget) -> Voxels | None:
    """Return the voxels of `solid` if they are there, or if the points asked in scenes so far pay for building them.

    Building takes about 0.5 us a face and 10 ns a voxel, some 0.5 ms for 1,000 faces; a ray takes 0.2 us. The answers
    are the same either way.
    """
    seen = solid.prepared("scene_points_seen", lambda: [0], budget.check)
    seen[0] += n_points
    n_faces = len(solid.triangles)
    if n_faces > MOST_FACES or seen[0] < _PAYS_FROM + _PAYS_PER_FACE * n_faces:
        return None
    return solid.prepared("voxels", lambda: build_voxels(solid, budget), budget.check)


def build_voxels(solid: Polyhedron, budget: Budget) -> Voxels | None:
    """Return the voxels of `solid`, None where its coordinates are out of range. Raises what `Budget.check` raises."""
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    with np.errstate(over="ignore"):
        extent = high - low
    if not (extent.min() > 1.0 / _RANGE and max(extent.max(), np.abs(low).max(), np.abs(high).max()) < _RANGE):
        return None
    columns = columns_of(solid, budget.check)
    wanted = _WANTED * len(solid.triangles) ** (1.0 / 3.0)
    shift = min(max(round(float(np.log2(wanted))), _SHIFTS[0]), _SHIFTS[1])
    # a trifle below 2^shift voxels, so that the largest coordinate lies in the last one
    frame = read_only(np.concatenate([low, (1 << shift) * (1.0 - 2.0**-45) / extent]))
    is_met = np.zeros(1 << (3 * shift), np.uint8)
    mark_met(columns.vertices, columns.triangles, frame, shift, is_met, budget.flag)
    budget.check()
    nothing = np.empty(0, np.int32)
    n_seeds = list_seeds(is_met, frame, shift, nothing, np.empty((0, 3)))
    seeds, points = np.empty(n_seeds, np.int32), np.empty((n_seeds, 3))
    list_seeds(is_met, frame, shift, seeds, points)
    sides = np.full(len(is_met), OPEN, np.int8)
    found = _by_rays(columns, points, budget)
    sides[seeds[seeds >= 0]] = found[seeds >= 0]
    packed = np.zeros(len(is_met) // 4, np.uint8)
    spread_sides(is_met, shift, sides, packed)
    budget.check()
    return Voxels(frame, shift, packed, packed.ctypes.data)


def _by_rays(columns: Columns, points: FloatArray, budget: Budget) -> Int8Array:
    """Return locations by vertical rays, OPEN where they are not decided."""
    found = np.empty(len(points), np.int8)
    for start in range(0, len(points), _AT_ONCE):
        stop = start + _AT_ONCE
        with np.errstate(all="ignore"):
            locate_by_columns(read_only(points[start:stop]), *columns, found[start:stop], budget.flag)
        budget.check()
    found[np.abs(found) != 1] = OPEN
    return found
