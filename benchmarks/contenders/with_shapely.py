"""Shapely (GEOS): prepared points, `STRtree.query` for a scene, `clip_by_rect`, `intersection`. No threads of its own.

It lets go of the interpreter lock, so points are split over as many threads as we have: what a careful user would do.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import shapely

import engine
from benchmarks.contenders import Couple, NotApplicable, Prepared, each_alone, in_threads, overlays, without_poses
from benchmarks.workloads import Bodies, Rings

PACKAGE = "shapely"
NAMES = {
    "": "shapely (GEOS)", "kept polygons": "shapely clip_by_rect", "points": "shapely, prepared",
    "polygon areas": "shapely clip_by_rect", "scene": "shapely STRtree", "segments": "shapely clip_by_rect",
}  # fmt: skip


def _made(rings: list[np.ndarray]) -> shapely.Polygon:
    return shapely.Polygon(rings[0], rings[1:])


def even_odd(rings: list[np.ndarray]) -> Any:
    """Return the rings as one geometry under even-odd: as given where that is valid, else repaired ring by ring."""
    polygons = [shapely.Polygon(ring) for ring in rings]
    for made in (_made(rings), shapely.MultiPolygon(polygons)):
        if made.is_valid:
            return made
    return shapely.symmetric_difference_all([shapely.make_valid(polygon) for polygon in polygons])


def _read(path: str) -> tuple[list[Any]]:
    read = shapely.from_wkt if path.endswith(".wkt") else shapely.from_geojson
    made = read(Path(path).read_text("utf-8"))
    return ([list(ring.coords)[:-1] for ring in (made.exterior, *made.interiors)],)


READERS = dict.fromkeys((".geojson", ".wkt"), _read)


def _points(subject: Rings, threads: int) -> Prepared:
    polygon = _made(subject.rings)  # not repaired: as its users call it
    shapely.prepare(polygon)
    shapely.contains_xy(polygon, *np.mean(subject.rings[0][:64], axis=0).repeat(4).reshape(2, 4))
    # the index is made lazily, at the second question or so: by two threads at once, the process may crash

    def ask(points: np.ndarray) -> np.ndarray:
        def part_of(part: slice) -> np.ndarray:
            return shapely.intersects_xy(polygon, points[part, 0], points[part, 1])

        return np.concatenate(in_threads(part_of, len(points), threads))

    return Prepared(ask)


def _scene(bodies: Bodies, threads: int) -> Prepared:
    tree = shapely.STRtree([_made(body.rings) for body in bodies.bodies])
    tree.query(shapely.Point(0, 0))

    def ask(points: np.ndarray) -> list[np.ndarray]:
        def part_of(part: slice) -> np.ndarray:
            result = tree.query(points[part], predicate="intersects")
            result[0] += part.start
            return result

        return in_threads(part_of, len(points), threads)

    def answer(result: list[np.ndarray]) -> np.ndarray:
        owners, indices = np.concatenate(result, axis=1)
        return np.sort(owners * len(bodies.bodies) + indices)

    return Prepared(ask, shapely.points, answer)


def _bounds(region: engine.Solid) -> tuple[float, ...]:
    if not isinstance(region, engine.Aabb):
        raise NotApplicable("boxes only")
    return (*region.min.tolist(), *region.max.tolist())


def _by_rectangle(native: Any, answer: Any) -> Callable[[engine.Solid, int], Prepared]:
    """Return the maker of `clip_by_rect`, which takes and answers so."""

    def make(region: engine.Solid, threads: int) -> Prepared:
        bounds = _bounds(region)
        return Prepared(lambda shapes: shapely.clip_by_rect(shapes, *bounds), native, answer)

    return make


def _rows_of(clipped: np.ndarray) -> np.ndarray:
    rows = np.full((len(clipped), 4), np.nan)
    lines = np.flatnonzero(shapely.get_num_coordinates(clipped) == 2)
    rows[lines] = shapely.get_coordinates(clipped[lines]).reshape(-1, 4)
    return rows


def _pieces_of(result: Any) -> list[Any]:
    lines, owners = shapely.get_parts(result, return_index=True)
    kept = (shapely.get_type_id(lines) == shapely.GeometryType.LINESTRING) & ~shapely.is_empty(lines)
    return [(int(i), line.coords[0], line.coords[-1]) for line, i in zip(lines[kept], owners[kept], strict=True)]


def _pieces(region: Rings | engine.Solid, threads: int) -> Prepared:
    shape = even_odd(region.rings) if isinstance(region, Rings) else shapely.box(*_bounds(region))
    return Prepared(lambda lines: shapely.intersection(lines, shape), shapely.linestrings, _pieces_of)


def _lines(region: engine.Polygon, threads: int) -> Prepared:
    shape = shapely.polygons(region.vertices)
    shapely.prepare(shape)
    return Prepared(lambda lines: shapely.intersection(lines, shape), shapely.linestrings)


def _relations(layers: Any, threads: int) -> Prepared:
    """By the matrices of `relate`; told as ours outside the clock."""
    left, right = map(shapely.polygons, layers)

    def answer(matrices: np.ndarray) -> np.ndarray:
        marks = np.array([list(matrix) for matrix in matrices]) != "F"
        overlap, names = marks[:, 0], engine.Relation
        is_first, is_second = ~marks[:, [1, 2, 4]].any(axis=1), ~marks[:, [3, 6, 4]].any(axis=1)
        kinds = [overlap & is_first, overlap & is_second, overlap, marks[:, [0, 1, 3, 4]].any(axis=1)]
        said = [names.FIRST_INSIDE_SECOND, names.SECOND_INSIDE_FIRST, names.OVERLAPPING, names.TOUCHING]
        return np.select(kinds, said, names.DISJOINT)

    return Prepared(lambda pairs: shapely.relate(left[pairs[:, 0]], right[pairs[:, 1]]), answer=answer)


def _outline_distances(region: Rings, threads: int) -> Prepared:
    outline = even_odd(region.rings).boundary
    return Prepared(lambda points: shapely.distance(points, outline), shapely.points)


def _polygon_areas(region: engine.Aabb, threads: int) -> Prepared:
    """Of single rings; of polygons of several."""
    bounds = _bounds(region)

    def ask(rings: Any) -> np.ndarray:
        try:
            shapes = [even_odd(each) for each in rings] if isinstance(rings, list) else shapely.polygons(rings)
            return shapely.area(shapely.clip_by_rect(shapes, *bounds))
        except shapely.GEOSException:  # one polygon it cannot clip ends the whole call
            return np.full(1, np.nan) if len(rings) == 1 else np.hstack([ask(ring[None]) for ring in rings])

    return Prepared(ask)


def _pair(pair: Couple, threads: int) -> Prepared:
    first, second = (body.shape for body in without_poses(pair))
    if not isinstance(first, Rings) or not isinstance(second, Rings | engine.Sphere):
        raise NotApplicable("polygons, and a polygon with a disc")
    if isinstance(second, engine.Sphere):
        shape = even_odd(first.rings)
        return Prepared(lambda _: shape.distance(shapely.Point(second.center)) <= second.radius)
    shapes = [_made(shape.rings) for shape in (first, second)]  # not repaired: as given
    return Prepared(lambda _: shapely.intersects(*shapes))


def _small_pairs(operation: str, threads: int) -> Prepared:
    """Simple polygons, vectorised."""

    def native(pairs: list[Any]) -> list[np.ndarray]:
        return [shapely.polygons(np.array([pair[side][0] for pair in pairs])) for side in range(2)]

    return Prepared(lambda shapes: getattr(shapely, operation)(*shapes), native, shapely.area)


def _gridded(pair: Any, grid: float = 0.0) -> Any:
    return [shapely.set_precision(even_odd(rings), grid) if grid else even_odd(rings) for rings in pair], grid or None


MAKERS = {
    "points": _points,
    "point distances": _outline_distances,
    "relations of polygons": _relations,
    "scene": _scene,
    "segments": _by_rectangle(shapely.linestrings, _rows_of),
    "pieces": _pieces,
    "lines": _lines,
    "pieces by rectangle": _by_rectangle(shapely.linestrings, _pieces_of),
    "kept polygons": _by_rectangle(shapely.polygons, lambda result: ~shapely.is_empty(result)),
    "polygon areas": _polygon_areas,
    "pair": _pair,
    "clearance pairs": lambda _, threads: each_alone(
        lambda pair: [_made(body.shape.rings) for body in pair], lambda pair: float(shapely.distance(*pair))
    ),
    "small pairs": _small_pairs,
    **overlays(
        _gridded,
        lambda made, operation: getattr(shapely, operation)(*made[0], grid_size=made[1]),
        lambda made, result: result.area,
    ),
}
