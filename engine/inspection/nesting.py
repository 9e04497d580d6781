"""Which shells of a mesh face the wrong way, as they are nested.

A shell is the faces that hang together by edges. Its signed volume should be positive within an even number of other
shells, negative within an odd number.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from engine.bounding.box_grid import all_pairs_of_boxes
from engine.collision.collide import collide
from engine.containment.locate import locate
from engine.errors import EngineError
from engine.running.budget import Budget
from engine.solid_cutting.faults import sign_of_volume
from engine.solids.mesh import Polyhedron
from engine.types import FloatArray, IntArray, Rcc8


class _Shell:
    """One shell: the triangles `part` of a mesh; `body` is it as a polyhedron, made at first use."""

    def __init__(self, points: FloatArray, faces: IntArray, part: IntArray) -> None:
        self.points, self.faces, self.part = points, faces[part], part
        self.vertices = np.unique(self.faces)
        self.low, self.high = (pick(points[self.vertices], axis=0) for pick in (np.min, np.max))
        self.is_odd = (self.faces == np.roll(self.faces, 1, axis=1)).any(axis=1)
        """Of triangles that name a vertex twice: they use each edge both ways."""
        self._body: Polyhedron | None = None

    def body(self, budget: Budget) -> Polyhedron:
        if self._body is None:
            faces = self.faces[~self.is_odd]
            self._body = Polyhedron(self.points, faces, deadline=budget.left(), cancel=budget.cancel)
        return self._body


def nesting(
    points: FloatArray, faces: IntArray, parts: list[IntArray], budget: Budget
) -> Iterator[tuple[IntArray, bool]]:
    """Yield each closed shell among `parts`, and whether it must be turned over: its signed volume should be positive
    within an even number of other shells, negative within an odd number. Shells may cross here."""
    closed = []
    for shell in (_Shell(points, faces, part) for part in parts):
        budget.check()
        try:
            closed += [shell] if not shell.is_odd.any() and shell.body(budget) else []
        except EngineError:
            budget.check()
    depths = [0] * len(closed)
    low, high = (np.array([getattr(shell, name) for shell in closed]).reshape(-1, 3) for name in ("low", "high"))
    for i, j in all_pairs_of_boxes(low, high, budget).tolist() if closed else ():
        for one, other in ((i, j), (j, i)):
            lies = _lies_within(closed[one], closed[other], budget)
            if lies == 0:  # all its corners are on the other's faces
                lies = _detail_of(closed[one], closed[other], budget) in (Rcc8.TPP, Rcc8.NTPP)
            depths[one] += lies > 0
    for shell, depth in zip(closed, depths):
        volume = sign_of_volume(points, shell.faces, budget)
        yield shell.part, volume != 0 and (volume > 0) is (depth % 2 == 1)


def _detail_of(one: _Shell, other: _Shell, budget: Budget) -> Rcc8 | None:
    limits: Any = {"deadline": budget.left(), "cancel": budget.cancel}
    return collide(one.body(budget), other.body(budget), detail=True, **limits).detail


def _lies_within(one: _Shell, other: _Shell, budget: Budget) -> int:
    """Return 1 if a shell that crosses no other lies within another, -1 if not, 0 if all its vertices are on that."""
    if (one.low < other.low).any() or (other.high < one.high).any():
        return -1
    points = one.points[one.vertices]
    for some in (points[:1], points):
        places = locate(some, other.body(budget), deadline=budget.left(), cancel=budget.cancel)
        if places.any():
            return int(places[np.argmax(places != 0)])
    return 0
