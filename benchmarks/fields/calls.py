"""Single calls of ours, of 1, 10 and 100 items: the overhead of a call; constructors of solids, and bounds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np

import engine
from benchmarks import polygon_pairs, workloads
from benchmarks.bodies import random_rotations
from benchmarks.contenders import Prepared
from benchmarks.contenders.with_ours import solid_of
from benchmarks.contest import Contender, Contest, Size, Task
from benchmarks.errors import same

COUNTS = (1, 10, 100)
TURNS = 64
"""Different inputs, used in turn: a branch predictor learns a single one by heart."""
UNBOUNDED = ("half-space 3D", "implicit 3D", "csg 3D")
SEGMENTS = ("aabb 2D", "aabb 3D", "sphere 3D", "convex of 20", "polygon of 16", "polyhedron of 80")
Call = tuple[str, Callable[[Any], object], Callable[[], list[Any]], int]


def tasks(size: Size) -> Iterator[Task]:
    """Yield the rows."""
    for name, ask, items, count in _calls(size):
        yield Task(name, partial(_contest, name, ask, items, count))


def _contest(name: str, ask: Callable[[Any], object], items: Callable[[], list[Any]], count: int) -> Contest:
    following = cycle(items())
    ours = Contender("ours", lambda: Prepared(lambda _: ask(next(following))))
    return Contest("calls", name, False, None, None, same, [ours], count=count)


def _calls(size: Size) -> Iterator[Call]:
    solids = _solids(size.seed)
    for name, make in solids.items():
        yield f"make {name}", lambda _, make=make: make(), lambda: [None], 1
        if name not in UNBOUNDED:  # bounds are cached, so a new solid each time
            yield f"bounds of {name}", lambda _, make=make: engine.bounds(make()), lambda: [None], 1
    queried = [("locate {} in", engine.locate, solids, ()), ("clip {} segments,", engine.clip_segments, SEGMENTS, (2,))]
    queried.append(("clip {} polygons,", engine.clip_polygons, ("aabb 2D", "aabb 3D", "convex 2D"), None))
    for shown, ask, names, shape in queried:
        for name in names:
            for n in COUNTS:
                solid = solids[name]()
                items = partial(_rings, size.seed, solid.dimension, n) if shape is None else partial(
                    _draw, size.seed, shown, n, *shape, solid.dimension)  # fmt: skip
                yield f"{shown.format(n)} {name}", partial(_second, ask, solid), items, n
    star, first, second = (solids[name]() for name in ("polygon of 16", *["polyhedron of 80"] * 2))
    poses, sides = partial(_poses, size.seed), partial(_sides, size.seed)
    for n in COUNTS:
        yield f"collide {n} poses of 80", lambda one: engine.collide_poses(first, second, *one), partial(poses, n), n
        yield f"clearance of {n} poses of 80", lambda p: engine.clearance_poses(first, second, *p), partial(poses, n), n
        triangles = partial(_triangles, size.seed, n)
        yield f"collide {n} triangles", lambda both: engine.collide_triangles(*both), triangles, n
        yield f"overlay {n} pairs of 8", lambda both: engine.overlay_batch(*both), partial(sides, n), n
        yield f"unite {n} polygons of 8", lambda both: engine.union_all(both[0]), partial(sides, n), n
        rings = partial(_rings, size.seed, 2, n)
        yield f"fill {n} rings of 8", lambda some: engine.filled(list(some), "non_zero"), rings, n
        yield f"clip {n} lines of 8", lambda some: engine.clip_lines(some, star), rings, n
    yield from _scenes(size.seed, solids)
    yield "clearance of polyhedra of 80", lambda p: engine.clearance(first, second, second_pose=p), partial(poses, 0), 1
    yield "collide polyhedra of 80", lambda one: engine.collide(first, second, second_pose=one), partial(poses, 0), 1
    yield "overlay of a pair of 8", lambda both: engine.overlay(both[0][0], both[1][0]), partial(sides, 1), 1
    pairs = partial(polygon_pairs.small, "star", 8, TURNS, size.seed)
    yield "overlay of a pair of 8, from arrays to pieces", _from_arrays, pairs, 1


def _scenes(seed: int, solids: dict[str, Callable[[], Any]]) -> Iterator[Call]:
    """Yield questions to ten posed balls, boxes and polyhedra of 80, in turn: passed each time, and as a stored
    scene."""
    names = ("sphere 3D", "aabb 3D", "polyhedron of 80")
    bodies, poses = [solids[names[k % 3]]() for k in range(10)], _poses(seed, 0)[:10]
    scene = engine.Scene(bodies, poses)
    yield "collide 10 bodies", lambda _: engine.collide_scene(bodies, poses), lambda: [None], 10
    for n in COUNTS:
        points, segments = (partial(_draw, seed, f"scene {n}", n, *shape) for shape in ((3,), (2, 3)))
        yield f"locate {n} in 10 bodies", lambda some: engine.locate_scene(some, bodies, poses), points, n
        yield f"locate {n} in a kept scene", scene.locate, points, n
        yield f"clip {n} segments on a kept scene", scene.clip_segments, segments, n


def _second(ask: Callable[..., object], solid: engine.Solid, items: Any) -> object:
    return ask(items, solid)


def _solids(seed: int) -> dict[str, Callable[[], Any]]:
    mesh, planes = workloads.bumpy_sphere("rows/calls", seed, 1), workloads.convex_of(20, seed).planes
    rings = workloads.star_polygon(16, seed)
    return {name: make for name, make in workloads.SIMPLE.items() if name not in ("sphere 2D", "half-space 2D")} | {
        "convex of 20": lambda: engine.Convex(planes),
        "polygon of 16": lambda: solid_of(rings),
        "polyhedron of 80": lambda: solid_of(mesh),
    }


def _draw(seed: int, name: str, n_items: int, *shape: int) -> list[np.ndarray]:
    return list(workloads.generator(f"rows/calls {name}", seed).uniform(-1.3, 1.3, (TURNS, n_items, *shape)))


def _rings(seed: int, dimension: int, n_items: int) -> list[np.ndarray]:
    return list(workloads.star_rings(8, dimension, TURNS * n_items, seed).reshape(TURNS, n_items, 8, dimension))


def _poses(seed: int, n_items: int) -> list[Any]:
    """Return poses as arrays; where n_items is 0, single ones as objects."""
    draw = workloads.generator("rows/calls poses", seed)
    moves = [(random_rotations(draw, n_items or 1), draw.uniform(-1.5, 1.5, (n_items or 1, 3))) for _ in range(TURNS)]
    return moves if n_items else [engine.Pose(turns[0], places[0]) for turns, places in moves]


def _triangles(seed: int, n_items: int) -> list[Any]:
    return list(zip(_draw(seed, "first", n_items, 3, 3), _draw(seed, "second", n_items, 3, 3), strict=True))


def _sides(seed: int, n_items: int) -> list[Any]:
    made = [tuple(map(engine.Polygon, pair)) for pair in polygon_pairs.small("star", 8, TURNS * n_items, seed)]
    return [tuple(map(list, zip(*made[start : start + n_items]))) for start in range(0, len(made), n_items)]


def _from_arrays(pair: Any) -> object:
    result = engine.overlay(*map(engine.Polygon, pair))
    return [piece.shell for piece in result.pieces]  # type: ignore[union-attr]
