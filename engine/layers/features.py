"""Layers as GeoJSON (RFC 7946): FeatureCollections in, features out; what HTTP and the command line speak.

What a feature holds beside its geometry goes through untouched: properties, id, the `crs`. It is written as JSON once a
feature (json_text.py), and rows are put together of these texts: how long an answer gets is known before it is made.
A row that comes from features of both layers has the properties of both, names that both layers have with _1 and _2,
as geopandas names them; `left` and `right` say which features these were.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np

from engine.errors import CancelledError, DeadlineExceededError, EngineError, InvalidInputError
from engine.layers.geojson import checked_each, collection_of, crs_of, groups_of, members_of, polygons_of, texts_of
from engine.layers.json_text import text_of
from engine.layers.rows import NONE, LayerRows, Limits, dissolved, held, overlay_rows, with_alone
from engine.running.budget import Cancel, polled
from engine.running.parallel import check_options
from engine.solids.checks import as_points, shown
from engine.solids.ragged import summed
from engine.types import Accuracy, FloatArray, IntArray, read_only

_CHECKED: Final = 1000
"""Features made at once."""
_ROW: Final = 55
"""Bytes of JSON of a row at least, without what is copied into it and its positions."""
_POSITION: Final = 10
"""Bytes of JSON of a position at least."""


@dataclass(frozen=True, slots=True, eq=False)
class FeatureRows:
    """Features of an answer, made when asked for: ``len``, ``make(start, stop)``; and the collection's `crs`, if any.

    offsets: (n + 1,) how many vertices stand before each feature. collapsed: rows that rounding left nothing of.
    As JSON: members(row) are those beside type and geometry, crs_text the `crs`, geometry(row) one that is passed
    through; n_bytes: (n + 1,) bytes before each feature, at least.
    areas: positions, and offsets of rings, of polygons and of rows, where the geometries are made; else None.
    """

    members: Callable[[int], bytes]
    offsets: IntArray
    n_bytes: IntArray
    crs_text: bytes | None
    areas: tuple[FloatArray, tuple[IntArray, IntArray, IntArray]] | None = None
    geometry: Callable[[int], bytes] = lambda row: b"null"
    collapsed: int = 0

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __iter__(self) -> Iterator[dict[str, Any]]:
        for start in range(0, len(self), _CHECKED):
            yield from self.make(start, min(len(self), start + _CHECKED))

    @property
    def crs(self) -> Any:
        """Return the member `crs` of the question."""
        return None if self.crs_text is None else json.loads(self.crs_text)

    def make(self, start: int, stop: int) -> list[dict[str, Any]]:
        """Return the features from one up to another."""
        return [
            {"type": "Feature", **json.loads(b"{%b}" % self.members(row)), "geometry": self._geometry(row)}
            for row in range(start, stop)
        ]

    def _geometry(self, row: int) -> Any:
        if self.areas is None:
            return json.loads(self.geometry(row))
        positions, (rings, pieces, ends) = self.areas
        parts = [
            [positions[i:j] for i, j in pairwise(rings[first : last + 1].tolist())]
            for first, last in pairwise(pieces[ends[row] : ends[row + 1] + 1].tolist())
        ]
        if not parts:
            return None
        kind, coordinates = ("Polygon", parts[0]) if len(parts) == 1 else ("MultiPolygon", parts)
        return {"type": kind, "coordinates": coordinates}


Answer = FeatureRows | tuple[FeatureRows, Accuracy]


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
    sides = [collection_of(value, (name,), limits) for value, name in ((left, "left"), (right, "right"))]
    crs = crs_of(sides, limits)
    told, n_bytes = members_of(sides, ("left", "right"), limits)
    layers = [polygons_of(side, limits) for side in sides]
    rows = overlay_rows(layers[0], layers[1], how, limits)
    made = _with_areas(
        rows, lambda row: told(int(rows.left[row]), int(rows.right[row])), n_bytes(rows.left, rows.right), crs
    )
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
    side = collection_of(layer, ("layer",), limits)
    crs = crs_of([side], limits)
    names = _checked_names(by)
    for member, kept in (("properties", side.properties), ("id", ({"id": each.get("id")} for each in side.features))):
        checked = texts_of(side, kept, member, limits)  # none may be what JSON cannot hold
        limits.budget().take(-sum(map(len, checked)))
        del checked
    groups, values = groups_of(side, names, limits)
    rows = dissolved(polygons_of(side, limits), groups, len(values), limits)
    counts = np.bincount(groups, minlength=len(rows)).tolist()
    texts = [b"%b:null" % text_of(name) for name in names]

    def told(row: int) -> bytes:
        own = texts.copy()
        for place, value in values[row].items():
            own[place] = own[place][:-4] + value
        return b'"properties":{%b}' % b",".join([*own, b'"count":%d' % counts[row]])

    lengths = [sum(len(value) - 4 for value in each.values()) for each in polled(values)]
    made = _with_areas(rows, told, np.array(lengths, np.int64) + sum(map(len, texts)), crs)
    return (made, limits.accuracy) if report else made


def _checked_names(by: Any) -> list[str]:
    names = [] if by is None else by
    if not isinstance(names, (list, tuple)) or not all(isinstance(name, str) for name in names):
        raise InvalidInputError(f"by must be a list of names of properties, got {shown(by)}", ("by",))
    if "count" in names:
        raise InvalidInputError("count is how many features were united; give that property another name", ("by",))
    return list(dict.fromkeys(names))


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
            positions = checked_each(there, sides[0], lambda each: as_points([each["coordinates"]], 2)[0])
    geometries = texts_of(sides[0], (each.get("geometry") for each in sides[0].features), "geometry", limits)
    told, n_bytes = members_of(sides, ("point", "polygon"), limits)
    layer = polygons_of(sides[1], limits)
    first, second, on_boundary = held(positions, layer, limits)
    first = np.array(there, np.int64)[first]
    if outside:
        first, second, on_boundary = with_alone(len(sides[0].features), first, second, on_boundary)

    def members(row: int) -> bytes:
        more = (b',"boundary":false', b',"boundary":true')[int(on_boundary[row])] if second[row] != NONE else b""
        return told(int(first[row]), int(second[row])) + more

    sizes = np.array([*map(len, geometries)], np.int64)[first] + n_bytes(first, second)
    offsets, n_bytes_before = read_only(np.arange(len(first) + 1)), summed(_ROW + sizes)
    made = FeatureRows(members, offsets, n_bytes_before, crs, geometry=lambda row: geometries[first[row]])
    return (made, limits.accuracy) if report else made


def _with_areas(rows: LayerRows, members: Callable[[int], bytes], n_bytes: IntArray, crs: bytes | None) -> FeatureRows:
    """Return features of rows: n_bytes says of each how long its members beside the geometry are at least."""
    positions, (rings, pieces, ends) = rows.ragged
    offsets = rings[pieces[ends]]
    n_bytes = summed(_ROW + n_bytes) + _POSITION * offsets
    areas = positions, (rings, pieces, ends)
    return FeatureRows(members, offsets, n_bytes, crs, areas, collapsed=rows.n_collapsed)
