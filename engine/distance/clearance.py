"""Public: how far apart two solids are, as they stand or under many rigid poses of the second."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cached_property, partial
from typing import Literal, Unpack, overload

import numpy as np

from engine.collision.codes import DISJOINT, TOUCHING, UNSETTLED
from engine.collision.collide import Answers, collide_pair, pair_function, posed, read_pair
from engine.collision.collide_poses import batch_of, read_poses
from engine.collision.meshes.mesh_arrays import STILL
from engine.collision.meshes.placement import PoseArrays
from engine.collision.result import Clearance, Poses, Work
from engine.distance import forms
from engine.distance.convex_nearest import fill_gaps_of_hulls, nearest_of_hulls, nearest_of_meshes
from engine.distance.from_plane import fill_gaps_from_plane
from engine.distance.spreads import SpreadPair, in_space, spread_pair
from engine.errors import InvalidInputError
from engine.running.budget import UNLIMITED, Budget, Cancel
from engine.running.parallel import Options, Progress, check_options, run_chunks
from engine.solids.accepted import PoseLike, PosesLike, SolidLike
from engine.solids.base import Solid
from engine.solids.checks import shown
from engine.solids.mesh import is_large
from engine.solids.pose import Pose
from engine.solids.primitives import HalfSpace
from engine.types import Accuracy, BoolArray, FloatArray, Relation, read_only


class ClearanceOptions(Options, total=False):
    """Keyword arguments of `clearance`, except `report`, which changes the return type."""

    at_least: float | None
    first_pose: PoseLike | None
    second_pose: PoseLike | None


@overload
def clearance(
    first: SolidLike, second: SolidLike, *, report: Literal[False] = False, **options: Unpack[ClearanceOptions]
) -> Clearance | bool: ...
@overload
def clearance(
    first: SolidLike, second: SolidLike, *, report: Literal[True], **options: Unpack[ClearanceOptions]
) -> tuple[Clearance | bool, Accuracy]: ...
def clearance(
    first: SolidLike,
    second: SolidLike,
    *,
    first_pose: PoseLike | None = None,
    second_pose: PoseLike | None = None,
    at_least: float | None = None,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Clearance | bool | tuple[Clearance | bool, Accuracy]:
    """Return how far apart two solids are, or whether they are at least a distance apart, exactly.

    Parameters
    ----------
    first, second : Solid
        All pairs that `collide` accepts.
    first_pose, second_pose : Pose, optional
        As for `collide`.
    at_least : float, optional
        A distance; the answer is then a bool.
    workers, progress : optional
        Accepted by every operation; one pair is one item.
    deadline, cancel, report
        As for `locate`.

    Returns
    -------
    Clearance
        With `at_least` a bool: whether the exact distance is that or more (so 0 is always true). With ``report=True`` a
        pair of the answer and an `Accuracy`.

    Raises
    ------
    InvalidInputError
        `at_least` is negative or not finite.
    NotRepresentableError
        The distance is beyond the largest double.
    EngineError
        As `collide`.

    Notes
    -----
    Solids are closed sets: bodies in contact, or one within another, are 0 apart; a body in a cavity of another is as
    far from it as the walls are.

    Boundary: 0.0 exactly where they have a common point; a positive distance that would round to 0 is the smallest
    denormal.

    Degenerate input: as `collide`; radius 0, flat boxes and faces without area are bodies too. Of several nearest pairs
    the one on the faces with the smallest numbers is given, the first body's first; where two faces are as near along
    an edge or all over, one point of that: of boxes along the axes, with gaps from 1e-135 to 1e150, the one nearest to
    where the first one's face, or edge in the plane, begins.

    Accuracy: the distance and each coordinate are the doubles nearest to the exact values, each on its own, so the
    points given may be a little nearer or further. Poses are exact images, as for `collide`.

    Cost: boxes along the axes, balls and half-spaces some 4 us, convex bodies of up to 100 faces 6 (parallel ones apart
    along axes too), small bodies of the plane 8. Others both trees, built once per solid; a search of 30 to 220 us for
    1,000 to 20,000 faces, then integers for ties. Where sums of coordinates may exceed 1e300 every pair of faces is
    measured: right, and slow.

    For many poses of one pair use `clearance_poses`.

    References
    ----------
    Hjaltason, Samet, Incremental distance join algorithms for spatial databases, 1998; Larsen, Gottschalk, Lin,
    Manocha, Fast distance queries with rectangular swept sphere volumes, 2000.

    Examples
    --------
    >>> from engine import Aabb, Sphere
    >>> box = Aabb([0, 0, 0], [1, 1, 1])
    >>> clearance(box, Sphere([4, 5, 1], 2)).distance
    3.0
    >>> clearance(box, Aabb([1.5, 0, 0], [2, 1, 1]), at_least=0.5)
    True
    """
    if not (isinstance(first, Solid) and isinstance(second, Solid)):
        first, second, deadline = read_pair(first, second, deadline, cancel)
    pair_function(first, second, "distance")
    if first_pose is not None or second_pose is not None:
        first_pose, second_pose = posed(first_pose, first, "first_pose"), posed(second_pose, second, "second_pose")
    if workers is not None or progress is not None or type(report) is not bool:
        check_options(workers, progress, report=report)
    least = None if at_least is None else checked_distance(at_least)
    poses = first_pose, second_pose
    is_free = deadline is None and cancel is None and progress is None
    if is_free and not report and (workers is None or not is_large(first, second)):
        return _answer(first, second, poses, least, UNLIMITED)
    with Budget(deadline, cancel, workers) as budget:
        budget.check()
        answer = _answer(first, second, poses, least, budget)
    if progress is not None:
        progress(1)
    if not report:
        return answer
    n_exact = int(isinstance(answer, Clearance) and answer.points is not None)
    return answer, Accuracy("exact", 0.5, 1, n_exact, n_exact, "+".join(sorted({first.type, second.type})))


def checked_distance(value: float, name: str = "at_least") -> float:
    """Return a distance as a float; raise unless it is a finite number, 0 or more. name: of the argument, for the
    message."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = -1.0
    if isinstance(value, (bool, str)) or not 0.0 <= number < float("inf"):
        raise InvalidInputError(f"{name} must be a distance, finite and 0 or more, got {shown(value)}", (name,))
    return number


def do_meet(first: Solid, second: Solid, poses: Poses, budget: Budget) -> bool:
    """Return whether two bodies under poses have a common point."""
    work = Work(budget, witness=False, boolean=True)
    return collide_pair(first, second, poses, work).relation != Relation.DISJOINT


def _answer(first: Solid, second: Solid, poses: Poses, least: float | None, budget: Budget) -> Clearance | bool:
    """Return the clearance of two bodies or, given `least`, whether it is at least that. Bodies moved together stay as
    far apart as they are unmoved, as for `collide_pair`; the points are those of the moved ones (none where a rounded
    rotation makes balls meet)."""
    if poses[0] is None or poses[0] != poses[1]:
        return _measured(first, second, poses, least, budget)
    found = _measured(first, second, (None, None), least, budget)
    if isinstance(found, bool) or found.points is None:
        return found
    moved = _measured(first, second, poses, None, budget)
    assert isinstance(moved, Clearance)
    return replace(found, points=moved.points, features=moved.features)


def _measured(first: Solid, second: Solid, poses: Poses, least: float | None, budget: Budget) -> Clearance | bool:
    """Return what `_answer` says of bodies that are not moved together, or as if they were not: by closed forms,
    half-space planes, or a search."""
    if least == 0.0:
        return True
    planes = has_plane(first, second)
    closed = (forms.between_body_and_plane if planes else forms.between_forms)(first, second, poses, least)
    if closed is not None:
        return closed
    nearest = None if planes or first.dimension == 2 else nearest_of_hulls(first, second, poses)
    if nearest is not None and nearest.distance != least:
        return nearest if least is None else nearest.distance > least
    if least is not None and not planes:
        answers = np.full(1, np.nan)
        spread_pair(first, second, poses, budget).fill(0, 1, answers, Fraction(least))
        return bool(answers[0] > 0.0) and not do_meet(first, second, poses, budget)
    if do_meet(first, second, poses, budget):
        return forms.MEETING if least is None else False
    if not planes:
        settle = partial(nearest_of_meshes, first, second, poses) if first.dimension == 3 else lambda: None
        return spread_pair(first, second, poses, budget).clearance(0, settle)
    gap, features = forms.gap_of_planes(first, second, poses, budget)
    return gap.clearance(features, first.dimension) if least is None else gap.is_at_least(Fraction(least))


def has_plane(first: Solid, second: Solid) -> bool:
    """Return whether one of two solids is a half-space."""
    return first.type == "half_space" or second.type == "half_space"


def clearance_poses(
    first: SolidLike,
    second: SolidLike,
    rotations: PosesLike,
    translations: object = None,
    *,
    at_least: float | None = None,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> FloatArray | BoolArray | tuple[FloatArray | BoolArray, Accuracy]:
    """Return how far `first` is from `second` moved by each of many poses, or whether at least a distance, exactly.

    Parameters
    ----------
    first, second : Solid
        As for `collide`.
    rotations : array_like, shape (n_poses, d, d)
        As for `collide_poses`.
    translations : array_like, shape (n_poses, d), optional
        As for `collide_poses`.
    at_least : float, optional
        A distance that every pose is compared with.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts poses.

    Returns
    -------
    ndarray of float64, shape (n_poses,)
        Distances, each as `clearance` gives it; with `at_least` of bool. With ``report=True`` a pair of it and an
        `Accuracy`.

    Raises
    ------
    NotRigidError, NotFiniteError, InvalidArrayError
        The message names the pose.
    EngineError
        As `clearance`.

    Notes
    -----
    Boundary, degenerate input, accuracy and cost: as `clearance`, a pose each. Empty arrays give an empty answer.

    References
    ----------
    As `clearance`.

    Examples
    --------
    >>> from engine import Aabb
    >>> box = Aabb([0, 0, 0], [1, 1, 1])
    >>> turns = np.broadcast_to(np.eye(3), (3, 3, 3))
    >>> clearance_poses(box, box, turns, [[0.5, 0, 0], [1.25, 0, 0], [4, 5, 0]]).tolist()
    [0.0, 0.25, 5.0]
    """
    check_options(workers, progress, report=report)
    if not (isinstance(first, Solid) and isinstance(second, Solid)):
        first, second, deadline = read_pair(first, second, deadline, cancel)
    pair_function(first, second, "distance")
    least = None if at_least is None else checked_distance(at_least)
    poses, deadline = read_poses(rotations, translations, first.dimension, workers, deadline, cancel)
    n_poses = len(poses.rotations)
    answers = np.full(n_poses, np.nan if least != 0.0 else np.inf)
    with Budget(deadline, cancel, workers) as budget:
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
    """One pair of bodies and n poses of the second body, the first unposed; fills distances by range of poses."""

    def __init__(self, first: Solid, second: Solid, poses: PoseArrays, budget: Budget) -> None:
        self.first, self.second, self.poses, self.budget = first, second, poses, budget
        n_poses = len(poses.rotations)
        self.relations = np.full(n_poses, UNSETTLED, np.int8)
        self.spread = None if has_plane(first, second) or not n_poses else in_space(poses.rotations, poses.translations)
        self.is_small = self.spread is not None and forms.are_small(first, second)
        self.n_exact = 0

    def fill(self, answers: FloatArray, start: int, stop: int, least: Fraction | None) -> None:
        """Fill answers[start:stop], NaN on entry, with the distances under these poses; threads may fill different
        ranges. least: if given, 0.0 for nearer bodies and infinity for others instead."""
        turns, moves = read_only(self.poses.rotations[start:stop]), read_only(self.poses.translations[start:stop])
        if self.is_small:
            motions = *forms.STILL2, turns, moves
            answers[start:stop] = forms.distances_under_poses(self.first, self.second, motions, least, self.budget)
        elif self.spread is not None and self.first.dimension == 3:
            some = PoseArrays(turns, moves, True)
            fill_gaps_of_hulls(self.first, self.second, some, least, answers[start:stop], self.budget)
        elif isinstance(self.first, HalfSpace) and not isinstance(self.second, HalfSpace):
            fill_gaps_from_plane(self.first, self.second, (turns, moves), least, answers[start:stop], self.budget)
        if not self.is_small and np.isnan(answers[start:stop]).any() and self.relate is not None:
            self.relate(start, stop)
        left = start + np.flatnonzero(np.isnan(answers[start:stop]))
        for item in left.tolist():
            self.budget.check()
            if self.relations[item] == UNSETTLED:
                meets = do_meet(self.first, self.second, self._poses(item), self.budget)
                self.relations[item] = TOUCHING if meets else DISJOINT
            if self.relations[item] != DISJOINT:
                answers[item] = 0.0
            elif self.spread is None:
                gap, _ = forms.gap_of_planes(self.first, self.second, self._poses(item), self.budget)
                answers[item] = gap.distance() if least is None else (np.inf if gap.is_at_least(least) else 0.0)
        if self.spread is None:
            self.n_exact += len(left)
        elif len(left):
            pair = SpreadPair(self.first, self.second, STILL, self.spread, self.budget)
            pair.fill(start, stop, answers, least)
            self.n_exact += pair.n_exact

    @cached_property
    def relate(self) -> Callable[[int, int], None] | None:
        """What `batch_of` returns: it builds what only bodies need whose distance is not proven at once."""
        answers = Answers(self.budget, True, self.relations, None, None)
        return batch_of(self.first, self.second, self.poses, answers)

    def _poses(self, item: int) -> Poses:
        """Return the poses of both bodies for pose number ``item``: None for the first."""
        return None, Pose.of_checked(self.poses.rotations[item], self.poses.translations[item])
