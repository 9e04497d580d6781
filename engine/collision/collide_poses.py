"""Public: one pair of solids under many rigid poses of the second."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from engine.arrays import FloatArray, Int8Array, read_only
from engine.collision.codes import UNSETTLED
from engine.collision.collide import collide_pair, pair_function
from engine.collision.detail import NO_DETAIL, check_has_detail, code_of, detail_of, details_where_proven, has_interior
from engine.collision.meshes.dual_traversal import new_descent
from engine.collision.meshes.mesh_arrays import shell_of
from engine.collision.meshes.mesh_mesh import mesh_mesh
from engine.collision.meshes.mesh_pair import what_to_seek
from engine.collision.meshes.placement import PoseArrays
from engine.collision.meshes.pose_batch import relate_poses
from engine.collision.result import Witness, Work
from engine.collision.scenes.batches import convex_poses
from engine.errors import InvalidArrayError, WrongDimensionError
from engine.parallel import Budget, Cancel, Progress, run_chunks
from engine.solids.base import Solid
from engine.solids.checks import as_floats
from engine.solids.pose import Pose, check_rotations
from engine.types import Accuracy, Relation

_ROOM = 64
Witnesses = list[Witness | None]
PoseCollisions = (
    Int8Array | tuple[Int8Array, Witnesses] | tuple[Int8Array, Int8Array] | tuple[Int8Array, Witnesses, Int8Array]
)


def collide_poses(
    first: Solid,
    second: Solid,
    rotations: object,
    translations: object,
    *,
    witnesses: bool = False,
    boolean: bool = False,
    detail: bool = False,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> PoseCollisions | tuple[PoseCollisions, Accuracy]:
    """Decide how `first` lies to `second` moved by each of many poses, exactly.

    The structures of both solids are built once; most poses are decided in compiled code, in parallel chunks. Time is
    discrete: two poses may be free while a motion between them collides.

    Parameters: first, second: as for `collide`. rotations ``(n_poses, d, d)`` and translations ``(n_poses, d)``:
    vertices map exactly to R p + t. witnesses: return the witness of every pose too. boolean: disjoint or not is all
    that is wanted; any other relation may then be answered as touching. workers, deadline, cancel, progress (items
    are poses), report: as everywhere.
    Returns: ``(n_poses,) int8`` relations (`Relation`); with `witnesses` a pair of that and a list, None where
    disjoint. Boundary, degenerate input, accuracy: as `collide`. Empty arrays give an empty answer.
    Cost: per pose the pairs of faces near each other; a chunk of poses takes about 2 ms.
    Raises: as `collide`; NotRigidError, NotFiniteError, InvalidArrayError name the pose.

    >>> from engine import Aabb
    >>> box = Aabb([0, 0, 0], [1, 1, 1])
    >>> turns = np.broadcast_to(np.eye(3), (3, 3, 3))
    >>> collide_poses(box, box, turns, [[0.5, 0, 0], [1, 0, 0], [2, 0, 0]]).tolist()
    [3, 4, 0]
    """
    function, _ = pair_function(first, second)
    if detail:
        check_has_detail(((("first",), first), (("second",), second)), boolean)
    turns, moves = as_poses(rotations, translations, first.dimension)
    n_poses = len(turns)
    relations = np.full(n_poses, UNSETTLED, np.int8)
    found: Witnesses = [None] * n_poses
    details = np.full(n_poses, NO_DETAIL, np.int8)
    with Budget(deadline, cancel) as budget:
        budget.check()
        has_detail = detail and has_interior(first, budget) and has_interior(second, budget)
        works: list[Work] = []

        def one_by_one(start: int, stop: int) -> None:
            work = Work(budget, witness=witnesses, boolean=boolean)
            works.append(work)
            is_open = relations[start:stop] == UNSETTLED
            if has_detail:
                details[start:stop] = np.where(is_open, NO_DETAIL, details_where_proven(relations[start:stop]))
            if witnesses:
                is_open |= relations[start:stop] != Relation.DISJOINT
            for item in (start + np.flatnonzero(is_open)).tolist():
                budget.check()
                pose = Pose(turns[item], moves[item])
                answer = collide_pair(first, second, None, pose, work)
                relations[item], found[item] = answer.relation, answer.witness
                if has_detail and details[item] == NO_DETAIL:
                    details[item] = code_of(detail_of(first, second, None, pose, answer.relation, work))

        task = one_by_one
        if function is mesh_mesh:
            batch = convex_poses(first, second, turns, moves, relations, budget, boolean)
            if batch is None:
                batch = _mesh_task(first, second, turns, moves, relations, budget, boolean)

            def task(start: int, stop: int) -> None:
                batch(start, stop)
                one_by_one(start, stop)

        run_chunks(task, n_poses, budget=budget, first_chunk=8, workers=workers, progress=progress)
    result: PoseCollisions = relations
    if detail:
        result = (relations, found, details) if witnesses else (relations, details)
    elif witnesses:
        result = (relations, found)
    if not report:
        return result
    method = "+".join(sorted({first.type, second.type}))
    beyond, rational = sum(work.n_beyond_filter for work in works), sum(work.n_rational for work in works)
    return result, Accuracy("exact", None, n_poses, beyond, rational, method)


def as_poses(rotations: object, translations: object, dimension: int) -> tuple[FloatArray, FloatArray]:
    """Return checked rotations (n, d, d) and translations (n, d)."""
    turns = np.ascontiguousarray(as_floats(rotations, 3, ("rotations",)))
    moves = np.ascontiguousarray(as_floats(translations, 2, ("translations",)))
    if len(turns) and turns.shape[1:] != (dimension, dimension):
        raise WrongDimensionError(
            f"rotations must have shape (n, {dimension}, {dimension}), got {turns.shape}", ("rotations",)
        )
    if len(moves) and moves.shape[1] != dimension:
        raise WrongDimensionError(
            f"translations must have shape (n, {dimension}), got {moves.shape}", ("translations",)
        )
    if len(turns) != len(moves):
        raise InvalidArrayError(
            f"rotations and translations must be equally many, got {len(turns)} and {len(moves)}", ("translations",)
        )
    if len(turns):
        check_rotations(turns)
    return turns, moves


def _mesh_task(
    first: Solid,
    second: Solid,
    turns: FloatArray,
    moves: FloatArray,
    relations: Int8Array,
    budget: Budget,
    boolean: bool,
) -> Callable[[int, int], None]:
    """Return the task that lets the kernel decide a range of poses."""
    a, b = shell_of(first), shell_of(second)
    still = a.posed(None)
    turns, moves = read_only(turns), read_only(moves)
    seek = what_to_seek(a, b, Work(budget, witness=False, boolean=boolean))

    def batch(start: int, stop: int) -> None:
        pairs, kinds = np.empty((_ROOM, 2), np.int64), np.empty(_ROOM, np.int8)
        poses = PoseArrays(turns[start:stop], moves[start:stop], True)
        with np.errstate(all="ignore"):
            relate_poses(
                a.arrays,
                a.components,
                a.has_inside,
                b.arrays,
                b.components,
                b.has_inside,
                still,
                poses,
                seek,
                new_descent(),
                pairs,
                kinds,
                relations[start:stop],
                budget.flag,
            )
        budget.check()

    return batch
