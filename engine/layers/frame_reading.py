"""GeoDataFrames as layers of flat arrays; errors name the feature."""

from __future__ import annotations

import ctypes
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from engine.errors import EngineError, InvalidInputError, NotFiniteError, UnsupportedSolidError
from engine.layers.limits import Limits
from engine.layers.rows import layer_of
from engine.layers.shapes import AREA, LINE, POINT, MixedLayer, Paths, no_areas, no_paths
from engine.layers.wrapping import cut_parts
from engine.polygon_overlay.pair_arrays import arrays_of
from engine.solids.checks import shown
from engine.solids.ragged import summed, within
from engine.types import BoolArray, FloatArray, Int8Array, IntArray, read_only

if TYPE_CHECKING:
    from geopandas import GeoDataFrame

_DIMS = np.array([POINT, LINE, LINE, AREA, POINT, LINE, AREA, -1, -1], np.int8)
"""Dimension by type number of shapely, -1 for collections and for none."""
_POLYGON, _MULTILINE = 3, 5
"""Type numbers of shapely."""
NOUNS = "points", "lines", "polygons"


def geopandas_and_shapely() -> tuple[Any, Any]:
    """Import geopandas and shapely and return them; raise if they are not installed."""
    try:
        import geopandas
        import shapely
    except ImportError:
        raise InvalidInputError("GeoDataFrames need geopandas: pip install 'exact-geometry[geo]'", ()) from None
    return geopandas, shapely


def check_frames(function: str, others: Any, taken: tuple[str, ...] = (), **frames: object) -> None:
    """Raise for an argument among `frames` that is no GeoDataFrame, and for an option among `others`, which this
    function does not have (though geopandas may). function: its name, for messages; taken: names of further options
    that it accepts."""
    geopandas, _ = geopandas_and_shapely()
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


def refused(error: type[EngineError], frame: GeoDataFrame, where: tuple[str, int], what: str) -> EngineError:
    name, place = where
    return error(f"{name}[{place}] (index {frame.index[place]}) {what}", where)


def dims_of(geometries: Any) -> Int8Array:
    """Return the dimension of each geometry, -1 for collections and for none."""
    _, shapely = geopandas_and_shapely()
    return _DIMS[shapely.get_type_id(np.asarray(geometries))]


def mixed_of(
    frame: GeoDataFrame, name: str, limits: Limits, kinds: tuple[int, ...] = (POINT, LINE, AREA)
) -> MixedLayer:
    """Return the geometry of a frame as a layer; raise for a GeometryCollection, a dimension not among `kinds`, or NaN.
    name: of the argument, for messages. Altitudes are left out. The layer stays with the array of geometries, as the
    index of geopandas does, and serves again while its elements are the same objects, which are immutable."""
    geometries = frame.geometry.array
    array = np.asarray(geometries)
    known = None if limits.wrap else getattr(geometries, "_exact_layer", None)
    if known is not None and len(known[0]) == len(array) and (_addresses(known[0]) == _addresses(array)).all():
        if np.isin(known[1].dims, (*kinds, -1)).all():
            return cast(MixedLayer, known[1])
    made = _mixed_of(frame, array, name, limits, kinds)
    if not limits.wrap:
        geometries._exact_layer = array.copy(), made
    return made


def _addresses(array: Any) -> IntArray:
    """Return the addresses of the objects in an array."""
    array = np.ascontiguousarray(array)
    octets = (ctypes.c_char * array.nbytes).from_address(array.ctypes.data) if len(array) else b""
    return np.frombuffer(octets, np.int64).copy()


def _mixed_of(frame: GeoDataFrame, array: Any, name: str, limits: Limits, kinds: tuple[int, ...]) -> MixedLayer:
    _, shapely = geopandas_and_shapely()
    types = shapely.get_type_id(array)
    dims, is_missing = _DIMS[types], types < 0
    is_filled = ~is_missing & ~shapely.is_empty(array)
    if len(wrong := np.flatnonzero(is_filled & ~np.isin(dims, kinds))):
        nouns = " or ".join(NOUNS[kind] for kind in kinds)
        what = f"is a {array[wrong[0]].geom_type}; {name} takes {nouns}{'; explode it' if types[wrong[0]] > 6 else ''}"
        raise refused(UnsupportedSolidError, frame, (name, int(wrong[0])), what)
    dims[~is_filled] = -1
    paths = _paths(frame, name, array, dims)
    is_area = dims == AREA
    there = np.flatnonzero(is_area)
    if not len(there):
        return MixedLayer(replace(no_areas(len(array)), is_missing=is_missing), paths)
    if not (shapely.get_num_interior_rings(array[there]) | (types[there] != _POLYGON)).any():  # twice as fast
        positions, of_rings = shapely.get_coordinates(array[there], return_index=True)
        rings = summed(np.bincount(of_rings, minlength=len(there)))
        parts_of = ends = np.arange(len(there) + 1)
    else:
        _, positions, (rings, parts_of, *several) = shapely.to_ragged_array(array[there], include_z=False)
        ends = several[0] if several else np.arange(len(there) + 1)
    if (broken := _first_broken(positions)) >= 0:
        owner = there[within(ends, within(parts_of, within(rings, np.array([broken]))))]
        raise refused(NotFiniteError, frame, (name, int(owner[0])), f"holds {positions[broken].tolist()}")
    counts = np.zeros(len(array), np.int64)
    counts[there] = np.diff(ends)
    in_degrees = bool(frame.crs and frame.crs.is_geographic)
    parts = arrays_of(positions, rings, parts_of)
    refuse = partial(refused, InvalidInputError, frame)
    cut = cut_parts(parts, summed(counts), in_degrees, limits, lambda k, what: refuse((name, k), what))
    areas = layer_of(*cut, is_missing, limits)
    return MixedLayer(areas, paths)


def _first_broken(positions: FloatArray) -> int:
    """Return the first position that is not finite, -1 if there is none."""
    is_finite = np.isfinite(positions)
    return -1 if is_finite.all() else int(np.argmin(is_finite)) // 2


def _paths(frame: GeoDataFrame, name: str, array: Any, dims: Any) -> Paths:
    """Return the points and lines of a frame. dims: by feature, -1 for empty ones."""
    _, shapely = geopandas_and_shapely()
    is_path: BoolArray = (dims >= 0) & (dims < AREA)
    there = np.flatnonzero(is_path)
    if not len(there):
        return no_paths(len(array))
    some, owners = array[there], np.arange(len(there))
    if (shapely.get_type_id(some) == _MULTILINE).any():
        some, owners = shapely.get_parts(some, return_index=True)
    vertices, of_parts = shapely.get_coordinates(some, return_index=True)
    if (are_points := dims[there[owners]] == POINT).any():  # each vertex is a path
        is_point = are_points[of_parts]
        firsts = np.append(True, of_parts[1:] != of_parts[:-1])
        owners, of_parts = owners[of_parts[is_point | firsts]], np.cumsum(is_point | firsts) - 1
    if (broken := _first_broken(vertices)) >= 0:
        owner = int(there[owners[of_parts[broken]]])
        raise refused(NotFiniteError, frame, (name, owner), f"holds {vertices[broken].tolist()}")
    counts = np.bincount(there[owners], minlength=len(array))
    sizes = np.bincount(of_parts, minlength=len(owners))
    return Paths(np.where(is_path, dims, -1).astype(np.int8), read_only(vertices + 0.0), summed(sizes), summed(counts))
