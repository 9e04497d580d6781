"""trimesh: points and all hits of rays by Embree, and triangles cut by `slice_plane` with the six planes of a box."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import embreex  # noqa: F401, without it trimesh would use a slower method
import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

import engine
from benchmarks.contenders import Prepared, each_or_nan, is_closed, merged, t_by_segment
from benchmarks.workloads import Bodies, Mesh

PACKAGE = "trimesh"
NAMES = {"": "trimesh + embreex"}


def _read(path: str) -> tuple[np.ndarray, np.ndarray]:
    made = trimesh.load(path, force="mesh")
    return made.vertices, made.faces


READERS = dict.fromkeys((".stl", ".obj", ".off", ".ply", ".glb"), _read)


def _made(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def _points(mesh: Mesh, threads: int) -> Prepared:
    return Prepared(_made(mesh).contains)


def _hits(mesh: Mesh, threads: int, is_first: bool = False) -> Prepared:
    """Whether a segment meets the mesh; from hits on its ray, those beyond its end left out."""
    intersector = RayMeshIntersector(_made(mesh))

    def native(segments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.ascontiguousarray(segments[:, 0]), segments[:, 1] - segments[:, 0]

    def ask(rays: tuple[np.ndarray, np.ndarray]) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
        origins, directions = rays
        points, ray, face = intersector.intersects_location(origins, directions, multiple_hits=not is_first)
        t = ((points - origins[ray]) * directions[ray]).sum(axis=1) / (directions[ray] ** 2).sum(axis=1)
        return len(origins), ray[t <= 1.0], face[t <= 1.0], t[t <= 1.0]

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
    made = _made(mesh)
    return Prepared(lambda points: trimesh.proximity.closest_point(made, points)[1])


def _signed_distances(mesh: Mesh, threads: int) -> Prepared:
    made = _made(mesh)
    return Prepared(lambda points: -trimesh.proximity.signed_distance(made, points))


def _origin(row: np.ndarray) -> np.ndarray:
    return -row[3] * row[:3] / (row[:3] @ row[:3])


def _cut_volumes(mesh: Mesh, threads: int) -> Prepared:
    made = _made(mesh)

    def volume(row: np.ndarray) -> float:
        part = trimesh.intersections.slice_mesh_plane(made, row[:3], _origin(row), cap=True)
        return float(part.volume) if is_closed(part.vertices, part.faces) else np.nan

    return Prepared(each_or_nan(volume))


def _section_areas(mesh: Mesh, threads: int) -> Prepared:
    made = _made(mesh)

    def area(row: np.ndarray) -> float:
        section = made.section(plane_normal=row[:3], plane_origin=_origin(row))
        return 0.0 if section is None else float(section.to_2D()[0].area)

    return Prepared(each_or_nan(area))


def _within(asked: tuple[Mesh, float], threads: int) -> Prepared:
    prepared = _distances(asked[0], threads)
    return Prepared(prepared.ask, answer=lambda result: result <= asked[1])


MAKERS = {
    "point distances": _distances, "points within": _within, "signed distances": _signed_distances,
    "all hits": lambda mesh, threads: replace(
        _hits(mesh, threads), answer=lambda result: list(zip(result[1].tolist(), result[3].tolist()))
    ),
    "first hits": lambda mesh, threads: replace(
        _hits(mesh, threads, True), answer=lambda result: t_by_segment(result[0], result[1], result[3])
    ),
    "hit counts": lambda mesh, threads: replace(
        _hits(mesh, threads), answer=lambda result: np.bincount(result[1], minlength=result[0])
    ),
    "volume": lambda mesh, threads: Prepared(lambda _: float(_made(mesh).volume)),
    "cut volumes": _cut_volumes, "section areas": _section_areas,
    "points": _points, "hits": _hits, "pieces": _pieces, "kept polygons": _kept_polygons, "scene all": _through,
    "scene any": lambda bodies, threads: _hits(merged(bodies)[0], threads),
}  # fmt: skip
