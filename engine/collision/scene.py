"""Public: every colliding pair of a scene of up to thousands of bodies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from engine.bounding.sweep import BLOCK, meeting_boxes
from engine.collision.collide import check_pose, collide_pair, pair_function
from engine.collision.result import Witness, Work
from engine.collision.world_box import world_box
from engine.errors import IndexOutOfRangeError, InvalidArrayError, UnsupportedSolidError, WrongDimensionError
from engine.parallel import Budget, Cancel, Progress, run_chunks
from engine.solids.base import IntArray, Solid
from engine.solids.pose import Pose
from engine.types import Accuracy, Relation

Relations = npt.NDArray[np.int8]


@dataclass(frozen=True, slots=True, eq=False)
class ScenePairs:
    """The colliding pairs of a scene, sorted by first, then second.

    first, second: ``(n_pairs,)`` int64, indices of bodies, first < second.
    relation: ``(n_pairs,)`` int8, `Relation` of the first to the second, never DISJOINT.
    witnesses: one a pair, where asked for; else None.
    """

    first: IntArray
    second: IntArray
    relation: npt.NDArray[np.int8]
    witnesses: tuple[Witness | None, ...] | None = None


def collide_scene(
    solids: Sequence[Solid],
    poses: Sequence[Pose | None] | None = None,
    *,
    skip: object = None,
    only: object = None,
    witnesses: bool = False,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> ScenePairs | tuple[ScenePairs, Accuracy]:
    """Find every pair of bodies with a common point, and how each lies to the other, exactly.

    Boxes around the posed bodies are swept for pairs that may meet; each of those is decided as by `collide`. One solid
    object may stand in the scene many times under different poses; its structures are built once.

    Parameters: solids: bodies of one dimension, of the types that `collide` takes. poses: one or None for each. skip:
    ``(n, 2)`` pairs of indices to leave out, in either order. only: ``(n, 2)`` the only pairs to look at. witnesses:
    give the witness of each pair too. workers, deadline, cancel, progress (items are candidate pairs), report: as
    everywhere.
    Returns: `ScenePairs`; with report=True a pair of it and an `Accuracy` whose items are the candidate pairs.
    Boundary and degenerate input: as `collide`. An empty scene has no pairs; two surfaces touch or are disjoint.
    Accuracy: exact. Cost: n log n for the sweep, then that of the pairs whose boxes meet.
    Raises: as `collide`, with the index of the body; IndexOutOfRangeError and InvalidArrayError for skip and only.

    >>> from engine import Aabb, Pose
    >>> cube = Aabb([0, 0, 0], [1, 1, 1])
    >>> step = Pose([[1, 0, 0], [0, 1, 0], [0, 0, 1]], [1, 0, 0])
    >>> pairs = collide_scene([cube, cube, Aabb([5, 5, 5], [6, 6, 6])], [None, step, None])
    >>> pairs.first.tolist(), pairs.second.tolist(), [Relation(code).label for code in pairs.relation]
    ([0], [1], ['touching'])
    """
    bodies, placed = _checked(solids, poses)
    with Budget(deadline, cancel) as budget:
        budget.check()
        skipped = None if skip is None else _keys(skip, len(bodies), "skip")
        wanted = None if only is None else _keys(only, len(bodies), "only")
        parts: list[tuple[IntArray, Relations, list[Witness | None]]] = []
        works: list[Work] = []
        n_candidates = 0
        for pairs in _candidates(bodies, placed, wanted, budget):
            budget.check()
            if skipped is not None:
                pairs = pairs[~np.isin(pairs[:, 0] * len(bodies) + pairs[:, 1], skipped)]
            n_candidates += len(pairs)
            relations = np.zeros(len(pairs), np.int8)
            found: list[Witness | None] = [None] * len(pairs) if witnesses else []

            def task(
                start: int,
                stop: int,
                pairs: IntArray = pairs,
                relations: Relations = relations,
                found: list[Witness | None] = found,
            ) -> None:
                work = Work(budget, witness=witnesses)
                works.append(work)
                for item in range(start, stop):
                    budget.check()
                    i, j = pairs[item].tolist()
                    answer = collide_pair(bodies[i], bodies[j], placed[i], placed[j], work)
                    relations[item] = answer.relation
                    if witnesses:
                        found[item] = answer.witness

            run_chunks(task, len(pairs), budget=budget, first_chunk=4, workers=workers, progress=progress)
            kept = np.flatnonzero(relations != Relation.DISJOINT)
            parts.append((pairs[kept], relations[kept], [found[item] for item in kept.tolist()] if witnesses else []))
        budget.check()
    result = _joined(parts, witnesses)
    if not report:
        return result
    beyond, rational = sum(work.n_beyond_filter for work in works), sum(work.n_rational for work in works)
    return result, Accuracy("exact", None, n_candidates, beyond, rational, "sweep" if only is None else "named pairs")


def _joined(parts: list[tuple[IntArray, Relations, list[Witness | None]]], witnesses: bool) -> ScenePairs:
    """Return the colliding pairs of all blocks as one."""
    pairs = np.concatenate([np.empty((0, 2), np.int64), *(part[0] for part in parts)])
    relations = np.concatenate([np.empty(0, np.int8), *(part[1] for part in parts)])
    named = tuple(witness for part in parts for witness in part[2]) if witnesses else None
    return ScenePairs(pairs[:, 0].copy(), pairs[:, 1].copy(), relations, named)


def _checked(solids: Sequence[Solid], poses: Sequence[Pose | None] | None) -> tuple[list[Solid], list[Pose | None]]:
    """Return bodies and poses as lists of one length; raise with the index of the body that is wrong."""
    for name, given in (("solids", solids), ("poses", () if poses is None else poses)):
        if not isinstance(given, (list, tuple)):
            raise InvalidArrayError(f"{name} must be a list, got {type(given).__name__}", (name,))
    bodies = list(solids)
    placed: list[Pose | None] = [None] * len(bodies) if poses is None else list(poses)
    if len(placed) != len(bodies):
        raise InvalidArrayError(f"poses must be as many as solids, {len(bodies)}, got {len(placed)}", ("poses",))
    for index, (body, pose) in enumerate(zip(bodies, placed)):
        try:
            pair_function(body, body)
        except (UnsupportedSolidError, WrongDimensionError) as error:
            error.where = ("solids", index)
            raise
        check_pose(pose, body, f"poses[{index}]")
        if body.dimension != bodies[0].dimension:
            raise WrongDimensionError(
                f"solids[{index}] is {body.dimension}D, solids[0] {bodies[0].dimension}D; a scene has one dimension",
                ("solids", index),
            )
    return bodies, placed


def _candidates(
    bodies: list[Solid], placed: list[Pose | None], wanted: IntArray | None, budget: Budget
) -> Iterator[IntArray]:
    """Yield the pairs whose boxes meet, of those wanted (keys first * n + second), in blocks, sorted."""
    if len(bodies) < 2 or (wanted is not None and not len(wanted)):
        return
    low = np.empty((len(bodies), bodies[0].dimension))
    high = np.empty_like(low)
    for index, (body, pose) in enumerate(zip(bodies, placed)):
        if index % 256 == 0:
            budget.check()
        low[index], high[index] = world_box(body, pose)
    if wanted is None:
        yield from meeting_boxes(low, high, budget.flag)
        return
    pairs = np.stack(np.divmod(np.unique(wanted), len(bodies)), axis=1)
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    for start in range(0, len(pairs), BLOCK):
        first, second = pairs[start : start + BLOCK].T
        meet = ((low[first] <= high[second]) & (low[second] <= high[first])).all(axis=1)
        yield pairs[start : start + BLOCK][meet]


def _keys(named: Any, n_bodies: int, name: str) -> IntArray:
    try:
        array = np.asarray(named)
    except ValueError:
        raise InvalidArrayError(
            f"{name} must be pairs of indices (n, 2), got rows of several lengths", (name,)
        ) from None
    if array.size == 0:
        return np.empty(0, np.int64)
    if array.ndim != 2 or array.shape[1] != 2 or array.dtype.kind not in "iu":
        raise InvalidArrayError(f"{name} must be pairs of indices (n, 2), got shape {array.shape}", (name,))
    wrong = np.flatnonzero(((array < 0) | (array >= n_bodies)).any(axis=1))
    if len(wrong):
        row = int(wrong[0])
        raise IndexOutOfRangeError(
            f"{name}[{row}] = {array[row].tolist()} names a body that is not there; the scene has {n_bodies}",
            (name, row),
        )
    array = np.sort(array.astype(np.int64), axis=1)
    keys: IntArray = array[:, 0] * n_bodies + array[:, 1]
    return keys
