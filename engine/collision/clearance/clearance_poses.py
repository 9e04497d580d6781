"""Public: how far apart two solids are under many rigid poses of the second."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from engine.arrays import BoolArray, FloatArray, read_only
from engine.budget import Budget, Cancel
from engine.collision.clearance.bodies import in_space
from engine.collision.clearance.clearance import checked_distance, do_meet, has_plane
from engine.collision.clearance.forms import STILL2, are_small, gap_of_planes, told_under_poses
from engine.collision.clearance.spreads import SpreadPair
from engine.collision.codes import DISJOINT, TOUCHING, UNSETTLED
from engine.collision.collide import Answers, pair_function
from engine.collision.collide_poses import as_poses, batch_of
from engine.collision.meshes.mesh_arrays import STILL
from engine.collision.meshes.placement import PoseArrays
from engine.collision.result import Poses
from engine.parallel import Progress, check_options, run_chunks
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.types import Accuracy


def clearance_poses(
    first: Solid,
    second: Solid,
    rotations: object,
    translations: object,
    *,
    at_least: float | None = None,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> FloatArray | BoolArray | tuple[FloatArray | BoolArray, Accuracy]:
    """Say how far `first` is from `second` moved by each of many poses, or whether at least so far, exactly.

    Parameters: first, second, rotations ``(n_poses, d, d)``, translations ``(n_poses, d)``: as for `collide_poses`.
    at_least: a distance that every pose is held against. workers, deadline, cancel, progress (items are poses), report:
    as everywhere.
    Returns: ``(n_poses,) float64`` distances, each as `clearance` gives it; with at_least ``(n_poses,) bool``.
    Boundary, degenerate input, accuracy: as `clearance`. Empty arrays give an empty answer.
    Raises: as `clearance`; NotRigidError, NotFiniteError, InvalidArrayError name the pose.

    >>> from engine import Aabb
    >>> box = Aabb([0, 0, 0], [1, 1, 1])
    >>> turns = np.broadcast_to(np.eye(3), (3, 3, 3))
    >>> clearance_poses(box, box, turns, [[0.5, 0, 0], [1.25, 0, 0], [4, 5, 0]]).tolist()
    [0.0, 0.25, 5.0]
    """
    check_options(workers, progress, report=report)
    pair_function(first, second)
    least = None if at_least is None else checked_distance(at_least)
    poses = PoseArrays(*as_poses(rotations, translations, first.dimension), True)
    n_poses = len(poses.rotations)
    answers = np.full(n_poses, np.nan if least != 0.0 else np.inf)
    with Budget(deadline, cancel) as budget:
        batch = _Batch(first, second, poses, budget)

        def task(start: int, stop: int) -> None:
            if least != 0.0:
                batch.fill(answers, start, stop, None if least is None else Fraction(least))

        run_chunks(task, n_poses, budget=budget, first_chunk=4, workers=workers, progress=progress)
    result = answers if least is None else answers > 0.0
    if not report:
        return result
    n_exact = batch.n_exact
    return result, Accuracy("exact", 0.5, n_poses, n_exact, n_exact, "+".join(sorted({first.type, second.type})))


class _Batch:
    """One pair of bodies and all poses of the second."""

    def __init__(self, first: Solid, second: Solid, poses: PoseArrays, budget: Budget) -> None:
        self.first, self.second, self.poses, self.budget = first, second, poses, budget
        n_poses = len(poses.rotations)
        self.relations = np.full(n_poses, UNSETTLED, np.int8)
        self.relate = batch_of(first, second, poses, Answers(budget, True, self.relations, None, None))
        self.spread = None if has_plane(first, second) or not n_poses else in_space(poses.rotations, poses.translations)
        self.is_small = self.spread is not None and are_small(first, second)
        self.n_exact = 0

    def fill(self, answers: FloatArray, start: int, stop: int, least: Fraction | None) -> None:
        """Answer the poses of a range as `SpreadPair.fill`; threads may answer different ranges."""
        if self.relate is not None:
            self.relate(start, stop)
        if self.is_small:
            turns, moves = read_only(self.poses.rotations[start:stop]), read_only(self.poses.translations[start:stop])
            motions = *STILL2, turns, moves
            answers[start:stop] = told_under_poses(self.first, self.second, motions, least, self.budget)
        left = start + np.flatnonzero(np.isnan(answers[start:stop]))
        for item in left.tolist():
            self.budget.check()
            if self.relations[item] == UNSETTLED:
                meets = do_meet(self.first, self.second, self._poses(item), self.budget)
                self.relations[item] = TOUCHING if meets else DISJOINT
            if self.relations[item] != DISJOINT:
                answers[item] = 0.0
            elif self.spread is None:
                gap, _ = gap_of_planes(self.first, self.second, self._poses(item), self.budget)
                answers[item] = gap.distance() if least is None else (np.inf if gap.is_at_least(least) else 0.0)
        if self.spread is None:
            self.n_exact += len(left)
        elif len(left):
            pair = SpreadPair(self.first, self.second, STILL, self.spread, self.budget)
            pair.fill(start, stop, answers, least)
            self.n_exact += pair.n_exact

    def _poses(self, item: int) -> Poses:
        return None, Pose.of_checked(self.poses.rotations[item], self.poses.translations[item])
