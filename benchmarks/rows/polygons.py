"""Polygons on every convex region: rings of 3 to 100 vertices, random and with vertices on the planes."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

import engine
from benchmarks import workloads
from benchmarks.rows import Question, Run, Size, asked_before
from benchmarks.rows.containment import simple_solids

REGIONS = ("half-space 2D", "half-space 3D", "convex 2D")


def questions(size: Size) -> Iterator[Question]:
    """Yield the rows of polygon clipping."""
    solids = simple_solids()
    for dimension in (2, 3):
        for n_vertices in (3, 4, 10, 30, 100):
            name = f"polygons of {n_vertices}, aabb {dimension}D"
            yield Question(name, partial(_ask, size, solids[f"aabb {dimension}D"], n_vertices, False))
        name = f"polygons of 10, aabb {dimension}D, on the planes"
        yield Question(name, partial(_ask, size, solids[f"aabb {dimension}D"], 10, True))
    yield Question("polygons of 10, aabb 2D, two threads", partial(_ask, size, solids["aabb 2D"], 10, False, 2))
    for name in REGIONS:
        yield Question(f"polygons of 10, {name}", partial(_ask, size, solids[name], 10, False))
    planes = engine.Convex(workloads.convex_planes(20, size.seed).rows)
    yield Question("polygons of 10, convex of 20", partial(_ask, size, planes, 10, False))
    yield Question("polygons with a hole, aabb 2D", partial(_with_holes, size))


def _ask(size: Size, region: engine.Solid, n_vertices: int, is_on_planes: bool, threads: int = 1) -> Run:
    rings = workloads.star_rings(n_vertices, region.dimension, size.of(100_000, 10_000) // n_vertices, size.seed)
    if is_on_planes:
        rings = np.round(rings * 2.0) / 2.0
    return asked_before(lambda: engine.clip_polygons(rings, region, workers=threads), 2)


def _with_holes(size: Size) -> Run:
    outer = workloads.star_rings(12, 2, size.of(2_000, 200), size.seed)
    middles = outer.mean(axis=1, keepdims=True)
    polygons = [engine.Polygon([ring, middle + 0.3 * (ring - middle)]) for ring, middle in zip(outer, middles)]
    region = simple_solids()["aabb 2D"]
    return asked_before(lambda: engine.clip_polygons(polygons, region, workers=1), 2)
