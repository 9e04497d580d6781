"""Questions to distances and to scenes about the nearest body."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

import engine
from benchmarks.answers import shapes, solids
from benchmarks.answers.asking import Question, drawn_by, family
from benchmarks.answers.draws import FAR_PLACES, NEAR_PLACES, Array, Draw, Place
from benchmarks.answers.solids import Shape, points_about


def _asked(points: Array, solid: Any, workers: int | None, **options: Any) -> tuple[int, Any]:
    return len(points), _columns(engine.distances(points, solid, workers=workers, **options))


def _columns(answer: Any) -> list[Any]:
    if isinstance(answer, np.ndarray):
        return [answer]
    return list(answer.to_dict().values())


def _about(draw: Draw, shape: Shape, n: int) -> Iterator[Question]:
    points, solid = points_about(draw, shape.targets, n), shape.solid
    for options in ({}, {"to": "boundary"}, {"signed": True}, {"nearest": True}):
        yield partial(_asked, points, solid, **options)
    yield partial(_asked, points, solid, within=float(draw.pick([0.0, 0.25, 1.0, 5.0])))
    yield partial(_asked, points, solid, pose=solids.pose(draw, solid.dimension), nearest=True)


def _each(draw: Draw, places: tuple[Place, ...], n: int) -> Iterator[Question]:
    for shape in solids.each(draw, solids.LOCATED, places):
        yield from _about(draw, shape, n)
    yield from _about(draw, solids.surface(draw, 3, draw.pick(places)), n)


family("distances", "solids", 6, lambda draw: _each(draw, NEAR_PLACES, 16))
family("distances", "solids_far_away", 4, lambda draw: _each(draw, FAR_PLACES, 6))


@drawn_by("distances", 2)
def large_mesh(draw: Draw) -> Iterator[Question]:
    """A mesh and points so many that they are answered in the order of their cells."""
    shape = solids.polyhedron_of(shapes.ball(draw, 5, 0.05))
    near = shape.targets[draw.whole(0, len(shape.targets) - 1, 9_000)]
    yield partial(_asked, near * draw.uniform(0.9, 1.1, len(near), 1), shape.solid, signed=True)


@drawn_by("distances", 3)
def scenes(draw: Draw) -> Iterator[Question]:
    for dimension in (2, 3):
        bodies = [draw.pick(solids.LEAVES[dimension][:-1])(draw, dimension) for _ in range(12)]
        bodies = [body for body in bodies if engine.solid_types[body.solid.type].measure is not None]
        poses: list[Any] = [solids.pose(draw, dimension) if draw.chance(0.5) else None for _ in bodies]
        points = points_about(draw, np.concatenate([body.targets for body in bodies]), 60)
        yield partial(_in_scene, points, engine.Scene([body.solid for body in bodies], poses))


def _in_scene(points: Array, scene: engine.Scene, workers: int | None) -> tuple[int, Any]:
    return len(points), _columns(scene.distances(points, workers=workers))
