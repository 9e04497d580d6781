"""The bodies of a scene, under poses that stay, and what is prepared of them, each thing when it is asked for first."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np

from engine.arrays import IntArray
from engine.collision.scenes.batches import SceneBatches
from engine.collision.scenes.bodies import SceneBodies, bodies_of, check_collidable, distinct_of
from engine.containment.locators import Locator
from engine.containment.posed.locators import posed_locator
from engine.containment.scene.first_pass import SECOND_PASS
from engine.containment.scene.tables import Scene as LocateTables
from engine.containment.scene.tables import scene_of
from engine.parallel import Budget
from engine.scenes.broad_phase import BodyTree, body_tree
from engine.scenes.table import Table
from engine.segment_clipping.profiles import check_cut
from engine.solids.base import Preparing, Solid
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose


class Bodies(Preparing):
    """Checked solids with a pose or None each; safe to share between threads.

    whole, names: bodies that these are some of, which share what does not depend on poses.
    """

    def __init__(
        self,
        solids: tuple[Solid, ...],
        poses: tuple[Pose | None, ...],
        whole: Bodies | None = None,
        names: IntArray | None = None,
    ) -> None:
        self.solids, self.poses = solids, poses
        self._whole, self._names = whole, names
        self._prepared: dict[str, Any] = {}
        self._lock = threading.RLock()

    def arrays(self, budget: Budget) -> SceneBodies:
        """Return the bodies as arrays, at least one."""
        return self.prepared("arrays", lambda: self._as_arrays(budget), budget.check)

    def _as_arrays(self, budget: Budget) -> SceneBodies:
        if self._whole is not None and self._names is not None:
            return self._whole.arrays(budget).under(self._names, self.poses)
        distinct, kinds, _ = distinct_of(self.solids)
        return bodies_of(self.solids, self.poses, distinct, kinds, budget.check)

    def tree(self, budget: Budget) -> BodyTree:
        """Return the tree over the boxes of the bodies, at least one."""
        return self.prepared("tree", lambda: body_tree(self.arrays(budget), budget), budget.check)

    def locator(self, body: int) -> Locator:
        """Return how points are located in a body."""
        return self.prepared(f"locator {body}", lambda: posed_locator(self.solids[body], self.poses[body]))

    def tables(self, dimension: int, budget: Budget) -> LocateTables:
        """Return what points are located in; made anew where cells have been built that its first pass lacks."""
        found: LocateTables | None = self.kept("tables")
        if found is not None and self.kept("asked_often") and _has_new_cells(found):
            self.drop("tables", "asked_often")
        return self.prepared("tables", lambda: scene_of(self.solids, self.poses, dimension, budget), budget.check)

    def batches(self, budget: Budget) -> SceneBatches:
        """Return what pairs are related by. Raises: as `collide_scene` where it does not take a body."""
        return self.prepared("batches", lambda: self._as_batches(budget), budget.check)

    def _as_batches(self, budget: Budget) -> SceneBatches:
        check_collidable(self.solids)
        return SceneBatches(self.arrays(budget))

    def table(self, budget: Budget) -> Table:
        """Return what kernels for segments read of the bodies."""
        like = None if self._whole is None else self._whole.table(budget)
        return self.prepared("table", lambda: Table(self.solids, self.poses, like), budget.check)

    def prepare(self, body: int, wanted: int, budget: Budget) -> None:
        """Make ready what these kernels want of a body."""
        table = self.table(budget)
        with self._lock:
            table.prepare(body, wanted)

    def placed(self, body: int) -> tuple[Solid, Pose | None]:
        """Return a body's solid, and its pose unless that leaves it where it is."""
        pose = self.poses[body]
        return self.solids[body], None if pose is None or pose.is_identity else pose

    def check_cut(self, budget: Budget) -> None:
        """Raise unless segments are cut on every body."""
        self.prepared("cut", lambda: check_cut(self.solids), budget.check)


def _has_new_cells(tables: LocateTables) -> bool:
    """Tell whether polyhedra that the first pass leaves to the second have cells by now."""
    kinds = np.full(len(tables.solids), SECOND_PASS, np.int8)
    kinds[tables.owners] = tables.tables.kinds
    left = [tables.solids[index] for index in np.flatnonzero(kinds == SECOND_PASS).tolist()]
    return any(isinstance(solid, Polyhedron) and solid.kept("top_cells") is not None for solid in left)
