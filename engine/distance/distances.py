"""Public: how far many points are from one solid, with a sign, within a distance, with the nearest points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Final, Literal, TypeAlias, cast

import numpy as np

from engine.collision.collide import posed
from engine.collision.result import Feature
from engine.containment.locate import SMALL_BATCH, locate_small_batch
from engine.containment.locators import Locator
from engine.containment.posed_locators import posed_locator
from engine.distance.clearance import checked_distance
from engine.distance.point_measures import Answers, Lines, Measure, TriangleMeasure
from engine.distance.point_mesh import KINDS, NOWHERE, OTHER, Features
from engine.errors import EmptyGeometryError, InvalidOperationError
from engine.running.budget import UNLIMITED, Budget, Cancel, reading
from engine.running.parallel import Progress, check_options, is_unlimited, run_chunks
from engine.solids.accepted import LinesLike, PointsLike, PoseLike, SolidLike
from engine.solids.base import Solid
from engine.solids.checks import as_points, is_ready, shown
from engine.solids.columns import Columns
from engine.solids.geometries import geometry_of, lines_in
from engine.solids.pose import Pose
from engine.solids.ragged import as_lines
from engine.solids.registry import refused, row_of
from engine.solids.shapes import as_solid
from engine.types import Accuracy, BoolArray, FloatArray, Int8Array, IntArray, read_only

_TO: Final = ("solid", "boundary")
_NO_FEET: Final = np.empty((0, 3))
_NO_CODES: Final = np.empty((0, 2), np.int64)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Distances(Columns):
    """Distances of points from a solid with the nearest points, by point.

    Attributes
    ----------
    distance : ndarray of float64, shape (n,)
        The double nearest to each distance.
    point : ndarray of float64, shape (n, dim)
        The nearest point of the solid, each coordinate the nearest double.
    face : ndarray of int64, shape (n,)
        The face it is on, of several the least: of a mesh or box its face, of a planar solid or of lines the edge
        (numbered as its first vertex; of lines by segment), of a convex or half-space the plane; -1 of a ball, and
        where the point itself lies in the solid.
    kind : ndarray of int8, shape (n,)
        What the nearest point is: 0 a vertex, 1 within an edge, 2 within a face, 3 of a ball or of planes, 4 the point
        itself, which lies in the solid.
    index : ndarray of int64, shape (n, 2)
        The number of that vertex, the two vertices of that edge, the face; -1 where there is none.
    """

    _rows: ClassVar[str] = "points"
    distance: FloatArray
    point: FloatArray
    face: IntArray
    kind: Int8Array
    index: IntArray

    def feature(self, item: int) -> Feature | None:
        """Return the feature that the nearest point of point number `item` lies on; None where that lies in the solid.

        Parameters
        ----------
        item : int
            The number of the point.

        Returns
        -------
        Feature or None
            Of a ball or of planes with no or one index.
        """
        kind = int(self.kind[item])
        if kind == NOWHERE:
            return None
        if kind == OTHER:
            face = int(self.face[item])
            return Feature("ball") if face < 0 else Feature("plane", (face,))
        return Feature(cast(Any, KINDS[kind]), tuple(k for k in self.index[item].tolist() if k >= 0))


def has_inside(solid: Any) -> bool:
    """Return whether a solid has an inside from which distances may be negative."""
    if solid.type == "triangle":
        return bool(solid.dimension == 2)
    return row_of(solid).exact is not None or row_of(solid).exact_posed is not None


def check_measured(solid: Any, body: int | None = None) -> None:
    """Raise unless distances can be measured from a solid. body: its number in a scene. Raises: UnsupportedSolidError,
    EmptyGeometryError."""
    where: tuple[str | int, ...] = ("solid",) if body is None else ("solids", body)
    if not isinstance(solid, Lines) and row_of(solid).measure is None:
        raise refused(solid, "distances are not measured from", lambda row: row.measure, where=where)
    if solid.type in ("polygon", "lines") and not len(solid.vertices):
        name = "solid" if body is None else f"solids[{body}]"
        raise EmptyGeometryError(f"{name} has no point to be near: it is an empty {solid.type}", where)


def measure_of(solid: Any, pose: Pose | None) -> Measure:
    """Return the measure of a solid under a pose. Raises: as `check_measured`."""
    check_measured(solid)
    made: Any = TriangleMeasure if isinstance(solid, Lines) else row_of(solid).measure
    if pose is not None:
        return cast(Measure, made(solid, pose))
    measure: Measure = solid.prepared("measure", lambda: made(solid, None))
    return measure


def _fill(
    measure: Measure, points: FloatArray, span: tuple[int, int], answers: Answers, limit: float | None,
    places: Int8Array | None, stops_inside: bool, is_signed: bool, budget: Budget,
) -> int:  # fmt: skip
    """Fill the answers for points number span[0] .. span[1] - 1 as a measure does; what lies inside is 0 away or
    negative. places: the locations of these points, if they matter."""
    start, stop = span
    distance = answers.distance[start:stop]
    if places is not None:
        if not answers.is_named:
            distance[places >= 0 if stops_inside else places == 0] = 0.0
        elif stops_inside:
            distance[places > 0] = 0.0
            answers.feet[start:stop][places > 0] = points[start:stop][places > 0]
    n_exact = measure.fill(points, start, stop, answers, limit, budget)
    if is_signed and places is not None:
        distance[places > 0] *= -1.0
    return n_exact


def _new_answers(points: FloatArray, is_named: bool) -> Answers:
    distance = np.empty(len(points))
    distance.fill(np.nan)
    if not is_named:
        return Answers(distance, _NO_FEET, _NO_CODES, False)
    codes = np.empty((len(points), 2), np.int64)
    codes.fill(-1)
    return Answers(distance, np.empty(points.shape), codes, True)


def _result(measure: Measure, answers: Answers, limit: float | None) -> tuple[Any, ...]:
    """Return the columns of the result, once all answers are filled."""
    if limit is not None:
        return (answers.distance == 0.0,)
    if not answers.is_named:
        return (answers.distance,)
    n = len(answers.distance)
    features = Features(np.empty(n, np.int64), np.empty(n, np.int8), np.empty((n, 2), np.int64))
    features.face.fill(-1)
    features.kind.fill(NOWHERE)
    features.numbers.fill(-1)
    measure.name(answers.codes, features)
    return answers.distance, answers.feet, *features


class PointQuery:
    """Distances of points (n, d) from one solid, by ranges of points; threads may fill different ranges.

    is_signed, to_boundary: as of `distances`. limit: a distance to compare with; is_named: nearest points too."""

    def __init__(
        self, points: FloatArray, solid: Any, pose: Pose | None, limit: float | None, is_named: bool, budget: Budget,
        to_boundary: bool = False, is_signed: bool = False,
    ) -> None:  # fmt: skip
        self.measure, self.n_exact = measure_of(solid, pose), 0
        self._order = self.measure.order(points)
        self.points = points if self._order is None else read_only(points[self._order])
        self.limit, self.is_signed = limit, is_signed
        self.answers = _new_answers(points, is_named)
        self._stops_inside = has_inside(solid) and not (to_boundary or is_signed)
        self._locator: Locator | None = None
        if has_inside(solid) and (is_signed or not to_boundary):
            self._locator = posed_locator(solid, pose).chosen(len(points), budget)

    def fill(self, start: int, stop: int, budget: Budget) -> None:
        """Fill the answers start .. stop - 1."""
        places = None
        if self._locator is not None:
            places = np.full(stop - start, -1, np.int8)
            self.n_exact += self._locator.fill(self.points[start:stop], places, budget).rational
        self.n_exact += _fill(
            self.measure, self.points, (start, stop), self.answers, self.limit, places, self._stops_inside,
            self.is_signed, budget,
        )  # fmt: skip

    def result(self) -> Any:
        """Return the answers, once all are filled."""
        columns = _result(self.measure, self.answers, self.limit)
        if self._order is not None:
            given = [np.empty_like(column) for column in columns]
            for column, rows in zip(columns, given):
                rows[self._order] = column
            columns = tuple(given)
        return columns[0] if len(columns) == 1 else Distances(*columns)


Result: TypeAlias = FloatArray | BoolArray | Distances


def distances(
    points: PointsLike,
    solid: SolidLike | LinesLike,
    *,
    to: Literal["solid", "boundary"] = "solid",
    signed: bool = False,
    within: float | None = None,
    nearest: bool = False,
    pose: PoseLike | None = None,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Result | tuple[Result, Accuracy]:
    """Return how far points are from a solid, whether within a distance, or the nearest points too, exactly.

    Parameters
    ----------
    points : array_like, shape (n, dimension)
        As for `locate`.
    solid : Solid or lines
        Polyhedron, surface, box, sphere, half-space, convex, triangle (of space: the flat triangle, not the prism of
        `locate`), polygon; in the plane GeoJSON LineString and MultiLineString too.
    to : {"solid", "boundary"}
        "solid": points in it are 0 away. "boundary": they are as far as its boundary is.
    signed : bool, default False
        Distances from the boundary, negative inside; `to` makes no difference then.
    within : float, optional
        A distance; the answer is then a bool for each point.
    nearest : bool, default False
        Also return the nearest points and what of the solid they lie on.
    pose : Pose, optional
        Of the solid; the exact image is meant.
    workers, deadline, cancel, progress, report
        As for `locate`.

    Returns
    -------
    ndarray of float64, shape (n,)
        With `within` of bool; with ``nearest=True`` `Distances`. With ``report=True`` a pair of the answer and an
        `Accuracy`.

    Raises
    ------
    UnsupportedSolidError
        An implicit solid or csg.
    EmptyGeometryError
        A solid without a point.
    InvalidOperationError, InvalidInputError
        Options that exclude each other; a sign where there is no inside; a `within` below 0.
    NotRepresentableError
        A distance is beyond the largest double.
    EngineError
        As `locate`.

    Notes
    -----
    Boundary: exactly 0.0 on it; a positive distance that would round to 0 is the smallest denormal. `within` counts the
    distance itself as within.

    Degenerate input: faces without area and edges without length are segments and points. Of several nearest points one
    on the face with the least number is returned; of the centre of a ball that in the direction of the first axis.

    Accuracy: each distance and coordinate is the double nearest to the exact one, each on its own; `within` is decided
    exactly. A pose is the exact image, as for `clearance`.

    Cost: the tree of a mesh is built once and cached with it. A point then takes 0.8 to 3 us of a mesh of 10^3 to 10^5
    faces, under a pose or some 100 sizes of the mesh away up to 30 us; points of a posed solid's own surface 0.1 ms.
    A convex: outside of it rational arithmetic over sets of planes, 10^-4 s and more.

    References
    ----------
    Roussopoulos, Kelley, Vincent, Nearest neighbor queries, 1995; Ericson, Real-Time Collision Detection, 2005, 5.1.5.

    Examples
    --------
    >>> from engine import Aabb
    >>> box = Aabb([0, 0, 0], [2, 2, 2])
    >>> distances([[3, 1, 1], [1, 1, 0.5], [5, 6, 1]], box, signed=True).tolist()
    [1.0, -0.5, 5.0]
    >>> distances([[3, 1, 1], [5, 6, 1]], box, within=1).tolist()
    [True, False]
    """
    if pose is None and report is False and is_unlimited(workers, deadline, cancel, progress):
        few = _few(points, solid, to, signed, within, nearest)
        if few is not None:
            return few
    check_options(workers, progress, report=report, signed=signed, nearest=nearest)
    if not isinstance(to, str) or to not in _TO:
        raise InvalidOperationError(f"to must be solid or boundary, got {shown(to)}", ("to",))
    if within is not None and (signed or nearest):
        other = "signed" if signed else "nearest"
        raise InvalidOperationError(f"within returns bools: leave {other} out, or within", ("within",))
    limit = None if within is None else checked_distance(within, "within")
    with reading(deadline, cancel) as reader:
        body = solid if isinstance(solid, Solid) else _lines_or_solid(solid)
        array = read_only(as_points(points, body.dimension))
        placed: Any = body
        moved = posed(pose, placed, "pose")
        if signed and not has_inside(body):
            raise InvalidOperationError(f"signed: no inside to be negative in ({body.type}); leave it out", ("signed",))
    with Budget(reader.left(), cancel, workers) as budget:
        budget.check()
        query = PointQuery(array, body, moved, limit, nearest, budget, to == "boundary", signed)
        run_chunks(
            lambda start, stop: query.fill(start, stop, budget),
            len(array), budget=budget, workers=workers, progress=progress,
        )  # fmt: skip
    answer: Result = query.result()
    if not report:
        return answer
    return answer, Accuracy(
        "exact", None if within is not None else 0.5, len(array), query.n_exact, query.n_exact, body.type
    )


def _few(points: Any, solid: Any, to: Any, signed: Any, within: Any, nearest: Any) -> Result | None:
    """Return the answer for few points and a solid whose measure is there, without a budget and chunks; None where the
    general path has to answer."""
    measure = solid.cached("measure") if isinstance(solid, Solid) else None
    if measure is None or type(signed) is not bool or type(nearest) is not bool or not isinstance(to, str):
        return None
    if within is not None and (signed or nearest or type(within) is not float or not 0.0 <= within < np.inf):
        return None
    array: Any = points if is_ready(points, solid.dimension) else as_points(points, solid.dimension)
    located, is_solid = None, to == "solid"
    if not 0 < len(array) <= SMALL_BATCH or not (is_solid or to == "boundary"):
        return None
    if (signed or is_solid) and has_inside(solid):
        located = locate_small_batch(array, solid)
    if located is None and (signed or (is_solid and has_inside(solid))):
        return None
    answers, places = _new_answers(array, nearest), None if located is None else located[0]
    _fill(measure, array, (0, len(array)), answers, within, places, is_solid and not signed, signed, UNLIMITED)
    columns = _result(measure, answers, within)
    return columns[0] if len(columns) == 1 else Distances(*columns)


def _lines_or_solid(value: Any) -> Any:
    """Return what people hold in place of a solid as one, and GeoJSON lines as `Lines`."""
    geometry = geometry_of(value)
    if geometry is not None and geometry["type"] in ("LineString", "MultiLineString"):
        vertices, offsets = as_lines(lines_in(value), 2)
        return Lines(read_only(vertices), offsets)
    return as_solid(value, "solid")
