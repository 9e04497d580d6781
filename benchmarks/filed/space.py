"""What a careful user of each peer would write for a filed case of space; see plane.py."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.filed.plane import NotApplicable, Piece, refuse_poses


def mesh_of(solid: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and triangles."""
    if solid["type"] not in ("polyhedron", "surface"):
        raise NotApplicable(solid["type"])
    return np.array(solid["vertices"], float), np.array(solid["faces"], np.int64)


# --- Open3D -----------------------------------------------------------------------------------------------------------


def open3d_locate(data: dict[str, Any]) -> np.ndarray:
    from open3d.core import Tensor
    from open3d.t.geometry import RaycastingScene

    vertices, faces = mesh_of(data["solid"])
    scene = RaycastingScene()
    scene.add_triangles(Tensor(vertices.astype(np.float32)), Tensor(faces.astype(np.uint32)))
    return scene.compute_occupancy(Tensor(np.array(data["points"], np.float32))).numpy() > 0.5


def open3d_collide(data: dict[str, Any]) -> bool:
    from open3d.geometry import TriangleMesh
    from open3d.utility import Vector3dVector, Vector3iVector

    refuse_poses(data)
    meshes = [mesh_of(data[key]) for key in ("first", "second")]
    first, second = (TriangleMesh(Vector3dVector(v), Vector3iVector(f.astype(np.int32))) for v, f in meshes)
    return first.is_intersecting(second)


# --- trimesh ----------------------------------------------------------------------------------------------------------


def _trimesh(solid: dict[str, Any]) -> Any:
    import embreex  # noqa: F401, without it trimesh would use a slower method
    import trimesh

    return trimesh.Trimesh(*mesh_of(solid), process=False)


def trimesh_locate(data: dict[str, Any]) -> np.ndarray:
    return _trimesh(data["solid"]).contains(np.array(data["points"]))


def trimesh_segments(data: dict[str, Any]) -> list[Piece]:
    """Cut at the hits of a ray; keep the parts whose middle is contained."""
    body, found = _trimesh(data["region"]), []
    for i, (a, b) in enumerate(np.array(data["segments"], float)):
        direction = b - a
        hits, *_ = body.ray.intersects_location([a], [direction], multiple_hits=True)
        t = ((hits - a) @ direction) / (direction @ direction) if len(hits) else np.zeros(0)
        cuts = np.unique(np.concatenate([[0.0, 1.0], t[(t > 0) & (t < 1)]]))
        ends = a + cuts[:, None] * direction
        kept = body.contains((ends[:-1] + ends[1:]) / 2)
        found += [(i, start, end) for start, end, keep in zip(ends[:-1], ends[1:], kept, strict=True) if keep]
    return found


# --- libigl -----------------------------------------------------------------------------------------------------------


def libigl_locate(data: dict[str, Any]) -> np.ndarray:
    import igl

    return igl.fast_winding_number(*mesh_of(data["solid"]), np.array(data["points"])) > 0.5


def libigl_collide(data: dict[str, Any]) -> bool:
    import igl.copyleft.cgal as cgal

    refuse_poses(data)
    return len(cgal.intersect_other(*mesh_of(data["first"]), *mesh_of(data["second"]), first_only=True)[0]) > 0


# --- VTK --------------------------------------------------------------------------------------------------------------


def _polydata(vertices: np.ndarray, faces: np.ndarray) -> Any:
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray

    corners, data, cells = vtk.vtkPoints(), vtk.vtkPolyData(), vtk.vtkCellArray()
    corners.SetData(numpy_to_vtk(np.ascontiguousarray(vertices), deep=True))
    data.SetPoints(corners)
    if len(faces):
        rows = np.hstack([np.full((len(faces), 1), 3), faces]).astype(np.int64)
        cells.SetCells(len(rows), numpy_to_vtkIdTypeArray(rows.ravel(), deep=True))
        data.SetPolys(cells)
    return data


def vtk_locate(data: dict[str, Any]) -> np.ndarray:
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy

    tester = vtk.vtkSelectEnclosedPoints()
    tester.SetInputData(_polydata(np.array(data["points"], float), np.zeros((0, 3))))
    tester.SetSurfaceData(_polydata(*mesh_of(data["solid"])))
    tester.SetTolerance(0.0)
    tester.Update()
    return vtk_to_numpy(tester.GetOutput().GetPointData().GetArray("SelectedPoints")) > 0


def vtk_collide(data: dict[str, Any]) -> bool:
    import vtk

    refuse_poses(data)
    tester = vtk.vtkCollisionDetectionFilter()
    for port, key in enumerate(("first", "second")):
        tester.SetInputData(port, _polydata(*mesh_of(data[key])))
        tester.SetMatrix(port, vtk.vtkMatrix4x4())
    tester.SetCollisionModeToFirstContact()
    tester.Update()
    return tester.GetNumberOfContacts() > 0


# --- CGAL -------------------------------------------------------------------------------------------------------------


def cgal_locate(data: dict[str, Any]) -> np.ndarray:
    from CGAL.CGAL_Kernel import Point_3
    from CGAL.CGAL_Polygon_mesh_processing import Side_of_triangle_mesh
    from CGAL.CGAL_Polyhedron_3 import Polyhedron_3, Polyhedron_modifier

    vertices, faces = mesh_of(data["solid"])
    modifier, body = Polyhedron_modifier(), Polyhedron_3()
    modifier.begin_surface(len(vertices), len(faces))
    for vertex in vertices.tolist():
        modifier.add_vertex(Point_3(*vertex))
    for face in faces.tolist():
        modifier.begin_facet()
        for corner in face:
            modifier.add_vertex_to_facet(corner)
        modifier.end_facet()
    body.delegate(modifier)
    side = Side_of_triangle_mesh(body)
    return np.array([side.bounded_side(Point_3(*point)) >= 0 for point in data["points"]])


# --- coal, fcl --------------------------------------------------------------------------------------------------------


def _middle_and_sides(solid: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    low, high = np.array(solid["min"], float), np.array(solid["max"], float)
    if len(low) != 3:
        raise NotApplicable("space only")
    return (low + high) / 2, high - low


def coal_collide(data: dict[str, Any]) -> bool:
    import coal

    def body(key: str) -> tuple[Any, Any]:
        solid, pose, place = data[key], data.get(f"{key}_pose"), coal.Transform3s()
        if pose and solid["type"] in ("polyhedron", "surface"):
            place = coal.Transform3s(*(np.array(pose[part], float) for part in ("rotation", "translation")))
        elif pose:
            raise NotApplicable("poses of meshes only")
        if solid["type"] == "aabb":
            middle, sides = _middle_and_sides(solid)
            place.setTranslation(middle)
            return coal.Box(*sides), place
        if solid["type"] == "sphere":
            place.setTranslation(np.array(solid["center"]))
            return coal.Sphere(solid["radius"]), place
        vertices, faces = mesh_of(solid)
        made = coal.BVHModelOBBRSS()
        made.beginModel(len(faces), len(vertices))
        made.addVertices(vertices)
        made.addTriangles(faces)
        made.endModel()
        return made, place

    first, second = body("first"), body("second")
    return coal.collide(*first, *second, coal.CollisionRequest(), coal.CollisionResult()) > 0


def fcl_collide(data: dict[str, Any]) -> bool:
    import fcl

    def body(key: str) -> Any:
        solid, pose, place = data[key], data.get(f"{key}_pose"), fcl.Transform()
        if pose and solid["type"] in ("polyhedron", "surface"):
            place = fcl.Transform(*(np.array(pose[part], float) for part in ("rotation", "translation")))
        elif pose:
            raise NotApplicable("poses of meshes only")
        if solid["type"] == "aabb":
            middle, sides = _middle_and_sides(solid)
            return fcl.CollisionObject(fcl.Box(*sides), fcl.Transform(middle))
        if solid["type"] == "sphere":
            return fcl.CollisionObject(fcl.Sphere(solid["radius"]), fcl.Transform(np.array(solid["center"])))
        vertices, faces = mesh_of(solid)
        made = fcl.BVHModel()
        made.beginModel(len(vertices), len(faces))
        made.addSubModel(vertices, faces)
        made.endModel()
        return fcl.CollisionObject(made, place)

    first, second = body("first"), body("second")
    return fcl.collide(first, second, fcl.CollisionRequest(), fcl.CollisionResult()) > 0


# --- manifold3d -------------------------------------------------------------------------------------------------------


def manifold_collide(data: dict[str, Any]) -> bool:
    import manifold3d

    refuse_poses(data)
    if "surface" in (data["first"]["type"], data["second"]["type"]):
        raise NotApplicable("solids only")
    meshes = [mesh_of(data[key]) for key in ("first", "second")]
    bodies = [manifold3d.Manifold(manifold3d.Mesh64(v, f.astype(np.uint64))) for v, f in meshes]
    for body in bodies:
        if body.status() != manifold3d.Error.NoError:
            raise ValueError(str(body.status()))
    return not (bodies[0] ^ bodies[1]).is_empty()
