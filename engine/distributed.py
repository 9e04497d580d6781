"""Batches over Dask: the functions below, on more than one machine.

Each function splits its batch into parts, sends the solids once to every worker, keeps a few parts per thread in flight
and puts the answers in order, so that the result is that of the function of the same name in `engine`, bit for bit. A
part whose worker is lost is given to another; the answer of a part has its own place, so nothing is lost or counted
twice. Dask gives a part up after some lost workers (its setting `distributed.scheduler.allowed-failures`) and raises
`KilledWorker`. Needs the extra ``distributed`` and, on each worker, this package.

client: a `distributed.Client`, its threads are used. part: items sent at a time. progress: called with the number of
items just finished. All other parameters, results and errors are those of the function in `engine`.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import dask.config
import numpy as np
from distributed import Client, Future, as_completed

from engine.collision import collide_poses as poses
from engine.containment import locate as containment
from engine.distance import clearance as clearances
from engine.distance import distances as point_distances
from engine.distance.clearance import checked_distance
from engine.errors import InvalidArrayError, InvalidInputError
from engine.layers import frame_joins as joins
from engine.layers import frames
from engine.layers.frame_reading import mixed_of
from engine.layers.joins import check_predicate
from engine.layers.limits import Limits
from engine.layers.path_rows import clip_mixed, overlay_mixed, sorted_rows
from engine.layers.rows import HOWS, NONE, LayerRows
from engine.layers.shapes import MixedLayer, single_points
from engine.polygon_overlay.batch import OverlayBatch, join_batches
from engine.polygon_overlay.batch import overlay_batch as overlay_pairs
from engine.polygon_overlay.run import Operation
from engine.running.parallel import Progress, check_options
from engine.scenes.ends import ScenePieces
from engine.scenes.hits import SceneHits
from engine.scenes.scene import Keep, Scene
from engine.segment_clipping import clip_segments as clipping
from engine.segment_clipping import hits as one
from engine.segment_clipping.hits import Hits
from engine.solid_cutting import overlap as overlaps
from engine.solid_cutting import section as sections
from engine.solid_cutting.overlap_batches import check_same_length
from engine.solids.base import Solid
from engine.solids.checks import as_floats, as_point_groups, as_points, shown
from engine.types import BoolArray, FloatArray, Int8Array

if TYPE_CHECKING:
    from geopandas import GeoDataFrame

PARTS_PER_THREAD = 3
"""Parts sent out at a time for each thread: enough to hide the network, few enough for batches larger than a worker's
memory."""

Function = Callable[..., Any]


def locate(
    client: Client, points: object, solid: Solid, *, part: int = 200_000, progress: Progress | None = None
) -> Int8Array:
    """Locate points in a solid, see `engine.locate`."""
    rows = as_points(points, solid.dimension)
    function = partial(_about_rows, containment.locate)
    return _filled(np.int8, _answers(client, function, (solid,), (rows,), part, progress), len(rows))


def collide_poses(
    client: Client, first: Solid, second: Solid, rotations: object, translations: object, *, part: int = 2_000,
    progress: Progress | None = None,
) -> Int8Array:  # fmt: skip
    """Decide how `first` lies to `second` under many poses, see `engine.collide_poses`."""
    turns, moves = poses.as_poses(rotations, translations, first.dimension)
    function = partial(_about_solids, poses.collide_poses)
    return _filled(np.int8, _answers(client, function, (first, second), (turns, moves), part, progress), len(turns))


def clearance_poses(
    client: Client, first: Solid, second: Solid, rotations: object, translations: object, *,
    at_least: float | None = None, part: int = 2_000, progress: Progress | None = None,
) -> FloatArray | BoolArray:  # fmt: skip
    """Say how far `first` is from `second` under many poses, see `engine.clearance_poses`."""
    turns, moves = poses.as_poses(rotations, translations, first.dimension)
    least = None if at_least is None else checked_distance(at_least)
    function = partial(_about_solids, clearances.clearance_poses, at_least=least)
    answers = _answers(client, function, (first, second), (turns, moves), part, progress)
    return _filled(np.float64 if least is None else np.bool_, answers, len(turns))


def distances(
    client: Client, points: object, solid: Solid, *, to: Literal["solid", "boundary"] = "solid", signed: bool = False,
    within: float | None = None, part: int = 100_000, progress: Progress | None = None,
) -> FloatArray | BoolArray:  # fmt: skip
    """Say how far points are from a solid, or whether within a distance, see `engine.distances`."""
    rows = as_points(points, solid.dimension)
    options: Any = {"to": to, "signed": signed, "within": within}
    none: Any = point_distances.distances(rows[:0], solid, **options)  # checks the options here, not on a worker
    function = partial(_about_rows, point_distances.distances, **options)
    return _filled(none.dtype, _answers(client, function, (solid,), (rows,), part, progress), len(rows))


def clip_segments(
    client: Client, segments: object, region: Solid, *, part: int = 100_000, progress: Progress | None = None
) -> clipping.SegmentPieces:
    """Clip segments on a region, see `engine.clip_segments`."""
    rows = as_point_groups(segments, 2, region.dimension, ("segments",))
    return _joined(client, partial(_about_rows, clipping.clip_segments), region, rows, part, progress)


def clip_segments_scene(
    client: Client, segments: object, scene: Scene, *, keep: Keep = "all", part: int = 20_000,
    progress: Progress | None = None,
) -> ScenePieces | BoolArray:  # fmt: skip
    """Clip segments on the bodies of a scene, see `engine.Scene.clip_segments`; the scene is sent once to every worker
    and stays prepared there."""
    rows = as_point_groups(segments, 2, scene.solids[0].dimension if len(scene) else None, ("segments",))
    return _joined(client, partial(_about_solids, Scene.clip_segments, keep=keep), scene, rows, part, progress)


def hits(
    client: Client, segments: object, surface: Solid | Scene, *, rays: bool = False, keep: Keep = "all",
    part: int = 50_000, progress: Progress | None = None,
) -> Hits | SceneHits | BoolArray:  # fmt: skip
    """Find where segments or rays meet a surface, or the bodies of a scene, see `engine.hits`, `engine.Scene.hits`."""
    rows = as_point_groups(segments, 2, 3, ("segments",))
    function = partial(_about_rows, one.hits, rays=rays, keep=keep)
    if isinstance(surface, Scene):
        function = partial(_about_solids, Scene.hits, rays=rays, keep=keep)
    return _joined(client, function, surface, rows, part, progress)


def overlay_batch(
    client: Client, subjects: Sequence[Solid], clips: Sequence[Solid], operation: Operation = "intersection", *,
    part: int = 1_000, progress: Progress | None = None,
) -> OverlayBatch:  # fmt: skip
    """Combine pairs of polygons, see `engine.overlay_batch`."""
    none: Any = overlay_pairs(subjects[:0], clips[:0], operation)  # checks the operation here, not on a worker
    if len(subjects) != len(clips):
        raise InvalidArrayError(
            f"subjects and clips must be of equal length, got {len(subjects)} and {len(clips)}", ("clips",)
        )
    function = partial(_about_rows, overlay_pairs, operation=operation)
    parts_done = _in_order(_answers(client, function, (), (subjects, clips), part, progress))
    return join_batches([none, *(batch for _, batch in parts_done)])


def sjoin(
    client: Client, left: GeoDataFrame, right: GeoDataFrame, how: joins.How = "inner", predicate: str = "intersects", *,
    distance: float | None = None, lsuffix: str = "left", rsuffix: str = "right", part: int = 20_000,
    progress: Progress | None = None,
) -> GeoDataFrame:  # fmt: skip
    """Join layers, see `engine.layers.sjoin`: parts of the left layer along a curve that fills the plane, each sent
    with the features of the right that are near it."""
    joins.check_join("sjoin", left, right, how, lsuffix, rsuffix, {})
    reach = check_predicate(predicate, distance)
    for name, side in (("left", left), ("right", right)):
        mixed_of(side, name, Limits(None, None))  # a worker could not say which feature is wrong, and sees not all
    tasks = _Tiles(left, right, _order(left), reach)
    function = partial(_related, predicate=predicate, distance=distance)
    pairs = [
        np.zeros((0, 2), np.int64),
        *(made for _, made in _answers(client, function, (), (tasks,), part, progress)),
    ]
    both = np.concatenate(pairs)
    return joins.joined(left, right, both[np.lexsort((both[:, 1], both[:, 0]))], how, (lsuffix, rsuffix))


def overlay(
    client: Client, left: GeoDataFrame, right: GeoDataFrame, how: str = "intersection",
    keep_geom_type: bool | None = None, *, grid: float | None = None, wrap: float | None = None, part: int = 5_000,
    progress: Progress | None = None,
) -> GeoDataFrame:  # fmt: skip
    """Overlay a layer with one of polygons, see `engine.layers.overlay`: parts as those of `sjoin`, first of the left
    layer, then of the right one where its remainders are in the answer."""
    layers = frames.checked_overlay(left, right, how, keep_geom_type, Limits(None, None, None, grid, wrap), {})
    kinds = frames.kinds_of(layers[0], keep_geom_type is not False)
    of_pairs, of_left, of_right = HOWS[how]
    options: Any = {"grid": grid, "wrap": wrap, "kinds": kinds, "with_touching": keep_geom_type is False}
    reach, rows = np.inf if wrap else 0.0, list[LayerRows]()
    for sides, name, is_turned in (
        ((left, right), ("identity" if of_left else "intersection") if of_pairs else "difference", False),
        *([((right, left), "difference", True)] if of_right else []),
    ):
        ask = partial(_overlaid, how=name, is_turned=is_turned, **options)
        rows += [
            made for _, made in _answers(client, ask, (), (_Tiles(*sides, _order(sides[0]), reach),), part, progress)
        ]
    nothing = single_points(np.zeros((0, 2)))
    none = overlay_mixed(nothing, nothing, how, Limits(None, None), kinds, False)
    return frames.overlaid(left, right, sorted_rows([none, *rows]), how, keep_geom_type, kinds)


def clip(
    client: Client, layer: GeoDataFrame, mask: Any, keep_geom_type: bool = False, *, keep: str = "inside",
    grid: float | None = None, wrap: float | None = None, part: int = 20_000, progress: Progress | None = None,
) -> GeoDataFrame:  # fmt: skip
    """Cut a layer to the union of some polygons, see `engine.layers.clip`: parts of the layer, as those of `sjoin`; the
    mask is sent once to every worker."""
    limits = Limits(None, None, None, grid, wrap, keep)
    sides = frames.checked_clip(layer, mask, keep_geom_type, limits, {})
    options: Any = {"grid": grid, "wrap": wrap, "keep": keep, "with_touching": not keep_geom_type}
    kinds = frames.kinds_of(sides[0], keep_geom_type)
    ask = partial(_clipped, kinds=kinds, **options)
    tiles = _Tiles(layer, layer.iloc[:0], _order(layer), 0.0)
    none = clip_mixed(single_points(np.zeros((0, 2))), sides[1], limits, kinds, False)
    made = [rows for _, rows in _answers(client, ask, (sides[1],), (tiles,), part, progress)]
    return frames.frame_of_left(layer, sorted_rows([none, *made]))


def _overlaid(
    shared: tuple[Any, ...], tile: Any, how: str, is_turned: bool, grid: Any, wrap: Any, **options: Any
) -> LayerRows:
    """Return the rows of a part of both layers; is_turned: of a part of the right one."""
    limits = Limits(None, None, 1, grid, wrap)
    numbers, sides = _sides_of(tile, limits)
    rows = overlay_mixed(*sides, how, limits, **options)
    first, second = (np.append(each, NONE)[of] for each, of in zip(numbers, (rows.left, rows.right)))
    return replace(rows, left=second, right=first) if is_turned else replace(rows, left=first, right=second)


def _clipped(shared: tuple[Any, ...], tile: Any, grid: Any, wrap: Any, keep: str, **options: Any) -> LayerRows:
    limits = Limits(None, None, 1, grid, wrap, keep)
    (numbers, _), (layer, _) = _sides_of(tile, limits)
    rows = clip_mixed(layer, shared[0], limits, **options)
    return replace(rows, left=numbers[rows.left])


def _sides_of(tile: Any, limits: Limits) -> tuple[tuple[Any, Any], tuple[MixedLayer, MixedLayer]]:
    """Return the numbers of features of a part of both layers, and these layers."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # they are given where the call is
        first, second = (mixed_of(each.to_frame("geometry"), "layer", limits) for each in tile[2:])
        return tile[:2], (first, second)


def _order(layer: GeoDataFrame) -> Any:
    """Return the numbers of features along a curve that fills the plane, then of those without geometry."""
    is_filled = ~(layer.geometry.isna() | layer.geometry.is_empty).to_numpy()
    there = np.flatnonzero(is_filled)
    if len(there):
        there = there[np.argsort(layer.geometry.iloc[there].hilbert_distance().to_numpy(), kind="stable")]
    return np.append(there, np.flatnonzero(~is_filled))


class _Tiles:
    """Parts of a layer in an order, with the features of another one within a distance of their boxes."""

    def __init__(self, left: GeoDataFrame, right: GeoDataFrame, order: Any, reach: float) -> None:
        self._sides, self._order, self._reach = (left, right), order, reach
        self._boxes = [side.geometry.bounds.to_numpy() for side in (left, right)]

    def __len__(self) -> int:
        return len(self._order)

    def __getitem__(self, some: slice) -> Any:
        rows = self._order[some]
        own, theirs = self._boxes[0][rows], self._boxes[1]
        low = np.nextafter(np.fmin.reduce(own[:, :2], initial=np.inf) - self._reach, -np.inf)
        high = np.nextafter(np.fmax.reduce(own[:, 2:], initial=-np.inf) + self._reach, np.inf)
        near = np.flatnonzero(((theirs[:, :2] <= high) & (theirs[:, 2:] >= low)).all(axis=1))
        parts = [side.geometry.iloc[each].reset_index(drop=True) for side, each in zip(self._sides, (rows, near))]
        return rows, near, *parts


def _related(shared: tuple[Any, ...], tile: Any, predicate: str, distance: float | None) -> Any:
    """Return pairs (n, 2) of features that are related, of a part of both layers."""
    rows, near, left, right = tile
    sides = left.to_frame("geometry"), right.to_frame("geometry")
    made = joins.sjoin(sides[0], sides[1], "inner", predicate, distance=distance, workers=1)
    return np.column_stack([rows[made.index.to_numpy()], near[made["index_right"].to_numpy()]])


def overlap_volume(
    client: Client, first: Any, second: Any, *, first_pose: Any = None, second_pose: Any = None, part: int = 2_000,
    progress: Progress | None = None,
) -> FloatArray:  # fmt: skip
    """Return what pairs of solids have in common, lists or arrays, see `engine.overlap_volume`."""
    return _of_pairs(client, overlaps.overlap_volume, first, second, (first_pose, second_pose), part, progress)


def iou(
    client: Client, first: Any, second: Any, *, first_pose: Any = None, second_pose: Any = None, part: int = 2_000,
    progress: Progress | None = None,
) -> FloatArray:  # fmt: skip
    """Return the same over the volume of their union, see `engine.iou`."""
    return _of_pairs(client, overlaps.iou, first, second, (first_pose, second_pose), part, progress)


def _of_pairs(
    client: Client, ask: Function, first: Any, second: Any, poses: tuple[Any, Any], part: int, progress: Any
) -> FloatArray:
    options = {"first_pose": poses[0], "second_pose": poses[1]}
    ask(first[:0], second[:0], **options)  # checks the options here, not on a worker
    check_same_length(first, second)
    answers = _answers(client, partial(_about_rows, ask, **options), (), (first, second), part, progress)
    return _filled(np.float64, answers, len(first))


def section(
    client: Client, solid: Solid, heights: object, *, normal: object = None, part: int = 16,
    progress: Progress | None = None,
) -> sections.Sections:  # fmt: skip
    """Return the sections of a polyhedron at heights along a normal, see `engine.section`."""
    rows = as_floats(heights, 1, ("heights",))
    function = partial(_about_solids, sections.section, normal=normal)
    parts_done = [
        (0, function((solid,), rows[:0])),
        *_in_order(_answers(client, function, (solid,), (rows,), part, progress)),
    ]
    return sections.join_sections([made for _, made in parts_done])


def _about_rows(ask: Function, solids: tuple[Any, ...], *rows: Any, **options: Any) -> Any:
    return _about_solids(ask, rows, *solids, **options)


def _about_solids(ask: Function, solids: tuple[Any, ...], *rows: Any, **options: Any) -> Any:
    return ask(*solids, *rows, workers=1, **options)


def _filled(kind: Any, answers: Iterator[tuple[int, Any]], n: int) -> Any:
    """Return n answers as one array of dtype `kind`; answers: (start, array), in any order."""
    result = np.empty(n, kind)
    for start, answer in answers:
        result[start : start + len(answer)] = answer
    return result


def _in_order(answers: Iterator[tuple[int, Any]]) -> list[tuple[int, Any]]:
    return sorted(answers, key=lambda each: each[0])


def _joined(client: Client, function: Function, solid: Any, rows: Any, part: int, progress: Progress | None) -> Any:
    """Return the answers about all segments as one object, whose `source` counts from the first of all."""
    parts = _in_order(_answers(client, function, (solid,), (rows,), part, progress))
    if len(parts) < 2:
        return parts[0][1] if parts else function((solid,), rows)
    kind = type(parts[0][1])
    if kind is np.ndarray:
        return np.concatenate([met for _, met in parts])
    source = np.concatenate([start + pieces.source for start, pieces in parts])
    names = [field.name for field in fields(kind)][1:]
    return kind(source, *(np.concatenate([getattr(pieces, name) for _, pieces in parts]) for name in names))


def _answers(
    client: Client, function: Function, solids: tuple[Any, ...], arrays: tuple[Any, ...], part: int,
    progress: Progress | None,
) -> Iterator[tuple[int, Any]]:  # fmt: skip
    """Yield (start, answer) of each part as it arrives; on an error the parts still running are cancelled."""
    check_options(None, progress)
    if isinstance(part, bool) or not isinstance(part, int) or part < 1:
        raise InvalidInputError(f"part must be a whole number from 1, got {shown(part)}", ("part",))
    starts = list(range(0, len(arrays[0]), part))[::-1]
    waiting: dict[Future, int] = {}

    def submit(queue: as_completed) -> None:
        start = starts.pop()
        rows = [array[start : start + part] for array in arrays]
        future = client.submit(function, shared, *rows, pure=False)
        waiting[future] = start
        queue.add(future)

    with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1 PiB"}):
        # The solids are the result of a task, not scattered: Dask recomputes them if their workers are lost.
        shared = client.submit(tuple, solids, pure=False)
        queue = as_completed()
        try:
            for _ in range(min(len(starts), PARTS_PER_THREAD * max(1, sum(client.nthreads().values())))):
                submit(queue)
            for future in queue:
                start = waiting.pop(future)
                yield start, future.result()
                if progress is not None:
                    progress(min(part, len(arrays[0]) - start))
                if starts:
                    submit(queue)
        finally:
            client.cancel([shared, *waiting])
