"""Layers from files: GeoJSON by the reader here, all other formats through geopandas (extra ``geo``)."""

from __future__ import annotations

import io
import json
import os
import sys
import warnings
from collections.abc import Iterable
from contextlib import AbstractContextManager, nullcontext
from importlib import import_module
from pathlib import Path
from typing import Any, Final, TextIO

from engine.errors import InvalidInputError
from engine.files.octets import File, as_text, read_octets
from engine.solids.checks import shown


def read_layer(file: File) -> dict[str, Any]:
    """Return the features of a file as a GeoJSON FeatureCollection, for `engine.layers` and wherever polygons are.

    Parameters
    ----------
    file : path, file object or bytes
        GeoJSON as text, one object or a feature a line (GeoJSON-seq), recognised by its contents; anything else that
        geopandas reads (GeoPackage, Shapefile, FlatGeobuf, GML, Parquet), with the extra `geo`.

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
    if octets.removeprefix(b"\xef\xbb\xbf").lstrip()[:1] in (b"{", b"\x1e"):
        return collection_in(as_text(octets, name), name)
    if suffix in ("json", "geojson") or not octets:
        raise InvalidInputError(f"{name} is no GeoJSON: it begins with {shown(octets[:20])}", ("file",))
    geopandas = _geopandas(name)
    try:
        given: Any = file if is_path else io.BytesIO(octets)  # a Shapefile is several files
        frame = geopandas.read_parquet(given) if octets.startswith(b"PAR1") else geopandas.read_file(given)
        text = frame.to_json(drop_id=True) if isinstance(frame, geopandas.GeoDataFrame) else None
    except Exception as error:  # whatever the bytes lead its readers to
        raise InvalidInputError(
            f"{name} cannot be read as a layer: {type(error).__name__}: {error!s:.200}", ("file",)
        ) from error
    if text is None:
        raise InvalidInputError(f"{name} has no geometries; its columns are {shown([*frame.columns])}", ("file",))
    made: dict[str, Any] = json.loads(text)
    return made


def collection_in(text: str, name: str) -> dict[str, Any]:
    """Return the FeatureCollection of a GeoJSON text; a single feature or geometry becomes a collection of one."""
    lines = [line for line in text.replace("\x1e", "").split("\n") if line.strip()]
    if len(lines) > 1 and lines[0].rstrip().endswith("}") and lines[1].lstrip().startswith("{"):
        return {"type": "FeatureCollection", "features": [feature_in(*each, name) for each in enumerate(lines, 1)]}
    try:
        value = json.loads(text.replace("\x1e", ""))
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


def feature_in(number: int, line: str, name: str) -> dict[str, Any]:
    """Return the feature, or geometry, in a line of GeoJSON-seq. number: of the line; name: of the file."""
    made: Any = collection_in(line, f"line {number} of {name}").get("features")
    if not isinstance(made, list) or len(made) != 1 or not isinstance(made[0], dict):
        raise InvalidInputError(f"line {number} of {name} is no feature", ("file", number))
    feature: dict[str, Any] = made[0]
    return feature


def write_geojson(
    target: str | None, features: Iterable[dict[str, Any]], crs: Any = None, in_lines: bool = False
) -> None:
    """Write features, whose coordinates may be arrays, one a line; crs: a member of the collection, if any; in_lines:
    without a collection around them (GeoJSON-seq)."""
    with open_output(target) as file:
        if in_lines:
            file.writelines(f"{json.dumps(each, default=lambda array: array.tolist())}\n" for each in features)
            return
        member = "" if crs is None else f'"crs": {json.dumps(crs)}, '
        file.write(f'{{"type": "FeatureCollection", {member}"features": [')
        for number, feature in enumerate(features):
            file.write(",\n" if number else "\n")
            file.write(json.dumps(feature, default=lambda array: array.tolist()))
        file.write("\n]}\n")


def open_output(target: str | None) -> AbstractContextManager[TextIO]:
    return nullcontext(sys.stdout) if target is None else Path(target).open("w", encoding="utf-8")


SEQUENCES: Final = (".geojsonl", ".geojsons", ".ndjson", ".jsonl", ".geojsonseq")
"""Extensions of files with a feature a line."""
_WRITERS: Final = {".gpkg": "GPKG", ".fgb": "FlatGeobuf", ".shp": "ESRI Shapefile", ".parquet": "parquet"}


def write_layer(target: str | None, features: Iterable[dict[str, Any]], crs: Any) -> None:
    """Write features to a file in the format of its extension, GeoJSON if that is none of those of geopandas; to the
    standard output without a target. crs: a member of the collection, if any."""
    suffix = Path(target or "").suffix.lower()
    if suffix not in _WRITERS:
        write_geojson(target, features, crs, in_lines=suffix in SEQUENCES)
        return
    geopandas = _geopandas(str(target))
    flat = []
    for each in features:
        if "geometry" in each["properties"]:
            raise InvalidInputError(f"{target} has no place for a property named geometry; rename it", ("file",))
        more = {
            name: json.dumps(value) for name, value in each.items() if name in ("left", "right", "point", "polygon")
        }
        more |= {name: each[name] for name in ("id", "boundary", "distance") if name in each}
        geometry = each["geometry"] and json.loads(json.dumps(each["geometry"], default=lambda array: array.tolist()))
        flat.append({"type": "Feature", "properties": {**each["properties"], **more}, "geometry": geometry})
    named = crs.get("properties") if isinstance(crs, dict) else None
    name = named.get("name") if isinstance(named, dict) else None
    try:
        frame = geopandas.GeoDataFrame.from_features(flat, crs=name)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that there is no crs
            frame.to_parquet(target) if suffix == ".parquet" else frame.to_file(target, driver=_WRITERS[suffix])
    except Exception as error:  # whatever the features lead its writers to
        raise InvalidInputError(
            f"{target} cannot be written: {type(error).__name__}: {error!s:.200}", ("file",)
        ) from error


def _geopandas(name: str) -> Any:
    try:
        return import_module("geopandas")
    except ImportError:
        raise InvalidInputError(
            f"{name}: layers other than GeoJSON need the package geopandas: pip install 'exact-geometry[geo]'",
            ("file",),
        ) from None
