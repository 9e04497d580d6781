"""Two bodies given by triangles and radii: the search over both trees, then the exact stage for what it leaves."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import product
from math import frexp, isfinite, ldexp, nextafter
from typing import Final

import numpy as np

from engine.collision.clearance.blocks import CLOSER, DONE
from engine.collision.clearance.bodies import feature_of, in_space, radius_of, spread_of
from engine.collision.clearance.boxes import new_room
from engine.collision.clearance.exact import nearest_of_triangles
from engine.collision.clearance.result import Clearance
from engine.collision.clearance.rounded import ScaledGap
from engine.collision.clearance.traversal import find_nearest
from engine.collision.meshes.exact_body import exact_pair, on_lattice
from engine.collision.meshes.mesh_arrays import STILL, MeshBody, lattice_shift
from engine.collision.meshes.placement import PoseArrays
from engine.parallel import Budget
from engine.solids.base import Solid
from engine.solids.pose import Pose

_ROOM: Final = 4096
_LARGEST: Final = 1e300
"""Coordinates up to here never overflow in the search; beyond it every pair of triangles is a candidate."""


class SpreadPair:
    """Two bodies, the second under one of many poses; one thread at a time."""

    def __init__(
        self, first: Solid, second: Solid, first_pose: PoseArrays, second_poses: PoseArrays, budget: Budget
    ) -> None:
        self.solids = first, second
        self.meshes = spread_of(first), spread_of(second)
        self.poses = first_pose, second_poses
        self.budget = budget
        self.n_exact = 0  # poses that the exact stage was asked about
        self._room = _ROOM
        self._work = new_room(_ROOM, max(len(mesh.arrays.child) for mesh in self.meshes))
        self._radii = radius_of(first), radius_of(second)
        a, b = self.meshes
        self._reach = 4.0 * (a.arrays.extent.reach + b.arrays.extent.reach) + float(
            np.abs(first_pose.translations).max()
        )

    def clearance(self, item: int) -> Clearance:
        """Return distance, points and features under pose `item`; the bodies have no common point there."""
        gap, triangles = self._least(item)
        codes = gap.gap.first, gap.gap.second
        first, second = map(feature_of, self.solids, self.meshes, triangles, codes)
        return gap.clearance((first, second), self.solids[0].dimension)

    def distance(self, item: int) -> float:
        """Return the distance under pose `item`; the bodies have no common point there."""
        return self._least(item)[0].distance()

    def are_boundaries_clear(self, item: int, least: Fraction) -> bool:
        """Tell whether all triangles are at least so far apart under pose `item`."""
        how, pairs = self._candidates(item, *_around(least + Fraction(self._radii[0]) + Fraction(self._radii[1])))
        if how == CLOSER or not pairs:
            return how != CLOSER
        exact = self._exact(item)
        return all(exact.gap(*row).is_at_least(least) for row in self._polled(pairs))

    def _candidates(self, item: int, most: float, enough: float) -> tuple[int, Iterable[Sequence[int]]]:
        """Return how the search ended, and its candidates: two triangles and two features each."""
        (a, b), (pose, poses) = self.meshes, self.poses
        size = self._reach + float(np.abs(poses.translations[item]).max()) + sum(self._radii)
        if not size < _LARGEST:
            return DONE, product(range(len(a.faces)), range(len(b.faces)), (0,), (0,))  # never held all at once
        unit = ldexp(1.0, -min(max(frexp(size)[1], -1000), 1000))
        limits = np.array([most * unit, enough * unit if enough > 0.0 else -1.0])
        while True:  # bound: the room doubles
            with np.errstate(all="ignore"):
                how, n = find_nearest(a.arrays, pose, b.arrays, poses, item, unit, limits, self._work, self.budget.flag)
            self.budget.check()
            if how in (DONE, CLOSER):
                return how, self._work.found.pairs[:n].tolist()
            self._room *= 2
            self._work = new_room(self._room, len(self._work.kept))

    def _polled(self, pairs: Iterable[Sequence[int]]) -> Iterator[Sequence[int]]:
        for count, row in enumerate(pairs):
            if count % 16 == 0:
                self.budget.check()
            yield row

    def _exact(self, item: int) -> _ExactPair:
        self.n_exact += 1
        (a, b), (pose, poses) = self.meshes, self.poses
        return _ExactPair(a, _pose_at(pose, 0), b, _pose_at(poses, item), self._radii)

    def _least(self, item: int) -> tuple[ScaledGap, tuple[int, int]]:
        """Return the least gap of the candidates, of equal ones that of the smallest faces, and its triangles."""
        exact, (a, b) = self._exact(item), self.meshes
        best: ScaledGap | None = None
        kept, faces = (-1, -1), (-1, -1)
        for i, j, first, second in self._polled(self._candidates(item, np.inf, -1.0)[1]):
            found = exact.gap(i, j, first, second)
            own = int(a.faces[i]), int(b.faces[j])
            is_less = best is None or found.gap.is_less(best.gap)
            if is_less or (own < faces and best is not None and not best.gap.is_less(found.gap)):
                best, kept, faces = found, (i, j), own
        assert best is not None
        return best, kept


class _ExactPair:
    """Both bodies on one lattice, their radii too."""

    def __init__(
        self, a: MeshBody, a_pose: Pose | None, b: MeshBody, b_pose: Pose | None, radii: tuple[float, float]
    ) -> None:
        self._bodies = exact_pair(a, a_pose, b, b_pose, lattice_shift(np.array(radii)))
        shift = self._bodies[0].shift
        self._scale = 1 << shift
        self._radii = on_lattice(radii[0], shift), on_lattice(radii[1], shift)

    def gap(self, i: int, j: int, first: int, second: int) -> ScaledGap:
        """Return the gap between two triangles."""
        a, b = self._bodies
        return ScaledGap(nearest_of_triangles(a.corners(i), b.corners(j), first, second), self._radii, self._scale)


def _pose_at(poses: PoseArrays, item: int) -> Pose | None:
    return Pose(poses.rotations[item], poses.translations[item]) if poses.is_posed else None


def _around(target: Fraction) -> tuple[float, float]:
    """Return doubles above and below a positive rational, the upper one infinite beyond the largest double."""
    try:
        value = target.numerator / target.denominator
    except OverflowError:
        return np.inf, 1.7e308
    return (nextafter(value, np.inf) * (1.0 + 2.0**-50) if isfinite(value) else np.inf), value * (1.0 - 2.0**-50)


def spread_pair(
    first: Solid, second: Solid, first_pose: Pose | None, second_pose: Pose | None, budget: Budget
) -> SpreadPair:
    """Return two bodies, each under one pose or none."""
    poses = [
        STILL if pose is None else in_space(pose.rotation[None], pose.translation[None])
        for pose in (first_pose, second_pose)
    ]
    return SpreadPair(first, second, poses[0], poses[1], budget)
