"""Public: the relation of two solids. One table maps the two types to the functions that decide.

**Detail.** Of the eight relations of RCC-8 disjoint is DC, touching EC, inside NTPP. Only overlapping splits further:
neither body sticks out of the other, EQ; one does, TPP or NTPP by whether the boundaries meet; both do, PO.

For many pairs, kernels fill the answers that they can decide (`Answers`); the rest is settled one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Literal, Unpack, overload

import numpy as np

from engine.collision import result
from engine.collision.codes import DISJOINT, UNSETTLED
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.meshes.mesh_mesh import mesh_mesh, mesh_parts
from engine.collision.outline import collide_outlines, live_edges, outline_of, outline_parts
from engine.collision.outline_batch import outline_arrays
from engine.collision.simple import closed_forms as forms
from engine.collision.simple.against_ball import body_sphere_parts, collide_body_sphere
from engine.collision.simple.boundary import live_parts
from engine.errors import InvalidInputError, UnsupportedPairError, UnsupportedSolidError, WrongDimensionError
from engine.running.budget import Budget, Cancel, reading
from engine.running.parallel import Options, Progress, check_options
from engine.solids.accepted import PoseLike, SolidLike
from engine.solids.base import Solid, named
from engine.solids.checks import spell
from engine.solids.mesh import Surface, is_large
from engine.solids.pose import Pose
from engine.solids.poses import as_pose
from engine.solids.primitives import Aabb, HalfSpace, Sphere
from engine.solids.shapes import as_solid
from engine.types import Accuracy, FloatArray, Int8Array, IntArray, Rcc8, Relation

TAKEN = {2: "polygon, triangle, aabb, sphere, half_space", 3: "polyhedron, surface, aabb, sphere, half_space"}


_Functions = tuple[result.PairFunction, result.PartsFunction]
_BODIES: dict[int, _Functions] = {3: (mesh_mesh, mesh_parts), 2: (collide_outlines, outline_parts)}
PAIRS: dict[tuple[int, str, str], _Functions] = {
    **{(d, first, second): _BODIES[d] for d in (2, 3) for first in result.FACES[d] for second in result.FACES[d]},
    **{
        (d, "half_space", body): (forms.collide_half_space_body, forms.half_space_body_parts)
        for d, body in result.BODIES
    },
    **{(d, body, "sphere"): (collide_body_sphere, body_sphere_parts) for d, body in result.BODIES},
}
"""Functions of each pair of kinds of solids: relation, and parts outside the other of two that overlap. Key: dimension
and the kinds of both solids (`Row.meets`), in one order or both."""
for _d, (_function, _parts) in _BODIES.items():
    PAIRS[_d, "box", "box"] = forms.closed_form_or(_function), _parts
    PAIRS[_d, "box", "sphere"] = forms.closed_form_or(forms.collide_form_sphere), body_sphere_parts
    PAIRS[_d, "half_space", "half_space"] = forms.collide_half_spaces, forms.half_spaces_parts
    PAIRS[_d, "half_space", "sphere"] = forms.collide_half_space_sphere, forms.half_space_sphere_parts
    PAIRS[_d, "sphere", "sphere"] = forms.closed_form_or(forms.collide_form_sphere), forms.sphere_sphere_parts
"""Dimension and as what two solids meet (`Row.meets`), in one order or both, to the functions of that pair: how the two
lie to each other, and of two that overlap what lies outside the other."""

_BY_TYPE: dict[tuple[int, str, int, str], tuple[result.PairFunction, result.PartsFunction, bool]] = {}
"""Rows of `PAIRS` cached by types, with whether to swap the bodies."""


INSTEAD = {
    "convex": "its corners need not be doubles; give the polyhedron or polygon of its corners, or an aabb",
    "triangle": "in space it is the prism over it; give Surface(triangle.vertices, [[0, 1, 2]])",
    "csg": "ask about its operands, or of polygons about their overlay or union_all",
    "implicit": "give a mesh of it",
}
"""What to give in place of a solid that is no body, by its type."""


def pair_function(
    first: Solid, second: Solid, what: str = "collision"
) -> tuple[result.PairFunction, result.PartsFunction, bool]:
    """Look up a pair of solids in the table `PAIRS`. Returns the function that decides their relation, the one that
    decides which has a part outside the other, and whether to call both with the two bodies swapped. Raises
    UnsupportedSolidError, WrongDimensionError or UnsupportedPairError if the pair is not in the table; what: the
    question, for these."""
    if isinstance(first, Solid) and isinstance(second, Solid):
        types = first.dimension, first.type, second.dimension, second.type
        if (known := _BY_TYPE.get(types)) is not None:
            return known
        if first.dimension == second.dimension:
            one, other = result.meets_as(first), result.meets_as(second)
            for key, is_swapped in (((first.dimension, one, other), False), ((first.dimension, other, one), True)):
                if (functions := PAIRS.get(key)) is not None:
                    return _BY_TYPE.setdefault(types, (*functions, is_swapped))
    for name, solid in (("first", first), ("second", second)):
        if not isinstance(solid, Solid):
            raise UnsupportedSolidError(
                f"{name} must be a solid, got {type(solid).__name__}; {what} takes {TAKEN[3]} in 3D, {TAKEN[2]} in 2D",
                (name,),
            )
    if first.dimension != second.dimension:
        raise WrongDimensionError(
            f"first is {named(first.type)} in {first.dimension}D, second {named(second.type)} in {second.dimension}D; "
            "both must have one dimension",
            ("second",),
        )
    odd = next((each for each in (first, second) if not result.meets_as(each)), second)
    between = f"{named(first.type)} {'and' if what == 'distance' else 'with'} {named(second.type)}"
    raise UnsupportedPairError(
        f"{what} of {between} in {first.dimension}D is not defined; it takes {TAKEN[first.dimension]} in "
        f"{first.dimension}D{instead_of(odd)}",
        ("first" if odd is first and odd is not second else "second",),
    )


def instead_of(solid: Solid) -> str:
    """Return a clause that says what to give in place of a solid that is no body."""
    return f"; {named(solid.type)}: {INSTEAD[solid.type]}" if solid.type in INSTEAD else ""


def read_pair(
    first: object, second: object, deadline: float | None, cancel: Cancel | None
) -> tuple[Solid, Solid, float | None]:
    """Return two solids, given as such or as what stands for them, and the seconds left."""
    with reading(deadline, cancel) as reader:
        return as_solid(first, "first"), as_solid(second, "second"), reader.left()


def posed(given: object, solid: Solid, *where: str | int) -> Pose | None:
    """Return a given pose, which may be a matrix or a pair (rotation, translation), as a `Pose`; None for None. Raises
    unless it has the solid's dimension; where: path of the argument in the call, for the message."""
    if given is None:
        return None
    pose = given if type(given) is Pose else as_pose(given, solid.dimension, *where)
    if pose.dimension != solid.dimension:
        raise WrongDimensionError(
            f"{spell(where)} has dimension {pose.dimension}, the {solid.type} it moves has {solid.dimension}", where
        )
    return pose


def collide_pair(first: Solid, second: Solid, poses: result.Poses, work: result.Work) -> result.Collision:
    """Return the relation of two checked solids under checked poses, within the budget of `work`. Two equal poses are
    dropped: bodies moved together keep their relation, although rounded rotations stretch lengths a little."""
    if poses[0] is not None and poses[0] == poses[1]:
        poses = None, None
    function, _, is_swapped = pair_function(first, second)
    if is_swapped:
        answer = function(second, first, poses[::-1], work).swapped()
    else:
        answer = function(first, second, poses, work)
    return answer if work.witness else result.UNNAMED[answer.relation]


class CollideOptions(Options, total=False):
    """Keyword arguments of `collide`, except `report`, which changes the return type."""

    first_pose: PoseLike | None
    second_pose: PoseLike | None
    boolean: bool
    witness: bool
    detail: bool


@overload
def collide(
    first: SolidLike, second: SolidLike, *, report: Literal[False] = False, **options: Unpack[CollideOptions]
) -> result.Collision: ...
@overload
def collide(
    first: SolidLike, second: SolidLike, *, report: Literal[True], **options: Unpack[CollideOptions]
) -> tuple[result.Collision, Accuracy]: ...
def collide(
    first: SolidLike,
    second: SolidLike,
    *,
    first_pose: PoseLike | None = None,
    second_pose: PoseLike | None = None,
    boolean: bool = False,
    witness: bool = True,
    detail: bool = False,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> result.Collision | tuple[result.Collision, Accuracy]:
    """Decide how two solids relate, exactly, and name a witness.

    Parameters
    ----------
    first, second : Solid
        In 3D polyhedron, surface, aabb, sphere, half_space; in 2D polygon, triangle, aabb, sphere, half_space.
    first_pose, second_pose : Pose, optional
        Poses of the bodies; omit for the identity.
    boolean : bool, default False
        Only decide disjoint or not; any other relation may be answered as touching, sooner, without a witness.
    witness : bool, default True
        False where no witness is needed.
    detail : bool, default False
        Also decide which of the eight relations of RCC-8 (`Rcc8`) holds, in `Collision.detail`.
    workers, progress : optional
        Accepted by every operation; one pair is one item.
    deadline, cancel, report
        As for `locate`.

    Returns
    -------
    Collision
        The relation, and a witness unless disjoint; with ``report=True`` a pair of it and an `Accuracy`. Among several
        contacts the witness names one; which one depends on the order of the faces, never on threads.

    Raises
    ------
    UnsupportedSolidError, UnsupportedPairError, WrongDimensionError, InvalidArrayError
        For solids or poses that are not accepted.
    InvalidInputError
        For `boolean` together with `detail`.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    Solids are closed sets. The first true line decides:

    | condition | relation |
    | --- | --- |
    | no common point | disjoint |
    | the first lies in the open interior of the second | first_inside_second |
    | the second lies in the open interior of the first | second_inside_first |
    | the open interiors meet | overlapping |
    | else | touching |

    RCC-8: disjoint is DC, touching EC, inside NTPP or NTPPi; overlapping becomes PO, EQ, or TPP and TPPi where one body
    lies in the other and the boundaries meet. It compares the closures of the open interiors, so walls that cancel
    count as boundary only. It is None where a body has no interior (flat, radius 0, all faces cancel); a surface is
    refused.

    Boundary: one common point is enough to touch.

    Degenerate input: faces without area count as the segment or point they are; walls that cancel under even-odd are
    part of the body but bound no interior. Bodies without interior never overlap.

    Accuracy: exact for all finite input, under poses too.

    Cost: two trees, built once per solid; then about the number of pairs of faces near each other. `detail`: nothing
    more where faces cross, some 20 us for each face in contact where bodies lie flush, 1 ms for one that the other
    cuts.

    For many poses of one pair use `collide_poses`, for many bodies `collide_scene`.

    References
    ----------
    Guigue, Devillers, Fast and robust triangle-triangle overlap test using orientation predicates, 2003; Randell, Cui,
    Cohn, A spatial logic based on regions and connection, 1992 (RCC-8).

    Examples
    --------
    >>> from engine import Aabb
    >>> collide(Aabb([0, 0, 0], [1, 1, 1]), Aabb([1, 0, 0], [2, 1, 1])).relation.label
    'touching'
    >>> collide(Aabb([0, 0, 0], [1, 1, 1]), Aabb([0, 0, 0], [2, 2, 2]), detail=True).detail.label
    'TPP'
    """
    if not (isinstance(first, Solid) and isinstance(second, Solid)):
        first, second, deadline = read_pair(first, second, deadline, cancel)
    if first_pose is not None or second_pose is not None:
        pair_function(first, second)
        first_pose, second_pose = posed(first_pose, first, "first_pose"), posed(second_pose, second, "second_pose")
    are_plain = type(report) is type(boolean) is type(witness) is type(detail) is bool
    if workers is not None or progress is not None or not are_plain:
        check_options(workers, progress, report=report, boolean=boolean, witness=witness, detail=detail)
    is_named, poses = witness and not boolean, (first_pose, second_pose)
    is_free = deadline is None and cancel is None and progress is None
    if is_free and not (detail or report) and (workers is None or not is_large(first, second)):
        return collide_pair(first, second, poses, result.UNCOUNTED[bool(is_named), bool(boolean)])
    pair_function(first, second)
    if detail:
        check_has_detail(((("first",), first), (("second",), second)), boolean)
    with Budget(deadline, cancel, workers) as budget:
        budget.check()
        work = result.Work(budget, witness=is_named, boolean=boolean)
        answer = collide_pair(first, second, poses, work)
        if detail:
            named = detail_of(first, second, poses, answer.relation, work)
            answer = result.Collision(answer.relation, answer.witness, named)
    if progress is not None:
        progress(1)
    if not report:
        return answer
    work.end_item()
    return answer, accuracy_of(1, 0, [work], "+".join(sorted({first.type, second.type})))


Witnesses = list[result.Witness | None]
PlacedPair = tuple[Solid, Solid, result.Poses]


@dataclass(slots=True, eq=False)
class Answers:
    """Answers to many pairs, by index of the pair.

    | field | meaning |
    |---|---|
    | budget, boolean | deadline; whether only disjoint or not is wanted |
    | relations | (n,) int8 codes, UNSETTLED where still to be decided |
    | witnesses | list of n, None where disjoint or still to be chosen; None in its place if not requested |
    | details | (n,) int8 `Rcc8` codes, NO_DETAIL where still to be decided; None if not requested |
    | works | counts of the pairs settled one by one, one entry for each call of `settle` |
    """

    budget: Budget
    boolean: bool
    relations: Int8Array
    witnesses: Witnesses | None
    details: Int8Array | None
    works: list[result.Work] = field(default_factory=list)

    def left(self, start: int = 0, stop: int | None = None) -> IntArray:
        """Return the indices of the pairs start .. stop - 1 still to be settled: undecided ones, or ones that lack a
        requested witness."""
        relations = self.relations[start:stop]
        is_left = relations == UNSETTLED
        if self.witnesses is not None:
            rows = np.flatnonzero(~is_left & (relations != DISJOINT))
            is_left[rows] = [self.witnesses[item] is None for item in (start + rows).tolist()]
        left: IntArray = start + np.flatnonzero(is_left)
        return left

    def settle(self, items: IntArray, pair_of: Callable[[int], PlacedPair]) -> None:
        """Decide the pairs with indices `items` one by one and fill their answers; pair_of(item): the two solids and
        their poses. Threads may settle different pairs."""
        work = result.Work(self.budget, witness=self.witnesses is not None, boolean=self.boolean)
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
            work.end_item()


def accuracy_of(n_pairs: int, n_open: int, works: list[result.Work], method: str) -> Accuracy:
    """Return the accuracy report of many pairs. n_open: number of pairs that batch kernels left open, all beyond a
    filter; works: counts of the pairs settled one by one."""
    beyond, rational = (sum(some) for some in zip((0, 0), *(work.items for work in works)))
    return Accuracy("exact", None, n_pairs, max(beyond, n_open), rational, method)


NO_DETAIL = -1
"""Code in place of an `Rcc8` value: a body has no interior, or the pair is still to be decided."""

UNLESS_OVERLAPPING = {
    Relation.DISJOINT: Rcc8.DC,
    Relation.TOUCHING: Rcc8.EC,
    Relation.FIRST_INSIDE_SECOND: Rcc8.NTPP,
    Relation.SECOND_INSIDE_FIRST: Rcc8.NTPPI,
}
_WHERE_PROVEN = np.array([UNLESS_OVERLAPPING.get(relation, Rcc8.PO) for relation in Relation], np.int8)


def check_has_detail(named: Iterable[tuple[tuple[str | int, ...], Solid]], boolean: bool) -> None:
    """Raise if RCC-8 relations cannot be decided: a solid is a surface, which has no interior, or `boolean` is set.
    named: solids with their paths in the call."""
    if boolean:
        raise InvalidInputError("detail needs the relation, which boolean leaves open; ask for one", ("detail",))
    for where, solid in named:
        if isinstance(solid, Surface):
            raise UnsupportedSolidError(
                f"{spell(where)} is a surface, which has no interior: detail is told of solids; make it a polyhedron, "
                "or ask without detail",
                where,
            )


def details_where_proven(relations: Int8Array) -> Int8Array:
    """Return the `Rcc8` codes of relations (n,) that a batch decided, NO_DETAIL for UNSETTLED. OVERLAPPING becomes PO:
    caller guarantees that a crossing, or points of each body outside the other, proved it."""
    return np.where(relations == UNSETTLED, np.int8(NO_DETAIL), _WHERE_PROVEN[relations])


def details_of_boxes(low: FloatArray, high: FloatArray, pairs: IntArray, relations: Int8Array) -> Int8Array:
    """Return the `Rcc8` codes (n,) of pairs (n, 2) of boxes (n_boxes, d) with interiors, given their relations (n,)."""
    i, j = pairs.T
    i_sticks_out = ((low[i] < low[j]) | (high[j] < high[i])).any(axis=1)
    j_sticks_out = ((low[j] < low[i]) | (high[i] < high[j])).any(axis=1)
    shared = np.where(j_sticks_out, Rcc8.TPP, Rcc8.EQ)
    split = np.where(i_sticks_out, np.where(j_sticks_out, Rcc8.PO, Rcc8.TPPI), shared)
    return np.where(relations == Relation.OVERLAPPING, split, _WHERE_PROVEN[relations]).astype(np.int8)


def detail_of(first: Solid, second: Solid, poses: result.Poses, relation: Relation, work: result.Work) -> Rcc8 | None:
    """Return the RCC-8 relation of a checked pair with a known relation; None if a body has no interior."""
    if relation != Relation.OVERLAPPING:
        if not (has_interior(first, work.budget) and has_interior(second, work.budget)):
            return None
        return UNLESS_OVERLAPPING[relation]
    if poses[0] is not None and poses[0] == poses[1]:
        poses = None, None
    _, function, is_swapped = pair_function(first, second)
    if is_swapped:
        parts = function(second, first, poses[::-1], work).swapped()
    else:
        parts = function(first, second, poses, work)
    if parts.first:
        return Rcc8.PO if parts.second else (Rcc8.TPPI if parts.meet else Rcc8.NTPPI)
    return (Rcc8.TPP if parts.meet else Rcc8.NTPP) if parts.second else Rcc8.EQ


def has_interior(solid: Solid, budget: Budget) -> bool:
    """Return whether a solid contains an open set; cached."""

    def find() -> bool:
        if isinstance(solid, (HalfSpace, Sphere)):
            return isinstance(solid, HalfSpace) or solid.radius > 0.0
        if isinstance(solid, Aabb):
            return bool((solid.min < solid.max).all())
        if solid.dimension == 2:
            is_simple = bool(outline_arrays(solid, budget)[2].any())
            return is_simple or bool(live_edges(outline_of(solid, None, budget), budget))
        mesh = mesh_body_of(solid)
        return mesh.has_inside and any(any(live_parts(mesh, face, budget)) for face in range(len(mesh.faces)))

    return solid.prepared("has_interior", find, budget.check)
