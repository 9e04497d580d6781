"""Questions to locate, contains and locate_scene."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

import engine
from benchmarks.answers import shapes, solids
from benchmarks.answers.asking import Question, asker, drawn_by, family, same
from benchmarks.answers.draws import FAR_PLACES, NEAR_PLACES, Array, Draw, Place
from benchmarks.answers.solids import Shape, points_about

located = asker(engine.locate)
scene_located = asker(engine.locate_scene, "offsets indices on_boundary")


def contained(points: Array, solid: Any, workers: int | None) -> tuple[int, Any]:
    return len(points), engine.contains(points, solid, workers=workers)


def _about(draw: Draw, shape: Shape, sizes: tuple[int, ...]) -> Iterator[Question]:
    for n in sizes:
        yield partial(located, points_about(draw, shape.targets, n), shape.solid)


def _about_each(draw: Draw, places: tuple[Place, ...], sizes: tuple[int, ...]) -> Iterator[Question]:
    for shape in solids.each(draw, solids.LOCATED, places):
        yield from _about(draw, shape, sizes)


family("locate", "simple_solids", 16, lambda draw: _about_each(draw, NEAR_PLACES, (1, 300)))
family("locate", "simple_solids_far_away", 8, lambda draw: _about_each(draw, FAR_PLACES, (12,)))


@drawn_by("locate", 12)
def polyhedra_asked_again_and_again(draw: Draw) -> Iterator[Question]:
    """Few points, passes over all faces; then the tree; then cells, once they amortise."""
    shape = solids.polyhedron(draw, 3, draw.pick(NEAR_PLACES))
    yield from _about(draw, shape, (1, 10, 40, *(60,) * 16, 300))
    if draw.chance(0.4):
        yield from _about(draw, shape, (17_000,))


@drawn_by("locate", 12)
def polygons_asked_again_and_again(draw: Draw) -> Iterator[Question]:
    """Slabs of edges, then cells of the rings."""
    rings = draw.pick([shapes.large_coast, shapes.many_holes, *shapes.RINGS])(draw)
    shape = solids.polygon_of(rings, draw.pick(NEAR_PLACES))
    yield from _about(draw, shape, (1, 40, 700, 5000, 50))


@drawn_by("locate", 1)
def large_mesh(draw: Draw) -> Iterator[Question]:
    """A mesh so large, and points so near to it, that they are queried in the order of their cells."""
    shape = solids.polyhedron_of(shapes.ball(draw, 6, 0.05))
    near = shape.targets[draw.whole(0, len(shape.targets) - 1, 190_000)]
    yield partial(located, near * draw.uniform(0.99, 1.01, len(near), 1), shape.solid)


family("locate", "faces_of_many_vertices", 6, lambda draw: (
    question for _ in range(4) for question in _about(draw, solids.prism(draw, 3, draw.pick(NEAR_PLACES)), (300,))
))  # fmt: skip


@drawn_by("locate", 6)
def faces_in_another_order(draw: Draw) -> Iterator[Question]:
    for _ in range(4):
        vertices, faces = draw.pick(shapes.MESHES)(draw)
        first = solids.polyhedron_of((vertices, faces))
        names = draw.order(len(vertices))
        moved = np.argsort(names)[faces][draw.order(len(faces))]
        second = engine.Polyhedron(vertices[names], np.roll(moved, draw.one(0, 2), axis=1))
        points = points_about(draw, first.targets, draw.pick([30, 500]))
        yield partial(_in_order, points, first.solid, second)
    for _ in range(4):
        shape = solids.polygon(draw)
        rings = np.split(shape.solid.vertices, shape.solid.ring_offsets[1:-1])
        turned = [np.roll(ring, draw.one(0, 5), axis=0)[:: draw.pick([1, -1])] for ring in rings[::-1]]
        yield partial(_in_order, points_about(draw, shape.targets, 500), shape.solid, engine.Polygon(turned))


def _in_order(points: Array, first: Any, second: Any, workers: int | None) -> tuple[int, Any]:
    n, result = located(points, first, workers=workers)
    return 2 * n, same(located(points, second, workers=workers)[1], result, "faces or vertices")


@drawn_by("contains", 12)
def all_solids(draw: Draw) -> Iterator[Question]:
    for shape in solids.each(draw, solids.LOCATED, NEAR_PLACES):
        yield partial(contained, points_about(draw, shape.targets, 550), shape.solid)


def _scene(draw: Draw, dimension: int, n: int, place: Place, n_kinds: int, n_points: int) -> Question:
    """Return the question about n bodies of some shapes, posed or not, spread over a cube."""
    kinds = [draw.pick(solids.LOCATED[dimension])(draw, dimension, place) for _ in range(n_kinds)]
    chosen = [kinds[i] for i in draw.whole(0, n_kinds - 1, n)]
    spread = 8.0 * n**0.25 * place[0]
    poses: list[Any] = [None] * n
    targets = [shape.targets for shape in chosen[:1]]
    for body, shape in enumerate(chosen):
        if draw.chance(0.7):
            turn = draw.rotation(dimension) if draw.chance(0.5) else np.eye(dimension)
            move = draw.whole(-4, 4, dimension) / 4.0 * spread
            poses[body] = engine.Pose(turn, move)
            targets.append(shape.targets + move)
        else:
            targets.append(shape.targets)
    points = points_about(draw, np.concatenate(targets), n_points)
    return partial(scene_located, points, [shape.solid for shape in chosen], poses if draw.chance(0.8) else None)


family("locate_scene", "few_bodies", 16, lambda draw: (
    _scene(draw, dimension, n, draw.pick(NEAR_PLACES), n, draw.pick([1, 40, 400])) for dimension in (2, 3)
    for n in (1, 3, 9)
))  # fmt: skip
family("locate_scene", "many_bodies", 8, lambda draw: (
    _scene(draw, dimension, draw.pick([60, 200, 700]), draw.pick(NEAR_PLACES), 9, 300) for dimension in (2, 3)
))  # fmt: skip
family("locate_scene", "scenes_far_away", 8, lambda draw: (
    _scene(draw, dimension, 4, draw.pick(FAR_PLACES), 4, 12) for dimension in (2, 3)
))  # fmt: skip


@drawn_by("locate_scene", 10)
def one_kind(draw: Draw) -> Iterator[Question]:
    """Bodies of one type on a grid, with enough points for voxels; large polygons, for which lists are better."""
    makers = [solids.aabb, solids.sphere, solids.polygon, solids.convex, solids.triangle]
    for dimension, maker in ((2, draw.pick(makers)), (3, draw.pick([solids.aabb, solids.sphere, solids.convex]))):
        bodies = [maker(draw, dimension) for _ in range(50)]
        poses = [engine.Pose(np.eye(dimension), draw.whole(-20, 20, dimension)) for _ in bodies]
        targets = np.concatenate([b.targets + pose.translation for b, pose in zip(bodies, poses)])
        yield partial(scene_located, points_about(draw, targets, 3000), [b.solid for b in bodies], poses)
    meshes = [solids.polyhedron_of(draw.pick([shapes.smooth, shapes.bumpy, shapes.soup])(draw)) for _ in range(2)]
    poses = [solids.pose(draw, 3) for _ in range(6)]
    points = points_about(draw, np.concatenate([mesh.targets for mesh in meshes]), 4000)
    yield partial(scene_located, points, [mesh.solid for mesh in meshes] * 3, poses)
    rings = [solids.polygon_of([shapes.coast(draw, n)]) for n in (100, 200, 300)]
    points = points_about(draw, np.concatenate([ring.targets for ring in rings]), 1500)
    yield partial(scene_located, points, [ring.solid for ring in rings], [None, *(solids.pose(draw, 2) for _ in "ab")])
