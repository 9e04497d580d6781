"""All pairs of faces of two meshes with a common point, or the one pair that settles the question."""

from __future__ import annotations

import numpy as np

from engine.arrays import Int8Array, IntArray
from engine.collision.meshes.dual_traversal import (
    FULL,
    SEEK_CONTACT,
    SEEK_OVERLAP,
    SEEK_PIERCING_BY_FIRST,
    SEEK_PIERCING_BY_SECOND,
    SETTLED,
    new_descent,
    new_found,
)
from engine.collision.meshes.exact_triangles import classify_exact
from engine.collision.meshes.face_regions import look_at_regions
from engine.collision.meshes.mesh_arrays import STATE_CLEAN, STATE_CROSSED
from engine.collision.meshes.mesh_pair import MeshPair
from engine.collision.meshes.pose_batch import find_contacts
from engine.collision.meshes.triangle_triangle import APART, COPLANAR, CROSSING
from engine.types import UNDECIDED, Relation

_ROOM = 1024
_PROBED = 8


def find_all_contacts(pair: MeshPair, *, looks_at_regions: bool = True) -> tuple[IntArray, bool]:
    """Return the pairs of faces (n, 2) with a common point, ascending, or the one that settles all; tell if it does.

    looks_at_regions: whether regions that prove overlapping settle it too; without, only a crossing does.
    """
    found, descent, budget = new_found(_ROOM), new_descent(), pair.work.budget
    found_pairs: list[IntArray] = []
    found_kinds: list[Int8Array] = []
    (first, second), (first_pose, second_pose) = (mesh.arrays for mesh in pair.meshes), pair.posed
    how = FULL
    while how == FULL:  # bound: each turn finds new pairs
        how, n_pairs, apart = find_contacts(
            first, first_pose, second, second_pose, pair.seek, not found_pairs, descent, found, budget.flag
        )
        budget.check()
        if how == SETTLED:
            return found.pairs[:1], True
        if apart == Relation.DISJOINT:
            pair.is_disjoint = True
            return found.pairs[:0], False
        found_pairs.append(found.pairs[:n_pairs].copy())
        found_kinds.append(found.kinds[:n_pairs].copy())
        may_probe = how == FULL and len(found_pairs) == 1 and looks_at_regions and pair.seek == SEEK_OVERLAP
        if may_probe and not pair.is_separated(found_pairs[0]) and _is_overlap_near(pair, *found):
            return found.pairs[:1], True
    pairs, kinds = np.concatenate(found_pairs), np.concatenate(found_kinds)
    faces = [pair.meshes[own].faces[pairs[:, own]] for own in (0, 1)]
    order = np.lexsort((pairs[:, 1], pairs[:, 0], faces[1], faces[0]))  # the caller's faces, then triangles
    return _settled(pair, pairs[order], kinds[order])


def _settled(pair: MeshPair, pairs: IntArray, kinds: Int8Array) -> tuple[IntArray, bool]:
    """Find the classes that kernels left open; return the pairs with a common point, or the one that settles all."""
    open_ones = np.flatnonzero(kinds == UNDECIDED)
    pair.work.n_beyond_filter += len(pairs)
    pair.work.n_rational += len(open_ones)
    for index in open_ones:
        pair.work.budget.check()
        i, j = int(pairs[index, 0]), int(pairs[index, 1])
        a, b = pair.exact
        kinds[index] = classify_exact(a.corners(i), b.corners(j), a.plane(i), b.plane(j))
        if kinds[index] != APART and _is_settled_by(pair, int(kinds[index]), i, j):
            return pairs[index : index + 1], True
    meet = np.concatenate([np.flatnonzero(kinds == COPLANAR), np.flatnonzero((kinds != APART) & (kinds != COPLANAR))])
    return pairs[meet], False


def _is_overlap_near(pair: MeshPair, pairs: IntArray, kinds: Int8Array) -> bool:
    """Tell whether the regions of a few faces in contact prove overlapping; such a pair is put first."""
    sure = np.flatnonzero(kinds != UNDECIDED)
    for index in sure[:: max(1, len(sure) // _PROBED)].tolist():
        if look_at_regions(pair, 0, int(pairs[index, 0]), None)[0]:
            pairs[0] = pairs[index]
            return True
    return False


def _is_settled_by(pair: MeshPair, kind: int, i: int, j: int) -> bool:
    """The rule of `dual_traversal.settles` for a class found exactly."""
    if pair.seek == SEEK_CONTACT:
        return True
    if kind != CROSSING:
        return False
    first, second = pair.state(0, i), pair.state(1, j)
    if pair.seek == SEEK_PIERCING_BY_FIRST:
        return second == STATE_CLEAN
    if pair.seek == SEEK_PIERCING_BY_SECOND:
        return first == STATE_CLEAN
    return max(first, second) <= STATE_CROSSED and min(first, second) == STATE_CLEAN
