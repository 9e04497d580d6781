"""Segments on boxes, convex solids and spheres: kept or not, and the coordinates of what is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

import engine
from benchmarks.contest import Ask, Contender, Contest, coordinates
from benchmarks.workloads import generator
from engine.textbook import cohen_sutherland, convex_cohen_sutherland, segment_sphere

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


def ours_on(region: engine.Solid, share: list[float]) -> Callable[[], Ask]:
    """Return the maker of ours."""

    def ask(segments: np.ndarray) -> np.ndarray:
        pieces, accuracy = engine.clip_segments(segments, region, report=True)
        share.append(accuracy.n_beyond_filter / max(1, accuracy.n_items))
        rows = np.full((len(segments), segments[0].size), np.nan)
        rows[pieces.source] = np.hstack([pieces.start, pieces.end])
        return rows

    return lambda: ask


def rows_of(found: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return clipped segments as rows, NaN where not kept."""
    return np.where(kept[:, None], found.reshape(len(found), -1), np.nan)


def _contest(
    name: str, is_hard: bool, segments: np.ndarray, n_exact: int, region: dict, share: list, rest: list, about: str
) -> Contest:
    solid = {"aabb": engine.Aabb, "convex": engine.Convex, "sphere": engine.Sphere}[region["type"]]
    made = solid(**{name: value for name, value in region.items() if name != "type"})
    contenders = [Contender("ours", ours_on(made, share), exact_share=lambda: share[-1]), *rest]
    exact = exact_ends(segments[:n_exact], region)
    return Contest("clipping segments", name, is_hard, segments, exact, coordinates, contenders, about)


def _on_box(segments: np.ndarray, dimension: int, is_hard: bool, n_exact: int) -> Contest:
    low, high = np.full(dimension, LOW), np.full(dimension, HIGH)

    def textbook(asked: np.ndarray) -> np.ndarray:
        found, kept = cohen_sutherland.clip(asked, low, high)
        return rows_of(found, kept == 1)

    rest = [Contender("textbook: Cohen-Sutherland", lambda: textbook)]
    if dimension == 2:
        rest += [
            Contender("shapely clip_by_rect", _shapely, "shapely"),
            Contender("numba_celltree", _celltree, "numba-celltree"),
        ]
    region = {"type": "aabb", "min": low.tolist(), "max": high.tolist()}
    name = f"box {dimension}D, {'corners' if is_hard else 'random'}"
    about = "through corners and edges of the box, give or take 2 ulps" if is_hard else "random in twice the box"
    return _contest(name, is_hard, segments, n_exact, region, [], rest, about)


def _shapely() -> Ask:
    import shapely

    def ask(segments: np.ndarray) -> np.ndarray:
        clipped = shapely.clip_by_rect(shapely.linestrings(segments), LOW, LOW, HIGH, HIGH)
        rows = np.full((len(segments), 4), np.nan)
        lines = np.flatnonzero(shapely.get_num_coordinates(clipped) == 2)
        rows[lines] = shapely.get_coordinates(clipped[lines]).reshape(-1, 4)
        return rows

    return ask


def _celltree() -> Ask:
    from numba_celltree.algorithms.cohen_sutherland import cohen_sutherland_line_box_clip
    from numba_celltree.constants import Box, Point

    box = Box(LOW, HIGH, LOW, HIGH)

    def ask(segments: np.ndarray) -> np.ndarray:
        rows = np.full((len(segments), 4), np.nan)
        for row, (a, b) in zip(rows, segments.tolist(), strict=True):
            kept, start, end = cohen_sutherland_line_box_clip(Point(*a), Point(*b), box)
            if kept:
                row[:] = (*start, *end)
        return rows

    return ask


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

    def textbook(asked: np.ndarray) -> np.ndarray:
        found, kept = convex_cohen_sutherland.clip(asked, planes)
        return rows_of(found, kept == 1)

    rest = [Contender("textbook: Cohen-Sutherland by planes", lambda: textbook)]
    about = "through the common line of two of 20 planes"
    return _contest("20 planes, edges", True, segments, n_exact, region, [], rest, about)


def _on_sphere(source: np.random.Generator, n_segments: int, n_exact: int) -> Contest:
    touch = source.normal(size=(n_segments, 3))
    touch /= np.linalg.norm(touch, axis=1, keepdims=True)
    along = np.cross(touch, source.normal(size=(n_segments, 3)))
    segments = np.stack([touch - along, touch + along * source.uniform(0.5, 2, (n_segments, 1))], axis=1)
    center = np.zeros(3)

    def textbook(asked: np.ndarray) -> np.ndarray:
        return rows_of(*segment_sphere.clip(asked, center, 1.0))

    rest = [Contender("textbook: quadratic", lambda: textbook)]
    region = {"type": "sphere", "center": center.tolist(), "radius": 1.0}
    return _contest("sphere, tangents", True, segments, n_exact, region, [], rest, "tangents, as near as doubles come")
