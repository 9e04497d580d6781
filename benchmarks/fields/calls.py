"""Single calls of ours, of 1, 10 and 100 items: what a call costs; making solids, and their bounds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np

import engine
from benchmarks import polygon_pairs, workloads
from benchmarks.contenders import Prepared
from benchmarks.contest import Contender, Contest
from benchmarks.errors import same
from benchmarks.fields import Size, Task
from benchmarks.poses import random_rotations

COUNTS = (1, 10, 100)
TURNS = 64
"""Different inputs, asked in turn: a single one would be learned by heart."""
UNBOUNDED = ("half-space 3D", "implicit 3D", "csg 3D")
Make = Callable[[], engine.Solid]


def table(size: Size) -> Iterator[Task]:
    """Yield the rows of the table."""
    for name, ask, items, count in _calls(size):
        yield name, partial(_contest, name, ask, items, count)


def _contest(name: str, ask: Callable[[Any], object], items: Callable[[], list[Any]], count: int) -> Contest:
    following = cycle(items())
    ours = Contender("ours", lambda: Prepared(lambda _: ask(next(following))))
    return Contest("calls", name, False, None, None, same, [ours], count=count)


Call = tuple[str, Callable[[Any], object], Callable[[], list[Any]], int]


def _calls(size: Size) -> Iterator[Call]:
    solids = _solids(size)
    for name, make in solids.items():
        yield f"make {name}", lambda _, make=make: make(), lambda: [None], 1
        if name not in UNBOUNDED:  # bounds are kept, so of a new solid each time
            yield f"bounds of {name}", lambda _, make=make: engine.bounds(make()), lambda: [None], 1
        for n in COUNTS:
            points = partial(_draw, size, "points", n, make().dimension)
            yield f"locate {n} in {name}", partial(_second, engine.locate, make()), points, n
    for name in ("aabb 2D", "aabb 3D", "sphere 3D", "convex of 20", "polygon of 16", "polyhedron of 80"):
        for n in COUNTS:
            region = solids[name]()
            segments = partial(_draw, size, "segments", n, 2, region.dimension)
            yield f"clip {n} segments, {name}", partial(_second, engine.clip_segments, region), segments, n
    for name in ("aabb 2D", "aabb 3D", "convex 2D"):
        for n in COUNTS:
            region = solids[name]()
            rings = partial(_rings, size, region.dimension, n)
            yield f"clip {n} polygons, {name}", partial(_second, engine.clip_polygons, region), rings, n
    first, second = (solids["polyhedron of 80"]() for _ in range(2))
    for n in COUNTS:
        poses = partial(_poses, size, n)
        yield f"collide {n} poses of 80", lambda poses: engine.collide_poses(first, second, *poses), poses, n
        yield f"collide {n} triangles", lambda both: engine.collide_triangles(*both), partial(_triangles, size, n), n
        yield f"overlay {n} pairs of 8", lambda sides: engine.overlay_batch(*sides), partial(_sides, size, n), n
    posed = partial(_poses, size, 0)
    yield "collide polyhedra of 80", lambda pose: engine.collide(first, second, second_pose=pose), posed, 1
    yield (
        "overlay of a pair of 8",
        lambda sides: engine.overlay(*(side[0] for side in sides)),
        partial(_sides, size, 1),
        1,
    )
    yield "overlay of a pair of 8, from arrays to pieces", _from_arrays, partial(_ring_pairs, size), 1


def _second(ask: Callable[..., object], solid: engine.Solid, items: Any) -> object:
    return ask(items, solid)


def _solids(size: Size) -> dict[str, Make]:
    mesh = workloads.bumpy_sphere("rows/calls", size.seed, 1)
    rings, planes = workloads.star_polygon(16, size.seed).rings, workloads.convex_planes(20, size.seed).rows
    names = ("aabb 2D", "aabb 3D", "sphere 3D", "half-space 3D", "convex 2D", "triangle 2D", "implicit 3D", "csg 3D")
    return {name: workloads.SIMPLE[name] for name in names} | {
        "convex of 20": lambda: engine.Convex(planes),
        "polygon of 16": lambda: engine.Polygon(rings),
        "polyhedron of 80": lambda: engine.Polyhedron(mesh.vertices, mesh.faces),
    }


def _draw(size: Size, name: str, n_items: int, *shape: int) -> list[np.ndarray]:
    return list(workloads.generator(f"rows/calls {name}", size.seed).uniform(-1.3, 1.3, (TURNS, n_items, *shape)))


def _rings(size: Size, dimension: int, n_items: int) -> list[np.ndarray]:
    return list(workloads.star_rings(8, dimension, TURNS * n_items, size.seed).reshape(TURNS, n_items, 8, dimension))


def _poses(size: Size, n_items: int) -> list[Any]:
    """Return poses as arrays; where n_items is 0, single ones as objects."""
    draw = workloads.generator("rows/calls poses", size.seed)
    moves = [(random_rotations(draw, n_items or 1), draw.uniform(-1.5, 1.5, (n_items or 1, 3))) for _ in range(TURNS)]
    return moves if n_items else [engine.Pose(turns[0], places[0]) for turns, places in moves]


def _triangles(size: Size, n_items: int) -> list[Any]:
    return list(zip(_draw(size, "first", n_items, 3, 3), _draw(size, "second", n_items, 3, 3), strict=True))


def _sides(size: Size, n_items: int) -> list[Any]:
    both = polygon_pairs.small("star", 8, TURNS * n_items, size.seed)
    sides = [[engine.Polygon([ring]) for ring in rings] for rings in both]
    return [tuple(side[start : start + n_items] for side in sides) for start in range(0, TURNS * n_items, n_items)]


def _ring_pairs(size: Size) -> list[Any]:
    return list(zip(*polygon_pairs.small("star", 8, TURNS, size.seed), strict=True))


def _from_arrays(pair: Any) -> object:
    found = engine.overlay(*(engine.Polygon([ring]) for ring in pair))
    return [piece.shell for piece in found.pieces]  # type: ignore[union-attr]
