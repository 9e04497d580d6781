"""VTK: enclosed points, meshes that meet, and `vtkClipPolyData` by the six planes of a box, one after another."""

from __future__ import annotations

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

import engine
from benchmarks.contenders import Couple, Prepared, meshes_of
from benchmarks.workloads import Mesh

PACKAGE = "vtk"
NAMES = {"": "VTK", "points": "VTK enclosed points"}


def _polydata(vertices: np.ndarray, faces: np.ndarray | None = None) -> vtk.vtkPolyData:
    corners, data, cells = vtk.vtkPoints(), vtk.vtkPolyData(), vtk.vtkCellArray()
    corners.SetData(numpy_to_vtk(np.ascontiguousarray(vertices), deep=True))
    data.SetPoints(corners)
    if faces is not None:
        rows = np.column_stack([np.full(len(faces), 3), faces]).astype(np.int64)
        cells.SetCells(len(rows), numpy_to_vtkIdTypeArray(rows.ravel(), deep=True))
        data.SetPolys(cells)
    return data


def _points(mesh: Mesh, threads: int) -> Prepared:
    body = _polydata(mesh.vertices, mesh.faces)

    def ask(points: np.ndarray) -> np.ndarray:
        tester = vtk.vtkSelectEnclosedPoints()
        tester.SetInputData(_polydata(points))
        tester.SetSurfaceData(body)
        tester.SetTolerance(0.0)
        tester.Update()
        return vtk_to_numpy(tester.GetOutput().GetPointData().GetArray("SelectedPoints")) > 0

    return Prepared(ask)


def _pair(pair: Couple, threads: int) -> Prepared:
    tester = vtk.vtkCollisionDetectionFilter()
    for port, mesh in enumerate(meshes_of(pair)):
        tester.SetInputData(port, _polydata(mesh.vertices, mesh.faces))
        tester.SetMatrix(port, vtk.vtkMatrix4x4())
    tester.SetCollisionModeToFirstContact()

    def ask(_: object) -> bool:
        tester.Modified()
        tester.Update()
        return tester.GetNumberOfContacts() > 0

    return Prepared(ask)


def _kept_polygons(region: engine.Aabb, threads: int) -> Prepared:
    def native(triangles: np.ndarray) -> vtk.vtkPolyData:
        return _polydata(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))

    def ask(data: vtk.vtkPolyData) -> vtk.vtkPolyData:
        for side, sign in ((region.min, 1.0), (region.max, -1.0)):
            for axis in range(3):
                plane, clip = vtk.vtkPlane(), vtk.vtkClipPolyData()
                plane.SetOrigin(*side)
                plane.SetNormal(*(sign * np.eye(3)[axis]))
                clip.SetInputData(data)
                clip.SetClipFunction(plane)
                clip.Update()
                data = clip.GetOutput()
        return data

    return Prepared(ask, native, lambda found: None)


MAKERS = {"points": _points, "pair": _pair, "kept polygons": _kept_polygons}
