"""Voxels of a polyhedron: a coarse grid that says of most of its box whether it is inside or outside, two bits a voxel.

A voxel that no triangle reaches into has one location. There are 2^k of them along each axis of the box; an index is
``int((x - low) * scale)``, each step monotone, so the doubles of a voxel are those between two borders, and no vertex
lies between the last double of one voxel and the first of the next. A triangle is listed from the index of its least
to that of its largest coordinate, but where a separating axis proves that it stays outside (`misses_cell`). Therefore
two neighbours without triangles have the same location, too: no triangle passes between them either.

`misses_cell` is made for scales that are powers of two. Here a scaled difference carries two roundings, not one: six
units of rounding in a product of two, eight with a third, eleven in a sum of three of them, where its bounds have room
for sixteen. A border is off the lattice by less than 2^-40, where its margin has room for 2^-20.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.containment.cells.lattice import corner, misses_cell, scaled_difference
from engine.jit import inline, kernel
from engine.lanes.addresses import array_at
from engine.types import UNDECIDED

OPEN: Final = 0
"""The side of a voxel that is not known; -1 and 1 are the others."""
LOW, SCALE = 0, 3
"""Columns of a frame (6,): the low corner of the box, and voxels to a unit."""


@inline
def voxel_of(value: float, low: float, scale: float) -> int:
    """Return the index of a value that is not below `low`."""
    return int((value - low) * scale)


@kernel
def mark_met(vertices: Any, triangles: Any, frame: Any, shift: int, is_met: Any, flag: Any) -> None:
    """Set is_met (8^shift,) uint8 for the voxels that a triangle may reach into."""
    low, scale = (frame[0], frame[1], frame[2]), (frame[3], frame[4], frame[5])
    for triangle in range(len(triangles)):
        if flag[0]:
            break
        a = corner(vertices, triangles[triangle, 0])
        b = corner(vertices, triangles[triangle, 1])
        c = corner(vertices, triangles[triangle, 2])
        u, v = scaled_difference(b, a, scale, 1.0), scaled_difference(c, a, scale, 1.0)
        base = scaled_difference(low, a, scale, 1.0)
        x_first = voxel_of(min(a[0], b[0], c[0]), low[0], scale[0])
        x_last = voxel_of(max(a[0], b[0], c[0]), low[0], scale[0])
        y_first = voxel_of(min(a[1], b[1], c[1]), low[1], scale[1])
        y_last = voxel_of(max(a[1], b[1], c[1]), low[1], scale[1])
        z_first = voxel_of(min(a[2], b[2], c[2]), low[2], scale[2])
        z_last = voxel_of(max(a[2], b[2], c[2]), low[2], scale[2])
        for z in range(z_first, z_last + 1):
            for y in range(y_first, y_last + 1):
                for x in range(x_first, x_last + 1):
                    voxel = (((z << shift) | y) << shift) | x
                    if is_met[voxel] == 0:
                        w = (base[0] + (x + 0.5), base[1] + (y + 0.5), base[2] + (z + 0.5))
                        is_met[voxel] = not misses_cell(u, v, w)


@inline
def _neighbour_below(is_met: Any, voxel: int, shift: int) -> int:
    """Return a voxel before this one that shares a side with it and has no triangles, -1 if there is none."""
    side = 1 << shift
    if voxel & (side - 1) != 0 and is_met[voxel - 1] == 0:
        return voxel - 1
    if (voxel >> shift) & (side - 1) != 0 and is_met[voxel - side] == 0:
        return voxel - side
    if (voxel >> (2 * shift)) != 0 and is_met[voxel - side * side] == 0:
        return voxel - side * side
    return -1


@kernel
def list_seeds(is_met: Any, frame: Any, shift: int, seeds: Any, points: Any) -> int:
    """List the free voxels without a free neighbour before them; returns how many there are.

    seeds: (n,) int32; points: (n, 3), a double of each; n may be 0, to count only. A seed is -1 where its point lies in
    another voxel, by rounding.
    """
    n_seeds, mask = 0, (1 << shift) - 1
    for voxel in range(len(is_met)):
        if is_met[voxel] != 0 or _neighbour_below(is_met, voxel, shift) >= 0:
            continue
        if len(seeds) > 0:
            seeds[n_seeds] = voxel
            for axis in range(3):
                index = (voxel >> (axis * shift)) & mask
                value = frame[LOW + axis] + (index + 0.5) / frame[SCALE + axis]
                points[n_seeds, axis] = value
                if not value >= frame[LOW + axis] or voxel_of(value, frame[LOW + axis], frame[SCALE + axis]) != index:
                    seeds[n_seeds] = -1
        n_seeds += 1
    return n_seeds


@kernel
def spread_sides(is_met: Any, shift: int, sides: Any, packed: Any) -> None:
    """Pass the sides of the seeds, in sides (n,) int8 and OPEN elsewhere, on to their neighbours; pack them all.

    packed: (ceil(n / 4),) uint8, zero: side + 1 of four voxels to a byte.
    """
    for voxel in range(len(is_met)):
        if is_met[voxel] == 0:
            before = _neighbour_below(is_met, voxel, shift)
            if before >= 0:
                sides[voxel] = sides[before]
        packed[voxel >> 2] |= np.uint8((sides[voxel] + 1) << (2 * (voxel & 3)))


@inline
def side_in_voxels(frames: Any, row: int, address: int, shift: int, x: float, y: float, z: float, blur: float) -> int:
    """Return the location of a blurred point if its voxel tells it, else UNDECIDED.

    frames: (n, 6), of which `row` counts; address: of the packed sides.
    """
    x_low, y_low, z_low = frames[row, 0], frames[row, 1], frames[row, 2]
    x_scale, y_scale, z_scale = frames[row, 3], frames[row, 4], frames[row, 5]
    side = float(1 << shift)
    is_within = (x - blur >= x_low) & (y - blur >= y_low) & (z - blur >= z_low)
    is_within &= ((x + blur) - x_low) * x_scale < side
    is_within &= ((y + blur) - y_low) * y_scale < side
    is_within &= ((z + blur) - z_low) * z_scale < side
    if not is_within:
        return UNDECIDED
    if blur > 0.0:
        is_one = voxel_of(x - blur, x_low, x_scale) == voxel_of(x + blur, x_low, x_scale)
        is_one &= voxel_of(y - blur, y_low, y_scale) == voxel_of(y + blur, y_low, y_scale)
        is_one &= voxel_of(z - blur, z_low, z_scale) == voxel_of(z + blur, z_low, z_scale)
        if not is_one:
            return UNDECIDED
    voxel = (voxel_of(z, z_low, z_scale) << shift) | voxel_of(y, y_low, y_scale)
    voxel = (voxel << shift) | voxel_of(x, x_low, x_scale)
    packed = array_at(address, (1 << (3 * shift - 2),), np.uint8)
    code = (packed[voxel >> 2] >> (2 * (voxel & 3))) & 3
    return UNDECIDED if code == OPEN + 1 else code - 1
