"""Public: how two solids lie to each other. One table from the two types to the function that decides."""

from __future__ import annotations

from typing import Literal, Unpack, overload

from engine.collision.detail import check_has_detail, detail_of
from engine.collision.pairs import PAIRS
from engine.collision.result import Collision, PairFunction, Work
from engine.errors import InvalidArrayError, UnsupportedPairError, UnsupportedSolidError, WrongDimensionError
from engine.parallel import Budget, Cancel, Options, Progress, check_options
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.types import Accuracy

TAKEN = {2: "polygon, triangle, aabb, sphere, half_space", 3: "polyhedron, surface, aabb, sphere, half_space"}


def pair_function(first: Solid, second: Solid) -> tuple[PairFunction, bool]:
    """Return the function of a pair and whether it wants the two in the other order."""
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
    function = PAIRS.get((first.dimension, first.type, second.type))
    if function is not None:
        return function, False
    function = PAIRS.get((second.dimension, second.type, first.type))
    if function is not None:
        return function, True
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


def collide_pair(
    first: Solid, second: Solid, first_pose: Pose | None, second_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of two checked solids under checked poses, within the budget of `work`.

    Two equal poses are left out: what moves together keeps its relation, although a rotation of floats is not quite
    orthogonal and a ball's radius is kept under it.
    """
    if first_pose is not None and first_pose == second_pose:
        first_pose = second_pose = None
    function, is_swapped = pair_function(first, second)
    if is_swapped:
        return function(second, first, second_pose, first_pose, work).swapped()
    return function(first, second, first_pose, second_pose, work)


class CollideOptions(Options, total=False):
    """What `collide` takes by name, but for `report`, which changes what it returns."""

    first_pose: Pose | None
    second_pose: Pose | None
    boolean: bool
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
    that is wanted; any other relation may then be answered as touching, sooner, without a witness. detail: say which of
    the eight relations of RCC-8 (`Rcc8`) too, in `Collision.detail`: disjoint is DC, touching EC, inside NTPP, NTPPi;
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
    where faces cross, about 1 ms for each face in contact where bodies lie flush.
    Raises: UnsupportedSolidError, UnsupportedPairError, WrongDimensionError, InvalidArrayError, InvalidInputError
    (boolean with detail), DeadlineExceededError, CancelledError.

    >>> from engine import Aabb
    >>> collide(Aabb([0, 0, 0], [1, 1, 1]), Aabb([1, 0, 0], [2, 1, 1])).relation.label
    'touching'
    >>> collide(Aabb([0, 0, 0], [1, 1, 1]), Aabb([0, 0, 0], [2, 2, 2]), detail=True).detail.label
    'TPP'
    """
    pair_function(first, second)
    check_pose(first_pose, first, "first_pose")
    check_pose(second_pose, second, "second_pose")
    check_options(workers, progress)
    if detail:
        check_has_detail(((("first",), first), (("second",), second)), boolean)
    with Budget(deadline, cancel) as budget:
        budget.check()
        work = Work(budget, witness=not boolean, boolean=boolean)
        result = collide_pair(first, second, first_pose, second_pose, work)
        if detail:
            named = detail_of(first, second, first_pose, second_pose, result.relation, work)
            result = Collision(result.relation, result.witness, named)
    if progress is not None:
        progress(1)
    if not report:
        return result
    method = "+".join(sorted({first.type, second.type}))
    return result, Accuracy("exact", None, 1, work.n_beyond_filter, work.n_rational, method)
