"""Public: what a half-space, box or convex region leaves of a solid, closed by caps."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np

from engine.compiling.jit import entry_of
from engine.errors import EmptyGeometryError, InvalidOperationError, WrongDimensionError
from engine.polygon_clipping.planes import plan_of
from engine.predicates.rational import cross, largest_axis, minus, scaled_integers, sign_of
from engine.running.budget import Budget, Cancel, current
from engine.running.parallel import Progress, check_options
from engine.solid_cutting.boundary import Boundary, boundary
from engine.solid_cutting.caps import cap_of, seen
from engine.solid_cutting.cut_measures import nearest_area, nearest_volume
from engine.solid_cutting.face_cuts import find_shapes
from engine.solid_cutting.plane_cut import Plane, Points, cut_triangles, plane_of
from engine.solid_cutting.section import as_polyhedron
from engine.solids.accepted import SolidLike
from engine.solids.base import Solid
from engine.solids.checks import shown
from engine.solids.columns import ByValue
from engine.solids.mesh import Polyhedron
from engine.solids.primitives import HalfSpace
from engine.solids.registry import refused, row_of
from engine.solids.shapes import read_argument
from engine.types import UNDECIDED, Accuracy, FloatArray, IntArray, read_only

_KEEPS: Final = ("inside", "outside", "both")
_NONE: Final = np.zeros((0, 3), np.int64)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CutSolid(ByValue):
    """What a region leaves of a solid.

    Attributes
    ----------
    vertices : ndarray of float64, shape (n, 3)
        Those of the solid that are left, in their order, then the cut ones, the nearest doubles.
    faces : ndarray of int64, shape (m, 3)
        Triangles, counter-clockwise seen from outside, closed by their indices.
    origins : ndarray of int64, shape (m,)
        The face of the solid that each is a part of; -1 - k for the cap on plane k of the region.
    collapsed : ndarray of int64, shape (k,)
        Faces whose corners rounding put on one line, or that were so before.
    folded : ndarray of int64, shape (k,)
        Faces that rounding turned over.
    """

    vertices: FloatArray
    faces: IntArray
    origins: IntArray
    collapsed: IntArray
    folded: IntArray
    _points: Points | None = field(default=None)
    _triangles: IntArray = field(default_factory=lambda: _NONE)
    _measures: tuple[float, float] | None = field(default=None)

    def __bool__(self) -> bool:
        """Return whether anything is left."""
        return len(self.faces) > 0

    def __repr__(self) -> str:
        return f"<CutSolid: {len(self.vertices):,} vertices, {len(self.faces):,} faces>"

    @property
    def n_collapsed(self) -> int:
        """Number of faces that are flat after rounding."""
        return len(self.collapsed)

    @property
    def n_folded(self) -> int:
        """Number of faces that rounding turned over."""
        return len(self.folded)

    @property
    def solid(self) -> Polyhedron:
        """The polyhedron of `vertices` and `faces`. Raises: EmptyGeometryError where nothing is left."""
        if not len(self.faces):
            raise EmptyGeometryError("nothing is left of the solid, so there is no polyhedron", ("solid",))
        if self._points is None:  # from a pickle
            return Polyhedron(self.vertices, self.faces)
        return Polyhedron.of_arrays(self.vertices, self.faces)

    @property
    def volume(self) -> float:
        """The double nearest to the exact volume, for the input as given, computed when asked for."""
        return self._measured(current())[0]

    @property
    def area(self) -> float:
        """The double nearest to the exact area of all faces, for the input, computed when asked for."""
        return self._measured(current())[1]

    def _measured(self, budget: Budget) -> tuple[float, float]:
        if self._measures is None and self._points is not None:
            some = self._points, self._triangles, budget
            object.__setattr__(self, "_measures", (nearest_volume(*some)[0], nearest_area(*some)[0]))
        return self._measures or (0.0, 0.0)

    def __reduce__(self) -> tuple[Any, ...]:
        arrays = self.vertices, self.faces, self.origins, self.collapsed, self.folded
        return type(self)._restored, (*arrays, None, _NONE, self._measured(current()))

    @classmethod
    def _restored(cls, *values: Any) -> CutSolid:
        """Return what a pickle holds, its mesh checked."""
        if len(values[1]):
            Polyhedron(values[0], values[1])
        return cls(*values)


def cut(
    solid: SolidLike,
    region: SolidLike,
    *,
    keep: str = "inside",
    measures: bool = False,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Any:
    """Return the part of a polyhedron within a half-space, box or convex region, or outside it, closed.

    Parameters
    ----------
    solid : Solid
        A polyhedron.
    region : Solid
        A half_space, aabb, convex or convex polyhedron of space.
    keep : {"inside", "outside", "both"}, optional
        The part within the region, or what is outside it, in one.
    measures : bool, default False
        Compute `volume` and `area` in this call, within its deadline.
    workers, progress : optional
        Accepted by every operation; one solid is one item.
    deadline, cancel, report
        As for `locate`.

    Returns
    -------
    CutSolid
        With ``keep="both"`` a pair, inside and outside. With ``report=True`` a pair of that and an `Accuracy`.

    Raises
    ------
    UnsupportedSolidError
        The solid is no polyhedron, or the region is not convex.
    InvalidInputError
        Faces of the polyhedron cross; the message names two.
    InvalidOperationError
        An unknown `keep`.
    TooComplexError
        Rings of a section cross each other.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    The result is the closure of what the open interiors have in common, without flat parts; outside, of the open
    interior without the region. A vertex on a plane counts as not in that, an edge that ends there is cut at it.

    Degenerate input: where nothing is left, no vertices and faces. A polyhedron is even-odd, see `volume`: of
    faces that lie on each other what is no boundary is left out, and the rest is cut where their edges cross, as are
    the faces beside it, so that every vertex is one of all faces that meet there.

    Accuracy: which faces there are, and that they close, is exact: every side of a face is used as often in one
    direction as in the other, by index and so by position. Coordinates are the nearest doubles. Rounding may flatten
    faces thinner than that or turn them over: `collapsed` and `folded` name them. `volume` and `area` are those of the
    exact result.

    Cost: 0.15 us a face for one plane; small meshes with a box 2 us a face inside, 6 outside; and what `volume`
    computes once.

    References
    ----------
    Sutherland, Hodgman, Reentrant polygon clipping, 1974; Eberly, Triangulation by ear clipping, 2002.

    Examples
    --------
    >>> from engine import HalfSpace, Polyhedron
    >>> corners = [[x, y, z] for z in (0, 1) for y in (0, 2) for x in (0, 3)]
    >>> quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    >>> half = cut(Polyhedron(corners, quads), HalfSpace([-1, 0, 0], 1))
    >>> half, half.volume, half.solid
    (<CutSolid: 12 vertices, 20 faces>, 2.0, Polyhedron(12 vertices, 20 faces))
    """
    if not isinstance(keep, str) or keep not in _KEEPS:
        raise InvalidOperationError(f"keep must be one of {', '.join(_KEEPS)}, got {shown(keep)}", ("keep",))
    body, deadline = as_polyhedron(solid, "cut", deadline, cancel)
    region, deadline = read_argument(region, deadline, cancel, "region")
    check_options(workers, progress, report=report, measures=measures)
    if region.dimension != 3:
        raise WrongDimensionError(f"region is of dimension {region.dimension}; cut takes solids of space", ("region",))
    with Budget(deadline, cancel, workers) as budget, np.errstate(all="ignore"):
        budget.check()
        planes = planes_in(region, budget)
        parts = []
        if keep != "outside":
            parts.append(_part(body, cut_by_planes(body, planes, budget), budget))
        if keep != "inside":
            parts.append(_part(body, cut_outside(body, planes, budget), budget))
        for part in parts if measures else ():
            part._measured(budget)
    if progress is not None:
        progress(1)
    answer = tuple(parts) if keep == "both" else parts[0]
    if not report:
        return answer
    return answer, Accuracy("exact", 0.5, body.n_faces, 0, 0, region.type)


def planes_in(region: Solid, budget: Budget) -> list[Plane]:
    """Return the planes of a region. Raises: UnsupportedSolidError."""
    if isinstance(region, HalfSpace):
        return [plane_of(region.row.tolist())]
    if row_of(region).planes is None:
        raise refused(region, "a region of cut is not", lambda row: row.planes, " that is convex", ("region",))
    rows = plan_of(region, budget.check).rows
    return region.prepared("cut_planes", lambda: [plane_of(row) for row in rows], budget.check)


class Left(NamedTuple):
    """What planes leave of a mesh: triangles of points, their origins, as in `CutSolid` but by triangle of the boundary
    of the solid, and whether each is whole."""

    given: Boundary
    points: Points
    triangles: IntArray
    origins: IntArray
    is_whole: Any
    planes: list[Plane]


def cut_by_planes(solid: Polyhedron, planes: list[Plane], budget: Budget) -> Left:
    """Return what is inside all planes of a polyhedron, closed."""
    given = boundary(solid, budget)
    points, triangles, origins = given.points.copy(), given.triangles, np.arange(len(given.of))
    is_whole = given.are_whole
    for number, plane in enumerate(planes):
        budget.check()
        sides = points.sides(plane, budget)
        if not len(triangles):
            break
        if sides.min() > 0:
            continue
        left = cut_triangles(points, triangles, plane, budget, sides)
        cap = cap_of(seen(points, plane), left.chain, budget)
        triangles = np.concatenate([np.take(triangles, left.whole, axis=0), left.pieces, cap])
        origins = np.concatenate([origins[left.whole], origins[left.of], np.full(len(cap), -1 - number)])
        n_new = len(left.pieces) + len(cap)
        is_whole = np.concatenate([is_whole[left.whole], np.zeros(n_new, np.bool_)])
    return Left(given, points, triangles, origins, is_whole, planes)


def cut_outside(solid: Polyhedron, planes: list[Plane], budget: Budget) -> Left:
    """Return what is outside some plane of a polyhedron, closed: its faces there, and the caps of the rest reversed.

    A vertex on a plane counts as inside, as if the region were a little larger. Each plane takes away what is outside
    it from what is inside those before, and caps the rest. A side along a plane that a later one cuts is cut in what
    was taken away before, too. A region without interior takes nothing away.
    """
    if len(planes) == 1:
        return cut_by_planes(solid, [planes[0].reversed], budget)
    is_met = len(cut_by_planes(solid, planes, budget).triangles) > 0
    given, planes = boundary(solid, budget), [plane.reversed for plane in planes]
    points, triangles, origins = given.points.copy(), given.triangles, np.arange(len(given.of))
    if not is_met:
        return Left(given, points, triangles, origins, given.are_whole, planes)
    parts, splits = [], [_NONE]
    for number, plane in enumerate(planes):
        budget.check()
        left = cut_triangles(points, triangles, plane, budget, with_beyond=True)
        cap = cap_of(seen(points, plane), left.chain, budget)
        for rows, of in ((triangles[left.whole], left.whole), (left.pieces, left.of)):
            is_of_solid = origins[of] >= 0
            parts.append((rows[is_of_solid], origins[of[is_of_solid]]))
        splits.append(left.splits)
        triangles = np.concatenate([left.beyond, cap[:, ::-1]])
        origins = np.concatenate([origins[left.beyond_of], np.full(len(cap), -1 - number)])
        if not len(triangles):
            break
    is_cap = origins < 0
    taken, of = (np.concatenate(each) for each in zip(*parts))
    taken, rows = _with_splits(taken, np.concatenate(splits), budget)
    taken, of = np.concatenate([taken, triangles[is_cap][:, ::-1]]), np.concatenate([of[rows], origins[is_cap]])
    is_whole = (of >= 0) & (taken == given.wholes[np.maximum(of, 0)]).all(axis=1)
    return Left(given, points, taken, of, is_whole, planes)


def _with_splits(triangles: IntArray, splits: IntArray, budget: Budget) -> tuple[IntArray, IntArray]:
    """Return triangles with the sides that later planes cut, at most one each, cut there too; and whose they are."""
    keys = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    ends = np.sort(splits[:, :2], axis=1)
    n = 1 + int(max(triangles.max(initial=0), splits.max(initial=0)))
    is_cut = np.isin(keys[..., 0] * n + keys[..., 1], ends[:, 0] * n + ends[:, 1])
    at = {(low, high): point for (low, high), point in zip(ends.tolist(), splits[:, 2].tolist())}
    fans: list[tuple[int, int, int]] = []
    of: list[int] = []
    for row, side in np.argwhere(is_cut).tolist():
        budget.check()
        start, end, tip = np.roll(triangles[row], -side).tolist()
        waiting = [end]
        while waiting:  # bound: each turn goes on, or to a point of `splits`
            point = at.get((min(start, waiting[-1]), max(start, waiting[-1])))
            if point is None:
                fans.append((start, waiting[-1], tip))
                of.append(row)
                start = waiting.pop()
            else:
                waiting.append(point)
    same = np.flatnonzero(~is_cut.any(axis=1))
    added = np.array(fans, np.int64).reshape(-1, 3)
    return np.concatenate([triangles[same], added]), np.concatenate([same, np.array(of, np.int64)])


def _part(solid: Polyhedron, left: Left, budget: Budget) -> CutSolid:
    """Return what is left as arrays of its own."""
    given, points, triangles, origins, is_whole, _ = left
    none = read_only(np.zeros(0, np.int64))
    if not len(triangles):
        return CutSolid(read_only(np.zeros((0, 3))), read_only(_NONE), none, none, none)
    is_used = np.zeros(len(points), np.bool_)
    is_used[triangles] = True
    number = np.cumsum(is_used) - 1
    numbers = np.flatnonzero(is_used)
    split = int(np.searchsorted(numbers, points.n_given))
    new = points.high[numbers[split:] - points.n_given]
    vertices = np.concatenate([points.vertices[numbers[:split]], new])
    budget.check()
    collapsed, folded = _misshapen(left, np.flatnonzero(~is_whole), budget)
    is_of_solid = origins >= 0
    faces_of = np.where(is_of_solid, solid.triangle_faces[given.of][np.where(is_of_solid, origins, 0)], origins)
    return CutSolid(
        read_only(vertices), read_only(number[triangles]), read_only(faces_of), collapsed, folded, points, triangles
    )


def _misshapen(left: Left, rows: IntArray, budget: Budget) -> tuple[IntArray, IntArray]:
    """Return which of some triangles are flat after rounding, and which are turned over: seen along the axis on which
    the exact normal, of the cap's plane or of the face that each is a part of, is largest."""
    given, points, triangles, origins, _, planes = left
    faces, shapes = given.wholes, np.empty(len(rows), np.int8)
    normals = read_only(np.stack([plane.row for plane in planes]))
    with np.errstate(all="ignore"):
        corners = points.rounded(triangles[rows].ravel()).reshape(-1, 3, 3)
        entry_of(find_shapes)(points.vertices, faces, corners, origins[rows], normals, shapes)
    for number in np.flatnonzero(shapes == UNDECIDED).tolist():
        budget.check()
        origin = int(origins[rows[number]])
        is_cap = origin < 0
        normal = tuple((-normals[-1 - origin, :3]).tolist()) if is_cap else _normal(points.vertices[faces[origin]])
        axis = largest_axis(normal)
        turn = _normal(corners[number])[axis] if normal[axis] else 0
        shapes[number] = sign_of(turn) * sign_of(normal[axis])
    return read_only(rows[shapes == 0]), read_only(rows[shapes < 0])


def _normal(corners: FloatArray) -> Any:
    """Return the exact normal of a triangle (3, 3), times a positive factor."""
    numbers = scaled_integers(corners.ravel().tolist())
    p, q, r = numbers[:3], numbers[3:6], numbers[6:]
    return cross(minus(q, p), minus(r, p))
