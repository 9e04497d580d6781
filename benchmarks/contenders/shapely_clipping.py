"""Shapely (GEOS): `clip_by_rect` over an array of lines or polygons; making the geometries is not timed."""

from __future__ import annotations

import numpy as np
import shapely

import engine
from benchmarks.contenders import Prepared

NAME, PACKAGE = "shapely", "shapely"


def _prepared(native, subject: engine.Aabb) -> Prepared:
    bounds = (*subject.min.tolist(), *subject.max.tolist())
    return Prepared(
        native, lambda shapes: shapely.clip_by_rect(shapes, *bounds), lambda found: ~shapely.is_empty(found)
    )


def _segments(subject: engine.Aabb, threads: int) -> Prepared:
    return _prepared(shapely.linestrings, subject)


def _polygons(subject: engine.Aabb, threads: int) -> Prepared:
    return _prepared(lambda rings: shapely.polygons(np.concatenate([rings, rings[:, :1]], axis=1)), subject)


MAKERS = {"segments": _segments, "polygons": _polygons}
