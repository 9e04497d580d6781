"""Clips and joins of layers as GeoJSON, for HTTP and the command line."""

from __future__ import annotations

from typing import Any, Literal, overload

import numpy as np

from engine.layers.feature_rows import ROW, FeatureRows, with_geometries
from engine.layers.features import Answer
from engine.layers.geojson import EVERY, collection_of, crs_of, members_of, mixed_of, texts_of
from engine.layers.joins import check_predicate, related_pairs
from engine.layers.limits import Limits
from engine.layers.path_rows import clip_mixed
from engine.layers.rows import NONE
from engine.running.budget import Cancel
from engine.running.parallel import check_options
from engine.solids.ragged import summed
from engine.types import Accuracy, read_only


@overload
def clip_features(
    layer: Any,
    mask: Any,
    *,
    grid: float | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: Literal[False] = False,
) -> FeatureRows: ...
@overload
def clip_features(
    layer: Any,
    mask: Any,
    *,
    grid: float | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: Literal[True],
) -> tuple[FeatureRows, Accuracy]: ...
def clip_features(
    layer: Any, mask: Any, *, grid: float | None = None, deadline: float | None = None, cancel: Cancel | None = None,
    report: bool = False,
) -> Answer:  # fmt: skip
    """Cut the features of a FeatureCollection to the union of some polygons.

    Parameters
    ----------
    layer, mask : dict
        GeoJSON FeatureCollections, the mask of polygons.
    grid : float, optional
        As for `engine.layers.overlay`.
    deadline, cancel, report
        As for `engine.locate`.

    Returns
    -------
    FeatureRows
        With ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    EngineError
        As `engine.layers.overlay`, with the path to the element at fault and its id.

    Notes
    -----
    Boundary, accuracy and cost: as `engine.layers.clip`; of a polygon that only touches the mask there is no row.

    References
    ----------
    RFC 7946 (GeoJSON).

    Examples
    --------
    >>> from engine import layers
    >>> def collection(kind, coordinates):
    ...     geometry = {"type": kind, "coordinates": coordinates}
    ...     feature = {"type": "Feature", "properties": {}, "geometry": geometry}
    ...     return {"type": "FeatureCollection", "features": [feature]}
    >>> triangle = collection("Polygon", [[[0, 0], [2, 0], [0, 2], [0, 0]]])
    >>> rows = layers.clip_features(collection("LineString", [[0, 1], [9, 1]]), triangle)
    >>> rows.make(0, 1)[0]["geometry"]["coordinates"]
    [[0.0, 1.0], [1.0, 1.0]]
    """
    check_options(None, None, report=report)
    limits = Limits(deadline, cancel, grid=grid)
    side = collection_of(layer, ("layer",), limits, EVERY)
    region = collection_of(mask, ("mask",), limits)
    nothing = collection_of({"type": "FeatureCollection", "features": []}, ("mask",), limits)
    crs = crs_of([side, region], limits)
    write_members, n_bytes = members_of([side, nothing], ("layer", "mask"), limits)
    features, mask = mixed_of(side, limits), mixed_of(region, limits)
    rows = clip_mixed(features, mask, limits, frozenset(features.dims.tolist()) - {-1}, False)
    none = np.full(len(rows), NONE)
    made = with_geometries(rows, lambda row: write_members(int(rows.left[row]), NONE), n_bytes(rows.left, none), crs)
    return (made, limits.accuracy) if report else made


@overload
def join_features(
    left: Any,
    right: Any,
    predicate: str = "intersects",
    *,
    distance: float | None = None,
    outside: bool = False,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: Literal[False] = False,
) -> FeatureRows: ...
@overload
def join_features(
    left: Any,
    right: Any,
    predicate: str = "intersects",
    *,
    distance: float | None = None,
    outside: bool = False,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: Literal[True],
) -> tuple[FeatureRows, Accuracy]: ...
def join_features(
    left: Any, right: Any, predicate: str = "intersects", *, distance: float | None = None, outside: bool = False,
    deadline: float | None = None, cancel: Cancel | None = None, report: bool = False,
) -> Answer:  # fmt: skip
    """Join each feature to those that it meets, or has another relation to.

    Parameters
    ----------
    left, right : dict
        GeoJSON FeatureCollections of any geometries but collections.
    predicate, distance
        As for `engine.layers.sjoin`.
    outside : bool, default False
        Also a row for each left feature without one.
    deadline, cancel, report
        As for `engine.locate`.

    Returns
    -------
    FeatureRows
        A row for each pair, with the left geometry and the properties of both. With ``report=True`` a pair of it and an
        `Accuracy`.

    Raises
    ------
    EngineError
        As `engine.layers.overlay`.

    Notes
    -----
    Boundary, accuracy and cost: as `engine.layers.sjoin`.

    References
    ----------
    RFC 7946 (GeoJSON).

    Examples
    --------
    >>> from engine import layers
    >>> def collection(kind, coordinates):
    ...     geometry = {"type": kind, "coordinates": coordinates}
    ...     feature = {"type": "Feature", "properties": {}, "geometry": geometry}
    ...     return {"type": "FeatureCollection", "features": [feature]}
    >>> triangle = collection("Polygon", [[[0, 0], [2, 0], [0, 2], [0, 0]]])
    >>> len(layers.join_features(collection("LineString", [[0, 1], [9, 1]]), triangle, "crosses"))
    1
    """
    check_options(None, None, report=report, outside=outside)
    reach, limits = check_predicate(predicate, distance), Limits(deadline, cancel)
    sides = [collection_of(left, ("left",), limits, EVERY), collection_of(right, ("right",), limits, EVERY)]
    crs = crs_of(sides, limits)
    geometries = texts_of(sides[0], (each.get("geometry") for each in sides[0].features), "geometry", limits)
    write_members, n_bytes = members_of(sides, ("left", "right"), limits)
    layers = [mixed_of(side, limits) for side in sides]
    first, second = related_pairs(layers[0], layers[1], predicate, reach, limits).T
    if outside:
        alone = np.setdiff1d(np.arange(len(sides[0].features)), first)
        order = np.argsort(np.concatenate([first, alone]), kind="stable")
        first = np.concatenate([first, alone])[order]
        second = np.concatenate([second, np.full(len(alone), NONE)])[order]
    sizes = np.array([*map(len, geometries)], np.int64)[first] + n_bytes(first, second)
    limits.budget().take(8 * 4 * len(first))
    made = FeatureRows(
        lambda row: write_members(int(first[row]), int(second[row])), read_only(np.arange(len(first) + 1)),
        summed(ROW + sizes), crs, geometry=lambda row: geometries[first[row]],
    )  # fmt: skip
    return (made, limits.accuracy) if report else made
