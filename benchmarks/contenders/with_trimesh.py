"""trimesh: points and all hits of rays by Embree, and triangles cut by `slice_plane` with the six planes of a box."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import embreex  # noqa: F401, without it trimesh would use a slower method
import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

import engine
from benchmarks.contenders import Prepared, merged
from benchmarks.workloads import Bodies, Mesh

PACKAGE = "trimesh"
NAMES = {"": "trimesh + embreex"}


def _points(mesh: Mesh, threads: int) -> Prepared:
    return Prepared(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).contains)


def _hits(mesh: Mesh, threads: int) -> Prepared:
    """Whether a segment meets the mesh; from hits on its ray, those beyond its end left out."""
    intersector = RayMeshIntersector(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False))

    def native(segments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.ascontiguousarray(segments[:, 0]), segments[:, 1] - segments[:, 0]

    def ask(rays: tuple[np.ndarray, np.ndarray]) -> tuple[int, np.ndarray, np.ndarray]:
        origins, directions = rays
        points, ray, face = intersector.intersects_location(origins, directions, multiple_hits=True)
        t = ((points - origins[ray]) * directions[ray]).sum(axis=1) / (directions[ray] ** 2).sum(axis=1)
        return len(origins), ray[t <= 1.0], face[t <= 1.0]

    return Prepared(ask, native, lambda result: np.bincount(result[1], minlength=result[0]) > 0)


def _through(bodies: Bodies, threads: int) -> Prepared:
    mesh, owners = merged(bodies)
    return replace(
        _hits(mesh, threads), answer=lambda result: np.unique(result[1] * len(bodies.bodies) + owners[result[2]])
    )


def _pieces(region: engine.Polyhedron, threads: int) -> Prepared:
    """Cut at the hits of a ray; keep the parts whose middle is contained."""
    body = trimesh.Trimesh(region.vertices, region.triangles, process=False)

    def ask(segments: np.ndarray) -> list[Any]:
        result = []
        for i, (a, b) in enumerate(np.array(segments, float)):
            direction = b - a
            hits, *_ = body.ray.intersects_location([a], [direction], multiple_hits=True)
            t = ((hits - a) @ direction) / (direction @ direction) if len(hits) else np.zeros(0)
            cuts = np.unique(np.concatenate([[0.0, 1.0], t[(t > 0) & (t < 1)]]))
            ends = a + cuts[:, None] * direction
            kept = body.contains((ends[:-1] + ends[1:]) / 2)
            result += [(i, start, end) for start, end, keep in zip(ends[:-1], ends[1:], kept, strict=True) if keep]
        return result

    return Prepared(ask)


def _kept_polygons(region: engine.Aabb, threads: int) -> Prepared:
    normals = np.concatenate([np.eye(3), -np.eye(3)])
    origins = np.concatenate([np.tile(region.min, (3, 1)), np.tile(region.max, (3, 1))])

    def native(triangles: np.ndarray) -> trimesh.Trimesh:
        faces = np.arange(3 * len(triangles)).reshape(-1, 3)
        return trimesh.Trimesh(triangles.reshape(-1, 3), faces, process=False)

    def ask(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
        for origin, normal in zip(origins, normals, strict=True):
            mesh = mesh.slice_plane(origin, normal)
        return mesh

    return Prepared(ask, native, lambda result: None)


def _distances(mesh: Mesh, threads: int) -> Prepared:
    made = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    return Prepared(lambda points: trimesh.proximity.closest_point(made, points)[1])


def _within(asked: tuple[Mesh, float], threads: int) -> Prepared:
    prepared = _distances(asked[0], threads)
    return Prepared(prepared.ask, answer=lambda result: result <= asked[1])


MAKERS = {
    "point distances": _distances, "points within": _within,
    "points": _points, "hits": _hits, "pieces": _pieces, "kept polygons": _kept_polygons, "scene all": _through,
    "scene any": lambda bodies, threads: _hits(merged(bodies)[0], threads),
}  # fmt: skip
