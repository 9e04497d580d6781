"""Meshes and rotations of the packages themselves (the extra `shapes`), where they are installed; `test_shapes.py` has
stand-ins with the same attributes."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import engine
from tests.unit.solids.test_shapes import CORNERS, TRIANGLES

INSIDE = [(0.5, 0.5, 0.5), (1.0, 0.5, 0.5), (1.5, 0.5, 0.5)]
CUBE = engine.Polyhedron(CORNERS, TRIANGLES)


def module(name: str) -> Any:
    with warnings.catch_warnings():  # of what these packages import
        warnings.simplefilter("ignore")
        return pytest.importorskip(name, reason="the extra `shapes` is not installed", exc_type=ImportError)


def test_rotations_of_scipy() -> None:
    rotation = module("scipy.spatial.transform").Rotation
    one, many = rotation.from_euler("xyz", [0.1, 0.2, 0.3]), rotation.random(5, random_state=3)
    made = engine.Pose(one.as_matrix(), [0, 0, 0])
    for given in (one, (one.as_matrix(), [0, 0, 0])):
        assert engine.collide(CUBE, CUBE, second_pose=given) == engine.collide(CUBE, CUBE, second_pose=made)
    for own in (engine.Pose.from_quaternion(xyzw=one.as_quat()), engine.Pose.from_rpy([0.1, 0.2, 0.3])):
        assert np.abs(own.rotation - one.as_matrix()).max() < 1e-15
    turns = many.as_rotvec()
    poses = engine.Poses(many)
    assert poses == engine.Poses(many.as_matrix(), np.zeros((5, 3)))
    by_axes = engine.Poses.from_axis_angle(turns, np.linalg.norm(turns, axis=1))
    assert np.abs(by_axes.rotations - poses.rotations).max() < 1e-15
    assert engine.collide_poses(CUBE, CUBE, many).tolist() == engine.collide_poses(CUBE, CUBE, poses).tolist()
    with pytest.raises(engine.EngineError):
        engine.collide(CUBE, CUBE, second_pose=many)
    rigid = getattr(module("scipy.spatial.transform"), "RigidTransform", None)
    if rigid is not None:  # from scipy 1.16 on
        moved = rigid.from_components([1.0, 0.0, 0.0], one)
        assert engine.collide(CUBE, CUBE, second_pose=moved) == engine.collide(
            CUBE, CUBE, second_pose=engine.Pose(one.as_matrix(), [1, 0, 0])
        )


def test_meshes_of_meshio(tmp_path: Path) -> None:
    meshio = module("meshio")
    mesh = meshio.Mesh(CORNERS, [("vertex", [[0]]), ("triangle", TRIANGLES)])
    assert engine.locate(INSIDE, mesh).tolist() == [1, 0, -1]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    assert engine.locate(INSIDE, meshio.Mesh(CORNERS, [("quad", quads)])).tolist() == [1, 0, -1]
    with pytest.raises(engine.UnsupportedSolidError, match="tetra"):
        engine.locate(INSIDE, meshio.Mesh(CORNERS, [("tetra", [[0, 1, 2, 4]])]))
    for suffix, options in (
        ("stl", {"binary": True}), ("stl", {"binary": False}), ("obj", {}), ("off", {}),
        ("ply", {"binary": True}), ("ply", {"binary": False}),
    ):  # fmt: skip
        path = tmp_path / f"cube.{suffix}"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            meshio.write(path, meshio.Mesh(CORNERS, [("triangle", TRIANGLES)]), **options)
            again = meshio.read(path)
        assert engine.locate(INSIDE, engine.read_mesh(path).solid()).tolist() == [1, 0, -1], (suffix, options)
        assert engine.inspect(again).is_closed


def test_meshes_of_pyvista(tmp_path: Path) -> None:
    pyvista = module("pyvista")
    cube = pyvista.Cube(center=(0.5, 0.5, 0.5))  # 24 points, 4 a face
    for mesh in (cube, cube.triangulate(), pyvista.PolyData(CORNERS, np.insert(TRIANGLES, 0, 3, axis=1).ravel())):
        assert engine.locate(INSIDE, mesh).tolist() == [1, 0, -1]
        assert engine.inspect(mesh).is_closed
    for suffix in ("stl", "ply", "obj"):
        cube.triangulate().save(path := tmp_path / f"cube.{suffix}")
        assert engine.locate(INSIDE, engine.read_mesh(path).solid()).tolist() == [1, 0, -1], suffix
    with pytest.raises(engine.EngineError):
        engine.locate(INSIDE, pyvista.Line())


def test_meshes_of_open3d() -> None:
    open3d = module("open3d")
    box = open3d.geometry.TriangleMesh.create_box()
    tensors = open3d.t.geometry.TriangleMesh.from_legacy(box)
    for mesh in (box, tensors):
        assert engine.locate(INSIDE, mesh).tolist() == [1, 0, -1]
        assert engine.collide(mesh, CUBE).relation.label == "overlapping"
        assert engine.inspect(mesh).is_closed
    with pytest.raises(engine.EngineError):
        engine.locate(INSIDE, open3d.geometry.TriangleMesh())
