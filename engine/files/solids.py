"""Solids from files: meshes through trimesh, which is installed with the extra ``formats``, GeoJSON polygons, and the
JSON of the HTTP interface."""

from __future__ import annotations

import io
import json
import logging
import re
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any, Final

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.errors import EmptyGeometryError, IndexOutOfRangeError, InvalidInputError
from engine.layers.features import polygon_of
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.checks import frozen
from engine.solids.convex import Convex
from engine.solids.csg import Csg
from engine.solids.half_space import HalfSpace
from engine.solids.implicit import Implicit
from engine.solids.mesh import first_equal
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.sphere import Sphere
from engine.solids.surface import Surface
from engine.solids.triangle import Triangle

CLASSES: Final[dict[str, Callable[..., Solid]]] = {
    "half_space": HalfSpace, "sphere": Sphere, "aabb": Aabb, "convex": Convex, "polyhedron": Polyhedron,
    "surface": Surface, "triangle": Triangle, "polygon": Polygon, "implicit": Implicit, "csg": Csg,
}  # fmt: skip


def read_solid(source: str) -> Solid:
    """Return the one solid that `source` names.

    source: a mesh file (.stl, .obj, .ply, .off, .glb), an .npz file of `vertices` and `faces`, a .json file with a
    solid as the HTTP interface writes it, a .geojson file with one polygon, or the JSON of a solid itself.
    """
    solids = read_solids(source)
    if len(solids) != 1:
        raise InvalidInputError(f"{source} holds {len(solids)} polygons; this command takes one solid", ("file",))
    return solids[0]


def read_solids(source: str) -> list[Solid]:
    """Return all solids of `source`: several only where it is a GeoJSON collection."""
    if source.lstrip().startswith("{"):
        return from_json(_parsed(source, "the argument"))
    path = Path(source)
    suffix = path.suffix.lower().removeprefix(".")
    if suffix in FORMATS:
        with path.open("rb") as file:
            return [Polyhedron(*read_mesh(file, suffix))]
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
        if kind in CLASSES:
            fields = {name: field for name, field in value.items() if name != "type"}
            if kind == "csg":
                fields["operands"] = [solid for operand in fields["operands"] for solid in from_json(operand)]
            return [CLASSES[kind](**fields)]
    except (KeyError, TypeError) as error:
        raise InvalidInputError(f"a {kind} lacks a field or has one too many: {error}", ("type",)) from None
    raise InvalidInputError(
        f"type must be Polygon, MultiPolygon, Feature, FeatureCollection or one of {', '.join(CLASSES)}; got {kind!r}",
        ("type",),
    )


def _parsed(text: str, name: str) -> Any:
    try:
        return json.loads(text)
    except ValueError as error:
        raise InvalidInputError(f"{name} is not JSON: {error}", ("file",)) from None
    except RecursionError:
        raise InvalidInputError(f"{name} is nested too deeply", ("file",)) from None


FORMATS: Final = ("stl", "obj", "ply", "off", "glb")


_NAMES: Final = re.compile(rb"^[ \t]*(?:g|o|s|usemtl|mtllib)(?:[ \t][^\r\n]*)?$", re.MULTILINE)
"""Lines of an OBJ file that say nothing of its shape: trimesh's time grows with their number squared."""


def read_mesh(file: IO[bytes], file_format: str) -> tuple[FloatArray, IntArray]:
    """Return the vertices and the triangles of a mesh file, for `Polyhedron` or `Surface`, which check them.

    Vertices at equal coordinates become one, in the order of the file; nothing else is repaired, and polygons are cut
    into triangles. Nothing that the file names is read.

    Parameters: file: open for reading bytes; file_format: stl, obj, ply, off or glb.
    Returns: vertices ``(n, 3) float64`` and indices of them ``(m, 3) int64``.
    Accuracy: coordinates are those of the file: decimals become the nearest double, single precision is exact in
    double. The meshes of a GLB scene are put together; a node's transform is applied in floating point, so that its
    coordinates are rounded once.
    Raises: InvalidInputError for another format, a file that cannot be read, or where trimesh is not installed;
    EmptyGeometryError for a file without faces; IndexOutOfRangeError where a face names a vertex that is not there.
    """
    if file_format not in FORMATS:
        raise InvalidInputError(f"format must be one of {', '.join(FORMATS)}, got {file_format!r}", ("format",))
    try:
        import trimesh
    except ImportError:
        raise InvalidInputError(
            "mesh files need the package trimesh: pip install 'exact-geometry[formats]'", ("format",)
        ) from None
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)  # its warnings about repairs that we do not ask for
    try:
        if file_format == "obj":
            file = io.BytesIO(_NAMES.sub(b"", file.read()))
        with np.errstate(all="ignore"):
            scene = trimesh.load_scene(
                file, file_type=file_format, process=False, maintain_order=True, skip_materials=True
            )
            mesh = scene.to_mesh()
            vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    except MemoryError:
        raise
    except Exception as error:  # the parsers raise whatever the bytes lead them to
        raise InvalidInputError(
            f"the file cannot be read as {file_format}: {type(error).__name__}: {error!s:.200}", ("file",)
        ) from error
    if not len(faces):
        raise EmptyGeometryError(f"the {file_format} file holds no faces", ("file",))
    if len(beyond := np.argwhere((faces < 0) | (faces >= len(vertices)))):
        face, corner = beyond[0].tolist()
        raise IndexOutOfRangeError(
            f"triangle {face} names vertex {faces[face, corner]}, the file holds {len(vertices)}; correct the file",
            ("file",),
        )
    return _merged(vertices, faces)


def _merged(vertices: Any, faces: Any) -> tuple[FloatArray, IntArray]:
    """Return the vertices at different coordinates in their first order, and the faces with their new indices."""
    first = first_equal(frozen(vertices))
    if first is None:
        return vertices, faces
    is_first = first == np.arange(len(first))
    return vertices[is_first], (np.cumsum(is_first) - 1)[first][faces]
