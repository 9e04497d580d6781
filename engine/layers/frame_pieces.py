"""Pieces of GeoDataFrames: polygons split by lines, and slivers. Needs the extra ``geo``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from engine.layers.frame_reading import check_frames, geopandas_and_shapely, mixed_of
from engine.layers.frames import frame_of_left
from engine.layers.limits import Limits
from engine.layers.pieces import narrow_rings, split_rows
from engine.layers.shapes import AREA, LINE
from engine.running.budget import Cancel
from engine.solids.ragged import summed

if TYPE_CHECKING:
    from geopandas import GeoDataFrame


def split(
    layer: GeoDataFrame, lines: GeoDataFrame, *, workers: int | None = None, deadline: float | None = None,
    cancel: Cancel | None = None,
) -> GeoDataFrame:  # fmt: skip
    """Split the polygons of a layer by lines, a row for each piece.

    Parameters
    ----------
    layer, lines : GeoDataFrame
        Of polygons, and of lines.
    workers, deadline, cancel
        As for `engine.locate`.

    Returns
    -------
    GeoDataFrame
        The pieces of each feature, with its index and attributes; one that no line splits is a row for each of its
        parts.

    Raises
    ------
    EngineError
        As `overlay`.

    Notes
    -----
    Boundary, accuracy, cost: as `engine.split`; features that no line is near take some 15 us.

    References
    ----------
    shapely.ops.split.

    Examples
    --------
    >>> import geopandas, shapely, engine
    >>> fields = geopandas.GeoDataFrame({"owner": ["Ada"]}, geometry=[shapely.box(0, 0, 2, 2)])
    >>> roads = geopandas.GeoDataFrame(geometry=[shapely.LineString([(1, -1), (1, 3)])])
    >>> engine.layers.split(fields, roads).geometry.area.tolist()
    [2.0, 2.0]
    """
    check_frames("split", {}, layer=layer, lines=lines)
    limits = Limits(deadline, cancel, workers)
    sides = mixed_of(layer, "layer", limits, (AREA,)), mixed_of(lines, "lines", limits, (LINE,))
    return frame_of_left(layer, split_rows(*sides, limits))


def slivers(
    layer: GeoDataFrame, min_width: float, *, deadline: float | None = None, cancel: Cancel | None = None
) -> GeoDataFrame:
    """List the pieces of polygons that are narrower than a distance.

    Parameters
    ----------
    layer : GeoDataFrame
        Of polygons; nothing of it changes.
    min_width : float
        Pieces of at least this width are not listed.
    deadline, cancel
        As for `engine.locate`.

    Returns
    -------
    GeoDataFrame
        A row for each such piece, with the index of its feature, `part`, its number in the feature, and `width`.

    Raises
    ------
    EngineError
        As `overlay`.

    Notes
    -----
    The width of a piece is the least distance of two parallel lines between which it lies; that of its convex hull. A
    thin piece that bends is as wide as what it bends around. Exact: the square of a width is a fraction; `width` is the
    double nearest to it. Degenerate input: a piece without area is 0 wide. Cost: some 50 ns a vertex, and some
    microseconds a vertex of pieces whose area divided by the diagonal of their box is below `min_width`.

    References
    ----------
    M. E. Houle, G. T. Toussaint, Computing the width of a set, 1988.

    Examples
    --------
    >>> import geopandas, shapely, engine
    >>> fields = geopandas.GeoDataFrame(geometry=[shapely.box(0, 0, 2, 2), shapely.box(0, 0, 9, 0.25)])
    >>> engine.layers.slivers(fields, 0.5).width.tolist()
    [0.25]
    """
    check_frames("slivers", {}, layer=layer)
    geopandas, shapely = geopandas_and_shapely()
    limits = Limits(deadline, cancel)
    mixed_of(layer, "layer", limits, (AREA,))
    parts, owners = shapely.get_parts(np.asarray(layer.geometry.array), return_index=True)
    parts, owners = parts[~shapely.is_empty(parts)], owners[~shapely.is_empty(parts)]
    places, of_parts = shapely.get_coordinates(shapely.get_exterior_ring(parts), return_index=True)
    offsets = summed(np.bincount(of_parts, minlength=len(parts)))
    narrow = narrow_rings(places, offsets, np.arange(len(parts)), min_width, limits)
    chosen = np.array([k for k, _ in narrow], np.int64)
    numbers = np.arange(len(parts)) - np.searchsorted(owners, owners)
    columns = {"part": numbers[chosen], "width": [width for _, width in narrow]}
    return geopandas.GeoDataFrame(
        columns, geometry=list(parts[chosen]), index=layer.index[owners[chosen]], crs=layer.crs
    )
