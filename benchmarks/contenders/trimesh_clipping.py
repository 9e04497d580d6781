"""trimesh: all hits of rays by Embree, and triangles cut by `slice_plane` with the six planes of a box."""

from __future__ import annotations

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

import engine
from benchmarks.contenders import Prepared

NAME, PACKAGE = "trimesh with embree", "trimesh"


def _mesh_segments(subject: engine.Polyhedron, threads: int) -> Prepared:
    """Whether a segment meets the mesh; from hits on its ray, those beyond its end left out."""
    intersector = RayMeshIntersector(trimesh.Trimesh(subject.vertices, subject.triangles, process=False))

    def native(segments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.ascontiguousarray(segments[:, 0]), segments[:, 1] - segments[:, 0]

    def ask(rays: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        origins, directions = rays
        points, ray, _ = intersector.intersects_location(origins, directions, multiple_hits=True)
        t = ((points - origins[ray]) * directions[ray]).sum(axis=1) / (directions[ray] ** 2).sum(axis=1)
        return np.bincount(ray[t <= 1.0], minlength=len(origins))

    return Prepared(native, ask, lambda found: found > 0)


def _polygons(subject: engine.Aabb, threads: int) -> Prepared:
    normals = np.concatenate([np.eye(3), -np.eye(3)])
    origins = np.concatenate([np.tile(subject.min, (3, 1)), np.tile(subject.max, (3, 1))])

    def native(triangles: np.ndarray) -> trimesh.Trimesh:
        faces = np.arange(3 * len(triangles)).reshape(-1, 3)
        return trimesh.Trimesh(triangles.reshape(-1, 3), faces, process=False)

    def ask(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
        for origin, normal in zip(origins, normals, strict=True):
            mesh = mesh.slice_plane(origin, normal)
        return mesh

    return Prepared(native, ask, lambda found: np.zeros(0, bool))


MAKERS = {"segments": _mesh_segments, "polygons": _polygons}
