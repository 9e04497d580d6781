"""Solids and positions from what people hold: GeoJSON, geometries and meshes of other packages, plain arrays.

Other packages are recognised by the attributes that their objects have; none is imported. Nothing is repaired: what a
constructor of `engine.solids` refuses is refused here with the same error.

| held | becomes |
| --- | --- |
| GeoJSON Polygon, MultiPolygon and collections of them, as a dict or `__geo_interface__` | Polygon, all parts united |
| trimesh.Trimesh, pyvista.PolyData, open3d's legacy and tensor meshes, meshio.Mesh | Polyhedron |
| a pair (vertices (n, 3), faces (m, k)) | Polyhedron |
| positions (n, 2), or a list of rings | Polygon |
| GeoJSON Point, MultiPoint, LineString, MultiLineString and collections of one of these kinds | positions, lines |
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from engine.errors import EngineError, InvalidArrayError, InvalidInputError, UnsupportedSolidError
from engine.running.budget import Budget, Cancel, current, polled, reading
from engine.solids.base import Solid
from engine.solids.checks import Where, as_points, shown, spell
from engine.solids.geometries import MEMBERS, as_list, coordinates_of, geometries_in, geometry_of, note_altitude
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.poses import axes_of
from engine.types import FloatArray

_TAKEN: Final = (
    "GeoJSON, an object with __geo_interface__, a mesh of trimesh, pyvista, open3d or meshio, (vertices, faces), "
    "or rings"
)


def as_solid(value: object, *where: str | int) -> Solid:
    """Return a solid as it is, and what people hold in place of one as a `Polygon` or `Polyhedron`.

    where: the path of the argument, for errors. Raises: UnsupportedSolidError for what is none of the table above, and
    as the constructors, with the path below that.
    """
    if isinstance(value, Solid):
        return value
    try:
        solid = _from_geojson(value, current()) or _from_mesh(value) or _from_arrays(value)
    except EngineError as error:
        raise error.at(*where) from None
    except (MemoryError, KeyboardInterrupt, Warning):
        raise
    except Exception as error:  # whatever the attributes and items of a caller's object raise
        raise InvalidInputError(
            f"{spell(where)}: a {type(value).__name__} that cannot be read: {type(error).__name__}: {error!s:.100}",
            where,
        ) from error
    if solid is None:
        got = f"{type(value).__name__} {shown(value)}"
        raise UnsupportedSolidError(f"{spell(where)} must be a solid, {_TAKEN}; got {got}", where)
    return solid


def read_argument(
    value: object, deadline: float | None, cancel: Cancel | None, where: str = "solid"
) -> tuple[Solid, float | None]:
    """Return an argument as `as_solid`, read within a deadline, and what is left of that."""
    if isinstance(value, Solid):
        return value, deadline
    with reading(deadline, cancel) as reader:
        return as_solid(value, where), reader.left()


def as_solids(values: Any, *where: str | int) -> Sequence[Any]:
    """Return a list of solids, each as `as_solid`; of a FeatureCollection (a GeoSeries) or GeometryCollection one a
    member, an empty polygon where a feature has no geometry. where: the path of the list.

    Raises: InvalidArrayError for what is no list, and as `as_solid`.
    """
    if not isinstance(values, (list, tuple)):
        geometry = geometry_of(values) or {}
        kind = geometry.get("type", "")
        members = geometry.get(MEMBERS.get(kind, ""))
        if kind == "Feature" or not isinstance(members, (list, tuple)):
            raise InvalidArrayError(f"{spell(where)} must be a list of polygons, got {type(values).__name__}", where)
        values = [Polygon([]) if each is None else each for each in members]  # a null geometry of a Feature: the same
    if all(issubclass(kind, Solid) for kind in set(map(type, values))):
        return values
    return [as_solid(each, *where, number) for number, each in enumerate(polled(values))]


def _from_geojson(value: Any, budget: Budget) -> Polygon | None:
    """Return the polygons of a GeoJSON object as one, parts united; altitudes are left out (RFC 7946, 3.1.1)."""
    geometry = geometry_of(value)
    if geometry is None:
        return None
    plane: list[Any] = []
    has_altitude = False
    for place, each in geometries_in(geometry, once=True):  # a part that is there twice adds nothing
        if each is None:
            continue
        kind = each["type"]
        if kind not in ("Polygon", "MultiPolygon"):
            uses = "clip_lines takes lines" if "Line" in kind else "locate takes points"
            raise UnsupportedSolidError(f"a {kind} is no solid: {uses}", (*place, "type"))
        coordinates, path = coordinates_of(each, place), (*place, "coordinates")
        for k, part in enumerate([coordinates] if kind == "Polygon" and len(coordinates) else coordinates):
            at = path if kind == "Polygon" else (*path, k)
            rings = [_positions(ring, (*at, j)) for j, ring in enumerate(as_list(part, at))]
            has_altitude |= any(ring.shape[1] == 3 for ring in rings)
            plane.append([ring[:, :2] for ring in rings])
    if has_altitude:
        note_altitude("the polygons")
    read, _ = Polygon.geojson
    return read({"type": "MultiPolygon", "coordinates": plane}, budget)


Polygon._from_geojson = _from_geojson


def _positions(positions: Any, where: Where) -> FloatArray:
    """Return positions (n, 2), or (n, 3) where each has three numbers: longitude, latitude, altitude."""
    rows = as_list(positions, where)
    if isinstance(rows, np.ndarray):
        is_tall = rows.ndim == 2 and rows.shape[1] == 3
    else:
        is_tall = bool(rows) and all(isinstance(each, (list, tuple, np.ndarray)) and len(each) == 3 for each in rows)
    return as_points(rows, 3 if is_tall else 2, where)


def _from_mesh(value: Any) -> Polyhedron | None:
    """Return the mesh of another package as a polyhedron."""
    arrays = mesh_arrays_of(value)
    if arrays is None:
        return None
    vertices, faces = arrays
    corners = vertices if isinstance(vertices, np.ndarray) else np.asarray(vertices)
    return Polyhedron(corners, faces if isinstance(faces, (list, np.ndarray)) else np.asarray(faces))


def mesh_arrays_of(value: Any) -> tuple[Any, Any] | None:
    """Return (vertices, faces), unchecked, of a mesh of trimesh, open3d, pyvista or meshio, known by its attributes;
    None for anything else."""
    if hasattr(value, "vertices") and hasattr(value, "faces"):  # trimesh
        return value.vertices, value.faces
    if hasattr(value, "vertices") and hasattr(value, "triangles"):  # open3d, legacy
        return value.vertices, value.triangles
    if hasattr(value, "vertex") and hasattr(value, "triangle"):  # open3d, tensors
        return value.vertex["positions"].numpy(), value.triangle["indices"].numpy()
    if hasattr(value, "points") and hasattr(value, "faces"):  # pyvista: [n, i, j, ..., n, i, j, ...]
        return value.points, _unpadded(np.asarray(value.faces))
    if hasattr(value, "points") and hasattr(value, "cells"):  # meshio: blocks of one type each
        return value.points, [face for block in value.cells for face in _faces_in(block)]
    return None


def _unpadded(flat: Any) -> list[list[int]]:
    """Return the faces of a flat list in which each stands behind its number of corners."""
    if flat.ndim != 1 or flat.dtype.kind not in "iu":
        raise InvalidArrayError(
            f"faces must be one row of whole numbers, got dtype {flat.dtype} and shape {flat.shape}", ("faces",)
        )
    faces, at = [], 0
    while at < len(flat):  # bound: each turn goes on by 1 or more
        n = int(flat[at])
        if not 0 < n < len(flat) - at:
            raise InvalidArrayError(
                f"faces[{at}] is {n}, the number of corners of a face that is not there", ("faces",)
            )
        faces.append(flat[at + 1 : at + 1 + n].tolist())
        at += n + 1
    return faces


def _faces_in(block: Any) -> list[list[int]]:
    """Return the faces of a block of meshio's cells; vertices and lines bound nothing and are left out."""
    if block.type not in ("triangle", "quad", "polygon", "vertex", "line"):
        raise UnsupportedSolidError(
            f"cells of type {block.type!r} are no faces; give the surface of the mesh", ("cells",)
        )
    return np.asarray(block.data).tolist() if block.type not in ("vertex", "line") else []


def _from_arrays(value: Any) -> Solid | None:
    """Return the solid of a pair (vertices, faces), of one ring (n, 2), or of a list of rings."""
    if (
        isinstance(value, tuple)
        and len(value) == 2
        and axes_of(value[0]) == 2
        and len(value[0])
        and len(value[0][0]) == 3
    ):
        return Polyhedron(value[0], value[1])
    axes = axes_of(value)
    if axes == 2:
        return Polygon([value])
    return Polygon(value if isinstance(value, (list, tuple)) else list(value)) if axes == 3 else None
