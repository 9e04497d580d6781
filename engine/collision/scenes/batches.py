"""The batches that decide most pairs of a scene: boxes, balls and convex polyhedra, in kernels for many pairs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from engine.arrays import FloatArray, Int8Array, IntArray
from engine.budget import Budget
from engine.collision.codes import UNSETTLED
from engine.collision.convex.body import ConvexArrays, ConvexBody, convex_body_of, pooled
from engine.collision.convex.pair import relate_convex_pairs
from engine.collision.detail import details_of_boxes, details_where_proven
from engine.collision.meshes.mesh_arrays import STILL
from engine.collision.meshes.placement import PoseArrays
from engine.collision.planar.outline_batch import OutlineArrays, outline_pool, relate_outline_pairs
from engine.collision.scenes.bodies import SceneBodies, scene_bodies
from engine.collision.simple.form_relations import relate_box_pairs
from engine.direct import entry_of
from engine.parallel import run_chunks
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.pose import Pose

_LEAST_POSES: Final = 32
"""What a batch of poses needs is made in the time that it spares on so many."""
_FEW: Final = 64
"""Distinct solids that are all described for a question about some of them."""


class _Pools:
    """The distinct solids of a scene as the batches take them; made when they are wanted."""

    def __init__(self, distinct: Sequence[Solid]) -> None:
        self.are_boxes = np.array([isinstance(solid, Aabb) for solid in distinct], np.bool_)
        self.convex: tuple[ConvexArrays, IntArray] | None = None
        self.outlines: tuple[OutlineArrays, IntArray] | None = None


class SceneBatches:
    """Which bodies of a scene the batches take, and the arrays that they want."""

    __slots__ = ("_is_box", "_pools", "bodies")

    def __init__(self, bodies: SceneBodies, pools: _Pools | None = None) -> None:
        self.bodies, self._pools = bodies, _Pools(bodies.distinct) if pools is None else pools
        self._is_box = self._pools.are_boxes[bodies.kinds] & ~bodies.is_posed

    def under(self, names: IntArray, poses: list[Pose | None]) -> SceneBatches:
        """Return the batches of some bodies under poses that fit them."""
        bodies, pools = self.bodies, self._pools
        if len(bodies.distinct) > _FEW and pools.convex is None and pools.outlines is None:
            return SceneBatches(scene_bodies([bodies.solids[body] for body in names.tolist()], poses))
        return SceneBatches(bodies.under(names, poses), pools)

    def relations(self, pairs: IntArray, boolean: bool, detail: bool, budget: Budget, workers: int | None) -> Int8Array:
        """Return the relations ``(n,)`` of pairs ``(n, 2)`` of bodies, UNSETTLED where no batch decides."""
        found = np.full(len(pairs), UNSETTLED, np.int8)
        bodies, flag = self.bodies, budget.flag
        relate_box_pairs(bodies.low, bodies.high, self._is_box, pairs, found)
        if bodies.dimension == 2:
            self._relate_outlines(pairs, found, detail, budget, workers)
            return found
        if not (found == UNSETTLED).any():
            return found
        pool, convex = self.pool(budget)
        rows = np.append(np.int64(-1), convex[bodies.kinds])
        poses = PoseArrays(bodies.rotations, bodies.translations, True)

        def task(start: int, stop: int) -> None:
            of_some = pairs[start:stop] + 1
            entry_of(relate_convex_pairs)(pool, rows, poses, of_some, boolean, not detail, found[start:stop], flag)

        run_chunks(task, len(pairs), budget=budget, workers=workers)
        return found

    def related(
        self, kinds: IntArray, rotations: FloatArray, translations: FloatArray, n: int, boolean: bool, budget: Budget
    ) -> Int8Array:
        """Return the relations of n pairs of bodies of some kinds, UNSETTLED where the batch of convex ones does not
        decide; pair i: rows 2 i + 1 and 2 i + 2; row 0: the identity, of any kind."""
        found, pools = np.full(n, UNSETTLED, np.int8), self._pools
        if n and self.bodies.dimension == 3 and (pools.convex is not None or len(self.bodies.distinct) <= _FEW):
            pool, convex = self.pool(budget)
            pairs, poses = np.arange(1, 2 * n + 1).reshape(n, 2), PoseArrays(rotations, translations, True)
            entry_of(relate_convex_pairs)(
                pool, convex[kinds[: 2 * n + 1]], poses, pairs, boolean, True, found, budget.flag
            )
            budget.check()
        return found

    def _relate_outlines(
        self, pairs: IntArray, found: Int8Array, detail: bool, budget: Budget, workers: int | None
    ) -> None:
        """Fill the relations of pairs of polygons, triangles and boxes of the plane, UNSETTLED where they are open."""
        bodies, flag = self.bodies, budget.flag
        if self._pools.outlines is None:
            self._pools.outlines = outline_pool(bodies.distinct)
        outlines, simple = self._pools.outlines
        simple = simple[bodies.kinds]
        rows = np.where(bodies.is_posed, np.arange(1, len(bodies.solids) + 1), 0)
        poses = PoseArrays(bodies.rotations, bodies.translations, True)

        def task(start: int, stop: int) -> None:
            with np.errstate(all="ignore"):  # uncompiled runs only
                relate_outline_pairs(outlines, simple, rows, poses, pairs[start:stop], detail, found[start:stop], flag)

        run_chunks(task, len(pairs), budget=budget, workers=workers)

    def details(self, pairs: IntArray, relations: Int8Array) -> Int8Array:
        """Return the codes of `Rcc8` of pairs of bodies with interiors; NO_DETAIL where relations are UNSETTLED."""
        found = details_where_proven(relations)
        boxes = np.flatnonzero(self._is_box[pairs].all(axis=1) & (relations != UNSETTLED))
        found[boxes] = details_of_boxes(self.bodies.low, self.bodies.high, pairs[boxes], relations[boxes])
        return found

    def pool(self, budget: Budget) -> tuple[ConvexArrays, IntArray]:
        """Return the convex bodies, and the place of each solid among them, -1 for others; each is looked at once."""
        if self._pools.convex is None:
            kinds = np.full(len(self.bodies.distinct), -1, np.int64)
            convex: list[ConvexBody] = []
            for kind, solid in enumerate(self.bodies.distinct):
                budget.check()
                body = convex_body_of(solid)
                if body is not None:
                    kinds[kind] = len(convex)
                    convex.append(body)
            self._pools.convex = pooled(convex), kinds
        return self._pools.convex


def convex_poses(
    first: Solid, second: Solid, poses: PoseArrays, relations: Int8Array, budget: Budget, boolean: bool
) -> Callable[[int, int], None] | None:
    """Return the task that relates ranges of poses, UNSETTLED where open; None where this does not pay."""
    bodies = [body for body in (convex_body_of(first), convex_body_of(second)) if body is not None]
    n = len(relations)
    if len(bodies) < 2 or n < _LEAST_POSES:
        return None
    pool, rows = pooled(bodies), np.append(np.int64(0), np.ones(n, np.int64))
    pairs = np.column_stack([np.zeros(n, np.int64), np.arange(1, n + 1)])
    rotations = np.concatenate([STILL.rotations, poses.rotations])
    all_poses = PoseArrays(rotations, np.concatenate([STILL.translations, poses.translations]), True)

    def fill(start: int, stop: int) -> None:
        with np.errstate(all="ignore"):  # uncompiled runs only
            relate_convex_pairs(
                pool, rows, all_poses, pairs[start:stop], boolean, False, relations[start:stop], budget.flag
            )
        budget.check()

    return fill
