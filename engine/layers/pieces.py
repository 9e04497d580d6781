"""Pieces of layers: polygons split by lines, a row for each piece; and slivers, pieces that are narrower than a
distance, decided exactly.

The width of a piece is the least distance of two parallel lines between which it lies. One of them then runs along an
edge of its convex hull, so the square of the width is the least, over these edges, of the largest square of a distance
of a vertex from the edge's line: a fraction. A polygon lies in a strip of its width w and in its box of diagonal d, so
its area is at most w d: most pieces are decided by that, in doubles with a bound on the rounding.

Sources: D. E. Muller, F. P. Preparata, Finding the intersection of two convex polyhedra, 1978 (faces, as split.py);
M. E. Houle, G. T. Toussaint, Computing the width of a set, 1988.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from typing import Final

import numpy as np

from engine.distance.clearance import checked_distance
from engine.layers.limits import Limits
from engine.layers.nearest import root_of
from engine.layers.rows import NONE, LayerRows, concatenate_rows, rows_of, rows_of_pairs
from engine.layers.shapes import MixedLayer
from engine.polygon_overlay.pair_arrays import PolygonSelection
from engine.polygon_overlay.split import rings_of, split_rings
from engine.predicates.rational import common_integers
from engine.running.budget import polled
from engine.solids.ragged import next_in_rings, summed
from engine.types import FloatArray, IntArray

_LEAST: Final = 2.0**-900
"""Area from which no product of doubles above was near underflow."""


def split_rows(layer: MixedLayer, lines: MixedLayer, limits: Limits) -> LayerRows:
    """Return the pieces of polygons between lines, a row each, by feature; pieces of one are in lexicographic order."""
    arrays, paths = layer.areas.arrays, lines.paths
    path, _ = paths.owners()
    tails = np.flatnonzero(path[:-1] == path[1:])
    segments = np.stack([paths.vertices[tails], paths.vertices[tails + 1]], axis=1)
    filled = np.flatnonzero(arrays.sizes())
    low, high = arrays.boxes(filled)
    n, ends = len(filled), (np.concatenate([low, segments.min(axis=1)]), np.concatenate([high, segments.max(axis=1)]))
    pairs = limits.pairs_of_boxes(*ends, None, n)
    offsets = np.searchsorted(pairs[:, 0], np.arange(n + 1))
    is_met = np.diff(offsets) > 0
    whole = PolygonSelection(arrays, filled[~is_met])
    parts = [rows_of_pairs(whole, whole, "intersection", filled[~is_met], np.full(len(whole), NONE), limits)]
    with limits.budget() as budget:
        for k in np.flatnonzero(is_met).tolist():
            budget.check()
            near = segments[pairs[offsets[k] : offsets[k + 1], 1] - n]
            made = split_rings(rings_of(arrays.polygon(int(filled[k]))), near, budget)
            parts.append(rows_of(made, np.full(len(made), filled[k])))
    rows = concatenate_rows(parts)
    of_pieces = np.repeat(np.arange(len(rows)), np.diff(rows.row_offsets))
    left = rows.left[of_pieces]
    rows = replace(rows, left=left, right=np.full(len(left), NONE), row_offsets=summed(np.ones(len(left), np.int64)))
    return rows.take(np.argsort(left, kind="stable"))


def narrow_rings(
    vertices: FloatArray, ring_offsets: IntArray, rings: IntArray, min_width: float, limits: Limits
) -> list[tuple[int, float]]:
    """Return (k, width) of those shells rings[k] whose width is below `min_width`: the nearest double, 0.0 for none."""
    least = Fraction(checked_distance(min_width, "min_width"))
    if not len(rings):
        return []
    after, (x, y) = (
        next_in_rings(ring_offsets),
        (vertices - vertices[np.repeat(ring_offsets[:-1], np.diff(ring_offsets))]).T,
    )
    made = []
    with limits.budget(), np.errstate(all="ignore"):
        first, second = x * y[after], x[after] * y
        starts = ring_offsets[:-1]
        area, size = np.add.reduceat(first - second, starts), np.add.reduceat(np.abs(first) + np.abs(second), starts)
        wide, tall = (np.maximum.reduceat(each, starts) - np.minimum.reduceat(each, starts) for each in (x, y))
        # bound: n terms of three roundings each, summed in some order; less than 2^-50 n of their size.
        low = 0.5 * (np.abs(area) - 2.0**-50 * np.diff(ring_offsets) * size)
        is_wide = low * (1.0 - 2.0**-48) >= np.maximum(float(min_width) * np.hypot(wide, tall), _LEAST)
    with limits.budget():
        for k in polled(np.flatnonzero(~is_wide[rings]).tolist()):
            square = width_square(vertices[ring_offsets[rings[k]] : ring_offsets[rings[k] + 1]])
            if square < least * least:
                made.append((k, root_of(square) if square else 0.0))
    return made


def slivers_of(rows: LayerRows, min_width: float, limits: Limits) -> tuple[tuple[int, int, float], ...]:
    """Return (row, piece of the row, width) of the pieces of rows that are narrower than `min_width`."""
    narrow = narrow_rings(rows.vertices, rows.ring_offsets, rows.piece_offsets[:-1], min_width, limits)
    owners = (np.searchsorted(rows.row_offsets, [k for k, _ in narrow], side="right") - 1).tolist()
    return tuple((row, int(k - rows.row_offsets[row]), width) for row, (k, width) in zip(owners, narrow))


def width_square(ring: FloatArray) -> Fraction:
    """Return the exact square of the width of a ring."""
    flat, unit = common_integers(ring.ravel().tolist())
    points = sorted(set(zip(flat[::2], flat[1::2])))
    halves = []
    for some in (points, points[::-1]):
        chain: list[tuple[int, int]] = []
        for p in polled(some):
            while len(chain) > 1 and _cross(chain[-2], chain[-1], p) <= 0:
                chain.pop()
            chain.append(p)
        halves += chain[:-1]
    n, far, best = len(halves), 1, Fraction(0)
    for k, (a, b) in enumerate(pairwise([*halves, *halves[:1]])):
        while n > 2 and _cross(a, b, halves[(far + 1) % n]) > _cross(a, b, halves[far % n]):  # bound: 2 n in all
            far += 1
        square = Fraction(_cross(a, b, halves[far % n]) ** 2, (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2)
        best = square if k == 0 else min(best, square)
    return best / (unit * unit)


def _cross(a: tuple[int, int], b: tuple[int, int], p: tuple[int, int]) -> int:
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
