"""Layers as GeoJSON (RFC 7946): FeatureCollections in, features out; for HTTP and the command line.

What a feature has besides its geometry (properties, id) and the `crs` is copied unchanged: written as JSON once a
feature (json_text.py), and joined to rows, so that the length of an answer is known before it is made. A row from
features of both layers has the properties of both, names that both layers have with _1 and _2, as in geopandas; `left`
and `right` are the numbers of these features.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final, Literal, overload

import numpy as np

from engine.errors import CancelledError, DeadlineExceededError, EngineError, InvalidInputError
from engine.layers.geojson import check_each, collection_of, crs_of, groups_of, members_of, polygons_of, texts_of
from engine.layers.json_text import text_of
from engine.layers.rows import (
    NONE,
    LayerRows,
    Limits,
    dissolve_rows,
    locate_points_in_layer,
    overlay_rows,
    with_unmatched_points,
)
from engine.running.budget import Cancel, polled
from engine.running.parallel import check_options
from engine.solids.checks import as_points, shown
from engine.solids.ragged import summed
from engine.types import Accuracy, FloatArray, IntArray, read_only

_BATCH: Final = 1000
"""Number of features made at a time."""
_ROW: Final = 55
"""Lower bound on the bytes of a row in JSON, without copied members and positions."""
_POSITION: Final = 10
"""Lower bound on the bytes of a position in JSON."""


@dataclass(frozen=True, slots=True, eq=False)
class FeatureRows:
    """Features of an answer, made on request.

    Attributes
    ----------
    offsets : ndarray of int64, shape (n + 1,)
        How many vertices stand before each feature.
    collapsed : int
        Rows that rounding left nothing of.
    crs_text : str
        The collection's `crs` as JSON.
    n_bytes : ndarray of int64, shape (n + 1,)
        Bytes of JSON before each feature, at least.
    areas : tuple or None
        Positions, and offsets of rings, of polygons and of rows, where the geometries are made.
    members, geometry : callable
        ``members(row)``: the members beside type and geometry, as JSON; ``geometry(row)``: one that is passed through.
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
        for start in range(0, len(self), _BATCH):
            yield from self.make(start, min(len(self), start + _BATCH))

    @property
    def crs(self) -> Any:
        """The member `crs` of the input."""
        return None if self.crs_text is None else json.loads(self.crs_text)

    def make(self, start: int, stop: int) -> list[dict[str, Any]]:
        """Return features as dicts.

        Parameters
        ----------
        start, stop : int
            The first, and one past the last.

        Returns
        -------
        list of dict
            GeoJSON features.
        """
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


@overload
def overlay_features(
    left: Any,
    right: Any,
    how: str = "intersection",
    *,
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
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: Literal[True],
) -> tuple[FeatureRows, Accuracy]: ...
def overlay_features(
    left: Any,
    right: Any,
    how: str = "intersection",
    *,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: bool = False,
) -> Answer:
    """Overlay two FeatureCollections of polygons.

    Parameters
    ----------
    left, right : dict
        GeoJSON FeatureCollections. Features with null geometry keep their properties where what is left of their layer
        is part of the answer.
    how : {"intersection", "union", "identity", "difference", "symmetric_difference"}
        As `engine.layers.overlay`.
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
    limits = Limits(deadline, cancel)
    sides = [collection_of(value, (name,), limits) for value, name in ((left, "left"), (right, "right"))]
    crs = crs_of(sides, limits)
    write_members, n_bytes = members_of(sides, ("left", "right"), limits)
    layers = [polygons_of(side, limits) for side in sides]
    rows = overlay_rows(layers[0], layers[1], how, limits)
    made = _with_areas(
        rows, lambda row: write_members(int(rows.left[row]), int(rows.right[row])), n_bytes(rows.left, rows.right), crs
    )
    return (made, limits.accuracy) if report else made


@overload
def dissolve_features(
    layer: Any,
    by: list[str] | None = None,
    *,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: Literal[False] = False,
) -> FeatureRows: ...
@overload
def dissolve_features(
    layer: Any,
    by: list[str] | None = None,
    *,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: Literal[True],
) -> tuple[FeatureRows, Accuracy]: ...
def dissolve_features(
    layer: Any,
    by: list[str] | None = None,
    *,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    report: bool = False,
) -> Answer:
    """Unite the features of a FeatureCollection that agree in the properties `by`; all of them by default.

    Parameters
    ----------
    layer : dict
        A GeoJSON FeatureCollection of polygons.
    by : list of str, optional
        Names of properties.
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
    check_options(None, None, report=report)
    limits = Limits(deadline, cancel)
    side = collection_of(layer, ("layer",), limits)
    crs = crs_of([side], limits)
    names = _checked_names(by)
    for member, column in (("properties", side.properties), ("id", ({"id": each.get("id")} for each in side.features))):
        checked = texts_of(side, column, member, limits)  # none may be what JSON cannot hold
        limits.budget().take(-sum(map(len, checked)))
        del checked
    groups, values = groups_of(side, names, limits)
    rows = dissolve_rows(polygons_of(side, limits), groups, len(values), limits)
    counts = np.bincount(groups, minlength=len(rows)).tolist()
    texts = [b"%b:null" % text_of(name) for name in names]

    def write_members(row: int) -> bytes:
        own = texts.copy()
        for place, value in values[row].items():
            own[place] = own[place][:-4] + value
        return b'"properties":{%b}' % b",".join([*own, b'"count":%d' % counts[row]])

    lengths = [sum(len(value) - 4 for value in each.values()) for each in polled(values)]
    made = _with_areas(rows, write_members, np.array(lengths, np.int64) + sum(map(len, texts)), crs)
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
    offsets, n_bytes_before = read_only(np.arange(len(first) + 1)), summed(_ROW + sizes)
    made = FeatureRows(members, offsets, n_bytes_before, crs, geometry=lambda row: geometries[first[row]])
    return (made, limits.accuracy) if report else made


def _with_areas(rows: LayerRows, members: Callable[[int], bytes], n_bytes: IntArray, crs: bytes | None) -> FeatureRows:
    """Return the features of rows with polygons. members(row): JSON bytes of a row's members besides type and geometry;
    n_bytes: lower bound on the bytes of JSON of each row but for the geometry; crs: the common member of the layers as
    JSON."""
    positions, (rings, pieces, ends) = rows.ragged
    offsets = rings[pieces[ends]]
    n_bytes = summed(_ROW + n_bytes) + _POSITION * offsets
    areas = positions, (rings, pieces, ends)
    return FeatureRows(members, offsets, n_bytes, crs, areas, collapsed=rows.n_collapsed)
