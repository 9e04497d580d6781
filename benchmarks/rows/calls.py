"""Single calls of 1, 10 and 100 items, as a later question and as the first about new solids; bounds of every solid."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

import engine
from benchmarks import polygon_pairs, workloads
from benchmarks.poses import random_rotations
from benchmarks.rows import Question, Run, Size, asked_before, in_turn
from benchmarks.rows.containment import simple_solids

COUNTS = (1, 10, 100)
TURNS = 64
"""Different inputs, asked in turn."""
Make = Callable[[], engine.Solid]


def questions(size: Size) -> Iterator[Question]:
    """Yield the rows of single calls."""
    for name, make in _solids(size).items():
        yield Question(f"call, make {name}", lambda make=make: make)
        if name not in ("half-space 3D", "implicit 3D", "csg 3D"):
            yield Question(f"call, bounds of {name}", partial(_bounds, make))
        for n_items in COUNTS:
            yield Question(f"call, locate {n_items} in {name}", partial(_locate, size, make, n_items))
    for name in ("aabb 2D", "aabb 3D", "sphere 3D", "convex of 20", "polygon of 16", "polyhedron of 80"):
        for n_items in COUNTS:
            yield Question(f"call, clip {n_items} segments, {name}", partial(_segments, size, name, n_items))
    for name in ("aabb 2D", "aabb 3D", "convex 2D"):
        for n_items in COUNTS:
            yield Question(f"call, clip {n_items} polygons, {name}", partial(_polygons, size, name, n_items))
    yield Question("call, collide polyhedra of 80", partial(_collide, size))
    for n_items in COUNTS:
        yield Question(f"call, collide {n_items} poses of 80", partial(_poses, size, n_items))
        yield Question(f"call, collide {n_items} triangles", partial(_triangles, size, n_items))
        yield Question(f"call, overlay {n_items} pairs of 8", partial(_overlays, size, n_items))
    yield Question("call, overlay a pair of 8 from arrays", partial(_overlay_from_arrays, size))


def _solids(size: Size) -> dict[str, Make]:
    mesh = workloads.bumpy_sphere("rows/calls", size.seed, 1)
    rings, planes = workloads.star_polygon(16, size.seed).rings, workloads.convex_planes(20, size.seed).rows
    names = ("aabb 2D", "aabb 3D", "sphere 3D", "half-space 3D", "convex 2D", "triangle 2D", "implicit 3D", "csg 3D")
    return {name: partial(_again, name) for name in names} | {
        "convex of 20": lambda: engine.Convex(planes),
        "polygon of 16": lambda: engine.Polygon(rings),
        "polyhedron of 80": lambda: engine.Polyhedron(mesh.vertices, mesh.faces),
    }


def _again(name: str) -> engine.Solid:
    return simple_solids()[name]


def _draw(size: Size, name: str, n_items: int, *shape: int) -> list[np.ndarray]:
    draw = workloads.generator(f"rows/calls {name}", size.seed)
    return list(draw.uniform(-1.3, 1.3, (TURNS, n_items, *shape)))


def _bounds(make: Make) -> Run:
    """Of a new solid each time: bounds are kept."""
    return lambda: engine.bounds(make())


def _locate(size: Size, make: Make, n_items: int) -> Run:
    solid = make()
    return in_turn(lambda points: engine.locate(points, solid), _draw(size, "points", n_items, solid.dimension))


def _segments(size: Size, name: str, n_items: int) -> Run:
    region = _solids(size)[name]()
    items = _draw(size, "segments", n_items, 2, region.dimension)
    return in_turn(lambda segments: engine.clip_segments(segments, region), items)


def _polygons(size: Size, name: str, n_items: int) -> Run:
    region = _again(name)
    rings = workloads.star_rings(8, region.dimension, TURNS * n_items, size.seed)
    items = list(rings.reshape(TURNS, n_items, 8, region.dimension))
    return in_turn(lambda polygons: engine.clip_polygons(polygons, region), items)


def _moves(size: Size, n_items: int) -> list[tuple[np.ndarray, np.ndarray]]:
    draw = workloads.generator("rows/calls poses", size.seed)
    return [(random_rotations(draw, n_items), draw.uniform(-1.5, 1.5, (n_items, 3))) for _ in range(TURNS)]


def _collide(size: Size) -> Run:
    first, second = (_solids(size)["polyhedron of 80"]() for _ in range(2))
    poses: list[Any] = [engine.Pose(turns[0], moves[0]) for turns, moves in _moves(size, 1)]
    return in_turn(lambda pose: engine.collide(first, second, second_pose=pose), poses)


def _poses(size: Size, n_items: int) -> Run:
    first, second = (_solids(size)["polyhedron of 80"]() for _ in range(2))
    return in_turn(lambda poses: engine.collide_poses(first, second, *poses), _moves(size, n_items))


def _triangles(size: Size, n_items: int) -> Run:
    pairs = list(zip(_draw(size, "first", n_items, 3, 3), _draw(size, "second", n_items, 3, 3), strict=True))
    return in_turn(lambda pair: engine.collide_triangles(*pair), pairs)


def _overlays(size: Size, n_items: int) -> Run:
    first, second = polygon_pairs.small("star", 8, TURNS * n_items, size.seed)
    sides = [[engine.Polygon([ring]) for ring in rings] for rings in (first, second)]
    starts = range(0, TURNS * n_items, n_items)
    pairs = [tuple(side[start : start + n_items] for side in sides) for start in starts]
    if n_items == 1:
        return in_turn(lambda pair: engine.overlay(pair[0][0], pair[1][0]), pairs)
    return asked_before(in_turn(lambda pair: engine.overlay_batch(*pair), pairs))


def _overlay_from_arrays(size: Size) -> Run:
    pairs = list(zip(*polygon_pairs.small("star", 8, TURNS, size.seed), strict=True))

    def ask(pair: Any) -> object:
        found = engine.overlay(*(engine.Polygon([ring]) for ring in pair))
        return [piece.shell for piece in found.pieces]

    return in_turn(ask, pairs)
