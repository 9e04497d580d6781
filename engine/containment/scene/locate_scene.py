"""Public: which of many solids hold each of many points.

A pass over the points finds the candidates and decides most of them (first_pass.py). What it leaves open is settled
body by body (second_pass.py), and the answers are put together point by point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Final, Literal, Unpack, overload

import numpy as np

from engine.arrays import BoolArray, FloatArray, Int8Array, IntArray
from engine.budget import Budget, Cancel
from engine.containment.at_once import are_few, locate_one_by_one
from engine.containment.scene.first_pass import drop_outside, put_in_order, scan_points, sort_by_cell
from engine.containment.scene.second_pass import settle_rest
from engine.containment.scene.tables import Scene, scene_of
from engine.errors import InvalidArrayError, WrongDimensionError
from engine.parallel import Options, Progress, check_options, run_chunks
from engine.solids.base import Solid
from engine.solids.checks import as_points
from engine.solids.pose import Pose
from engine.solids.ragged import Ragged
from engine.types import Accuracy

_MOST_PAIRS: Final = 1 << 23
"""Candidate pairs held at once, about 300 MB; the rest of the points waits (one piece of work is done at least)."""

_BYTES: Final = 32
"""Of a candidate pair, and later of a body and point that it holds, in the pieces and in the answer."""
_MOST_IN_BLOCK: Final = 1 << 16
"""Points that are scanned in the order of their cells."""


@dataclass(frozen=True, slots=True)
class SceneLocations(Ragged):
    """The bodies that hold each point: those of point i are ``indices[offsets[i]:offsets[i + 1]]``, ascending."""

    _levels: ClassVar[tuple[str, ...]] = ("indices", "offsets")
    offsets: IntArray
    """``(n_points + 1,)`` int64."""
    indices: IntArray
    """``(n_held,)`` int64: positions in the list of solids."""
    on_boundary: BoolArray
    """``(n_held,)``: True where the point is on the body's boundary, False where it is inside."""


@dataclass(frozen=True, slots=True)
class _Piece:
    """What the first pass found for the points from `start` on, as `scan_points` lists it."""

    start: int
    counts: IntArray
    bodies: IntArray
    located: Int8Array
    places: IntArray
    owners: IntArray
    n_beyond: int


@overload
def locate_scene(
    points: object,
    solids: Sequence[Solid],
    poses: Sequence[Pose | None] | None = None,
    *,
    report: Literal[False] = False,
    **options: Unpack[Options],
) -> SceneLocations: ...
@overload
def locate_scene(
    points: object,
    solids: Sequence[Solid],
    poses: Sequence[Pose | None] | None = None,
    *,
    report: Literal[True],
    **options: Unpack[Options],
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

    A grid over the bodies' boxes gives each point's candidates, and float filters with proven bounds decide most of
    them at once; what they leave, each body locates as `locate` does. For one solid use `locate`.

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
    check_bodies(solids, poses)
    check_options(workers, progress, report=report)
    array = as_points(points, solids[0].dimension if len(solids) else None)
    with Budget(deadline, cancel) as budget:
        if are_few(array, solids):
            found = locate_few(array, solids, poses, budget, progress)
        else:
            found = locate_in(array, scene_of(solids, poses, array.shape[1], budget), budget, workers, progress)
    return found if report else found[0]


def locate_few(
    array: FloatArray,
    solids: Sequence[Solid],
    poses: Sequence[Pose | None] | None,
    budget: Budget,
    progress: Progress | None = None,
) -> tuple[SceneLocations, Accuracy]:
    """Return the bodies that hold each of a few checked points (`are_few`).

    What went beyond the filter counts for each body, up to the number of points; tables count each point once.
    """
    located, counts, is_exact = locate_one_by_one(array, solids, poses, budget)
    n = len(array)
    if progress is not None:
        progress(n)
    owners, bodies = np.nonzero(located.T >= 0)
    offsets = np.searchsorted(owners, np.arange(n + 1))
    decisions: Literal["exact", "float64"] = "exact" if is_exact else "float64"
    accuracy = Accuracy(decisions, None, n, min(n, counts.beyond), min(n, counts.rational), "box_grid")
    return SceneLocations(offsets, bodies, located[bodies, owners] == 0), accuracy


def locate_in(
    array: FloatArray, scene: Scene, budget: Budget, workers: int | None, progress: Progress | None
) -> tuple[SceneLocations, Accuracy]:
    """Return the bodies of a prepared scene that hold each of some checked points."""
    done: list[_Piece] = []
    n_beyond = n_rational = 0
    todo = [(0, -(-len(array) // _block_size(scene)))]
    while todo:  # bound: each turn does a piece of work
        pieces, todo = _scan(array, todo, scene, budget, workers)
        counts = settle_rest(
            array, scene, [piece.owners for piece in pieces], [piece.bodies[piece.places] for piece in pieces],
            [partial(piece.located.__setitem__, piece.places) for piece in pieces], budget, workers,
        )  # fmt: skip
        n_beyond += counts.beyond + sum(piece.n_beyond for piece in pieces)
        n_rational += counts.rational
        held = [_held(piece) for piece in pieces]
        budget.take(_BYTES * sum(len(kept.bodies) - len(piece.bodies) for kept, piece in zip(held, pieces)))
        done += held
        if progress is not None:
            progress(sum(len(piece.counts) for piece in pieces))
    budget.check()
    done.sort(key=lambda piece: piece.start)
    offsets = np.zeros(len(array) + 1, np.int64)
    if done:
        np.cumsum(np.concatenate([piece.counts for piece in done]), out=offsets[1:])
    result = SceneLocations(
        offsets,
        np.concatenate([np.zeros(0, np.int64), *(piece.bodies for piece in done)]),
        np.concatenate([np.zeros(0, np.int8), *(piece.located for piece in done)]) == 0,
    )
    is_exact = all(locator.decisions == "exact" for locator in scene.locators.values())
    decisions: Literal["exact", "float64"] = "exact" if is_exact else "float64"
    n = len(array)
    return result, Accuracy(decisions, None, n, min(n_beyond, n), min(n_rational, n), "box_grid")


def check_bodies(solids: Sequence[Solid], poses: Sequence[Pose | None] | None) -> None:
    """Raise unless these are solids of one dimension and a pose or None for each, naming the first that is wrong."""
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


def _scan(
    points: FloatArray, todo: list[tuple[int, int]], scene: Scene, budget: Budget, workers: int | None
) -> tuple[list[_Piece], list[tuple[int, int]]]:
    """Return what the first pass finds in ranges of blocks of points, and the ranges that there was no room for."""
    pieces: list[_Piece] = []
    left: list[tuple[int, int]] = []
    size = _block_size(scene)
    n_pairs = 0

    def task(first: int, start: int, stop: int) -> None:
        nonlocal n_pairs
        for block in range(first + start, first + stop):
            if n_pairs > _MOST_PAIRS:
                left.append((block, first + stop))
                return
            piece = _scan_block(points[block * size : (block + 1) * size], block * size, scene, budget)
            budget.take(_BYTES * len(piece.bodies))
            pieces.append(piece)
            n_pairs += len(piece.bodies)

    for first, last in todo:
        run_chunks(partial(task, first), last - first, budget=budget, first_chunk=1, workers=workers)
    return pieces, left


def _block_size(scene: Scene) -> int:
    """Return how many points are scanned together: so few that even all candidates of all of them find room."""
    return max(1, min(_MOST_IN_BLOCK, _MOST_PAIRS // (4 * scene.most)))


def _scan_block(points: FloatArray, start: int, scene: Scene, budget: Budget) -> _Piece:
    """Return what the first pass finds for a block of points that begins at `start`."""
    n, n_cells = len(points), len(scene.grid.offsets)
    shift = max(0, (n_cells // n).bit_length())
    order, in_order = np.empty(n, np.int32), np.empty_like(points)
    ends = np.zeros((n_cells >> shift) + 2, np.int64)
    sorted_counts, room = np.zeros(n, np.int64), n + n // 2 + scene.most
    with np.errstate(all="ignore"):
        sort_by_cell(points, scene.grid, shift, np.empty(n, np.int32), ends, order, in_order)
        while True:  # bound: the room doubles until it holds all candidates
            bodies, located = np.empty(room, np.int32), np.empty(room, np.int8)
            n_done, n_listed, n_beyond = scan_points(
                in_order, scene.tables, scene.grid, scene.unbounded, sorted_counts, bodies, located, budget.flag
            )
            if n_done == n or budget.flag[0]:
                break
            room *= 2
    n_listed = 0 if budget.flag[0] else int(n_listed)  # a call about to end leaves nothing behind
    counts = np.zeros(n, np.int64)
    places, owners = np.empty(n_listed, np.int64), np.empty(n_listed, np.int64)
    lists = np.empty(n_listed, np.int64), np.empty(n_listed, np.int8), places, owners
    n_open = 0
    if n_listed:
        n_open = int(put_in_order(order, sorted_counts, bodies, located, counts, np.empty(n, np.int64), lists))
    owners += start
    return _Piece(start, counts, lists[0], lists[1], places[:n_open].copy(), owners[:n_open].copy(), int(n_beyond))


def _held(piece: _Piece) -> _Piece:
    """Return the piece without the bodies that do not hold their point."""
    if not len(piece.places):
        return piece
    n_held = int(drop_outside(piece.counts, piece.bodies, piece.located))
    return replace(piece, bodies=piece.bodies[:n_held], located=piece.located[:n_held])
