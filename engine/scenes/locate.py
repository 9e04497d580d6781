"""Point location in a scene: which bodies contain each of many points.

A tree over the boxes of the bodies selects the candidates of a point, and the tables of the bodies (location_tables.py)
decide most of them in the kernel. Small batches, and what the tables leave open, are located body by body as `locate`
does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar, Final, Literal

import numpy as np

from engine.compiling.jit import entry_of, kernel
from engine.containment.cells.build import MOST_FACES, sides_if_profitable
from engine.containment.locate import locate_small_batch
from engine.containment.locators import Counts
from engine.containment.methods.filters import in_space
from engine.containment.methods.rational_locate import is_located
from engine.containment.prepared import tree_of
from engine.running.budget import Budget
from engine.running.joining import join_columns
from engine.running.parallel import Progress, run_chunks
from engine.scenes.location_tables import LocateTables, locate_in_body
from engine.scenes.near_boxes import Where, bodies_in, scratch_at, scratch_for
from engine.scenes.placements import Placements
from engine.solids.checks import check_finite
from engine.solids.mesh import Polyhedron
from engine.solids.ragged import Ragged, parts_of_runs
from engine.solids.registry import BodyKind, row_of
from engine.types import UNDECIDED, Accuracy, BoolArray, FlagArray, FloatArray, Int8Array, IntArray, read_only

_BYTES: Final = 72
"""Memory counted for a candidate: its key, twice; its point, body and location."""
_MOST_SORTED: Final = 32
"""Most candidates of a point whose keys are sorted by insertion."""
_FEW_POINTS, _FEW_BODIES, _FEW_VERTICES = 32, 16, 1000
"""Limits of a small batch in points, in bodies, and in vertices of a body; it is located body by body, without tables.
"""
_MOST_IN_GROUP: Final = 1 << 14
"""Most points located in one body in one task."""
_FEWEST_FOR_TREES: Final = 64
"""Smallest number of points for which a polyhedron's tree is built."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SceneLocations(Ragged):
    """The bodies that contain each point: those of point i are ``indices[offsets[i]:offsets[i + 1]]``, ascending.

    Attributes
    ----------
    offsets : ndarray of int64, shape (n_points + 1,)
        Into the other two.
    indices : ndarray of int64, shape (n,)
        Positions in the list of solids.
    on_boundary : ndarray of bool, shape (n,)
        True where the point is on the body's boundary, False where it is inside.
    """

    _levels: ClassVar[tuple[str, ...]] = ("indices", "offsets")
    _not_rows: ClassVar[tuple[str, ...]] = ("indices", "on_boundary")
    _rows: ClassVar[str] = "points"
    offsets: IntArray
    indices: IntArray
    on_boundary: BoolArray

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def _by_row(self) -> dict[str, Any]:
        """Return the columns of a table with a row for each point and body that contains it."""
        points = np.repeat(np.arange(len(self)), np.diff(self.offsets))
        return {"point": points, "body": self.indices, "on_boundary": self.on_boundary}

    def __iter__(self) -> Iterator[IntArray]:
        """Yield the bodies that contain each point, ascending."""
        return (self.indices[start:stop] for start, stop in pairwise(self.offsets.tolist()))

    def __getitem__(self, point: int) -> IntArray:
        """Return the bodies that contain one point, ascending."""
        if not -len(self) <= point < len(self):
            raise IndexError(f"there are {len(self)} points, got number {point}")
        start, stop = self.offsets[point : point + 2] if point >= 0 else self.offsets[len(self) + point :][:2]
        return self.indices[start:stop]


@kernel
def locate_near(
    points: FloatArray, first: int, last: int, where: Where, tables: LocateTables, room: IntArray, keys: IntArray,
    query_counts: IntArray, flag: FlagArray,
) -> Any:  # fmt: skip
    """Write the bodies that contain points first .. last - 1 of (n, dim), or may, as keys, until there is no more room.

    keys (room,): 4 (point n_bodies + body) + location, ascending; UNDECIDED is possible. query_counts (n_meshes,):
    raised by the number of points for which each mesh is a candidate. room: work space of `scratch_for`. Returns the
    point reached, the number of keys, the number of locations that took more than a filter, and whether the keys
    ascend.
    """
    scratch, n, is_flat, is_sorted = scratch_at(room), where.together.low.shape[0], points.shape[1] == 2, True
    n_keys, n_beyond, done = 0, 0, first
    for item in range(first, last):
        if flag[0]:
            break
        n_near = bodies_in(points[item], points[item], where, scratch.inner.stack, scratch.near)
        if n_keys + n_near > keys.size:
            break
        p, before = in_space(points, item), n_keys
        for place in range(n_near):
            body = scratch.near[place]
            location, is_beyond = locate_in_body(tables, body, is_flat, p, scratch.inner.stack, flag)
            n_beyond += is_beyond
            if tables.kinds[body] == BodyKind.MESH:
                query_counts[tables.slots[body]] += 1
            if location == -1:
                continue
            key, put = 4 * (item * n + (body if body < n else where.names[body - n])) + location, n_keys
            if n_keys - before > _MOST_SORTED:
                is_sorted &= keys[put - 1] < key
            else:
                while put > before and keys[put - 1] > key:
                    keys[put] = keys[put - 1]
                    put -= 1
            keys[put] = key
            n_keys += 1
        done = item + 1
    return done, n_keys, n_beyond, is_sorted


@kernel
def locate_pairs(
    points: FloatArray, owners: IntArray, bodies: IntArray, tables: LocateTables, room: IntArray, located: Int8Array,
    flag: FlagArray,
) -> None:  # fmt: skip
    """Fill located (n,) int8 with the locations of pairs of point owners[i] and body bodies[i]; UNDECIDED if the tables
    do not decide. room: work space of `scratch_for`."""
    scratch, is_flat = scratch_at(room), points.shape[1] == 2
    for pair in range(owners.size):
        if flag[0]:
            break
        p = in_space(points, owners[pair])
        located[pair], _ = locate_in_body(tables, bodies[pair], is_flat, p, scratch.inner.stack, flag)


@kernel
def split_keys(
    keys: IntArray, start: int, n_bodies: int, located: Int8Array, bodies: IntArray, n_hits: IntArray
) -> None:
    """Split the keys of `locate_near` of points from ``start`` on: located, bodies by key, n_hits (zeros) by point."""
    for k in range(keys.size):
        pair = keys[k] >> 2
        located[k], bodies[k] = keys[k] & 3, pair % n_bodies
        n_hits[pair // n_bodies - start] += 1


_NO_KEYS: Final = np.zeros(0, np.int8), np.zeros(0, np.int64)
"""The columns of `split_keys` by key, without keys."""


def locate_all(
    points: FloatArray, scene: Placements, budget: Budget, workers: int | None, progress: Progress | None
) -> tuple[SceneLocations, Accuracy]:
    """Return the bodies that contain each of some points, and the accuracy report. Raises: as `check_finite`."""
    budget.check()
    n, n_bodies, parts = len(points), len(scene.base.solids), dict[int, tuple[Any, ...]]()
    if n <= _FEW_POINTS or not n_bodies:
        check_finite(points, ("points",))
    if not n_bodies:
        none = SceneLocations(np.zeros(n + 1, np.int64), np.zeros(0, np.int64), np.zeros(0, np.bool_))
        return none, Accuracy("exact", None, n, 0, 0, "box_grid")
    points, beyond, query_counts, has_new = read_only(points), [0], list[IntArray](), False
    if 0 < n <= _FEW_POINTS and n_bodies <= _FEW_BODIES and not scene.base.cached("can_locate"):
        if all(len(getattr(solid, "vertices", ())) <= _FEW_VERTICES for solid in scene.base.solids):
            return _locate_small_batch(points, scene, budget, progress)
    where, tables = scene.where(budget), scene.tables(budget)
    offsets = np.zeros(n + 1, np.int64)

    def task(start: int, stop: int) -> None:
        if not np.isfinite(points[start:stop]).all():
            check_finite(points, ("points",))
        done, size, blocks = start, 2 * (stop - start) + scene.n_rows, list[IntArray]()
        scratch, counted = scratch_for(scene.n_rows), np.zeros(len(tables.sizes), np.int64)
        while done < stop:  # bound: each turn locates a point, for all candidates of one have room
            keys = np.empty(size, np.int64)
            done, n_keys, n_beyond, is_sorted = entry_of(locate_near)(
                points, done, stop, where, tables, scratch, keys, counted, budget.flag
            )
            budget.check()
            budget.take(_BYTES * n_keys)
            blocks.append(keys[:n_keys] if is_sorted else np.sort(keys[:n_keys]))
            beyond.append(n_beyond)
        keys = blocks[0] if len(blocks) == 1 else np.concatenate(blocks)
        columns, n_hits = (
            (np.empty(len(keys), np.int8), np.empty(len(keys), np.int64)),
            np.zeros(stop - start, np.int64),
        )
        entry_of(split_keys)(keys, start, n_bodies, *columns, n_hits)
        np.cumsum(n_hits, out=offsets[start + 1 : stop + 1])
        parts[start] = columns
        query_counts.append(counted)

    run_chunks(task, n, budget=budget, workers=workers, progress=progress)
    starts = sorted(parts)
    located, bodies = join_columns([_NO_KEYS, *(parts[start] for start in starts)], budget, workers)
    for start, stop in zip(starts[1:], [*starts[2:], n]):
        offsets[start + 1 : stop + 1] += offsets[start]
    if query_counts and len(tables.sizes):
        has_new = _build_trees(scene, np.sum(query_counts, axis=0), budget, workers)
    left = np.flatnonzero(located == UNDECIDED)
    counts, is_exact = Counts(0, 0), scene.base.is_exact
    if len(left):
        owners = np.repeat(np.arange(n), np.diff(offsets))
        located[left], counts = _locate_exactly(points, owners[left], bodies[left], scene, has_new, budget, workers)
        is_hit = located >= 0
        located, bodies = located[is_hit], bodies[is_hit]
        np.cumsum(np.bincount(owners[is_hit], minlength=n), out=offsets[1:])
    decisions: Literal["exact", "float64"] = "exact" if is_exact else "float64"
    n_beyond = min(n, sum(beyond) + counts.beyond)
    accuracy = Accuracy(decisions, None, n, n_beyond, min(n, counts.rational), "box_grid")
    return SceneLocations(offsets, bodies, located == 0), accuracy


def _locate_small_batch(
    points: FloatArray, scene: Placements, budget: Budget, progress: Progress | None
) -> tuple[SceneLocations, Accuracy]:
    """Return the bodies that contain each of a few points, and the accuracy report; body by body, without a tree over
    bodies."""
    n, located, counts = len(points), np.empty((len(scene.base.solids), len(points)), np.int8), [0, 0]
    scene.base.check_located(budget)
    for body in range(len(located)):
        solid, pose = scene.placed(body)
        answer = locate_small_batch(points, solid) if pose is None else None
        if answer is None:
            more = scene.locator(body).chosen(n, budget).fill(points, located[body], budget)
        else:
            located[body], more = answer[0], Counts(*answer[1:3])
        counts = [min(n, counts[0] + more.beyond), min(n, counts[1] + more.rational)]
    owners, bodies = np.nonzero(located.T >= 0)
    if progress is not None:
        progress(n)
    accuracy = Accuracy("exact" if scene.base.is_exact else "float64", None, n, counts[0], counts[1], "box_grid")
    offsets = np.searchsorted(owners, np.arange(n + 1))
    return SceneLocations(offsets, bodies, located[bodies, owners] == 0), accuracy


def _locate_exactly(
    points: FloatArray, owners: IntArray, bodies: IntArray, scene: Placements, has_new: bool, budget: Budget,
    workers: int | None,
) -> tuple[Int8Array, Counts]:  # fmt: skip
    """Return the locations of pairs of point owners[i] and body bodies[i], by each body's own locator, and how many
    points were beyond the filter and decided in rationals. has_new: a tree was built since the kernel ran, so the
    kernel runs again first."""
    locations, order = np.full(len(owners), UNDECIDED, np.int8), np.argsort(bodies, kind="stable")
    if has_new:
        tables, names, scratch = scene.tables(budget), scene.rows_of(bodies), scratch_for(scene.n_rows)
        entry_of(locate_pairs)(
            points, owners[order], names[order], tables, scratch, again := locations[order], budget.flag
        )
        budget.check()
        locations[order] = again
        order = order[again == UNDECIDED]
    groups, counts, locators = parts_of_runs(bodies[order], _MOST_IN_GROUP), [], []
    for begin, end in groups:  # order: the choice depends on what a solid was asked before: it is not left to threads
        budget.check()
        locators.append(scene.locator(int(bodies[order[begin]])).chosen(end - begin, budget))

    def task(first: int, last: int) -> None:
        for (begin, end), locator in zip(groups[first:last], locators[first:last]):
            places = order[begin:end]
            located = np.empty(end - begin, np.int8)
            counts.append(locator.fill(points[owners[places]], located, budget))
            locations[places] = located

    run_chunks(task, len(groups), budget=budget, first_chunk=1, workers=workers)
    return locations, Counts(sum(each.beyond for each in counts), sum(each.rational for each in counts))


def locate_given(
    points: FloatArray, owners: IntArray, bodies: IntArray, scene: Placements, budget: Budget, workers: int | None
) -> Int8Array:
    """Return the locations of pairs of point owners[i] and body bodies[i], a solid with an inside."""
    are_many = len(owners) >= _FEWEST_FOR_TREES and all(is_located(row_of(solid)) for solid in scene.base.solids)
    if are_many:
        tables = scene.tables(budget)
        rows = scene.rows_of(bodies)
        slots = tables.slots[rows[tables.kinds[rows] == BodyKind.MESH]]
        _build_trees(scene, np.bincount(slots, minlength=len(tables.sizes)), budget, workers)
    return _locate_exactly(points, owners, bodies, scene, are_many, budget, workers)[0]


def _build_trees(scene: Placements, query_counts: IntArray, budget: Budget, workers: int | None) -> bool:
    """Build trees and cells of polyhedra queried often enough; return whether the scene's tables lack one of these.
    query_counts: by mesh the number of points for which it was a candidate."""
    chosen = list[tuple[Polyhedron, int]]()
    for solid, n_queries in zip(scene.base.solid_tables(budget).meshes, query_counts.tolist()):
        if n_queries and len(solid.triangles) <= MOST_FACES:
            if n_queries >= _FEWEST_FOR_TREES or solid.cached("tree") is not None:
                chosen.append((solid, n_queries))

    def build(start: int, stop: int) -> None:
        for solid, n_queries in chosen[start:stop]:
            tree_of(solid, budget.check)
            sides_if_profitable(solid, n_queries, budget)

    run_chunks(build, len(chosen), budget=budget, first_chunk=1, workers=workers)
    return bool(chosen) and scene.has_new_trees([solid for solid, _ in chosen])
