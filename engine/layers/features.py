"""Layers as GeoJSON (RFC 7946): FeatureCollections in, features out; for HTTP and the command line.

What a feature has besides its geometry (properties, id) and the `crs` is copied unchanged: written as JSON once a
feature (json_text.py), and joined to rows, so that the length of an answer is known before it is made. A row from
features of both layers has the properties of both, names that both layers have with _1 and _2, as in geopandas; `left`
and `right` are the numbers of these features.
"""

from __future__ import annotations

from typing import Any, Literal, overload

import numpy as np

from engine.errors import CancelledError, DeadlineExceededError, EngineError, InvalidInputError
from engine.layers.feature_rows import ROW, FeatureRows, with_geometries
from engine.layers.geojson import (
    EVERY,
    check_each,
    collection_of,
    crs_of,
    groups_of,
    members_of,
    mixed_of,
    polygons_of,
    texts_of,
)
from engine.layers.json_text import text_of
from engine.layers.limits import Limits
from engine.layers.path_rows import dissolve_mixed, overlay_mixed
from engine.layers.rows import (
    NONE,
    locate_points_in_layer,
    with_unmatched_points,
)
from engine.running.budget import Cancel, polled
from engine.running.parallel import check_options
from engine.solids.checks import as_points, shown
from engine.solids.ragged import summed
from engine.types import Accuracy, read_only

Answer = FeatureRows | tuple[FeatureRows, Accuracy]


@overload
def overlay_features(
    left: Any,
    right: Any,
    how: str = "intersection",
    *,
    grid: float | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: Literal[False] = False,
) -> FeatureRows: ...
@overload
def overlay_features(
    left: Any,
    right: Any,
    how: str = "intersection",
    *,
    grid: float | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: Literal[True],
) -> tuple[FeatureRows, Accuracy]: ...
def overlay_features(
    left: Any,
    right: Any,
    how: str = "intersection",
    *,
    grid: float | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: bool = False,
) -> Answer:
    """Overlay a FeatureCollection with one of polygons.

    Parameters
    ----------
    left, right : dict
        GeoJSON FeatureCollections, the left one of any geometries, the right one of polygons. Features with null
        geometry keep their properties where what is left of their layer is part of the answer.
    how : {"intersection", "union", "identity", "difference", "symmetric_difference"}
        As `engine.layers.overlay`.
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
    Boundary, degenerate input, accuracy and cost: as `engine.layers.overlay`.

    References
    ----------
    RFC 7946 (GeoJSON).

    Examples
    --------
    >>> from engine import layers
    >>> def layer(low, high):
    ...     ring = [[low, low], [high, low], [high, high], [low, high], [low, low]]
    ...     geometry = {"type": "Polygon", "coordinates": [ring]}
    ...     feature = {"type": "Feature", "properties": {}, "geometry": geometry}
    ...     return {"type": "FeatureCollection", "features": [feature]}
    >>> rows = layers.overlay_features(layer(0, 2), layer(1, 3))
    >>> rows.make(0, len(rows))[0]["geometry"]["coordinates"][0].tolist()
    [[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0], [1.0, 1.0]]
    """
    check_options(None, None, report=report)
    limits = Limits(deadline, cancel, grid=grid)
    sides = [collection_of(left, ("left",), limits, EVERY), collection_of(right, ("right",), limits)]
    crs = crs_of(sides, limits)
    write_members, n_bytes = members_of(sides, ("left", "right"), limits)
    layers = [mixed_of(side, limits) for side in sides]
    kinds = frozenset(layers[0].dims.tolist()) - {-1}
    rows = overlay_mixed(layers[0], layers[1], how, limits, kinds, False)
    made = with_geometries(
        rows, lambda row: write_members(int(rows.left[row]), int(rows.right[row])), n_bytes(rows.left, rows.right), crs
    )
    return (made, limits.accuracy) if report else made


@overload
def dissolve_features(
    layer: Any,
    by: list[str] | None = None,
    *,
    coverage: bool = False,
    grid: float | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: Literal[False] = False,
) -> FeatureRows: ...
@overload
def dissolve_features(
    layer: Any,
    by: list[str] | None = None,
    *,
    coverage: bool = False,
    grid: float | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: Literal[True],
) -> tuple[FeatureRows, Accuracy]: ...
def dissolve_features(
    layer: Any,
    by: list[str] | None = None,
    *,
    coverage: bool = False,
    grid: float | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: bool = False,
) -> Answer:
    """Unite the features of a FeatureCollection that agree in the properties `by`; all of them by default.

    Parameters
    ----------
    layer : dict
        A GeoJSON FeatureCollection of polygons, of lines, or of points.
    by : list of str, optional
        Names of properties.
    coverage, grid
        As for `engine.layers.dissolve`.
    deadline, cancel, report
        As for `engine.locate`.

    Returns
    -------
    FeatureRows
        Groups in the order of their first features. Properties: those of `by`, and `count`, the features united. With
        ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    EngineError
        As `engine.layers.overlay`.

    Notes
    -----
    Boundary, accuracy and cost: as `engine.union_all`, a group each.

    References
    ----------
    RFC 7946 (GeoJSON).

    Examples
    --------
    >>> from engine import layers
    >>> geometry = {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [0, 1], [0, 0]]]}
    >>> features = [{"type": "Feature", "properties": {"owner": "Ada"}, "geometry": geometry}] * 2
    >>> rows = layers.dissolve_features({"type": "FeatureCollection", "features": features}, ["owner"])
    >>> rows.make(0, len(rows))[0]["properties"]
    {'owner': 'Ada', 'count': 2}
    """
    check_options(None, None, report=report, coverage=coverage)
    limits = Limits(deadline, cancel, grid=grid)
    side = collection_of(layer, ("layer",), limits, EVERY)
    crs = crs_of([side], limits)
    names = _checked_names(by)
    for member, column in (("properties", side.properties), ("id", ({"id": each.get("id")} for each in side.features))):
        checked = texts_of(side, column, member, limits)  # none may be what JSON cannot hold
        limits.budget().take(-sum(map(len, checked)))
        del checked
    groups, values = groups_of(side, names, limits)
    rows = dissolve_mixed(mixed_of(side, limits), groups, len(values), limits, coverage)
    counts = np.bincount(groups, minlength=len(rows)).tolist()
    texts = [b"%b:null" % text_of(name) for name in names]

    def write_members(row: int) -> bytes:
        own = texts.copy()
        for place, value in values[row].items():
            own[place] = own[place][:-4] + value
        return b'"properties":{%b}' % b",".join([*own, b'"count":%d' % counts[row]])

    lengths = [sum(len(value) - 4 for value in each.values()) for each in polled(values)]
    made = with_geometries(rows, write_members, np.array(lengths, np.int64) + sum(map(len, texts)), crs)
    return (made, limits.accuracy) if report else made


def _checked_names(by: Any) -> list[str]:
    names = [] if by is None else by
    if not isinstance(names, (list, tuple)) or not all(isinstance(name, str) for name in names):
        raise InvalidInputError(f"by must be a list of names of properties, got {shown(by)}", ("by",))
    if "count" in names:
        raise InvalidInputError("count is how many features were united; give that property another name", ("by",))
    return list(dict.fromkeys(names))


@overload
def locate_features(
    points: Any,
    polygons: Any,
    *,
    outside: bool = False,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: Literal[False] = False,
) -> FeatureRows: ...
@overload
def locate_features(
    points: Any,
    polygons: Any,
    *,
    outside: bool = False,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: Literal[True],
) -> tuple[FeatureRows, Accuracy]: ...
def locate_features(
    points: Any,
    polygons: Any,
    *,
    outside: bool = False,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: bool = False,
) -> Answer:
    """Join each Point to the polygons that contain it, boundary included.

    Parameters
    ----------
    points, polygons : dict
        GeoJSON FeatureCollections.
    outside : bool, default False
        Also a row for a point that no polygon contains.
    deadline, cancel, report
        As for `engine.locate`.

    Returns
    -------
    FeatureRows
        A row each, with `boundary`, and the properties of both. With ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    EngineError
        As `engine.layers.overlay`.

    Notes
    -----
    Boundary: a point on a border that two polygons share is in both. Exact; cost as `engine.locate_scene`.

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
    >>> len(layers.locate_features(collection("Point", [1, 1]), triangle))
    1
    """
    check_options(None, None, report=report, outside=outside)
    limits = Limits(deadline, cancel)
    sides = [collection_of(points, ("points",), limits, ("Point",)), collection_of(polygons, ("polygons",), limits)]
    crs = crs_of(sides[:1], limits)
    there = [k for k, each in enumerate(sides[0].features) if each.get("geometry") is not None]
    places = [sides[0].features[k]["geometry"].get("coordinates") for k in there]
    with limits.budget():
        try:
            positions = as_points(places, 2, ("points",))
        except (DeadlineExceededError, CancelledError):
            raise
        except EngineError:
            positions = check_each(there, sides[0], lambda each: as_points([each["coordinates"]], 2)[0])
    geometries = texts_of(sides[0], (each.get("geometry") for each in sides[0].features), "geometry", limits)
    write_members, n_bytes = members_of(sides, ("point", "polygon"), limits)
    layer = polygons_of(sides[1], limits)
    first, second, on_boundary = locate_points_in_layer(positions, layer, limits)
    first = np.array(there, np.int64)[first]
    if outside:
        first, second, on_boundary = with_unmatched_points(len(sides[0].features), first, second, on_boundary)

    def members(row: int) -> bytes:
        more = (b',"boundary":false', b',"boundary":true')[int(on_boundary[row])] if second[row] != NONE else b""
        return write_members(int(first[row]), int(second[row])) + more

    sizes = np.array([*map(len, geometries)], np.int64)[first] + n_bytes(first, second)
    offsets, n_bytes_before = read_only(np.arange(len(first) + 1)), summed(ROW + sizes)
    made = FeatureRows(members, offsets, n_bytes_before, crs, geometry=lambda row: geometries[first[row]])
    return (made, limits.accuracy) if report else made
