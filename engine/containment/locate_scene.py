"""Public: which of many solids hold each of many points.

Boxes choose the candidates, grouped by body so that each body locates all of its candidates in one batch; the answers
are written back point by point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, overload

import numpy as np
import numpy.typing as npt

from engine.bounding.grid import BoxGrid, build_box_grid
from engine.containment.body_boxes import body_box
from engine.containment.locators import Locator
from engine.containment.posed import posed_locator
from engine.containment.scene_pairs import count_candidates, group_by_body, list_candidates
from engine.errors import EngineError, InvalidArrayError, WrongDimensionError
from engine.parallel import Budget, Cancel, Progress, check_options, run_chunks
from engine.solids.base import FloatArray, IntArray, Solid
from engine.solids.checks import as_points
from engine.solids.pose import Pose
from engine.types import Accuracy

_MOST_PAIRS: Final = 1 << 23
"""Candidate pairs held at once, about 300 MB; points are taken in portions below it (one point at least)."""
_MOST_POINTS: Final = 1 << 22
_MOST_IN_GROUP: Final = 1 << 14
"""Points that one body locates in one piece of work."""


@dataclass(frozen=True, slots=True)
class SceneLocations:
    """The bodies that hold each point: those of point i are ``indices[offsets[i]:offsets[i + 1]]``, ascending."""

    offsets: IntArray
    """``(n_points + 1,)`` int64."""
    indices: IntArray
    """``(n_held,)`` int64: positions in the list of solids."""
    on_boundary: npt.NDArray[np.bool_]
    """``(n_held,)``: True where the point is on the body's boundary, False where it is inside."""


@dataclass(frozen=True, slots=True)
class _Scene:
    """Bodies sorted into those with a box and those without."""

    lows: FloatArray
    highs: FloatArray
    grid: BoxGrid
    bounded: IntArray
    unbounded: IntArray
    locators: list[Locator]


@overload
def locate_scene(
    points: object,
    solids: Sequence[Solid],
    poses: Sequence[Pose | None] | None = ...,
    *,
    workers: int | None = ...,
    deadline: float | None = ...,
    cancel: Cancel | None = ...,
    progress: Progress | None = ...,
    report: Literal[False] = ...,
) -> SceneLocations: ...
@overload
def locate_scene(
    points: object,
    solids: Sequence[Solid],
    poses: Sequence[Pose | None] | None = ...,
    *,
    workers: int | None = ...,
    deadline: float | None = ...,
    cancel: Cancel | None = ...,
    progress: Progress | None = ...,
    report: Literal[True],
) -> tuple[SceneLocations, Accuracy]: ...
def locate_scene(
    points: object,
    solids: Sequence[Solid],
    poses: Sequence[Pose | None] | None = None,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> SceneLocations | tuple[SceneLocations, Accuracy]:
    """Find for each point the solids that hold it, inside or on the boundary.

    A grid over the bodies' boxes gives each point's candidates; each body then locates its candidates as `locate` does.
    For one solid use `locate`.

    Parameters
        points: ``(n_points, dimension)`` numbers; borrowed.
        solids: any but surfaces, all of the points' dimension; the same object may stand for many bodies.
        poses: one `Pose` or None for each solid. A posed solid is the exact image of the solid under R p + t; a sphere
            keeps its radius about the exact image of its centre.
        workers, deadline, cancel, progress, report: as in `locate`; progress counts points.
    Returns
        `SceneLocations`; with report=True a pair of it and an `Accuracy`.
    Boundary: a point on a wall that two bodies share is on both.
    Degenerate input: no points and no solids are welcome; solids as in `locate`.
    Accuracy: exact, also for posed solids: the image of the matrix as given is meant, not that of a nearby rotation.
    Cost: bodies in the cells of the points; bodies without bounds (half_space, convex, implicit, the prism over a
        triangle of space) are asked about every point.
    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError, UnsupportedSolidError, DeadlineExceededError,
        CancelledError.

    >>> from engine import Aabb, Pose, locate_scene
    >>> box = Aabb([0, 0], [1, 1])
    >>> held = locate_scene([[0.5, 0.5], [1, 0.5], [9, 9]], [box, box], [None, Pose([[1, 0], [0, 1]], [1, 0])])
    >>> held.offsets.tolist(), held.indices.tolist(), held.on_boundary.tolist()
    ([0, 1, 3, 3], [0, 0, 1], [False, True, True])
    """
    _check_solids(solids, poses)
    check_options(workers, progress)
    array = as_points(points, solids[0].dimension if len(solids) else None)
    held_counts = np.zeros(len(array) + 1, np.int64)
    portions: list[tuple[IntArray, npt.NDArray[np.bool_]]] = []
    totals = [0, 0]
    with Budget(deadline, cancel) as budget:
        scene = _prepare(solids, poses, array.shape[1], budget)
        start = 0
        while start < len(array):  # bound: each portion holds a point
            counts = _count(array[start : start + _MOST_POINTS], scene, budget, workers)
            ends = np.cumsum(counts)
            stop = max(1, int(np.searchsorted(ends, _MOST_PAIRS, side="right")))
            chunk = array[start : start + stop]
            owners, bodies, located = _locate_pairs(chunk, counts[:stop], scene, budget, workers, totals)
            held = np.flatnonzero(located >= 0)
            held_counts[start + 1 : start + stop + 1] = np.bincount(owners[held], minlength=stop)
            portions.append((bodies[held], located[held] == 0))
            start += stop
            if progress is not None:
                progress(stop)
        budget.check()
    result = SceneLocations(
        np.cumsum(held_counts),
        np.concatenate([indices for indices, _ in portions] or [np.zeros(0, np.int64)]),
        np.concatenate([on_boundary for _, on_boundary in portions] or [np.zeros(0, np.bool_)]),
    )
    if not report:
        return result
    is_exact = all(locator.decisions == "exact" for locator in scene.locators)
    decisions: Literal["exact", "float64"] = "exact" if is_exact else "float64"
    beyond, rational = (min(total, len(array)) for total in totals)
    return result, Accuracy(decisions, None, len(array), beyond, rational, "box_grid")


def _check_solids(solids: Sequence[Solid], poses: Sequence[Pose | None] | None) -> None:
    if not isinstance(solids, (list, tuple)):
        raise InvalidArrayError(f"solids must be a list of solids, got {type(solids).__name__}", ("solids",))
    for index, solid in enumerate(solids):
        if not isinstance(solid, Solid):
            raise InvalidArrayError(f"solids[{index}] must be a solid, got {type(solid).__name__}", ("solids", index))
        if solid.dimension != solids[0].dimension:
            raise WrongDimensionError(
                f"solids[{index}] is {solid.dimension}D, solids[0] {solids[0].dimension}D; use one dimension",
                ("solids", index),
            )
    if poses is None:
        return
    if not isinstance(poses, (list, tuple)) or len(poses) != len(solids):
        given = f"{len(poses)}" if isinstance(poses, (list, tuple)) else type(poses).__name__
        raise InvalidArrayError(f"poses must be a list of {len(solids)}, one for each solid, got {given}", ("poses",))
    for index, pose in enumerate(poses):
        if pose is not None and not isinstance(pose, Pose):
            raise InvalidArrayError(
                f"poses[{index}] must be a Pose or None, got {type(pose).__name__}", ("poses", index)
            )
        if pose is not None and pose.dimension != solids[index].dimension:
            raise WrongDimensionError(
                f"poses[{index}] is {pose.dimension}D, its solid {solids[index].dimension}D", ("poses", index)
            )


def _prepare(solids: Sequence[Solid], poses: Sequence[Pose | None] | None, dimension: int, budget: Budget) -> _Scene:
    """Return boxes, grid and locators of the bodies."""
    lows, highs = np.empty((len(solids), dimension)), np.empty((len(solids), dimension))
    locators = []
    for index, solid in enumerate(solids):
        if index % 64 == 0:
            budget.check()
        pose = None if poses is None else poses[index]
        try:
            locators.append(posed_locator(solid, pose))
        except EngineError as error:
            error.where = ("solids", index)
            raise
        lows[index], highs[index] = body_box(solid, pose)
    is_bounded = np.isfinite(lows).all(axis=1) & np.isfinite(highs).all(axis=1)
    is_empty = (lows > highs).any(axis=1)
    bounded = np.flatnonzero(is_bounded & ~is_empty)
    lows, highs = lows[bounded], highs[bounded]
    side = max(1, min(1024, int(len(bounded) ** 0.5) * 2))
    if len(bounded):
        x_low, x_high, y_low, y_high = (np.ascontiguousarray(s[:, k]) for k in (0, 1) for s in (lows, highs))
        grid = build_box_grid(x_low, x_high, y_low, y_high, side, side)
    else:
        nothing = np.full(1, np.inf)
        grid = build_box_grid(nothing, -nothing, nothing, -nothing, 1, 1)
    return _Scene(lows, highs, grid, bounded, np.flatnonzero(~is_bounded & ~is_empty), locators)


def _count(points: FloatArray, scene: _Scene, budget: Budget, workers: int | None) -> IntArray:
    """Return how many candidates each point has."""
    counts = np.empty(len(points), np.int64)

    def task(start: int, stop: int) -> None:
        count_candidates(points[start:stop], scene.lows, scene.highs, scene.grid, counts[start:stop], budget.flag)

    run_chunks(task, len(points), budget=budget, workers=workers)
    counts += len(scene.unbounded)
    return counts


def _locate_pairs(
    points: FloatArray, counts: IntArray, scene: _Scene, budget: Budget, workers: int | None, totals: list[int]
) -> tuple[IntArray, IntArray, npt.NDArray[np.int8]]:
    """Return owner, body and location of each candidate pair, by point and then by body."""
    firsts = np.cumsum(counts) - counts
    n_pairs = int(counts.sum())
    owners, bodies = np.empty(n_pairs, np.int64), np.empty(n_pairs, np.int64)

    def list_pairs(start: int, stop: int) -> None:
        list_candidates(
            points[start:stop],
            scene.lows,
            scene.highs,
            scene.grid,
            scene.bounded,
            scene.unbounded,
            firsts[start:stop],
            owners,
            bodies,
            budget.flag,
        )
        if start:
            first, last = int(firsts[start]), int(firsts[stop]) if stop < len(points) else n_pairs
            owners[first:last] += start

    run_chunks(list_pairs, len(points), budget=budget, workers=workers)
    sizes = np.bincount(bodies, minlength=len(scene.locators))
    ends = np.cumsum(sizes) - sizes
    groups = [
        (int(body), int(begin), int(min(begin + _MOST_IN_GROUP, ends[body] + sizes[body])))
        for body in np.flatnonzero(sizes)
        for begin in range(int(ends[body]), int(ends[body] + sizes[body]), _MOST_IN_GROUP)
    ]
    order, located = np.empty(n_pairs, np.int64), np.empty(n_pairs, np.int8)
    group_by_body(bodies, ends, order)
    found_counts = []

    def locate_groups(start: int, stop: int) -> None:
        for body, begin, end in groups[start:stop]:
            places = order[begin:end]
            found = np.empty(end - begin, np.int8)
            locator = scene.locators[body].chosen(end - begin, budget)
            found_counts.append(locator.fill(points[owners[places]], found, budget))
            located[places] = found

    run_chunks(locate_groups, len(groups), budget=budget, first_chunk=1, workers=workers)
    totals[0] += sum(found.beyond for found in found_counts)
    totals[1] += sum(found.rational for found in found_counts)
    return owners, bodies, located
