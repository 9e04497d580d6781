"""The engine: float64 points, exact three-valued answers, `contained` is inside or on the boundary."""

from __future__ import annotations

from typing import Any

import numpy as np

import engine
from benchmarks.collision_scenes import Crowd
from benchmarks.contenders import Prepared
from benchmarks.poses import Pair
from benchmarks.workloads import Bodies, Mesh, Planes, Rings

NAME, PACKAGE = "ours", None


def _one_solid(solid: engine.Solid, threads: int) -> Prepared:
    used: list[str] = []

    def method() -> str:
        return used[-1] if used else ""

    def ask(points: np.ndarray) -> np.ndarray:
        locations, accuracy = engine.locate(points, solid, workers=threads, report=True)
        used[:] = [accuracy.method]
        return locations

    return Prepared(lambda points: points, ask, lambda found: found >= 0, lambda: solid.memory, method)


def _polyhedron(mesh: Mesh, threads: int) -> Prepared:
    return _one_solid(engine.Polyhedron(mesh.vertices, mesh.faces), threads)


def _polygon(rings: Rings, threads: int) -> Prepared:
    return _one_solid(engine.Polygon(rings.rings), threads)


def _convex(planes: Planes, threads: int) -> Prepared:
    return _one_solid(engine.Convex(planes.rows), threads)


def _scene(solids: list[Any], threads: int) -> Prepared:
    def ask(points: np.ndarray) -> engine.SceneLocations:
        return engine.locate_scene(points, solids, workers=threads)

    def answer(found: engine.SceneLocations) -> np.ndarray:
        owners = np.repeat(np.arange(len(found.offsets) - 1), np.diff(found.offsets))
        return owners * len(solids) + found.indices

    return Prepared(lambda points: points, ask, answer, lambda: sum(solid.memory for solid in solids))


def _scene_polygons(bodies: Bodies, threads: int) -> Prepared:
    return _scene([engine.Polygon(body.rings) for body in bodies.bodies], threads)


def _scene_polyhedra(bodies: Bodies, threads: int) -> Prepared:
    return _scene([engine.Polyhedron(body.vertices, body.faces) for body in bodies.bodies], threads)


def _mesh_pair(pair: Pair, threads: int) -> Prepared:
    first, second = pair.solids()

    def native(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return pair.rotations[rows], pair.translations[rows]

    def ask(poses: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        return engine.collide_poses(first, second, *poses, workers=threads)

    return Prepared(native, ask, lambda found: found, lambda: first.memory + second.memory)


def _convex_pair(pair: Pair, threads: int) -> Prepared:
    asked = _mesh_pair(pair, threads)
    return Prepared(asked.native, asked.ask, lambda found: found != engine.Relation.DISJOINT)


def _crowd(crowd: Crowd, threads: int) -> Prepared:
    """Every question starts from a list of solids and poses: nothing is kept but what a solid keeps of itself."""
    solids = _crowd_solids(crowd)
    poses = _crowd_poses(crowd)

    def ask(_: object) -> engine.ScenePairs:
        return engine.collide_scene(solids, poses, workers=threads)

    return Prepared(lambda rows: rows, ask, lambda found: found.first * len(solids) + found.second)


def _moving_crowd(crowd: Crowd, threads: int) -> Prepared:
    """The same question for each of the poses of `Crowd.frames`."""
    solids = _crowd_solids(crowd)

    def ask(frames: list[list[engine.Pose]]) -> engine.ScenePairs:
        for poses in frames:
            found = engine.collide_scene(solids, poses, workers=threads)
        return found

    return Prepared(
        lambda rows: [_crowd_poses(frame) for frame in crowd.frames()],
        ask,
        lambda found: found.first * len(solids) + found.second,
    )


def _crowd_solids(crowd: Crowd) -> list[engine.Polyhedron]:
    meshes = [engine.Polyhedron(mesh.vertices, mesh.faces) for mesh in crowd.meshes]
    return [meshes[kind] for kind in crowd.kinds]


def _crowd_poses(crowd: Crowd) -> list[engine.Pose]:
    return [engine.Pose(turn, move) for turn, move in zip(crowd.rotations, crowd.translations, strict=True)]


MAKERS = {
    "polyhedron": _polyhedron,
    "convex_pair": _convex_pair,
    "crowd": _crowd,
    "moving_crowd": _moving_crowd,
    "mesh_pair": _mesh_pair,
    "polygon": _polygon,
    "convex": _convex,
    "scene_polygons": _scene_polygons,
    "scene_polyhedra": _scene_polyhedra,
}
