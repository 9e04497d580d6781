"""Open3D: `RaycastingScene.compute_occupancy` (Embree): float32, one ray a point, parity of the hits; meshes that meet.

For a scene of bodies it is given one raycasting scene a body, each for the points in the body's box. The boxes
are found as a careful user would: points sorted along x once, a binary search for each body, then y and z.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import open3d
from open3d.core import Tensor
from open3d.t.geometry import RaycastingScene

from benchmarks.contenders import Couple, Prepared, merged, meshes_of
from benchmarks.workloads import Bodies, Mesh

PACKAGE = "open3d"
NAMES = {"": "Open3D", "points": "Open3D occupancy", "scene": "Open3D occupancy"}

open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)


def _read(path: str) -> tuple[np.ndarray, np.ndarray]:
    made = open3d.io.read_triangle_mesh(path)
    return np.asarray(made.vertices), np.asarray(made.triangles)


READERS = dict.fromkeys((".stl", ".obj", ".off", ".ply", ".glb"), _read)


def _scene_of(mesh: Mesh, threads: int) -> RaycastingScene:
    scene = RaycastingScene(nthreads=threads)
    scene.add_triangles(Tensor(mesh.vertices.astype(np.float32)), Tensor(mesh.faces.astype(np.uint32)))
    # Embree builds its tree at the first question
    scene.compute_occupancy(Tensor(mesh.vertices[:1].astype(np.float32)), nthreads=threads)
    return scene


def _points(mesh: Mesh, threads: int, samples: float = 1) -> Prepared:
    """Samples: rays a point, whose majority decides."""
    scene = _scene_of(mesh, threads)
    return Prepared(
        lambda points: scene.compute_occupancy(points, nthreads=threads, nsamples=int(samples)),
        lambda points: Tensor(points.astype(np.float32)),
        lambda result: result.numpy() > 0.5,
    )


def _scene(bodies: Bodies, threads: int) -> Prepared:
    scenes = [_scene_of(body, threads) for body in bodies.bodies]
    lows = np.array([body.vertices.min(axis=0) for body in bodies.bodies], np.float32)
    highs = np.array([body.vertices.max(axis=0) for body in bodies.bodies], np.float32)

    def ask(points: np.ndarray) -> list[np.ndarray]:
        order = np.argsort(points[:, 0])
        along = points[order]
        starts = np.searchsorted(along[:, 0], lows[:, 0])
        stops = np.searchsorted(along[:, 0], highs[:, 0], side="right")
        result = []
        for i_body, scene in enumerate(scenes):
            slab = along[starts[i_body] : stops[i_body]]
            y, z = slab[:, 1], slab[:, 2]
            low, high = lows[i_body], highs[i_body]
            near = np.flatnonzero((y >= low[1]) & (y <= high[1]) & (z >= low[2]) & (z <= high[2]))
            if len(near):
                contained = scene.compute_occupancy(Tensor(slab[near]), nthreads=threads).numpy() > 0.5
                result.append(order[starts[i_body] + near[contained]] * len(scenes) + i_body)
        return result

    return Prepared(ask, lambda points: points.astype(np.float32), lambda result: np.sort(np.concatenate(result)))


def _rays(segments: np.ndarray) -> Tensor:
    return Tensor(np.concatenate([segments[:, 0], segments[:, 1] - segments[:, 0]], axis=1).astype(np.float32))


def _along(ask: str, answer: Callable[[int, Any], Any]) -> Callable[[Mesh, int], Prepared]:
    """Return the maker of one question about segments, as rays whose t counts lengths of the segment."""

    def make(mesh: Mesh, threads: int) -> Prepared:
        scene = _scene_of(mesh, threads)
        run = getattr(scene, ask)
        return Prepared(
            lambda rays: (len(rays), run(rays, nthreads=threads)), _rays, lambda result: answer(*result)
        )  # fmt: skip

    return make


def _places(n_segments: int, result: dict[str, Tensor]) -> tuple[np.ndarray, np.ndarray]:
    t, segments = result["t_hit"].numpy().astype(float), result["ray_ids"].numpy().astype(np.int64)
    return segments[t <= 1.0], t[t <= 1.0]


def _first(n_segments: int, result: dict[str, Tensor]) -> np.ndarray:
    t = result["t_hit"].numpy().astype(float)
    return np.where(t <= 1.0, t, np.nan)


def _volume(mesh: Mesh, threads: int) -> Prepared:
    vector = open3d.utility
    made = open3d.geometry.TriangleMesh(
        vector.Vector3dVector(mesh.vertices), vector.Vector3iVector(mesh.faces.astype(np.int32))
    )
    return Prepared(lambda _: made.get_volume())


def _through(keep: str) -> Callable[[Bodies, int], Prepared]:
    """Return the maker of one raycasting scene of all bodies: all hits of rays, the first, or whether there is any."""

    def make(bodies: Bodies, threads: int) -> Prepared:
        mesh, owners = merged(bodies)
        scene = _scene_of(mesh, threads)

        def all_met(result: dict[str, Tensor]) -> np.ndarray:
            hits = result["t_hit"].numpy() <= 1.0
            rays, faces = result["ray_ids"].numpy().astype(np.int64)[hits], result["primitive_ids"].numpy()[hits]
            return np.unique(rays * len(bodies.bodies) + owners[faces])

        if keep == "all":
            return Prepared(lambda rays: scene.list_intersections(rays, nthreads=threads), _rays, all_met)
        if keep == "first":
            return Prepared(lambda rays: scene.cast_rays(rays, nthreads=threads), _rays,
                            lambda result: result["t_hit"].numpy() <= 1.0)  # fmt: skip
        return Prepared(lambda rays: scene.test_occlusions(rays, 0.0, 1.0, nthreads=threads), _rays,
                        lambda result: result.numpy())  # fmt: skip

    return make


def _pair(pair: Couple, threads: int) -> Prepared:
    vector = open3d.utility
    make: Callable = open3d.geometry.TriangleMesh
    first, second = (
        make(vector.Vector3dVector(mesh.vertices), vector.Vector3iVector(mesh.faces.astype(np.int32)))
        for mesh in meshes_of(pair)
    )
    return Prepared(lambda _: first.is_intersecting(second))


def _distances(mesh: Mesh, threads: int) -> Prepared:
    scene = _scene_of(mesh, threads)
    return Prepared(
        lambda points: scene.compute_distance(points, nthreads=threads),
        lambda points: Tensor(points.astype(np.float32)),
        lambda result: result.numpy().astype(float),
    )


def _signed_distances(mesh: Mesh, threads: int) -> Prepared:
    scene = _scene_of(mesh, threads)
    return replace(
        _distances(mesh, threads), ask=lambda points: scene.compute_signed_distance(points, nthreads=threads)
    )


def _within(asked: tuple[Mesh, float], threads: int) -> Prepared:
    prepared = _distances(asked[0], threads)
    return Prepared(prepared.ask, prepared.native, lambda result: result.numpy() <= asked[1])


MAKERS = {
    "points": _points, "scene": _scene, "pair": _pair, "point distances": _distances, "points within": _within,
    "signed distances": _signed_distances, "volume": _volume, "first hits": _along("cast_rays", _first),
    "hits": _along("cast_rays", lambda n, result: ~np.isnan(_first(n, result))),
    "hit counts": _along("list_intersections", lambda n, result: np.bincount(_places(n, result)[0], minlength=n)),
    "all hits": _along("list_intersections", lambda n, result: list(zip(*map(np.ndarray.tolist, _places(n, result))))),
} | {
    f"scene {keep}": _through(keep) for keep in ("all", "first", "any")
}  # fmt: skip
