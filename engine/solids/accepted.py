"""What arguments may be, for type checkers: our classes and what people hold in place of them (`shapes`, `poses`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, TypeAlias

import numpy.typing as npt

from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.solids.poses import Poses


class HasGeoInterface(Protocol):
    """A geometry of shapely, a GeoSeries, a GeoDataFrame, and whatever else has GeoJSON."""

    @property
    def __geo_interface__(self) -> Any: ...


class HasArray(Protocol):
    """A DataFrame, a Series, a DataArray of xarray, a tensor."""

    def __array__(self) -> Any: ...


class HasFaces(Protocol):
    """A mesh of trimesh."""

    vertices: Any
    faces: Any


class HasTriangles(Protocol):
    """A mesh of open3d."""

    vertices: Any
    triangles: Any


class HasTensors(Protocol):
    """A tensor mesh of open3d."""

    vertex: Any
    triangle: Any


class HasPointsAndFaces(Protocol):
    """A PolyData of pyvista."""

    points: Any
    faces: Any


class HasPointsAndCells(Protocol):
    """A mesh of meshio."""

    points: Any
    cells: Any


class HasMatrix(Protocol):
    """A rotation of scipy."""

    def as_matrix(self) -> Any: ...


_Geo: TypeAlias = Mapping[str, Any] | HasGeoInterface
_Array: TypeAlias = npt.NDArray[Any]
_Rows: TypeAlias = Sequence[Sequence[float] | _Array]
PointsLike: TypeAlias = _Array | HasArray | _Rows | _Geo | Sequence[_Geo]
"""Positions: an array (n, d), nested lists, a DataFrame of coordinates, GeoJSON of points."""
LinesLike: TypeAlias = _Array | HasArray | Sequence[_Rows | _Array] | _Geo | Sequence[_Geo] | tuple[_Array, _Array]
"""Segments and polylines: lists of lists of positions, arrays, GeoJSON of lines."""
SolidLike: TypeAlias = (
    Solid | _Geo | HasFaces | HasTriangles | HasTensors | HasPointsAndFaces | HasPointsAndCells
    | _Array | _Rows | Sequence[_Rows | _Array] | tuple[_Rows | _Array, Sequence[Sequence[int]] | _Array]
)  # fmt: skip
"""A solid: ours, GeoJSON with areas, a mesh of another package, rings, or (vertices, faces)."""
SolidsLike: TypeAlias = Sequence[SolidLike] | _Geo
"""A list of solids, or a collection of GeoJSON."""
PoseLike: TypeAlias = Pose | HasMatrix | _Array | _Rows | tuple[_Rows | _Array, Sequence[float] | _Array]
"""A pose: ours, a matrix of homogeneous coordinates, (rotation, translation), a rotation of scipy."""
PosesLike: TypeAlias = Poses | _Array | Sequence[PoseLike | None] | Sequence[Sequence[_Rows]]
"""Many poses: `Poses`, a list of poses, an array (n, d + 1, d + 1); of a scene None for a body that stays."""
