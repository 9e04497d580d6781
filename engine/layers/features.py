"""Layers as GeoJSON (RFC 7946): FeatureCollections in, features out; what HTTP and the command line speak.

What a feature holds beside its geometry goes through untouched: properties, id, the `crs`. A row that comes
from features of both layers has the properties of both, names that both layers have with _1 and _2, as geopandas names
them; `left` and `right` say which features these were.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain, pairwise
from typing import Any, Final

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.budget import Cancel
from engine.errors import (
    EngineError,
    InvalidArrayError,
    InvalidInputError,
    NotFiniteError,
    RingTooShortError,
    UnsupportedSolidError,
    WrongDimensionError,
)
from engine.layers.rows import NONE, Layer, LayerRows, Limits, dissolved, held, layer_of, overlay_rows, with_alone
from engine.parallel import check_options
from engine.polygon_overlay.polygon_arrays import arrays_of
from engine.polygon_overlay.union_all import union_all
from engine.solids.checks import Where, as_points, shown
from engine.solids.polygon import Polygon
from engine.types import Accuracy

AREAS: Final = ("Polygon", "MultiPolygon")
_CHECKED: Final = 1000
"""Features read between two looks at the clock."""


@dataclass(frozen=True, slots=True, eq=False)
class FeatureRows:
    """Features of an answer, made when asked for: ``len``, ``some(start, stop)``; and the collection's `crs`, if any.

    offsets: (n + 1,) how many vertices stand before each feature. collapsed: rows that rounding left nothing of.
    """

    make: Callable[[int, int], list[dict[str, Any]]]
    offsets: IntArray
    crs: Any
    collapsed: int = 0

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __iter__(self) -> Iterator[dict[str, Any]]:
        for start in range(0, len(self), _CHECKED):
            yield from self.make(start, min(len(self), start + _CHECKED))


Answer = FeatureRows | tuple[FeatureRows, Accuracy]


@dataclass(frozen=True, slots=True, eq=False)
class _Collection:
    """A FeatureCollection whose features are of one kind: the features, their properties (empty for null)."""

    features: list[dict[str, Any]]
    properties: list[dict[str, Any]]
    crs: Any


def overlay_features(
    left: Any,
    right: Any,
    how: str = "intersection",
    *,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: bool = False,
) -> Answer:
    """Overlay two FeatureCollections of polygons; rows and options as `engine.layers.overlay` on GeoDataFrames.

    Features with null geometry are kept with their properties where what is left of their layer is asked for.
    Raises: as there, with the path to what is at fault, and its id.
    """
    check_options(None, None, report=report)
    limits = Limits(deadline, cancel)
    sides = [_collection(value, (name,)) for value, name in ((left, "left"), (right, "right"))]
    crs = [side.crs for side in sides if side.crs is not None]
    if len(crs) == 2 and _key(crs[0], "crs") != _key(crs[1], "crs"):
        raise InvalidInputError("the crs of left and right differ; bring both layers into one", ("right", "crs"))
    layers = [_layer(side, (name,), limits) for side, name in zip(sides, ("left", "right"))]
    rows = overlay_rows(layers[0], layers[1], how, limits)
    told = _told(sides[0], sides[1], ("left", "right"))
    made = _with_geometry(rows, lambda row: told(int(rows.left[row]), int(rows.right[row])), crs[0] if crs else None)
    return (made, limits.accuracy) if report else made


def dissolve_features(
    layer: Any,
    by: list[str] | None = None,
    *,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: bool = False,
) -> Answer:
    """Unite the features of a FeatureCollection that agree in the properties `by`; all of them by default.

    Groups stand in the order of their first features. Properties: those of `by`, and `count`, the features united.
    """
    check_options(None, None, report=report)
    limits = Limits(deadline, cancel)
    side = _collection(layer, ("layer",))
    names = _checked_names(by)
    keys = [_key([each.get(name) for name in names], "by") for each in side.properties]
    order = {key: k for k, key in enumerate(dict.fromkeys(keys if names else ["[]"]))}
    groups = np.array([order[key] for key in keys], np.int64)
    rows = dissolved(_layer(side, ("layer",), limits), groups, len(order), limits)
    counts = np.bincount(groups, minlength=len(rows)).tolist()
    values = [json.loads(key) for key in order]

    def told(row: int) -> dict[str, Any]:
        return {"properties": {**dict(zip(names, values[row])), "count": counts[row]}}

    made = _with_geometry(rows, told, side.crs)
    return (made, limits.accuracy) if report else made


def _checked_names(by: Any) -> list[str]:
    names = [] if by is None else by
    if not isinstance(names, (list, tuple)) or not all(isinstance(name, str) for name in names):
        raise InvalidInputError(f"by must be a list of names of properties, got {shown(by)}", ("by",))
    if "count" in names:
        raise InvalidInputError("count is how many features were united; give that property another name", ("by",))
    return list(names)


def locate_features(
    points: Any,
    polygons: Any,
    *,
    outside: bool = False,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: bool = False,
) -> Answer:
    """Join each Point to the polygons that hold it, boundary included: a row each, with `boundary`, and properties of
    both; outside: also a row for a point that nothing holds."""
    check_options(None, None, report=report, outside=outside)
    limits = Limits(deadline, cancel)
    sides = _collection(points, ("points",), ("Point",)), _collection(polygons, ("polygons",))
    there = [k for k, each in enumerate(sides[0].features) if each.get("geometry") is not None]
    places = [sides[0].features[k]["geometry"].get("coordinates") for k in there]
    try:
        positions = as_points(places, 2, ("points",))
    except EngineError:
        positions = _named(there, sides[0], ("points",), lambda each: as_points([each["coordinates"]], 2)[0])
    layer = _layer(sides[1], ("polygons",), limits)
    first, second, on_boundary = held(positions, layer, limits)
    first = np.array(there, np.int64)[first]
    if outside:
        first, second, on_boundary = with_alone(len(sides[0].features), first, second, on_boundary)
    told = _told(*sides, ("point", "polygon"))

    def some(start: int, stop: int) -> list[dict[str, Any]]:
        found = []
        for one, other, boundary in zip(*(each[start:stop].tolist() for each in (first, second, on_boundary))):
            more = {"boundary": bool(boundary)} if other != NONE else {}
            row = {"type": "Feature", **told(one, other), **more, "geometry": sides[0].features[one].get("geometry")}
            found.append(row)
        return found

    made = FeatureRows(some, 10 * np.arange(len(first) + 1), sides[0].crs)
    return (made, limits.accuracy) if report else made


def _told(left: _Collection, right: _Collection, names: tuple[str, str]) -> Callable[[int, int], dict[str, Any]]:
    """Return what makes the members beside type and geometry of a row from both features' numbers, -1 for none."""
    columns = [{*chain.from_iterable(side.properties)} for side in (left, right)]
    shared = columns[0] & columns[1]
    made = [name + end * (name in shared) for column, end in zip(columns, ("_1", "_2")) for name in column]
    if len({*made}) < len(made):
        twice = min(name for name in made if made.count(name) > 1)
        raise InvalidInputError(
            f"two properties would be named {twice!r}, as names that both layers have get _1 and _2; rename one", ()
        )

    def renamed(side: _Collection, suffix: str) -> list[dict[str, Any]]:
        if not shared:
            return side.properties
        return [{name + suffix * (name in shared): value for name, value in each.items()} for each in side.properties]

    sides = (left, renamed(left, "_1")), (right, renamed(right, "_2"))

    def told(*numbers: int) -> dict[str, Any]:
        properties: dict[str, Any] = {}
        sources: dict[str, Any] = {}
        for name, number, (side, texts) in zip(names, numbers, sides):
            if number != NONE:
                properties |= texts[number]
                sources[name] = {"index": number, **_id_of(side.features[number])}
        alone = next(iter(sources.values())) if len(sources) == 1 else {}
        return {**_id_of(alone), "properties": properties, **sources}

    return told


def _id_of(feature: dict[str, Any]) -> dict[str, Any]:
    return {"id": feature["id"]} if "id" in feature else {}


def _with_geometry(rows: LayerRows, told: Callable[[int], dict[str, Any]], crs: Any) -> FeatureRows:
    """Return features of rows: told gives their other members."""
    positions, (rings, pieces, ends) = rows.ragged

    def some(start: int, stop: int) -> list[dict[str, Any]]:
        found = []
        for row in range(start, stop):
            parts = [
                [positions[i:j] for i, j in pairwise(rings[first : last + 1].tolist())]
                for first, last in pairwise(pieces[ends[row] : ends[row + 1] + 1].tolist())
            ]
            geometry: dict[str, Any] | None = None
            if parts:
                kind, coordinates = ("Polygon", parts[0]) if len(parts) == 1 else ("MultiPolygon", parts)
                geometry = {"type": kind, "coordinates": coordinates}
            found.append({"type": "Feature", **told(row), "geometry": geometry})
        return found

    return FeatureRows(some, rings[pieces[ends]], crs, rows.n_collapsed)


def _collection(value: Any, where: Where, kinds: tuple[str, ...] = AREAS) -> _Collection:
    """Return a FeatureCollection whose features are of these kinds, or have null as geometry; coordinates unchecked."""
    features = value.get("features") if _type_of(value) == "FeatureCollection" else None
    if not isinstance(features, list):
        raise InvalidInputError(f"{where[0]} must be a GeoJSON FeatureCollection, got {shown(value)}", where)
    for number, feature in enumerate(features):
        if _type_of(feature) != "Feature":
            raise InvalidInputError(f"{where[0]}.features[{number}] is no Feature", (*where, "features", number))
        geometry, properties = feature.get("geometry"), feature.get("properties")
        if geometry is not None and (kind := _type_of(geometry)) not in kinds:
            got = kind or shown(geometry)
            raise _refused(UnsupportedSolidError, feature, number, where, f"is {got:.60}, not {' or '.join(kinds)}")
        if properties is not None and not (
            isinstance(properties, dict) and all(isinstance(name, str) for name in properties)
        ):
            what = "has properties that are no object whose names are text"
            raise _refused(InvalidInputError, feature, number, where, what)
    properties_of = [feature.get("properties") or {} for feature in features]
    try:
        json.dumps(properties_of, allow_nan=False, default=_listed)
    except (ValueError, TypeError):
        for number, each in enumerate(properties_of):
            try:
                json.dumps(each, allow_nan=False, default=_listed)
            except ValueError:
                what = "has a property that is infinite or NaN, which JSON cannot hold"
                raise _refused(NotFiniteError, features[number], number, where, what) from None
            except TypeError as error:
                what = f"has a property that JSON cannot hold: {error}"
                raise _refused(InvalidInputError, features[number], number, where, what) from None
    return _Collection(features, properties_of, value.get("crs"))


def _type_of(value: Any) -> str:
    """Return the member `type` of a GeoJSON object; nothing if it has none."""
    kind = value.get("type") if isinstance(value, dict) else None
    return kind if isinstance(kind, str) else ""


def _key(value: Any, name: str) -> str:
    """Return a text that is one for equal JSON values."""
    try:
        return json.dumps(value, sort_keys=True, default=_listed)
    except TypeError as error:
        raise InvalidInputError(f"{name} compares a value that JSON cannot hold: {error}", (name,)) from None


def _listed(value: Any) -> Any:
    """Return a list of numbers that was read as an array."""
    if not isinstance(value, (np.ndarray, np.generic)):
        raise TypeError(f"it is of type {type(value).__name__}")
    return value.tolist()


def _refused(
    kind: Callable[[str, Where], EngineError], feature: dict[str, Any], number: int, where: Where, what: str
) -> EngineError:
    """Return an error that names a feature by its number and id."""
    named = f" (id {shown(feature['id'])})" if "id" in feature else ""
    return kind(f"{where[0]}.features[{number}]{named} {what}", (*where, "features", number))


def _layer(side: _Collection, where: Where, limits: Limits) -> Layer:
    """Return the polygons of a collection."""
    rings: list[Any] = []
    part_sizes: list[int] = []
    there = [k for k, feature in enumerate(side.features) if feature.get("geometry") is not None]
    is_missing = np.ones(len(side.features), np.bool_)
    is_missing[there] = False
    try:
        counts = np.zeros(len(side.features), np.int64)
        with limits.budget() as budget:
            for place, number in enumerate(there):
                if place % _CHECKED == 0:
                    budget.check()
                geometry = side.features[number]["geometry"]
                parts = geometry["coordinates"]
                parts = [parts] if geometry["type"] == "Polygon" and len(parts) else parts
                counts[number] = len(parts)
                for part in parts:
                    part_sizes.append(len(part))
                    rings.extend(part)
            budget.check()
        positions = _positions(rings)
        offsets = (np.cumsum([0, *each]) for each in (map(len, rings), part_sizes))
        arrays = arrays_of(positions, *offsets)
    except (EngineError, TypeError, ValueError, KeyError) as error:
        if isinstance(error, EngineError) and error.code in ("deadline_exceeded", "cancelled"):
            raise
        _named(there, side, where, _check_rings)
        raise
    return layer_of(arrays, np.append(0, np.cumsum(counts)), is_missing, limits)


def _positions(rings: list[Any]) -> FloatArray:
    """Return the positions of rings, lists or arrays, one after another."""
    if not any(isinstance(ring, np.ndarray) for ring in rings):
        return as_points(list(chain.from_iterable(rings)), 2)
    return np.concatenate([as_points(ring, 2) for ring in rings])


def _check_rings(geometry: dict[str, Any]) -> None:
    """Raise for the first fault of the coordinates of a Polygon or MultiPolygon."""
    coordinates = geometry["coordinates"]
    for part in [coordinates] if geometry["type"] == "Polygon" else coordinates:
        for ring in part:
            if len(as_points(ring, 2, ("its ring",))) == 1:
                raise RingTooShortError("a ring of one position; a ring needs 3", ())


def _named(there: list[int], side: _Collection, where: Where, check: Callable[[dict[str, Any]], Any]) -> Any:
    """Check geometries one by one; raise for the first at fault, naming its feature; else return all made."""
    made = []
    for number in there:
        feature = side.features[number]
        try:
            made.append(check(feature["geometry"]))
            continue
        except WrongDimensionError:
            kind, what = (
                WrongDimensionError,
                "has positions of other than two numbers; layers are plane: leave the z out",
            )
        except EngineError as error:
            kind, what = type(error), f"is wrong: {error.message}"  # type: ignore[assignment]
        except (KeyError, TypeError, ValueError):
            kind, what = InvalidArrayError, "has coordinates that are no lists of positions"  # type: ignore[assignment]
        raise _refused(kind, feature, number, where, what)
    return np.array(made)


def polygon_of(geometry: Any) -> Polygon:
    """Return a GeoJSON Polygon or MultiPolygon as one polygon, parts that overlap united."""
    feature = {"type": "Feature", "geometry": geometry}
    side = _collection({"type": "FeatureCollection", "features": [feature]}, ("geometry",))
    return _layer(side, ("geometry",), Limits(None, None)).arrays.polygon(0)


Polygon.geojson = polygon_of, lambda polygon: union_all([polygon]).__geo_interface__
