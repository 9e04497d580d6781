"""Layers as GeoJSON (RFC 7946): FeatureCollections in, features out; for HTTP and the command line.

What a feature has besides its geometry (properties, id) and the `crs` is copied unchanged: written as JSON once a
feature (json_text.py), and joined to rows, so that the length of an answer is known before it is made. A row from
features of both layers has the properties of both, names that both layers have with _1 and _2, as in geopandas; `left`
and `right` are the numbers of these features.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from engine.errors import InvalidInputError
from engine.layers.dissolve import check_gaps, dissolve_mixed
from engine.layers.feature_rows import Answer, FeatureRows, reporting, with_geometries
from engine.layers.geojson import EVERY, LINES, Collection, collection_of, mixed_of
from engine.layers.json_text import text_of
from engine.layers.limits import Limits
from engine.layers.members import crs_of, groups_of, members_of, texts_of
from engine.layers.path_rows import clip_mixed, overlay_mixed
from engine.layers.pieces import slivers_of, split_rows
from engine.layers.rows import NONE, LayerRows
from engine.layers.shapes import MixedLayer
from engine.running.budget import Cancel, polled
from engine.running.parallel import check_options
from engine.solids.checks import shown


@reporting
def overlay_features(
    left: Any, right: Any, how: str = "intersection", *, grid: float | None = None, min_width: float | None = None,
    wrap: float | None = None, deadline: float | None = None, cancel: Cancel | None = None, report: bool = False,
) -> Answer:  # fmt: skip
    """Overlay a FeatureCollection with one of polygons.

    Parameters
    ----------
    left, right : dict
        GeoJSON FeatureCollections, the left one of any geometries, the right one of polygons. Features with null
        geometry keep their properties where what is left of their layer is part of the answer.
    how : {"intersection", "union", "identity", "difference", "symmetric_difference"}
        As `engine.layers.overlay`.
    grid, wrap
        As for `engine.layers.overlay`.
    min_width : float, optional
        List the pieces that are narrower, as `engine.layers.slivers` says: in `FeatureRows.slivers`.
    deadline, cancel, report
        As for `engine.locate`: with ``report=True`` the answer is a pair, of `FeatureRows` and an `Accuracy`.

    Returns
    -------
    FeatureRows

    Raises
    ------
    EngineError
        As `engine.layers.overlay`, with the path to the element at fault and its id.

    Notes
    -----
    As `engine.layers.overlay`; altitudes are counted in the report. Edges are straight in the plane of the coordinates,
    in degrees too: no great circles.

    References
    ----------
    RFC 7946 (GeoJSON).

    Examples
    --------
    >>> from engine import layers, read_layer
    >>> def square(x, y):
    ...     ring = [[x, x], [y, x], [y, y], [x, y], [x, x]]
    ...     return read_layer(('{"type": "Polygon", "coordinates": [%s]}' % ring).encode())
    >>> rows = layers.overlay_features(square(0, 2), square(1, 3))
    >>> rows.make(0, len(rows))[0]["geometry"]["coordinates"][0].tolist()
    [[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0], [1.0, 1.0]]
    """
    check_options(None, None, report=report)
    limits = Limits(deadline, cancel, grid=grid, wrap=wrap)
    sides = [collection_of(left, ("left",), limits, EVERY), collection_of(right, ("right",), limits)]

    def overlaid(one: MixedLayer, other: MixedLayer) -> LayerRows:
        return overlay_mixed(one, other, how, limits, one.kinds, False)

    return _answered(sides, ("left", "right"), overlaid, min_width, limits, report)


@reporting
def clip_features(
    layer: Any, mask: Any, *, keep: str = "inside", grid: float | None = None, min_width: float | None = None,
    wrap: float | None = None, deadline: float | None = None, cancel: Cancel | None = None, report: bool = False,
) -> Answer:  # fmt: skip
    """Cut the features of a FeatureCollection to the union of some polygons.

    Parameters
    ----------
    layer, mask : dict
        GeoJSON FeatureCollections, the mask of polygons.
    keep : {"inside", "outside"}
        What is within the mask, or what is outside of it.
    grid, min_width, wrap, deadline, cancel, report
        As for `overlay_features`.

    Returns
    -------
    FeatureRows

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
    >>> from engine import layers, read_layer
    >>> triangle = read_layer(b'{"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [0, 2], [0, 0]]]}')
    >>> line = read_layer(b'{"type": "LineString", "coordinates": [[0, 1], [9, 1]]}')
    >>> rows = layers.clip_features(line, triangle)
    >>> rows.make(0, 1)[0]["geometry"]["coordinates"]
    [[0.0, 1.0], [1.0, 1.0]]
    """
    check_options(None, None, report=report)
    limits = Limits(deadline, cancel, grid=grid, wrap=wrap, keep=keep)
    sides = [collection_of(layer, ("layer",), limits, EVERY), collection_of(mask, ("mask",), limits)]

    def clipped(one: MixedLayer, other: MixedLayer) -> LayerRows:
        return clip_mixed(one, other, limits, one.kinds, False)

    return _answered(sides, ("layer",), clipped, min_width, limits, report)


@reporting
def dissolve_features(
    layer: Any, by: list[str] | None = None, *, coverage: bool = False, gaps: str = "keep", grid: float | None = None,
    min_width: float | None = None, wrap: float | None = None, deadline: float | None = None,
    cancel: Cancel | None = None, report: bool = False,
) -> Answer:  # fmt: skip
    """Unite the features of a FeatureCollection that agree in the properties `by`; all of them by default.

    Parameters
    ----------
    layer : dict
        A GeoJSON FeatureCollection of polygons, lines and points.
    by : list of str, optional
        Names of properties.
    coverage, gaps, grid
        As for `engine.layers.dissolve`.
    min_width, wrap, deadline, cancel, report
        As for `overlay_features`.

    Returns
    -------
    FeatureRows
        Groups in the order of their first features. Properties: those of `by`, and `count`, the features united.

    Raises
    ------
    EngineError
        As `engine.layers.overlay`.

    Notes
    -----
    Boundary, accuracy and cost: as `engine.layers.dissolve`.

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
    limits = Limits(deadline, cancel, grid=grid, wrap=wrap)
    check_gaps(gaps, coverage, grid)
    side = collection_of(layer, ("layer",), limits, EVERY)
    crs = crs_of([side], limits)
    names = _checked_names(by)
    for member, column in (("properties", side.properties), ("id", ({"id": each.get("id")} for each in side.features))):
        checked = texts_of(side, column, member, limits)  # none may be what JSON cannot hold
        limits.budget().take(-sum(map(len, checked)))
        del checked
    groups, values = groups_of(side, names, limits)
    rows = dissolve_mixed(mixed_of(side, limits), groups, len(values), limits, coverage, gaps)
    counts = np.bincount(groups, minlength=len(rows)).tolist()
    texts = [b"%b:null" % text_of(name) for name in names]

    def write_members(row: int) -> bytes:
        own = texts.copy()
        for place, value in values[row].items():
            own[place] = own[place][:-4] + value
        return b'"properties":{%b}' % b",".join([*own, b'"count":%d' % counts[row]])

    lengths = [sum(len(value) - 4 for value in each.values()) for each in polled(values)]
    known = side.known
    known[:, 0] = groups[known[:, 0].astype(np.int64)]
    n_bytes = np.array(lengths, np.int64) + sum(map(len, texts))
    with limits.budget():
        made = with_geometries(rows, write_members, n_bytes, crs, [(known, np.arange(len(rows)))])
    return _finished(made, rows, min_width, limits, report)


@reporting
def split_features(
    layer: Any, lines: Any, *, min_width: float | None = None, deadline: float | None = None,
    cancel: Cancel | None = None, report: bool = False,
) -> Answer:  # fmt: skip
    """Split the polygons of a FeatureCollection by the lines of another, a row for each piece.

    Parameters
    ----------
    layer, lines : dict
        GeoJSON FeatureCollections, of polygons and of lines.
    min_width, deadline, cancel, report
        As for `overlay_features`.

    Returns
    -------
    FeatureRows
        The pieces of each feature, with its properties; one that no line splits is a row for each of its parts.

    Raises
    ------
    EngineError
        As `engine.layers.overlay`.

    Notes
    -----
    Boundary, accuracy and cost: as `engine.split`.

    References
    ----------
    RFC 7946 (GeoJSON).

    Examples
    --------
    >>> from engine import layers, read_layer
    >>> triangle = read_layer(b'{"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [0, 2], [0, 0]]]}')
    >>> line = read_layer(b'{"type": "LineString", "coordinates": [[-1, 1], [9, 1]]}')
    >>> len(layers.split_features(triangle, line))
    2
    """
    check_options(None, None, report=report)
    limits = Limits(deadline, cancel)
    sides = [collection_of(layer, ("layer",), limits), collection_of(lines, ("lines",), limits, LINES)]
    return _answered(sides, ("layer",), lambda one, other: split_rows(one, other, limits), min_width, limits, report)


def _answered(
    sides: list[Collection], names: tuple[str, ...], function: Callable[[MixedLayer, MixedLayer], LayerRows],
    min_width: float | None, limits: Limits, report: bool,
) -> Answer:  # fmt: skip
    """Return the rows that `function` gives for the layers of `sides`, with altitudes and with the members of the
    features they come from. names: of the members in which a row says which features these are, one a layer."""
    crs = crs_of(sides, limits)
    write_members, n_bytes = members_of(sides[: len(names)], names, limits)
    rows = function(*(mixed_of(side, limits) for side in sides))
    numbers = rows.left, rows.right if len(names) > 1 else np.full(len(rows), NONE)
    with limits.budget():
        sources = [(side.known, of_rows) for side, of_rows in zip(sides[: len(names)], numbers)]
        made = with_geometries(
            rows, lambda row: write_members(*(int(each[row]) for each in numbers)), n_bytes(*numbers), crs, sources
        )
    return _finished(made, rows, min_width, limits, report)


def _finished(made: FeatureRows, rows: LayerRows, min_width: float | None, limits: Limits, report: bool) -> Answer:
    """Return an answer, with slivers if they are requested."""
    if min_width is not None:
        if limits.wrap:
            raise InvalidInputError("min_width measures in the plane; leave it or wrap out", ("min_width",))
        made = replace(made, slivers=slivers_of(rows, min_width, limits))
    return (made, limits.accuracy) if report else made


def _checked_names(by: Any) -> list[str]:
    names = [] if by is None else by
    if not isinstance(names, (list, tuple)) or not all(isinstance(name, str) for name in names):
        raise InvalidInputError(f"by must be a list of names of properties, got {shown(by)}", ("by",))
    if "count" in names:
        raise InvalidInputError("count is how many features were united; give that property another name", ("by",))
    return list(dict.fromkeys(names))
