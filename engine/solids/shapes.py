"""Solids, positions and poses from what people hold: GeoJSON, geometries and meshes of other packages, plain arrays.

Other packages are recognised by the attributes that their objects have; none is imported. Nothing is repaired: what a
constructor of `engine.solids` refuses is refused here with the same error.

| held | becomes |
| --- | --- |
| GeoJSON Polygon, MultiPolygon and collections of them, as a dict or `__geo_interface__` | Polygon, all parts united |
| trimesh.Trimesh, pyvista.PolyData, open3d's legacy and tensor meshes, meshio.Mesh | Polyhedron |
| a pair (vertices (n, 3), faces (m, k)) | Polyhedron |
| positions (n, 2), or a list of rings | Polygon |
| GeoJSON Point, MultiPoint, LineString, MultiLineString and collections of one of these kinds | positions, lines |
| a matrix (d + 1, d + 1), a pair (rotation, translation), an object with `as_matrix` (scipy's Rotation) | Pose |
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from engine.errors import EngineError, InvalidArrayError, UnsupportedSolidError, WrongDimensionError
from engine.solids.base import Solid
from engine.solids.checks import as_points, shown, spell
from engine.solids.geometries import coordinates_of, geometries_in, geometry_of
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.pose import Pose
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
        solid = _from_geojson(value) or _from_mesh(value) or _from_arrays(value)
    except EngineError as error:
        raise error.at(*where) from None
    except Exception as error:  # whatever the parts of an object raise that is none of those above
        raise InvalidArrayError(
            f"{spell(where)} cannot be read as a solid: {type(error).__name__}: {error!s:.100}", where
        ) from error
    if solid is None:
        got = f"{type(value).__name__} {shown(value)}"
        raise UnsupportedSolidError(f"{spell(where)} must be a solid, {_TAKEN}; got {got}", where)
    return solid


def as_solids(values: Any, *where: str | int) -> Sequence[Any]:
    """Return a list of solids, each as `as_solid`; of a FeatureCollection (a GeoSeries) or GeometryCollection one a
    member, an empty polygon where a feature has no geometry. where: the path of the list.

    Raises: InvalidArrayError for what is no list, and as `as_solid`.
    """
    if not isinstance(values, (list, tuple)):
        geometry = geometry_of(values) or {}
        members = geometry.get("features", geometry.get("geometries"))
        if not isinstance(members, (list, tuple)):
            raise InvalidArrayError(f"{spell(where)} must be a list of polygons, got {type(values).__name__}", where)
        values = [Polygon([]) if _has_no_geometry(each) else each for each in members]
    if all(isinstance(each, Solid) for each in values):
        return values
    return [as_solid(each, *where, number) for number, each in enumerate(values)]


def _has_no_geometry(member: Any) -> bool:
    """Return whether a member of a collection is null, or a Feature whose geometry is."""
    is_feature = isinstance(member, Mapping) and member.get("type") == "Feature"
    return member is None or (is_feature and member.get("geometry") is None)


def _from_geojson(value: Any) -> Polygon | None:
    """Return the polygons of a GeoJSON object as one, parts united; altitudes are left out (RFC 7946, 3.1.1)."""
    geometry = geometry_of(value)
    if geometry is None:
        return None
    parts: list[Any] = []
    for each in geometries_in(geometry):
        kind = each["type"]
        if kind not in ("Polygon", "MultiPolygon"):
            uses = "clip_lines takes lines" if "Line" in kind else "locate takes points"
            raise UnsupportedSolidError(f"a {kind} is no solid: {uses}", ("type",))
        coordinates = coordinates_of(each)
        parts += [coordinates] if kind == "Polygon" and len(coordinates) else coordinates
    plane = [[_plane(ring) for ring in part] for part in parts]
    read, _ = Polygon.geojson
    return read({"type": "MultiPolygon", "coordinates": plane})


def _plane(positions: Any) -> FloatArray:
    """Return positions (n, 2), of three numbers each (longitude, latitude, altitude) the first two."""
    is_tall = len(positions) and all(hasattr(each, "__len__") and len(each) == 3 for each in positions)
    return as_points([each[:2] for each in positions] if is_tall else positions, 2, ("coordinates",))


def _from_mesh(value: Any) -> Polyhedron | None:
    """Return the mesh of another package: by what its objects have, in the order of the docstring above."""
    if hasattr(value, "vertices") and hasattr(value, "faces"):  # trimesh
        return _polyhedron(value.vertices, value.faces)
    if hasattr(value, "vertices") and hasattr(value, "triangles"):  # open3d, legacy
        return _polyhedron(value.vertices, value.triangles)
    if hasattr(value, "vertex") and hasattr(value, "triangle"):  # open3d, tensors
        return _polyhedron(value.vertex["positions"].numpy(), value.triangle["indices"].numpy())
    if hasattr(value, "points") and hasattr(value, "faces"):  # pyvista: [n, i, j, ..., n, i, j, ...]
        return _polyhedron(value.points, _unpadded(np.asarray(value.faces)))
    if hasattr(value, "points") and hasattr(value, "cells"):  # meshio: blocks of one type each
        return _polyhedron(value.points, [face for block in value.cells for face in _faces_in(block)])
    return None


def _polyhedron(vertices: Any, faces: Any) -> Polyhedron:
    return Polyhedron(vertices, faces if isinstance(faces, (list, tuple)) else np.asarray(faces))


def _unpadded(flat: Any) -> list[list[int]]:
    """Return the faces of a flat list in which each stands behind its number of corners."""
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
    return [list(map(int, face)) for face in block.data] if block.type not in ("vertex", "line") else []


def _from_arrays(value: Any) -> Solid | None:
    """Return the solid of a pair (vertices, faces), of one ring (n, 2), or of a list of rings."""
    if (
        isinstance(value, tuple)
        and len(value) == 2
        and _axes(value[0]) == 2
        and len(value[0])
        and len(value[0][0]) == 3
    ):
        return Polyhedron(value[0], value[1])
    axes = _axes(value)
    if axes == 2:
        return Polygon([value])
    return Polygon(value if isinstance(value, (list, tuple)) else list(value)) if axes == 3 else None


def _axes(value: Any) -> int:
    """Return how many axes an array has, or lists within lists as their first items have; 0 for anything else."""
    if isinstance(value, np.ndarray):
        return value.ndim
    axes = 0
    while isinstance(value, (list, tuple, np.ndarray)) and axes < 4:
        if isinstance(value, np.ndarray):
            return axes + value.ndim
        axes += 1
        if not value:
            break
        value = value[0]
    return axes


def as_pose(value: object, dimension: int, *where: str | int) -> Pose:
    """Return a pose as it is, and a matrix, a pair (rotation, translation) or a rotation of scipy as one.

    where: the path of the argument, for errors. Raises: InvalidArrayError for anything else, and as `Pose`.
    """
    if isinstance(value, Pose):
        return value
    given: Any = value
    try:
        if hasattr(given, "as_matrix"):
            return Pose(given.as_matrix(), np.zeros(dimension))
        if isinstance(given, (list, tuple)) and len(given) == 2 and _axes(given[0]) == 2:
            return Pose(*given)
        if _axes(given) == 2 and np.shape(given) == (dimension + 1, dimension + 1):
            return Pose.from_matrix(given)
    except EngineError as error:
        raise error.at(*where) from None
    except (TypeError, ValueError):  # rows of different lengths, junk
        pass
    raise InvalidArrayError(
        f"{spell(where)} must be a Pose, a matrix ({dimension + 1}, {dimension + 1}) or (rotation, translation), "
        f"got {shown(value)}",
        where,
    )


def as_pose_arrays(poses: Any, dimension: int) -> tuple[FloatArray, FloatArray]:
    """Return rotations (n, d, d) and translations (n, d) of poses: a list of them, or matrices (n, d + 1, d + 1)."""
    if isinstance(poses, np.ndarray) and poses.ndim == 3 and poses.shape[1:] == (dimension + 1, dimension + 1):
        last = np.append(np.zeros(dimension), 1.0)
        if len(odd := np.flatnonzero((poses[:, -1] != last).any(axis=1))):
            as_pose(poses[odd[0]], dimension, "poses", int(odd[0]))  # the error says what is wrong
        return poses[:, :-1, :-1], poses[:, :-1, -1]
    if not isinstance(poses, Iterable) or isinstance(poses, (str, bytes)):
        raise InvalidArrayError(
            f"poses must be a list of poses or an array of matrices, got {shown(poses)}", ("poses",)
        )
    made = [as_pose(each, dimension, "poses", number) for number, each in enumerate(poses)]
    for number, each in enumerate(made):
        if each.dimension != dimension:
            raise WrongDimensionError(
                f"poses[{number}] has dimension {each.dimension}, the bodies have {dimension}", ("poses", number)
            )
    turns = np.array([each.rotation for each in made]).reshape(-1, dimension, dimension)
    return turns, np.array([each.translation for each in made]).reshape(-1, dimension)
