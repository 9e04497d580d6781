"""Questions to clip_segments and clip_polygons, and to scenes that stay: segments through bodies of all types, and what
moved."""

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

ROUNDED = "decisions coordinates_ulp"
segments_clipped = asker(engine.clip_segments, "source start end t faces", ROUNDED)
lines_hit, rays_hit = (
    asker(ask, "source t t_end face triangle kind barycentric normal", ROUNDED)
    for ask in (engine.hits, partial(engine.hits, rays=True))
)
lines_clipped = asker(engine.clip_lines, "source vertices offsets segments t faces", ROUNDED)
polygons_clipped = asker(
    engine.clip_polygons, "vertices ring_offsets polygon_offsets contours status may_have_bridges", ROUNDED
)


def _segments(draw: Draw, targets: Array, n: int) -> Array:
    """Return segments between points about the targets, through targets, along axes, and some without length."""
    a, b = points_about(draw, targets, n), points_about(draw, targets, n)
    on = targets[draw.whole(0, len(targets) - 1, n)]
    direction = np.where(draw.unit(n, 1) < 0.5, draw.whole(-2, 2, *on.shape), draw.uniform(-1.0, 1.0, *on.shape))
    reach = direction * (np.abs(on).max() * 0.5)
    through = [on - reach * draw.pick([0.0, 0.5, 1.0]), on + reach]
    ways = np.stack(
        [[a, b], [a, b], through, draw.nudged(np.stack(through)), [a, np.where(draw.unit(*a.shape) < 0.5, a, b)]]
    )
    return ways[draw.whole(0, len(ways) - 1, n), :, np.arange(n)]


def _on_regions(draw: Draw, places: tuple[Place, ...], n: int) -> Iterator[Question]:
    for shape in solids.each(draw, solids.REGIONS, places):
        some = n // 4 if shape.solid.type in ("polygon", "polyhedron") else n
        yield partial(segments_clipped, _segments(draw, shape.targets, some), shape.solid)


family("clip_segments", "on_all_regions", 20, lambda draw: _on_regions(draw, NEAR_PLACES, 600))
family("clip_segments", "on_regions_far_away", 10, lambda draw: _on_regions(draw, FAR_PLACES, 24))


@drawn_by("clip_segments", 6)
def batches(draw: Draw) -> Iterator[Question]:
    """Long batches of easy segments, on convex regions and on boundaries for which the first batch builds cells."""
    for maker in (solids.aabb, solids.convex, solids.sphere):
        shape = maker(draw, draw.pick([2, 3]))
        yield partial(segments_clipped, draw.uniform(-6.0, 6.0, 5000, 2, shape.solid.dimension), shape.solid)
    mesh = solids.polyhedron_of(draw.pick([shapes.bumpy, lambda draw: shapes.ball(draw, 4, 0.1)])(draw))
    yield partial(segments_clipped, draw.uniform(-3.0, 3.0, 18_000, 2, 3), mesh.solid)
    yield partial(segments_clipped, _segments(draw, mesh.targets, 20), mesh.solid)
    rings = solids.polygon_of(draw.pick([shapes.large_coast(draw), shapes.squares(draw, 15, 0.5)]))
    yield partial(segments_clipped, draw.uniform(-4.0, 4.0, 5000, 2, 2), rings.solid)
    yield partial(segments_clipped, _segments(draw, rings.targets, 20), rings.solid)


@drawn_by("hits", 6)
def lines_on_meshes(draw: Draw) -> Iterator[Question]:
    """Segments and rays through corners, along edges and in faces of meshes, open and closed, near and far."""
    for place in (draw.pick(NEAR_PLACES), draw.pick(NEAR_PLACES), draw.pick(FAR_PLACES)):
        for shape in (solids.polyhedron(draw, 3, place), solids.surface(draw, 3, place)):
            lines = _segments(draw, shape.targets, 40)
            yield partial(lines_hit, lines, shape.solid)
            yield partial(rays_hit, lines - [[[0.0], [1.0]]] * lines[:, :1], shape.solid)


@drawn_by("clip_lines", 6)
def lines_on_all_regions(draw: Draw) -> Iterator[Question]:
    """Walks over the ends of such segments: some closed, some with repeats."""
    for shape in solids.each(draw, solids.REGIONS, NEAR_PLACES):
        ends = _segments(draw, shape.targets, 120).reshape(40, 6, -1)
        closed = np.concatenate([ends[:20], ends[:20, :1]], axis=1)
        yield partial(lines_clipped, [*closed, *np.repeat(ends[20:30], 2, axis=1), *ends[30:]], shape.solid)


def _cutters(draw: Draw, dimension: int, place: Place) -> Shape:
    makers = [solids.half_space, solids.aabb, solids.convex, solids.aabb]
    if dimension == 3 and draw.chance(0.3):
        makers = [shapes.box, shapes.tetrahedron, lambda draw: shapes.ball(draw, draw.one(0, 1))]
        return solids.polyhedron_of(draw.pick(makers)(draw), place)
    return draw.pick(makers)(draw, dimension, place)


def _contours(draw: Draw, shape: Shape, n: int) -> list[list[Array]]:
    """Return polygons of one to three rings, in space neither plane nor simple as a rule."""
    sizes = [[draw.one(1, 9) for _ in range(draw.one(1, 3))] for _ in range(n)]
    return [[points_about(draw, shape.targets, size) for size in row] for row in sizes]


def _contours_about(draw: Draw, places: tuple[Place, ...], n_regions: int, n: int) -> Iterator[Question]:
    for dimension in (2, 3):
        for _ in range(n_regions):
            shape = _cutters(draw, dimension, draw.pick(places))
            yield partial(polygons_clipped, _contours(draw, shape, n), shape.solid)


family("clip_polygons", "contours_about_regions", 20, lambda draw: _contours_about(draw, NEAR_PLACES, 4, 14))
family("clip_polygons", "contours_far_away", 8, lambda draw: _contours_about(draw, FAR_PLACES, 1, 12))


@drawn_by("clip_polygons", 12)
def flat_polygons(draw: Draw) -> Iterator[Question]:
    """Arrays of triangles and quads, mostly plane; polygons as solids."""
    for dimension in (2, 3):
        size = draw.pick([3, 4])
        flat = draw.uniform(-4.0, 4.0, 3000, 1, dimension) + np.pad(shapes.SQUARE[:size], ((0, 0), (0, dimension - 2)))
        yield partial(polygons_clipped, flat, _cutters(draw, dimension, (1.0, 0.0)).solid)
    rings = [solids.polygon(draw).solid for _ in range(40)]
    yield partial(polygons_clipped, rings, _cutters(draw, 2, (1.0, 0.0)).solid)
    triangles = np.stack([draw.spots(3, 3) for _ in range(80)])
    yield partial(polygons_clipped, triangles, _cutters(draw, 3, (1.0, 0.0)).solid)


NAMES = ("source", "body", "start", "end", "t", "faces", "ranks")


def clipped(scene: engine.Scene, segments: Array, workers: int | None) -> tuple[int, Any]:
    """Clip with keep all, first and any; the last two must follow from the first."""
    every: Any = scene.clip_segments(segments, workers=workers)
    first: Any = scene.clip_segments(segments, keep="first", workers=workers)
    met: Any = scene.clip_segments(segments, keep="any", workers=workers)
    rows = np.unique(every.source, return_index=True)[1]
    for name in NAMES[:-1]:
        same(getattr(first, name), getattr(every, name)[rows], "the first piece")
    same(np.flatnonzero(met), every.source[rows], "any piece")
    return 3 * len(segments), [getattr(every, name) for name in NAMES]


def moved(scene: engine.Scene, steps: dict[int, Any], segments: Array, workers: int | None) -> tuple[int, Any]:
    """Query a scene some of whose bodies moved; it must answer like a new one."""
    after = scene.moved(steps)
    n, answer = clipped(after, segments, workers)
    rebuilt: Any = engine.Scene(list(after.solids), list(after.poses)).clip_segments(segments, workers=workers)
    for name, column in zip(NAMES, answer):
        same(column, getattr(rebuilt, name), "a scene made anew")
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
