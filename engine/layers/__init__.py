"""Layers: points, lines and polygons with attributes, as maps have them; GeoDataFrames, and GeoJSON for HTTP, files."""

from engine.layers.feature_joins import join_features, locate_features, nearest_features
from engine.layers.feature_rows import FeatureRows
from engine.layers.features import clip_features, dissolve_features, overlay_features, split_features
from engine.layers.frame_joins import sjoin, sjoin_nearest
from engine.layers.frame_pieces import slivers, split
from engine.layers.frames import clip, dissolve, overlay
from engine.layers.geojson import polygon_of
from engine.layers.streams import FeatureStream

__all__ = [
    "FeatureRows",
    "FeatureStream",
    "clip",
    "clip_features",
    "dissolve",
    "dissolve_features",
    "join_features",
    "locate_features",
    "nearest_features",
    "overlay",
    "overlay_features",
    "polygon_of",
    "sjoin",
    "sjoin_nearest",
    "slivers",
    "split",
    "split_features",
]
