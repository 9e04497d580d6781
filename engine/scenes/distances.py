"""How far points are from the bodies of a scene: the nearest body of each point, and its distance.

The boxes of the bodies bound their distances from below. Bodies are measured in the order of these bounds, all points
whose turn comes to the same body together, until no bound of a point is below its distance.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Final

import numpy as np

from engine.distance.distances import Distances, PointQuery
from engine.errors import EmptyGeometryError
from engine.running.budget import Budget
from engine.running.parallel import Progress, run_chunks
from engine.scenes.placements import Placements
from engine.solids.columns import Columns
from engine.types import Accuracy, FloatArray, Int8Array, IntArray, read_only

_PAIRS: Final = 1 << 20
"""Pairs of points and bodies whose bounds are in memory at once."""
_BELOW: Final = 1.0 - 2.0**-48


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


def measure_all(
    points: FloatArray, placements: Placements, budget: Budget, workers: int | None, progress: Progress | None
) -> tuple[SceneDistances, Accuracy]:
    """Return the answer for points (n, d), and its accuracy; caller guarantees a body."""
    solids, poses = placements.base.solids, placements.poses
    boxes, n = placements.boxes(budget), len(points)
    best, body = np.full(n, np.inf), np.full(n, -1)
    rows: tuple[Any, ...] = (
        np.empty_like(points),
        np.empty(n, np.int64),
        np.empty(n, np.int8),
        np.empty((n, 2), np.int64),
    )
    n_exact = [0]

    def task(start: int, stop: int) -> None:
        for some, number in _turns(points, boxes, best, start, stop, max(1, _PAIRS // len(solids)), budget):
            query = PointQuery(
                read_only(points[some]), solids[number], poses[number], None, True, budget, where=("solids", number)
            )
            try:
                query.fill(0, len(some), budget)
            except EmptyGeometryError as error:  # of half-spaces, which no box tells
                raise EmptyGeometryError(
                    str(error).replace("solid", f"solids[{number}]", 1), ("solids", number)
                ) from None
            answer: Distances = query.result()
            n_exact[0] += query.n_exact
            is_less = (answer.distance < best[some]) | ((answer.distance == best[some]) & (number < body[some]))
            some = some[is_less]
            columns: tuple[Any, ...] = answer.point, answer.face, answer.kind, answer.index
            best[some], body[some] = answer.distance[is_less], number
            for row, column in zip(rows, columns):
                row[some] = column[is_less]

    run_chunks(task, n, budget=budget, workers=workers, progress=progress)
    kinds = "+".join(sorted({solid.type for solid in solids}))
    return SceneDistances(best, body, *rows), Accuracy("exact", 0.5, n, n_exact[0], n_exact[0], kinds)


def _turns(
    points: FloatArray, boxes: FloatArray, best: FloatArray, start: int, stop: int, step: int, budget: Budget
) -> Iterator[tuple[IntArray, int]]:
    """Yield (points, body): which of the points start .. stop - 1 are to be measured from a body next. boxes: low and
    high (m, 2, d) of the bodies, maybe infinite. The consumer lowers `best`."""
    for first in range(start, stop, step):
        last = min(first + step, stop)
        bounds = _bounds(points[first:last], boxes)
        order = np.argsort(bounds, axis=1, kind="stable")
        live = np.arange(last - first)
        for turn in range(len(boxes)):
            budget.check()
            bodies = order[live, turn]
            is_near = ~(bounds[live, bodies] > best[first + live])
            live, bodies = live[is_near], bodies[is_near]
            if not len(live):
                break
            by_body = np.argsort(bodies, kind="stable")
            cuts = np.flatnonzero(np.diff(bodies[by_body], prepend=-1))
            for group in np.split(by_body, cuts[1:]):
                yield first + live[group], int(bodies[group[0]])


def _bounds(points: FloatArray, boxes: FloatArray) -> Any:
    """Return lower bounds (n, m) on the distances of points from boxes: some 6 roundings are far below what is left
    out; what overflows or is no number is 0."""
    with np.errstate(all="ignore"):
        square = np.zeros((len(points), len(boxes)))
        for axis in range(points.shape[1]):
            x = points[:, axis, None]
            gap = np.maximum(np.maximum(boxes[None, :, 0, axis] - x, x - boxes[None, :, 1, axis]), 0.0)
            square += gap * gap
        bounds = np.sqrt(square) * _BELOW
    return np.where(np.isfinite(bounds), bounds, 0.0)
