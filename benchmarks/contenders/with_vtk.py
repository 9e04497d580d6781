"""VTK, as pyvista and vedo call it: points, distances, lines, volumes, closed cuts, sections, Boolean operations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import VTK_DOUBLE, vtkObject, vtkPoints
from vtkmodules.vtkCommonDataModel import (
    vtkCellArray,
    vtkPlane,
    vtkPlaneCollection,
    vtkPolyData,
    vtkStaticCellLocator,
)
from vtkmodules.vtkCommonExecutionModel import vtkAlgorithm
from vtkmodules.vtkFiltersCore import (
    vtkCutter,
    vtkImplicitPolyDataDistance,
    vtkMassProperties,
    vtkTriangleFilter,
)
from vtkmodules.vtkFiltersGeneral import (
    vtkBooleanOperationPolyDataFilter,
    vtkClipClosedSurface,
    vtkContourTriangulator,
    vtkIntersectionPolyDataFilter,
)
from vtkmodules.vtkFiltersModeling import vtkSelectEnclosedPoints
from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkSTLReader
from vtkmodules.vtkIOPLY import vtkPLYReader

from benchmarks.contenders import Couple, Prepared, each_or_nan, is_closed, meshes_of
from benchmarks.workloads import Mesh

PACKAGE = "vtk"
NAMES = {"": "VTK"}

vtkObject.GlobalWarningDisplayOff()


def _data(vertices: np.ndarray, faces: np.ndarray) -> vtkPolyData:
    points, cells = vtkPoints(), vtkCellArray()
    points.SetDataType(VTK_DOUBLE)
    points.SetData(numpy_to_vtk(np.ascontiguousarray(vertices, float), deep=True))
    cells.SetCells(
        len(faces), numpy_to_vtkIdTypeArray(np.insert(faces, 0, 3, axis=1).astype(np.int64).ravel(), deep=True)
    )
    result = vtkPolyData()
    result.SetPoints(points)
    result.SetPolys(cells)
    return result


def _reader(kind: type[vtkAlgorithm]) -> Callable[[str], tuple[np.ndarray, np.ndarray]]:
    def read(path: str) -> tuple[np.ndarray, np.ndarray]:
        reader = kind()
        reader.SetFileName(path)
        reader.Update()
        data = reader.GetOutput()
        faces = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
        return vtk_to_numpy(data.GetPoints().GetData()).astype(float), faces

    return read


READERS = {".stl": _reader(vtkSTLReader), ".obj": _reader(vtkOBJReader), ".ply": _reader(vtkPLYReader)}


def _made(mesh: Mesh) -> vtkPolyData:
    return _data(mesh.vertices, mesh.faces)


def _run(filter_: vtkAlgorithm, data: vtkPolyData) -> vtkPolyData:
    filter_.SetInputData(data)
    filter_.Update()
    return filter_.GetOutput()


def _measured(data: vtkPolyData) -> vtkMassProperties:
    result = vtkMassProperties()
    result.SetInputData(_run(vtkTriangleFilter(), data))
    result.Update()
    return result


def _closed_volume(data: vtkPolyData) -> float:
    """Return the volume of a mesh, NaN where it is not closed."""
    if data.GetNumberOfPolys() == 0:
        return 0.0
    data = _run(vtkTriangleFilter(), data)
    faces = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return float(_measured(data).GetVolume()) if is_closed(vtk_to_numpy(data.GetPoints().GetData()), faces) else np.nan


def _plane(row: np.ndarray) -> vtkPlane:
    result = vtkPlane()
    result.SetNormal(*row[:3])
    result.SetOrigin(*(-row[3] * row[:3] / (row[:3] @ row[:3])))
    return result


def _cut(data: vtkPolyData, row: np.ndarray) -> vtkPolyData:
    planes, clip = vtkPlaneCollection(), vtkClipClosedSurface()
    planes.AddItem(_plane(row))
    clip.SetClippingPlanes(planes)
    return _run(clip, data)


def _section_area(data: vtkPolyData, row: np.ndarray) -> float:
    cutter, filled = vtkCutter(), vtkContourTriangulator()
    cutter.SetCutFunction(_plane(row))
    area = _run(filled, _run(cutter, data))
    return float(_measured(area).GetSurfaceArea())


def _rows(one: Callable[[vtkPolyData, np.ndarray], float]) -> Callable[[Mesh, int], Prepared]:
    def make(mesh: Mesh, threads: int) -> Prepared:
        data = _made(mesh)
        return Prepared(each_or_nan(lambda row: one(data, row)))

    return make


def _points(mesh: Mesh, threads: int) -> Prepared:
    data = _made(mesh)

    def ask(points: np.ndarray) -> np.ndarray:
        inside = vtkSelectEnclosedPoints()
        inside.SetSurfaceData(data)
        result = _run(inside, _data(points, np.empty((0, 3))))
        return vtk_to_numpy(result.GetPointData().GetArray("SelectedPoints")) > 0

    return Prepared(ask)


def _distances(is_signed: bool) -> Callable[[Mesh, int], Prepared]:
    def make(mesh: Mesh, threads: int) -> Prepared:
        function = vtkImplicitPolyDataDistance()
        function.SetInput(_made(mesh))

        def ask(points: np.ndarray) -> np.ndarray:
            result = np.array([function.EvaluateFunction(point) for point in points.tolist()])
            return result if is_signed else np.abs(result)

        return Prepared(ask)

    return make


def _lines(mesh: Mesh, threads: int) -> Prepared:
    tree = vtkStaticCellLocator()
    tree.SetDataSet(_made(mesh))
    tree.BuildLocator()

    def ask(segments: np.ndarray) -> list[Any]:
        result = []
        for number, (start, end) in enumerate(segments):
            points = vtkPoints()
            points.SetDataType(VTK_DOUBLE)
            tree.IntersectWithLine(start, end, 0.0, points, None)
            way = end - start
            places = [points.GetPoint(k) for k in range(points.GetNumberOfPoints())]
            result += [(number, float((np.array(place) - start) @ way / (way @ way))) for place in places]
        return result

    return Prepared(ask)


def _overlap(pair: Couple, threads: int) -> Prepared:
    first, second = map(_made, meshes_of(pair))

    def ask(_: object) -> float:
        both = vtkBooleanOperationPolyDataFilter()
        both.SetOperationToIntersection()
        both.SetInputData(0, first)
        both.SetInputData(1, second)
        both.Update()
        return _closed_volume(both.GetOutput())

    return Prepared(ask)


def _pair(pair: Couple, threads: int) -> Prepared:
    first, second = map(_made, meshes_of(pair))

    def ask(_: object) -> bool:
        curves = vtkIntersectionPolyDataFilter()
        curves.SetInputData(0, first)
        curves.SetInputData(1, second)
        curves.Update()
        return curves.GetNumberOfIntersectionPoints() > 0

    return Prepared(ask)


MAKERS = {
    "points": _points, "pair": _pair, "overlap": _overlap, "all hits": _lines,
    "point distances": _distances(False), "signed distances": _distances(True),
    "volume": lambda mesh, threads: Prepared(lambda _: float(_measured(_made(mesh)).GetVolume())),
    "cut volumes": _rows(lambda data, row: _closed_volume(_cut(data, row))), "section areas": _rows(_section_area),
}  # fmt: skip
