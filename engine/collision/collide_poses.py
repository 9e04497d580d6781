"""Public: one pair of solids under many rigid poses of the second."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any, Literal, Unpack, overload

import numpy as np

from engine.collision import collide as one_pair
from engine.collision.batches import posed_batch
from engine.collision.codes import DISJOINT, N_COLUMNS, N_CONTACTS, OVERLAPPING, RELATION, UNSETTLED
from engine.collision.meshes.contact_kinds import N_NAMED
from engine.collision.meshes.dual_traversal import PIERCING, SEEK_CROSSING, SEEK_OVERLAP
from engine.collision.meshes.mesh_arrays import STATE_STACKED, STILL, mesh_body_of
from engine.collision.meshes.mesh_mesh import decode_row, relation_from_kernel
from engine.collision.meshes.mesh_pair import SPACE, search_goal
from engine.collision.meshes.parity import states_of
from engine.collision.meshes.placement import PoseArrays
from engine.collision.meshes.pose_batch import ONE_SETTLES, relate_poses
from engine.collision.result import RELATIONS, SWAPPED_RELATION, UNCOUNTED, Collision, PoseRelations, Work, has_faces
from engine.collision.simple.against_ball import centers_in_frame, named, relate_balls
from engine.collision.simple.closed_forms import relation_closed_form
from engine.compiling.jit import entry_of
from engine.running.budget import Budget, Cancel, reading
from engine.running.parallel import Options, Progress, check_options, run_chunks
from engine.solids.accepted import PosesLike, SolidLike
from engine.solids.base import Solid
from engine.solids.checks import as_floats, is_ready
from engine.solids.mesh import is_large
from engine.solids.pose import Pose, motion_of
from engine.solids.poses import Poses, as_pose_arrays, check_pose_arrays
from engine.solids.primitives import Sphere
from engine.solids.rotations import is_certified_rotation
from engine.types import Accuracy, FloatArray, IntArray, read_only

PoseCollisions = PoseRelations | tuple[Any, ...]
"""Relations; then witnesses, then details, where asked for."""


@overload
def collide_poses(
    first: SolidLike,
    second: SolidLike,
    rotations: PosesLike,
    translations: object = None,
    *,
    witnesses: Literal[False] = False,
    detail: Literal[False] = False,
    report: Literal[False] = False,
    boolean: bool = False,
    **options: Unpack[Options],
) -> PoseRelations: ...
@overload
def collide_poses(
    first: SolidLike,
    second: SolidLike,
    rotations: PosesLike,
    translations: object = None,
    *,
    witnesses: bool = False,
    detail: bool = False,
    report: bool = False,
    boolean: bool = False,
    **options: Unpack[Options],
) -> Any: ...
def collide_poses(
    first: SolidLike,
    second: SolidLike,
    rotations: PosesLike,
    translations: object = None,
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
    """Decide how `first` relates to `second` moved by each of many poses, exactly.

    Parameters
    ----------
    first, second : Solid
        As for `collide`.
    rotations : array_like, shape (n_poses, d, d)
        Row-major; vertices map exactly to R p + t. Without translations: `Poses`, a list of `Pose` (or of matrices), or
        matrices (n_poses, d + 1, d + 1).
    translations : array_like, shape (n_poses, d), optional
        Of the second body.
    witnesses : bool, default False
        Also return the witness of every pose.
    boolean : bool, default False
        Only decide disjoint or not; any other relation may be answered as touching.
    detail : bool, default False
        Also decide the relation of RCC-8, as `collide`.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts poses.

    Returns
    -------
    ndarray of int8, shape (n_poses,)
        Codes of `Relation`; its `first_contact` is the first pose in which the bodies meet, None if they never do. With
        `witnesses` a pair of it and a list of `Witness`, None where disjoint; with
        ``report=True`` a pair of the answer and an `Accuracy`.

    Raises
    ------
    NotRigidError, NotFiniteError, InvalidArrayError
        The message names the pose.
    EngineError
        As `collide`.

    Notes
    -----
    Only the given poses are tested: a collision between two poses is not detected.

    Boundary, degenerate input, accuracy: as `collide`. Empty arrays give an empty answer.

    Cost: the structures of both solids are built once; most poses are decided in compiled code, in parallel chunks of
    2 to 20 ms. A pose costs the pairs of faces near each other.

    References
    ----------
    Gottschalk, Lin, Manocha, OBBTree, 1996 (dual traversal); Snethen, XenoCollide, 2008 (convex pairs).

    Examples
    --------
    >>> from engine import Aabb
    >>> box = Aabb([0, 0, 0], [1, 1, 1])
    >>> turns = np.broadcast_to(np.eye(3), (3, 3, 3))
    >>> collide_poses(box, box, turns, [[0.5, 0, 0], [1, 0, 0], [2, 0, 0]]).tolist()
    [3, 4, 0]
    """
    are_plain = type(report) is type(witnesses) is type(boolean) is type(detail) is bool
    if workers is not None or progress is not None or not are_plain:
        check_options(workers, progress, report=report, witnesses=witnesses, boolean=boolean, detail=detail)
    if not (isinstance(first, Solid) and isinstance(second, Solid)):
        first, second, deadline = one_pair.read_pair(first, second, deadline, cancel)
    one_pair.pair_function(first, second)
    if detail:
        one_pair.check_has_detail(((("first",), first), (("second",), second)), boolean)
    poses, deadline = read_poses(rotations, translations, first.dimension, workers, deadline, cancel)
    n_poses = len(poses.rotations)
    is_free = deadline is None and cancel is None and progress is None
    if n_poses == 1 and is_free and not (detail or report) and (workers is None or not is_large(first, second)):
        one = _collide_pose(first, second, poses, UNCOUNTED[bool(witnesses), bool(boolean)])
        alone = _ALONE[one.relation].copy()
        return (alone, [one.witness]) if witnesses else alone
    with Budget(deadline, cancel, workers) as budget:
        budget.check()
        has_detail = detail and one_pair.has_interior(first, budget) and one_pair.has_interior(second, budget)
        details, relations = np.full(n_poses, one_pair.NO_DETAIL, np.int8), np.full(n_poses, UNSETTLED, np.int8)
        witness_list: one_pair.Witnesses | None = [None] * n_poses if witnesses else None
        answers = one_pair.Answers(budget, bool(boolean), relations, witness_list, details if has_detail else None)
        fill = batch_of(first, second, poses, answers)
        if fill is None and not is_large(first, second):
            workers = 1  # each pose is Python code, which two threads run slower than one

        def pair_of(item: int) -> one_pair.PlacedPair:
            return first, second, (None, Pose.of_checked(poses.rotations[item], poses.translations[item]))

        def task(start: int, stop: int) -> None:
            if fill is not None:
                fill(start, stop)
            if has_detail:
                details[start:stop] = one_pair.details_where_proven(relations[start:stop])
            answers.settle(answers.left(start, stop), pair_of)

        run_chunks(task, n_poses, budget=budget, first_chunk=8, workers=workers, progress=progress)
    codes = relations.view(PoseRelations)
    parts = (codes, *([] if witness_list is None else [witness_list]), *([details] if detail else []))
    result: Any = parts if len(parts) > 1 else parts[0]
    if not report:
        return result
    return result, one_pair.accuracy_of(n_poses, 0, answers.works, "+".join(sorted({first.type, second.type})))


_ALONE = [np.array([relation], np.int8).view(PoseRelations) for relation in RELATIONS]


def _collide_pose(first: Solid, second: Solid, poses: PoseArrays, work: Work) -> Collision:
    """Return the relation of the first solid and the second under the only pose in `poses`. Closed forms and the mesh
    kernel read the arrays; a `Pose`, whose constructor takes as long as a decision, is made for other pairs alone."""
    if first.type == "aabb" or first.type == second.type == "sphere":
        motion = poses.rotations[0], poses.translations[0]
        closed_form = relation_closed_form(first, second, motion_of(None, first.dimension), motion, work)
        if closed_form is not None:
            return closed_form
    if first.dimension == 3 and has_faces(first) and has_faces(second):
        answer = relation_from_kernel(mesh_body_of(first), mesh_body_of(second), (STILL, poses), work)
        if isinstance(answer, Collision):
            return answer
    pose = Pose.of_checked(poses.rotations[0], poses.translations[0])
    return one_pair.collide_pair(first, second, (None, pose), work)


def read_poses(
    rotations: object, translations: object, dimension: int, workers: int | None, deadline: float | None,
    cancel: Cancel | None,
) -> tuple[PoseArrays, float | None]:  # fmt: skip
    """Return poses in any form as checked arrays, and the seconds left."""
    if translations is None:
        only = rotations[0] if type(rotations) is list and len(rotations) == 1 else None
        if type(only) is Pose and len(only.translation) == dimension:
            return PoseArrays(only.rotation[None], only.translation[None], True), deadline
        if type(rotations) is not Poses:
            with reading(deadline, cancel) as reader:
                rotations, translations = as_pose_arrays(rotations, dimension)
            deadline = reader.left()
    return PoseArrays(*as_poses(rotations, translations, dimension, workers), True), deadline


def as_poses(
    rotations: object, translations: object, dimension: int, workers: int | None = 1
) -> tuple[FloatArray, FloatArray]:
    """Return checked rotations (n, d, d) and translations (n, d), read-only."""
    if translations is None:
        if type(rotations) is Poses and rotations.dimension == dimension:
            return rotations.rotations, rotations.translations
        rotations, translations = as_pose_arrays(rotations, dimension)
    turn: Any = rotations
    move: Any = translations
    if is_ready(turn, dimension, dimension) and is_ready(move, dimension) and len(turn) == 1 == len(move):
        turn, move = read_only(turn), read_only(move)
        if isfinite(sum(move[0].tolist())) and is_certified_rotation(turn):
            return turn, move
    turns, moves = as_floats(rotations, 3, ("rotations",)), as_floats(translations, 2, ("translations",))
    turns, moves = check_pose_arrays(turns, moves, dimension, workers=workers)
    return read_only(turns), read_only(moves)


_BALL_AND_MESH = ({"sphere", "polyhedron"}, {"sphere", "surface"})


def batch_of(
    first: Solid, second: Solid, poses: PoseArrays, answers: one_pair.Answers, own: PoseArrays | None = None
) -> Callable[[int, int], None] | None:
    """Return a task by which kernels fill the relations, and requested witnesses, of answers[start:stop], one entry a
    pose of the second solid; UNSETTLED where they cannot decide. None if no kernel takes the pair. own: as many poses
    of the first; then the batch of convex bodies is left out, which the caller asked."""
    types = {first.type, second.type}
    budget, relations, witnesses = answers.budget, answers.relations, answers.witnesses
    is_named = witnesses is not None  # then a search for contacts follows where both have faces, which decides all
    is_posed_box = types == {"sphere", "aabb"} and (own is not None or (is_named and second.type == "aabb"))
    if types in _BALL_AND_MESH or (is_posed_box and first.dimension == 3):
        return _ball_batch(first, second, poses, answers, own)
    if is_posed_box and is_named:  # in the plane: what a disc meets is an edge
        return None
    has_detail = answers.details is not None
    have_faces = first.dimension == 3 and has_faces(first) and has_faces(second)
    is_coarse = answers.boolean or (is_named and have_faces)
    batch = None
    if own is None:
        batch = posed_batch(first, second, poses, relations, is_coarse, has_detail, budget, witnesses)
    if not have_faces:
        return batch
    a, b = mesh_body_of(first), mesh_body_of(second)
    seek = search_goal(a, b, Work(budget, is_named, answers.boolean))
    if has_detail and seek == SEEK_OVERLAP:  # it is known of overlaps that a crossing proves
        seek = SEEK_CROSSING

    def fill(start: int, stop: int) -> None:
        if batch is not None:
            batch(start, stop)
        items: IntArray | slice = slice(start, stop) if batch is None else answers.left(start, stop)
        some, still = poses_at(poses, items), STILL if own is None else poses_at(own, items)
        rows = np.empty((len(some.rotations), N_COLUMNS), np.int64)
        if not len(rows):
            return
        entry_of(relate_poses)(
            a.arrays, b.arrays, still, some, seek, N_NAMED if is_named else 0, SPACE.descent, SPACE.contacts, 0, rows,
            budget.flag,
        )  # fmt: skip
        budget.check()
        if has_detail:  # those speak of overlaps that a crossing proves
            rows[(rows[:, RELATION] == OVERLAPPING) & (rows[:, N_CONTACTS] != ONE_SETTLES), RELATION] = UNSETTLED
        relations[items] = rows[:, RELATION]
        if witnesses is not None:
            numbers = range(start, stop) if isinstance(items, slice) else items.tolist()
            pierces = (rows[:, N_CONTACTS] == ONE_SETTLES) & (seek in PIERCING)
            for item, answer in zip(numbers, map(decode_row, *rows[:, :N_CONTACTS].T.tolist(), pierces.tolist())):
                if answer is not None:
                    witnesses[item] = answer.witness

    return fill


def poses_at(poses: PoseArrays, items: IntArray | slice) -> PoseArrays:
    """Return some of the poses."""
    return PoseArrays(read_only(poses.rotations[items]), read_only(poses.translations[items]), poses.is_posed)


_SWAPPED = np.array([*(SWAPPED_RELATION.get(relation, relation) for relation in RELATIONS), UNSETTLED], np.int8)
"""Relation of the two bodies in the other order, by relation; the last entry is UNSETTLED."""


def _ball_batch(
    first: Solid, second: Solid, poses: PoseArrays, answers: one_pair.Answers, own: PoseArrays | None
) -> Callable[[int, int], None]:
    """Return a task that fills answers[start:stop] for a ball and a mesh, in either order, under these poses of the
    second, and `own` of the first; UNSETTLED where floats prove nothing."""
    is_swapped = isinstance(first, Sphere)
    body, ball = (second, first) if is_swapped else (first, second)
    assert isinstance(ball, Sphere)
    mesh = mesh_body_of(body)

    def fill(start: int, stop: int) -> None:
        some = slice(start, stop)
        moves = [poses_at(each, some)[:2] if each is not None and each.is_posed else None for each in (own, poses)]
        centers = centers_in_frame(ball, *(moves[::-1] if is_swapped else moves))
        results = np.empty((stop - start, 2), np.int64)
        is_named = answers.witnesses is not None
        entry_of(relate_balls)(mesh.arrays, centers, float(ball.radius), is_named, results, answers.budget.flag)
        answers.budget.check()
        relations, triangles = results.T
        overlapping = np.flatnonzero(relations == OVERLAPPING)
        # That a face enters says nothing of the detail, and nothing at all where even-odd cancels it.
        is_open = answers.details is not None or states_of(mesh.arrays, triangles[overlapping]) == STATE_STACKED
        relations[overlapping] = np.where(is_open, UNSETTLED, OVERLAPPING)
        answers.relations[start:stop] = _SWAPPED[relations] if is_swapped else relations
        if is_named:
            assert answers.witnesses is not None
            rows = np.flatnonzero(relations > DISJOINT)
            faces = np.where(relations[rows] >= OVERLAPPING, mesh.faces[triangles[rows]], -1)
            for row, relation, face in zip(rows.tolist(), relations[rows].tolist(), faces.tolist()):
                answers.witnesses[start + row] = named(relation, face, is_swapped).witness

    return fill
