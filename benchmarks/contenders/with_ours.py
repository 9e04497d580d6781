"""The engine: float64 in, exact answers."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

import engine
from benchmarks.bodies import Crowd, Pair
from benchmarks.contenders import Couple, Placed, Prepared, each_alone, each_or_nan, t_by_segment
from benchmarks.workloads import Bodies, Mesh, Rings


def solid_of(subject: Any) -> Any:
    """Return a new solid."""
    match subject:
        case Mesh():
            return engine.Polyhedron(subject.vertices, subject.faces)
        case Rings():
            return engine.Polygon(subject.rings)
    return subject


class _Said:
    """What the last question said of itself."""

    report: Any = None

    def keep(self, result: Any) -> Any:
        answer, self.report = result
        return answer

    def beyond_filter(self) -> float:
        return self.report.n_beyond_filter / max(1, self.report.n_items)

    def method(self) -> str:
        return self.report.method if self.report else ""


def _points(subject: Any, threads: int) -> Prepared:
    solid, said = solid_of(subject), _Said()
    return Prepared(
        lambda points: said.keep(engine.locate(points, solid, workers=threads, report=True)),
        answer=lambda result: result >= 0, memory=lambda: solid.memory, method=said.method, share=said.beyond_filter,
    )  # fmt: skip


def _scene(bodies: Bodies, threads: int) -> Prepared:
    solids = [solid_of(body) for body in bodies.bodies]

    def answer(result: engine.SceneLocations) -> np.ndarray:
        owners = np.repeat(np.arange(len(result.offsets) - 1), np.diff(result.offsets))
        return owners * len(solids) + result.indices

    return Prepared(
        lambda points: engine.locate_scene(points, solids, workers=threads),
        answer=answer, memory=lambda: sum(solid.memory for solid in solids),
    )  # fmt: skip


def _segments(subject: Any, threads: int) -> Prepared:
    region, said = solid_of(subject), _Said()

    def ask(segments: np.ndarray) -> tuple[int, engine.SegmentPieces]:
        return len(segments), said.keep(engine.clip_segments(segments, region, workers=threads, report=True))

    def answer(result: tuple[int, engine.SegmentPieces]) -> np.ndarray:
        n_segments, pieces = result
        rows = np.full((n_segments, 2 * region.dimension), np.nan)
        backwards = slice(None, None, -1)  # of several pieces the first stays
        rows[pieces.source[backwards]] = np.hstack([pieces.start, pieces.end])[backwards]
        return rows

    return Prepared(ask, answer=answer, share=said.beyond_filter)


def _hits(keep: Any, answer: Callable[[int, Any], Any]) -> Callable[[Any, int], Prepared]:
    """Return the maker of one question about where segments meet a mesh."""

    def make(subject: Any, threads: int) -> Prepared:
        region = solid_of(subject)
        return Prepared(
            lambda segments: (len(segments), engine.hits(segments, region, keep=keep, workers=threads)),
            answer=lambda result: answer(*result),
        )

    return make


def _planes(measure: Callable[[Any, Any], float]) -> Callable[[Any, int], Prepared]:
    """Return the maker of one call a plane."""

    def make(subject: Any, threads: int) -> Prepared:
        solid = solid_of(subject)
        return Prepared(lambda rows: np.array([measure(solid, engine.HalfSpace(row[:3], row[3])) for row in rows]))

    return make


def _kept_polygons(region: engine.Solid, threads: int) -> Prepared:
    return Prepared(
        lambda rings: engine.clip_polygons(rings, region, workers=threads),
        answer=lambda result: np.diff(result.polygon_offsets) > 0,
    )


def _polygon_areas(region: engine.Solid, threads: int) -> Prepared:
    def ask(rings: np.ndarray) -> np.ndarray:
        clipped = engine.clip_polygons(rings, region)
        counts, result = np.diff(clipped.polygon_offsets), np.zeros(len(rings))
        result[counts > 0] = np.abs(ring_areas(clipped.vertices, clipped.ring_offsets))  # one ring each at most
        return result

    return Prepared(ask)


def ring_areas(vertices: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Return the signed areas of rings of three or more vertices in plain float64."""
    if len(offsets) < 2:
        return np.zeros(0)
    starts = np.repeat(offsets[:-1], np.diff(offsets))
    following = np.arange(1, len(vertices) + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    a, b = vertices - vertices[starts], vertices[following] - vertices[starts]
    return 0.5 * np.add.reduceat(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], offsets[:-1])


def _bodies_of(pair: Couple) -> list[Any]:
    def body(placed: Placed) -> Any:
        if isinstance(placed.shape, Mesh) and not placed.is_closed:
            return engine.Surface(placed.shape.vertices, placed.shape.faces)
        return solid_of(placed.shape)

    return [body(placed) for placed in pair]


def _pair(pair: Couple, threads: int) -> Prepared:
    """Yes or no, the question that the peers answer."""
    first, second = _bodies_of(pair)
    return Prepared(lambda _: engine.collide(first, second, boolean=True).relation != engine.Relation.DISJOINT)


def _relation(pair: Couple, threads: int) -> Prepared:
    """One of five relations, and a witness."""
    first, second = _bodies_of(pair)
    return Prepared(lambda _: engine.collide(first, second).relation)


def _relations(layers: Any, threads: int) -> Prepared:
    """The pairs of two layers that are asked about, in one call."""
    solids = [engine.Polygon([ring]) for layer in layers for ring in layer]
    n_left = len(layers[0])

    def ask(pairs: np.ndarray) -> tuple[np.ndarray, engine.ScenePairs]:
        asked = np.add(pairs, [0, n_left])
        return asked, engine.collide_scene(solids, only=asked, workers=threads)

    def answer(result: tuple[np.ndarray, engine.ScenePairs]) -> np.ndarray:
        asked, met = result
        known = dict(zip(zip(met.first.tolist(), met.second.tolist()), met.relation.tolist()))
        return np.array([known.get(tuple(pair), 0) for pair in asked.tolist()])

    return Prepared(ask, answer=answer)


def _poses(pair: Pair, threads: int, **options: bool) -> Prepared:
    """Yes or no, the question that the peers answer, unless options say otherwise."""
    first, second = pair.solids()
    options = options or {"boolean": True}
    return Prepared(
        lambda poses: engine.collide_poses(first, second, *poses, workers=threads, **options),  # type: ignore[call-overload]
        lambda rows: (pair.rotations[rows], pair.translations[rows]),
        lambda result: (result[0] if isinstance(result, tuple) else result) != engine.Relation.DISJOINT,
    )


def _clearance_poses(pair: Pair, threads: int) -> Prepared:
    first, second = pair.solids()
    return Prepared(
        lambda poses: engine.clearance_poses(first, second, *poses, workers=threads),
        lambda rows: (pair.rotations[rows], pair.translations[rows]),
    )


def _distances(mesh: Mesh, threads: int, **options: Any) -> Prepared:
    solid = solid_of(mesh)
    return Prepared(lambda points: engine.distances(points, solid, to="boundary", workers=threads, **options))


def _tree(mesh: Mesh, threads: int) -> Prepared:
    """From arrays to the answer of a first question with nothing near: constructor and tree."""
    far = engine.Surface([[9, 9, 9], [9, 9, 9.5], [9, 9.5, 9]], [[0, 1, 2]])
    return Prepared(lambda _: engine.collide(solid_of(mesh), far), answer=lambda _: None)


def _crowd(crowd: Crowd, threads: int) -> Prepared:
    """Every question starts from a list of solids and poses: nothing is cached but what a solid caches."""
    solids, still = crowd.solids(), crowd.poses()

    def ask(frames: list[list[engine.Pose]]) -> engine.ScenePairs:
        for poses in frames or [still]:
            result = engine.collide_scene(solids, poses, workers=threads)
        return result

    return Prepared(
        ask,
        lambda frames: [frame.poses() for frame in frames],
        lambda result: result.first * len(solids) + result.second,
    )


def _sides(pairs: Any) -> list[list[engine.Polygon]]:
    if len(pairs) == 1:
        return [[engine.Polygon(rings)] for rings in pairs[0]]
    return [_made([pair[side] for pair in pairs]) for side in range(2)]


def _made(shapes: list[list[np.ndarray]]) -> list[engine.Polygon]:
    """Return many polygons from their rings, put one after another, as arrays of geometries hold them."""
    rings = [ring for shape in shapes for ring in shape]
    sizes = [np.cumsum([0, *map(len, parts)]) for parts in (rings, shapes)]
    return engine.polygons(np.concatenate(rings), *sizes)


def _overlay(operation: Any, threads: int) -> Prepared:
    """Polygons are made while the clock runs, as the peers make theirs."""
    return Prepared(lambda pairs: areas_of(engine.overlay_batch(*_sides(pairs), operation, workers=threads)))


def _overlay_of_made(operation: Any, threads: int) -> Prepared:
    return Prepared(lambda sides: engine.overlay_batch(*sides, operation, workers=threads), _sides, areas_of)


def areas_of(batch: engine.OverlayBatch) -> np.ndarray:
    """Return the areas of the rounded outputs in plain float64, shells less holes, like those of the peers."""
    rings = batch.piece_offsets[batch.pair_offsets]
    owners = np.repeat(np.arange(len(batch)), np.diff(rings))
    return np.bincount(owners, weights=ring_areas(batch.vertices, batch.ring_offsets), minlength=len(batch))


def _exact_area(operation: Any, threads: int) -> Prepared:
    def area(pair: Any) -> float:
        return float(engine.overlay(*map(engine.Polygon, pair), operation, workers=threads).area_exact)

    return Prepared(each_or_nan(area))


def _simple(body: Mesh) -> engine.Solid:
    """Return a body as what its name says it is."""
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    if body.name == "ball":
        return engine.Sphere((low + high) / 2, 0.5 * (high - low).max())
    return engine.Aabb(low, high) if body.name == "box" else solid_of(body)


def _through(keep: Any) -> Callable[[Bodies, int], Prepared]:
    """Return the maker of a stored scene for questions about segments, its boxes and balls as such."""

    def make(bodies: Bodies, threads: int) -> Prepared:
        n = len(bodies.bodies)
        scene = engine.Scene([_simple(body) for body in bodies.bodies])

        def ask(segments: np.ndarray) -> tuple[int, Any]:
            return len(segments), scene.clip_segments(segments, keep=keep, workers=threads)

        def answer(result: tuple[int, Any]) -> np.ndarray:
            if keep == "any":
                return result[1]
            if keep == "first":
                return np.bincount(result[1].source, minlength=result[0]) > 0
            return np.unique(result[1].source * n + result[1].body)

        return Prepared(ask, answer=answer)

    return make


def _lines(subject: Any, threads: int) -> Prepared:
    region = solid_of(subject)
    return Prepared(
        lambda lines: engine.clip_lines(lines, region, workers=threads), answer=lambda result: result.source
    )


def _layers(how: str, threads: int) -> Prepared:
    """From two layers of polygons of (n, size, 2) corners, as frames with a column each."""
    from benchmarks.contenders.with_geopandas import areas, frames

    return Prepared(lambda both: engine.layers.overlay(*both, how, True, workers=threads), frames, areas)


def _join(predicate: str, threads: int) -> Prepared:
    from benchmarks.contenders.with_geopandas import frames, pairs

    return Prepared(lambda both: engine.layers.sjoin(*both, predicate=predicate), frames, pairs)


MAKERS = {
    "lines": _lines, "layers": _layers, "join": _join,
    "points": _points, "scene": _scene, "segments": _segments, "kept polygons": _kept_polygons,
    "polygon areas": _polygon_areas, "relations of polygons": _relations, "pair": _pair, "relation": _relation,
     "poses": _poses, "convex poses": _poses,
    "witnesses": lambda pair, threads: _poses(pair, threads, witnesses=True),
    "detail": lambda pair, threads: _poses(pair, threads, detail=True),
    "relations": lambda pair, threads: _poses(pair, threads, boolean=False),
    "hits": _hits("any", lambda n, met: met),
    "first hits": _hits("first", lambda n, found: t_by_segment(n, found.source, found.t)),
    "hit counts": _hits("all", lambda n, found: np.bincount(found.source, minlength=n)),
    "volume": lambda mesh, threads: Prepared(lambda _: engine.volume(solid_of(mesh))),
    "cut volumes": _planes(lambda solid, region: engine.cut(solid, region).volume),
    "section areas": _planes(lambda solid, region: math.fsum(engine.section(solid, [region]).areas)),
    "point distances": _distances,
    "points within": lambda asked, threads: _distances(asked[0], threads, within=asked[1]),
    "clearance poses": _clearance_poses,
    "clearance pairs": lambda _, threads: each_alone(_bodies_of, lambda made: engine.clearance(*made).distance),
    "tree": _tree, "crowd": _crowd, "overlay": _overlay, "overlay of made": _overlay_of_made,
    "exact area": _exact_area, **{f"scene {keep}": _through(keep) for keep in ("all", "first", "any")},
}  # fmt: skip
