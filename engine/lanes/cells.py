"""Parity of a segment's crossings with the triangles of a cell, eight at once: one entry a lane.

A cell has a reference point R whose location is known. A point q of the cell is on the other side of the surface if
the segment from R to q crosses it an odd number of times. For one triangle a, b, c and x = q - R, in units of the
cell:

- s = n . x - d, its plane, turned so that R is on the positive side (d < 0);
- e_k = m_k . x, the three planes through R and an edge. x is in the (double) cone of R over the triangle where the
  three have one sign.

The segment crosses where s < 0 and the three e agree; it misses, and q is not on the triangle, where s > 0 or two e
have opposite signs. Each normal is scaled to a largest component of 1, so all of this is sure beyond a band of 2^-18:

  |x| < 0.75, |d| < 4 and |n|, |m| <= 1 are rounded to single precision (2^-24 relative); three products, their sums and
  the sum with d add 2^-24 of at most 6.3 each; the errors of n, m and d in double precision are bounded below, and an
  entry is made NaN, sure of nothing, where they exceed 2^-24. In total less than 40 * 2^-24 < 2^-18.

Points that are not sure go to the vertical ray (polyhedron_ray_parity.py): nothing is decided here that rounding could
have changed.

A group is (14, 8) float32: the entries of eight triangles, number by number; lanes without a triangle hold one that is
never crossed. One group answers in some 40 vector instructions and no branch, where a loop over four entries spends
most of its time on mispredicted ends. All is plain products and sums, in the order above.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from engine.compiling.jit import inline, merged
from engine.lanes.lanes import aligned, any_of, bits_of, count_bits, dot, greater, lesser, load, prefetch
from engine.lanes.tracing import LANES, Lanes, Number, Rows, traced
from engine.types import UNDECIDED, Float32Array

_UNSURE: Final = 2.0**-24
_ROUNDING: Final = 16.0 * 2.0**-53
"""Relative error of a component of u x v to the sum of its two |products|: 2 u for the factors (rounded differences), u
for the product, u for the sum; times four."""
_FAR: Final = 4.0
BAND: Final = np.float32(2.0**-18)
"""Least distance from a plane of a triangle's entry at which its sign is certain."""
ROWS: Final = 14
"""Numbers of an entry: n and d (4), the three m (9), and 1.0 in the last group of a list, else 0.0."""
_LINE: Final = 16
"""Numbers of a cache line."""


@inline
def _set_normal(row: Float32Array, place: int, u: tuple[float, ...], v: tuple[float, ...]) -> float:
    """Write u x v, scaled to a largest component of 1, to row[place : place + 3]; return a bound on the error of a
    component, NaN if u x v is out of range."""
    x, y, z = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    size = max(
        abs(u[1] * v[2]) + abs(u[2] * v[1]), abs(u[2] * v[0]) + abs(u[0] * v[2]), abs(u[0] * v[1]) + abs(u[1] * v[0])
    )
    largest = max(abs(x), abs(y), abs(z))
    if not (largest > 1e-280 and largest < 1e280):  # underflow, off by 2^-1074, is far below what is still sure
        return np.nan
    scale = 1.0 / largest
    row[place], row[place + 1], row[place + 2] = x * scale, y * scale, z * scale
    return size * scale * _ROUNDING


@inline
def set_nothing(row: Float32Array) -> None:
    """Write an entry that no segment in the cell crosses, for a lane without a triangle; row (13,) or longer."""
    for k in range(ROWS - 1):
        row[k] = 0.0
    row[3] = -_FAR


@inline
def set_entry(
    row: Float32Array, a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...], u: tuple[float, ...],
    v: tuple[float, ...],
) -> None:  # fmt: skip
    """Write the entry of a triangle to row (13,) or longer; NaN where a sign would not be certain. a, b, c: corners
    minus the cell's reference point R; u, v: b - a and c - a; each difference rounded once, in units of the cell."""
    normal_error = _set_normal(row, 0, u, v)
    distance = row[0] * a[0] + row[1] * a[1] + row[2] * a[2]
    reach = max(abs(a[0]), abs(a[1]), abs(a[2]))
    is_sure = normal_error < _UNSURE and (3.0 * normal_error + _ROUNDING) * reach < _UNSURE
    if is_sure and abs(distance) > _FAR:  # the plane does not reach the cell: on R's side everywhere
        set_nothing(row)
        return
    is_sure = is_sure and abs(distance) > 2.0**-16  # R is clearly on one side
    if distance > 0.0:
        row[0], row[1], row[2], distance = -row[0], -row[1], -row[2], -distance
    row[3] = distance
    is_sure = is_sure and _set_normal(row, 4, a, b) < _UNSURE
    is_sure = is_sure and _set_normal(row, 7, b, c) < _UNSURE
    is_sure = is_sure and _set_normal(row, 10, c, a) < _UNSURE
    if not is_sure:
        for k in range(ROWS - 1):
            row[k] = np.nan


@traced
def group_parity(groups: Rows, group: int, x: Number, y: Number, z: Number) -> int:
    """Return 0 or 1, the parity of crossings of the segment from the cell's reference point R to R + (x, y, z) with the
    eight triangles of group `group` of (n, 14, 8). The bit UNDECIDED (2) is added where a triangle is too close to be
    certain."""
    side, least, most = planes_of(groups, group, (x, y, z))
    is_crossed = (side < -BAND) & ((least > BAND) | (most < -BAND))
    is_apart = (side > BAND) | ((least < -BAND) & (most > BAND))
    return (count_bits(bits_of(is_crossed)) & 1) | any_of(~(is_apart | is_crossed)) * UNDECIDED


@merged
def parity_across(groups: Float32Array, group: int, wx: float, wy: float, wz: float) -> int:
    """Return 0 or 1, the parity of crossings of the segment from the cell's reference point R to R + w with the cell's
    triangles, from group `group` to the end of its list. The bit UNDECIDED (2) is added where a triangle is too close
    to be certain."""
    parity = group_parity(groups, group, wx, wy, wz)
    while groups[group, ROWS - 1, 0] == 0.0:  # bound: the last group of each leaf says so
        group += 1
        of_group = group_parity(groups, group, wx, wy, wz)
        parity = ((parity ^ of_group) & 1) | ((parity | of_group) & UNDECIDED)
    return parity


def planes_of(groups: Rows, group: int, point: Sequence[Lanes]) -> tuple[Lanes, Lanes, Lanes]:
    """Return (side, least, most) for each of eight triangles at a point x relative to the cell's reference point R: n .
    x - d of its plane, and the least and the largest m . x of the three planes through R and an edge; the normals n and
    m have a largest component of 1."""
    rows = [load(groups, ROWS * group + row) for row in range(ROWS - 1)]
    side = dot(rows[0:3], point) - rows[3]
    a, b, c = dot(rows[4:7], point), dot(rows[7:10], point), dot(rows[10:13], point)
    return side, lesser(lesser(a, b), c), greater(greater(a, b), c)


@traced
def prefetch_group(groups: Rows, group: int) -> None:
    """Prefetch group `group` of (n, 14, 8) into the cache."""
    for place in range(0, ROWS * LANES, _LINE):
        prefetch(groups, ROWS * LANES * group + place)


def groups_of(n_groups: int) -> Any:
    """Return an uninitialised array (n_groups, 14, 8) float32, aligned to a cache line (a group is seven lines)."""
    return aligned((n_groups, ROWS, LANES), np.float32)
