"""Layers as GeoDataFrames: overlay, dissolve and sjoin, row for row as geopandas has them. Needs the extra ``geo``."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from engine.errors import InvalidInputError
from engine.layers.dissolve import check_gaps, dissolve_mixed
from engine.layers.frame_reading import check_frames, dims_of, geopandas_and_shapely, mixed_of
from engine.layers.limits import Limits
from engine.layers.path_rows import clip_mixed, overlay_mixed
from engine.layers.rows import NONE, LayerRows, check_how, heights_at
from engine.layers.shapes import AREA, LINE, POINT, MixedLayer
from engine.running.budget import Cancel
from engine.running.parallel import check_options
from engine.solids.checks import shown
from engine.types import IntArray

if TYPE_CHECKING:
    from geopandas import GeoDataFrame

_ABOUT_ATTRIBUTES = (
    *("as_index", "level", "sort", "observed", "dropna"), *("numeric_only", "min_count", "engine", "engine_kwargs"),
)  # fmt: skip
"""Options of dissolve that are passed on to geopandas: how rows are grouped, and arguments of aggregation functions."""
_EVERY = frozenset({POINT, LINE, AREA})


def overlay(
    left: GeoDataFrame, right: GeoDataFrame, how: str = "intersection", keep_geom_type: bool | None = None, *,
    grid: float | None = None, wrap: float | None = None, workers: int | None = None, deadline: float | None = None,
    cancel: Cancel | None = None, **others: Any,
) -> GeoDataFrame:  # fmt: skip
    """Overlay a layer with one of polygons, every feature with every one that it meets, as geopandas.overlay does.

    Parameters
    ----------
    left : GeoDataFrame
        Of polygons, lines and points, mixed too; missing and empty geometries are accepted.
    right : GeoDataFrame
        Of Polygon and MultiPolygon.
    how : {"intersection", "union", "identity", "difference", "symmetric_difference"}
        As geopandas.
    keep_geom_type : bool, optional
        None is True, with a warning where rows without geometry are left out. False keeps these rows, and of every pair
        the lines and points in which features meet without common area, alone or with the area in a GeometryCollection,
        and those to which rounding collapses an area. With True rows have the dimensions that the left layer has.
    grid : float, optional
        As for `engine.overlay`, of which each row then is one; `grid_size` is the same. For polygons alone.
    wrap : 180, optional
        Coordinates are longitudes and latitudes; polygons with a step of more than 180 degrees between two positions
        cross the antimeridian. They are cut there first, and joined in the answer; a warning counts them.
    workers, deadline, cancel
        As for `engine.locate`.
    **others
        No other option of geopandas is accepted: its precision and its repairs are not those of here.

    Returns
    -------
    GeoDataFrame
        Rows, their order, columns, suffixes and types are those of geopandas.overlay; the geometry is that of
        `engine.overlay`: exact topology, coordinates rounded once, valid.

    Raises
    ------
    InvalidInputError
        geopandas is not installed, or an option is not accepted.
    InvalidOperationError, UnsupportedSolidError, NotFiniteError, NotRepresentableError
        The message names the feature.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    Boundary, degenerate input: features that only touch make no row, but with ``keep_geom_type=False``. Lines bend
    where borders do, and end where lines meet. A ring that crosses itself is even-odd; the parts of a MultiPolygon that
    overlap are united. Points and lines on a boundary are within; what is left of a line ends on the boundary, and its
    parts are joined where none of the polygons comes between, decided exactly. A vertex of the left or right feature
    that stays keeps its altitude; no altitude is interpolated: of new vertices it is NaN, and a warning counts both.

    Cost: that of `overlay_batch` on the pairs whose boxes meet, and some microseconds a feature; some 15 us more a pair
    with ``keep_geom_type=False``.

    References
    ----------
    geopandas.overlay, whose rows and columns these are.

    Examples
    --------
    >>> import geopandas, shapely, engine
    >>> parcels = geopandas.GeoDataFrame({"owner": ["Ada"]}, geometry=[shapely.box(0, 0, 2, 2)])
    >>> floods = geopandas.GeoDataFrame({"year": [1962]}, geometry=[shapely.box(1, 1, 3, 3)])
    >>> engine.layers.overlay(parcels, floods).geometry.area.tolist()
    [1.0]
    """
    limits = Limits(deadline, cancel, workers, _grid_of(grid, others), wrap)
    layers = checked_overlay(left, right, how, keep_geom_type, limits, others)
    kinds = kinds_of(layers[0], keep_geom_type is not False)
    rows = overlay_mixed(*layers, how, limits, kinds, keep_geom_type is False)
    return overlaid(left, right, rows, how, keep_geom_type, kinds)


def checked_overlay(
    left: Any, right: Any, how: str, keep_geom_type: bool | None, limits: Limits, others: Any
) -> tuple[MixedLayer, MixedLayer]:
    """Return both layers after checks of the arguments of `overlay`."""
    check_frames("overlay", others, left=left, right=right)
    check_how(how)
    check_options(limits.workers, None, **({} if keep_geom_type is None else {"keep_geom_type": keep_geom_type}))
    if left.crs is not None and right.crs is not None and left.crs != right.crs:
        warnings.warn("the layers have different CRS; coordinates are taken as they are", UserWarning, stacklevel=3)
    return mixed_of(left, "left", limits), mixed_of(right, "right", limits, (AREA,))


def kinds_of(layer: MixedLayer, keep_geom_type: bool) -> frozenset[int]:
    """Return the dimensions of parts that stay: those that a layer has, or all."""
    return layer.kinds if keep_geom_type else _EVERY


def overlaid(
    left: GeoDataFrame, right: GeoDataFrame, rows: LayerRows, how: str, keep_geom_type: bool | None,
    kinds: frozenset[int],
) -> GeoDataFrame:  # fmt: skip
    """Return the rows of an overlay with the attributes of both layers; kinds: the dimensions that stay, unless
    `keep_geom_type` is False."""
    if rows.n_collapsed:
        warnings.warn(f"rounding left nothing of {rows.n_collapsed} rows with area", UserWarning, stacklevel=3)
    frame = _frame(left, right, rows, how)
    is_other = ~np.isin(dims_of(frame.geometry.array), [*kinds])
    is_other &= frame.geometry.geom_type.to_numpy() != "GeometryCollection"  # of parts of these dimensions
    if keep_geom_type is not False and is_other.any():
        frame = frame[~is_other]
        if keep_geom_type is None:
            what = "without geometry, or of other dimensions than the left layer,"
            warnings.warn(f"{int(is_other.sum())} rows {what} are left out", UserWarning, stacklevel=3)
    return frame.reset_index(drop=True)


def clip(
    layer: GeoDataFrame, mask: Any, keep_geom_type: bool = False, sort: bool = False, *, keep: str = "inside",
    grid: float | None = None, wrap: float | None = None, workers: int | None = None, deadline: float | None = None,
    cancel: Cancel | None = None, **others: Any,
) -> GeoDataFrame:  # fmt: skip
    """Cut the features of a layer to the union of some polygons, as geopandas.clip does.

    Parameters
    ----------
    layer : GeoDataFrame
        Of polygons, lines and points.
    mask : GeoDataFrame, GeoSeries, polygon or four numbers
        Polygons; four numbers are the low x, low y, high x and high y of a box.
    keep_geom_type : bool, default False
        Leave out lines and points in which a feature of more dimensions touches the mask.
    sort : bool, default False
        Accepted: rows are in the order of the layer anyway.
    keep : {"inside", "outside"}
        What is within the mask, or what is outside of it: of each feature its difference with the mask.
    grid, wrap, workers, deadline, cancel, **others
        As for `overlay`.

    Returns
    -------
    GeoDataFrame
        The features that the mask meets, with their index and attributes.

    Raises
    ------
    EngineError
        As `overlay`.

    Notes
    -----
    Boundary, accuracy, cost: as `overlay` with how = "intersection". Several masks are one region; where they overlap,
    polygons are cut by their union, whose crossings are rounded.

    References
    ----------
    geopandas.clip.

    Examples
    --------
    >>> import geopandas, shapely, engine
    >>> roads = geopandas.GeoDataFrame({"name": ["A1"]}, geometry=[shapely.LineString([(0, 0), (9, 0)])])
    >>> engine.layers.clip(roads, shapely.box(1, -1, 3, 1)).geometry.length.tolist()
    [2.0]
    """
    check_options(workers, None, sort=sort)
    limits = Limits(deadline, cancel, workers, _grid_of(grid, others), wrap, keep)
    sides = checked_clip(layer, mask, keep_geom_type, limits, others)
    rows = clip_mixed(*sides, limits, kinds_of(sides[0], keep_geom_type), not keep_geom_type)
    return frame_of_left(layer, rows)


def checked_clip(
    layer: Any, mask: Any, keep_geom_type: bool, limits: Limits, others: Any
) -> tuple[MixedLayer, MixedLayer]:
    """Return both layers after checks of the arguments of `clip`."""
    geopandas, shapely = geopandas_and_shapely()
    check_options(None, None, keep_geom_type=keep_geom_type)
    region = mask
    if isinstance(region, (list, tuple, np.ndarray)) and len(region) == 4 and np.isrealobj(np.asarray(region)):
        region = shapely.box(*region)
    if isinstance(region, shapely.Geometry):
        region = geopandas.GeoSeries([region])
    if isinstance(region, geopandas.GeoSeries):
        region = geopandas.GeoDataFrame(geometry=region)
    check_frames("clip", others, layer=layer, mask=region)
    return mixed_of(layer, "layer", limits), mixed_of(region, "mask", limits, (AREA,))


def frame_of_left(layer: GeoDataFrame, rows: LayerRows) -> GeoDataFrame:
    """Return rows with the index and attributes of their left features."""
    geopandas, _ = geopandas_and_shapely()
    frame = layer.iloc[rows.left].copy()
    geometries = _geometries(rows, source=np.asarray(layer.geometry.array))
    geometries = _with_altitudes(geometries, [(layer, rows.left, None)])
    frame[layer.geometry.name] = geopandas.array.GeometryArray(geometries, crs=layer.crs)
    return frame


def _grid_of(grid: float | None, others: dict[str, Any]) -> float | None:
    """Return the grid, under whichever of its names it is given."""
    size = others.pop("grid_size", None)
    if grid is not None and size is not None:
        raise InvalidInputError("grid and grid_size are one option; give one", ("grid_size",))
    return size if grid is None else grid


def dissolve(
    layer: GeoDataFrame, by: Any = None, aggfunc: Any = "first", *, coverage: bool = False, gaps: str = "keep",
    grid: float | None = None, wrap: float | None = None, deadline: float | None = None, cancel: Cancel | None = None,
    **options: Any,
) -> GeoDataFrame:  # fmt: skip
    """Unite the features of each group exactly, and aggregate their attributes, as GeoDataFrame.dissolve does.

    Parameters
    ----------
    layer : GeoDataFrame
        Of polygons, lines and points.
    by, aggfunc
        As GeoDataFrame.dissolve.
    coverage : bool, default False
        The polygons of a group do not overlap: verified exactly, and refused with the place of an overlap. Sides that
        they share then vanish without an arrangement. What several polygons enclose, and none has as a hole of its own,
        is a gap: a warning lists their places.
    gaps : {"keep", "refuse"}
        With coverage: gaps stay holes, or are refused. No tolerance tells a gap from a lake between polygons.
    grid, wrap
        As for `overlay`.
    deadline, cancel
        As for `engine.locate`.
    **options
        Those about attributes: as_index, level, sort, observed, dropna, and for aggfunc numeric_only, min_count,
        engine, engine_kwargs. Others are refused.

    Returns
    -------
    GeoDataFrame
        A row a group; one without geometries has an empty one; one of several dimensions a GeometryCollection.

    Raises
    ------
    InvalidInputError
        What geopandas cannot group by or aggregate.
    EngineError
        As `overlay`.

    Notes
    -----
    Boundary, accuracy and cost: as `engine.union_all`, a group each. Of lines, stretches that lie on one another are
    taken once, lines are joined where two ends meet, and get no vertex where they cross: it would be rounded. Of lines
    stays what is outside of the polygons of their group, of points those that are on neither, decided exactly.

    References
    ----------
    GeoDataFrame.dissolve.

    Examples
    --------
    >>> import geopandas, shapely, engine
    >>> squares = [shapely.box(x, 0, x + 1, 1) for x in range(3)]
    >>> parcels = geopandas.GeoDataFrame({"owner": ["Ada", "Ada", "Bo"]}, geometry=squares)
    >>> engine.layers.dissolve(parcels, by="owner").geometry.area.tolist()
    [2.0, 1.0]
    """
    grid = _grid_of(grid, options)
    check_frames("dissolve", options, _ABOUT_ATTRIBUTES, layer=layer)
    geopandas, shapely = geopandas_and_shapely()
    check_options(None, None, coverage=coverage)
    limits = Limits(deadline, cancel, grid=grid, wrap=wrap)
    check_gaps(gaps, coverage, grid)
    name = layer.geometry.name
    features = mixed_of(layer, "layer", limits)
    points = geopandas.points_from_xy(np.arange(len(layer)), np.zeros(len(layer)), crs=layer.crs)
    places = layer.copy()
    places[name] = points
    # geopandas gathers rows and attributes; points on a line encode the group of each feature
    try:
        frame = places.dissolve(by, aggfunc, method="unary", **options)
    except Exception as error:  # whatever pandas makes of them
        given = f"by={shown(by)}, aggfunc={shown(aggfunc)}"
        what = f"the layer cannot be dissolved with {given}: {type(error).__name__}: {error!s:.200}"
        raise InvalidInputError(what, ("by",)) from error
    at, group = shapely.get_coordinates(np.asarray(frame.geometry.array), return_index=True)
    groups = np.full(len(layer), NONE)
    groups[at[:, 0].astype(int)] = group
    rows = dissolve_mixed(features, groups, len(frame), limits, coverage, gaps)
    empty = shapely.GeometryCollection() if (features.paths.dims >= 0).any() else shapely.Polygon()
    geometries = _with_altitudes(_geometries(rows, empty), [(layer, np.arange(len(frame)), groups)])
    frame[name] = geopandas.array.GeometryArray(geometries, crs=layer.crs)
    return frame


def _geometries(rows: LayerRows, empty: Any = None, source: Any = None) -> Any:
    """Return the geometries of rows as an array of shapely, `empty` for a row without parts; a row with parts of
    several dimensions is a GeometryCollection. source: the left layer's geometries; points are taken from there."""
    _, shapely = geopandas_and_shapely()
    positions, (rings, pieces, ends) = rows.ragged
    points, lines = shapely.points(rows.touching.places), shapely.GeometryType.LINESTRING
    if source is not None and len(points):
        lefts = rows.left[rows.touching.points]
        points = np.where(shapely.get_type_id(source)[lefts] == shapely.GeometryType.POINT, source[lefts], points)
    lines = shapely.from_ragged_array(lines, rows.touching.vertices, (rows.touching.offsets,))
    polygons = shapely.from_ragged_array(shapely.GeometryType.POLYGON, positions, (rings, pieces))
    owners = np.concatenate([rows.touching.points, rows.touching.lines, np.repeat(np.arange(len(rows)), np.diff(ends))])
    order, geometries = np.argsort(owners, kind="stable"), np.full(len(rows), empty, object)
    there, starts, counts = np.unique(owners[order], return_index=True, return_counts=True)
    if len(there):
        parts = np.concatenate([points, lines, polygons])[order]
        dims = dims_of(parts)
        least, most = np.minimum.reduceat(dims, starts), np.maximum.reduceat(dims, starts)
        made, of = parts[starts], np.repeat(np.arange(len(there)), counts)
        makers = [shapely.multipoints, shapely.multilinestrings, shapely.multipolygons, shapely.geometrycollections]
        for dim, make in enumerate(makers):
            chosen = ((counts > 1) & (np.where(least == most, most, len(makers) - 1) == dim))[of]
            make(parts[chosen], indices=of[chosen], out=made)
        geometries[there] = made
    return geometries


def _with_altitudes(geometries: Any, sources: list[tuple[GeoDataFrame, IntArray, IntArray | None]]) -> Any:
    """Return geometries of rows with altitudes (`heights_at`). sources: for each input layer the frame; by row the
    feature, or the group, that it comes from; by feature its group, None where rows come from features."""
    _, shapely = geopandas_and_shapely()
    known = []
    for frame, of_rows, groups in sources:
        array = np.asarray(frame.geometry.array)
        if shapely.has_z(array).any():
            places, feature = shapely.get_coordinates(array, include_z=True, return_index=True)
            known.append((np.column_stack([feature if groups is None else groups[feature], places]), of_rows))
    if not known:
        return geometries
    flat, row = shapely.get_coordinates(geometries, return_index=True)
    heights = heights_at(flat, row, known)
    if heights is None:
        return geometries
    made, there = np.array(geometries, object), ~shapely.is_missing(geometries)
    solid = shapely.force_3d(geometries[there])
    made[there] = shapely.set_coordinates(solid, np.column_stack([flat, heights]))
    return made


def _frame(left: GeoDataFrame, right: GeoDataFrame, rows: LayerRows, how: str) -> GeoDataFrame:
    """Return the rows as a GeoDataFrame with the attributes of both layers, of the left one alone for how = difference;
    names that both have get the suffixes _1 and _2."""
    geopandas, _ = geopandas_and_shapely()
    import pandas

    if how == "difference":
        return frame_of_left(left, rows)
    geometries = _geometries(rows, source=np.asarray(left.geometry.array))
    geometries = _with_altitudes(geometries, [(left, rows.left, None), (right, rows.right, None)])
    geometry = geopandas.array.GeometryArray(geometries, crs=left.crs)
    sides = [side.drop(columns=side.geometry.name) for side in (left, right)]
    shared = set(sides[0].columns) & set(sides[1].columns)
    first, second = (
        side.rename(columns={column: f"{column}_{k}" for column in shared}) for k, side in enumerate(sides, 1)
    )
    halves = [half.reset_index(drop=True).reindex(rows_) for half, rows_ in ((first, rows.left), (second, rows.right))]
    frame = pandas.concat([half.reset_index(drop=True) for half in halves], axis=1)  # -1 is no label: missing
    return geopandas.GeoDataFrame(frame, geometry=geometry, crs=left.crs)
