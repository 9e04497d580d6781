"""VTK: `vtkClipPolyData` by the six planes of a box, one after another."""

from __future__ import annotations

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPlane, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkClipPolyData

import engine
from benchmarks.contenders import Prepared

NAME, PACKAGE = "vtk", "vtk"


def _polygons(subject: engine.Aabb, threads: int) -> Prepared:
    def native(triangles: np.ndarray) -> vtkPolyData:
        points, cells, data = vtkPoints(), vtkCellArray(), vtkPolyData()
        points.SetData(numpy_to_vtk(triangles.reshape(-1, 3), deep=True))
        faces = np.column_stack([np.full(len(triangles), 3), np.arange(3 * len(triangles)).reshape(-1, 3)])
        cells.SetCells(len(triangles), numpy_to_vtkIdTypeArray(faces.ravel(), deep=True))
        data.SetPoints(points)
        data.SetPolys(cells)
        return data

    def ask(data: vtkPolyData) -> vtkPolyData:
        for side, sign in ((subject.min, 1.0), (subject.max, -1.0)):
            for axis in range(3):
                plane, clip = vtkPlane(), vtkClipPolyData()
                plane.SetOrigin(*side)
                plane.SetNormal(*(sign * np.eye(3)[axis]))
                clip.SetInputData(data)
                clip.SetClipFunction(plane)
                clip.Update()
                data = clip.GetOutput()
        return data

    return Prepared(native, ask, lambda found: np.zeros(0, bool))


MAKERS = {"polygons": _polygons}
