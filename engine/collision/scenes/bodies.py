"""The bodies of a scene as arrays: which solid, where, and a box around each. No work per body beyond a few lookups."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.bounding.aabb import place_boxes
from engine.collision.collide import TAKEN, check_pose, pair_function
from engine.direct import entry_of
from engine.errors import InvalidArrayError, UnsupportedPairError, UnsupportedSolidError, WrongDimensionError
from engine.solids.base import Solid
from engine.solids.pose import Pose, motions_of
from engine.solids.registry import own_box


@dataclass(frozen=True, slots=True, eq=False)
class SceneBodies:
    """A checked scene.

    solids, poses: one a body. distinct: each solid object once; kinds: (n,) which of these a body is. is_posed: (n,).
    rotations (n + 1, d, d), translations (n + 1, d): row 0 the identity, then one row a body. low, high: (n, d) boxes
    around the posed bodies, exact where there is no pose and the solid is a box. own: those of the distinct solids.
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
        """2 or 3."""
        return self.translations.shape[1]

    def under(self, names: IntArray, poses: Sequence[Pose | None]) -> SceneBodies:
        """Return some bodies under poses that fit them; the distinct solids are those of all."""
        solids = [self.solids[body] for body in names.tolist()]
        return _placed(solids, poses, self.distinct, self.kinds[names], self.own)


class OwnBoxes(NamedTuple):
    """The boxes of distinct solids where they are, as `place_boxes` takes them."""

    boxes: FloatArray
    reaches: FloatArray
    radii: FloatArray


def scene_bodies(solids: Sequence[Solid], poses: Sequence[Pose | None] | None) -> SceneBodies:
    """Return the bodies as arrays; raise with the index of the body that is wrong."""
    for name, each in (("solids", solids), ("poses", () if poses is None else poses)):
        if not isinstance(each, (list, tuple)):
            raise InvalidArrayError(f"{name} must be a list, got {type(each).__name__}", (name,))
    bodies = list(solids)
    given: list[Pose | None] = [None] * len(bodies) if poses is None else list(poses)
    if len(given) != len(bodies):
        raise InvalidArrayError(f"poses must be as many as solids, {len(bodies)}, got {len(given)}", ("poses",))
    return bodies_of(bodies, given, *check_collidable(bodies))


def bodies_of(
    solids: Sequence[Solid], poses: Sequence[Pose | None], distinct: list[Solid], kinds: IntArray,
    check: Callable[[], object] | None = None,
) -> SceneBodies:  # fmt: skip
    """Return bodies of any type as arrays; check: as for `Solid.prepared`."""
    own = [own_box(solid, check) for solid in distinct]
    boxes = np.array([box[:2] for box in own]).reshape(-1, 2, distinct[0].dimension if distinct else 3)
    radii = np.array([getattr(solid, "radius", 0.0) for solid in distinct])
    return _placed(solids, poses, distinct, kinds, OwnBoxes(boxes, np.array([box[2] for box in own]), radii))


def _placed(
    solids: Sequence[Solid], poses: Sequence[Pose | None], distinct: Sequence[Solid], kinds: IntArray, own: OwnBoxes
) -> SceneBodies:
    """Return bodies where their poses put them."""
    n, dimension = len(kinds), own.boxes.shape[2]
    try:
        rotations, translations = motions_of([None, *poses], dimension)
    except (AttributeError, TypeError, ValueError):  # one is no pose, or of another dimension
        for index, pose in enumerate(poses):
            check_pose(pose, solids[index], f"poses[{index}]")
        raise
    is_posed = np.frombuffer(bytes([pose is not None for pose in poses]), np.bool_)  # of a list it takes as long again
    pose_rows = np.where(is_posed, np.arange(1, n + 1), -1)
    low, high = np.empty((n, dimension)), np.empty((n, dimension))
    entry_of(place_boxes)(*own, kinds, pose_rows, rotations, translations, low, high)
    return SceneBodies(solids, poses, distinct, kinds, is_posed, rotations, translations, low, high, own)


def check_collidable(bodies: Sequence[Solid]) -> tuple[list[Solid], IntArray]:
    """Return each solid once and which of them each body is; raise unless every solid is one that `collide` takes, all
    of one dimension."""
    distinct, kinds = distinct_of(bodies)
    for body in distinct:
        try:
            pair_function(body, body)
        except UnsupportedPairError:
            index = _first(body, bodies)
            raise UnsupportedPairError(
                f"solids[{index}] is a {body.type}; a scene in {body.dimension}D takes {TAKEN[body.dimension]}",
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
    return next(index for index, body in enumerate(bodies) if body is solid)


def distinct_of(bodies: Sequence[Solid]) -> tuple[list[Solid], IntArray]:
    """Return each solid once, in the order in which they first appear, and which of them each body is."""
    distinct = list({id(body): body for body in bodies}.values())
    numbers = {id(solid): number for number, solid in enumerate(distinct)}
    return distinct, np.fromiter((numbers[id(body)] for body in bodies), np.int64, len(bodies))
