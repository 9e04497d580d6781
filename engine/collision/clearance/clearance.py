"""Public: how far apart two solids are."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, Literal, Unpack, overload

import numpy as np

from engine.budget import UNLIMITED, Budget, Cancel
from engine.collision.clearance.forms import (
    MEETING,
    between_form_and_plane,
    between_forms,
    between_outlines,
    gap_of_planes,
)
from engine.collision.clearance.spreads import spread_pair
from engine.collision.collide import check_pose, collide_pair, pair_function
from engine.collision.result import Clearance, Poses, Work
from engine.errors import InvalidInputError
from engine.parallel import Options, Progress, check_options
from engine.solids.base import Solid
from engine.solids.checks import shown
from engine.solids.pose import Pose
from engine.types import Accuracy, Relation


class ClearanceOptions(Options, total=False):
    """What `clearance` takes by name, but for `report`, which changes what it returns."""

    at_least: float | None
    first_pose: Pose | None
    second_pose: Pose | None


@overload
def clearance(
    first: Solid, second: Solid, *, report: Literal[False] = False, **options: Unpack[ClearanceOptions]
) -> Clearance | bool: ...
@overload
def clearance(
    first: Solid, second: Solid, *, report: Literal[True], **options: Unpack[ClearanceOptions]
) -> tuple[Clearance | bool, Accuracy]: ...
def clearance(
    first: Solid,
    second: Solid,
    *,
    first_pose: Pose | None = None,
    second_pose: Pose | None = None,
    at_least: float | None = None,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Clearance | bool | tuple[Clearance | bool, Accuracy]:
    """Say how far apart two solids are, or whether they are at least so far apart, exactly.

    Solids are closed sets: one within another, or in contact, is 0 apart; one in a cavity of another is as far from it
    as the walls are. For many poses of one pair use `clearance_poses`.

    Parameters: first, second, first_pose, second_pose: as for `collide`, all pairs that it takes. at_least: a distance;
    the answer is then a bool. workers, progress: taken for uniformity, one pair is one item. deadline: seconds.
    report: return an `Accuracy` too.
    Returns: a `Clearance`; with at_least whether the exact distance is that or more, that itself counts (so 0 is always
    true; `collide` tells whether they meet).
    Boundary: 0.0 exactly where they have a common point; a positive distance that would round to 0 is the smallest
    denormal. Degenerate input: as `collide`; radius 0, flat boxes and faces without area are bodies too.
    Of several nearest pairs the one on the faces with the smallest numbers is given, the first body's first; where two
    faces are as near along an edge or all over, one point of that: of boxes along the axes the one nearest to where the
    first one's face, or edge in the plane, begins.
    Accuracy: the distance and each coordinate are the doubles nearest to the exact values, each on its own, so the
    points given may be a little nearer or further. Poses are exact images, equal ones are left out, as by `collide`.
    Cost: boxes along the axes, balls and half-spaces some 4 us, small bodies of the plane 8. Others both trees, built
    once per solid; a search of 30 to 220 us for 1,000 to 20,000 faces, then integers for ties. Where sums of
    coordinates may exceed 1e300 every pair of faces is measured: right, and slow.
    Raises: as `collide`; InvalidInputError (at_least negative or not finite); NotRepresentableError (the distance is
    beyond the largest double).

    >>> from engine import Aabb, Sphere
    >>> box = Aabb([0, 0, 0], [1, 1, 1])
    >>> clearance(box, Sphere([4, 5, 1], 2)).distance
    3.0
    >>> clearance(box, Aabb([1.5, 0, 0], [2, 1, 1]), at_least=0.5)
    True
    """
    pair_function(first, second)
    if first_pose is not None or second_pose is not None:
        check_pose(first_pose, first, "first_pose")
        check_pose(second_pose, second, "second_pose")
    if workers is not None or progress is not None or type(report) is not bool:
        check_options(workers, progress, report=report)
    least = None if at_least is None else checked_distance(at_least)
    poses = first_pose, second_pose
    if first_pose is not None and first_pose == second_pose:
        poses = None, None  # as `collide_pair` does, so that the two agree
    if deadline is None and cancel is None and progress is None and not report:
        return _answer(first, second, poses, least, UNLIMITED)
    with Budget(deadline, cancel) as budget:
        budget.check()
        answer = _answer(first, second, poses, least, budget)
    if progress is not None:
        progress(1)
    if not report:
        return answer
    n_exact = int(isinstance(answer, Clearance) and answer.points is not None)
    return answer, Accuracy("exact", 0.5, 1, n_exact, n_exact, "+".join(sorted({first.type, second.type})))


def checked_distance(value: Any, name: str = "at_least") -> float:
    """Return a distance; raise unless it is a finite number, 0 or more."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = -1.0
    if isinstance(value, (bool, str)) or not 0.0 <= number < float("inf"):
        raise InvalidInputError(f"{name} must be a distance, finite and 0 or more, got {shown(value)}", (name,))
    return number


def do_meet(first: Solid, second: Solid, poses: Poses, budget: Budget) -> bool:
    """Tell whether two bodies have a common point."""
    work = Work(budget, witness=False, boolean=True)
    return collide_pair(first, second, poses, work).relation != Relation.DISJOINT


def _answer(first: Solid, second: Solid, poses: Poses, least: float | None, budget: Budget) -> Clearance | bool:
    """Return how far apart two bodies are, or whether at least so far: by closed forms, by planes, by a search."""
    if least == 0.0:
        return True
    planes = has_plane(first, second)
    if planes:
        closed = between_form_and_plane(first, second, poses, least)
    else:
        closed = between_forms(first, second, poses, least)
        if closed is None and first.dimension == 2:
            closed = between_outlines(first, second, poses, least)
    if closed is not None:
        return closed
    if least is not None and not planes:
        answers = np.full(1, np.nan)
        spread_pair(first, second, poses, budget).fill(0, 1, answers, Fraction(least))
        return bool(answers[0] > 0.0) and not do_meet(first, second, poses, budget)
    if do_meet(first, second, poses, budget):
        return MEETING if least is None else False
    if not planes:
        return spread_pair(first, second, poses, budget).clearance(0)
    gap, features = gap_of_planes(first, second, poses, budget)
    return gap.clearance(features, first.dimension) if least is None else gap.is_at_least(Fraction(least))


def has_plane(first: Solid, second: Solid) -> bool:
    """Tell whether one of two solids is a half-space."""
    return first.type == "half_space" or second.type == "half_space"
