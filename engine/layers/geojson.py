"""Reads GeoJSON FeatureCollections (RFC 7946); errors name the feature at fault."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from typing import Any, Final, cast

import numpy as np

from engine.errors import (
    CancelledError,
    DeadlineExceededError,
    EngineError,
    InvalidArrayError,
    InvalidInputError,
    RingTooShortError,
    UnsupportedSolidError,
    WrongDimensionError,
)
from engine.layers.json_text import Path
from engine.layers.limits import Limits
from engine.layers.rows import Layer, layer_of
from engine.layers.shapes import LINE, POINT, MixedLayer, Paths
from engine.layers.wrapping import cut_parts
from engine.polygon_overlay.overlay import union_all
from engine.polygon_overlay.pair_arrays import PolygonArrays, arrays_of
from engine.running.budget import UNLIMITED, Budget, polled
from engine.solids.checks import Where, as_points, shown
from engine.solids.polygon import Polygon
from engine.solids.ragged import summed
from engine.types import BoolArray, FloatArray, IntArray, read_only

AREAS: Final = ("Polygon", "MultiPolygon")
POINTS: Final = ("Point", "MultiPoint")
LINES: Final = ("LineString", "MultiLineString")
EVERY: Final = (*POINTS, *LINES, *AREAS)


@dataclass(frozen=True, slots=True, eq=False)
class Collection:
    """A FeatureCollection whose geometries are of one kind: its features, the properties of each (empty for null), its
    `crs`, and the path of the argument, for messages. altitudes: of vertices, once they are read.
    start: of a part of a stream, the number of the features before it; kept: what was made of a collection that many
    calls share."""

    features: list[dict[str, Any]]
    properties: list[dict[str, Any]]
    crs: Any
    where: Where
    altitudes: list[FloatArray] = field(default_factory=lambda: [np.zeros((0, 4))])
    start: int | None = None
    kept: dict[Any, Any] = field(default_factory=dict)

    @property
    def known(self) -> FloatArray:
        """The vertices that have an altitude: feature, x, y, altitude."""
        return np.concatenate(self.altitudes)


def collection_of(
    value: Any, where: Where, limits: Limits, kinds: tuple[str, ...] = AREAS, start: int | None = None
) -> Collection:
    """Return a checked FeatureCollection whose geometries are null or of the types `kinds`; coordinates are not
    checked; a `Collection` as it is. where: path of the argument, for messages."""
    if isinstance(value, Collection):
        return value
    features = value.get("features") if _type_of(value) == "FeatureCollection" else None
    if not isinstance(features, list):
        raise InvalidInputError(f"{where[0]} must be a GeoJSON FeatureCollection, got {shown(value)}", where)
    side = Collection(features, [], value.get("crs"), where, start=start)
    with limits.budget():
        for number, feature in enumerate(polled(features)):
            if _type_of(feature) != "Feature":
                raise InvalidInputError(f"{where[0]}.features[{number}] is no Feature", (*where, "features", number))
            geometry, properties = feature.get("geometry"), feature.get("properties")
            if geometry is not None and (kind := _type_of(geometry)) not in kinds:
                got = kind or shown(geometry)
                raise refused(UnsupportedSolidError, side, number, f"is {got:.60}, not {' or '.join(kinds)}")
            if properties is not None and not (
                isinstance(properties, dict) and all(isinstance(name, str) for name in properties)
            ):
                what = "has properties that are no object whose names are text"
                raise refused(InvalidInputError, side, number, what)
            side.properties.append(properties or {})
    return side


def _type_of(value: Any) -> str:
    """Return the member `type` of a GeoJSON object, "" if there is none."""
    kind = value.get("type") if isinstance(value, dict) else None
    return kind if isinstance(kind, str) else ""


def refused(
    kind: Callable[[str, Where], EngineError], side: Collection, number: int, what: str, path: Path = ()
) -> EngineError:
    """Return an error of type `kind` for feature `number` of a layer, with its number and id in the message and in
    `where`. what: the fault; path: its place in the feature."""
    feature, where = side.features[number], side.where
    number += side.start or 0
    named = f" (id {shown(feature['id'])})" if "id" in feature else ""
    return kind(f"{where[0]}.features[{number}]{named} {what}", (*where, "features", number, *path))


def polygons_of(side: Collection, limits: Limits) -> Layer:
    """Return the polygons of a collection as a `Layer`; overlapping parts of a feature are united."""
    with limits.budget():
        parts, offsets, is_missing = _parts_of(side, limits)
        cut = cut_parts(parts, offsets, side.crs is None, limits, partial(refused, InvalidInputError, side))
        return layer_of(*cut, is_missing, limits)


def mixed_of(side: Collection, limits: Limits) -> MixedLayer:
    """Return the points, lines and polygons of a collection."""
    if "mixed" in side.kept:
        return cast(MixedLayer, side.kept["mixed"])
    n = len(side.features)
    dims, counts, sizes, positions = np.full(n, -1, np.int8), np.zeros(n, np.int64), list[int](), list[FloatArray]()
    with limits.budget():
        single = _single_points(side)
        for number in polled(range(n)):
            geometry = side.features[number].get("geometry")
            if geometry is not None and geometry["type"] not in AREAS:
                paths = single.get(number) or check_each([number], side, _paths_in, is_array=False)[0]
                counts[number] = len(paths)
                sizes += map(len, paths)
                positions += [path[:, :2] for path in paths]
                side.altitudes.extend(_known(number, path) for path in paths if path.shape[1] == 3)
                dims[number] = (POINT if geometry["type"] in POINTS else LINE) if paths else -1
    vertices = np.concatenate([np.zeros((0, 2)), *positions])
    made = side.kept["mixed"] = MixedLayer(
        polygons_of(side, limits), Paths(dims, read_only(vertices), summed(sizes), summed(counts))
    )
    return made


def _single_points(side: Collection) -> dict[int, list[FloatArray]]:
    """Return the positions of the Points of a collection, read together; none if one of them is wrong."""
    geometries = (feature.get("geometry") or {} for feature in side.features)
    places = {k: each.get("coordinates") for k, each in enumerate(polled(geometries)) if each.get("type") == "Point"}
    there = {k: place for k, place in places.items() if isinstance(place, list) and place}
    try:
        positions = _positions([list(there.values())])
    except (DeadlineExceededError, CancelledError):
        raise
    except (EngineError, TypeError, ValueError):
        return {}
    return {k: [positions[row : row + 1]] for row, k in enumerate(polled(there))}


def _paths_in(geometry: dict[str, Any]) -> list[FloatArray]:
    """Return the positions of each point or line of a geometry."""
    kind, given = geometry["type"], geometry["coordinates"]
    if kind in POINTS:
        return [_positions([[place]]) for place in ([given] if kind == "Point" and len(given) else given)]
    lines = [_positions([line]) for line in ([given] if kind == "LineString" else given) if len(line)]
    for line in lines:
        if len(line) == 1:
            raise InvalidArrayError("a line of one position; a line needs 2", ())
    return lines


def _parts_of(side: Collection, limits: Limits) -> tuple[PolygonArrays, IntArray, BoolArray]:
    """Return (arrays, offsets, is_missing): all parts (Polygons) of all features as polygons, the offsets (n + 1,) of
    each feature's parts, and (n,) whether a feature has no geometry."""
    rings: list[Any] = []
    part_sizes: list[int] = []
    geometries = [feature.get("geometry") for feature in side.features]
    there = [k for k, geometry in enumerate(geometries) if geometry is not None and geometry["type"] in AREAS]
    is_missing = np.array([geometry is None for geometry in geometries], np.bool_)
    counts = np.zeros(len(side.features), np.int64)
    with limits.budget():
        try:
            for number in polled(there):
                geometry = side.features[number]["geometry"]
                parts = geometry["coordinates"]
                parts = [parts] if geometry["type"] == "Polygon" and len(parts) else parts
                counts[number] = len(parts)
                for part in polled(parts):
                    part_sizes.append(len(part))
                    rings.extend(part)
            positions = _positions(rings)
            offsets = summed(np.fromiter(map(len, polled(rings)), np.int64)), summed(part_sizes)
            if positions.shape[1] == 3:
                owners = np.repeat(np.repeat(np.arange(len(counts)), counts), np.diff(offsets[0][offsets[1]]))
                side.altitudes.append(_known(owners, positions))
            arrays = arrays_of(np.ascontiguousarray(positions[:, :2]), *offsets)
        except (DeadlineExceededError, CancelledError):
            raise
        except (EngineError, TypeError, ValueError, KeyError):
            check_each(there, side, _check_rings)
            raise
    return arrays, summed(counts), is_missing


def _positions(rings: list[Any]) -> FloatArray:
    """Return the positions of all rings, one after another, in one array (n, 2), or (n, 3) where some have an altitude,
    NaN for others."""
    if not any(isinstance(ring, np.ndarray) for ring in rings):
        places = list(chain.from_iterable(polled(rings)))
        has_altitude = np.fromiter(map(len, places), np.int64) == 3 if places else np.zeros(0, np.bool_)
        if not has_altitude.any():
            return as_points(places, 2)
        made = as_points([place if len(place) == 3 else [*place, 0.0] for place in polled(places)], 3)
        return np.where(has_altitude[:, None] | (np.arange(3) < 2), made, np.nan)
    parts = [_positions([ring.tolist()]) if isinstance(ring, np.ndarray) and ring.ndim == 2 and ring.shape[1] == 3
             else as_points(ring, 2) for ring in polled(rings)]  # fmt: skip
    if any(part.shape[1] == 3 for part in parts):
        parts = [part if part.shape[1] == 3 else np.insert(part, 2, np.nan, axis=1) for part in parts]
    return np.concatenate(parts)


def _known(owners: Any, positions: FloatArray) -> FloatArray:
    """Return positions (n, 3) as rows (feature, x, y, altitude)."""
    return np.insert(positions, 0, owners, axis=1)


def _check_rings(geometry: dict[str, Any]) -> None:
    """Raise for the first error in the coordinates of a Polygon or MultiPolygon."""
    coordinates = geometry["coordinates"]
    for part in [coordinates] if geometry["type"] == "Polygon" else polled(coordinates):
        for ring in polled(part):
            if len(_positions([ring])) == 1:
                raise RingTooShortError("a ring of one position; a ring needs 3", ())


def check_each(
    there: list[int], side: Collection, check: Callable[[dict[str, Any]], Any], is_array: bool = True
) -> Any:
    """Return the array, or the list, of check(geometry) for the features of a layer at the indices `there`; an error
    names its feature."""
    made = []
    for number in polled(there):
        try:
            made.append(check(side.features[number]["geometry"]))
            continue
        except (DeadlineExceededError, CancelledError):
            raise
        except WrongDimensionError:
            kind, what = (
                WrongDimensionError,
                "has positions of other than two numbers, or three with an altitude",
            )
        except EngineError as error:
            kind, what = type(error), f"is wrong: {error.message}"  # type: ignore[assignment]
        except (KeyError, TypeError, ValueError):
            kind, what = InvalidArrayError, "has coordinates that are no lists of positions"  # type: ignore[assignment]
        raise refused(kind, side, number, what)
    return np.array(made) if is_array else made


def polygon_of(geometry: Any) -> Polygon:
    """Return a GeoJSON Polygon or MultiPolygon as one polygon, its parts united.

    Parameters
    ----------
    geometry : dict or object with `__geo_interface__`
        A Polygon or MultiPolygon.

    Returns
    -------
    Polygon
        Even-odd over all rings.

    Raises
    ------
    UnsupportedSolidError, InvalidArrayError, WrongDimensionError, NotFiniteError, RingTooShortError
        For another geometry or coordinates that break a rule.

    Notes
    -----
    Boundary, accuracy: several parts are united as by `engine.union_all`, whose crossings are rounded; walls that parts
    share vanish.

    References
    ----------
    RFC 7946 (GeoJSON).

    Examples
    --------
    >>> from engine import layers
    >>> layers.polygon_of({"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [0, 1], [0, 0]]]})
    Polygon(1 rings, 3 vertices)
    """
    return _polygon_of(geometry, UNLIMITED)


def _polygon_of(geometry: Any, budget: Budget) -> Polygon:
    """Do the work of `polygon_of` within a budget."""
    feature, limits = {"type": "Feature", "geometry": geometry}, Limits(budget.left(), budget.cancel)
    side = collection_of({"type": "FeatureCollection", "features": [feature]}, ("geometry",), limits)
    parts, offsets, _ = _parts_of(side, limits)
    polygons = [parts.polygon(k) for k in range(int(offsets[-1]))]
    if len(polygons) == 1:
        return polygons[0]
    return Polygon(union_all(polygons, deadline=budget.left(), cancel=budget.cancel).rings)


Polygon.geojson = _polygon_of, lambda polygon: union_all([polygon]).__geo_interface__
