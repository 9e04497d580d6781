"""How far points are from one solid: by the search over its triangles, or exactly by formulas of a ball and planes.

A measure fills the distances of a batch; it does not ask on which side of the boundary a point lies.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

from engine.collision.exact_images import image_half_space, image_point
from engine.collision.meshes.mesh_arrays import STILL, MeshBody, mesh_body_of_triangles
from engine.collision.meshes.near_triangles import FACE
from engine.compiling.jit import entry_of
from engine.distance.exact import ScaledGap
from engine.distance.point_formulas import fill_from_ball, fill_from_planes
from engine.distance.point_search import Goal, PointRoom, find_nearest_on_mesh, new_point_room
from engine.distance.spreads import SpreadPair, feature_of, in_space, spread_of
from engine.distance.traversal import BEYOND, DONE
from engine.errors import EmptyGeometryError, NotRepresentableError
from engine.predicates.rational import dot, nearest_with_root
from engine.running.budget import Budget, poll
from engine.solids.base import Preparing, Solid
from engine.solids.checks import check_finite
from engine.solids.mesh import Mesh
from engine.solids.pose import Pose
from engine.solids.primitives import Convex, HalfSpace, Sphere, Triangle
from engine.types import FloatArray, Int8Array, IntArray, read_only

VERTEX, EDGE, WITHIN_FACE, OTHER, NOWHERE = range(5)
KINDS: Final = ("vertex", "edge", "face", "", "inside")
"""Names of features by code; OTHER: the surface of a ball, a plane; NOWHERE: the point itself lies in the solid."""
_ROOM: Final = 256
_MANY: Final = 4096
"""Points, and triangles, from which the order of the points pays."""


class Answers(NamedTuple):
    """The arrays that a measure fills. distance (n,): NaN where it is wanted; with a limit 0.0 within it, infinity
    beyond. If nearest points are wanted, feet (n, d), codes (n, 2), what of the solid is there, as the measure has it;
    else without rows."""

    distance: FloatArray
    feet: FloatArray
    codes: IntArray

    @property
    def is_named(self) -> bool:
        """Whether the nearest points are wanted."""
        return len(self.feet) > 0


class Measure(Protocol):
    """What fills answers for points (n, d) number start .. stop - 1. limit: a distance to compare with, or None."""

    def fill(
        self, points: FloatArray, start: int, stop: int, answers: Answers, limit: float | None, budget: Budget
    ) -> int:
        """Return how many of them integers decided."""

    def order(self, points: FloatArray) -> IntArray | None:
        """Return an order of points (n, d) in which they are answered sooner, None for as they are."""

    def features(self, codes: IntArray) -> tuple[IntArray, Int8Array, IntArray]:
        """Return faces (n,), kinds (n,) and the indices (n, 2) of features, -1 where there are none."""


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
    """Return the triangles of a solid; of lines their edges."""
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


def _room() -> PointRoom:
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
        self._spot = Sphere(np.zeros(solid.dimension), 0.0)

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
        """As `Measure.order`: by their cells, 64 an axis (G. M. Morton, 1966), where that pays: points near each other
        need the same nodes, which is twice as fast."""
        if len(points) < _MANY or len(self.body.faces) < _MANY:
            return None
        low, high = points.min(axis=0), points.max(axis=0)
        with np.errstate(all="ignore"):
            cells = (points / 4.0 - low / 4.0) / (high / 4.0 - low / 4.0) * 63.0
        cells = np.nan_to_num(cells, nan=0.0, posinf=0.0, neginf=0.0).astype(np.int64)
        keys = np.zeros(len(points), np.int64)
        for bit in range(6):
            for axis in range(points.shape[1]):
                keys |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
        return np.argsort(keys, kind="stable")

    def _search(
        self, points: FloatArray, placed: FloatArray, shift: int, span: tuple[int, int], answers: Answers,
        limit: float | None, budget: Budget,
    ) -> int:  # fmt: skip
        """Do so for the points number span[0] .. span[1] - 1 of `placed`, which holds those from number `shift` on, in
        space."""
        goal = _NAMED if answers.is_named else _ANY
        if limit is not None:
            goal = Goal(limit * (1.0 + 2.0**-50) + 5e-324, limit * (1.0 - 2.0**-50), limit, False)
        rows = [array[shift:] if goal.is_named else array for array in (answers.codes, answers.feet)]
        room, n_exact, (item, stop) = _room(), 0, span
        while True:  # bound: each turn answers a point, or doubles the room
            item, how, n = entry_of(find_nearest_on_mesh)(
                self.body.arrays,
                self.own,
                placed,
                (item, stop),
                goal,
                answers.distance[shift:],
                *rows,
                room,
                budget.flag,
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
        spot = in_space(np.eye(d)[None], points[item][None])
        return SpreadPair(self.solid, self._spot, self.own, spot, budget, (self.body, spread_of(self._spot)))

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

    def features(self, codes: IntArray) -> tuple[IntArray, Int8Array, IntArray]:
        """As `Measure.features`; codes: triangles and codes of features."""
        n, faces = len(codes), self.body.faces[codes[:, 0]]
        kinds, indices = np.empty(n, np.int8), np.full((n, 2), -1)
        rows, code = np.arange(n), codes[:, 1]
        is_face = code == FACE
        kinds[is_face], indices[is_face, 0] = WITHIN_FACE, faces[is_face]
        table = _corner_names(self.solid, self.body)
        if table is None:
            for row in np.flatnonzero(~is_face).tolist():
                kind, numbers = feature_of(self.solid, self.body, int(codes[row, 0]), int(code[row]))
                kinds[row], indices[row, : len(numbers)] = KINDS.index(kind), numbers
            return faces, kinds, indices
        ends = np.stack([table[codes[:, 0], code % 3], table[codes[:, 0], (code + 1) % 3]], axis=1)
        is_edge = (code >= 3) & ~is_face & (ends[:, 0] != ends[:, 1])
        kinds[is_edge], indices[is_edge] = EDGE, np.sort(ends[is_edge], axis=1)
        is_vertex = ~is_face & ~is_edge
        kinds[is_vertex], indices[rows[is_vertex], 0] = VERTEX, ends[is_vertex, 0]
        return faces, kinds, indices


def _corner_names(solid: Any, body: MeshBody) -> IntArray | None:
    """Return the caller's number of each corner (m, 3) of the triangles of a body, of several vertices at one position
    the first; None where edges of triangles are not all edges of faces, or corners have other names (boxes)."""
    if isinstance(solid, Lines):
        numbers = solid.edges[:, [0, 1, 1]]
    elif isinstance(solid, Mesh) and len(solid.face_indices) == 3 * len(solid.triangles):
        numbers = solid.face_indices.reshape(-1, 3)
    elif isinstance(solid, Triangle) and solid.dimension == 3:
        numbers = np.arange(3)[None]
    else:
        return None
    return np.asarray(solid.prepared("corner_names", lambda: numbers[body.faces]))


class Rooted(NamedTuple):
    """The number a + b sqrt(s), exact; s >= 0."""

    a: Fraction
    b: Fraction
    s: Fraction

    def rounded(self) -> float:
        """Return the nearest double. Raises: NotRepresentableError beyond the largest."""
        (p, q), w = self.a.as_integer_ratio(), self.s.numerator * self.s.denominator  # sqrt(s) = sqrt(w) / denominator
        b = self.b / self.s.denominator
        try:
            return nearest_with_root(p * b.denominator, b.numerator * q, w, q * b.denominator) + 0.0
        except OverflowError:
            raise NotRepresentableError(
                "a distance is beyond the largest double, 1.8e308; scale the scene down by a power of two", ("points",)
            ) from None

    def is_at_most(self, most: Fraction) -> bool:
        """Return whether the number is at most `most`."""
        rest, square = most - self.a, self.b * self.b * self.s
        if self.b < 0:
            return rest >= 0 or square >= rest * rest
        return rest >= 0 and square <= rest * rest


Vector = Sequence[Fraction]


class _ByFormula:
    """Base of the measures of balls and planes: each point in rational arithmetic."""

    kernels: tuple[Any, ...] = ()
    """A kernel that decides most distances, with its arguments between span and limit."""

    def order(self, _: FloatArray) -> None:
        """As `Measure.order`."""

    def measured(self, point: Vector) -> tuple[Rooted, list[Rooted], int]:
        """Return the distance of a point from the boundary or, outside, from the solid, its nearest point there, and
        the number of a plane, -1 for none."""
        raise NotImplementedError

    def fill(
        self, points: FloatArray, start: int, stop: int, answers: Answers, limit: float | None, budget: Budget
    ) -> int:
        """As `Measure.fill`."""
        if not answers.is_named:
            most = np.inf if limit is None else limit
            for kernel, *numbers in self.kernels:
                entry_of(kernel)(points, (start, stop), *numbers, most, answers.distance, budget.flag)
                budget.check()
        left = (start + np.flatnonzero(np.isnan(answers.distance[start:stop]))).tolist()
        if left:
            check_finite(points, ("points",))
        for item in left:
            budget.check()
            value, foot, plane = self.measured([Fraction(x) for x in points[item].tolist()])
            if limit is not None:
                answers.distance[item] = 0.0 if value.is_at_most(Fraction(limit)) else np.inf
                continue
            answers.distance[item] = value.rounded() or (0.0 if value.is_at_most(_ZERO) else 5e-324)
            if answers.is_named:
                answers.feet[item], answers.codes[item] = [x.rounded() for x in foot], (plane, 0)
        return len(left)

    def features(self, codes: IntArray) -> tuple[IntArray, Int8Array, IntArray]:
        """As `Measure.features`: the number of the plane as the face."""
        return codes[:, 0].copy(), np.full(len(codes), OTHER, np.int8), np.full((len(codes), 2), -1)


_ZERO, _ONE = Fraction(0), Fraction(1)


class BallMeasure(_ByFormula):
    """Distances from the surface of a ball, whose radius a pose keeps; of its centre the nearest point is that in the
    direction of the first axis."""

    def __init__(self, solid: Sphere, pose: Pose | None) -> None:
        self.centre, self.radius = image_point(solid.center.tolist(), pose), Fraction(float(solid.radius))
        if pose is None:
            self.kernels = ((fill_from_ball, solid.center, float(solid.radius)),)

    def measured(self, point: Vector) -> tuple[Rooted, list[Rooted], int]:
        """As `_ByFormula.measured`: |sqrt(s) - r|, and c + (q - c) r / sqrt(s)."""
        way = [x - c for x, c in zip(point, self.centre)]
        s, r = sum((x * x for x in way), _ZERO), self.radius
        if s == 0:
            foot = [Rooted(c + (r if axis == 0 else 0), _ZERO, _ONE) for axis, c in enumerate(self.centre)]
            return Rooted(r, _ZERO, _ONE), foot, -1
        sign = 1 if s >= r * r else -1
        return Rooted(-sign * r, _ONE * sign, s), [Rooted(c, x * r / s, s) for c, x in zip(self.centre, way)], -1


class PlanesMeasure(_ByFormula):
    """Distances from a half-space, or from an intersection of half-spaces.

    Within it the nearest plane is that with the least |h| / |n|: the largest ball about the point that lies in all
    half-spaces lies in the solid. Outside the nearest point p is the only one of the solid with q - p a sum of outward
    normals of planes through p with weights that are not negative (Karush, Kuhn, Tucker): all sets of at most d planes
    are tried, in floats first.
    """

    def __init__(self, solid: HalfSpace | Convex, pose: Pose | None) -> None:
        rows = [solid] if isinstance(solid, HalfSpace) else [HalfSpace(r[:-1], r[-1]) for r in solid.planes.tolist()]
        self.rows = [image_half_space(row, pose) for row in rows]
        self.d = solid.dimension
        if pose is None:
            own = solid.row[None] if isinstance(solid, HalfSpace) else solid.planes
            self.kernels = ((fill_from_planes, read_only(own)),)

    def measured(self, point: Vector) -> tuple[Rooted, list[Rooted], int]:
        """As `_ByFormula.measured`."""
        heights = [(dot(n, point) + offset, dot(n, n)) for n, offset in self.rows]
        if all(h >= 0 for h, _ in heights):
            squares = [h * h / size for h, size in heights]
            plane = min(range(len(squares)), key=squares.__getitem__)
            h, size = heights[plane]
            foot = [x - h / size * y for x, y in zip(point, self.rows[plane][0])]
            return Rooted(_ZERO, _ONE, squares[plane]), [Rooted(x, _ZERO, _ONE) for x in foot], plane
        below = [k for k, (h, _) in enumerate(heights) if h < 0]
        for n_planes in range(1, self.d + 1):
            for some in combinations(range(len(self.rows)), n_planes):
                poll()
                if not any(k in below for k in some):
                    continue
                foot_ = self._foot(point, some, heights)
                if foot_ is not None:
                    s = sum(((x - y) ** 2 for x, y in zip(point, foot_)), _ZERO)
                    return Rooted(_ZERO, _ONE, s), [Rooted(x, _ZERO, _ONE) for x in foot_], some[0]
        raise EmptyGeometryError("solid has no point to be near: its half-spaces have none in common", ("solid",))

    def _foot(
        self, point: Vector, some: Sequence[int], heights: Sequence[tuple[Fraction, Fraction]]
    ) -> list[Fraction] | None:
        """Return the foot of a point on the planes `some`, if it is the nearest point of the solid."""
        normals = [self.rows[k][0] for k in some]
        weights = _solved([[dot(a, b) for b in normals] for a in normals], [-heights[k][0] for k in some])
        if weights is None or min(weights) < 0:
            return None
        foot = [x + sum((w * n[axis] for w, n in zip(weights, normals)), _ZERO) for axis, x in enumerate(point)]
        return foot if all(dot(n, foot) + offset >= 0 for n, offset in self.rows) else None


def _solved(matrix: list[list[Fraction]], right: list[Fraction]) -> list[Fraction] | None:
    """Return the solution of a symmetric system of one to three equations, None if it is singular."""
    rows = [[*row, value] for row, value in zip(matrix, right)]
    for k in range(len(rows)):
        pivot = next((i for i in range(k, len(rows)) if rows[i][k] != 0), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for i in range(len(rows)):
            if i != k:
                rows[i] = [x - rows[i][k] * y for x, y in zip(rows[i], rows[k])]
    return [row[-1] for row in rows]
