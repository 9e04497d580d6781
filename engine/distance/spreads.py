"""Distance of two bodies given by triangles and radii: the search over both trees, then the exact stage for the rest.

A ball is its centre and a radius; a planar body is its edges, at z = 0, as triangles without area. Cached with the
solid.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import product
from math import isfinite, nextafter
from typing import Any, Final

import numpy as np

from engine.bounding.aabb import corners_of_box
from engine.collision.meshes.exact_body import exact_pair, on_lattice
from engine.collision.meshes.mesh_arrays import (
    BOX_TRIANGLES,
    STILL,
    MeshBody,
    lattice_shift,
    mesh_body_of,
    mesh_body_of_triangles,
)
from engine.collision.meshes.near_triangles import FACE
from engine.collision.meshes.placement import PoseArrays
from engine.collision.outline_batch import outline_arrays
from engine.collision.result import Clearance, Feature, Poses
from engine.compiling.jit import entry_of
from engine.distance.exact import Gap, ScaledGap, Wall, is_beyond, nearest_of_triangles, walls
from engine.distance.refined import Room, new_room
from engine.distance.ties import in_order, nearest_between_walls
from engine.distance.traversal import ANSWERED, BEYOND, DONE, FULL, Query, find_nearest
from engine.running.budget import Budget
from engine.solids.base import Solid
from engine.solids.mesh import Mesh
from engine.solids.pose import Pose
from engine.solids.primitives import Aabb, Sphere
from engine.types import FloatArray, IntArray, read_only

_ROOM: Final = 4096

_rooms = threading.local()


def _room() -> Room:
    """Return this thread's work space, cached."""
    room: Room | None = getattr(_rooms, "room", None)
    if room is None or len(room.heap.bounds) != _ROOM:
        room = _rooms.room = new_room(_ROOM)
    return room


class SpreadPair:
    """Two bodies as triangles and radii, the second under n poses, the first under one or n; used by one thread at a
    time."""

    def __init__(
        self, first: Solid, second: Solid, own: PoseArrays, second_poses: PoseArrays, budget: Budget,
        meshes: tuple[MeshBody, MeshBody] | None = None,
    ) -> None:  # fmt: skip
        self.solids = first, second
        self.meshes = (spread_of(first), spread_of(second)) if meshes is None else meshes
        self.poses = own, second_poses
        self.budget = budget
        self.n_exact = 0  # poses decided by the exact stage
        self._radii = radius_of(first), radius_of(second)
        a, b = self.meshes
        self._room = _room()
        self._reach = 4.0 * (a.arrays.extent.reach + b.arrays.extent.reach) + sum(self._radii)

    def clearance(self, item: int, settle: Callable[[], Clearance | None] = lambda: None) -> Clearance:
        """Return distance, nearest points and features of two disjoint bodies under pose `item`. settle: may know the
        answer, and is asked before integers are."""
        query, answers = Query(np.inf, -1.0, *self._radii, self._reach, True), np.full(item + 1, np.nan)
        how, _, pairs = next(self._unanswered(item, item + 1, answers, query))
        d = self.solids[0].dimension
        if how != ANSWERED:
            if (settled := settle()) is not None:
                return settled
            gap, triangles = self.least(item, pairs)
            return gap.clearance(self._features(triangles, (gap.gap.first, gap.gap.second)), d)
        i, j, *codes = next(iter(pairs))
        points = self._room.points[:, :d].copy()
        points.setflags(write=False)
        return Clearance(float(answers[item]), points, self._features((i, j), codes))

    def _features(self, triangles: Sequence[int], codes: Sequence[int]) -> tuple[Feature, Feature]:
        """Return the caller's features for a triangle of each body and a feature code of each."""
        meshes = (mesh.arrays for mesh in self.meshes)
        first, second = map(feature_of, self.solids, meshes, triangles, codes)
        return first, second

    def fill(self, start: int, stop: int, answers: FloatArray, least: Fraction | None = None) -> None:
        """Fill the NaN entries of answers[start:stop] with the distances under these poses; caller guarantees that the
        bodies' triangles do not meet. least: if given, 0.0 for nearer bodies, infinity for others instead."""
        limits = (np.inf, -1.0) if least is None else _around(least + sum(map(Fraction, self._radii)))
        for _, item, pairs in self._unanswered(start, stop, answers, Query(*limits, *self._radii, self._reach, False)):
            gap, _ = self.least(item, pairs)
            answers[item] = gap.distance() if least is None else (np.inf if gap.is_at_least(least) else 0.0)

    def _unanswered(
        self, start: int, stop: int, answers: FloatArray, query: Query
    ) -> Iterator[tuple[int, int, Iterable[Sequence[int]]]]:
        """Yield (outcome, pose number, candidates) for each pose start .. stop - 1 that the search in floats does not
        answer; the consumer fills the answer. Candidates: rows of two triangles and a feature code of each; ANSWERED:
        the answer is filled, and the first row names the nearest features."""
        (a, b), (own, poses) = self.meshes, self.poses
        while True:  # bound: an answer is filled, or the room doubles
            start, how, n = entry_of(find_nearest)(
                a.arrays, own, b.arrays, poses, (start, stop), query, answers, self._room, self.budget.flag
            )
            self.budget.check()
            if start == stop:
                return
            if how in (DONE, ANSWERED):
                yield how, start, self._room.candidates.pairs[:n].tolist()
            elif how == BEYOND:
                every = product(range(len(a.faces)), range(len(b.faces)), (0,), (0,))  # never in memory together
                yield how, start, every
            else:
                row = self._nearest_between_walls(start, n) if how == FULL and n > 0 and query.most == np.inf else None
                if row is not None:
                    yield DONE, start, [row]
                else:
                    self._room = new_room(2 * len(self._room.candidates.bounds))

    def _nearest_between_walls(self, item: int, n: int) -> list[int] | None:
        """Return the row of the nearest pair under pose `item` if one of the first n candidates of a search that ran
        full proves it."""
        bodies = exact_pair(*self.meshes, self._placed(item), lattice_shift(np.array(self._radii)))
        nearest = self._room.candidates.bounds[:n].argmin()
        pairs = self._room.candidates.pairs[nearest : nearest + 1]
        row = nearest_between_walls(bodies, pairs, self.budget)
        return None if row is None else row.tolist()

    def _placed(self, item: int) -> Poses:
        """Return both poses of pose number `item`."""
        own, poses = self.poses
        return _pose_at(own, min(item, len(own.rotations) - 1)), _pose_at(poses, item)

    def least(self, item: int, pairs: Iterable[Sequence[int]]) -> tuple[ScaledGap, tuple[int, int]]:
        """Return the smallest gap of the candidates of pose number `item`, ties by the lowest faces, and its two
        triangles; exact. pairs: rows of two triangles and a feature code of each."""
        self.n_exact += 1
        a, b = self.meshes
        exact = _ExactPair(a, b, self._placed(item), self._radii)

        def rank(i: int, j: int) -> tuple[Any, ...]:
            """Return the key of ties: faces, then corners, independent of the order of the tree."""
            corners = (body.arrays.vertices[body.arrays.triangles[k]].ravel().tolist() for body, k in ((a, i), (b, j)))
            return int(a.faces[i]), int(b.faces[j]), *corners

        best: ScaledGap | None = None
        best_pair = (-1, -1)
        is_sorted = isinstance(pairs, list)
        if isinstance(pairs, list) and len(pairs) > 1:
            pairs = in_order(self.meshes, np.array(pairs)).tolist()  # ties fall to the first
        for count, (i, j, first, second) in enumerate(pairs):
            if count % 16 == 0:
                self.budget.check()
            is_later = best is not None and (is_sorted or rank(i, j) >= rank(*best_pair))
            if is_later and exact.are_beyond(i, j):
                continue
            candidate = exact.gap(i, j, first, second)
            is_less = best is None or candidate.gap.is_less(best.gap)
            if is_less or (not is_later and best is not None and not best.gap.is_less(candidate.gap)):
                best, best_pair = candidate, (i, j)
                exact.set_reference(candidate.gap)
        assert best is not None
        return best, best_pair


class _ExactPair:
    """Two bodies under one pose each, and their radii, in integers on one lattice."""

    def __init__(self, a: MeshBody, b: MeshBody, poses: Poses, radii: tuple[float, float]) -> None:
        self._bodies = exact_pair(a, b, poses, lattice_shift(np.array(radii)))
        shift = self._bodies[0].shift
        self._scale = 1 << shift
        self._radii = on_lattice(radii[0], shift), on_lattice(radii[1], shift)
        self._walls: tuple[Wall, ...] = ()
        self._beyond: tuple[dict[int, bool], ...] = ()

    def set_reference(self, gap: Gap) -> None:
        """Set the gap that triangles are compared with."""
        self._walls, self._beyond = walls(gap), ({}, {})

    def are_beyond(self, i: int, j: int) -> bool:
        """Return whether triangle i of the first and j of the second body are provably no nearer than the reference
        gap: both lie beyond its `walls`. Tests of vertices are cached."""
        for body, wall, known, triangle in zip(self._bodies, self._walls, self._beyond, (i, j)):
            for vertex in body.mesh.arrays.triangles[triangle].tolist():
                if vertex not in known:
                    known[vertex] = is_beyond(wall, body.vertex(vertex))
                if not known[vertex]:
                    return False
        return True

    def gap(self, i: int, j: int, first: int, second: int) -> ScaledGap:
        """Return the gap between triangles i and j; first, second: codes of the probably nearest features."""
        a, b = self._bodies
        return ScaledGap(nearest_of_triangles(a.corners(i), b.corners(j), first, second), self._radii, self._scale)


def _pose_at(poses: PoseArrays, item: int) -> Pose | None:
    """Return pose number `item` of a body as a `Pose`, None if the body has no pose."""
    return Pose(poses.rotations[item], poses.translations[item]) if poses.is_posed else None


def _around(target: Fraction) -> tuple[float, float]:
    """Return (above, below): doubles around a positive rational with room for rounding; the upper one is infinite
    beyond the largest double."""
    try:
        value = target.numerator / target.denominator
    except OverflowError:
        return np.inf, 1.7e308
    return (nextafter(value, np.inf) * (1.0 + 2.0**-50) if isfinite(value) else np.inf), value * (1.0 - 2.0**-50)


def spread_pair(first: Solid, second: Solid, poses: Poses, budget: Budget) -> SpreadPair:
    """Return two bodies, each under a `Pose` or None, as a `SpreadPair`, the input of distance kernels."""
    own, their = (STILL if at is None else in_space(at.rotation[None], at.translation[None]) for at in poses)
    return SpreadPair(first, second, own, their, budget)


BALL: Final = Feature("ball")
AROUND: Final = np.array([0, 1, 3, 2])
"""Corners of a box of the plane in the order of its outline, with the numbers that corners have in space."""


def spread_of(solid: Solid) -> MeshBody:
    """Return the triangles of a body other than a half-space: of a ball its centre, of a planar body its edges."""
    if solid.dimension == 3 and not isinstance(solid, Sphere):
        return mesh_body_of(solid)
    return solid.prepared("spread", lambda: _built(solid))


def _built(solid: Solid) -> MeshBody:
    """Build the mesh of a planar body's edges, or of a ball's centre: triangles without area at z = 0, one for each
    edge or centre."""
    points, following = outline_of(solid)[:2]
    vertices = np.zeros((len(points), 3))
    vertices[:, : solid.dimension] = points
    triangles = np.column_stack([np.arange(len(points)), following, following])
    return mesh_body_of_triangles(vertices, triangles, np.arange(len(points)), False)


Outline = tuple[FloatArray, IntArray, float, "_Names"]


def outline_of(solid: Solid) -> Outline:
    """Return vertices (n, d), the end vertex of each edge (n,), the radius, and the features by number, vertices before
    edges, of a planar body or a ball. Cached. A ball is one vertex with a radius."""
    cached: Outline | None = solid.cached("outline and names")
    return solid.prepared("outline and names", lambda: _outline(solid)) if cached is None else cached


def _outline(solid: Solid) -> Outline:
    if isinstance(solid, Sphere):
        return read_only(solid.center[None]), read_only(np.zeros(1, np.int64)), radius_of(solid), _Names(solid, ())
    vertices, following, _ = outline_arrays(solid)
    return vertices, following, 0.0, _Names(solid, following.tolist())


class _Names(dict[int, Feature]):
    """Features of an outline by number: n vertices, then n edges; made at first use."""

    def __init__(self, solid: Solid, following: Sequence[int]) -> None:
        self._is_box, self._following = solid.type == "aabb", following

    def __missing__(self, number: int) -> Feature:
        n = len(self._following)
        if not n:
            return BALL
        ends = [number] if number < n else [number - n, self._following[number - n]]
        ends = sorted(int(AROUND[end]) if self._is_box else end for end in ends)
        self[number] = Feature("vertex" if number < n else "edge", tuple(ends))
        return self[number]


def radius_of(solid: Solid) -> float:
    """Return the radius of a ball, 0.0 for other bodies: a ball is its centre as a triangle."""
    return float(solid.radius) if isinstance(solid, Sphere) else 0.0


def in_space(rotations: FloatArray, translations: FloatArray) -> PoseArrays:
    """Return poses (n, d, d), (n, d) as poses of space, for kernels; planar ones rotate about z."""
    n, d = translations.shape
    if d == 3:
        return PoseArrays(read_only(rotations), read_only(translations), True)
    turns, moves = np.zeros((n, 3, 3)), np.zeros((n, 3))
    turns[:, :2, :2], turns[:, 2, 2], moves[:, :2] = rotations, 1.0, translations
    return PoseArrays(read_only(turns), read_only(moves), True)


def feature_of(solid: Solid, mesh: Any, triangle: int, code: int) -> Feature:
    """Return the feature with code `code` (`near_triangles.py`) of a triangle of a solid's mesh, in the caller's
    numbering of vertices and faces. mesh: `MeshArrays`, or other arrays of its vertices, triangles and their faces."""
    if isinstance(solid, Sphere):
        return BALL
    face = int(mesh.faces[triangle])
    if code == FACE:
        return Feature("face", (face,))
    corners, vertices = mesh.triangles[triangle].tolist(), mesh.vertices
    if isinstance(solid, Mesh) and len(set(corners)) == 3:
        numbers = solid.face_indices[solid.face_offsets[face] : solid.face_offsets[face + 1]].tolist()
        if len(numbers) == 3:  # case: a triangle, its corners in the caller's order
            i, j = numbers[code % 3], numbers[(code + 1) % 3]
            return Feature("vertex", (i,)) if code < 3 else Feature("edge", (min(i, j), max(i, j)))
    numbers, points = _ring(solid, face)
    places = [points.index(vertices[corners[k]].tolist()[: solid.dimension]) for k in (code % 3, (code + 1) % 3)]
    if code < 3 or places[0] == places[1]:
        return Feature("vertex", (named(solid, numbers[places[0]]),))
    if solid.dimension == 3 and abs(places[0] - places[1]) not in (1, len(numbers) - 1):
        return Feature("face", (face,))  # an edge of the triangulation only
    return Feature("edge", tuple(sorted(named(solid, numbers[place]) for place in places)))


def _ring(solid: Solid, face: int) -> tuple[list[int], list[list[float]]]:
    """Return the caller's numbers and the coordinates of the vertices of a face (in the plane: an edge), in order."""
    if isinstance(solid, Mesh):
        indices = solid.face_indices[solid.face_offsets[face] : solid.face_offsets[face + 1]]
        return indices.tolist(), solid.vertices[indices].tolist()
    if isinstance(solid, Aabb) and solid.dimension == 3:
        (a, b, c), (_, _, d) = BOX_TRIANGLES[face].tolist()
        points, numbers = corners_of_box(solid.min, solid.max), [a, b, c, d]
    else:
        points, following = outline_of(solid)[:2]
        numbers = [face, int(following[face])]
    return numbers, points[numbers].tolist()


def named(solid: Solid, number: int) -> int:
    """Return the caller's number of a vertex: a box of the plane numbers its corners as a box of space does."""
    return int(AROUND[number]) if solid.type == "aabb" and solid.dimension == 2 else number
