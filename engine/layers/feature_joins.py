"""Joins of layers as GeoJSON, for HTTP and the command line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, Unpack, overload

import numpy as np

from engine.distance.clearance import checked_distance
from engine.errors import CancelledError, DeadlineExceededError, EngineError
from engine.layers.feature_rows import ROW, FeatureRows
from engine.layers.features import Answer
from engine.layers.geojson import EVERY, Collection, check_each, collection_of, mixed_of, polygons_of
from engine.layers.joins import check_predicate, nearest_of, related_pairs
from engine.layers.json_text import text_of
from engine.layers.limits import Limits, TimeOptions
from engine.layers.members import crs_of, members_of, texts_of
from engine.layers.rows import NONE, locate_points_in_layer, with_unmatched
from engine.running.budget import Cancel
from engine.running.parallel import check_options
from engine.solids.checks import as_points
from engine.solids.ragged import summed
from engine.types import Accuracy, IntArray, read_only


@overload
def join_features(
    left: Any,
    right: Any,
    predicate: str = "intersects",
    *,
    distance: float | None = None,
    outside: bool = False,
    report: Literal[False] = False,
    **options: Unpack[TimeOptions],
) -> FeatureRows: ...
@overload
def join_features(
    left: Any,
    right: Any,
    predicate: str = "intersects",
    *,
    distance: float | None = None,
    outside: bool = False,
    report: Literal[True],
    **options: Unpack[TimeOptions],
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
    >>> from engine import layers, read_layer
    >>> triangle = read_layer(b'{"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [0, 2], [0, 0]]]}')
    >>> line = read_layer(b'{"type": "LineString", "coordinates": [[0, 1], [9, 1]]}')
    >>> len(layers.join_features(line, triangle, "crosses"))
    1
    """
    check_options(None, None, report=report, outside=outside)
    reach, limits = check_predicate(predicate, distance), Limits(deadline, cancel)
    sides = [collection_of(left, ("left",), limits, EVERY), collection_of(right, ("right",), limits, EVERY)]
    write = _writer(sides, ("left", "right"), limits)
    layers = [mixed_of(side, limits) for side in sides]
    made = write(related_pairs(layers[0], layers[1], predicate, reach, limits), outside, None)
    return (made, limits.accuracy) if report else made


@overload
def nearest_features(
    left: Any, right: Any, *, max_distance: float | None = None, exclusive: bool = False, outside: bool = False,
    report: Literal[False] = False, **options: Unpack[TimeOptions],
) -> FeatureRows: ...  # fmt: skip
@overload
def nearest_features(
    left: Any, right: Any, *, max_distance: float | None = None, exclusive: bool = False, outside: bool = False,
    report: Literal[True], **options: Unpack[TimeOptions],
) -> tuple[FeatureRows, Accuracy]: ...  # fmt: skip
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
    outside : bool, default False
        Also a row for each left feature without one.
    deadline, cancel, report
        As for `engine.locate`.

    Returns
    -------
    FeatureRows
        A row for each pair, with the left geometry, the properties of both, and the member `distance`. With
        ``report=True`` a pair of it and an `Accuracy`.

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
    write = _writer(sides, ("left", "right"), limits)
    layers = [mixed_of(side, limits) for side in sides]
    pairs, distances = nearest_of(layers[0], layers[1], most, bool(exclusive), limits)
    made = write(pairs, outside, lambda pair: b',"distance":%b' % text_of(float(distances[pair])))
    return (made, limits.accuracy) if report else made


@overload
def locate_features(
    points: Any, polygons: Any, *, outside: bool = False, report: Literal[False] = False, **options: Unpack[TimeOptions]
) -> FeatureRows: ...
@overload
def locate_features(
    points: Any, polygons: Any, *, outside: bool = False, report: Literal[True], **options: Unpack[TimeOptions]
) -> tuple[FeatureRows, Accuracy]: ...
def locate_features(
    points: Any, polygons: Any, *, outside: bool = False, deadline: float | None = None, cancel: Cancel | None = None,
    report: bool = False,
) -> Answer:  # fmt: skip
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
    >>> from engine import layers, read_layer
    >>> triangle = read_layer(b'{"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [0, 2], [0, 0]]]}')
    >>> len(layers.locate_features(read_layer(b'{"type": "Point", "coordinates": [1, 1]}'), triangle))
    1
    """
    check_options(None, None, report=report, outside=outside)
    limits = Limits(deadline, cancel)
    sides = [collection_of(points, ("points",), limits, ("Point",)), collection_of(polygons, ("polygons",), limits)]
    there = [k for k, each in enumerate(sides[0].features) if each.get("geometry") is not None]
    places = [sides[0].features[k]["geometry"].get("coordinates") for k in there]
    with limits.budget():
        try:
            positions = as_points(places, 2, ("points",))
        except (DeadlineExceededError, CancelledError):
            raise
        except EngineError:
            positions = check_each(there, sides[0], lambda each: as_points([each["coordinates"]], 2)[0])
    write = _writer(sides, ("point", "polygon"), limits)
    first, second, on_boundary = locate_points_in_layer(positions, polygons_of(sides[1], limits), limits)
    words = (b',"boundary":false', b',"boundary":true')
    pairs = np.column_stack([np.array(there, np.int64)[first], second])
    made = write(pairs, outside, lambda pair: words[int(on_boundary[pair])])
    return (made, limits.accuracy) if report else made


def _writer(
    sides: list[Collection], names: tuple[str, str], limits: Limits
) -> Callable[[IntArray, bool, Callable[[int], bytes] | None], FeatureRows]:
    """Return a function that makes the rows of a join: of pairs (n, 2) of features, with the geometry and the members
    of the first; outside: also a row for each first feature without one; more: further members of a pair, as JSON."""
    crs = crs_of(sides if names[0] == "left" else sides[:1], limits)
    geometries = texts_of(sides[0], (each.get("geometry") for each in sides[0].features), "geometry", limits)
    write_members, n_bytes = members_of(sides, names, limits)

    def write(pairs: IntArray, outside: bool, more: Callable[[int], bytes] | None) -> FeatureRows:
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
        return FeatureRows(members, offsets, summed(ROW + sizes), crs, geometry=lambda row: geometries[first[row]])

    return write
