"""Pairs of bodies of a scene that batches leave open, by kernels for all pairs of the same two solids, on threads.

One kernel call relates many pairs of the same two meshes, or of a ball and a mesh, as many poses of one pair; a thread
holds the interpreter lock between two calls alone. Pairs that a kernel leaves open, or of which there are few, are
decided one by one.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, Final

import numpy as np

from engine.collision.batches import SceneBodies
from engine.collision.codes import UNSETTLED
from engine.collision.collide import NO_DETAIL, Answers, PlacedPair, details_where_proven
from engine.collision.collide_poses import batch_of
from engine.collision.meshes.placement import PoseArrays
from engine.running.parallel import Progress, run_chunks
from engine.types import BoolArray, IntArray

_FEW: Final = 7
"""Most pairs of the same two solids that are decided one by one sooner than by a kernel for many."""
_FEW_IN_ALL: Final = 64
"""Most pairs that are decided one by one sooner than put in groups."""


def grouped(items: IntArray, keys: IntArray) -> tuple[IntArray, IntArray]:
    """Return items sorted by their keys, of equal ones in their order, and where each run of equal keys ends."""
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    return items[order], np.append(np.flatnonzero(keys[1:] != keys[:-1]) + 1, len(keys))


def runs_of(items: IntArray, ends: IntArray, start: int, stop: int) -> Iterator[IntArray]:
    """Yield the parts of items[start:stop] between the given ends."""
    inner = ends[np.searchsorted(ends, start, "right") : np.searchsorted(ends, stop)].tolist()
    yield from (items[begin:end] for begin, end in pairwise([start, *inner, stop]))


def of_one_pose(bodies: SceneBodies, pairs: IntArray) -> IntArray:
    """Return the indices of the pairs (n, 2) of bodies under equal poses."""
    (i, j), turns, moves = pairs.T + 1, bodies.rotations, bodies.translations
    equal = np.flatnonzero(moves[i, 0] == moves[j, 0])
    equal = equal[(moves[i[equal]] == moves[j[equal]]).all(axis=1)]
    result: IntArray = equal[(turns[i[equal]] == turns[j[equal]]).all(axis=(1, 2))]
    return result


def settle_pairs(
    bodies: SceneBodies, pairs: IntArray, answers: Answers, workers: int | None, progress: Progress | None
) -> None:
    """Decide those pairs (n, 2) of a block that the batches left UNSETTLED, and write to `answers`."""
    left = answers.left()
    if progress is not None and len(left) < len(pairs):
        progress(len(pairs) - len(left))
    if not len(left):
        return
    are_few, ends = len(left) <= _FEW_IN_ALL, left
    if not are_few:
        left, ends = grouped(left, _keys_of(bodies, pairs[left]))

    def pair_of(item: int) -> PlacedPair:
        i, j = pairs[item].tolist()
        return bodies.solids[i], bodies.solids[j], (bodies.poses[i], bodies.poses[j])

    def task(start: int, stop: int) -> None:
        if are_few:
            answers.settle(left[start:stop], pair_of)
            return
        for items in runs_of(left, ends, start, stop):
            answers.settle(_relate_group(bodies, pairs, items, answers) if len(items) > _FEW else items, pair_of)

    run_chunks(task, len(left), budget=answers.budget, first_chunk=4, workers=workers, progress=progress)


def _keys_of(bodies: SceneBodies, pairs: IntArray) -> IntArray:
    """Return a number for each pair (n, 2), equal for pairs that one kernel call may relate: of the same two solids,
    each posed in both or in neither; one of its own for a pair under equal poses, and where no kernel helps. A ball
    before a posed box has a witness on a face, which a kernel for many finds."""
    if bodies.dimension == 2:
        return np.arange(len(pairs))
    (i, j), n, turns = pairs.T, len(bodies.distinct), bodies.rotations[1:]
    is_moved = _are_any(turns != np.eye(3)) | _are_any(bodies.translations[1:] != 0.0)
    keys: IntArray = 4 * (bodies.kinds[i] * n + bodies.kinds[j]) + 2 * is_moved[i] + is_moved[j]
    types = np.array([solid.type for solid in bodies.distinct])
    is_ball, is_box = (types == "sphere")[bodies.kinds], (types == "aabb")[bodies.kinds]
    is_plain = is_ball | (is_box & ~_are_any(turns != np.rint(turns)))  # decided by that, alone
    is_posed_box = is_box & bodies.is_posed
    meets_face = (is_ball[i] & is_posed_box[j]) | (is_posed_box[i] & is_ball[j])
    alone = np.concatenate([of_one_pose(bodies, pairs), np.flatnonzero(is_plain[i] & is_plain[j] & ~meets_face)])
    keys[alone] = 4 * n * n + alone
    return keys


def _are_any(rows: BoolArray) -> BoolArray:
    """Return whether any is true of each row: a product of rows of few, since `any` takes ten times as long."""
    flat = rows.reshape(len(rows), -1)
    result: BoolArray = flat @ np.ones(flat.shape[1], np.bool_)
    return result


def _relate_group(bodies: SceneBodies, pairs: IntArray, items: IntArray, answers: Answers) -> IntArray:
    """Fill the answers of pairs[items], of equal keys, as far as kernels decide them; return the items left open."""
    one = pairs[items[0]].tolist()
    posed = []
    for bodies_of_side in pairs[items].T:
        turns, moves = bodies.rotations[bodies_of_side + 1], bodies.translations[bodies_of_side + 1]
        is_posed = bool((turns[0] != np.eye(bodies.dimension)).any() or moves[0].any())
        posed.append(PoseArrays(turns, moves, is_posed))
    named: list[Any] | None = None if answers.witnesses is None else [None] * len(items)
    relations = np.full(len(items), UNSETTLED, np.int8)
    details = None if answers.details is None else np.full(len(items), NO_DETAIL, np.int8)
    some = Answers(answers.budget, answers.boolean, relations, named, details)
    fill = batch_of(bodies.solids[one[0]], bodies.solids[one[1]], posed[1], some, posed[0])
    if fill is None:
        return items
    fill(0, len(items))
    left = some.left()
    answers.relations[items] = relations
    if answers.details is not None:
        answers.details[items] = details_where_proven(relations)
    if answers.witnesses is not None and named is not None:
        for item, witness in zip(items.tolist(), named):
            answers.witnesses[item] = witness
    return items[left]
