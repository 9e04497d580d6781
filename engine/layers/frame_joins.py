"""Spatial joins of GeoDataFrames, row for row as geopandas has them. Needs the extra ``geo``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from engine.distance.clearance import checked_distance
from engine.errors import InvalidInputError, InvalidOperationError
from engine.layers.frame_reading import check_frames, geopandas_and_shapely, mixed_of
from engine.layers.joins import check_predicate, nearest_of, related_pairs
from engine.layers.limits import Limits
from engine.layers.rows import NONE, with_unmatched
from engine.running.budget import Cancel
from engine.running.parallel import check_options
from engine.solids.checks import shown
from engine.types import FloatArray, IntArray

if TYPE_CHECKING:
    from geopandas import GeoDataFrame

How = Literal["inner", "left", "right"]


def sjoin(
    left: GeoDataFrame, right: GeoDataFrame, how: How = "inner", predicate: str = "intersects", *,
    distance: float | None = None, lsuffix: str = "left", rsuffix: str = "right", workers: int | None = None,
    deadline: float | None = None, cancel: Cancel | None = None, **others: Any,
) -> GeoDataFrame:  # fmt: skip
    """Join features to those that they meet, or have another relation to, decided exactly: geopandas.sjoin.

    Parameters
    ----------
    left, right : GeoDataFrame
        Of points, lines and polygons; missing and empty ones have no relation.
    how : {"inner", "left", "right"}
        As geopandas.
    predicate : str, default "intersects"
        intersects, within, contains, touches, overlaps, crosses, covers, covered_by or equals, of the left feature to
        the right one, with the meaning that they have in GEOS; or dwithin.
    distance : float, optional
        With dwithin alone: the largest distance, which counts as within.
    lsuffix, rsuffix : str
        Of names that both layers have, as geopandas.
    workers, deadline, cancel
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
    Boundary: all features are closed sets: a point on a border that two polygons share is in both. The boundary of a
    line are its ends, those of an odd number of parts. Exact, but for polygons whose rings cross, and overlapping parts
    of a MultiPolygon: these are united first, which rounds where they cross. A z has no part in it.

    Cost: some 0.3 us for each pair of features whose boxes meet, and for points that of `engine.locate_scene`.

    References
    ----------
    geopandas.sjoin; Clementini, Di Felice, van Oosterom, A small set of formal topological relationships, 1993.

    Examples
    --------
    >>> import geopandas, shapely, engine
    >>> wells = geopandas.GeoDataFrame({"depth": [9]}, geometry=[shapely.Point(1, 0.5)])
    >>> squares = [shapely.box(x, 0, x + 1, 1) for x in (0, 1)]
    >>> parcels = geopandas.GeoDataFrame({"owner": ["Ada", "Bo"]}, geometry=squares)
    >>> engine.layers.sjoin(wells, parcels)["owner"].tolist()
    ['Ada', 'Bo']
    >>> engine.layers.sjoin(wells, parcels, predicate="within")["owner"].tolist()
    []
    """
    check_join("sjoin", left, right, how, lsuffix, rsuffix, others)
    reach = check_predicate(predicate, distance)
    check_options(workers, None)
    limits = Limits(deadline, cancel, workers)
    layers = mixed_of(left, "left", limits), mixed_of(right, "right", limits)
    return joined(left, right, related_pairs(*layers, predicate, reach, limits), how, (lsuffix, rsuffix))


def sjoin_nearest(
    left: GeoDataFrame, right: GeoDataFrame, how: How = "inner", *, max_distance: float | None = None,
    lsuffix: str = "left", rsuffix: str = "right", distance_col: str | None = None, exclusive: bool = False,
    workers: int | None = None, deadline: float | None = None, cancel: Cancel | None = None, **others: Any,
) -> GeoDataFrame:  # fmt: skip
    """Join each feature to all features that are nearest to it, ties decided exactly: geopandas.sjoin_nearest.

    Parameters
    ----------
    left, right : GeoDataFrame
        Of points, lines and polygons.
    how : {"inner", "left", "right"}
        As geopandas; with right, of each right feature the nearest left ones.
    max_distance : float, optional
        The largest distance, which counts.
    lsuffix, rsuffix : str
        As for `sjoin`.
    distance_col : str, optional
        Name of a column for the distances.
    exclusive : bool, default False
        Features that are equal to it are not the nearest.
    workers, deadline, cancel, **others
        As for `sjoin`.

    Returns
    -------
    GeoDataFrame
        Rows and columns as geopandas.sjoin_nearest has them; distances are the doubles nearest to the exact ones, 0
        where features meet.

    Raises
    ------
    EngineError
        As `overlay`.

    Notes
    -----
    Boundary: a feature at distance 0, on the boundary too, is nearest. Exact: two distances are equal only if their
    squares are, as fractions.

    Cost: a search in boxes that grow until they hold the nearest; some 20 us a row that is no contact.

    References
    ----------
    geopandas.sjoin_nearest.

    Examples
    --------
    >>> import geopandas, shapely, engine
    >>> wells = geopandas.GeoDataFrame({"depth": [9]}, geometry=[shapely.Point(2, 0)])
    >>> towns = geopandas.GeoDataFrame({"town": ["A", "B"]}, geometry=[shapely.Point(0, 0), shapely.Point(4, 0)])
    >>> engine.layers.sjoin_nearest(wells, towns, distance_col="far")[["town", "far"]].to_numpy().tolist()
    [['A', 2.0], ['B', 2.0]]
    """
    check_join("sjoin_nearest", left, right, how, lsuffix, rsuffix, others)
    check_options(workers, None, exclusive=exclusive)
    most = np.inf if max_distance is None else checked_distance(max_distance, "max_distance")
    if distance_col is not None and not isinstance(distance_col, str):
        raise InvalidInputError(f"distance_col must be a name, got {shown(distance_col)}", ("distance_col",))
    limits = Limits(deadline, cancel, workers)
    sides = mixed_of(left, "left", limits), mixed_of(right, "right", limits)
    pairs, distances = nearest_of(*(sides[::-1] if how == "right" else sides), most, bool(exclusive), limits)
    pairs = pairs[:, ::-1] if how == "right" else pairs
    return joined(left, right, pairs, how, (lsuffix, rsuffix), distances, distance_col)


def check_join(function: str, left: Any, right: Any, how: Any, lsuffix: Any, rsuffix: Any, others: Any) -> None:
    check_frames(function, others, left=left, right=right)
    if not isinstance(how, str) or how not in ("inner", "left", "right"):
        raise InvalidOperationError(f"how must be inner, left or right; got {shown(how)}", ("how",))
    for name, suffix in (("lsuffix", lsuffix), ("rsuffix", rsuffix)):
        if not isinstance(suffix, str):
            raise InvalidInputError(f"{name} must be text, got {shown(suffix)}", (name,))


def joined(
    left: GeoDataFrame, right: GeoDataFrame, pairs: IntArray, how: str, suffixes: tuple[str, str],
    distances: FloatArray | None = None, column: str | None = None,
) -> GeoDataFrame:  # fmt: skip
    """Return a join as a GeoDataFrame, with the columns of geopandas.sjoin. pairs (n, 2): left and right feature of
    each row, sorted by the side that `how` names, the left one for inner. distances (n,): put in the column named
    `column`, if given."""
    first, second = pairs.T
    places = np.arange(len(pairs))
    if how == "left":
        first, second, places = with_unmatched(len(left), first, second)
    elif how == "right":
        second, first, places = with_unmatched(len(right), second, first)
    frame = _assembled(left, right, first, second, how, suffixes)
    if column is not None and distances is not None:
        frame[column] = np.append(distances, np.nan)[places]
    return frame


def _assembled(
    left: GeoDataFrame, right: GeoDataFrame, first: IntArray, second: IntArray, how: str, suffixes: tuple[str, str]
) -> GeoDataFrame:
    """Return rows of features, NONE for none, with the columns of geopandas.sjoin."""
    attributes = right.drop(columns=right.geometry.name)
    names = {*left.columns, *attributes.columns}
    is_plain = all(side.index.nlevels == 1 and side.index.name is None for side in (left, right))
    if how == "right" or suffixes != ("left", "right") or not is_plain or names & {"index_left", "index_right"}:
        return _by_geopandas(left, right, first, second, how, suffixes)
    shared = set(attributes.columns) & set(left.columns)
    joined = left.iloc[first].rename(columns={column: f"{column}_left" for column in shared})
    attributes = attributes.rename(columns={column: f"{column}_right" for column in shared})
    attributes.insert(0, "index_right", right.index)
    more = attributes.reset_index(drop=True).reindex(np.where(second == NONE, len(right), second))
    return joined.assign(**{column: more[column].array for column in more.columns})


def _by_geopandas(
    left: GeoDataFrame, right: GeoDataFrame, first: IntArray, second: IntArray, how: str, suffixes: tuple[str, str]
) -> GeoDataFrame:
    """Return the rows (first[k], second[k]) joined by geopandas itself, so that it names columns and indexes: points at
    different places, one for each row, stand for the geometries, which are put back afterwards."""
    geopandas, _ = geopandas_and_shapely()
    sides, points = [], geopandas.points_from_xy(np.arange(len(first)), np.zeros(len(first)))
    for side, rows in ((left, first), (right, second)):
        there = np.flatnonzero(rows != NONE)
        some = side.iloc[rows[there]].copy()
        some[side.geometry.name] = geopandas.array.GeometryArray(np.asarray(points)[there])
        sides.append(some)
    try:
        frame = geopandas.sjoin(*sides, how=how, lsuffix=suffixes[0], rsuffix=suffixes[1])
    except ValueError as error:  # names that the suffixes make twice
        raise InvalidInputError(f"the columns cannot be joined: {error!s:.200}", ("lsuffix",)) from error
    own, rows = (right, second) if how == "right" else (left, first)
    name = frame.geometry.name
    frame[name] = geopandas.array.GeometryArray(np.asarray(own.geometry.array)[rows], crs=own.crs)
    return frame
