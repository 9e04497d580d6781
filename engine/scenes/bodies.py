"""The bodies of a scene, under poses that stay, and what is prepared of them, each thing when it is asked for first."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.bounding.aabb import place_boxes
from engine.budget import Budget
from engine.collision.scenes.batches import SceneBatches
from engine.collision.scenes.bodies import SceneBodies, bodies_of, check_collidable, distinct_of
from engine.containment.locators import Locator
from engine.containment.posed.locators import posed_locator
from engine.containment.scene.first_pass import SECOND_PASS
from engine.containment.scene.grid import body_box
from engine.containment.scene.tables import Scene as LocateTables
from engine.containment.scene.tables import scene_of
from engine.direct import entry_of
from engine.scenes.broad_phase import NOBODY, body_tree, words_of
from engine.scenes.near_boxes import BodyTree
from engine.scenes.table import Table
from engine.segment_clipping.profiles import check_cut
from engine.solids.base import Preparing, Solid
from engine.solids.csg import Csg
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose, motions_of
from engine.solids.triangle import Triangle

_LISTED: Final = 4
"""Bodies that have no tree: their boxes are looked at sooner than one is built."""


class Bodies(Preparing):
    """Checked solids with a pose or None each; safe to share between threads.

    whole: bodies that these are some of, which share what does not depend on poses.
    """

    def __init__(self, solids: tuple[Solid, ...], poses: tuple[Pose | None, ...], whole: Bodies | None = None) -> None:
        self.solids, self.poses, self._whole = solids, poses, whole
        self._prepared: dict[str, Any] = {}
        self._lock = threading.RLock()

    def arrays(self, budget: Budget) -> SceneBodies:
        """Return the bodies as arrays, at least one."""
        return self.prepared("arrays", lambda: self._as_arrays(budget), budget.check)

    def _as_arrays(self, budget: Budget) -> SceneBodies:
        distinct, kinds, _ = distinct_of(self.solids)
        return bodies_of(self.solids, self.poses, distinct, kinds, budget.check)

    def tree(self, budget: Budget) -> BodyTree:
        """Return the tree over the boxes of the bodies, at least one."""
        return self.prepared("tree", lambda: self._as_tree(budget), budget.check)

    def _as_tree(self, budget: Budget) -> BodyTree:
        arrays = self.arrays(budget)
        boxes = arrays.low.copy(), arrays.high.copy()
        self._place_odd(np.arange(len(arrays.kinds)), self.poses, *boxes, budget)
        return body_tree(*boxes, _LISTED)

    def _place_odd(self, names: IntArray, poses: Sequence[Pose | None], low: Any, high: Any, budget: Budget) -> None:
        """Set the boxes of each csg and prism among some, whose own are no boxes of theirs."""
        arrays, kinds = self.arrays(budget), (Csg, Triangle) if self.solids[0].dimension == 3 else Csg
        odd = self.prepared("odd", lambda: [k for k, solid in enumerate(arrays.distinct) if isinstance(solid, kinds)])
        for place in np.flatnonzero(np.isin(arrays.kinds[names], odd)).tolist() if odd else ():
            budget.check()
            low[place], high[place] = body_box(self.solids[names[place]], poses[place], budget.check)

    def under(
        self, names: IntArray, poses: Sequence[Pose | None], budget: Budget
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return rotations (m, d, d) and translations of some bodies under other poses, and boxes, low and high."""
        arrays, m, d = self.arrays(budget), len(names), self.solids[0].dimension
        turns, moves = motions_of(poses, d)
        low, high, rows = np.empty((m, d)), np.empty((m, d)), np.arange(m)
        if type(None) in map(type, poses):
            rows[[pose is None for pose in poses]] = -1
        entry_of(place_boxes)(*arrays.own, arrays.kinds[names], rows, turns, moves, low, high)
        self._place_odd(names, poses, low, high, budget)
        return turns, moves, low, high

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

        def build() -> SceneBatches:
            check_collidable(self.solids)
            return SceneBatches(self.arrays(budget))

        return self.prepared("batches", build, budget.check)

    def table(self, budget: Budget) -> Table:
        """Return what kernels for segments read of the bodies."""
        like = None if self._whole is None else self._whole.table(budget)
        return self.prepared("table", lambda: Table(self.solids, self.poses, like), budget.check)

    def words(self, budget: Budget) -> tuple[list[int], Any]:
        """Return what kernels for segments read of all bodies (`words_of`)."""
        return self.prepared(
            "words", lambda: words_of(self.tree(budget), NOBODY, self.table(budget).rows), budget.check
        )

    def prepare(self, body: int, wanted: int, budget: Budget) -> None:
        """Make ready what these kernels want of a body."""
        table = self.table(budget)
        with self._lock:
            table.prepare(body, wanted)

    def check_cut(self, budget: Budget) -> None:
        """Raise unless segments are cut on every body."""
        self.prepared("cut", lambda: check_cut(self.solids), budget.check)


def _has_new_cells(tables: LocateTables) -> bool:
    """Tell whether polyhedra that the first pass leaves to the second have cells by now."""
    kinds = np.full(len(tables.solids), SECOND_PASS, np.int8)
    kinds[tables.owners] = tables.tables.kinds
    left = [tables.solids[index] for index in np.flatnonzero(kinds == SECOND_PASS).tolist()]
    return any(isinstance(solid, Polyhedron) and solid.kept("top_cells") is not None for solid in left)
