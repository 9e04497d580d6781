"""Altitudes of GeoDataFrames: decisions are those of the plane, vertices that stay keep theirs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from engine.layers.frame_reading import geopandas_and_shapely
from engine.layers.rows import NONE
from engine.running.budget import note
from engine.types import FloatArray, IntArray

if TYPE_CHECKING:
    from geopandas import GeoDataFrame


def with_altitudes(geometries: Any, sources: list[tuple[GeoDataFrame, IntArray, IntArray | None]]) -> Any:
    """Return the geometries of rows with the altitudes of their features, NaN at vertices that no feature has; as they
    are if no feature has any.

    sources: layers; by row the feature, or the group, that it comes from, NONE for none; by feature its group, None
    where rows are of features. Of two layers with an altitude at a vertex the first counts."""
    _, shapely = geopandas_and_shapely()
    sides = [each for each in sources if shapely.has_z(np.asarray(each[0].geometry.array)).any()]
    if not sides:
        return geometries
    flat, row = shapely.get_coordinates(geometries, return_index=True)
    heights = np.full(len(flat), np.nan)
    for frame, of_rows, groups in sides:
        known, feature = shapely.get_coordinates(np.asarray(frame.geometry.array), include_z=True, return_index=True)
        owner = feature if groups is None else groups[feature]
        there = ~np.isnan(known[:, 2]) & (owner != NONE)
        table, wanted = _keys(owner[there], known[there]), _keys(of_rows[row], flat)
        _, places = np.unique(np.concatenate([table, wanted]), axis=0, return_inverse=True)
        values = np.full(len(table) + len(wanted), np.nan)
        values[places.reshape(-1)[: len(table)][::-1]] = known[there, 2][::-1]  # of equal ones the first counts
        heights = np.where(np.isnan(heights), values[places.reshape(-1)[len(table) :]], heights)
    n_new = int(np.isnan(heights).sum())
    note(f"altitudes: {len(flat) - n_new} vertices keep theirs, {n_new} new ones have none")
    solid = shapely.force_3d(geometries)
    there = ~shapely.is_missing(geometries)
    made = np.array(geometries, object)
    made[there] = shapely.set_coordinates(solid[there], np.column_stack([flat, heights]))
    return made


def _keys(owner: IntArray, points: FloatArray) -> FloatArray:
    return np.column_stack([owner, points[:, :2] + 0.0])
