"""Layers: polygons with attributes, as maps have them; GeoDataFrames in and out, and GeoJSON for HTTP and files."""

from engine.layers.features import FeatureRows, dissolve_features, locate_features, overlay_features
from engine.layers.frame_joins import sjoin, sjoin_nearest
from engine.layers.frames import clip, dissolve, overlay
from engine.layers.geojson import polygon_of

__all__ = [
    "FeatureRows",
    "clip",
    "dissolve",
    "dissolve_features",
    "locate_features",
    "overlay",
    "overlay_features",
    "polygon_of",
    "sjoin",
    "sjoin_nearest",
]
