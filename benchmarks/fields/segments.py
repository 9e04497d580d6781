"""Segments on boxes, convex solids and spheres: kept or not, and the coordinates of what is kept."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

import engine
from benchmarks import workloads
from benchmarks.contest import Contest, contender
from benchmarks.errors import coordinates, same
from benchmarks.fields import Size, Task
from benchmarks.workloads import generator, simple_solids

LOW, HIGH = -1.0, 1.0


def contests(seed: int, scale: float) -> Iterator[Contest]:
    """Yield the contests of segment clipping."""
    source = generator("report segments", seed)
    n_hard = int(4_000 * scale)
    for dimension in (2, 3):
        easy = source.uniform(-2, 2, (int(200_000 * scale), 2, dimension))
        for is_hard, segments in ((False, easy), (True, through_corners(source, n_hard, dimension))):
            yield _on_box(segments, dimension, is_hard, int(1000 * min(1, 4 * scale)))
    yield _on_planes(source, n_hard, int(500 * min(1, 4 * scale)))
    yield _on_sphere(source, n_hard, int(500 * min(1, 4 * scale)))


def through_corners(source: np.random.Generator, n_segments: int, dimension: int) -> np.ndarray:
    """Return segments through a corner or an edge of the box, as near as doubles come, moved by up to 2 ulps."""
    target = source.choice([LOW, HIGH], (n_segments, dimension))
    if dimension == 3:
        free = source.uniform(size=n_segments) < 0.5
        target[free, 2] = source.uniform(LOW, HIGH, free.sum())
    start = target * source.uniform(1, 2, (n_segments, dimension)) * source.choice([1, -1], (n_segments, dimension))
    segments = np.stack([start, target + (target - start) * source.uniform(0.3, 2, (n_segments, 1))], axis=1)
    return segments + source.integers(-2, 3, segments.shape) * np.spacing(np.abs(segments))


def exact_ends(segments: np.ndarray, region: dict) -> np.ndarray:
    """Return (n, 2 * dim) nearest doubles of the first piece's ends, NaN where nothing remains."""
    from tests.reference.segments import clip_segment

    rows = np.full((len(segments), segments[0].size), np.nan)
    for row, segment in zip(rows, segments.tolist(), strict=True):
        if pieces := clip_segment(segment, region):
            start, end, _ = pieces[0].rounded()
            row[:] = (*start, *end)
    return rows


def _contest(
    name: str, is_hard: bool, segments: np.ndarray, n_exact: int, region: dict, rest: list, about: str
) -> Contest:
    solid = {"aabb": engine.Aabb, "convex": engine.Convex, "sphere": engine.Sphere}[region["type"]]
    made = solid(**{name: value for name, value in region.items() if name != "type"})
    contenders = [contender(shown, *how, made, 1) for shown, *how in [("ours", "ours", "segments"), *rest]]
    exact = exact_ends(segments[:n_exact], region)
    return Contest("clipping segments", name, is_hard, segments, exact, coordinates, contenders, about)


def _on_box(segments: np.ndarray, dimension: int, is_hard: bool, n_exact: int) -> Contest:
    rest = [("textbook: Cohen-Sutherland", "textbook", "segments")]
    if dimension == 2:
        rest.append(("shapely clip_by_rect", "shapely", "segments"))
        rest.append(("numba_celltree", "celltree", "segments one by one"))
    region = {"type": "aabb", "min": [LOW] * dimension, "max": [HIGH] * dimension}
    name = f"box {dimension}D, {'corners' if is_hard else 'random'}"
    about = "through corners and edges of the box, give or take 2 ulps" if is_hard else "random in twice the box"
    return _contest(name, is_hard, segments, n_exact, region, rest, about)


def _on_planes(source: np.random.Generator, n_segments: int, n_exact: int) -> Contest:
    normals = source.normal(size=(20, 3))
    planes = np.hstack([normals, np.linalg.norm(normals, axis=1, keepdims=True)])
    # through the edge of two neighbouring planes: solve both and a random third
    segments = np.empty((n_segments, 2, 3))
    for segment in segments:
        first, second = source.choice(20, 2, replace=False)
        rows = np.stack([normals[first], normals[second], source.normal(size=3)])
        at = np.linalg.solve(rows, -np.array([planes[first, 3], planes[second, 3], source.normal()]))
        direction = source.normal(size=3)
        segment[:] = at - direction, at + direction
    region = {"type": "convex", "planes": planes.tolist()}
    rest = [("textbook: Cohen-Sutherland by planes", "textbook", "segments")]
    about = "through the common line of two of 20 planes"
    return _contest("20 planes, edges", True, segments, n_exact, region, rest, about)


def _on_sphere(source: np.random.Generator, n_segments: int, n_exact: int) -> Contest:
    touch = source.normal(size=(n_segments, 3))
    touch /= np.linalg.norm(touch, axis=1, keepdims=True)
    along = np.cross(touch, source.normal(size=(n_segments, 3)))
    segments = np.stack([touch - along, touch + along * source.uniform(0.5, 2, (n_segments, 1))], axis=1)
    rest = [("textbook: quadratic", "textbook", "segments")]
    region = {"type": "sphere", "center": [0.0] * 3, "radius": 1.0}
    return _contest("sphere, tangents", True, segments, n_exact, region, rest, "tangents, as near as doubles come")


# --- the table --------------------------------------------------------------------------------------------------------

NAIVE = {"random": (0.65, 1.0), "corner": (0.3, 0.6), "edge": (0.3, 0.6), "ulp": (0.3, 0.6)}
Peers = dict[str, tuple[float, float]]
KINDS = {"textbook": "naive segments"}


def table(size: Size) -> Iterator[Task]:
    """Yield the rows of the table; one thread, unless a row says otherwise."""
    solids = simple_solids()
    square, cube = solids["aabb 2D"], solids["aabb 3D"]
    planes = engine.Convex(workloads.convex_planes(20, size.seed).rows)
    peers: Peers = {"celltree": (0.7, 1.0), "shapely": (10.0, 20.0)}
    yield "aabb 2D, random", partial(_row, size, "aabb 2D, random", square, "random", peers)
    for kind, goals in NAIVE.items():
        yield f"aabb 3D, {kind}", partial(_row, size, f"aabb 3D, {kind}", cube, kind, {"textbook": goals})
    for kind in ("corner", "edge", "ulp"):
        yield f"aabb 2D, {kind}", partial(_row, size, f"aabb 2D, {kind}", square, kind, {})
    of_planes, of_sphere = {"textbook": (0.37, 0.7)}, {"textbook": (0.1, 0.3)}
    yield "20 planes", partial(_row, size, "20 planes", planes, "random", of_planes)
    yield "sphere 3D", partial(_row, size, "sphere 3D", solids["sphere 3D"], "random", of_sphere)
    for name in ("sphere 2D", "half-space 2D", "half-space 3D", "convex 2D"):
        yield name, partial(_row, size, name, solids[name], "random", {})
    for n_vertices in (10, 1_000):
        polygon = engine.Polygon(workloads.star_polygon(n_vertices, size.seed).rings)
        for kind in ("random", "ulp"):
            name = f"polygon of {n_vertices:,}, {kind}"
            yield name, partial(_row, size, name, polygon, kind, {}, 20)
    for region, name in ((cube, "aabb 3D, two threads"), (planes, "20 planes, two threads")):
        yield name, partial(_two_threads, size, name, region)
    for faces in ("1k", "86k")[: size.of(2, 1)]:
        yield f"{faces} faces", partial(_mesh, size, faces, False)
    yield "first 100, 1k faces", partial(_mesh, size, "1k", True)


def as_json(region: engine.Solid) -> dict[str, Any] | None:
    """Return a region as the reference reads it."""
    match region:
        case engine.Aabb():
            return {"type": "aabb", "min": region.min.tolist(), "max": region.max.tolist()}
        case engine.Convex():
            return {"type": "convex", "planes": region.planes.tolist()}
        case engine.Sphere():
            return {"type": "sphere", "center": region.center.tolist(), "radius": region.radius}
    return None


def _row(size: Size, name: str, region: engine.Solid, kind: str, peers: Peers, share: int = 1) -> Contest:
    segments = workloads.segments_of(kind, region.dimension, size.of(1_000_000, 50_000) // share, size.seed)
    contenders = [contender("ours", "ours", "segments", region, 1)]
    for module, goals in peers.items():
        shown = {"textbook": "naive", "shapely": "shapely clip_by_rect", "celltree": "numba_celltree"}[module]
        contenders.append(contender(shown, module, KINDS.get(module, "segments"), region, 1, goals))
    told = as_json(region)
    exact = None if told is None or not peers else lambda rows: exact_ends(segments[rows], told)
    return Contest("segments", name, kind != "random", segments, exact, coordinates, contenders, n_sample=100)


def _two_threads(size: Size, name: str, region: engine.Solid) -> Contest:
    segments = workloads.segments_of("random", region.dimension, size.of(1_000_000, 50_000), size.seed)
    one = contender("ours, one thread", "ours", "segments", region, 1, (1.7, 1.9))
    two = contender("ours", "ours", "segments", region, 2)
    return Contest("segments", name, False, segments, None, coordinates, [two, one])


def _mesh(size: Size, faces: str, is_new: bool) -> Contest:
    """Segments between two random points of the mesh's box, of about its size: do they meet a face?"""
    mesh = workloads.mesh_of_size(faces, size.seed)
    n_segments = 100 if is_new else size.of(100_000, 5_000)
    segments = np.ascontiguousarray(workloads.uniform_points(mesh, 2 * n_segments, size.seed).reshape(-1, 2, 3))
    contenders = [
        contender("ours", "ours", "hits", mesh, 1, is_new=is_new),
        contender("trimesh + embreex", "trimesh", "hits", mesh, 1, (3.0, 10.0), is_new=is_new),
    ]
    name = f"first 100, {faces} faces" if is_new else f"{faces} faces"
    return Contest("segments", name, False, segments, None, same, contenders, count=n_segments)
