"""Reads solids from files (meshes, GeoJSON polygons, the JSON of the HTTP interface), and arrays from and to files."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from engine.errors import InvalidArrayError, InvalidInputError
from engine.files.layers import collection_in, open_output, read_layer
from engine.files.meshes import FORMATS, read_mesh
from engine.files.octets import read_text
from engine.layers.geojson import polygon_of
from engine.solids.base import Solid
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.registry import solid_types
from engine.types import FloatArray

POSITIONS: Final = {
    "Point": lambda at: [at], "MultiPoint": list, "LineString": lambda at: [at], "MultiLineString": list,
}  # fmt: skip
"""By type of a GeoJSON geometry, the function from its coordinates to a list of items."""


def read_rows(source: str, shape: tuple[int, ...]) -> FloatArray:
    """Return an array ``(n, *shape)``; a -1 in `shape` is the dimension of the file.

    | suffix | contents |
    | --- | --- |
    | .npy | any array of that many numbers a row |
    | .csv | a row a line, a header is skipped |
    | .geojson, .json | points, or line strings of two positions |
    """
    path = Path(source)
    suffix = path.suffix.lower()
    if suffix == ".npy":
        array = np.load(path, allow_pickle=False)
    elif suffix == ".csv":
        array = _read_csv(path)
    elif suffix in (".json", ".geojson"):
        array = np.array(_positions(_parsed(read_text(path), source)))
    else:
        raise InvalidInputError(f"{source}: numbers are read from .npy, .csv or .geojson", ("file",))
    if not array.size:
        return np.zeros((0, *map(abs, shape)))
    try:
        return array.reshape((len(array), *shape)) if array.ndim else array.reshape(shape)
    except ValueError:
        wanted = " x ".join("dimension" if size < 0 else str(size) for size in shape)
        raise InvalidArrayError(
            f"{source}: rows of {wanted} numbers expected, the shape is {array.shape}", ()
        ) from None


def _read_csv(path: Path) -> FloatArray:
    lines = read_text(path).splitlines()
    try:
        [float(cell) for cell in lines[0].split(",")] if lines else []
        header = 0
    except ValueError:
        header = 1
    if len(lines) <= header:
        return np.zeros((0, 0))
    try:
        return np.loadtxt(lines, delimiter=",", skiprows=header, ndmin=2)
    except ValueError as error:
        raise InvalidArrayError(f"{path}: {error}", ("file",)) from None


def _positions(value: Any) -> list[Any]:
    kind = value.get("type") if isinstance(value, dict) else None
    if kind == "FeatureCollection":
        return [item for feature in value["features"] for item in _positions(feature)]
    if kind == "Feature":
        return _positions(value["geometry"])
    if kind in POSITIONS:
        return POSITIONS[kind](value["coordinates"])
    raise InvalidInputError(f"points and line strings are read from GeoJSON, got {kind!r}", ("type",))


def write_table(target: str | None, columns: dict[str, npt.NDArray[Any]]) -> None:
    """Write columns of equal length, ``(n,)`` or ``(n, k)`` each: .npz by name, .npy if there is one column, else .csv.

    target: a path; None: .csv to the standard output. Doubles are written so that they read back the same.
    """
    suffix = "" if target is None else Path(target).suffix.lower()
    if suffix == ".npy" and len(columns) == 1:
        np.save(str(target), next(iter(columns.values())))
    elif suffix == ".npz":
        np.savez(str(target), **columns)  # type: ignore[arg-type]
    elif suffix in ("", ".csv"):
        with open_output(target) as file:
            file.write(_csv(columns))
    else:
        several = "" if len(columns) == 1 else " (one .npy array cannot hold several columns)"
        raise InvalidInputError(f"{target}: this answer is written to .csv, .npy or .npz{several}", ("output",))


def _csv(columns: dict[str, npt.NDArray[Any]]) -> str:
    names, lists = [], []
    for name, column in columns.items():
        flat = column.reshape(len(column), -1)
        names += [name] if flat.shape[1] == 1 else [f"{name}_{i}" for i in range(flat.shape[1])]
        lists += [map(repr, flat[:, i].tolist()) if column.dtype.kind != "U" else flat[:, i].tolist()
                  for i in range(flat.shape[1])]  # fmt: skip
    return "\n".join([",".join(names), *map(",".join, zip(*lists, strict=True))]) + "\n"


def write_mesh(target: str | None, vertices: FloatArray, faces: npt.NDArray[Any]) -> None:
    """Write a mesh of triangles: .npz, else as OFF. target: a path; None: OFF to the standard output."""
    suffix = "" if target is None else Path(target).suffix.lower()
    if suffix == ".npz":
        np.savez(str(target), vertices=vertices, faces=faces)
        return
    if suffix not in ("", ".off"):
        raise InvalidInputError(f"{target}: a mesh is written to .off or .npz", ("output",))
    rows = [" ".join(map(repr, row)) for row in vertices.tolist()]
    rows += [f"3 {a} {b} {c}" for a, b, c in faces.tolist()]
    with open_output(target) as file:
        file.write("\n".join(["OFF", f"{len(vertices)} {len(faces)} 0", *rows]) + "\n")


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
    """Return all solids of `source`: several only for a GeoJSON collection."""
    if source.lstrip().startswith("{"):
        return from_json(_parsed(source, "the argument"))
    path = Path(source)
    suffix = path.suffix.lower().removeprefix(".")
    if suffix in FORMATS:
        mesh = read_mesh(path, suffix)
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
        return from_json(_parsed(read_text(path), source))
    raise InvalidInputError(
        f"{source}: a solid is read from {', '.join('.' + name for name in FORMATS)}, .npz, .json or .geojson",
        ("file",),
    )


def read_features(source: str) -> Any:
    """Return the FeatureCollection of a file (`read_layer`), or of GeoJSON itself."""
    if source.lstrip().startswith("{"):
        return collection_in(source, "the argument")
    return read_layer(source)


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
