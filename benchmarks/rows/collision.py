"""Pairs under many poses, small pairs, pairs of simple solids, scenes, triangles, the hard set: on one thread."""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator
from functools import partial
from itertools import pairwise, product
from typing import Any

import numpy as np

import engine
from benchmarks import workloads
from benchmarks.collision_scenes import BALLS, convex_pair, crowd
from benchmarks.poses import Pair, pair_of_size, random_rotations
from benchmarks.rows import Question, Run, Size, asked_before
from benchmarks.rows.containment import simple_solids


def questions(size: Size) -> Iterator[Question]:
    """Yield the rows of collision."""
    for faces in ("1k",) if size.is_quick else ("1k", "10k", "86k", "soup"):
        yield Question(f"collision, poses near contact, {faces}", partial(_poses, size, faces, ()))
    for option in ("boolean", "witnesses", "detail"):
        yield Question(f"collision, poses near contact, 1k, {option}", partial(_poses, size, "1k", (option,)))
    for n_vertices in BALLS:
        yield Question(f"collision, poses, convex of {n_vertices}", partial(_convex_poses, size, n_vertices))
    yield Question("collision, first question, 1k", partial(_first, size))
    yield Question("collision, pairs of simple solids", partial(_simple, size))
    yield Question("collision, pairs of polygons", partial(_polygons, size))
    n_bodies = size.of(10_000, 1_000)
    yield Question(f"collision, scene of {n_bodies}", partial(_scene, size, n_bodies))
    yield Question("collision, scene of 2000 from arrays", partial(_first_scene, size, size.of(2_000, 300)))
    yield Question("collision, scene of balls and boxes", partial(_simple_scene, size, size.of(10_000, 1_000)))
    yield Question("collision, flush stack, a scene", partial(_flush_stack, size, True))
    yield Question("collision, flush stack, call by call", partial(_flush_stack, size, False))
    for dimension in (2, 3):
        yield Question(f"collision, triangles {dimension}D", partial(_triangles, size, dimension))
    yield Question("collision, hard set", partial(_hard, size))


def _ask(pair: Pair, options: tuple[str, ...] = ()) -> Run:
    first, second = pair.solids()
    said: Any = dict.fromkeys(options, True)
    return asked_before(
        lambda: engine.collide_poses(first, second, pair.rotations, pair.translations, workers=1, **said), 2
    )


def _poses(size: Size, faces: str, options: tuple[str, ...]) -> Run:
    return _ask(
        pair_of_size(
            faces, size.of(200 if "witnesses" in options else 500 if faces == "86k" else 1_000, 100), size.seed
        ),
        options,
    )


def _convex_poses(size: Size, n_vertices: int) -> Run:
    return _ask(convex_pair(n_vertices, size.of(10_000, 1_000), size.seed))


def _first(size: Size) -> Run:
    pair = pair_of_size("1k", 16, size.seed)
    poses = [engine.Pose(turn, move) for turn, move in zip(pair.rotations, pair.translations, strict=True)]
    return lambda: [engine.collide(*pair.solids(), second_pose=pose).relation for pose in poses]


def _simple(size: Size) -> Run:
    """Every simple solid with every other of its dimension that collision is defined for, and a tetrahedron."""
    solids = [*simple_solids().values()]
    corners = [[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]]
    solids.append(engine.Polyhedron(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))
    pairs = []
    for first, second in product(solids, solids):
        try:
            engine.collide(first, second, workers=1)
        except engine.EngineError:
            continue
        pairs.append((first, second))
    return lambda: [engine.collide(first, second, workers=1) for first, second in pairs]


def _polygons(size: Size) -> Run:
    bodies = workloads.polygon_scene(100, size.seed).bodies
    solids = [engine.Polygon(body.rings) for body in bodies]
    return asked_before(lambda: [engine.collide(first, second, workers=1) for first, second in pairwise(solids)], 2)


def _scene(size: Size, n_bodies: int) -> Run:
    bodies = crowd(n_bodies, size.seed)
    kinds = [engine.Polyhedron(mesh.vertices, mesh.faces) for mesh in bodies.meshes]
    solids = [kinds[kind] for kind in bodies.kinds]
    poses = [engine.Pose(turn, move) for turn, move in zip(bodies.rotations, bodies.translations, strict=True)]
    return asked_before(lambda: engine.collide_scene(solids, poses, workers=1), 2)


def _first_scene(size: Size, n_bodies: int) -> Run:
    bodies = crowd(n_bodies, size.seed)

    def run() -> object:
        solids = [engine.Polyhedron(bodies.meshes[kind].vertices, bodies.meshes[kind].faces) for kind in bodies.kinds]
        poses = [engine.Pose(turn, move) for turn, move in zip(bodies.rotations, bodies.translations, strict=True)]
        return engine.collide_scene(solids, poses, workers=1)

    return run


def _simple_scene(size: Size, n_bodies: int) -> Run:
    draw, side = workloads.generator("rows/simple scene", size.seed), 1.25 * n_bodies ** (1 / 3)
    middles = draw.uniform(0.0, side, (n_bodies, 3))
    solids = [
        engine.Sphere(middle, 0.5) if number % 2 else engine.Aabb(middle - 0.4, middle + 0.4)
        for number, middle in enumerate(middles)
    ]
    return asked_before(lambda: engine.collide_scene(solids, workers=1), 2)


def _flush_stack(size: Size, is_scene: bool) -> Run:
    """300 boxes on one another under one pose."""
    draw = workloads.generator("flush stacks", size.seed)
    pose = engine.Pose(random_rotations(draw, 1)[0], draw.normal(size=3))
    faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    boxes = [
        engine.Polyhedron([[i & 1, i >> 1 & 1, (low, high)[i >> 2]] for i in range(8)], faces)
        for low, high in pairwise([0.1 * level for level in range(301)])
    ]
    if is_scene:
        return asked_before(lambda: engine.collide_scene(boxes, [pose] * len(boxes), workers=1), 2)
    return asked_before(
        lambda: [engine.collide(a, b, first_pose=pose, second_pose=pose, workers=1) for a, b in pairwise(boxes)], 2
    )


def _triangles(size: Size, dimension: int) -> Run:
    draw = workloads.generator(f"rows/triangles {dimension}", size.seed)
    first, second = (draw.uniform(0.0, 1.0, (size.of(200_000, 20_000), 3, dimension)) for _ in range(2))
    first[::10] = np.round(first[::10] * 4) / 4  # one in ten on a lattice, with its partner
    second[::10] = np.round(second[::10] * 4) / 4
    return lambda: engine.collide_triangles(first, second, workers=1)


def _hard(size: Size) -> Run:
    """The pairs of the hard set, from arrays; where there are no data, cubes that touch and coincide."""
    path = workloads.DATA / "hard_collision" / "cases.json.gz"
    if path.is_file():
        cases = json.loads(gzip.decompress(path.read_bytes()))[:: size.of(4, 20)]
        bodies = [[(case[key]["vertices"], case[key]["faces"]) for key in ("first", "second")] for case in cases]
    else:
        mesh = workloads.bumpy_sphere("rows/hard", size.seed, 1)
        bodies = [[(mesh.vertices, mesh.faces), (mesh.vertices + move, mesh.faces)] for move in (0.0, 2.0**-50, 0.5)]
    arrays = [[(np.array(v, float), np.array(f, np.int64)) for v, f in pair] for pair in bodies]
    return lambda: [engine.collide(*(engine.Polyhedron(*body) for body in pair), workers=1) for pair in arrays]
