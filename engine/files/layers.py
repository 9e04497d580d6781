"""Layers from files: GeoJSON by the reader here, all other formats through geopandas (extra ``geo``)."""

from __future__ import annotations

import io
import json
import os
from importlib import import_module
from typing import Any

from engine.errors import InvalidInputError
from engine.files.octets import File, as_text, read_octets
from engine.solids.checks import shown


def read_layer(file: File) -> dict[str, Any]:
    """Return the features of a file as a GeoJSON FeatureCollection, for `engine.layers` and wherever polygons are.

    Parameters
    ----------
    file : path, file object or bytes
        GeoJSON as text, recognised by its contents; anything else that geopandas reads (GeoPackage, Shapefile,
        FlatGeobuf, GML, Parquet), with the extra `geo`.

    Returns
    -------
    dict
        A FeatureCollection; a single feature or geometry becomes a collection of one. What it has besides `features`
        (`crs`, `bbox`, `name`) stays.

    Raises
    ------
    InvalidInputError
        The file is not there or cannot be read, is JSON but no GeoJSON, or geopandas is not installed.

    Notes
    -----
    Nothing is repaired or reprojected; coordinates are the doubles of the file. A GeoDataFrame needs no file:
    `engine.layers` takes it as it is.

    Cost: linear.

    References
    ----------
    RFC 7946 (GeoJSON).

    Examples
    --------
    >>> from engine import read_layer
    >>> point = b'{"type": "Point", "coordinates": [1, 2]}'
    >>> read_layer(point)["features"][0]["geometry"]["coordinates"]
    [1, 2]
    """
    octets, suffix = read_octets(file)
    is_path = isinstance(file, (str, os.PathLike))
    name = str(file) if is_path else "the file"
    if octets.removeprefix(b"\xef\xbb\xbf").lstrip()[:1] == b"{":
        return collection_in(as_text(octets, name), name)
    if suffix in ("json", "geojson") or not octets:
        raise InvalidInputError(f"{name} is no GeoJSON: it begins with {shown(octets[:20])}", ("file",))
    try:
        geopandas = import_module("geopandas")
    except ImportError:
        raise InvalidInputError(
            f"{name}: layers other than GeoJSON need the package geopandas: pip install 'exact-geometry[geo]'",
            ("file",),
        ) from None
    try:
        given: Any = file if is_path else io.BytesIO(octets)  # a Shapefile is several files
        frame = geopandas.read_parquet(given) if suffix == "parquet" else geopandas.read_file(given)
    except Exception as error:  # whatever the bytes lead its readers to
        raise InvalidInputError(
            f"{name} cannot be read as a layer: {type(error).__name__}: {error!s:.200}", ("file",)
        ) from error
    made: dict[str, Any] = json.loads(frame.to_json(drop_id=True))
    return made


def collection_in(text: str, name: str) -> dict[str, Any]:
    """Return the FeatureCollection of a GeoJSON text; a single feature or geometry becomes a collection of one."""
    try:
        value = json.loads(text)
    except ValueError as error:
        raise InvalidInputError(f"{name} is not JSON: {error}", ("file",)) from None
    except RecursionError:
        raise InvalidInputError(f"{name} is nested too deeply", ("file",)) from None
    kind = value.get("type") if isinstance(value, dict) else None
    if kind == "FeatureCollection":
        return dict(value)
    if not isinstance(kind, str) or not (kind == "Feature" or "coordinates" in value or "geometries" in value):
        raise InvalidInputError(f"{name} is JSON, but no GeoJSON: its type is {shown(kind)}", ("type",))
    feature = value if kind == "Feature" else {"type": "Feature", "properties": None, "geometry": value}
    return {"type": "FeatureCollection", "features": [feature]}
