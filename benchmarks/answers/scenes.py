"""Questions to scenes that stay: segments through bodies of all types, and what moved."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

import engine
from benchmarks.answers import solids
from benchmarks.answers.asking import Question, family, same
from benchmarks.answers.clipping import _segments
from benchmarks.answers.draws import FAR_PLACES, NEAR_PLACES, Array, Draw, Place

NAMES = ("source", "body", "start", "end", "t", "faces", "ranks")


def clipped(scene: engine.Scene, segments: Array, workers: int | None) -> tuple[int, Any]:
    """Ask for all pieces, the first, and any; the last two follow from the first."""
    every: Any = scene.clip_segments(segments, workers=workers)
    first: Any = scene.clip_segments(segments, keep="first", workers=workers)
    met: Any = scene.clip_segments(segments, keep="any", workers=workers)
    rows = np.unique(every.source, return_index=True)[1]
    for name in NAMES[:-1]:
        same(getattr(first, name), getattr(every, name)[rows], "the first piece")
    same(np.flatnonzero(met), every.source[rows], "any piece")
    return 3 * len(segments), [getattr(every, name) for name in NAMES]


def moved(scene: engine.Scene, steps: dict[int, Any], segments: Array, workers: int | None) -> tuple[int, Any]:
    """Ask a scene of which bodies moved, which answers as one that is made so."""
    after = scene.moved(steps)
    n, answer = clipped(after, segments, workers)
    anew: Any = engine.Scene(list(after.solids), list(after.poses)).clip_segments(segments, workers=workers)
    for name, column in zip(NAMES, answer):
        same(column, getattr(anew, name), "a scene made anew")
    return n + len(segments), answer


def _has_polynomial(solid: Any) -> bool:
    return solid.type == "implicit" or any(map(_has_polynomial, getattr(solid, "operands", ())))


def _scenes(draw: Draw, places: tuple[Place, ...], n: int) -> Iterator[Question]:
    for dimension, makers in solids.LOCATED.items():
        place = draw.pick(places)
        some = [draw.pick(makers + (solids.surface,) * (dimension == 3))(draw, dimension, place) for _ in range(6)]
        some = [shape for shape in some if not _has_polynomial(shape.solid)] or [solids.aabb(draw, dimension, place)]
        bodies = [draw.pick(some) for _ in range(2 * len(some))]
        poses = [solids.pose(draw, dimension, place) if draw.chance(0.5) else None for _ in bodies]
        scene = engine.Scene([body.solid for body in bodies], poses)
        segments = _segments(draw, np.concatenate([shape.targets for shape in some]), n)
        yield partial(clipped, scene, segments)
        steps = {draw.one(0, len(bodies) - 1): solids.pose(draw, dimension, place) for _ in range(2)}
        yield partial(moved, scene, steps, segments[: n // 2])


family("scenes", "segments_through_scenes", 20, lambda draw: _scenes(draw, NEAR_PLACES, 40))
family("scenes", "segments_through_scenes_far_away", 6, lambda draw: _scenes(draw, FAR_PLACES, 20))
