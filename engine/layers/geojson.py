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
from engine.layers.rows import layer_of
from engine.layers.shapes import AREA, LINE, POINT, MixedLayer, Paths
from engine.layers.wrapping import cut_parts
from engine.polygon_overlay.overlay import union_all
from engine.polygon_overlay.pair_arrays import PolygonArrays, arrays_of
from engine.running.budget import UNLIMITED, Budget, polled
from engine.solids.checks import Where, as_points, shown
from engine.solids.polygon import Polygon
from engine.solids.ragged import summed
from engine.types import FloatArray, Int8Array, IntArray, read_only

AREAS: Final = ("Polygon", "MultiPolygon")
POINTS: Final = ("Point", "MultiPoint")
LINES: Final = ("LineString", "MultiLineString")
EVERY: Final = (*POINTS, *LINES, *AREAS)
_DIMS: Final = dict(zip(EVERY, (POINT, POINT, LINE, LINE, AREA, AREA)))
_PARTS: Final[dict[str, Callable[[Any], Any]]] = {
    "Point": lambda at: [[[at]]], "MultiPoint": lambda at: [[at]], "LineString": lambda at: [[at]],
    "MultiLineString": lambda at: [[line] for line in at if len(line)], "Polygon": lambda at: [at],
    "MultiPolygon": lambda at: at,
}  # fmt: skip
"""By type, its coordinates as parts, each a list of rings; the positions of points, and a line, are a ring."""


@dataclass(frozen=True, slots=True, eq=False)
class Collection:
    """A FeatureCollection as it came: its features, the properties of each (empty for null), its `crs`, and the path of
    the argument, for messages. start: of a part of a stream, the number of features before it. kept: what was computed
    from a collection that several calls use, by name."""

    features: list[dict[str, Any]]
    properties: list[dict[str, Any]]
    crs: Any
    where: Where
    start: int | None = None
    kept: dict[Any, Any] = field(default_factory=dict)

    @property
    def known(self) -> FloatArray:
        """The vertices with altitude, (m, 4): feature, x, y, altitude; (0, 4) if there are none or coordinates have not
        been read."""
        return cast(FloatArray, self.kept.get("known", np.zeros((0, 4))))


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


def mixed_of(side: Collection, limits: Limits) -> MixedLayer:
    """Return the points, lines and polygons of a collection; overlapping parts of a feature are united."""
    if "mixed" in side.kept:
        return cast(MixedLayer, side.kept["mixed"])
    dims, parts, counts = _parts_of(side, limits)
    n = len(dims)
    of_parts = np.repeat(np.arange(n), counts)
    of_rings = np.repeat(of_parts, np.diff(parts.polygon_offsets))
    of_vertices = np.repeat(of_rings, np.diff(parts.ring_offsets))
    if parts.vertices.shape[1] == 3:
        side.kept["known"] = np.column_stack([of_vertices, parts.vertices])
    at = np.ascontiguousarray(parts.vertices[:, :2])
    is_path = dims[of_rings] < AREA
    sizes = np.diff(parts.ring_offsets)
    is_point = dims[of_rings] == POINT
    lengths = np.where(is_point, 1, sizes)[np.repeat(np.arange(len(sizes)), np.where(is_point, sizes, is_path))]
    paths = Paths(
        np.where((dims < AREA) & (counts > 0), dims, -1).astype(np.int8), read_only(at[dims[of_vertices] < AREA] + 0.0),
        summed(lengths), summed(np.bincount(of_rings, np.where(is_point, sizes, is_path), n).astype(np.int64)),
    )  # fmt: skip
    is_area = dims[of_parts] == AREA
    rings, offsets = summed(sizes[~is_path]), summed(np.diff(parts.polygon_offsets)[is_area])
    areas, counts = arrays_of(at[dims[of_vertices] == AREA], rings, offsets), np.where(dims == AREA, counts, 0)
    with limits.budget():
        cut = cut_parts(areas, summed(counts), side.crs is None, limits, partial(refused, InvalidInputError, side))
        layer = layer_of(*cut, dims < POINT, limits)
    made = side.kept["mixed"] = MixedLayer(layer, paths)
    return made


def _parts_of(side: Collection, limits: Limits) -> tuple[Int8Array, PolygonArrays, IntArray]:
    """Return the dimension of each feature, -1 without geometry; the parts of all, which may have altitudes, as
    polygons: the positions of points, and a line, are a ring; and the number of parts of each feature."""
    kinds = [(feature.get("geometry") or {}).get("type", "") for feature in side.features]
    dims = np.array([_DIMS.get(kind, -1) for kind in kinds], np.int8)
    numbers = np.flatnonzero(dims >= 0)
    with limits.budget():
        try:
            rings, part_sizes, sizes = _rings_of(side, numbers.tolist())
            lengths = summed(np.fromiter(map(len, polled(rings)), np.int64))
            parts = PolygonArrays(_positions(rings), lengths, summed(part_sizes))
        except (DeadlineExceededError, CancelledError):
            raise
        except (EngineError, TypeError, ValueError, KeyError):
            for number in polled(numbers.tolist()):
                _check(side, number)
            raise
    counts = np.zeros(len(dims), np.int64)
    counts[numbers] = sizes
    of_rings = np.repeat(np.repeat(np.arange(len(dims)), counts), np.diff(parts.polygon_offsets))
    if len(short := np.flatnonzero((np.diff(parts.ring_offsets) == 1) & (dims[of_rings] > POINT))):
        number = int(of_rings[short[0]])
        if dims[number] == LINE:
            raise refused(InvalidArrayError, side, number, "is wrong: a line of one position; a line needs 2")
        raise refused(RingTooShortError, side, number, "is wrong: a ring of one position; a ring needs 3")
    has_shell = np.append(np.diff(parts.ring_offsets), 0)[parts.polygon_offsets[:-1]] > 0
    if len(alone := np.flatnonzero(~has_shell & (parts.sizes() > 0))):
        number = int(np.repeat(np.arange(len(dims)), counts)[alone[0]])
        raise refused(RingTooShortError, side, number, "is wrong: a shell without positions that has holes")
    return dims, parts, counts


def _rings_of(side: Collection, numbers: list[int]) -> tuple[list[Any], list[int], list[int]]:
    """Return the rings of some features, the number of rings of each part, and the number of parts of each feature."""
    rings, part_sizes, counts = list[Any](), list[int](), list[int]()
    for number in polled(numbers):
        geometry = side.features[number]["geometry"]
        given = geometry["coordinates"]
        parts = _PARTS[geometry["type"]](given) if len(given) else []
        counts.append(len(parts))
        for part in polled(parts):
            part_sizes.append(len(part))
            rings.extend(part)
    return rings, part_sizes, counts


def _check(side: Collection, number: int) -> None:
    """Raise, with its name, for a feature that cannot be read."""
    try:
        for ring in polled(_rings_of(side, [number])[0]):
            _positions([ring])
        return
    except (DeadlineExceededError, CancelledError):
        raise
    except WrongDimensionError:
        what = "has positions of other than two numbers, or three with an altitude"
        raise refused(WrongDimensionError, side, number, what) from None
    except EngineError as error:
        raise refused(type(error), side, number, f"is wrong: {error.message}") from None
    except (KeyError, TypeError, ValueError):
        raise refused(InvalidArrayError, side, number, "has coordinates that are no lists of positions") from None


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
    Degenerate input: a polygon without positions, [] or [[]], is empty; holes of an empty shell are refused.

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
    _, (positions, *offsets), _ = _parts_of(side, limits)
    arrays = arrays_of(np.ascontiguousarray(positions[:, :2]), *offsets)
    polygons = [arrays.polygon(k) for k in range(len(arrays.polygon_offsets) - 1)]
    if len(polygons) == 1:
        return polygons[0]
    return Polygon(union_all(polygons, deadline=budget.left(), cancel=budget.cancel).rings)


Polygon.geojson = _polygon_of, lambda polygon: union_all([polygon]).__geo_interface__
