"""Scenes that stay: segments through 1,000 bodies, and what moved of 10,000, beside Open3D and fcl where installed.

python -m benchmarks scenes [--quick]

Bodies are meshes of 1,000 faces, boxes and balls; peers get balls as meshes of as many faces. Each figure is the best
of some runs, all contenders in turns. `wrong` counts segments for which Open3D's crossings within the segment are not
as many as the faces that ours crosses, or which it sees met where ours proves that nothing is, and the other way round.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import engine
from benchmarks.measure import clocked
from benchmarks.workloads import Mesh

Array = Any


def _ball(n_around: int = 25, n_belts: int = 20) -> Mesh:
    """Return a ball of 1,000 faces."""
    rise, turn = np.pi * (np.arange(n_belts) + 1) / (n_belts + 1), 2 * np.pi * np.arange(n_around) / n_around
    belts = [[np.sin(r) * np.cos(t), np.sin(r) * np.sin(t), -np.cos(r)] for r in rise for t in turn]
    here, last = np.arange(n_around), n_around * n_belts
    there = (here + 1) % n_around
    faces = [np.stack([here * 0 + last, there, here], 1)]
    for a, b in ((start + here, start + there) for start in range(0, last - n_around, n_around)):
        faces += [np.stack([a, b, b + n_around], 1), np.stack([a, b + n_around, a + n_around], 1)]
    faces.append(np.stack([here * 0 + last + 1, last - n_around + here, last - n_around + there], 1))
    return Mesh("ball", np.array([*belts, [0, 0, -1], [0, 0, 1]]), np.concatenate(faces))


_MESH = _ball()


def scattered(n: int, rng: np.random.Generator) -> engine.Scene:
    """Return n bodies of radius 0.04 and less, in the unit cube where they are 1,000, as dense where they are more."""
    size, solids = 0.4 / max(1.0, n / 1000) ** (1 / 3), []
    radius = 0.1 * size
    for k in range(n):
        center = rng.uniform(0, 1, 3)
        if k % 3 == 0:
            faces = np.asarray(_MESH.faces, np.int64)
            solids.append(engine.Polyhedron(_MESH.vertices * radius + center, faces))
        elif k % 3 == 1:
            solids.append(engine.Aabb(center - 0.7 * radius, center + 0.7 * radius))
        else:
            solids.append(engine.Sphere(center, radius))
    return engine.Scene(solids)


def triangles_of(scene: engine.Scene) -> tuple[Array, Array]:
    """Return vertices and faces of all bodies as one mesh; balls as meshes."""
    vertices, faces, n = [], [], 0
    quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    for solid in scene.solids:
        triangles: Any = np.asarray(_MESH.faces)
        if isinstance(solid, engine.Aabb):
            corners = np.array([[(solid.min, solid.max)[i >> k & 1][k] for k in range(3)] for i in range(8)])
            triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
        elif isinstance(solid, engine.Sphere):
            corners = _MESH.vertices * solid.radius + solid.center
        else:
            corners = solid.vertices  # type: ignore[attr-defined]
        vertices.append(corners)
        faces.append(np.asarray(triangles) + n)
        n += len(corners)
    return np.concatenate(vertices), np.concatenate(faces)


def segments_of(scene: engine.Scene, n: int, is_grazing: bool, rng: np.random.Generator) -> Array:
    """Return random segments of the unit cube, or ones through vertices and edges of the meshes and boxes."""
    segments = rng.uniform(0, 1, (n, 2, 3))
    if is_grazing:
        vertices, faces = triangles_of(scene)
        face = faces[rng.integers(len(faces), size=n)]
        share = np.where(rng.random((n, 1)) < 0.5, 0.0, 0.5)
        on = vertices[face[:, 0]] * (1 - share) + vertices[face[:, 1]] * share
        way = rng.normal(size=(n, 3)) * 0.25
        segments = np.stack([on - way, on + way], axis=1)
    return segments


def best(runs: dict[str, Callable[[], object]], turns: int) -> dict[str, float]:
    """Return the least seconds of each run, all in turns."""
    found = dict.fromkeys(runs, np.inf)
    for _ in range(turns + 1):
        for name, run in runs.items():
            found[name] = min(found[name], clocked(run)[0])
    return found


def through(n: int, is_quick: bool) -> Iterator[str]:
    """Yield a line for each number of segments."""
    rng = np.random.default_rng(0)
    scene = scattered(n, rng)
    for many, is_grazing in ((1, False), (10, False), (100, False), (10_000, True), (100_000, False)):
        if is_quick and many > 100:
            continue
        segments = segments_of(scene, many, is_grazing, rng)
        runs: dict[str, Any] = {
            keep: lambda keep=keep, segments=segments: scene.clip_segments(segments, keep=keep)
            for keep in ("all", "first", "any")
        }
        wrong = ""
        try:
            runs |= with_open3d(scene, segments)
        except ImportError:
            pass
        else:
            wrong = errors_of_open3d(scene, segments, runs)
        seconds = best(runs, 3 if many > 1000 else 20)
        figures = ", ".join(f"{name} {1e3 * seconds[name]:.3f} ms" for name in seconds)
        yield f"{many:,} segments{' that graze' * is_grazing}: {figures}{wrong}"


def with_open3d(scene: engine.Scene, segments: Array) -> dict[str, Callable[[], Any]]:
    """Return what is asked of Open3D (Embree, float32)."""
    import open3d

    vertices, faces = triangles_of(scene)
    theirs = open3d.t.geometry.RaycastingScene()
    theirs.add_triangles(open3d.core.Tensor(vertices.astype(np.float32)), open3d.core.Tensor(faces.astype(np.uint32)))
    rays = np.concatenate([segments[:, 0], segments[:, 1] - segments[:, 0]], axis=1).astype(np.float32)
    given = open3d.core.Tensor(rays)
    return {
        "open3d list_intersections": lambda: theirs.list_intersections(given),
        "open3d test_occlusions": lambda: theirs.test_occlusions(given, 0.0, 1.0),
    }


def errors_of_open3d(scene: engine.Scene, segments: Array, runs: dict[str, Any]) -> str:
    """Count its errors against the same triangles, asked exactly."""
    vertices, faces = triangles_of(scene)
    exact = engine.Scene([engine.Surface(vertices, faces)])
    ours: Any = exact.clip_segments(segments)
    listed = runs["open3d list_intersections"]()
    splits, t = listed["ray_splits"].numpy(), listed["t_hit"].numpy()
    owners = np.repeat(np.arange(len(segments)), np.diff(splits))
    theirs = np.bincount(owners[t <= 1.0], minlength=len(segments))
    counts = np.bincount(ours.source, minlength=len(segments))
    met = runs["open3d test_occlusions"]().numpy()
    wrong = (theirs != counts).sum(), (met != (counts > 0)).sum()
    return f"; open3d wrong: {wrong[0]:,} lists, {wrong[1]:,} occlusions"


def moving(n: int, n_moved: int) -> Iterator[str]:
    """Yield lines on bodies that move: new pairs against all pairs, and single questions."""
    rng = np.random.default_rng(1)
    scene = scattered(n, rng)
    whole = best({"all pairs": lambda: engine.collide_scene(list(scene.solids)), "kept": lambda: scene.collide()}, 2)
    named = rng.choice(n, n_moved, replace=False).tolist()

    def step() -> object:
        shift = rng.uniform(-0.01, 0.01, (n_moved, 3))
        poses = {body: engine.Pose(np.eye(3), by) for body, by in zip(named, shift)}
        return scene.moved(poses).collide(moved=named)

    seconds = best({"new pairs": step}, 10)["new pairs"]
    yield (
        f"{n:,} bodies: all pairs {1e3 * whole['all pairs']:.1f} ms, of a kept scene {1e3 * whole['kept']:.1f} ms; "
        f"{n_moved} moved: new pairs {1e3 * seconds:.2f} ms, 1/{whole['all pairs'] / seconds:.0f}"
    )
    point, segment = rng.uniform(0, 1, (1, 3)), rng.uniform(0, 1, (1, 2, 3)) * 0.1 + 0.45
    pose = {named[0]: engine.Pose(np.eye(3), [0.001, 0, 0])}
    single = best(
        {
            "a point": lambda: scene.locate(point),
            "a segment": lambda: scene.clip_segments(segment),
            "a moved body": lambda: scene.moved(pose).collide(moved=named[:1]),
        },
        50,
    )
    yield f"{n:,} bodies, one question: " + ", ".join(f"{name} {1e6 * took:.0f} us" for name, took in single.items())
    points = rng.uniform(0, 1, (100_000, 3))
    located = best(
        {
            "kept": lambda: scene.locate(points),
            "locate_scene": lambda: engine.locate_scene(points, list(scene.solids)),
        },
        2,
    )
    yield "100,000 points: " + ", ".join(f"{name} {1e3 * took:.1f} ms" for name, took in located.items())


def main(words: list[str] | None = None) -> int:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="few bodies and segments, seconds")
    is_quick = parser.parse_args(words).quick
    for line in through(100 if is_quick else 1_000, is_quick):
        print(line, flush=True)
    for line in moving(500 if is_quick else 10_000, 20 if is_quick else 100):
        print(line, flush=True)
    return 0
