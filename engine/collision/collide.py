"""Public: how two solids lie to each other. One table from the two types to the function that decides.

Of calls about many pairs kernels fill what answers they can (`Answers`), the rest is settled one by one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, Unpack, overload

import numpy as np

from engine.arrays import Int8Array, IntArray
from engine.collision.codes import DISJOINT, UNSETTLED
from engine.collision.detail import NO_DETAIL, check_has_detail, detail_of
from engine.collision.meshes.mesh_mesh import mesh_mesh
from engine.collision.planar.outline_batch import collide_outlines
from engine.collision.result import (
    BODIES,
    FACES,
    UNCOUNTED,
    UNNAMED,
    Collision,
    PairFunction,
    Poses,
    Witness,
    Work,
    meets_as,
)
from engine.collision.simple.against_ball import collide_body_sphere
from engine.collision.simple.against_half_space import collide_half_space_body
from engine.collision.simple.closed_forms import (
    by_forms_or,
    collide_form_sphere,
    collide_half_space_sphere,
    collide_half_spaces,
)
from engine.errors import InvalidArrayError, UnsupportedPairError, UnsupportedSolidError, WrongDimensionError
from engine.running.budget import Budget, Cancel
from engine.running.parallel import Options, Progress, check_options
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.types import Accuracy

TAKEN = {2: "polygon, triangle, aabb, sphere, half_space", 3: "polyhedron, surface, aabb, sphere, half_space"}


PAIRS: dict[tuple[int, str, str], PairFunction] = {
    **{(3, first, second): mesh_mesh for first in FACES[3] for second in FACES[3]},
    **{(2, first, second): collide_outlines for first in FACES[2] for second in FACES[2]},
    **{(d, "half_space", body): collide_half_space_body for d, body in BODIES},
    **{(d, body, "sphere"): collide_body_sphere for d, body in BODIES},
}
for _dimension in (2, 3):
    PAIRS[_dimension, "box", "box"] = by_forms_or(mesh_mesh if _dimension == 3 else collide_outlines)
    PAIRS[_dimension, "box", "sphere"] = by_forms_or(collide_form_sphere)
    PAIRS[_dimension, "half_space", "half_space"] = collide_half_spaces
    PAIRS[_dimension, "half_space", "sphere"] = collide_half_space_sphere
    PAIRS[_dimension, "sphere", "sphere"] = by_forms_or(collide_form_sphere)
"""Dimension and as what two solids meet (`Row.meets`) to the function of that pair, in one order or both."""

_BY_TYPE: dict[tuple[int, str, int, str], tuple[PairFunction, bool]] = {}
"""What `PAIRS` says of types that were asked about."""


def pair_function(first: Solid, second: Solid) -> tuple[PairFunction, bool]:
    """Return the function of a pair and whether it wants the two in the other order."""
    if isinstance(first, Solid) and isinstance(second, Solid):
        types = first.dimension, first.type, second.dimension, second.type
        if (known := _BY_TYPE.get(types)) is not None:
            return known
        if first.dimension == second.dimension:
            one, other = meets_as(first), meets_as(second)
            for key, is_swapped in (((first.dimension, one, other), False), ((first.dimension, other, one), True)):
                if (function := PAIRS.get(key)) is not None:
                    return _BY_TYPE.setdefault(types, (function, is_swapped))
    for name, solid in (("first", first), ("second", second)):
        if not isinstance(solid, Solid):
            raise UnsupportedSolidError(
                f"{name} must be a solid, got {type(solid).__name__}; collide takes {TAKEN[3]} in 3D, {TAKEN[2]} in 2D",
                (name,),
            )
    if first.dimension != second.dimension:
        raise WrongDimensionError(
            f"first is a {first.dimension}D {first.type}, second a {second.dimension}D {second.type}; "
            "both must have one dimension",
            ("second",),
        )
    raise UnsupportedPairError(
        f"collision of a {first.type} with a {second.type} in {first.dimension}D is not defined; "
        f"collide takes {TAKEN[first.dimension]} in {first.dimension}D",
        ("second",),
    )


def check_pose(pose: object, solid: Solid, name: str) -> None:
    """Raise unless `pose` is None or a pose of the solid's dimension."""
    if pose is None:
        return
    if not isinstance(pose, Pose):
        raise InvalidArrayError(f"{name} must be a Pose or None, got {type(pose).__name__}", (name,))
    if pose.dimension != solid.dimension:
        raise WrongDimensionError(
            f"{name} has dimension {pose.dimension}, the {solid.type} it moves has {solid.dimension}", (name,)
        )


def collide_pair(first: Solid, second: Solid, poses: Poses, work: Work) -> Collision:
    """Return the relation of two checked solids under checked poses, within the budget of `work`.

    Two equal poses are left out: what moves together keeps its relation, although a rotation of floats is not quite
    orthogonal and a ball's radius is kept under it.
    """
    if poses[0] is not None and poses[0] == poses[1]:
        poses = None, None
    function, is_swapped = pair_function(first, second)
    answer = (
        function(second, first, poses[::-1], work).swapped() if is_swapped else function(first, second, poses, work)
    )
    return answer if work.witness else UNNAMED[answer.relation]


class CollideOptions(Options, total=False):
    """What `collide` takes by name, but for `report`, which changes what it returns."""

    first_pose: Pose | None
    second_pose: Pose | None
    boolean: bool
    witness: bool
    detail: bool


@overload
def collide(
    first: Solid, second: Solid, *, report: Literal[False] = False, **options: Unpack[CollideOptions]
) -> Collision: ...
@overload
def collide(
    first: Solid, second: Solid, *, report: Literal[True], **options: Unpack[CollideOptions]
) -> tuple[Collision, Accuracy]: ...
def collide(
    first: Solid,
    second: Solid,
    *,
    first_pose: Pose | None = None,
    second_pose: Pose | None = None,
    boolean: bool = False,
    witness: bool = True,
    detail: bool = False,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Collision | tuple[Collision, Accuracy]:
    """Decide how two solids lie to each other, exactly, and name one reason.

    Solids are closed sets. The first true line decides: no common point, disjoint; the first within the open interior
    of the second, first_inside_second; the other way, second_inside_first; the open interiors meet, overlapping; else
    touching. Bodies without interior (surfaces, flat boxes, faces that all cancel) never overlap. For many poses of one
    pair use `collide_poses`, for many bodies `collide_scene`.

    Parameters: first, second: 3D polyhedron, surface, aabb, sphere, half_space; 2D polygon, triangle, aabb, sphere,
    half_space. first_pose, second_pose: exact affine images as given, None for none. boolean: disjoint or not is all
    that is wanted; any other relation may then be answered as touching, sooner, without a witness. witness: False where
    no reason is wanted. detail: say which of the eight relations of RCC-8 (`Rcc8`) too, in `Collision.detail`: disjoint
    is DC, touching EC, inside NTPP, NTPPi;
    overlapping becomes PO, EQ, or TPP and TPPi where one body lies in the other and the boundaries meet. Containment
    and equality are of the closures of the open interiors, so walls that cancel do not count; they count as boundary.
    None where a body has no interior (flat, radius 0, all faces cancel); a surface is refused. workers, progress: taken
    for uniformity, one pair is one item. deadline: seconds. report: return an `Accuracy` too.
    Returns: a `Collision`: the relation, and a witness unless disjoint. Among several contacts the witness names one;
    which one depends on the order of the faces, never on threads.
    Boundary: one common point is enough to touch. Degenerate input: faces without area count as the segment or point
    they are; walls that cancel under even-odd are part of the body but bound no interior.
    Accuracy: exact for all finite input, under poses too.
    Cost: two trees, built once per solid; then about the number of pairs of faces near each other. detail: nothing more
    where faces cross, some 20 us for each face in contact where bodies lie flush, 1 ms for one that the other cuts.
    Raises: UnsupportedSolidError, UnsupportedPairError, WrongDimensionError, InvalidArrayError, InvalidInputError
    (boolean with detail), DeadlineExceededError, CancelledError.

    >>> from engine import Aabb
    >>> collide(Aabb([0, 0, 0], [1, 1, 1]), Aabb([1, 0, 0], [2, 1, 1])).relation.label
    'touching'
    >>> collide(Aabb([0, 0, 0], [1, 1, 1]), Aabb([0, 0, 0], [2, 2, 2]), detail=True).detail.label
    'TPP'
    """
    if first_pose is not None or second_pose is not None:
        pair_function(first, second)
        check_pose(first_pose, first, "first_pose")
        check_pose(second_pose, second, "second_pose")
    are_plain = type(report) is type(boolean) is type(witness) is type(detail) is bool
    if workers is not None or progress is not None or not are_plain:
        check_options(workers, progress, report=report, boolean=boolean, witness=witness, detail=detail)
    is_named, poses = witness and not boolean, (first_pose, second_pose)
    if deadline is None and cancel is None and progress is None and not (detail or report):
        return collide_pair(first, second, poses, UNCOUNTED[bool(is_named), bool(boolean)])
    pair_function(first, second)
    if detail:
        check_has_detail(((("first",), first), (("second",), second)), boolean)
    with Budget(deadline, cancel) as budget:
        budget.check()
        work = Work(budget, witness=is_named, boolean=boolean)
        result = collide_pair(first, second, poses, work)
        if detail:
            named = detail_of(first, second, poses, result.relation, work)
            result = Collision(result.relation, result.witness, named)
    if progress is not None:
        progress(1)
    if not report:
        return result
    method = "+".join(sorted({first.type, second.type}))
    return result, Accuracy("exact", None, 1, work.n_beyond_filter, work.n_rational, method)


Witnesses = list[Witness | None]
PlacedPair = tuple[Solid, Solid, Poses]


@dataclass(slots=True, eq=False)
class Answers:
    """One a pair, by its number.

    relations: (n,) int8, UNSETTLED where none is known yet. witnesses, details ((n,) int8, NO_DETAIL where none is
    known): where asked for, else None. works: what settling counted.
    """

    budget: Budget
    boolean: bool
    relations: Int8Array
    witnesses: Witnesses | None
    details: Int8Array | None
    works: list[Work] = field(default_factory=list)

    def left(self, start: int = 0, stop: int | None = None) -> IntArray:
        """Return the pairs of a range to be settled one by one: open ones, and those whose witness is asked for yet."""
        relations = self.relations[start:stop]
        is_left = relations == UNSETTLED
        if self.witnesses is not None:
            is_left |= (relations != DISJOINT) & np.array([w is None for w in self.witnesses[start:stop]], np.bool_)
        left: IntArray = start + np.flatnonzero(is_left)
        return left

    def settle(self, items: IntArray, pair_of: Callable[[int], PlacedPair]) -> None:
        """Fill the answers of some pairs by `collide_pair`; threads may settle different pairs."""
        work = Work(self.budget, witness=self.witnesses is not None, boolean=self.boolean)
        self.works.append(work)
        for item in items.tolist():
            self.budget.check()
            pair = pair_of(item)
            answer = collide_pair(*pair, work)
            self.relations[item] = answer.relation
            if self.witnesses is not None:
                self.witnesses[item] = answer.witness
            if self.details is not None and self.details[item] == NO_DETAIL:
                named = detail_of(*pair, answer.relation, work)
                self.details[item] = NO_DETAIL if named is None else named


def accuracy_of(n_pairs: int, n_open: int, works: list[Work], method: str) -> Accuracy:
    """Return the report on many pairs; n_open: those that batches left, all of them beyond a filter."""
    beyond, rational = sum(work.n_beyond_filter for work in works), sum(work.n_rational for work in works)
    return Accuracy("exact", None, n_pairs, max(beyond, n_open), rational, method)
