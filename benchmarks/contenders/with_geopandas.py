"""geopandas: overlays and joins of layers, by shapely's tree; one call, as its users make it."""

from __future__ import annotations

from typing import Any

import geopandas
import numpy as np
import shapely

from benchmarks.contenders import Prepared

PACKAGE = "geopandas"


def frames(layers: Any) -> list[Any]:
    """Return two layers of polygons of (n, size, 2) corners as frames with a column each."""
    return [geopandas.GeoDataFrame({side: np.arange(len(layer))}, geometry=shapely.polygons(layer))
            for side, layer in zip("ab", layers)]  # fmt: skip


def areas(result: Any) -> np.ndarray:
    """Return the areas of the rows of an overlay by the numbers of what they come from."""
    return result.sort_values(["a", "b"]).geometry.area.to_numpy()


def pairs(result: Any) -> np.ndarray:
    """Return the rows of a join as pairs of numbers."""
    return np.stack([result["a"].to_numpy(np.int64), result["b"].to_numpy(np.int64)], axis=1)


def _layers(how: str, threads: int) -> Prepared:
    return Prepared(lambda both: geopandas.overlay(*both, how, keep_geom_type=True), frames, areas)


def _join(predicate: str, threads: int) -> Prepared:
    return Prepared(lambda both: geopandas.sjoin(*both, predicate=predicate), frames, pairs)


MAKERS = {"layers": _layers, "join": _join}
