"""One point, which may carry a blur, in level 0 of the cells of one of many polyhedra: for scenes.

Where the tables come from is top.py. A blurred point (posed/filters.py) must lie in one cell with all of its blur: an
index is ``int((x - low) * scale)``, each step monotone.
"""

from __future__ import annotations

from typing import Any

from engine.jit import inline
from engine.lanes.addresses import int8_at
from engine.types import UNDECIDED


@inline
def _index(value: float, low: float, scale: float) -> int:
    """Return the index of a value that is not below `low`."""
    return int((value - low) * scale)


@inline
def side_in_cell(frames: Any, places: Any, row: int, p: Any, blur: float) -> int:
    """Return the location of a blurred point (x, y, z) if its cell tells it, else UNDECIDED.

    frames: (n, 6), places: (n, 4), what `TopCells` has of each polyhedron, of which `row` counts.
    """
    x, y, z = p
    x_low, y_low, z_low = frames[row, 0], frames[row, 1], frames[row, 2]
    x_scale, y_scale, z_scale = frames[row, 3], frames[row, 4], frames[row, 5]
    address, nx, ny, nz = places[row, 0], places[row, 1], places[row, 2], places[row, 3]
    is_within = (x - blur >= x_low) & (y - blur >= y_low) & (z - blur >= z_low)
    is_within &= ((x + blur) - x_low) * x_scale < nx
    is_within &= ((y + blur) - y_low) * y_scale < ny
    is_within &= ((z + blur) - z_low) * z_scale < nz
    if not is_within:
        return UNDECIDED
    column, line, layer = _index(x, x_low, x_scale), _index(y, y_low, y_scale), _index(z, z_low, z_scale)
    if blur > 0.0:
        is_one = _index(x - blur, x_low, x_scale) == _index(x + blur, x_low, x_scale)
        is_one &= _index(y - blur, y_low, y_scale) == _index(y + blur, y_low, y_scale)
        is_one &= _index(z - blur, z_low, z_scale) == _index(z + blur, z_low, z_scale)
        if not is_one:
            return UNDECIDED
    return int(int8_at(address, (layer * ny + line) * nx + column))
