"""Layers as GeoDataFrames: overlay, dissolve and sjoin, row for row as geopandas has them. Needs the extra ``geo``."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from engine.errors import EngineError, InvalidInputError, InvalidOperationError, NotFiniteError, UnsupportedSolidError
from engine.layers.rows import (
    NONE,
    Layer,
    LayerRows,
    Limits,
    check_how,
    dissolve_rows,
    layer_of,
    locate_points_in_layer,
    overlay_rows,
    with_unmatched_points,
)
from engine.polygon_overlay.pair_arrays import PolygonArrays, arrays_of
from engine.polygon_overlay.touching import Touching
from engine.running.budget import Cancel
from engine.solids.checks import shown
from engine.solids.ragged import within

if TYPE_CHECKING:
    from geopandas import GeoDataFrame

_POLYGONS = (3, 6)
"""Shapely's type numbers of Polygon and MultiPolygon."""
_ABOUT_ATTRIBUTES = (
    *("as_index", "level", "sort", "observed", "dropna"), *("numeric_only", "min_count", "engine", "engine_kwargs"),
)  # fmt: skip
"""Options of dissolve that are passed on to geopandas: how rows are grouped, and arguments of aggregation functions."""
_POINT = 0
_LINE = 1


def overlay(
    left: GeoDataFrame,
    right: GeoDataFrame,
    how: str = "intersection",
    keep_geom_type: bool | None = None,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    **others: Any,
) -> GeoDataFrame:
    """Overlay two layers of polygons, every feature with every one that it meets, as geopandas.overlay does.

    Parameters
    ----------
    left, right : GeoDataFrame
        Of Polygon and MultiPolygon; missing and empty geometries are accepted.
    how : {"intersection", "union", "identity", "difference", "symmetric_difference"}
        As geopandas.
    keep_geom_type : bool, optional
        None is True, with a warning where rows without geometry are left out. False keeps these rows, and of every pair
        the lines and points in which features meet without common area, alone or with the area in a GeometryCollection,
        and those to which rounding collapses an area.
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
    overlap are united. A z is refused.

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
    _check_frames("overlay", others, left=left, right=right)
    check_how(how)
    if keep_geom_type is not None and not isinstance(keep_geom_type, (bool, np.bool_)):
        what = f"keep_geom_type must be None, True or False, got {shown(keep_geom_type)}"
        raise InvalidInputError(what, ("keep_geom_type",))
    if left.crs is not None and right.crs is not None and left.crs != right.crs:
        warnings.warn("the layers have different CRS; coordinates are taken as they are", UserWarning, stacklevel=2)
    limits = Limits(deadline, cancel, workers)
    layers = _layer(left, "left", limits), _layer(right, "right", limits)
    rows = overlay_rows(*layers, how, limits, with_touching=keep_geom_type is not None and not keep_geom_type)
    if rows.n_collapsed:
        warnings.warn(f"rounding left nothing of {rows.n_collapsed} rows with area", UserWarning, stacklevel=2)
    frame = _frame(left, right, rows, how)
    if keep_geom_type in (None, True) and (missing := frame.geometry.isna()).any():
        frame = frame[~missing]
        if keep_geom_type is None:
            warnings.warn(f"{int(missing.sum())} rows without geometry are left out", UserWarning, stacklevel=2)
    return frame.reset_index(drop=True)


def dissolve(
    layer: GeoDataFrame,
    by: Any = None,
    aggfunc: Any = "first",
    *,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    **options: Any,
) -> GeoDataFrame:
    """Unite the polygons of each group exactly, and aggregate their attributes, as GeoDataFrame.dissolve does.

    Parameters
    ----------
    layer : GeoDataFrame
        Of polygons.
    by, aggfunc
        As GeoDataFrame.dissolve.
    deadline, cancel
        As for `engine.locate`.
    **options
        Those about attributes: as_index, level, sort, observed, dropna, and for aggfunc numeric_only, min_count,
        engine, engine_kwargs. Others are refused.

    Returns
    -------
    GeoDataFrame
        A row a group. A group without polygons has an empty geometry.

    Raises
    ------
    InvalidInputError
        What geopandas cannot group by or aggregate.
    EngineError
        As `overlay`.

    Notes
    -----
    Boundary, accuracy and cost: as `engine.union_all`, a group each.

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
    _check_frames("dissolve", options, _ABOUT_ATTRIBUTES, layer=layer)
    geopandas, shapely = _geopandas()
    limits = Limits(deadline, cancel)
    name = layer.geometry.name
    solids = _layer(layer, "layer", limits)
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
    rows = dissolve_rows(solids, groups, len(frame), limits)
    frame[name] = geopandas.array.GeometryArray(_geometries(rows, shapely.Polygon()), crs=layer.crs)
    return frame


def sjoin(
    left: GeoDataFrame,
    right: GeoDataFrame,
    how: Literal["inner", "left"] = "inner",
    *,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    **others: Any,
) -> GeoDataFrame:
    """Join points to the polygons that contain them, boundary included, decided exactly: geopandas.sjoin, "intersects".

    Parameters
    ----------
    left : GeoDataFrame
        Of points; missing ones are in nothing.
    right : GeoDataFrame
        Of polygons.
    how : {"inner", "left"}
        As geopandas.
    deadline, cancel
        As for `engine.locate`.
    **others
        No other option of geopandas is accepted.

    Returns
    -------
    GeoDataFrame
        Rows and columns as geopandas.sjoin has them.

    Raises
    ------
    EngineError
        As `overlay`.

    Notes
    -----
    Boundary: a point on a border that two polygons share is in both. Exact; cost as `engine.locate_scene`.

    References
    ----------
    geopandas.sjoin.

    Examples
    --------
    >>> import geopandas, shapely, engine
    >>> wells = geopandas.GeoDataFrame({"depth": [9]}, geometry=[shapely.Point(1, 0.5)])
    >>> squares = [shapely.box(x, 0, x + 1, 1) for x in (0, 1)]
    >>> parcels = geopandas.GeoDataFrame({"owner": ["Ada", "Bo"]}, geometry=squares)
    >>> engine.layers.sjoin(wells, parcels)["owner"].tolist()
    ['Ada', 'Bo']
    """
    _check_frames("sjoin", others, left=left, right=right)
    _, shapely = _geopandas()
    if not isinstance(how, str) or how not in ("inner", "left"):
        raise InvalidOperationError(f"how must be inner or left; got {shown(how)}", ("how",))
    limits = Limits(deadline, cancel)
    points = np.asarray(left.geometry.array)
    if len(wrong := np.flatnonzero(~np.isin(shapely.get_type_id(points), (-1, 0)))):
        raise _refused(
            UnsupportedSolidError, left, ("left", int(wrong[0])), "is no point; sjoin joins points to polygons"
        )
    places, numbers = shapely.get_coordinates(points, return_index=True)
    first, second, on_boundary = locate_points_in_layer(places, _layer(right, "right", limits), limits)
    first = numbers[first]
    if how == "left":
        first, second, _ = with_unmatched_points(len(left), first, second, on_boundary)
    attributes = right.drop(columns=right.geometry.name)
    shared = set(attributes.columns) & set(left.columns)
    joined = left.iloc[first].rename(columns={column: f"{column}_left" for column in shared})
    attributes = attributes.rename(columns={column: f"{column}_right" for column in shared})
    attributes.insert(0, "index_right", right.index)
    more = attributes.reset_index(drop=True).reindex(np.where(second == NONE, len(right), second))
    return joined.assign(**{column: more[column].to_numpy() for column in more.columns})


def _geopandas() -> tuple[Any, Any]:
    """Import geopandas and shapely and return them; raise if they are not installed."""
    try:
        import geopandas
        import shapely
    except ImportError:
        raise InvalidInputError("GeoDataFrames need geopandas: pip install 'exact-geometry[geo]'", ()) from None
    return geopandas, shapely


def _check_frames(function: str, others: Any, taken: tuple[str, ...] = (), **frames: object) -> None:
    """Raise for an argument among `frames` that is no GeoDataFrame, and for an option among `others`, which this
    function does not have (though geopandas may). function: its name, for messages; taken: names of further options
    that it accepts."""
    geopandas, _ = _geopandas()
    if others.keys() - set(taken):
        name = sorted(others.keys() - set(taken))[0]
        also = f"{', '.join(taken)} beside " if taken else ""
        raise InvalidInputError(
            f"{function} takes no option {name!r}: coordinates and what meets are decided here, not by geopandas; it "
            f"takes {also}the options in its signature",
            (name,),
        )
    for name, frame in frames.items():
        if not isinstance(frame, geopandas.GeoDataFrame) or frame._geometry_column_name not in frame.columns:
            raise InvalidInputError(f"{name} must be a GeoDataFrame with a geometry, got {_named(frame)}", (name,))


def _named(frame: object) -> str:
    return f"one without ({type(frame).__name__})" if hasattr(frame, "columns") else shown(frame)


def _refused(error: type[EngineError], frame: GeoDataFrame, where: tuple[str, int], what: str) -> EngineError:
    name, place = where
    return error(f"{name}[{place}] (index {frame.index[place]}) {what}", where)


def _layer(frame: GeoDataFrame, name: str, limits: Limits) -> Layer:
    """Return the polygons of a frame's geometry as a `Layer`; raise for other geometries, a z or NaN. name: of the
    argument, for messages."""
    _, shapely = _geopandas()
    array = np.asarray(frame.geometry.array)
    if len(wrong := np.flatnonzero(~np.isin(shapely.get_type_id(array), (-1, *_POLYGONS)))):
        what = f"is a {array[wrong[0]].geom_type}; layers are of polygons"
        raise _refused(UnsupportedSolidError, frame, (name, int(wrong[0])), what)
    if len(high := np.flatnonzero(shapely.has_z(array))):
        what = "has a z; layers are plane: drop it with shapely.force_2d"
        raise _refused(UnsupportedSolidError, frame, (name, int(high[0])), what)
    is_missing = shapely.is_missing(array)
    there = np.flatnonzero(~is_missing)
    if not len(there):
        none = np.zeros(len(array) + 1, np.int64)
        return layer_of(PolygonArrays(np.zeros((0, 2)), none[:1], none[:1]), none, is_missing, limits)
    _, positions, (rings, parts, *several) = shapely.to_ragged_array(array[there], include_z=False)
    ends = several[0] if several else np.arange(len(there) + 1)
    if len(broken := np.flatnonzero(~np.isfinite(positions).all(axis=1))):
        owner = there[within(ends, within(parts, within(rings, broken[:1])))]
        raise _refused(NotFiniteError, frame, (name, int(owner[0])), f"holds {positions[broken[0]].tolist()}")
    counts = np.zeros(len(array), np.int64)
    counts[there] = np.diff(ends)
    return layer_of(arrays_of(positions, rings, parts), np.append(0, np.cumsum(counts)), is_missing, limits)


def _geometries(rows: LayerRows, empty: Any = None) -> Any:
    """Return an array of the rows' geometries: Polygon for one piece, MultiPolygon for several, `empty` for none; with
    the touching lines and points added."""
    _, shapely = _geopandas()
    positions, (rings, pieces, ends) = rows.ragged
    single = shapely.from_ragged_array(shapely.GeometryType.POLYGON, positions, (rings, pieces))
    sizes = np.diff(ends)
    geometries = np.full(len(rows), empty, object)
    geometries[sizes == 1] = single[ends[:-1][sizes == 1]]
    if (several := sizes > 1).any():
        owner = np.repeat(np.cumsum(several) - 1, np.where(several, sizes, 0))
        geometries[several] = shapely.multipolygons(single[np.repeat(several, sizes)], indices=owner)
    if rows.touching is not None and len(rows.touching.lines) + len(rows.touching.points):
        _add_touching(geometries, rows.touching)
    return geometries


def _add_touching(geometries: Any, touching: Touching) -> None:
    """Add the lines and points in which pairs touch to the geometries of their rows, in place; mixed types give a
    GeometryCollection."""
    _, shapely = _geopandas()
    lines = shapely.from_ragged_array(shapely.GeometryType.LINESTRING, touching.vertices, (touching.offsets,))
    rows, owners = np.unique(np.append(touching.points, touching.lines), return_inverse=True)
    pieces, of_pieces = shapely.get_parts(geometries[rows], return_index=True)
    owners = np.append(owners, of_pieces)
    order = np.argsort(owners, kind="stable")
    parts, owners = np.concatenate([shapely.points(touching.places), lines, pieces])[order], owners[order]
    starts, kinds = np.searchsorted(owners, np.arange(len(rows))), shapely.get_type_id(parts)
    least, most = np.minimum.reduceat(kinds, starts), np.maximum.reduceat(kinds, starts)
    made = parts[starts]
    is_alone = np.bincount(owners) == 1
    for make, are_meant in (
        (shapely.multipoints, most == _POINT),
        (shapely.multilinestrings, (least == _LINE) & (most == _LINE)),
        (shapely.geometrycollections, least < most),
    ):
        chosen = (are_meant & ~is_alone)[owners]
        make(parts[chosen], indices=owners[chosen], out=made)
    geometries[rows] = made


def _frame(left: GeoDataFrame, right: GeoDataFrame, rows: LayerRows, how: str) -> GeoDataFrame:
    """Return the rows as a GeoDataFrame with the attributes of both layers, of the left one alone for how = difference;
    names that both have get the suffixes _1 and _2."""
    geopandas, _ = _geopandas()
    import pandas

    geometry = geopandas.array.GeometryArray(_geometries(rows), crs=left.crs)
    if how == "difference":
        frame = left.iloc[rows.left].copy()
        frame[left.geometry.name] = geometry
        return frame
    sides = [side.drop(columns=side.geometry.name) for side in (left, right)]
    shared = set(sides[0].columns) & set(sides[1].columns)
    first, second = (
        side.rename(columns={column: f"{column}_{k}" for column in shared}) for k, side in enumerate(sides, 1)
    )
    halves = [half.reset_index(drop=True).reindex(rows_) for half, rows_ in ((first, rows.left), (second, rows.right))]
    frame = pandas.concat([half.reset_index(drop=True) for half in halves], axis=1)  # -1 is no label: missing
    return geopandas.GeoDataFrame(frame, geometry=geometry, crs=left.crs)
