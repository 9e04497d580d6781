"""Altitudes: decisions are those of the plane, vertices that stay keep theirs, and none is interpolated."""

from __future__ import annotations

import numpy as np

from engine.layers.rows import NONE
from engine.running.budget import note
from engine.types import FloatArray, IntArray


def heights_at(places: FloatArray, rows: IntArray, sources: list[tuple[FloatArray, IntArray]]) -> FloatArray | None:
    """Return the altitude of each of n vertices of rows, NaN for new ones; None if there are no altitudes at all.

    places, rows (n, 2), (n,): vertices, and the row of each. sources: known vertices as rows (feature, x, y, altitude),
    and by row the feature, or the group, that it comes from. Of two at a vertex the first counts."""
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
