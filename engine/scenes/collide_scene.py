"""Public: all colliding pairs of a scene of up to thousands of bodies, and all pairs nearer than a gap.

Gaps of boxes along the axes, balls and convex bodies are measured in batches (closed_forms.py, convex_gaps.py), all
others as by `clearance_poses`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar, Final, Literal, NamedTuple, Unpack, overload

import numpy as np

from engine.bounding.box_grid import BLOCK, pairs_of_boxes
from engine.collision.batches import SceneBatches, SceneBodies, scene_bodies
from engine.collision.codes import UNSETTLED
from engine.collision.collide import NO_DETAIL, Answers, accuracy_of, check_has_detail, has_interior
from engine.collision.convex_body import pool_bodies
from engine.collision.meshes.placement import PoseArrays
from engine.collision.result import Clearance, Witness, Work
from engine.compiling.jit import entry_of
from engine.distance.clearance import checked_distance, has_plane
from engine.distance.convex_gaps import gaps_of_pairs
from engine.distance.forms import are_small, between_body_and_plane, distances_under_poses, gap_of_planes
from engine.distance.spreads import SpreadPair, in_space
from engine.errors import IndexOutOfRangeError, InvalidArrayError
from engine.running.budget import Budget, Cancel
from engine.running.parallel import Options, Progress, check_options, run_chunks
from engine.scenes.pair_groups import grouped, of_one_pose, runs_of, settle_pairs
from engine.solids.accepted import PosesLike, SolidsLike
from engine.solids.columns import Columns
from engine.solids.ragged import are_among, ascending
from engine.types import Accuracy, BoolArray, FloatArray, Int8Array, IntArray, Relation, read_only

_FEW_PAIRS: Final = 8
"""Largest number of pairs decided one by one, which is faster than filling arrays for so few."""
_BYTES: Final = 64
_BYTES_OF_WITNESS: Final = 150
"""Memory of a colliding pair with witness: in its block, concatenated, and sorted."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ScenePairs(Columns):
    """The colliding pairs of a scene, sorted by first, then second; with a gap also the pairs nearer than that.

    Attributes
    ----------
    first, second : ndarray of int64, shape (n_pairs,)
        Indices of bodies, first < second.
    relation : ndarray of int8, shape (n_pairs,)
        `Relation` of the first to the second, DISJOINT only where a gap was given.
    witnesses : tuple of Witness or None
        One a pair, where asked for.
    detail : ndarray of int8, shape (n_pairs,), or None
        Codes of `Rcc8`, -1 where a body has no interior, where asked for.
    distance : ndarray of float64, shape (n_pairs,), or None
        As `clearance` gives it, 0.0 where they meet; where a gap was given and boolean was not.
    """

    _rows: ClassVar[str] = "pairs"
    first: IntArray
    second: IntArray
    relation: Int8Array
    witnesses: tuple[Witness | None, ...] | None = None
    detail: Int8Array | None = None
    distance: FloatArray | None = None

    def __iter__(self) -> Iterator[tuple[int, int, Relation]]:
        """Yield both bodies of each pair, and how the first relates to the second."""
        return zip(self.first.tolist(), self.second.tolist(), map(Relation, self.relation.tolist()))


class PairOptions(Options, total=False):
    """Keyword arguments of `collide_scene`, except `report`, which changes the return type."""

    skip: object
    only: object
    gap: float | None
    witnesses: bool
    boolean: bool
    detail: bool


@overload
def collide_scene(
    solids: SolidsLike,
    poses: PosesLike | None = None,
    *,
    report: Literal[False] = False,
    **options: Unpack[PairOptions],
) -> ScenePairs: ...
@overload
def collide_scene(
    solids: SolidsLike, poses: PosesLike | None = None, *, report: Literal[True], **options: Unpack[PairOptions]
) -> tuple[ScenePairs, Accuracy]: ...
def collide_scene(
    solids: SolidsLike,
    poses: PosesLike | None = None,
    *,
    skip: object = None,
    only: object = None,
    gap: float | None = None,
    witnesses: bool = False,
    boolean: bool = False,
    detail: bool = False,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> ScenePairs | tuple[ScenePairs, Accuracy]:
    """Find every pair of bodies with a common point, and how they relate, exactly.

    Parameters
    ----------
    solids : sequence of Solid
        Bodies of one dimension, of the types that `collide` accepts; one object may stand for many bodies.
    poses : sequence of Pose or None, optional
        One for each solid.
    skip : array_like, shape (n, 2), optional
        Pairs of indices to leave out, in either order.
    only : array_like, shape (n, 2), optional
        The only pairs to test.
    gap : float, optional
        A distance; pairs that do not meet but are nearer than that, exactly, are reported too, as disjoint.
    witnesses : bool, default False
        Also return the witness of each pair.
    boolean : bool, default False
        Only decide disjoint or not: every pair that meets is answered as touching, and no distance is measured.
    detail : bool, default False
        Also decide the relation of RCC-8, as `collide`; no body may be a surface.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts candidate pairs.

    Returns
    -------
    ScenePairs
        With ``report=True`` a pair of it and an `Accuracy` whose items are the candidate pairs.

    Raises
    ------
    IndexOutOfRangeError, InvalidArrayError
        For `skip` and `only`.
    InvalidInputError
        `gap` is negative or not finite.
    EngineError
        As `collide`, with the index of the body.

    Notes
    -----
    Broad phase: boxes around the posed bodies, by a grid, or by a sweep where sizes are mixed. Narrow phase: pairs of
    boxes, balls and convex polyhedra are decided in batches where float64 with a proven margin can, outlines of the
    plane by exact signs, in contact too; all others, contacts above all, as by `collide`.

    Boundary and degenerate input: as `collide`; a pair exactly as far apart as the gap is clear. An empty scene has no
    pairs; two surfaces touch or are disjoint.

    Accuracy: exact.

    Cost: n log n for the boxes, 1 us or less for each pair that a batch decides, then as `collide`; with a gap as
    `clearance` for the pairs whose boxes are nearer than that, but for boxes and balls.

    References
    ----------
    Ericson, Real-Time Collision Detection, 2005, chapter 7; Baraff, Dynamic simulation of non-penetrating rigid bodies,
    1992 (sweep and prune).

    Examples
    --------
    >>> from engine import Aabb, Pose
    >>> cube = Aabb([0, 0, 0], [1, 1, 1])
    >>> step = Pose([[1, 0, 0], [0, 1, 0], [0, 0, 1]], [1, 0, 0])
    >>> pairs = collide_scene([cube, cube, Aabb([5, 5, 5], [6, 6, 6])], [None, step, None])
    >>> pairs.first.tolist(), pairs.second.tolist(), [Relation(code).label for code in pairs.relation]
    ([0], [1], ['touching'])
    """
    check_options(workers, progress, report=report, witnesses=witnesses, boolean=boolean, detail=detail)
    query = PairQuery(skip, only, gap, witnesses, boolean, detail)
    with Budget(deadline, cancel, workers) as budget:
        batches = SceneBatches(scene_bodies(solids, poses))
        pairs = collide_bodies(batches, query, budget, workers, progress)
    return pairs if report else pairs[0]


class PairQuery(NamedTuple):
    """Options of a query about pairs of a scene, see `collide_scene`."""

    skip: object = None
    only: object = None
    gap: float | None = None
    witnesses: bool = False
    boolean: bool = False
    detail: bool = False


def collide_bodies(
    batches: SceneBatches, query: PairQuery, budget: Budget, workers: int | None, progress: Progress | None
) -> tuple[ScenePairs, Accuracy]:
    """Return the pairs of a prepared scene that collide, or are nearer than ``query.gap``, and the accuracy report."""
    bodies, (skip, only, gap, witnesses, boolean, detail) = batches.bodies, query
    boolean, detail = bool(boolean), bool(detail)  # what is not a bool would compile kernels of its own
    if detail:
        check_has_detail(((("solids", i), solid) for i, solid in enumerate(bodies.solids)), boolean)
    gap = None if gap is None else checked_distance(gap, "gap")
    budget.check()
    skipped = None if skip is None else pair_keys(skip, len(bodies.solids), "skip", budget)
    wanted = None if only is None else pair_keys(only, len(bodies.solids), "only", budget)
    parts: list[ScenePairs] = []
    works: list[Work] = []
    n_candidates = n_open = 0
    for pairs in _candidates(bodies, enlarged(bodies, gap), wanted, skipped, budget, workers):
        budget.check()
        relations = np.full(len(pairs), UNSETTLED, np.int8)
        named: list[Witness | None] | None = [None] * len(pairs) if witnesses else None
        if len(pairs) > _FEW_PAIRS:
            relations = batches.relations(pairs, boolean, detail, budget, workers, named)
        n_open += int((relations == UNSETTLED).sum())
        n_candidates += len(pairs)
        details = batches.details(pairs, relations) if detail else None
        answers = Answers(budget, boolean, relations, named, details)
        settle_pairs(bodies, pairs, answers, workers, progress)
        works += answers.works
        near = None
        if gap is not None:
            near, apart = np.zeros(len(pairs)), np.flatnonzero(answers.relations == Relation.DISJOINT)
            near[apart] = distances_below(batches, pairs[apart], gap, not boolean, budget, workers)
        parts.append(_select_pairs(bodies, pairs, answers, near))
        budget.take((_BYTES + _BYTES_OF_WITNESS * witnesses) * len(parts[-1].first))
    budget.check()
    if not parts:
        none, codes, distances = np.empty(0, np.int64), np.empty(0, np.int8), np.empty(0)
        is_near = gap is not None and not boolean
        parts = [ScenePairs(none, none, codes, () if witnesses else None, codes if detail else None,
                            distances if is_near else None)]  # fmt: skip
    accuracy = accuracy_of(n_candidates, n_open, works, "boxes" if only is None else "named pairs")
    return parts[0] if len(parts) == 1 else _concatenate(parts), accuracy


def _select_pairs(bodies: SceneBodies, pairs: IntArray, answers: Answers, near: FloatArray | None) -> ScenePairs:
    """Return the pairs (n, 2) of a block that collide or are nearer than the gap. answers: their relations; near: their
    distances, infinite if not below the gap; None without a gap."""
    meet = answers.relations != Relation.DISJOINT
    if answers.boolean:
        answers.relations[meet] = Relation.TOUCHING
    rows = np.flatnonzero(meet if near is None else near != np.inf)
    named = None if answers.witnesses is None else tuple(map(answers.witnesses.__getitem__, rows.tolist()))
    details = None if answers.details is None else answers.details[rows]
    if details is not None:
        details[~_have_interiors(bodies, pairs[rows], answers.budget)] = NO_DETAIL
    distances = None if near is None or answers.boolean else near[rows]
    return ScenePairs(pairs[rows, 0], pairs[rows, 1], answers.relations[rows], named, details, distances)


def _concatenate(parts: list[ScenePairs]) -> ScenePairs:
    """Return the pairs of all sorted blocks as one sorted result."""
    columns = zip(*((part.first, part.second, part.relation, part.detail, part.distance) for part in parts))
    joined: list[Any] = [None if column[0] is None else np.concatenate(column) for column in columns]
    order = np.argsort(joined[0] * (int(joined[1].max(initial=0)) + 1) + joined[1], kind="stable")  # merges blocks
    ordered: list[Any] = [None if column is None else column[order] for column in joined]
    named = [witness for part in parts for witness in part.witnesses or ()]
    witnesses = None if parts[0].witnesses is None else tuple(map(named.__getitem__, order.tolist()))
    first, second, relation, detail, distance = ordered
    return ScenePairs(first, second, relation, witnesses, detail, distance)


def _have_interiors(bodies: SceneBodies, pairs: IntArray, budget: Budget) -> BoolArray:
    """Return, for each pair, whether both bodies have an interior."""
    kinds, places = np.unique(bodies.kinds[pairs], return_inverse=True)
    solid = np.array([has_interior(bodies.distinct[kind], budget) for kind in kinds.tolist()], np.bool_)
    first, second = places.reshape(-1, 2).T
    return solid[first] & solid[second]


def _candidates(
    bodies: SceneBodies,
    low: FloatArray,
    wanted: IntArray | None,
    skipped: IntArray | None,
    budget: Budget,
    workers: int | None,
) -> Iterator[IntArray]:
    """Yield sorted blocks of pairs (m, 2) whose boxes intersect (broad phase). low: low corners of the boxes, moved
    outward by the gap. wanted, skipped: keys first * n + second to which pairs are restricted, and that are left out;
    None for no restriction."""
    n_bodies = len(bodies.solids)
    if n_bodies < 2 or (wanted is not None and not len(wanted)):
        return
    if wanted is None:
        blocks = pairs_of_boxes(low, bodies.high, budget, workers=workers)
    else:
        blocks = _meeting(low, bodies.high, wanted)
    for pairs in blocks:
        yield pairs if skipped is None else pairs[~are_among(pairs[:, 0] * n_bodies + pairs[:, 1], skipped)]


def _meeting(low: FloatArray, high: FloatArray, keys: IntArray) -> Iterator[IntArray]:
    """Yield blocks (m, 2) of the pairs, given as keys first * n + second, whose boxes low, high (n, d) intersect."""
    for start in range(0, len(keys), BLOCK):
        first, second = np.divmod(keys[start : start + BLOCK], len(low))
        meet = (first < second) & ((low[first] <= high[second]) & (low[second] <= high[first])).all(axis=1)
        yield np.stack([first[meet], second[meet]], axis=1)


def pair_keys(named: Any, n_bodies: int, name: str, budget: Budget) -> IntArray:
    """Return the keys first * n_bodies + second, first <= second, of the caller's pairs `named`, each once, ascending.
    name: of the argument, for errors. Raises InvalidArrayError or IndexOutOfRangeError for what is no array of pairs of
    bodies."""
    try:
        array = np.asarray(named)
    except ValueError:
        message = f"{name} must be pairs of indices (n, 2), got rows of several lengths"
        raise InvalidArrayError(message, (name,)) from None
    if array.size == 0:
        return np.empty(0, np.int64)
    if array.ndim != 2 or array.shape[1] != 2 or array.dtype.kind not in "iu":
        got = f"{array.dtype} values of shape {array.shape}"
        raise InvalidArrayError(f"{name} must be pairs of integers (n, 2), indices of bodies, got {got}", (name,))
    budget.take(_BYTES * len(array))
    wrong = np.flatnonzero(((array < 0) | (array >= n_bodies)).any(axis=1))
    if len(wrong):
        row = int(wrong[0])
        message = f"{name}[{row}] = {array[row].tolist()} names a body that is not there; the scene has {n_bodies}"
        raise IndexOutOfRangeError(message, (name, row))
    first, second = array.astype(np.int64).T
    budget.check()
    return ascending(np.minimum(first, second) * n_bodies + np.maximum(first, second))


_STRETCHED: Final = 1.0 + 2.0**-38
"""R'R = I + E with |E_ij| <= 1e-12: |R v|^2 <= (1 + 3e-12) |v|^2, so |R v| < (1 + 2^-38) |v|. Needed since boxes are
posed, while `collide` leaves out poses that both bodies have in common."""
_NONE: Final = pool_bodies([])


def enlarged(bodies: SceneBodies, gap: float | None) -> FloatArray:
    """Return the low corners (n, d) of the boxes moved outward by the gap, so that boxes of bodies nearer than that
    intersect."""
    return bodies.low if gap is None else np.nextafter(bodies.low - gap * _STRETCHED, -np.inf)


def distances_below(
    batches: SceneBatches, pairs: IntArray, gap: float, is_measured: bool, budget: Budget, workers: int | None
) -> FloatArray:
    """Return the distances (n,) of disjoint pairs nearer than the gap, infinite for others; exact. is_measured: if
    False, pairs nearer than the gap get 0.0 instead."""
    bodies, distances = batches.bodies, np.full(len(pairs), np.inf)
    if not gap:
        return distances
    places = pairs + 1
    kinds = bodies.kinds[pairs]
    turns, moves = bodies.rotations, bodies.translations
    places[of_one_pose(bodies, pairs)] = 0  # left out, as by `collide`
    forms = batches.pairs.forms()
    pool, convex = _NONE, np.full(len(forms), -1, np.int64)
    if bodies.dimension == 3 and (bodies.is_posed[pairs].any() or np.isnan(forms[kinds, 0]).any()):
        pool, convex = batches.pairs.pool(budget)

    def by_batch(start: int, stop: int) -> None:
        entry_of(gaps_of_pairs)(
            forms, pool, convex, kinds[start:stop], PoseArrays(turns, moves, True), places[start:stop], gap,
            is_measured, distances[start:stop], budget.flag,
        )  # fmt: skip

    run_chunks(by_batch, len(pairs), budget=budget, workers=workers)
    still = np.flatnonzero(np.isnan(distances))
    still, ends = grouped(still, kinds[still, 0] * len(forms) + kinds[still, 1])  # one query for the same two solids

    def by_search(start: int, stop: int) -> None:
        for rows in runs_of(still, ends, start, stop):
            distances[rows] = _distances_of_group(bodies, pairs[rows], places[rows], gap, is_measured, budget)

    run_chunks(by_search, len(still), budget=budget, first_chunk=4, workers=workers)
    return distances


def _distances_of_group(
    bodies: SceneBodies, pairs: IntArray, places: IntArray, gap: float, is_measured: bool, budget: Budget
) -> FloatArray:
    """Return the distances (n,) of disjoint pairs of bodies (n, 2), all of the same two solids; exact; infinite for
    those not nearer than the gap. places (n, 2): the rows of their poses. is_measured: if False, pairs nearer than the
    gap get 0.0 instead of their distance."""
    first, second = (bodies.solids[number] for number in pairs[0].tolist())
    distances = np.full(len(pairs), np.nan)
    if has_plane(first, second):
        for item, ((i, j), place) in enumerate(zip(pairs.tolist(), places[:, 0].tolist())):
            budget.check()
            placed = (bodies.poses[i], bodies.poses[j]) if place else (None, None)
            known = between_body_and_plane(first, second, placed, None)
            if isinstance(known, Clearance) and known.distance != gap:
                distances[item] = np.inf if known.distance > gap else known.distance if is_measured else 0.0
                continue
            apart, _ = gap_of_planes(first, second, placed, budget)
            distances[item] = np.inf if apart.is_at_least(Fraction(gap)) else apart.distance() if is_measured else 0.0
        return distances
    if are_small(first, second):
        motions = [read_only(some[rows]) for rows in places.T for some in (bodies.rotations, bodies.translations)]
        distances = distances_under_poses(first, second, motions, None if is_measured else Fraction(gap), budget)
        distances[distances > gap], distances[distances == gap] = np.inf, np.nan
        if not np.isnan(distances).any():
            return distances
    own, others = (in_space(bodies.rotations[rows], bodies.translations[rows]) for rows in places.T)
    pair = SpreadPair(first, second, own, others, budget)
    pair.fill(0, len(pairs), distances, Fraction(gap))
    if is_measured:
        distances[distances == 0.0] = np.nan
        pair.fill(0, len(pairs), distances)
    return distances
