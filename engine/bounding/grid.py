"""Uniform grids: which cell a value is in.

It is ``int((x / 2 - low / 2) * cells_per_unit)``, cut off at the last cell. Each of these steps is monotone in floating
point, so what is listed from the cell of its lower side to the cell of its upper side is found from every value between
them, ties and roundings included. Halving keeps the difference finite for every input (for subnormal values it rounds,
monotonically too).
"""

from __future__ import annotations

from typing import Final, NamedTuple

from engine.compiling.jit import inline

_FASTEST: Final = 1e300
"""Most cells per unit: keeps the product finite where all values of an axis lie within some subnormals."""


class Axis(NamedTuple):
    """The cells along one axis."""

    low: float
    high: float
    cells_per_unit: float
    n_cells: int


@inline
def cell_of(value: float, low: float, cells_per_unit: float, n_cells: int) -> int:
    """Return the cell of a value that is not below `low`."""
    return int(min((value * 0.5 - low * 0.5) * cells_per_unit, n_cells - 1.0))


def make_axis(low: float, high: float, n_cells: int) -> Axis:
    """Return `n_cells` cells from low to high, one where there is no extent."""
    extent = high * 0.5 - low * 0.5
    return Axis(low, high, 0.0, 1) if extent <= 0.0 else Axis(low, high, min(n_cells / extent, _FASTEST), n_cells)
