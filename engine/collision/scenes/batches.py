"""The batches that decide most pairs of a scene: boxes, balls and convex polyhedra, in kernels for many pairs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from engine.arrays import Int8Array, IntArray
from engine.collision.codes import UNSETTLED
from engine.collision.convex.body import ConvexArrays, ConvexBody, convex_body_of, pooled
from engine.collision.convex.pair import relate_convex_pairs
from engine.collision.convex.poses import LEAST_POSES, lane_arrays, relate_in_lanes
from engine.collision.detail import details_of_boxes, details_where_proven
from engine.collision.meshes.mesh_arrays import STILL
from engine.collision.meshes.placement import PoseArrays
from engine.collision.planar.outline_batch import OutlineArrays, outline_pool, relate_outline_pairs
from engine.collision.scenes.bodies import SceneBodies
from engine.collision.simple.aabb_aabb import relate_box_pairs
from engine.parallel import Budget, run_chunks
from engine.solids.aabb import Aabb
from engine.solids.base import Solid


class SceneBatches:
    """Which bodies of a scene the batches take, and the arrays that they want."""

    def __init__(self, bodies: SceneBodies, boolean: bool, detail: bool, budget: Budget) -> None:
        self._bodies = bodies
        self._boolean = boolean
        self._detail = detail
        self._budget = budget
        is_box = np.array([isinstance(solid, Aabb) for solid in bodies.distinct], np.bool_)
        self._is_box = is_box[bodies.kinds] & ~bodies.is_posed
        self._pool: ConvexArrays | None = None
        self._convex = np.full(len(bodies.solids), -1, np.int64)
        self._outlines: OutlineArrays | None = None
        self._simple = self._convex

    def relations(self, pairs: IntArray, workers: int | None) -> Int8Array:
        """Return the relations ``(n,)`` of pairs ``(n, 2)`` of bodies, UNSETTLED where no batch decides."""
        found = np.full(len(pairs), UNSETTLED, np.int8)
        bodies, flag = self._bodies, self._budget.flag
        relate_box_pairs(bodies.low, bodies.high, self._is_box, pairs, found)
        if bodies.dimension == 2:
            self._relate_outlines(pairs, found, workers)
        elif (found == UNSETTLED).any():
            self._prepare()
        pool = self._pool
        if pool is None:
            return found
        rows, poses = np.append(np.int64(-1), self._convex), PoseArrays(bodies.rotations, bodies.translations, True)

        def task(start: int, stop: int) -> None:
            with np.errstate(all="ignore"):  # uncompiled runs only
                relate_convex_pairs(
                    pool, rows, poses, pairs[start:stop] + 1, self._boolean, not self._detail, found[start:stop], flag
                )

        run_chunks(task, len(pairs), budget=self._budget, workers=workers)
        return found

    def _relate_outlines(self, pairs: IntArray, found: Int8Array, workers: int | None) -> None:
        """Fill the relations of pairs of polygons, triangles and boxes of the plane, UNSETTLED where they are open."""
        bodies, flag = self._bodies, self._budget.flag
        if self._outlines is None:
            pool, numbers = outline_pool(bodies.distinct)
            self._outlines, self._simple = pool, numbers[bodies.kinds]
        outlines, simple = self._outlines, self._simple
        rows = np.where(bodies.is_posed, np.arange(1, len(bodies.solids) + 1), 0)
        poses = PoseArrays(bodies.rotations, bodies.translations, True)

        def task(start: int, stop: int) -> None:
            with np.errstate(all="ignore"):  # uncompiled runs only
                relate_outline_pairs(outlines, simple, rows, poses, pairs[start:stop], found[start:stop], flag)

        run_chunks(task, len(pairs), budget=self._budget, workers=workers)

    def details(self, pairs: IntArray, relations: Int8Array) -> Int8Array:
        """Return the codes of `Rcc8` of pairs of bodies with interiors whose relations are those that `relations`
        found; NO_DETAIL where these are UNSETTLED."""
        found = details_where_proven(relations)
        boxes = np.flatnonzero(self._is_box[pairs].all(axis=1))
        found[boxes] = details_of_boxes(self._bodies.low, self._bodies.high, pairs[boxes], relations[boxes])
        return found

    def _prepare(self) -> None:
        """Look at each solid once: is it convex?"""
        if self._pool is not None:
            return
        kinds = np.full(len(self._bodies.distinct), -1, np.int64)
        convex: list[ConvexBody] = []
        for kind, solid in enumerate(self._bodies.distinct):
            self._budget.check()
            body = convex_body_of(solid)
            if body is not None:
                kinds[kind] = len(convex)
                convex.append(body)
        self._pool = pooled(convex)
        self._convex = kinds[self._bodies.kinds]


def convex_poses(
    first: Solid, second: Solid, poses: PoseArrays, relations: Int8Array, budget: Budget, boolean: bool
) -> Callable[[int, int], None] | None:
    """Return the task that fills relations for a range of poses of `second`, UNSETTLED where float64 does not decide;
    None unless both solids are convex."""
    bodies = [body for body in (convex_body_of(first), convex_body_of(second)) if body is not None]
    if len(bodies) < 2:
        return None
    pool, lanes = pooled(bodies), lane_arrays(*bodies) if len(relations) >= LEAST_POSES else None
    turns, moves, _ = poses

    def fill(start: int, stop: int) -> None:
        found = relations[start:stop]
        with np.errstate(all="ignore"):  # uncompiled runs only
            if lanes is not None:
                some = PoseArrays(turns[start:stop], moves[start:stop], True)
                relate_in_lanes(pool, lanes, STILL, some, boolean, found, budget.flag)
            rest = np.flatnonzero(found == UNSETTLED)
            if len(rest):
                rows = np.append(np.int64(0), np.ones(len(rest), np.int64))
                pairs = np.column_stack([np.zeros(len(rest), np.int64), np.arange(1, len(rest) + 1)])
                placed = np.concatenate([STILL.rotations, turns[start + rest]])
                moved = np.concatenate([STILL.translations, moves[start + rest]])
                some, answers = PoseArrays(placed, moved, True), np.full(len(rest), UNSETTLED, np.int8)
                relate_convex_pairs(pool, rows, some, pairs, boolean, False, answers, budget.flag)
                found[rest] = answers
        budget.check()

    return fill
