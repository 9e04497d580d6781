"""Arrays of the bodies of a scene, and kernels that relate most of many pairs: boxes, outlines, balls, convex bodies.

A scene stores a solid, a pose and a box a body; preparing it takes a few lookups a body. One table of pairs serves
scenes and many poses of one pair: rows of (solid, pose), and pairs of rows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import compress
from typing import Any, Final, NamedTuple

import numpy as np

from engine.bounding.aabb import place_boxes
from engine.collision.codes import OVERLAPPING, UNSETTLED
from engine.collision.collide import (
    TAKEN,
    Witnesses,
    details_of_boxes,
    details_where_proven,
    instead_of,
    pair_function,
    posed,
)
from engine.collision.convex_batch import relate_convex_pairs
from engine.collision.convex_body import ConvexBody, convex_body_of, pool_bodies
from engine.collision.meshes.placement import PoseArrays
from engine.collision.outline import witness_of
from engine.collision.outline_batch import outline_pool, relate_outline_pairs
from engine.collision.result import has_faces
from engine.collision.simple.closed_forms import FORMS, witness_of_forms
from engine.collision.simple.form_relations import (
    HIGH,
    IS_BALL,
    N_NUMBERS,
    RADIUS,
    RELATION_MASK,
    FormRows,
    relate_box_pairs,
    relate_form_pairs,
)
from engine.compiling.jit import entry_of
from engine.errors import InvalidArrayError, UnsupportedPairError, UnsupportedSolidError, WrongDimensionError
from engine.running.budget import Budget, polled
from engine.running.parallel import run_chunks
from engine.solids.base import Solid, named
from engine.solids.bounds import boxes_of_polygons
from engine.solids.polygon import Polygon
from engine.solids.pose import Pose, motions_of
from engine.solids.poses import Poses
from engine.solids.primitives import Aabb, Sphere
from engine.solids.registry import own_box
from engine.solids.shapes import as_solid
from engine.types import BoolArray, FloatArray, Int8Array, IntArray, read_only

_LEAST_POSES: Final = 32
"""Smallest number of poses for which a batch saves more time than its preparation takes."""
_FEW: Final = 64
"""Largest number of distinct solids that are all prepared for a query about some of them."""
_SMALL: Final = 64
"""Most vertices of a polygon for `_is_small`."""


class PairBatches:
    """Batch kernels for pairs of bodies, each one of the solids `distinct` (all of one dimension) under a pose; the
    arrays that they read are built at first use."""

    def __init__(self, distinct: Sequence[Solid], own: OwnBoxes) -> None:
        self.distinct, self._own, self.is_planar = distinct, own, len(distinct) > 0 and distinct[0].dimension == 2
        self.are_boxes, self.are_balls = (
            np.array([isinstance(solid, kind) for solid in distinct], np.bool_) for kind in (Aabb, Sphere)
        )
        self.cached_pool: tuple[Any, IntArray] | None = None
        self._forms: FloatArray | None = None

    def pool(self, budget: Budget) -> tuple[Any, IntArray]:
        """Return (pool, places): the solids of `distinct` that the batch kernels take, in one set of arrays, and by
        solid its index there, -1 for a solid that they do not take. In the plane `OutlineArrays` of outlines with
        simple boundaries, in space `ConvexArrays` of convex bodies. Cached."""
        if self.cached_pool is None:
            self.cached_pool = (outline_pool if self.is_planar else _convex_pool)(self.distinct, budget)
        return self.cached_pool

    def task(
        self, kinds: IntArray, poses: PoseArrays, is_posed: BoolArray, pairs: IntArray, relations: Int8Array,
        boolean: bool, detail: bool, budget: Budget, witnesses: Witnesses | None = None,
    ) -> Callable[[int, int], None]:  # fmt: skip
        """Return a function (start, stop) that fills the UNSETTLED entries of relations[start:stop] with relation codes
        of pairs[start:stop]; they stay UNSETTLED where no kernel can decide. A row is a solid under a pose: kinds
        (n_rows,), its index in `distinct`; poses, one a row, row 0 the identity; is_posed (n_rows,), False for none.
        pairs (n, 2): two rows each. boolean: another relation may be given than that of two bodies that meet. detail:
        an overlap that is not proven to be PO stays UNSETTLED. witnesses (n): in the plane, and of boxes and balls,
        filled too."""
        (pool, places), flag, is_named = self.pool(budget), budget.flag, witnesses is not None
        bodies, has_boxes, has_balls = places[kinds], bool(self.are_boxes.any()), bool(self.are_balls.any())
        rows = FormRows(self.forms(), kinds, poses.rotations, poses.translations, is_posed)
        contacts = np.full((len(pairs) if self.is_planar and is_named else 0, 3), -1, np.int32)

        def by_forms(start: int, stop: int, with_balls: bool) -> None:
            codes, some = np.empty(stop - start, np.int32), relations[start:stop]
            entry_of(relate_form_pairs)(rows, pairs[start:stop], some, is_named, with_balls, codes, flag)
            budget.check()
            if detail:
                codes[codes & RELATION_MASK == OVERLAPPING] = UNSETTLED
            decided = codes != UNSETTLED
            some[decided] = codes[decided] & RELATION_MASK
            if witnesses is not None and decided.any():
                witnesses[start:stop] = map(witness_of_forms, codes.tolist())

        def task(start: int, stop: int) -> None:
            with_balls = self.is_planar or is_named
            if has_boxes or (has_balls and with_balls):
                by_forms(start, stop, with_balls)
            some, codes = pairs[start:stop], relations[start:stop]
            if not self.is_planar:
                entry_of(relate_convex_pairs)(pool, bodies, poses, some, boolean, not detail, codes, flag)
                budget.check()
                if has_balls and not is_named:  # balls that touch: others are decided sooner by floats
                    by_forms(start, stop, True)
                return
            met = contacts[start:stop]
            entry_of(relate_outline_pairs)(pool, bodies, poses, some, boolean, detail, codes, met, flag)
            budget.check()
            if witnesses is not None:
                items = np.flatnonzero(met[:, 2] >= 0)
                for item, *named in zip(items.tolist(), codes[items].tolist(), *met[items].T.tolist()):
                    witnesses[start + item] = witness_of(*named)

        return task

    def forms(self) -> FloatArray:
        """Return the numbers (n, N_NUMBERS) of the boxes and balls among the solids, see `form_relations.py`; NaN for
        others and flat boxes. Cached."""
        if self._forms is None:
            (low, high), d = np.moveaxis(self._own.boxes, 1, 0), self._own.boxes.shape[2]
            forms = np.zeros((len(low), N_NUMBERS))
            forms[:, :d], forms[:, HIGH : HIGH + d], forms[:, RADIUS] = low, high, self._own.radii
            forms[:, IS_BALL] = self.are_balls
            forms[~self.are_balls & ~(self.are_boxes & (low < high).all(axis=1))] = np.nan
            self._forms = read_only(forms)
        return self._forms


def _convex_pool(solids: Sequence[Solid], budget: Budget) -> tuple[Any, IntArray]:
    """Return the solids that are provably convex in one pool, and by solid its index there, -1 for a solid that is
    not."""
    places, convex = np.full(len(solids), -1, np.int64), list[ConvexBody]()
    for kind, solid in enumerate(solids):
        budget.check()
        body = convex_body_of(solid)
        if body is not None:
            places[kind] = len(convex)
            convex.append(body)
    return pool_bodies(convex), places


class SceneBatches:
    """Batch kernels for pairs of bodies of one scene. bodies: the scene; pairs: its distinct solids, prepared."""

    __slots__ = ("_is_box", "bodies", "pairs")

    def __init__(self, bodies: SceneBodies, pairs: PairBatches | None = None) -> None:
        self.bodies, self.pairs = bodies, PairBatches(bodies.distinct, bodies.own) if pairs is None else pairs
        self._is_box = self.pairs.are_boxes[bodies.kinds] & ~bodies.is_posed

    def under(self, names: IntArray, poses: list[Pose | None]) -> SceneBatches:
        """Return the batches of the bodies with indices `names` under other, checked poses, one for each name. They
        share the prepared solids, unless preparing all of these would cost more than preparing those of `names`."""
        bodies = self.bodies
        if len(bodies.distinct) > _FEW and self.pairs.cached_pool is None:
            return SceneBatches(scene_bodies([bodies.solids[body] for body in names.tolist()], poses))
        return SceneBatches(bodies.under(names, poses), self.pairs)

    def relations(
        self, pairs: IntArray, boolean: bool, detail: bool, budget: Budget, workers: int | None,
        witnesses: Witnesses | None = None,
    ) -> Int8Array:  # fmt: skip
        """Return the relation codes (n,) of pairs (n, 2) of body indices, UNSETTLED where no kernel decides. boolean,
        detail, witnesses: as in `PairBatches.task`."""
        result, bodies = np.full(len(pairs), UNSETTLED, np.int8), self.bodies

        def relate_boxes(start: int, stop: int) -> None:
            relate_box_pairs(bodies.low, bodies.high, self._is_box, pairs[start:stop], result[start:stop])

        if witnesses is None:
            run_chunks(relate_boxes, len(pairs), budget=budget, workers=workers)
        if (result == UNSETTLED).any():
            kinds, poses = np.append(np.int64(0), bodies.kinds), PoseArrays(bodies.rotations, bodies.translations, True)
            is_posed = np.append(False, bodies.is_posed)
            task = self.pairs.task(kinds, poses, is_posed, pairs + 1, result, boolean, detail, budget, witnesses)
            run_chunks(task, len(pairs), budget=budget, workers=workers)
        return result

    def related(
        self, kinds: IntArray, rotations: FloatArray, translations: FloatArray, n: int, boolean: bool, budget: Budget
    ) -> Int8Array:
        """Return the relation codes (n,) of n pairs of placed solids, rows 1 and 2, rows 3 and 4, ...; UNSETTLED where
        open. kinds: index in the distinct solids by row; rotations, translations: pose by row, row 0 the identity. All
        are UNSETTLED if the scene has too many distinct solids to prepare them for few pairs."""
        relations = np.full(n, UNSETTLED, np.int8)
        if n and (self.pairs.cached_pool is not None or len(self.bodies.distinct) <= _FEW):
            pairs, poses = np.arange(1, 2 * n + 1).reshape(n, 2), PoseArrays(rotations, translations, True)
            is_posed = np.zeros(2 * n + 1, np.bool_)  # only for witnesses
            self.pairs.task(kinds[: 2 * n + 1], poses, is_posed, pairs, relations, boolean, False, budget)(0, n)
        return relations

    def details(self, pairs: IntArray, relations: Int8Array) -> Int8Array:
        """Return the `Rcc8` codes (n,) of pairs (n, 2) of body indices from their relations (n,); NO_DETAIL where a
        relation is UNSETTLED. Caller guarantees that all bodies have interiors."""
        codes = details_where_proven(relations)
        boxes = np.flatnonzero(self._is_box[pairs].all(axis=1) & (relations != UNSETTLED))
        codes[boxes] = details_of_boxes(self.bodies.low, self.bodies.high, pairs[boxes], relations[boxes])
        return codes


def posed_batch(
    first: Solid, second: Solid, poses: PoseArrays, relations: Int8Array, boolean: bool, detail: bool, budget: Budget,
    witnesses: Witnesses | None,
) -> Callable[[int, int], None] | None:  # fmt: skip
    """Return a task that fills relations[start:stop] for these poses of the second solid, the first unposed; UNSETTLED
    where the kernel cannot decide. None if a batch would be no faster, if a solid of space is not provably convex, or
    one of the plane has no edges, unless the two are boxes and discs. boolean, detail, witnesses: as in
    `PairBatches.task`."""
    n, solids, are_planar = len(relations), [first, second], first.dimension == 2
    if n < _LEAST_POSES or not (are_planar or all(map(convex_body_of, solids))):
        return None
    if are_planar and not (all(map(has_faces, solids)) or {first.type, second.type} <= {*FORMS}):
        return None
    table = PairBatches(solids, _own_boxes(solids))
    turn, move = motions_of([None], first.dimension)
    rows = PoseArrays(np.concatenate([turn, poses.rotations]), np.concatenate([move, poses.translations]), True)
    kinds, pairs = np.minimum(np.arange(n + 1), 1), np.column_stack([np.zeros(n, np.int64), np.arange(1, n + 1)])
    return table.task(kinds, rows, np.arange(n + 1) > 0, pairs, relations, boolean, detail, budget, witnesses)


@dataclass(frozen=True, slots=True, eq=False)
class SceneBodies:
    """Bodies of a checked scene.

    | field | shape | meaning |
    |---|---|---|
    | solids, poses | n | solid and pose of each body |
    | distinct | | each solid object once |
    | kinds | (n,) | index of each body's solid in distinct |
    | is_posed | (n,) | whether a pose was given |
    | rotations, translations | (n + 1, d, d), (n + 1, d) | row 0 the identity, then one row a body |
    | low, high | (n, d) | boxes of the posed bodies; exact for an aabb without pose |
    | own | | unposed boxes of the distinct solids |
    """

    solids: Sequence[Solid]
    poses: Sequence[Pose | None]
    distinct: Sequence[Solid]
    kinds: IntArray
    is_posed: BoolArray
    rotations: FloatArray
    translations: FloatArray
    low: FloatArray
    high: FloatArray
    own: OwnBoxes

    @property
    def dimension(self) -> int:
        """Dimension of the bodies, 2 or 3."""
        return self.translations.shape[1]

    def under(self, names: IntArray, poses: Sequence[Pose | None]) -> SceneBodies:
        """Return bodies `names` under other, checked poses, sharing the distinct solids."""
        solids = [self.solids[body] for body in names.tolist()]
        return _place_bodies(solids, poses, self.distinct, self.kinds[names], self.own)


class OwnBoxes(NamedTuple):
    """Unposed boxes of n distinct solids, the input of `place_boxes`. boxes (n, 2, d): low and high corner, of a ball
    its centre twice; reaches (n,): largest distance of a point of the solid from the middle of its box; radii (n,): of
    balls, 0.0 for other solids."""

    boxes: FloatArray
    reaches: FloatArray
    radii: FloatArray


def scene_bodies(solids: Any, poses: Any) -> SceneBodies:
    """Check the bodies of a scene and return them as arrays; poses: one or None for each solid, or None for no poses.
    Raises an error that names the index of the wrong body."""
    poses = list(poses) if isinstance(poses, Poses) else poses
    for name, each in (("solids", solids), ("poses", () if poses is None else poses)):
        if not isinstance(each, (list, tuple)):
            raise InvalidArrayError(f"{name} must be a list, got {type(each).__name__}", (name,))
    bodies = list(solids)
    if not all(issubclass(kind, Solid) for kind in set(map(type, bodies))):
        bodies = [as_solid(each, "solids", index) for index, each in enumerate(bodies)]
    given: list[Any] = [None] * len(bodies) if poses is None else list(poses)
    if len(given) != len(bodies):
        raise InvalidArrayError(f"poses must be as many as solids, {len(bodies)}, got {len(given)}", ("poses",))
    kinds = check_collidable(bodies)
    if set(map(type, given)) - {Pose, type(None)}:
        given = [posed(each, bodies[index], "poses", index) for index, each in enumerate(polled(given))]
    return bodies_of(bodies, given, *kinds)


def bodies_of(
    solids: Sequence[Solid], poses: Sequence[Pose | None], distinct: list[Solid], kinds: IntArray,
    check: Callable[[], object] | None = None,
) -> SceneBodies:  # fmt: skip
    """Return bodies of any type as arrays. solids, poses: of each body; distinct: each solid object once; kinds: index
    in `distinct` of each body's solid; check: called while another thread computes a box, may raise."""
    return _place_bodies(solids, poses, distinct, kinds, _own_boxes(distinct, check))


def _own_boxes(distinct: Sequence[Solid], check: Callable[[], object] | None = None) -> OwnBoxes:
    """Return the boxes of solids of one dimension. check: as in `bodies_of`."""
    d, is_small = (distinct[0].dimension if distinct else 3), [_is_small(solid) for solid in distinct]
    boxes, reaches = np.empty((len(distinct), 2, d)), np.empty(len(distinct))
    if d == 2 and any(is_small):
        boxes[is_small], reaches[is_small] = boxes_of_polygons([*compress(distinct, is_small)])
    others = np.flatnonzero(~np.array(is_small, np.bool_))
    if len(others):
        own = [own_box(distinct[k], check) for k in others.tolist()]
        boxes[others], reaches[others] = np.array([box[:2] for box in own]), [box[2] for box in own]
    radii = np.array([getattr(solid, "radius", 0.0) for solid in distinct])
    return OwnBoxes(boxes, reaches, radii)


def _is_small(solid: Solid) -> bool:
    """Return whether a solid is a polygon whose box is computed together with those of others, and not cached."""
    return type(solid) is Polygon and 0 < len(solid.vertices) <= _SMALL


def _place_bodies(
    solids: Sequence[Solid], poses: Sequence[Pose | None], distinct: Sequence[Solid], kinds: IntArray, own: OwnBoxes
) -> SceneBodies:
    """Return the bodies as arrays, with their boxes under their poses. kinds: index in `distinct` of each body's solid;
    own: unposed boxes of `distinct`."""
    n, dimension = len(kinds), own.boxes.shape[2]
    try:
        rotations, translations = motions_of([None, *poses], dimension)
    except (AttributeError, TypeError, ValueError):  # one is no pose, or of another dimension
        for index, pose in enumerate(poses):
            posed(pose, solids[index], "poses", index)
        raise
    is_posed = np.frombuffer(bytes([pose is not None for pose in poses]), np.bool_)  # of a list it takes as long again
    pose_rows = np.where(is_posed, np.arange(1, n + 1), -1)
    low, high = np.empty((n, dimension)), np.empty((n, dimension))
    entry_of(place_boxes)(*own, kinds, pose_rows, rotations, translations, low, high)
    return SceneBodies(solids, poses, distinct, kinds, is_posed, rotations, translations, low, high, own)


def check_collidable(bodies: Sequence[Solid]) -> tuple[list[Solid], IntArray]:
    """Return the distinct solids, and by body the index of its solid among them. Raises unless `collide` accepts every
    solid and all have one dimension."""
    distinct, kinds = distinct_of(bodies)
    of_kind: dict[tuple[str, int], Solid] = {}
    for body in distinct:
        of_kind.setdefault((body.type, body.dimension), body)
    for body in of_kind.values():
        try:
            pair_function(body, body)
        except UnsupportedPairError:
            index = _first(body, bodies)
            raise UnsupportedPairError(
                f"solids[{index}] is {named(body.type)}; a scene in {body.dimension}D takes {TAKEN[body.dimension]}"
                f"{instead_of(body)}",
                ("solids", index),
            ) from None
        except (UnsupportedSolidError, WrongDimensionError) as error:
            error.where = ("solids", _first(body, bodies))
            raise
        if body.dimension != distinct[0].dimension:
            index = _first(body, bodies)
            raise WrongDimensionError(
                f"solids[{index}] is {body.dimension}D, solids[0] {distinct[0].dimension}D; a scene has one dimension",
                ("solids", index),
            )
    return distinct, kinds


def _first(solid: Solid, bodies: Sequence[Solid]) -> int:
    """Return the index of the first body with a given solid."""
    return next(index for index, body in enumerate(bodies) if body is solid)


def distinct_of(bodies: Sequence[Solid]) -> tuple[list[Solid], IntArray]:
    """Return the distinct solids, in order of first appearance, and the index of each body's solid."""
    distinct = list({id(body): body for body in bodies}.values())
    numbers = {id(solid): number for number, solid in enumerate(distinct)}
    return distinct, np.fromiter((numbers[id(body)] for body in bodies), np.int64, len(bodies))
