"""The textbook's clipping in plain float64 (engine/textbook/clip_batches.py), compiled like ours."""

from __future__ import annotations

from typing import Any

import numpy as np

import engine
from benchmarks.contenders import Prepared, in_threads
from engine.solids.box_planes import box_rows
from engine.textbook import clip_batches

NAME, PACKAGE = "naive", None


def _segments(subject: Any, threads: int) -> Prepared:
    match subject:
        case engine.Aabb():
            kernel = clip_batches.clip_on_box_2d if subject.dimension == 2 else clip_batches.clip_on_box_3d
            region: tuple[Any, ...] = (subject.min, subject.max)
        case engine.Convex():
            kernel, region = clip_batches.clip_on_planes_3d, (subject.planes,)
        case _:
            kernel, region = clip_batches.clip_on_sphere_3d, (subject.center, subject.radius)

    def ask(segments: np.ndarray) -> list[Any]:
        return in_threads(lambda part: kernel(segments[part], *region), len(segments), threads)

    return Prepared(lambda segments: segments, ask, lambda found: np.concatenate([part[1] for part in found]) == 1)


def _polygons(subject: engine.Aabb, threads: int) -> Prepared:
    rows = box_rows(subject)

    def native(polygons: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        n, size, dimension = polygons.shape
        return polygons.reshape(-1, dimension), size * np.arange(n + 1)

    def ask(rings: tuple[np.ndarray, np.ndarray]) -> Any:
        return clip_batches.clip_rings_on_planes(*rings, rows)

    return Prepared(native, ask, lambda found: np.diff(found[1]) > 0)


MAKERS = {"segments": _segments, "polygons": _polygons}
