"""Where the bodies of a scene stand: as they were when they were last prepared together, but for a few that moved."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from engine.arrays import BoolArray, FloatArray, Int8Array, IntArray
from engine.containment.scene.locate_scene import SceneLocations
from engine.direct import entry_of
from engine.parallel import Budget
from engine.scenes.bodies import Bodies
from engine.scenes.broad_phase import candidates
from engine.scenes.moved_pairs import PairRows, Placed, list_pairs
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.types import Accuracy

_FEW: Final = 64
_PART: Final = 4
"""Bodies up to `_FEW`, or the scene's size divided by `_PART`, that moved are kept beside the others."""
_NONE: Final = np.zeros(0, np.bool_)


class Layer(NamedTuple):
    """Bodies that were prepared together."""

    bodies: Bodies
    names: IntArray | None
    """What they are called in the scene, None for their places."""
    is_away: BoolArray
    """(n,) of each whether it moved since, or (0,) where none did."""


class Standing:
    """Bodies, and those that moved since: safe to share between threads, as `Bodies` are."""

    __slots__ = ("_whole", "base", "few", "layers", "names", "places")

    def __init__(self, base: Bodies, moved: Mapping[int, Pose | None]) -> None:
        self.base = base
        self.places = {body: place for place, body in enumerate(sorted(moved))}
        """Which of `few` a body is, ascending."""
        self.names = np.array(list(self.places), np.int64)
        self.few: Bodies | None = None
        self._whole: Bodies | None = base
        self.layers = [Layer(base, None, _NONE)]
        if moved:
            solids, poses = zip(*((base.solids[body], moved[body]) for body in self.places))
            self.few = Bodies(solids, poses, base, self.names)
            self._whole = None
            is_away = np.zeros(len(base.solids), np.bool_)
            is_away[self.names] = True
            self.layers = [Layer(base, None, is_away), Layer(self.few, self.names, _NONE)]

    @property
    def poses(self) -> tuple[Pose | None, ...]:
        """The pose of each body."""
        poses = list(self.base.poses)
        for body in self.places:
            poses[body] = self.pose(body)
        return tuple(poses)

    @property
    def kept(self) -> list[Any]:
        """What is prepared."""
        all_of = {id(each): each for each in (self.base, self.few, self._whole) if each is not None}
        return [each._prepared for each in all_of.values()]

    def moved(self, poses: Mapping[int, Pose | None]) -> Standing:
        """Return where bodies stand after some, which are there, moved."""
        given = {body: self.pose(body) for body in self.places} | dict(poses)
        if len(given) <= max(_FEW, len(self.base.solids) // _PART):
            return Standing(self.base, given)
        everywhere = list(self.base.poses)
        for body, pose in given.items():
            everywhere[body] = pose
        return Standing(Bodies(self.base.solids, tuple(everywhere)), {})

    def whole(self) -> Bodies:
        """Return all bodies where they are."""
        if self._whole is None:
            self._whole = Bodies(self.base.solids, self.poses)
        return self._whole

    def pose(self, body: int) -> Pose | None:
        """Return the pose of a body."""
        place = self.places.get(body)
        return self.base.poses[body] if place is None or self.few is None else self.few.poses[place]

    def placed(self, body: int) -> tuple[Solid, Pose | None]:
        """Return a body's solid, and its pose unless that leaves it where it is."""
        place = self.places.get(body)
        return self.base.placed(body) if place is None or self.few is None else self.few.placed(place)

    def boxes(self, budget: Budget) -> FloatArray:
        """Return the boxes of all bodies where they are."""
        boxes = self.base.tree(budget).boxes
        if self.few is not None:
            boxes = boxes.copy()
            boxes[self.names] = self.few.tree(budget).boxes
        return boxes

    def layers_near(self, segments: FloatArray, budget: Budget) -> list[Layer]:
        """Return the layers that segments (n, 2, dim) may meet: where few, and away from what moved, the first."""
        if self.few is None or not 0 < len(segments) <= _FEW:
            return self.layers
        boxes = self.few.tree(budget).boxes
        meet = (boxes[:, 0] <= segments.max(axis=(0, 1))) & (boxes[:, 1] >= segments.min(axis=(0, 1)))
        return self.layers[: 1 + bool(meet.all(axis=1).any())]

    def pairs_with(self, named: IntArray, reach: float, boolean: bool, budget: Budget) -> tuple[IntArray, Int8Array]:
        """Return the pairs of a body named and another whose boxes, grown by `reach`, meet, by first * n + second and
        in no order, and how the batch of convex bodies relates them, UNSETTLED where it does not.

        Raises: as `collide_scene` where it does not take a body.
        """
        batches, tree, room = self.base.batches(budget), self.base.tree(budget), 16 + 6 * len(named)
        bodies, few = batches.bodies, self.base if self.few is None else self.few
        arrays_of = (each.arrays(budget) for each in (self.base, few))
        still, moved = (Placed(each.kinds, each.rotations, each.translations) for each in arrays_of)
        while True:  # bound: the second turn has room
            d, n_rows = bodies.dimension, 2 * room + 1
            arrays = np.empty((n_rows, d, d)), np.empty((n_rows, d))
            rows = PairRows(np.empty(room, np.int64), np.empty(n_rows, np.int64), *arrays)
            n = int(
                entry_of(list_pairs)(
                    named,
                    reach,
                    tree,
                    self.layers[0].is_away,
                    few.tree(budget),
                    self.names,
                    still,
                    moved,
                    rows,
                    budget.flag,
                )
            )
            budget.check()
            if n <= room:
                return rows.keys[:n], batches.related(rows.kinds, rows.rotations, rows.translations, n, boolean, budget)
            room = n

    def near(self, points: FloatArray, budget: Budget) -> tuple[IntArray, IntArray]:
        """Return pairs of one of some points and a body that it may meet."""
        ends = np.stack([points, points], axis=1)
        owners, bodies = candidates(self.base.tree(budget), ends, budget, 1)
        if self.few is None:
            return owners, bodies
        stays = ~self.layers[0].is_away[bodies]
        more, places = candidates(self.few.tree(budget), ends, budget, 1)
        return np.concatenate([owners[stays], more]), np.concatenate([bodies[stays], self.names[places]])

    def located(self, points: FloatArray, budget: Budget) -> tuple[SceneLocations, Accuracy]:
        """Return where a few points lie, body by body: for many `locate_in` is faster."""
        n, beyond, rational, is_exact = len(points), 0, 0, True
        budget.check()
        owners, bodies = self.near(points, budget)
        order = np.lexsort((bodies, owners))
        owners, bodies, at = owners[order], bodies[order], np.empty(len(order), np.int8)
        for pair, (item, body) in enumerate(zip(owners.tolist(), bodies.tolist())):
            place = self.places.get(body)
            locator = self.base.locator(body) if place is None or self.few is None else self.few.locator(place)
            counts = locator.chosen(1, budget).fill(points[item : item + 1], at[pair : pair + 1], budget)
            beyond, rational = beyond + counts.beyond, rational + counts.rational
            is_exact &= locator.decisions == "exact"
        held = at >= 0
        offsets = np.zeros(n + 1, np.int64)
        np.cumsum(np.bincount(owners[held], minlength=n), out=offsets[1:])
        decisions: Literal["exact", "float64"] = "exact" if is_exact else "float64"
        accuracy = Accuracy(decisions, None, n, min(n, beyond), min(n, rational), "box_grid")
        return SceneLocations(offsets, bodies[held], at[held] == 0), accuracy

    def merged(self, found: SceneLocations, more: SceneLocations) -> SceneLocations:
        """Return where points lie among all bodies, from where they lie among those of `base` and of `few`."""
        stay, n = ~self.layers[0].is_away[found.indices], len(found.offsets) - 1
        owners = np.repeat(np.arange(n), np.diff(found.offsets))[stay]
        owners = np.concatenate([owners, np.repeat(np.arange(n), np.diff(more.offsets))])
        bodies = np.concatenate([found.indices[stay], self.names[more.indices]])
        order = np.lexsort((bodies, owners))
        on_boundary = np.concatenate([found.on_boundary[stay], more.on_boundary])[order]
        offsets = np.zeros(n + 1, np.int64)
        np.cumsum(np.bincount(owners, minlength=n), out=offsets[1:])
        return SceneLocations(offsets, bodies[order], on_boundary)
