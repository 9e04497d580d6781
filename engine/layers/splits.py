"""Layers of polygons split by lines: a row for each piece.

Source: D. E. Muller, F. P. Preparata, Finding the intersection of two convex polyhedra, 1978 (faces, as split.py).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from engine.layers.limits import Limits
from engine.layers.rows import NONE, LayerRows, concatenate_rows, rows_of, rows_of_pairs
from engine.layers.shapes import MixedLayer
from engine.polygon_overlay.pair_arrays import PolygonSelection
from engine.polygon_overlay.split import rings_of, split_rings
from engine.solids.ragged import summed


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
