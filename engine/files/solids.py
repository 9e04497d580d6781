"""Solids from files: meshes, GeoJSON polygons, and the JSON of the HTTP interface."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from engine.errors import InvalidInputError
from engine.files.meshes import FORMATS, read_mesh
from engine.layers.geojson import polygon_of
from engine.solids.base import Solid
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.registry import solid_types

Note = Callable[[str], object]


def read_solid(source: str, note: Note | None = None) -> Solid:
    """Return the one solid that `source` names.

    source: a mesh file (.stl, .obj, .ply, .off, .glb), an .npz file of `vertices` and `faces`, a .json file with a
    solid as the HTTP interface writes it, a .geojson file with one polygon, or the JSON of a solid itself. note: called
    with a sentence where triangles are left out.
    """
    solids = read_solids(source, note)
    if len(solids) != 1:
        raise InvalidInputError(f"{source} holds {len(solids)} polygons; this command takes one solid", ("file",))
    return solids[0]


def read_solids(source: str, note: Note | None = None) -> list[Solid]:
    """Return all solids of `source`: several only where it is a GeoJSON collection."""
    if source.lstrip().startswith("{"):
        return from_json(_parsed(source, "the argument"))
    path = Path(source)
    suffix = path.suffix.lower().removeprefix(".")
    if suffix in FORMATS:
        with path.open("rb") as file:
            mesh = read_mesh(file, suffix)
        if mesh.n_collapsed and note is not None:
            note(f"{source}: {mesh.n_collapsed} triangles have two equal corners and are left out")
        return [mesh.solid()]
    if suffix == "npz":
        with np.load(path, allow_pickle=False) as arrays:
            missing = {"vertices", "faces"} - set(arrays.files)
            if missing:
                raise InvalidInputError(f"{source} has no array named {sorted(missing)[0]!r}", ("file",))
            return [Polyhedron(arrays["vertices"], arrays["faces"])]
    if suffix in ("json", "geojson"):
        return from_json(_parsed(path.read_text("utf-8"), source))
    raise InvalidInputError(
        f"{source}: a solid is read from {', '.join('.' + name for name in FORMATS)}, .npz, .json or .geojson",
        ("file",),
    )


def read_features(source: str) -> Any:
    """Return the FeatureCollection of a GeoJSON file; a feature or a geometry alone is one of one feature."""
    value = _parsed(source if source.lstrip().startswith("{") else Path(source).read_text("utf-8"), source)
    if not isinstance(value, dict) or value.get("type") == "FeatureCollection":
        return value
    feature = value if value.get("type") == "Feature" else {"type": "Feature", "properties": None, "geometry": value}
    return {"type": "FeatureCollection", "features": [feature]}


def from_json(value: Any) -> list[Solid]:
    """Return the solids of a parsed JSON or GeoJSON value; the parts of a multipolygon are united."""
    kind = value.get("type") if isinstance(value, dict) else None
    try:
        if kind == "FeatureCollection":
            return [solid for feature in value["features"] for solid in from_json(feature)]
        if kind == "GeometryCollection":
            return [solid for geometry in value["geometries"] for solid in from_json(geometry)]
        if kind == "Feature":
            return from_json(value["geometry"])
        if kind == "Polygon":
            return [Polygon(value["coordinates"])]
        if kind == "MultiPolygon":
            return [polygon_of(value)]
        if isinstance(kind, str) and kind in solid_types:
            fields = {name: field for name, field in value.items() if name != "type"}
            if kind == "csg":
                fields["operands"] = [solid for operand in fields["operands"] for solid in from_json(operand)]
            return [solid_types[kind].solid(**fields)]
    except (KeyError, TypeError) as error:
        raise InvalidInputError(f"a {kind} lacks a field or has one too many: {error}", ("type",)) from None
    names = ", ".join(solid_types)
    raise InvalidInputError(
        f"type must be Polygon, MultiPolygon, Feature, FeatureCollection or one of {names}; got {kind!r}", ("type",)
    )


def _parsed(text: str, name: str) -> Any:
    try:
        return json.loads(text)
    except ValueError as error:
        raise InvalidInputError(f"{name} is not JSON: {error}", ("file",)) from None
    except RecursionError:
        raise InvalidInputError(f"{name} is nested too deeply", ("file",)) from None
