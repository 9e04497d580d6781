"""How far points are from the bodies of a scene: the nearest body of each point and its distance, or whether one is
within a distance.

`nearest_bodies.py` measures most; what it leaves is located or measured here, body by body, in the order of the bounds
on its distance, until none of a point is below its distance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar, Final

import numpy as np

from engine.compiling.jit import entry_of
from engine.distance.ball_and_planes import BallMeasure
from engine.distance.distances import PointQuery, check_measured, has_inside, measure_of
from engine.distance.point_measures import TriangleMeasure, thread_room
from engine.distance.point_mesh import NOWHERE, OTHER, Features
from engine.distance.point_search import new_point_room
from engine.errors import EmptyGeometryError
from engine.running.budget import Budget
from engine.running.parallel import Progress, run_chunks
from engine.scenes.locate import locate_given
from engine.scenes.nearest_bodies import (
    DONE,
    KIND,
    N_COLUMNS,
    NO_CANDIDATES,
    NO_ROOM,
    TO_LOCATE,
    Nearest,
    Notes,
    find_nearest_bodies,
)
from engine.scenes.placements import Placements
from engine.solids.base import Solid
from engine.solids.checks import check_finite
from engine.solids.columns import Columns
from engine.solids.pose import Pose
from engine.solids.ragged import run_offsets
from engine.solids.registry import BodyKind
from engine.types import Accuracy, BoolArray, FloatArray, Int8Array, IntArray, read_only

_ROOM: Final = 1 << 14
"""Notes of a kernel in memory at once, if they are enough for a point."""

_BYTES_OF_NOTE: Final = 32


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SceneDistances(Columns):
    """Of each point the nearest body of a scene, and how far it is.

    Attributes
    ----------
    distance : ndarray of float64, shape (n,)
        The double nearest to the distance; 0 exactly within the body.
    body : ndarray of int64, shape (n,)
        The body; of those whose distances are one double the first.
    point : ndarray of float64, shape (n, dim)
        The nearest point of the body.
    face, kind, index : ndarray
        What of the body that is, as in `Distances`.
    """

    _rows: ClassVar[str] = "points"
    distance: FloatArray
    body: IntArray
    point: FloatArray
    face: IntArray
    kind: Int8Array
    index: IntArray


class _Rows:
    """Rows of bodies (n, N_COLUMNS) as `find_nearest_bodies` reads them, filled body by body on demand."""

    def __init__(self, solids: Sequence[Solid], poses: Sequence[Pose | None]) -> None:
        self._solids, self._poses = solids, poses
        self.rows = np.zeros((len(solids), N_COLUMNS), np.int64)
        self.rows[:, KIND] = BodyKind.UNREADY
        self.measures: dict[int, Any] = {}
        """By body, with what rows name by its address."""

    def prepare(self, body: int) -> None:
        """Fill the row of a body; threads may do so at the same time, with the same numbers."""
        solid, pose = self._solids[body], self._poses[body]
        if (measure := self.measures.get(body)) is None:  # of threads that make one each, all take the first
            made: Any = measure_of(solid, None if pose is None or pose.is_identity else pose)
            measure = self.measures.setdefault(body, made)
        kind, columns = BodyKind.OTHER, (0,) * (N_COLUMNS - 1)
        if isinstance(measure, TriangleMeasure):
            names, kind = measure.names(), BodyKind.MESH
            of_names = (0, 0, 0) if names is None else (len(names.numbers), *(each.ctypes.data for each in names))
            columns = *measure.row, has_inside(solid), *of_names
        elif isinstance(measure, BallMeasure) and measure.numbers is not None:
            kind, columns = BodyKind.BALL, (measure.numbers.ctypes.data, *columns[1:])
        if self.rows[body, KIND] == BodyKind.UNREADY:
            self.rows[body, 1:] = columns
            self.rows[body, KIND] = kind  # order: last, kernels of other threads read it


def measure_all(
    points: FloatArray, scene: Placements, limit: float | None, budget: Budget, workers: int | None,
    progress: Progress | None,
) -> tuple[SceneDistances | BoolArray, Accuracy]:  # fmt: skip
    """Return the answer for points (n, d), with a limit whether a body is within it, and its accuracy; caller
    guarantees a body."""
    solids, (n, d), most = scene.base.solids, points.shape, np.inf if limit is None else limit
    kinds = scene.base.prepared("measured kinds", lambda: _kinds_of(solids, budget))
    check_finite(points, ("points",))
    points, words, still = (
        read_only(points),
        scene.words(budget),
        scene.base.prepared("measured", lambda: _rows_of(scene.base)),
    )
    moved = scene.few().prepared("measured", lambda: _rows_of(scene.few())) if scene.moved else _NO_ROWS
    features = Features(np.full(n, -1), np.full(n, NOWHERE, np.int8), np.full((n, 2), -1))
    nearest, left = Nearest(np.full(n, np.inf), np.full(n, -1), np.empty((n, d)), features), list[tuple[Any, Any]]()

    def task(start: int, stop: int) -> None:
        n_notes = min(max(_ROOM, 2 * scene.n_rows), 2 * scene.n_rows * (stop - start))
        budget.take(_BYTES_OF_NOTE * n_notes)
        notes = Notes(np.empty((n_notes, 3), np.int64), np.empty(n_notes), np.array([start, 0, 0]))
        room, way, foot, how = thread_room(), new_point_room(1), np.empty(d), NO_ROOM
        while how != DONE:  # bound: each turn answers a point, fills a row, or doubles the room
            how = entry_of(find_nearest_bodies)(
                points, stop, words, still.rows, moved.rows, most, nearest, notes, way, room, foot, budget.flag
            )
            budget.check()
            if how == NO_CANDIDATES:
                room = new_point_room(2 * len(room.candidates.bounds))
            elif how in (NO_ROOM, DONE):
                budget.take(_BYTES_OF_NOTE * int(notes.n[1]))
                left.append((notes.rows[: notes.n[1]].copy(), notes.bounds[: notes.n[1]].copy()))
                notes.n[1] = 0
            elif notes.n[2] < len(solids):
                still.prepare(int(notes.n[2]))
            else:
                moved.prepare(int(notes.n[2]) - len(solids))
        budget.take(-_BYTES_OF_NOTE * n_notes)

    run_chunks(task, n, budget=budget, workers=workers, progress=progress)
    n_exact = _settle(points, nearest, left, scene, limit, budget, workers) if any(len(rows) for rows, _ in left) else 0
    accuracy = Accuracy("exact", None if limit is not None else 0.5, n, n_exact, n_exact, kinds)
    if limit is not None:
        return nearest.distance == 0.0, accuracy
    _name_late(nearest, scene, still, moved)
    return SceneDistances(nearest.distance, nearest.body, nearest.point, *features), accuracy


def _settle(
    points: FloatArray, nearest: Nearest, left: list[tuple[Any, Any]], scene: Placements, limit: float | None,
    budget: Budget, workers: int | None,
) -> int:  # fmt: skip
    """Locate and measure what the kernel left; return how many distances integers decided."""
    rows, bounds = (np.concatenate(parts) for parts in zip(*left))
    are_held, features = rows[:, 2] == TO_LOCATE, nearest.features
    owners, bodies = rows[are_held, 0], rows[are_held, 1]
    are_inside = locate_given(points, owners, bodies, scene, budget, workers) == 1
    for item, body in sorted(zip(owners[are_inside].tolist(), bodies[are_inside].tolist()), reverse=True):
        if nearest.distance[item] > 0.0 or body < nearest.body[item]:
            nearest.distance[item], nearest.body[item], nearest.point[item] = 0.0, body, points[item]
            features.face[item], features.kind[item], features.numbers[item] = -1, NOWHERE, -1
    n_exact = 0
    for some, number in _turns(rows[~are_held], bounds[~are_held], nearest.distance, budget):
        solid, pose = scene.placed(number)
        query = PointQuery(read_only(points[some]), solid, pose, limit, limit is None, budget)
        try:
            query.fill(0, len(some), budget)
        except EmptyGeometryError as error:  # of half-spaces, which no box tells
            raise EmptyGeometryError(str(error).replace("solid", f"solids[{number}]", 1), ("solids", number)) from None
        answer: Any = query.result()
        n_exact += query.n_exact
        if limit is not None:
            nearest.distance[some[answer]] = 0.0
            continue
        best, body = nearest.distance[some], nearest.body[some]
        is_less = (answer.distance < best) | ((answer.distance == best) & (number < body))
        some = some[is_less]
        nearest.body[some] = number
        row: Any
        for row, name in zip(
            (nearest.distance, nearest.point, *features), ("distance", "point", "face", "kind", "index")
        ):
            row[some] = getattr(answer, name)[is_less]
    return n_exact


def _turns(rows: IntArray, bounds: FloatArray, best: FloatArray, budget: Budget) -> Iterator[tuple[IntArray, int]]:
    """Yield (points, body): which points are to be measured from a body next, in the order of `bounds` for each point.
    rows (n, 3): points and bodies. The consumer lowers `best`."""
    order = np.lexsort((bounds, rows[:, 0]))
    owners, bodies, bounds = rows[order, 0], rows[order, 1], bounds[order]
    starts = np.flatnonzero(np.diff(owners, prepend=-1))
    ranks = np.arange(len(owners)) - np.repeat(starts, np.diff(starts, append=len(owners)))
    for rank in range(ranks.max(initial=-1) + 1):
        budget.check()
        live = np.flatnonzero((ranks == rank) & ~(bounds > best[owners]))
        live = live[np.argsort(bodies[live], kind="stable")]
        for begin, end in pairwise(run_offsets(bodies[live]).tolist()):
            yield owners[live[begin:end]], int(bodies[live[begin]])


def _name_late(nearest: Nearest, scene: Placements, still: _Rows, moved: _Rows) -> None:
    """Name the features of meshes whose corners have no names; their rows have triangle and code as numbers."""
    face, kind, numbers = nearest.features
    late = np.flatnonzero((kind == OTHER) & (numbers[:, 1] >= 0))
    for item, row in zip(late.tolist(), scene.rows_of(nearest.body[late]).tolist()):
        n = len(still.rows)
        measure = still.measures[row] if row < n else moved.measures[row - n]
        codes = numbers[item : item + 1].copy()
        numbers[item] = -1
        measure.name(codes, Features(face[item : item + 1], kind[item : item + 1], numbers[item : item + 1]))


def _kinds_of(solids: Sequence[Solid], budget: Budget) -> str:
    """Return the types of solids, joined. Raises: as `check_measured`."""
    for body, solid in enumerate(solids):
        budget.check()
        check_measured(solid, body)
    return "+".join(sorted({solid.type for solid in solids}))


def _rows_of(bodies: Any) -> _Rows:
    return _Rows(bodies.solids, bodies.poses)


_NO_ROWS: Final = _Rows((), ())
