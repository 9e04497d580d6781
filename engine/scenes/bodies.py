"""Bodies of a scene under fixed poses, and their prepared structures, each built on first use.

A tree over their boxes selects the bodies that a segment, or another body, may meet. Boxes are rounded outward
(`place_boxes`), so no body is missed; bodies without bounds are listed apart and always selected.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from math import isfinite
from typing import Any, Final

import numpy as np

from engine.bounding.aabb import place_boxes
from engine.bounding.bvh import UNUSED, WIDTH, Bvh
from engine.bounding.trees import build_bvh
from engine.collision.batches import SceneBatches, SceneBodies, bodies_of, check_collidable, distinct_of
from engine.collision.collide import posed
from engine.compiling.jit import entry_of
from engine.containment.locators import Locator, locator_of
from engine.containment.methods.filters import frames_of
from engine.containment.methods.rational_locate import Check, fold_csg_tree, is_located
from engine.containment.posed_locators import posed_locator
from engine.errors import EngineError, InvalidArrayError, WrongDimensionError
from engine.lanes.boxes import BOX_ROWS, EMPTY
from engine.running.budget import Budget, polled
from engine.running.parallel import run_chunks
from engine.scenes.location_tables import LocateTables, Tables, moved_boxes
from engine.scenes.near_boxes import BodyTree, put_keys
from engine.scenes.table import Table
from engine.segment_clipping.profiles import check_cut
from engine.solids.base import Preparing, Solid
from engine.solids.csg import Csg
from engine.solids.implicit import Implicit
from engine.solids.pose import Pose, motions_of
from engine.solids.poses import Poses
from engine.solids.primitives import Sphere
from engine.solids.registry import own_box, row_of
from engine.solids.shapes import as_solid
from engine.types import FloatArray, IntArray, read_only

_LISTED: Final = 4
"""Largest number of bodies without a tree: testing all boxes is faster than building one."""


class Bodies(Preparing):
    """Checked solids with a pose or None each, and their cached structures; safe to share between threads. whole: the
    bodies of which these are a subset, with which they share what does not depend on poses. owners: by body the number
    of its solid among the distinct ones of ``whole``."""

    def __init__(
        self, solids: tuple[Solid, ...], poses: tuple[Pose | None, ...], whole: Bodies | None = None, owners: Any = None
    ) -> None:
        self.solids, self.poses, self._whole, self._owners = solids, poses, whole, owners
        self._prepared: dict[str, Any] = {}
        self._lock = threading.RLock()

    def arrays(self, budget: Budget) -> SceneBodies:
        """Return the bodies as flat arrays; caller guarantees at least one body."""

        def build() -> SceneBodies:
            return bodies_of(self.solids, self.poses, *distinct_of(self.solids), budget.check)

        return self.prepared("arrays", build, budget.check)

    def tree(self, budget: Budget) -> BodyTree:
        """Return the tree over the boxes of the bodies; caller guarantees at least one body."""

        def build() -> BodyTree:
            arrays = self.arrays(budget)
            boxes = arrays.low.copy(), arrays.high.copy()
            self._place_odd(np.arange(len(arrays.kinds)), self.poses, *boxes, budget)
            return body_tree(*boxes, _LISTED)

        return self.prepared("tree", build, budget.check)

    def _place_odd(
        self, names: IntArray, poses: Sequence[Pose | None], low: FloatArray, high: FloatArray, budget: Budget
    ) -> None:
        """Set the boxes low, high (m, d) of those of the m bodies ``names`` that are CSG trees, combined from their
        operands' boxes under the poses (m of them)."""
        arrays = self.arrays(budget)
        odd = self.prepared("odd", lambda: [k for k, solid in enumerate(arrays.distinct) if isinstance(solid, Csg)])
        for place in np.flatnonzero(np.isin(arrays.kinds[names], odd)).tolist() if odd else ():
            budget.check()
            low[place], high[place] = body_box(self.solids[names[place]], poses[place], budget.check)

    def under(
        self, names: IntArray, poses: Sequence[Pose | None], budget: Budget
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return rotations (m, d, d), translations (m, d), and low and high (m, d) of the boxes of the m bodies
        ``names``, all under other poses than their own."""
        arrays, m, d = self.arrays(budget), len(names), self.solids[0].dimension
        turns, moves = motions_of(poses, d)
        low, high, rows = np.empty((m, d)), np.empty((m, d)), np.arange(m)
        if type(None) in map(type, poses):
            rows[[pose is None for pose in poses]] = -1
        entry_of(place_boxes)(*arrays.own, arrays.kinds[names], rows, turns, moves, low, high)
        self._place_odd(names, poses, low, high, budget)
        return turns, moves, low, high

    def locator(self, body: int) -> Locator:
        """Return the point locator of a body under its pose."""

        def make() -> Locator:
            try:
                return posed_locator(self.solids[body], self.poses[body])
            except EngineError as error:
                error.where = ("solids", body)
                raise

        return self.prepared(f"locator {body}", make)

    def solid_tables(self, budget: Budget) -> Tables:
        """Return the location tables of the distinct solids. Raises: UnsupportedSolidError."""

        def build() -> Tables:
            arrays = self.arrays(budget)
            return Tables(arrays.distinct, arrays.kinds, self.poses, budget)

        return self.prepared("solid_tables", build, budget.check)

    def tables(self, budget: Budget) -> LocateTables:
        """Return the location tables of the bodies under their poses; caller guarantees at least one body."""
        kinds = (self._whole or self).solid_tables(budget)
        owners = self.arrays(budget).kinds if self._whole is None else self._owners
        return self.prepared("tables", lambda: kinds.placed(owners, self.poses), budget.check)

    def check_located(self, budget: Budget) -> None:
        """Raise unless points can be located in every body. Raises: UnsupportedSolidError."""

        def check() -> bool:
            for body, solid in enumerate(self.solids):
                if type(solid) is Csg or not is_located(row_of(solid)):  # a csg depends on its operands
                    budget.check()
                    self.locator(body)
            return True

        self.prepared("can_locate", check, budget.check)

    @property
    def is_exact(self) -> bool:
        """False if a caller's function decides whether a point lies in some body."""

        def find() -> bool:
            solids = {id(solid): solid for solid in self.solids if isinstance(solid, (Csg, Implicit))}.values()
            return all(locator_of(solid).decisions == "exact" for solid in solids)

        return self.prepared("is_exact", find)

    def batches(self, budget: Budget) -> SceneBatches:
        """Return the `SceneBatches` that relate pairs of bodies by kernels. Raises: as `collide_scene` for an
        unsupported body."""

        def build() -> SceneBatches:
            check_collidable(self.solids)
            return SceneBatches(self.arrays(budget))

        return self.prepared("batches", build, budget.check)

    def table(self, budget: Budget) -> Table:
        """Return the segment table of the bodies."""
        like = None if self._whole is None else self._whole.table(budget)
        return self.prepared("table", lambda: Table(self.solids, self.poses, like), budget.check)

    def words(self, budget: Budget) -> tuple[list[int], Any]:
        """Return the row of integers that encodes the `BodyTree` of all bodies for segment kernels (`words_of`), and
        the arrays whose addresses are in it, which must outlive it."""
        return self.prepared(
            "words", lambda: words_of(self.tree(budget), NOBODY, self.table(budget).rows), budget.check
        )

    def prepare(self, body: int, wanted: int, budget: Budget) -> None:
        """Build a kernel input for one body: its row of the segment table (wanted is WANTS_BODY) or its solid's
        location tree (WANTS_TREE)."""
        table = self.table(budget)
        with self._lock:
            table.prepare(body, wanted)

    def check_cut(self, budget: Budget) -> None:
        """Raise unless segments can be clipped to every body."""
        self.prepared("cut", lambda: check_cut(self.solids), budget.check)


def checked_bodies(solids: Any, poses: Any) -> tuple[tuple[Solid, ...], tuple[Pose | None, ...]]:
    """Return solids of one dimension and a pose or None for each; other shapes are read by `engine.solids.shapes`."""
    if not isinstance(solids, (list, tuple)):
        raise InvalidArrayError(f"solids must be a list of solids, got {type(solids).__name__}", ("solids",))
    solids = list(solids)
    for index, solid in enumerate(polled(solids)):
        if not isinstance(solid, Solid):
            solid = solids[index] = as_solid(solid, "solids", index)
        if solid.dimension != solids[0].dimension:
            raise WrongDimensionError(
                f"solids[{index}] is {solid.dimension}D, solids[0] {solids[0].dimension}D; use one dimension",
                ("solids", index),
            )
    solids = tuple(solids)
    if poses is None:
        return solids, (None,) * len(solids)
    poses = list(poses) if isinstance(poses, Poses) else poses
    if not isinstance(poses, (list, tuple)) or len(poses) != len(solids):
        given = f"{len(poses)}" if isinstance(poses, (list, tuple)) else type(poses).__name__
        raise InvalidArrayError(f"poses must be a list of {len(solids)}, one for each solid, got {given}", ("poses",))
    is_plain = not set(map(type, poses)) - {Pose, type(None)}
    if is_plain and all(each is None or len(each.translation) == solids[0].dimension for each in poses):
        return solids, tuple(poses)
    return solids, tuple(posed(each, solid, "poses", k) for k, (each, solid) in enumerate(zip(polled(poses), solids)))


def body_box(solid: Solid, pose: Pose | None, check: Check) -> tuple[FloatArray, FloatArray]:
    """Return low, high (dim,) of a box around a posed body, rounded outward; infinite if the body may be unbounded.
    check: as for `Solid.prepared`."""
    if isinstance(solid, Csg):
        box: tuple[FloatArray, FloatArray] = fold_csg_tree(solid, lambda leaf: body_box(leaf, pose, check), _csg_box)
        return box
    low, high, _ = own_box(solid, check)
    if np.isinf(low).any():
        return low, high
    frames = frames_of([pose], len(low))
    lows, highs = moved_boxes(low[None], high[None], frames, frames.rows)
    if isinstance(solid, Sphere):  # its box was that of its centre
        with np.errstate(over="ignore"):
            lows, highs = lows - solid.radius, highs + solid.radius
        lows, highs = (np.nextafter(np.nextafter(side, out), out) for side, out in ((lows, -np.inf), (highs, np.inf)))
    return lows[0], highs[0]


def _csg_box(operation: str, boxes: list[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """Return the box of a CSG operation from its operands' boxes; an empty intersection has an inverted box."""
    lows, highs = (np.array(sides) for sides in zip(*(boxes[:1] if operation == "difference" else boxes)))
    if operation == "union":
        return lows.min(axis=0), highs.max(axis=0)
    return lows.max(axis=0), highs.min(axis=0)


_MANY: Final = 4096
_BLOCK: Final = 1 << 15
"""Segments from which they are put in order; how many are ordered together."""
_AS_GIVEN: Final = read_only(np.arange(_MANY))


def body_tree(low: FloatArray, high: FloatArray, most_listed: int) -> BodyTree:
    """Return the tree over bodies with boxes low, high (n, dimension). If there are at most most_listed bodies, or all
    are so near each other that 1 / scale is not finite, they are listed, to be tested one by one, without a tree."""
    n, dimension = low.shape
    every = BodyTree(low, high, _NO_TREE, 1.0, NOBODY, np.arange(n))
    if n <= most_listed:
        return every
    is_bounded = (np.isfinite(low) & np.isfinite(high)).all(axis=1)
    bounded, listed = np.flatnonzero(is_bounded), np.flatnonzero(~is_bounded & (low <= high).all(axis=1))
    flat = np.zeros((len(bounded), 6))  # in the plane z is 0
    flat[:, :dimension], flat[:, 3 : 3 + dimension] = low[bounded], high[bounded]
    tree = build_bvh(flat) if len(bounded) else _NO_TREE
    inverse = 1.0 / tree.scale
    return BodyTree(low, high, tree, inverse, bounded, listed) if isfinite(inverse) else every


NOBODY: Final = np.empty(0, np.int64)
_NO_TREE: Final = Bvh(
    read_only(np.full((1, BOX_ROWS, WIDTH), UNUSED)),
    read_only(np.full((1, WIDTH), EMPTY, np.int32)),
    read_only(np.zeros(3)),
    1.0,
    np.zeros((2, 2), np.int64),
)
_NO_NUMBERS: Final = read_only(np.array([1.0, 0.0, 0.0, 0.0]))
_ADDRESSES: Final[dict[int, int]] = {
    id(array): array.__array_interface__["data"][0] for array in (NOBODY, _NO_TREE.boxes, _NO_TREE.child, _NO_NUMBERS)
}
"""Addresses of long-lived arrays, by id: reading an address from an array takes a microsecond."""
NO_BODIES: Final = {d: BodyTree(np.empty((0, d)), np.empty((0, d)), _NO_TREE, 1.0, NOBODY, NOBODY) for d in (2, 3)}


def words_of(bodies: BodyTree, names: IntArray, placed: IntArray) -> tuple[list[int], Any]:
    """Return the row of integers that encodes a `BodyTree` (columns of near_boxes.py), and the arrays whose addresses
    are in it. names: indices in the scene of moved bodies; placed: the rows of the bodies' `Table`."""
    tree = bodies.tree
    numbers = _NO_NUMBERS if tree is _NO_TREE else np.array([bodies.inverse, *tree.origin.tolist()])
    read = bodies.low, bodies.high, tree.boxes, tree.child, bodies.bounded, bodies.listed, numbers, names, placed
    low, high, boxes, child, bounded, listed, *more = (_ADDRESSES.get(id(array)) or _address(array) for array in read)
    return [len(bodies.low), low, high, len(tree.child), boxes, child, bounded, len(bodies.listed), listed, *more], read


def _address(array: Any) -> int:
    """Return the address of an array's data."""
    return int(array.__array_interface__["data"][0])


def order_of(segments: FloatArray, t: float, where: Any, budget: Budget, workers: int | None) -> IntArray:
    """Return an order of segments (n, 2, dim) in which neighbours in space, at parameter t, follow each other, for the
    cache, block by block; few stay as given. where: `Where` of the bodies."""
    n = len(segments)
    if n < _MANY:
        return _AS_GIVEN[:n]
    order = np.empty(n, np.int64)

    def task(first: int, last: int) -> None:
        for begin in range(first * _BLOCK, min(last * _BLOCK, n), _BLOCK):
            some = segments[begin : begin + _BLOCK]
            entry_of(put_keys)(some, t, where.together, keys := np.empty(len(some), np.uint16))
            np.add(np.argsort(keys, kind="stable"), begin, out=order[begin : begin + _BLOCK])

    run_chunks(task, -(-n // _BLOCK), budget=budget, workers=workers, first_chunk=1)
    return read_only(order)
