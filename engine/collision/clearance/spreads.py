"""Two bodies given by triangles and radii: the search over both trees, then the exact stage for what it leaves."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import product
from math import isfinite, nextafter
from typing import Any, Final

import numpy as np

from engine.arrays import FloatArray
from engine.budget import Budget
from engine.collision.clearance.blocks import DONE
from engine.collision.clearance.bodies import feature_of, in_space, radius_of, spread_of
from engine.collision.clearance.boxes import Room, new_room
from engine.collision.clearance.exact import Gap, ScaledGap, Wall, is_beyond, nearest_of_triangles, walls
from engine.collision.clearance.traversal import BEYOND, TOLD, Asked, find_nearest
from engine.collision.meshes.exact_body import exact_pair, on_lattice
from engine.collision.meshes.mesh_arrays import STILL, MeshBody, lattice_shift
from engine.collision.meshes.placement import PoseArrays
from engine.collision.result import Clearance, Feature, Poses
from engine.direct import entry_of
from engine.solids.base import Solid
from engine.solids.pose import Pose

_ROOM: Final = 4096

_rooms = threading.local()


def _room(n_nodes: int) -> Room:
    """Return the work space that this thread keeps, for trees of so many nodes."""
    found: Room | None = getattr(_rooms, "room", None)
    if found is None or len(found.kept) < n_nodes or len(found.heap.bounds) != _ROOM:
        found = _rooms.room = new_room(_ROOM, max(n_nodes, 256))
    return found


class SpreadPair:
    """Two bodies, the second under one of many poses, the first under one or as many; one thread at a time."""

    def __init__(self, first: Solid, second: Solid, own: PoseArrays, second_poses: PoseArrays, budget: Budget) -> None:
        self.solids = first, second
        self.meshes = spread_of(first), spread_of(second)
        self.poses = own, second_poses
        self.budget = budget
        self.n_exact = 0  # poses that the exact stage was asked about
        self._radii = radius_of(first), radius_of(second)
        a, b = self.meshes
        self._room = _room(max(len(a.arrays.child), len(b.arrays.child)))
        self._reach = 4.0 * (a.arrays.extent.reach + b.arrays.extent.reach) + sum(self._radii)

    def clearance(self, item: int) -> Clearance:
        """Return distance, points and features under pose `item`; the bodies have no common point there."""
        asked, answers = Asked(np.inf, -1.0, *self._radii, self._reach, True), np.full(item + 1, np.nan)
        how, _, pairs = next(self._left(item, item + 1, answers, asked))
        d = self.solids[0].dimension
        if how != TOLD:
            gap, triangles = self._least(item, pairs)
            return gap.clearance(self._features(triangles, (gap.gap.first, gap.gap.second)), d)
        i, j, *codes = next(iter(pairs))
        points = self._room.points[:, :d].copy()
        points.setflags(write=False)
        return Clearance(float(answers[item]), points, self._features((i, j), codes))

    def _features(self, triangles: Sequence[int], codes: Sequence[int]) -> tuple[Feature, Feature]:
        first, second = map(feature_of, self.solids, self.meshes, triangles, codes)
        return first, second

    def fill(self, start: int, stop: int, answers: FloatArray, least: Fraction | None = None) -> None:
        """Answer for the poses of a range whose answers are NaN: how far apart the triangles are, those of bodies that
        have no common point; where a distance is given 0.0 if they are nearer than that, else infinity."""
        limits = (np.inf, -1.0) if least is None else _around(least + sum(map(Fraction, self._radii)))
        for _, item, pairs in self._left(start, stop, answers, Asked(*limits, *self._radii, self._reach, False)):
            gap, _ = self._least(item, pairs)
            answers[item] = gap.distance() if least is None else (np.inf if gap.is_at_least(least) else 0.0)

    def _left(
        self, start: int, stop: int, answers: FloatArray, asked: Asked
    ) -> Iterator[tuple[int, int, Iterable[Sequence[int]]]]:
        """Yield how it ended, the pose, and the candidates, two triangles and two features each, for those it leaves.

        Whoever takes them fills the answer.
        """
        (a, b), (own, poses) = self.meshes, self.poses
        while True:  # bound: an answer is filled, or the room doubles
            start, how, n = entry_of(find_nearest)(
                a.arrays, own, b.arrays, poses, (start, stop), asked, answers, self._room, self.budget.flag
            )
            self.budget.check()
            if start == stop:
                return
            if how in (DONE, TOLD):
                yield how, start, self._room.found.pairs[:n].tolist()
            elif how == BEYOND:
                every = product(range(len(a.faces)), range(len(b.faces)), (0,), (0,))  # never held all at once
                yield how, start, every
            else:
                self._room = new_room(2 * len(self._room.found.bounds), len(self._room.kept))

    def _least(self, item: int, pairs: Iterable[Sequence[int]]) -> tuple[ScaledGap, tuple[int, int]]:
        """Return the least gap of the candidates, of equal ones that of the smallest faces, and its triangles."""
        self.n_exact += 1
        (a, b), (own, poses) = self.meshes, self.poses
        placed = _pose_at(own, min(item, len(own.rotations) - 1)), _pose_at(poses, item)
        exact = _ExactPair(a, b, placed, self._radii)

        def rank(i: int, j: int) -> tuple[Any, ...]:
            """Order by faces, of one face by corners: the order of the tree is nobody's."""
            corners = (body.arrays.vertices[body.arrays.triangles[k]].ravel().tolist() for body, k in ((a, i), (b, j)))
            return int(a.faces[i]), int(b.faces[j]), *corners

        best: ScaledGap | None = None
        kept = (-1, -1)
        if isinstance(pairs, list) and len(pairs) > 1:
            pairs.sort(key=lambda row: rank(row[0], row[1]))  # ties fall to the first
        for count, (i, j, first, second) in enumerate(pairs):
            if count % 16 == 0:
                self.budget.check()
            is_later = best is not None and rank(i, j) >= rank(*kept)
            if is_later and exact.are_beyond(i, j):
                continue
            found = exact.gap(i, j, first, second)
            is_less = best is None or found.gap.is_less(best.gap)
            if is_less or (not is_later and best is not None and not best.gap.is_less(found.gap)):
                best, kept = found, (i, j)
                exact.hold(found.gap)
        assert best is not None
        return best, kept


class _ExactPair:
    """Both bodies on one lattice, their radii too."""

    def __init__(self, a: MeshBody, b: MeshBody, poses: Poses, radii: tuple[float, float]) -> None:
        self._bodies = exact_pair(a, b, poses, lattice_shift(np.array(radii)))
        shift = self._bodies[0].shift
        self._scale = 1 << shift
        self._radii = on_lattice(radii[0], shift), on_lattice(radii[1], shift)
        self._walls: tuple[Wall, ...] = ()
        self._beyond: tuple[dict[int, bool], ...] = ()

    def hold(self, gap: Gap) -> None:
        """Hold triangles against this gap from now on."""
        self._walls, self._beyond = walls(gap), ({}, {})

    def are_beyond(self, i: int, j: int) -> bool:
        """Tell whether two triangles are surely no nearer than the gap held; each vertex is looked at once."""
        for body, wall, known, triangle in zip(self._bodies, self._walls, self._beyond, (i, j)):
            for vertex in body.mesh.arrays.triangles[triangle].tolist():
                if vertex not in known:
                    known[vertex] = is_beyond(wall, body.vertex(vertex))
                if not known[vertex]:
                    return False
        return True

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


def spread_pair(first: Solid, second: Solid, poses: Poses, budget: Budget) -> SpreadPair:
    """Return two bodies, each under one pose or none."""
    own, their = (STILL if at is None else in_space(at.rotation[None], at.translation[None]) for at in poses)
    return SpreadPair(first, second, own, their, budget)
