"""How far points are from one solid: what a measure is, and that of triangles, by the search over them.

A measure fills the distances of a batch; it does not ask on which side of the boundary a point lies.
"""

from __future__ import annotations

import threading
from fractions import Fraction
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

from engine.bounding.morton import morton_codes
from engine.collision.meshes.mesh_arrays import STILL, MeshBody, mesh_body_of_triangles
from engine.compiling.jit import entry_of
from engine.distance.exact import ScaledGap
from engine.distance.point_mesh import KINDS, CornerNames, Features, corner_names, fill_features, words_of_mesh
from engine.distance.point_search import Goal, PointRoom, find_nearest_on_mesh, new_point_room
from engine.distance.spreads import SpreadPair, feature_of, in_space, spread_of
from engine.distance.traversal import BEYOND, DONE
from engine.running.budget import Budget
from engine.solids.base import Preparing, Solid
from engine.solids.checks import check_finite
from engine.solids.pose import Pose
from engine.solids.primitives import Sphere, Triangle
from engine.types import FloatArray, IntArray

_ROOM: Final = 256
_BITS: Final = 6
"""Bits of each coordinate in the Morton code."""
_MANY: Final = 4096
"""Points, and triangles, from which the order of the points pays."""


class Answers(NamedTuple):
    """The arrays that a measure fills. distance (n,): NaN where it is wanted; with a limit 0.0 within it, infinity
    beyond. If nearest points are wanted, feet (n, d), codes (n, 2), what of the solid is there, as the measure has it,
    -1 where nothing is; else without rows. is_named: whether they are."""

    distance: FloatArray
    feet: FloatArray
    codes: IntArray
    is_named: bool


class Measure(Protocol):
    """What fills answers for points (n, d) number start .. stop - 1. limit: a distance to compare with, or None."""

    def fill(
        self, points: FloatArray, start: int, stop: int, answers: Answers, limit: float | None, budget: Budget
    ) -> int:
        """Fill ``answers`` for points start .. stop - 1 of points (n, d), distances only where they are NaN; return how
        many were decided in integers. limit: if given, a distance is 0.0 where it is at most that, else infinity."""

    def order(self, points: FloatArray) -> IntArray | None:
        """Return the order (n,) in which points (n, d) are answered fastest, None for that in which they are given."""

    def name(self, codes: IntArray, features: Features) -> None:
        """Fill ``features`` from codes (n, 2), which `fill` wrote to the answers; rows whose second code is -1 stay as
        they are."""


class Lines(Preparing):
    """Polylines of the plane as a solid without an inside: vertices (n, 2), and by edge its two ends (m, 2)."""

    type, dimension = "lines", 2

    def __init__(self, vertices: FloatArray, offsets: IntArray) -> None:
        self.vertices = vertices
        last = np.zeros(len(vertices) + 1, np.bool_)
        last[offsets[1:]] = True
        starts = np.flatnonzero(~last[1:])
        self.edges = np.column_stack([starts, starts + 1])
        self._prepared: dict[str, Any] = {}
        self._lock = threading.RLock()


def _spread(solid: Any) -> MeshBody:
    """Return the triangles of a solid as a `MeshBody`; polylines have one triangle, without area, for each edge."""
    if isinstance(solid, Lines):
        corners = np.zeros((len(solid.vertices), 3))
        corners[:, :2] = solid.vertices
        triangles = solid.edges[:, [0, 1, 1]]
        return solid.prepared(
            "spread", lambda: mesh_body_of_triangles(corners, triangles, np.arange(len(triangles)), False)
        )
    if isinstance(solid, Triangle) and solid.dimension == 3:
        face = np.arange(3)[None]
        return solid.prepared("spread", lambda: mesh_body_of_triangles(solid.vertices, face, np.zeros(1, int), False))
    return spread_of(solid)


_ANY: Final = Goal(np.inf, -1.0, np.inf, False)
_NAMED: Final = Goal(np.inf, -1.0, np.inf, True)

_rooms = threading.local()


def thread_room() -> PointRoom:
    """Return this thread's work space, cached."""
    room: PointRoom | None = getattr(_rooms, "room", None)
    if room is None:
        room = _rooms.room = new_point_room(_ROOM)
    return room


class TriangleMeasure:
    """Distances from the triangles of a mesh, from a triangle of space, from the edges of a planar body."""

    def __init__(self, solid: Solid, pose: Pose | None) -> None:
        self.solid, self.body = solid, _spread(solid)
        self.own = STILL if pose is None else in_space(pose.rotation[None], pose.translation[None])
        numbers = np.concatenate([self.own.rotations.ravel(), self.own.translations.ravel()])
        words, arrays = solid.prepared("point words", lambda: words_of_mesh(self.body.arrays))
        self.row = int(words.ctypes.data), int(numbers.ctypes.data), pose is not None
        """What kernels take: addresses of a mesh and of a pose, and whether there is a pose."""
        self._named = words, arrays, numbers

    def fill(
        self, points: FloatArray, start: int, stop: int, answers: Answers, limit: float | None, budget: Budget
    ) -> int:
        """As `Measure.fill`."""
        if points.shape[1] == 3:
            return self._search(points, points, 0, (start, stop), answers, limit, budget)
        placed = np.zeros((stop - start, 3))
        placed[:, :2] = points[start:stop]
        return self._search(points, placed, start, (0, stop - start), answers, limit, budget)

    def order(self, points: FloatArray) -> IntArray | None:
        """As `Measure.order`: by their Morton codes, where that pays: points near each other need the same nodes, which
        is twice as fast."""
        if len(points) < _MANY or len(self.body.faces) < _MANY:
            return None
        return np.argsort(morton_codes(points, points, _BITS), kind="stable")

    def _search(
        self, points: FloatArray, placed: FloatArray, shift: int, span: tuple[int, int], answers: Answers,
        limit: float | None, budget: Budget,
    ) -> int:  # fmt: skip
        """Fill `answers` for points number span[0] .. span[1] - 1 of `placed` (m, 3), where point number i of `points`
        is row i - shift; return how many integers decided. limit: as in `Measure.fill`."""
        goal = _NAMED if answers.is_named else _ANY
        if limit is not None:
            goal = Goal(limit * (1.0 + 2.0**-50) + 5e-324, limit * (1.0 - 2.0**-50), limit, False)
        rows = [array[shift:] if goal.is_named else array for array in (answers.codes, answers.feet)]
        room, n_exact, (item, stop) = thread_room(), 0, span
        while True:  # bound: each turn answers a point, or doubles the room
            item, how, n = entry_of(find_nearest_on_mesh)(
                self.row, placed, (item, stop), goal, answers.distance[shift:], *rows, room, budget.flag
            )
            budget.check()
            if item == stop:
                return n_exact
            if how == DONE:
                pairs = room.candidates.pairs[:n]
            elif how == BEYOND:
                check_finite(points, ("points",))
                pairs = np.zeros((len(self.body.faces), 4), np.int64)
                pairs[:, 0] = np.arange(len(pairs))
            else:
                room = new_point_room(2 * len(room.candidates.bounds))
                continue
            self._by_integers(points, shift + item, pairs, answers, limit, budget)
            n_exact += 1

    def _pair(self, points: FloatArray, item: int, budget: Budget) -> SpreadPair:
        """Return the solid and point number `item`, a ball without a radius, as a pair of bodies."""
        d = self.solid.dimension
        ball, spot = Sphere(np.zeros(d), 0.0), in_space(np.eye(d)[None], points[item][None])
        return SpreadPair(self.solid, ball, self.own, spot, budget, (self.body, spread_of(ball)))

    def _by_integers(
        self, points: FloatArray, item: int, pairs: IntArray, answers: Answers, limit: float | None, budget: Budget
    ) -> None:
        """Answer point number `item` from candidates in integers. pairs: rows that begin with a triangle, and have the
        code of its feature in column 2."""
        rows = np.zeros((len(pairs), 4), np.int64)
        rows[:, 0], rows[:, 2] = pairs[:, 0], pairs[:, 2]
        gap, (triangle, _) = self._pair(points, item, budget).least(0, rows.tolist())
        self._write(gap, triangle, item, answers, limit)

    def _write(self, gap: ScaledGap, triangle: int, item: int, answers: Answers, limit: float | None) -> None:
        if limit is not None:
            answers.distance[item] = 0.0 if gap.is_at_most(Fraction(limit)) else np.inf
            return
        answers.distance[item] = gap.distance() if gap.gap.top else 0.0
        if answers.is_named:
            d = self.solid.dimension
            answers.codes[item], answers.feet[item] = (triangle, gap.gap.first), gap.ends()[0][:d]

    def names(self) -> CornerNames | None:
        """Return the names of the corners of the triangles, None if there are too many faces."""
        names: CornerNames | None = self.solid.prepared(
            "corner_names", lambda: corner_names(self.solid, self.body.arrays)
        )
        return names

    def name(self, codes: IntArray, features: Features) -> None:
        """As `Measure.name`; codes: triangles and codes of features."""
        names = self.names()
        if names is not None:
            entry_of(fill_features)(codes, self.body.faces, names, features)
            return
        for row in np.flatnonzero(codes[:, 1] >= 0).tolist():
            triangle, code = codes[row].tolist()
            kind, numbers = feature_of(self.solid, self.body.arrays, triangle, code)
            features.face[row], features.kind[row] = self.body.faces[triangle], KINDS.index(kind)
            features.numbers[row, : len(numbers)] = numbers
