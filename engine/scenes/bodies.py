"""The bodies of a scene, under poses that stay, and what is prepared of them, each thing when it is asked for first."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from engine.collision.scenes.batches import SceneBatches
from engine.collision.scenes.bodies import check_collidable, scene_bodies
from engine.containment.scene.first_pass import SECOND_PASS
from engine.containment.scene.tables import Scene as LocateTables
from engine.containment.scene.tables import scene_of
from engine.parallel import Budget
from engine.scenes.broad_phase import BodyTree, body_tree
from engine.scenes.clip import Placed, check_cut
from engine.scenes.posed import PosedBody, posed_body
from engine.solids.base import Solid
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose

T = TypeVar("T")
_WAIT = 0.005
"""Seconds between two looks at the clock of a caller that waits for another thread's build."""


class Bodies:
    """Checked solids with a pose or None each; safe to share between threads."""

    def __init__(self, solids: tuple[Solid, ...], poses: tuple[Pose | None, ...]) -> None:
        self.solids, self.poses = solids, poses
        self.kept: dict[str, Any] = {}
        self._lock = threading.RLock()

    def tree(self, budget: Budget) -> BodyTree:
        """Return the tree over the boxes of the bodies, at least one."""
        dimension = self.solids[0].dimension
        return self._prepared("tree", lambda: body_tree(self.solids, self.poses, dimension, budget), budget)

    def tables(self, dimension: int, budget: Budget) -> LocateTables:
        """Return what points are located in; made anew where cells have been built that its first pass lacks."""
        found: LocateTables | None = self.kept.get("tables")
        if found is not None and self.kept.get("asked_often") and _has_new_cells(found):
            self.kept.pop("tables", None)
            self.kept.pop("asked_often", None)
        return self._prepared("tables", lambda: scene_of(self.solids, self.poses, dimension, budget), budget)

    def batches(self, budget: Budget) -> SceneBatches:
        """Return what pairs are related by. Raises: as `collide_scene` where it does not take a body."""
        return self._prepared(
            "batches", lambda: SceneBatches(scene_bodies(list(self.solids), list(self.poses))), budget
        )

    def placed(self, body: int) -> Placed:
        """Return a body as segments are cut on it; what that wants of a posed one is kept."""
        solid, pose = self.solids[body], self.poses[body]
        if pose is None or pose.is_identity:
            return Placed(solid, None, lambda: None)
        known = self.kept.setdefault("posed", {})

        def posed() -> PosedBody | None:
            if body not in known:
                known[body] = posed_body(solid, pose)
            found: PosedBody | None = known[body]
            return found

        return Placed(solid, pose, posed)

    def check_collidable(self, budget: Budget) -> None:
        """Raise unless `collide_scene` takes every body."""
        self._prepared("collidable", lambda: check_collidable(self.solids), budget)

    def check_cut(self, budget: Budget) -> None:
        """Raise unless segments are cut on every body."""
        self._prepared("cut", lambda: check_cut(self.solids), budget)

    def _prepared(self, key: str, build: Callable[[], T], budget: Budget) -> T:
        """Return what is kept under `key`; who asks first builds it, others wait for that."""
        found: T | None = self.kept.get(key)
        if found is not None:
            return found
        while not self._lock.acquire(timeout=_WAIT):  # bound: the build ends, or check raises
            budget.check()
        try:
            found = self.kept.get(key)
            if found is None:
                found = self.kept[key] = build()
            return found
        finally:
            self._lock.release()


def _has_new_cells(tables: LocateTables) -> bool:
    """Tell whether polyhedra that the first pass leaves to the second have cells by now."""
    kinds = np.full(len(tables.solids), SECOND_PASS, np.int8)
    kinds[tables.owners] = tables.tables.kinds
    left = [tables.solids[index] for index in np.flatnonzero(kinds == SECOND_PASS).tolist()]
    return any(isinstance(solid, Polyhedron) and solid.kept("top_cells") is not None for solid in left)
