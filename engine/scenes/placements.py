"""Placements of the bodies of a scene: prepared together, except for a few moved since; pairs of selected bodies.

Kernels take both: of n bodies, unmoved ones are numbered by index, moved ones from n on.
"""

from __future__ import annotations

import threading
from collections import namedtuple
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from engine.collision.exact_images import image_in_doubles
from engine.compiling.jit import entry_of, inline, kernel
from engine.containment.locators import Locator
from engine.running.budget import UNLIMITED, Budget
from engine.scenes.bodies import NO_BODIES, NOBODY, Bodies, body_tree, words_of
from engine.scenes.location_tables import LocateTables, concatenated
from engine.scenes.near_boxes import PLACED, Where, bodies_in, place_in, scratch_at, scratch_for
from engine.scenes.table import unready
from engine.solids.base import Preparing, Solid
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.pose import Pose
from engine.types import FlagArray, FloatArray, Int8Array, IntArray

_FEW: Final = 64
_PART: Final = 4
"""Up to `_FEW` moved bodies, or 1 / `_PART` of the scene, are stored apart from the others; more become the scene's
own."""
_LISTED: Final = 128
"""Most moved bodies whose boxes are tested one by one, which is as fast as building a tree."""
_PAID_BY_SEGMENT: Final = 256
"""Vertices of which an image, and the tree over it, cost as much as exact arithmetic on a segment."""
_NO_IMAGE: Final = ()
_NO_WORDS: Final = [0] * (PLACED + 1)


class Placements(Preparing):
    """The bodies of a scene as first placed, and those moved since; safe to share between threads, as `Bodies` are."""

    __slots__ = ("_lock", "_placed", "_prepared", "_words", "base", "moved", "names")

    def __init__(self, base: Bodies, moved: dict[int, Pose | None]) -> None:
        self.base, self.moved = base, moved
        self.names = np.array(list(moved), np.int64) if moved else NOBODY
        """Those that moved, ascending."""
        self._lock, self._prepared = threading.RLock(), dict[str, Any]()
        self._placed: tuple[Where, FloatArray, FloatArray] | None = None
        self._words: tuple[IntArray, Any] | None = None

    @property
    def poses(self) -> tuple[Pose | None, ...]:
        """The pose of each body."""
        poses = list(self.base.poses)
        for body, pose in self.moved.items():
            poses[body] = pose
        return tuple(poses)

    @property
    def all_cached(self) -> list[Any]:
        """The structures cached so far, to count their memory."""
        others = (self.cached("few"), self.cached("whole"))
        return [
            self.base._prepared,
            self._prepared,
            self._placed,
            *(each._prepared for each in others if each is not None),
        ]

    def after(self, poses: Mapping[int, Pose | None]) -> Placements:
        """Return the placements after the bodies of `poses`, in ascending order, were moved."""
        given = dict(sorted({**self.moved, **poses}.items())) if self.moved else dict(poses)
        if len(given) <= max(_FEW, len(self.base.solids) // _PART):
            return Placements(self.base, given)
        everywhere = list(self.base.poses)
        for body, pose in given.items():
            everywhere[body] = pose
        return Placements(Bodies(self.base.solids, tuple(everywhere)), {})

    @property
    def n_rows(self) -> int:
        """Number of bodies as kernels count them: the n of the scene, and the moved ones again."""
        return len(self.base.solids) + len(self.names)

    def whole(self) -> Bodies:
        """Return all bodies under their current poses."""
        return self.prepared("whole", lambda: Bodies(self.base.solids, self.poses)) if self.moved else self.base

    def few(self) -> Bodies:
        """Return the moved bodies under their current poses; caller guarantees that there is one."""
        solids, poses = tuple(self.base.solids[body] for body in self.moved), tuple(self.moved.values())
        owners = self.base.arrays(UNLIMITED).kinds[self.names]
        return self.prepared("few", lambda: Bodies(solids, poses, self.base, owners))

    def pose(self, body: int) -> Pose | None:
        """Return the current pose of a body."""
        return self.moved[body] if body in self.moved else self.base.poses[body]

    def placed(self, body: int) -> tuple[Solid, Pose | None]:
        """Return a body's solid and its current pose, None for the identity."""
        pose = self.pose(body)
        return self.base.solids[body], None if pose is None or pose.is_identity else pose

    def placed_exactly(self, body: int, n: int, budget: Budget) -> tuple[Solid, Pose | None]:
        """Return a body's solid and its current pose, for n segments that kernels leave open; if so many pay for it,
        and it is one (`image_in_doubles`), the solid's image and None."""
        solid, pose = self.placed(body)
        if pose is None or not isinstance(solid, Polyhedron | Polygon):
            return solid, pose
        owner, key = (self if body in self.moved else self.base), f"image {body}"
        image = owner.cached(key)
        if image is None and n * _PAID_BY_SEGMENT >= len(solid.vertices):
            image = owner.prepared(key, lambda: image_in_doubles(solid, pose) or _NO_IMAGE, budget.check)
        return (solid, pose) if image is None or image is _NO_IMAGE else (image, None)

    def names_of(self, bodies: IntArray) -> IntArray:
        """Return the scene's indices for body numbers of kernels, which number moved bodies from n on."""
        n = len(self.base.solids)
        if not self.moved or not len(bodies):
            return bodies
        return np.where(bodies < n, bodies, self.names.take(bodies - n, mode="clip"))

    def where(self, budget: Budget) -> Where:
        """Return the positions of all bodies, as input of kernels."""
        return (self._placed or self.placed_numbers(budget))[0]

    def placed_numbers(self, budget: Budget) -> tuple[Where, FloatArray, FloatArray]:
        """Return the positions of all bodies, and the rotations (m, d, d) and translations (m, d) of the m moved ones,
        the identity for None."""
        if self._placed is None:  # who comes second makes the same
            tree, names = self.base.tree(budget), self.names
            if self.moved:
                turns, moves, low, high = self.base.under(names, list(self.moved.values()), budget)
                self._placed = Where(tree, body_tree(low, high, _LISTED), names), turns, moves
            else:
                d = tree.low.shape[1]
                self._placed = Where(tree, NO_BODIES[d], names), np.empty((0, d, d)), np.empty((0, d))
        return self._placed

    def words(self, budget: Budget) -> IntArray:
        """Return two rows of integers from which segment kernels read the bodies as first placed, and the moved ones
        (`words_of`)."""
        if self._words is None:
            together, moved, arrays = self.base.words(budget), _NO_WORDS, ()
            if self.moved:
                moved, arrays = words_of(self.where(budget).moved, self.names, unready(len(self.names)))
            made = np.array([together[0], moved]), (together[1], arrays)  # and what its addresses are of
            with self._lock:
                self._words = self._words or made
        return self._words[0]

    def prepare(self, body: int, wanted: int, budget: Budget) -> None:
        """Build the kernel input `wanted` (WANTS_BODY, WANTS_TREE) for one body, given by the kernels' number."""
        n = len(self.base.solids)
        if body < n:
            self.base.prepare(body, wanted, budget)
        else:
            few = self.few()
            few.prepare(body - n, wanted, budget)
            self.words(budget)[1, PLACED] = few.table(budget).rows.ctypes.data

    def boxes(self, budget: Budget) -> FloatArray:
        """Return the boxes (n, 2, dim) of all bodies under their current poses."""
        where = self.where(budget)
        boxes = np.stack([where.together.low, where.together.high], axis=1)
        boxes[self.names, 0], boxes[self.names, 1] = where.moved.low, where.moved.high
        return boxes

    def pairs_with(self, named: IntArray, reach: float, boolean: bool, budget: Budget) -> tuple[IntArray, Int8Array]:
        """Return the keys first * n + second, unsorted, of the pairs of a named body and another whose boxes, enlarged
        by `reach`, meet; and their relations by the batch of convex bodies, else UNSETTLED. boolean: only whether they
        meet matters. Raises: as `collide_scene` for an unsupported body."""
        batches, (where, *moves), room = self.base.batches(budget), self.placed_numbers(budget), 16 + 6 * len(named)
        arrays, d = batches.bodies, batches.bodies.dimension
        still, moved = Placed(arrays.kinds, arrays.rotations, arrays.translations), Placed(arrays.kinds, *moves)
        scratch, box = scratch_for(self.n_rows), np.empty((2, d))
        while True:  # bound: the second turn has room
            n_rows = 2 * room + 1
            placed = np.empty((n_rows, d, d)), np.empty((n_rows, d))
            rows = PairRows(np.empty(room, np.int64), np.empty(n_rows, np.int64), *placed)
            n = entry_of(list_pairs)(named, reach, where, still, moved, rows, scratch, box, budget.flag)
            budget.check()
            if n <= room:
                return rows.keys[:n], batches.related(*rows[1:], n, boolean, budget)
            room = n

    def locator(self, body: int) -> Locator:
        """Return the point locator of a body under its current pose."""
        if body not in self.moved:
            return self.base.locator(body)
        return self.few().locator(int(np.searchsorted(self.names, body)))

    def tables(self, budget: Budget) -> LocateTables:
        """Return the location tables of all bodies, then of the moved ones."""
        if not self.moved:
            return self.base.tables(budget)
        few = self.few()
        return self.prepared("tables", lambda: concatenated(self.base.tables(budget), few.tables(budget)), budget.check)

    def rows_of(self, bodies: IntArray) -> IntArray:
        """Return the kernels' numbers of bodies, moved ones from n on: the inverse of `names_of`."""
        rows = np.arange(len(self.base.solids))
        rows[self.names] = len(rows) + np.arange(len(self.names))
        return rows[bodies]

    def has_new_trees(self, solids: list[Polyhedron]) -> bool:
        """Return whether cached location tables lack a tree or cells of some solids, cached by now; then these tables
        are dropped."""
        known: set[int] = self.base.prepared("trees", lambda: set())
        new = {2 * id(solid) + (solid.cached("sides") is not None) for solid in solids} - known
        if new:
            known |= new
            for bodies in (self.base, self.cached("few"), self):
                if bodies is not None:
                    bodies.drop("tables", "solid_tables")
        return bool(new)


Placed = namedtuple("Placed", "kinds rotations translations")
"""Placements of n bodies: kinds (n,) their solids, rotations (n + 1, d, d) and translations (n + 1, d), row 0 the
identity."""
PairRows = namedtuple("PairRows", "keys kinds rotations translations")
"""Pairs of bodies. keys (room,): first * n + second. kinds, rotations, translations (2 room + 1, ...): their bodies,
those of pair i in rows 2 i + 1 and 2 i + 2; row 0 is the identity."""


@inline
def _put_row(rows: PairRows, row: int, still: Placed, moved: Placed, body: int, name: int) -> None:
    """Fill row ``row`` of rows with the solid and the current pose of a body. body: its number in kernels, name: its
    index in the scene; still, moved: `Placed` of the bodies as first placed and of those moved since."""
    n = still.kinds.size
    rows.kinds[row] = still.kinds[name]
    for i in range(rows.translations.shape[1]):
        step = still.translations[body + 1, i] if body < n else moved.translations[body - n, i]
        rows.translations[row, i] = step
        for j in range(rows.translations.shape[1]):
            turn = still.rotations[body + 1, i, j] if body < n else moved.rotations[body - n, i, j]
            rows.rotations[row, i, j] = turn


@kernel
def list_pairs(
    named: IntArray, reach: float, where: Where, still: Placed, moved: Placed, rows: PairRows, room: IntArray,
    box: FloatArray, flag: FlagArray,
) -> int:  # fmt: skip
    """Fill `rows` with the pairs of a named body and another whose boxes, enlarged by `reach`, intersect, each once,
    unsorted. Returns their number, which may exceed the room. named: ascending. still, moved: `Placed` of the n bodies
    as first placed and of those moved since, without row 0. room: work space of `scratch_for`; box (2, dim): scratch.
    """
    n, n_pairs, scratch = still.kinds.size, 0, scratch_at(room)
    rows.kinds[0] = 0
    for i in range(box.shape[1]):
        rows.translations[0, i] = 0.0
        for j in range(box.shape[1]):
            rows.rotations[0, i, j] = still.rotations[0, i, j]
    for name in named:
        place = place_in(where.names, name)
        body = name if place < 0 else n + place
        for i in range(box.shape[1]):
            box[0, i] = where.together.low[name, i] if place < 0 else where.moved.low[place, i]
            box[1, i] = where.together.high[name, i] if place < 0 else where.moved.high[place, i]
            if reach != 0.0:
                box[0, i], box[1, i] = _outward(box[0, i], reach, 0), _outward(box[1, i], reach, 1)
        for i in range(bodies_in(box[0], box[1], where, scratch.inner.stack, scratch.near)):
            near = scratch.near[i]
            other = near if near < n else where.names[near - n]
            if other == name or (other < name and place_in(named, other) >= 0):
                continue
            if n_pairs < rows.keys.size:
                rows.keys[n_pairs] = min(name, other) * n + max(name, other)
                row = 2 * n_pairs + 1
                _put_row(rows, row + (other < name), still, moved, body, name)
                _put_row(rows, row + (name < other), still, moved, near, other)
            n_pairs += 1
        if flag[0]:
            break
    return n_pairs


@inline
def _outward(value: float, reach: float, side: int) -> float:
    """Return `value`, a coordinate of the low (side 0) or high (side 1) corner of a box, moved outward by `reach`,
    stretched as a pose may stretch it. R'R = I + E with |E_ij| <= 1e-12: |R v|^2 <= (1 + 3e-12) |v|^2, so |R v| < 1.001
    |v|; `nextafter` covers the rounding.
    """
    far = 1.001 * reach
    return np.nextafter(value - far, -np.inf) if side == 0 else np.nextafter(value + far, np.inf)
