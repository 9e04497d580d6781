"""Runs the Sutherland-Hodgman kernel over chunks: planes as double-doubles, scenes brought into its range."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Final

import numpy as np

from engine.arrays import BoolArray, FlagArray, FloatArray, IntArray
from engine.budget import Budget
from engine.direct import entry_of
from engine.polygon_clipping.in_integers import Row
from engine.polygon_clipping.rings import PlaneTables
from engine.polygon_clipping.sutherland_hodgman import clip_rings
from engine.predicates.digits import packed_numbers
from engine.predicates.expansion import LARGEST, SMALLEST
from engine.predicates.rational import nearest_pair
from engine.predicates.scaling import exponent_above, scaled_back, shifted
from engine.solids.base import Solid
from engine.types import OPEN

AXES: Final = {2: (0, 1), 3: (0, 1, 2)}  # the `names` of `clip_rings`
_DEEPEST: Final = -900
"""Scenes below 2^-900 have subnormal results, which the kernel would round twice."""


@dataclass(frozen=True, slots=True)
class KernelScene:
    """vertices: (m, dim) float64 times 2^-exponent; tables: the planes for them."""

    vertices: FloatArray
    exponent: int
    tables: PlaneTables


def kernel_scene(
    region: Solid, vertices: FloatArray, largest: float, planes: list[Row], budget: Budget
) -> KernelScene | None:
    """Return the scene as the kernel takes it, None where numbers lie too far apart for it.

    largest: magnitude of any coordinate. planes: those of the region.
    """
    exponent = exponent_above(largest)
    points = shifted(vertices, -exponent) if exponent else vertices
    if points is None or exponent < _DEEPEST or not planes:
        return None
    if exponent:
        tables = _plane_tables(planes, exponent, budget)
    else:
        tables = region.prepared("clipping_tables", lambda: _plane_tables(planes, 0, budget), budget.check)
    return None if tables is None else KernelScene(points, exponent, tables)


def _plane_tables(planes: list[Row], exponent: int, budget: Budget) -> PlaneTables | None:
    """Return planes for vertices times 2^-exponent, None where numbers lie too far apart for the kernel."""
    high, low = np.zeros((len(planes), len(planes[0]))), np.zeros((len(planes), len(planes[0])))
    axes, at = np.full(len(planes), -1, np.int64), np.zeros(len(planes))
    rows: list[list[int]] = []
    for i, row in enumerate(planes):
        if i % 256 == 0:
            budget.check()
        *normal, offset = [x << exponent for x in row[:-1]] + [row[-1]] if exponent > 0 else row
        offset = offset << -exponent if exponent < 0 else offset
        rows.append([*normal, offset])
        shift = max(map(int.bit_length, normal))  # the row is divided by 2^shift: its largest number is about 1
        try:
            for k, number in enumerate([*normal, offset]):
                high[i, k], low[i, k] = _double_double(number, shift)
            across = [k for k, number in enumerate(normal) if number]
            if len(across) == 1:
                place, rest = nearest_pair(-offset, normal[across[0]])
                axes[i], at[i] = (across[0], place) if rest == 0 else (-1, 0.0)
        except OverflowError:
            return None
    sizes = np.abs(np.concatenate([high.ravel(), low.ravel()]))
    if ((sizes != 0.0) & ((sizes < SMALLEST) | (sizes > LARGEST))).any():
        return None
    packed = packed_numbers(rows)
    return None if packed is None else PlaneTables(high, low, axes, at, *packed)


def _double_double(number: int, shift: int) -> tuple[float, float]:
    """Return number / 2^shift as a double-double, whose low part is zero only where the high part is exact."""
    high, low = nearest_pair(number, 1 << shift)
    if low == 0.0 and Fraction(high) * (1 << shift) != number:
        raise OverflowError(number)  # the low part underflows
    return high, low


def clip_chunk(
    scene: KernelScene, ring_offsets: IntArray, polygon_offsets: IntArray, first: int, last: int, budget: Budget,
    sizes: IntArray, state: FlagArray, may_have_bridges: BoolArray,
) -> FloatArray:  # fmt: skip
    """Clip polygons first .. last - 1 as far as the kernel can; return the vertices of those it settled, in order.

    Fills sizes (of rings), state and may_have_bridges (of polygons); see `clip_rings`.
    """
    n_vertices = int(ring_offsets[polygon_offsets[last]] - ring_offsets[polygon_offsets[first]])
    vertices, tables, done, parts = scene.vertices, scene.tables, first, list[FloatArray]()
    d = vertices.shape[1]
    room, clip = d * (n_vertices + 4 * len(tables.high) + 64), entry_of(clip_rings, d)
    flat, found = vertices.reshape(-1), (sizes, state, may_have_bridges)
    while done < last:
        out = np.empty(room)
        reached, written = clip(
            flat, ring_offsets, polygon_offsets, tables, done, last, budget.flag, out, *found, AXES[d]
        )
        budget.check()
        parts.append(out[: written * d].reshape(-1, d))
        budget.take(2 * parts[-1].nbytes)
        if reached == done:
            room *= 2
            budget.take(room * out.itemsize)
        done = reached
    vertices = parts[0] if len(parts) == 1 else np.concatenate([np.zeros((0, d)), *parts])
    if scene.exponent:
        vertices, doubtful = scaled_back(vertices, scene.exponent)
        if doubtful.any():
            state[first:last] = OPEN
            sizes[polygon_offsets[first] : polygon_offsets[last]] = 0
            return vertices[:0]
    return vertices
