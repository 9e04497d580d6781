"""Altitudes: decisions are those of the plane, vertices that stay keep theirs, and none is interpolated."""

from __future__ import annotations

import numpy as np

from engine.layers.rows import NONE
from engine.running.budget import note
from engine.types import FloatArray, IntArray


def heights_at(places: FloatArray, rows: IntArray, sources: list[tuple[FloatArray, IntArray]]) -> FloatArray | None:
    """Return the altitude of each of n vertices of an answer, NaN for new ones; None if the input has no altitudes.

    places (n, 2), rows (n,): vertices, and the row of each. sources: for each input layer its vertices with altitude
    (m, 4), feature, x, y, altitude, and (n_rows,) the feature that each row comes from (or its group, if the first
    column has groups). Of two altitudes at a vertex the first counts."""
    heights = np.full(len(places), np.nan)
    sides = [(known[~np.isnan(known[:, 3]) & (known[:, 0] != NONE)], of_rows) for known, of_rows in sources]
    if not len(places) or not any(len(known) for known, _ in sides):
        return None
    for known, of_rows in sides:
        wanted = np.column_stack([of_rows[rows], places + 0.0])
        _, names = np.unique(np.concatenate([known[:, :3] + 0.0, wanted]), axis=0, return_inverse=True)
        names, values = names.reshape(-1), np.full(len(known) + len(wanted), np.nan)
        values[names[: len(known)][::-1]] = known[::-1, 3]
        heights = np.where(np.isnan(heights), values[names[len(known) :]], heights)
    n_new = int(np.isnan(heights).sum())
    note(f"altitudes: {len(places) - n_new} vertices keep theirs, {n_new} new ones have none")
    return heights
