"""Where the bodies of a scene stand: as they were when they were last prepared together, but for a few that moved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray, read_only
from engine.containment.scene.locate_scene import SceneLocations
from engine.containment.scene.tables import Scene as Tables
from engine.parallel import Budget
from engine.scenes.bodies import Bodies
from engine.scenes.broad_phase import candidates
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
            self.few = Bodies(tuple(base.solids[body] for body in self.places), tuple(moved[b] for b in self.places))
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

    def boxes(self, bodies: IntArray, budget: Budget) -> FloatArray:
        """Return the boxes of bodies, one or more times each, where they are."""
        boxes = self.base.tree(budget).boxes[bodies]
        if self.few is not None:
            places = np.minimum(np.searchsorted(self.names, bodies), len(self.names) - 1)
            are_moved = self.names[places] == bodies
            boxes[are_moved] = self.few.tree(budget).boxes[places[are_moved]]
        return boxes

    def near(self, boxes: FloatArray, budget: Budget, workers: int | None) -> tuple[IntArray, IntArray]:
        """Return pairs of one of some boxes and a body that it may meet."""
        found = []
        for layer in self.layers:
            owners, bodies = candidates(layer.bodies.tree(budget), boxes, True, budget, workers)
            stays = slice(None) if not len(layer.is_away) else ~layer.is_away[bodies]
            found.append((owners[stays], bodies[stays] if layer.names is None else layer.names[bodies]))
        owners, bodies = (np.concatenate(each) for each in zip(*found))
        return owners, bodies

    def located(self, points: FloatArray, tables: Sequence[Tables], budget: Budget) -> tuple[SceneLocations, Accuracy]:
        """Return where a few points lie, body by body: for many `locate_in` is faster. tables: those of the layers."""
        n, beyond, rational, is_exact = len(points), 0, 0, True
        budget.check()
        owners, bodies = self.near(read_only(np.stack([points, points], axis=1)), budget, 1)
        order = np.lexsort((bodies, owners))
        owners, bodies, at = owners[order], bodies[order], np.empty(len(order), np.int8)
        for pair, (item, body) in enumerate(zip(owners.tolist(), bodies.tolist())):
            place = self.places.get(body)
            locator = tables[0].locator(body) if place is None else tables[1].locator(place)
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
