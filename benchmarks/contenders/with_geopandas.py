"""geopandas: layers of polygons with attributes, frame in and frame out."""

from __future__ import annotations

from typing import Any

import geopandas
import numpy as np
import shapely

from benchmarks.contenders import Prepared

PACKAGE = "geopandas"


def frames_of(layers: tuple[np.ndarray, np.ndarray]) -> list[Any]:
    """Return two layers of polygons of (n, size, 2) corners as GeoDataFrames with two columns."""
    return [
        geopandas.GeoDataFrame(
            {"number": np.arange(len(layer)), "name": [f"{side}{k}" for k in range(len(layer))]},
            geometry=shapely.polygons(layer),
        )
        for side, layer in zip("lr", layers, strict=True)
    ]


def areas_of(frame: Any) -> np.ndarray:
    return frame.area.to_numpy()


def _layers(how: str, threads: int) -> Prepared:
    return Prepared(lambda frames: geopandas.overlay(*frames, how, keep_geom_type=True), frames_of, areas_of)


MAKERS = {"layers": _layers}
