"""The engine: float64 in, exact answers."""

from __future__ import annotations

from typing import Any

import numpy as np

import engine
from benchmarks.contenders import Couple, Placed, Prepared
from benchmarks.crowds import Crowd
from benchmarks.poses import Pair
from benchmarks.workloads import Bodies, Mesh, Planes, Rings


def solid_of(subject: Any) -> engine.Solid:
    """Return a new solid."""
    match subject:
        case Mesh():
            return engine.Polyhedron(subject.vertices, subject.faces)
        case Rings():
            return engine.Polygon(subject.rings)
        case Planes():
            return engine.Convex(subject.rows)
    return subject


class _Share:
    """What the last question said of itself."""

    said: Any = None

    def keep(self, found: Any) -> Any:
        answer, self.said = found
        return answer

    def beyond_filter(self) -> float:
        return self.said.n_beyond_filter / max(1, self.said.n_items)

    def method(self) -> str:
        return self.said.method if self.said else ""


def _points(subject: Any, threads: int) -> Prepared:
    solid, share = solid_of(subject), _Share()

    def ask(points: np.ndarray) -> np.ndarray:
        return share.keep(engine.locate(points, solid, workers=threads, report=True))

    return Prepared(
        ask,
        answer=lambda found: found >= 0,
        memory=lambda: solid.memory,
        method=share.method,
        share=share.beyond_filter,
    )


def _scene(bodies: Bodies, threads: int) -> Prepared:
    solids = [solid_of(body) for body in bodies.bodies]

    def answer(found: engine.SceneLocations) -> np.ndarray:
        owners = np.repeat(np.arange(len(found.offsets) - 1), np.diff(found.offsets))
        return owners * len(solids) + found.indices

    return Prepared(
        lambda points: engine.locate_scene(points, solids, workers=threads),
        answer=answer,
        memory=lambda: sum(solid.memory for solid in solids),
    )


def _segments(subject: Any, threads: int) -> Prepared:
    region, share = solid_of(subject), _Share()

    def ask(segments: np.ndarray) -> tuple[int, engine.SegmentPieces]:
        return len(segments), share.keep(engine.clip_segments(segments, region, workers=threads, report=True))

    def answer(found: tuple[int, engine.SegmentPieces]) -> np.ndarray:
        n_segments, pieces = found
        rows = np.full((n_segments, 2 * region.dimension), np.nan)
        backwards = slice(None, None, -1)  # of several pieces the first stays
        rows[pieces.source[backwards]] = np.hstack([pieces.start, pieces.end])[backwards]
        return rows

    return Prepared(ask, answer=answer, share=share.beyond_filter)


def _hits(subject: Any, threads: int) -> Prepared:
    region = solid_of(subject)

    def ask(segments: np.ndarray) -> tuple[int, engine.SegmentPieces]:
        return len(segments), engine.clip_segments(segments, region, workers=threads)

    def answer(found: tuple[int, engine.SegmentPieces]) -> np.ndarray:
        met = found[1].source[(found[1].faces >= 0).any(axis=1)]
        return np.bincount(met, minlength=found[0]) > 0

    return Prepared(ask, answer=answer)


def _kept_polygons(region: engine.Solid, threads: int) -> Prepared:
    return Prepared(
        lambda rings: engine.clip_polygons(rings, region, workers=threads),
        answer=lambda found: np.diff(found.polygon_offsets) > 0,
    )


def _polygon_areas(region: engine.Solid, threads: int) -> Prepared:
    def ask(rings: np.ndarray) -> np.ndarray:
        clipped = engine.clip_polygons(rings, region)
        counts, found = np.diff(clipped.polygon_offsets), np.zeros(len(rings))
        found[counts > 0] = np.abs(ring_areas(clipped.vertices, clipped.ring_offsets))  # one ring each at most
        return found

    return Prepared(ask)


def ring_areas(vertices: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Return the signed areas of rings of three or more vertices in plain float64."""
    starts = np.repeat(offsets[:-1], np.diff(offsets))
    following = np.arange(1, len(vertices) + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    a, b = vertices - vertices[starts], vertices[following] - vertices[starts]
    return 0.5 * np.add.reduceat(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], offsets[:-1])


def _pair(pair: Couple, threads: int) -> Prepared:
    first, second = (_body(body) for body in pair)
    return Prepared(lambda _: engine.collide(first, second).relation != engine.Relation.DISJOINT)


def _body(body: Placed) -> engine.Solid:
    if isinstance(body.shape, Mesh) and not body.is_closed:
        return engine.Surface(body.shape.vertices, body.shape.faces)
    return solid_of(body.shape)


def _poses(pair: Pair, threads: int) -> Prepared:
    first, second = pair.solids()

    def ask(poses: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        return engine.collide_poses(first, second, *poses, workers=threads)

    return Prepared(
        ask,
        lambda rows: (pair.rotations[rows], pair.translations[rows]),
        lambda found: found != engine.Relation.DISJOINT,
    )


def _tree(mesh: Mesh, threads: int) -> Prepared:
    """From arrays to the answer of a first question with nothing near: constructor and tree."""
    far = engine.Surface([[9, 9, 9], [9, 9, 9.5], [9, 9.5, 9]], [[0, 1, 2]])
    return Prepared(lambda _: engine.collide(solid_of(mesh), far))


def _crowd(crowd: Crowd, threads: int) -> Prepared:
    """Every question starts from a list of solids and poses: nothing is kept but what a solid keeps of itself."""
    kinds = [solid_of(mesh) for mesh in crowd.meshes]
    solids, still = [kinds[kind] for kind in crowd.kinds], crowd.poses()

    def ask(frames: list[list[engine.Pose]]) -> engine.ScenePairs:
        for poses in frames or [still]:
            found = engine.collide_scene(solids, poses, workers=threads)
        return found

    return Prepared(
        ask, lambda frames: [frame.poses() for frame in frames], lambda found: found.first * len(solids) + found.second
    )


def _overlay(operation: Any, threads: int) -> Prepared:
    """Polygons are made while the clock runs, as the peers make theirs."""

    def ask(pairs: Any) -> np.ndarray:
        sides = [[engine.Polygon(pair[side]) for pair in pairs] for side in range(2)]
        return areas_of(engine.overlay_batch(sides[0], sides[1], operation, workers=threads))

    return Prepared(ask)


def _overlay_of_made(operation: Any, threads: int) -> Prepared:
    def ask(sides: list[list[engine.Polygon]]) -> engine.OverlayBatch:
        return engine.overlay_batch(sides[0], sides[1], operation, workers=threads)

    def native(pairs: Any) -> list[list[engine.Polygon]]:
        return [[engine.Polygon(pair[side]) for pair in pairs] for side in range(2)]

    return Prepared(ask, native, areas_of)


def areas_of(batch: engine.OverlayBatch) -> np.ndarray:
    """Return the areas of the rounded outputs in plain float64, shells less holes, like those of the peers."""
    n, rings = len(batch), batch.piece_offsets[batch.pair_offsets]
    if not len(batch.vertices):
        return np.zeros(n)
    starts, ends = batch.ring_offsets[:-1], batch.ring_offsets[1:]
    x, y = (batch.vertices - np.repeat(batch.vertices[starts], ends - starts, axis=0)).T
    following = np.arange(1, len(x) + 1)
    following[ends - 1] = starts
    twice = np.add.reduceat(x * y[following] - y * x[following], starts)
    return 0.5 * np.bincount(np.repeat(np.arange(n), np.diff(rings)), weights=twice, minlength=n)


MAKERS = {
    "points": _points,
    "scene": _scene,
    "segments": _segments,
    "hits": _hits,
    "kept polygons": _kept_polygons,
    "polygon areas": _polygon_areas,
    "pair": _pair,
    "poses": _poses,
    "convex poses": _poses,
    "tree": _tree,
    "crowd": _crowd,
    "overlay": _overlay,
    "overlay of made": _overlay_of_made,
}
