"""Which cells a triangle may reach into: intervals of rows, from the planes of the separating axes.

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
the lattice either way. The result is conservative.

Source: the separating axes of a triangle and a box after Akenine-Moeller 2001; listing by rows is a scan conversion.
"""

from __future__ import annotations

from math import ceil, floor
from typing import Any, Final, NamedTuple

from engine.compiling.jit import inline

_MARGIN: Final = 0.5 + 2.0**-20
_ROUNDING: Final = 32.0 * 2.0**-53
_SLACK: Final = 2.0**-16
_FLAT: Final = 2.0**-300
"""A slope below this cuts nothing: the quotient could overflow."""


class Walls(NamedTuple):
    """Functions that are not negative where a cell may meet the triangle: two slopes and a constant each."""

    seen_along_z: Any
    """Three over (x, y)."""
    seen_along_x: Any
    """Three over (y, z)."""
    seen_along_y: Any
    """Three over (z, x)."""
    normal: Any
    """The plane: |normal . w| is at most `reach` where they may meet."""
    reach: float


@inline
def walls_of(u: tuple[float, ...], v: tuple[float, ...]) -> Any:
    """Return the walls of the triangle 0, u, v."""
    nx, ny, nz = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    su, sv = abs(u[0]) + abs(u[1]) + abs(u[2]), abs(v[0]) + abs(v[1]) + abs(v[2])
    reach = _MARGIN * (abs(nx) + abs(ny) + abs(nz)) + _ROUNDING * su * sv * (su + sv + 6.0)
    return Walls(
        _edges(u[0], u[1], v[0], v[1]), _edges(u[1], u[2], v[1], v[2]), _edges(u[2], u[0], v[2], v[0]), (nx, ny, nz),
        reach,
    )  # fmt: skip


@inline
def _edges(ux: float, uy: float, vx: float, vy: float) -> Any:
    """Return the functions of the three edges of a triangle (0, u, v) of the plane, of none if it may have no area."""
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
    """Return the part of an interval where slope * t + value may be at least 0; low > high where it is nowhere."""
    if abs(slope) > _FLAT:
        end = -value / slope
        if slope > 0.0:
            return (end - _SLACK if end - _SLACK > low else low), high
        return low, (end + _SLACK if end + _SLACK < high else high)
    if slope == 0.0 and value < 0.0:
        return low, low - 1.0
    return low, high


@inline
def layer_reached(walls: Walls, z: float, y: float, first: int, last: int) -> tuple[int, int]:
    """Return the first and last row of a layer that the triangle may reach into; z: of the centres, y: of row 0."""
    low, high = float(first), float(last)
    for wall in walls.seen_along_x:
        low, high = _narrowed(low, high, wall[0], wall[0] * y + wall[1] * z + wall[2])
    return ceil(low), floor(high)


@inline
def row_reached(walls: Walls, z: float, y: float, x: float, first: int, last: int) -> tuple[int, int]:
    """Return the first and last cell of a row that the triangle may reach into; x: of the centre of cell 0."""
    low, high = float(first), float(last)
    for wall in walls.seen_along_z:
        low, high = _narrowed(low, high, wall[0], wall[0] * x + wall[1] * y + wall[2])
    for wall in walls.seen_along_y:
        low, high = _narrowed(low, high, wall[1], wall[0] * z + wall[1] * x + wall[2])
    side = walls.normal[0] * x + walls.normal[1] * y + walls.normal[2] * z
    low, high = _narrowed(low, high, walls.normal[0], walls.reach + side)
    low, high = _narrowed(low, high, -walls.normal[0], walls.reach - side)
    return ceil(low), floor(high)
