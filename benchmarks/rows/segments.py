"""Segments on every region, random and through corners; on one thread and on two."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

import engine
from benchmarks import workloads
from benchmarks.rows import Question, Run, Size, asked_before
from benchmarks.rows.containment import simple_solids

REGIONS = ("sphere 2D", "sphere 3D", "half-space 2D", "half-space 3D", "convex 2D")


def questions(size: Size) -> Iterator[Question]:
    """Yield the rows of segment clipping."""
    solids = simple_solids()
    for dimension in (2, 3):
        for kind in ("random", "corner", "edge", "ulp"):
            box = solids[f"aabb {dimension}D"]
            yield Question(f"segments, aabb {dimension}D, {kind}", partial(_ask, size, box, kind, 1))
    yield Question("segments, aabb 3D, random, two threads", partial(_ask, size, solids["aabb 3D"], "random", 2))
    planes = engine.Convex(workloads.convex_planes(20, size.seed).rows)
    yield Question("segments, convex of 20, random", partial(_ask, size, planes, "random", 1))
    yield Question("segments, convex of 20, random, two threads", partial(_ask, size, planes, "random", 2))
    for name in REGIONS:
        yield Question(f"segments, {name}, random", partial(_ask, size, solids[name], "random", 1))
    for n_vertices in (10, 1_000):
        polygon = engine.Polygon(workloads.star_polygon(n_vertices, size.seed).rings)
        for kind in ("random", "ulp"):
            yield Question(f"segments, polygon of {n_vertices}, {kind}", partial(_ask, size, polygon, kind, 1, 20))
    for faces in ("1k",) if size.is_quick else ("1k", "86k"):
        yield Question(f"segments, polyhedron of {faces}", partial(_mesh, size, faces))
    yield Question("segments, first 100, polyhedron of 1k", partial(_first, size))


def _ask(size: Size, region: engine.Solid, kind: str, threads: int, share: int = 1) -> Run:
    segments = workloads.segments_of(kind, region.dimension, size.of(500_000, 50_000) // share, size.seed)
    return asked_before(lambda: engine.clip_segments(segments, region, workers=threads), 2)


def _inside(size: Size, faces: str, n_segments: int) -> tuple[workloads.Mesh, np.ndarray]:
    mesh = workloads.mesh_of_size(faces, size.seed)
    ends = workloads.uniform_points(mesh, 2 * n_segments, size.seed)
    return mesh, np.ascontiguousarray(ends.reshape(-1, 2, 3))


def _mesh(size: Size, faces: str) -> Run:
    mesh, segments = _inside(size, faces, size.of(50_000, 5_000))
    solid = engine.Polyhedron(mesh.vertices, mesh.faces)
    return asked_before(lambda: engine.clip_segments(segments, solid, workers=1), 2)


def _first(size: Size) -> Run:
    mesh, segments = _inside(size, "1k", 100)
    return lambda: engine.clip_segments(segments, engine.Polyhedron(mesh.vertices, mesh.faces), workers=1)
