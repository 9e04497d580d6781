"""Joins of layers as GeoJSON, for HTTP and the command line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine.distance.clearance import checked_distance
from engine.layers.feature_rows import ROW, Answer, FeatureRows, reporting
from engine.layers.geojson import EVERY, Collection, collection_of, mixed_of
from engine.layers.joins import check_predicate, nearest_of, related_pairs
from engine.layers.json_text import text_of
from engine.layers.limits import Limits
from engine.layers.members import crs_of, members_of, texts_of
from engine.layers.rows import NONE, locate_points_in_layer, with_unmatched
from engine.layers.shapes import MixedLayer
from engine.running.budget import Cancel
from engine.running.parallel import check_options
from engine.solids.ragged import summed
from engine.types import IntArray, read_only


@reporting
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
        As for `overlay_features`.

    Returns
    -------
    FeatureRows
        A row for each pair, with the left geometry and the properties of both.

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
    >>> from engine import layers, read_layer
    >>> triangle = read_layer(b'{"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [0, 2], [0, 0]]]}')
    >>> line = read_layer(b'{"type": "LineString", "coordinates": [[0, 1], [9, 1]]}')
    >>> len(layers.join_features(line, triangle, "crosses"))
    1
    """
    check_options(None, None, report=report, outside=outside)
    reach, limits = check_predicate(predicate, distance), Limits(deadline, cancel)
    sides = [collection_of(left, ("left",), limits, EVERY), collection_of(right, ("right",), limits, EVERY)]

    def related(one: MixedLayer, other: MixedLayer) -> _Joined:
        return related_pairs(one, other, predicate, reach, limits), None

    return _answered(sides, ("left", "right"), related, outside, limits, report)


@reporting
def nearest_features(
    left: Any, right: Any, *, max_distance: float | None = None, exclusive: bool = False, outside: bool = False,
    deadline: float | None = None, cancel: Cancel | None = None, report: bool = False,
) -> Answer:  # fmt: skip
    """Join each feature to all features that are nearest to it.

    Parameters
    ----------
    left, right : dict
        GeoJSON FeatureCollections of any geometries but collections.
    max_distance, exclusive
        As for `engine.layers.sjoin_nearest`.
    outside, deadline, cancel, report
        As for `join_features`.

    Returns
    -------
    FeatureRows
        A row for each pair, with the left geometry, the properties of both, and the member `distance`.

    Raises
    ------
    EngineError
        As `engine.layers.overlay`.

    Notes
    -----
    Boundary, accuracy and cost: as `engine.layers.sjoin_nearest`: all of several that are as near, decided exactly.

    References
    ----------
    RFC 7946 (GeoJSON).

    Examples
    --------
    >>> from engine import layers, read_layer
    >>> triangle = read_layer(b'{"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [0, 2], [0, 0]]]}')
    >>> point = read_layer(b'{"type": "Point", "coordinates": [5, 0]}')
    >>> layers.nearest_features(point, triangle).make(0, 1)[0]["distance"]
    3.0
    """
    check_options(None, None, report=report, outside=outside, exclusive=exclusive)
    most = np.inf if max_distance is None else checked_distance(max_distance, "max_distance")
    limits = Limits(deadline, cancel)
    sides = [collection_of(left, ("left",), limits, EVERY), collection_of(right, ("right",), limits, EVERY)]

    def nearest(one: MixedLayer, other: MixedLayer) -> _Joined:
        pairs, distances = nearest_of(one, other, most, bool(exclusive), limits)
        return pairs, lambda pair: b',"distance":%b' % text_of(float(distances[pair]))

    return _answered(sides, ("left", "right"), nearest, outside, limits, report)


@reporting
def locate_features(
    points: Any, polygons: Any, *, outside: bool = False, deadline: float | None = None, cancel: Cancel | None = None,
    report: bool = False,
) -> Answer:  # fmt: skip
    """Join each Point to the polygons that contain it, boundary included.

    Parameters
    ----------
    points, polygons : dict
        GeoJSON FeatureCollections.
    outside, deadline, cancel, report
        As for `join_features`.

    Returns
    -------
    FeatureRows
        A row each, with `boundary`, and the properties of both.

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
    >>> from engine import layers, read_layer
    >>> triangle = read_layer(b'{"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [0, 2], [0, 0]]]}')
    >>> len(layers.locate_features(read_layer(b'{"type": "Point", "coordinates": [1, 1]}'), triangle))
    1
    """
    check_options(None, None, report=report, outside=outside)
    limits = Limits(deadline, cancel)
    sides = [collection_of(points, ("points",), limits, ("Point",)), collection_of(polygons, ("polygons",), limits)]

    def located(one: MixedLayer, other: MixedLayer) -> _Joined:
        first, second, on_boundary = locate_points_in_layer(one.paths.vertices, other.areas, limits)
        words = (b',"boundary":false', b',"boundary":true')
        pairs = np.column_stack([one.paths.owners()[1][first], second])
        return pairs, lambda pair: words[int(on_boundary[pair])]

    return _answered(sides, ("point", "polygon"), located, outside, limits, report)


_Joined = tuple[IntArray, Callable[[int], bytes] | None]
"""Pairs (n, 2) of features, and a function of a pair: further members, as JSON."""


def _answered(
    sides: list[Collection], names: tuple[str, str], function: Callable[[MixedLayer, MixedLayer], _Joined],
    outside: bool, limits: Limits, report: bool,
) -> Answer:  # fmt: skip
    """Return the rows of a join, each with geometry and members of the first feature and members of the second. sides:
    both collections; function: the join of them as layers, which returns pairs of features; outside: also a row for
    each first feature without a second."""
    crs = crs_of(sides if names[0] == "left" else sides[:1], limits)
    geometries = texts_of(sides[0], (each.get("geometry") for each in sides[0].features), "geometry", limits)
    write_members, n_bytes = members_of(sides, names, limits)
    pairs, more = function(*(mixed_of(side, limits) for side in sides))
    first, second = pairs.T
    places = np.arange(len(pairs))
    if outside:
        first, second, places = with_unmatched(len(sides[0].features), first, second)
    limits.budget().take(8 * 4 * len(first))

    def members(row: int) -> bytes:
        text = write_members(int(first[row]), int(second[row]))
        return text + more(int(places[row])) if more is not None and places[row] != NONE else text

    sizes = np.array([*map(len, geometries)], np.int64)[first] + n_bytes(first, second)
    offsets = read_only(np.arange(len(first) + 1))
    made = FeatureRows(members, offsets, summed(ROW + sizes), crs, geometry=lambda row: geometries[first[row]])
    return (made, limits.accuracy) if report else made
