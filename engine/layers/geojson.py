"""FeatureCollections of GeoJSON (RFC 7946) read: what a layer holds, and errors that name the feature at fault."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain
from typing import Any, Final

import numpy as np

from engine.arrays import FloatArray
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
from engine.layers.rows import Layer, Limits, layer_of
from engine.polygon_overlay.polygon_arrays import arrays_of
from engine.polygon_overlay.union_all import union_all
from engine.running.budget import polled
from engine.solids.checks import Where, as_points, shown
from engine.solids.polygon import Polygon
from engine.solids.ragged import summed

AREAS: Final = ("Polygon", "MultiPolygon")


@dataclass(frozen=True, slots=True, eq=False)
class Collection:
    """A FeatureCollection whose features are of one kind: the features, their properties (empty for null)."""

    features: list[dict[str, Any]]
    properties: list[dict[str, Any]]
    crs: Any
    where: Where


def collection_of(value: Any, where: Where, limits: Limits, kinds: tuple[str, ...] = AREAS) -> Collection:
    """Return a FeatureCollection whose features are of these kinds, or have null as geometry; coordinates unchecked."""
    features = value.get("features") if _type_of(value) == "FeatureCollection" else None
    if not isinstance(features, list):
        raise InvalidInputError(f"{where[0]} must be a GeoJSON FeatureCollection, got {shown(value)}", where)
    side = Collection(features, [], value.get("crs"), where)
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
    """Return the member `type` of a GeoJSON object; nothing if it has none."""
    kind = value.get("type") if isinstance(value, dict) else None
    return kind if isinstance(kind, str) else ""


def refused(
    kind: Callable[[str, Where], EngineError], side: Collection, number: int, what: str, path: Path = ()
) -> EngineError:
    """Return an error that names a feature by its number and id."""
    feature, where = side.features[number], side.where
    named = f" (id {shown(feature['id'])})" if "id" in feature else ""
    return kind(f"{where[0]}.features[{number}]{named} {what}", (*where, "features", number, *path))


def polygons_of(side: Collection, limits: Limits) -> Layer:
    """Return the polygons of a collection."""
    rings: list[Any] = []
    part_sizes: list[int] = []
    there = [k for k, feature in enumerate(side.features) if feature.get("geometry") is not None]
    is_missing = np.ones(len(side.features), np.bool_)
    is_missing[there] = False
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
            arrays = arrays_of(positions, *offsets)
        except (DeadlineExceededError, CancelledError):
            raise
        except (EngineError, TypeError, ValueError, KeyError):
            checked_each(there, side, _check_rings)
            raise
    return layer_of(arrays, summed(counts), is_missing, limits)


def _positions(rings: list[Any]) -> FloatArray:
    """Return the positions of rings, lists or arrays, one after another."""
    if not any(isinstance(ring, np.ndarray) for ring in rings):
        return as_points(list(chain.from_iterable(polled(rings))), 2)
    return np.concatenate([as_points(ring, 2) for ring in polled(rings)])


def _check_rings(geometry: dict[str, Any]) -> None:
    """Raise for the first fault of the coordinates of a Polygon or MultiPolygon."""
    coordinates = geometry["coordinates"]
    for part in [coordinates] if geometry["type"] == "Polygon" else polled(coordinates):
        for ring in polled(part):
            if len(as_points(ring, 2, ("its ring",))) == 1:
                raise RingTooShortError("a ring of one position; a ring needs 3", ())


def checked_each(there: list[int], side: Collection, check: Callable[[dict[str, Any]], Any]) -> Any:
    """Check geometries one by one; raise for the first at fault, naming its feature; else return all made."""
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
                "has positions of other than two numbers; layers are plane: leave the z out",
            )
        except EngineError as error:
            kind, what = type(error), f"is wrong: {error.message}"  # type: ignore[assignment]
        except (KeyError, TypeError, ValueError):
            kind, what = InvalidArrayError, "has coordinates that are no lists of positions"  # type: ignore[assignment]
        raise refused(kind, side, number, what)
    return np.array(made)


def polygon_of(geometry: Any) -> Polygon:
    """Return a GeoJSON Polygon or MultiPolygon as one polygon, parts that overlap united."""
    feature, limits = {"type": "Feature", "geometry": geometry}, Limits(None, None)
    side = collection_of({"type": "FeatureCollection", "features": [feature]}, ("geometry",), limits)
    return polygons_of(side, limits).arrays.polygon(0)


Polygon.geojson = polygon_of, lambda polygon: union_all([polygon]).__geo_interface__
