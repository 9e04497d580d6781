"""Layers of polygons against each other: which meet, and what remains, as rows of flat arrays.

A layer is a list of polygons, None where a feature has no geometry. Features are paired by their boxes; the pairs are
overlaid together. Rows stand in the order of geopandas.overlay: the pairs by left, then right; then what is left of the
left, then of the right.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Final, cast

import numpy as np

from engine.bounding.box_grid import pairs_of_boxes
from engine.errors import InvalidOperationError, NotRepresentableError
from engine.polygon_overlay.batch import OverlayBatch, overlay_batch
from engine.polygon_overlay.overlay import less_all, overlay, union_all
from engine.polygon_overlay.pair_arrays import Chosen, PolygonArrays, chained, joined_arrays, places_of
from engine.polygon_overlay.result import Overlay
from engine.polygon_overlay.run import Operation
from engine.polygon_overlay.touching import Touching, collapsed, joined_touching, touching
from engine.running.budget import Budget, Cancel
from engine.scenes.locate_scene import locate_scene
from engine.solids.checks import shown
from engine.solids.polygon import Polygon
from engine.solids.ragged import closed_rings, summed
from engine.types import Accuracy, BoolArray, FloatArray, IntArray

HOWS: Final[dict[str, tuple[bool, bool, bool]]] = {
    "intersection": (True, False, False),
    "union": (True, True, True),
    "identity": (True, True, False),
    "difference": (False, True, False),
    "symmetric_difference": (False, True, True),
}
"""Whether there are rows of pairs, of what is left of the left, and of the right."""
NONE: Final = -1
_PAIR_BYTES: Final = 16
_ROW_BYTES: Final = 300
_HELD_BYTES: Final = 40
"""Of a pair of boxes; of the overlay of a pair, at least; of a point and a feature that holds it."""


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """The polygons of a layer's features, empty ones welcome, and which features have no geometry at all.

    parts, owners: of features whose parts overlap the parts as given, and of each the feature; arrays: their union.
    """

    arrays: PolygonArrays
    is_missing: BoolArray
    parts: PolygonArrays
    owners: IntArray

    def __len__(self) -> int:
        return len(self.is_missing)


@dataclass(frozen=True, slots=True, eq=False)
class LayerRows:
    """Rows of an overlay of layers, as ragged arrays.

    left, right: (m,) int64, the feature of either layer that a row comes from, -1 where of none.
    vertices: (n, 2) float64. ring_offsets into them; no ring repeats its first vertex. piece_offsets into the rings, a
    shell counter-clockwise before its holes, clockwise. row_offsets (m + 1,) into the pieces; a row without pieces is
    that of a feature without geometry, or of two that meet without common area, or with one that rounding takes.
    n_collapsed: rows that are not here because rounding left no piece of them.
    touching: where pairs meet without common area, by row; None where nobody asked.
    """

    left: IntArray
    right: IntArray
    vertices: FloatArray
    ring_offsets: IntArray
    piece_offsets: IntArray
    row_offsets: IntArray
    n_collapsed: int = 0
    touching: Touching | None = None

    def __len__(self) -> int:
        return len(self.left)

    @property
    def ragged(self) -> tuple[FloatArray, tuple[IntArray, IntArray, IntArray]]:
        """Coordinates and offsets of rings, polygons and rows, rings closed: for shapely.from_ragged_array."""
        positions, offsets = closed_rings(self.vertices, self.ring_offsets)
        return positions, (offsets, self.piece_offsets, self.row_offsets)


class Limits:
    """What is left of the time of one call, for the calls that it makes, and how the decisions of these came about."""

    def __init__(self, deadline: float | None, cancel: Cancel | None, workers: int | None = None) -> None:
        seconds = Budget(deadline, cancel).deadline  # checks both
        self._end = None if seconds is None else time.monotonic() + seconds
        self._cancel, self.workers = cancel, workers
        self._ulps, self._counts = 0.5, [0, 0, 0]

    def options(self) -> dict[str, Any]:
        """Return the options of the next call."""
        left = None if self._end is None else self._end - time.monotonic()
        return {"deadline": left, "cancel": self._cancel, "workers": self.workers, "report": True}

    def budget(self) -> Budget:
        """Return deadline and cancel switch of what is done here."""
        return Budget(self.options()["deadline"], self._cancel)

    def noted(self, found: tuple[Any, Accuracy]) -> Any:
        """Keep what a call says of its accuracy; return its result."""
        result, accuracy = found
        self._ulps = max(self._ulps, accuracy.coordinates_ulp or 0.0)
        told = accuracy.n_items, accuracy.n_beyond_filter, accuracy.n_rational
        self._counts = [count + more for count, more in zip(self._counts, told)]
        return result

    @property
    def accuracy(self) -> Accuracy:
        """The report of all calls together: its items are edges."""
        n_items, n_beyond, n_rational = self._counts
        return Accuracy("exact", self._ulps, n_items, n_beyond, n_rational, "arrangement")


def overlay_rows(left: Layer, right: Layer, how: str, limits: Limits, with_touching: bool = False) -> LayerRows:
    """Overlay two layers, every feature with every one that it meets.

    Boundary: features that meet without common area make no row, unless it is asked where they do. Degenerate input:
    polygons without area likewise; one without geometry stands as a row without pieces where what is left of its layer
    is asked for.
    Accuracy: decisions exact, coordinates rounded once. Of a feature what others leave is its difference with all of
    these at once, in one arrangement.
    Cost: n log n for the boxes of both layers together, then that of `overlay_batch`.
    Raises: InvalidOperationError, NotRepresentableError, DeadlineExceededError, CancelledError.
    """
    check_how(how)
    of_pairs, of_left, of_right = HOWS[how]
    pairs, rivals = meeting(left, right, limits, with_rivals=of_left or of_right)
    parts = []
    if of_pairs:
        sides = Chosen(left.arrays, pairs[:, 0]), Chosen(right.arrays, pairs[:, 1])
        batch = _overlaid(*sides, "intersection", limits)
        more = _touching(*sides, batch, limits) if with_touching else None
        parts.append(_rows(batch, pairs[:, 0], pairs[:, 1], more))
    if of_left:
        parts.append(_differences(left, right, pairs, rivals[1], limits))
    if of_right:
        turned = pairs[np.lexsort((pairs[:, 0], pairs[:, 1]))][:, ::-1]
        rest = _differences(right, left, turned, rivals[0], limits)
        parts.append(replace(rest, left=rest.right, right=rest.left))
    return parts[0] if len(parts) == 1 else _together(parts)


def check_how(how: object) -> None:
    if not isinstance(how, str) or how not in HOWS:
        raise InvalidOperationError(f"how must be one of {', '.join(HOWS)}; got {shown(how)}", ("how",))


def meeting(
    left: Layer, right: Layer, limits: Limits, with_rivals: bool = False
) -> tuple[IntArray, tuple[IntArray, IntArray]]:
    """Return the pairs (n, 2) of features whose boxes meet, by left, then right; with_rivals: also those within each
    layer."""
    filled = [np.flatnonzero(layer.arrays.sizes()) for layer in (left, right)]
    corners = [layer.arrays.boxes(numbers) for layer, numbers in zip((left, right), filled)]
    low, high = (np.concatenate(each) for each in zip(*corners))
    numbers = np.concatenate([filled[0], filled[1] + len(left)])
    found = [np.zeros((0, 2), np.int64)]
    rivals: tuple[list[IntArray], list[IntArray]] = ([found[0]], [found[0]])
    with limits.budget() as budget:
        for block in pairs_of_boxes(low, high, budget.flag) if len(low) else ():
            budget.check()
            pairs = numbers[block]
            is_left = pairs < len(left)
            found.append(pairs[is_left[:, 0] & ~is_left[:, 1]])
            budget.take(_ROW_BYTES * len(found[-1]))
            if with_rivals:
                rivals[0].append(pairs[is_left[:, 1]])
                rivals[1].append(pairs[~is_left[:, 0]] - len(left))
                budget.take(_PAIR_BYTES * len(block))
        budget.check()
    pairs = np.concatenate(found) - np.array([0, len(left)])
    order = np.lexsort((pairs[:, 1], pairs[:, 0])) if len(found) > 2 else slice(None)
    return pairs[order], (np.concatenate(rivals[0]), np.concatenate(rivals[1]))


def _differences(layer: Layer, others: Layer, pairs: IntArray, rivals: IntArray, limits: Limits) -> LayerRows:
    """Return what is left of each feature of `layer` without those of `others` that it is paired with.

    pairs: by the first, then the second; rivals: of others whose boxes meet.
    """
    seconds, groups = pairs[:, 1], summed(np.bincount(pairs[:, 0], minlength=len(layer)))
    overlap = _overlapping(others, rivals, groups, seconds, limits)
    clips, is_there = others.arrays.taken(seconds).merged(groups), layer.arrays.sizes() > 0
    at_once, apart = np.flatnonzero(is_there & ~overlap), np.flatnonzero(is_there & overlap)
    sides = Chosen(layer.arrays, at_once), Chosen(clips, at_once)
    rows = _rows(_overlaid(*sides, "difference", limits), at_once, np.full(len(at_once), NONE))
    if len(apart):
        found = []
        for k in apart.tolist():
            with limits.budget() as budget:
                rest = list(Chosen(others.arrays, seconds[groups[k] : groups[k + 1]]))
                found.append(limits.noted(less_all(layer.arrays.polygon(k), rest, budget)))
        rows = _together([rows, _rows_of(found, apart)])
    missing = np.flatnonzero(layer.is_missing)
    left = np.concatenate([rows.left, missing])
    stays = np.concatenate([np.diff(rows.row_offsets) > 0, np.ones(len(missing), np.bool_)])
    order = np.flatnonzero(stays)[np.argsort(left[stays], kind="stable")]
    offsets = np.append(rows.row_offsets, np.full(len(missing), rows.row_offsets[-1]))
    pieces = PolygonArrays(rows.vertices, rows.ring_offsets, rows.piece_offsets)
    if len(apart):
        pieces = pieces.taken(places_of(offsets, order))
    sizes = summed(np.diff(offsets)[order])
    return LayerRows(left[order], np.full(len(order), NONE), *pieces, sizes, rows.n_collapsed)


def _overlapping(others: Layer, rivals: IntArray, groups: IntArray, seconds: IntArray, limits: Limits) -> BoolArray:
    """Tell of each group of others, seconds[groups[k]:groups[k + 1]], whether any two of them have common area."""
    found = np.zeros(len(groups) - 1, np.bool_)
    clash = rivals[_overlap(others.arrays, rivals, limits)]
    enemies: dict[int, set[int]] = {}
    for first, second in clash.tolist():
        enemies.setdefault(first, set()).add(second)
    for k in np.flatnonzero(np.diff(groups) > 1).tolist() if enemies else ():
        here = set(seconds[groups[k] : groups[k + 1]].tolist())
        found[k] = any(not here.isdisjoint(enemies[each]) for each in here & enemies.keys())
    return found


def _overlap(arrays: PolygonArrays, pairs: IntArray, limits: Limits) -> BoolArray:
    """Tell of pairs of polygons whether they have common area, however little."""
    sides = Chosen(arrays, pairs[:, 0]), Chosen(arrays, pairs[:, 1])
    return _overlaid(*sides, "intersection", limits).n_pieces_exact > 0


def united(polygons: Sequence[Polygon], limits: Limits) -> PolygonArrays:
    """Return the union of polygons as one that is valid."""
    found = limits.noted(union_all(list(polygons), **limits.options()))
    return PolygonArrays(found.vertices, found.ring_offsets, np.array([0, len(found.ring_offsets) - 1]))


def layer_of(parts: PolygonArrays, offsets: IntArray, is_missing: BoolArray, limits: Limits) -> Layer:
    """Return a layer of features, each of the parts from offsets[k] on; parts that overlap are united."""
    owner = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    arrays = parts.merged(offsets)
    filled = np.flatnonzero(parts.sizes())
    several = filled[(np.diff(offsets) > 1)[owner[filled]]]
    low, high = parts.boxes(several)
    found = [np.zeros((0, 2), np.int64)]
    with limits.budget() as budget:
        for block in pairs_of_boxes(low, high, budget.flag) if len(low) else ():
            budget.check()
            pairs = several[block]
            found.append(pairs[owner[pairs[:, 0]] == owner[pairs[:, 1]]])
        budget.check()
    pairs = np.concatenate(found)
    overlapping = np.unique(owner[pairs[_overlap(parts, pairs, limits), 0]])
    if len(overlapping):
        those = [united(Chosen(parts, np.arange(offsets[k], offsets[k + 1])), limits) for k in overlapping.tolist()]
        places = np.arange(len(offsets) - 1)
        places[overlapping] = len(offsets) - 1 + np.arange(len(those))
        arrays = joined_arrays([arrays, *those]).taken(places)
    kept = np.flatnonzero(np.isin(owner, overlapping) & (parts.sizes() > 0))
    return Layer(arrays, is_missing, parts.taken(kept), owner[kept])


def _overlaid(subjects: Chosen, clips: Chosen, operation: Operation, limits: Limits) -> OverlayBatch:
    found: Any = overlay_batch(subjects, clips, operation, **limits.options())
    return cast(OverlayBatch, limits.noted(found))


def _touching(firsts: Chosen, seconds: Chosen, batch: OverlayBatch, limits: Limits) -> Touching:
    """Return where pairs meet without common area, or, of those whose common area rounding takes, what is left."""
    shells = []
    for pair in np.flatnonzero(_is_lost(batch)).tolist():
        result = limits.noted(overlay(firsts[pair], seconds[pair], "intersection", **limits.options()))
        shells += [(pair, ring) for ring in (result._lost.shells() if result._lost else ())]
    with limits.budget() as budget:
        return joined_touching([touching(firsts, seconds, budget, limits.workers), collapsed(shells, budget)])


def _is_lost(batch: OverlayBatch) -> BoolArray:
    """Tell of each pair whether it has common area of which rounding leaves nothing."""
    return (np.diff(batch.pair_offsets) == 0) & (batch.n_pieces_exact > 0)


def _rows(batch: OverlayBatch, left: IntArray, right: IntArray, more: Touching | None = None) -> LayerRows:
    """Return the pairs of a batch that have pieces, or touch, as rows."""
    if batch.status.any():
        row = int(np.flatnonzero(batch.status)[0])
        raise NotRepresentableError(
            f"feature {left[row]} of one layer and what it meets of the other cross beyond the largest double; scale "
            "the layers down",
            (),
        )
    n_pieces = np.diff(batch.pair_offsets)
    is_row = n_pieces > 0
    if more is not None:
        is_row[more.lines] = is_row[more.points] = True
        rows = np.cumsum(is_row) - 1
        more = more._replace(lines=rows[more.lines], points=rows[more.points])
    kept = np.flatnonzero(is_row)
    lost = int((_is_lost(batch) & ~is_row).sum())
    rings = batch.vertices, batch.ring_offsets, batch.piece_offsets
    return LayerRows(left[kept], right[kept], *rings, summed(n_pieces[kept]), lost, more)


def _together(parts: Sequence[LayerRows]) -> LayerRows:
    """Return the rows of some parts one after another; pairs that touch are those of the first."""
    return LayerRows(
        np.concatenate([part.left for part in parts]), np.concatenate([part.right for part in parts]),
        np.concatenate([part.vertices for part in parts]), chained([part.ring_offsets for part in parts]),
        chained([part.piece_offsets for part in parts]), chained([part.row_offsets for part in parts]),
        sum(part.n_collapsed for part in parts), parts[0].touching,
    )  # fmt: skip


def dissolved(layer: Layer, groups: IntArray, n_groups: int, limits: Limits) -> LayerRows:
    """Return the union of the features of each group; groups: of each feature, -1 for none. A row a group, all kept."""
    order = np.argsort(groups, kind="stable")
    ends = np.searchsorted(groups[order], np.arange(n_groups + 1)).tolist()
    members = (list(Chosen(layer.arrays, order[start:stop])) for start, stop in pairwise(ends))
    found = [limits.noted(union_all(some, **limits.options())) for some in members]
    return _rows_of(found, np.arange(n_groups))


def _rows_of(found: Sequence[Overlay], left: IntArray) -> LayerRows:
    """Return overlays as rows, also those without pieces."""
    return LayerRows(
        left, np.full(len(left), NONE), np.concatenate([np.zeros((0, 2)), *(each.vertices for each in found)]),
        chained([each.ring_offsets for each in found]), chained([each.piece_offsets for each in found]),
        summed(np.array([each.n_pieces for each in found], np.int64)),
        sum(each.n_pieces == 0 < each.n_pieces_exact for each in found),
    )  # fmt: skip


def held(points: object, layer: Layer, limits: Limits) -> tuple[IntArray, IntArray, BoolArray]:
    """Return points and the features that hold them, boundary included, by point, then feature; whether they are on it.

    Where parts of a feature overlap it holds what one of them does, boundary, spikes and all; a point on the boundary
    of some, in the interior of none, is on the feature's unless it is in the interior of their union.
    """
    there = np.flatnonzero(layer.arrays.sizes())
    solids = [*Chosen(layer.arrays, there), *Chosen(layer.parts, np.arange(len(layer.owners)))]
    found = limits.noted(locate_scene(points, solids, **limits.options()))
    limits.budget().take(_HELD_BYTES * len(found.indices))
    first, second = np.repeat(np.arange(len(found.offsets) - 1), np.diff(found.offsets)), found.indices
    features, on_boundary = np.concatenate([there, layer.owners])[second], found.on_boundary
    if len(layer.owners):
        counts = (second >= len(there)) | ~np.isin(features, layer.owners)
        order = np.lexsort((features, first))
        first, features, on_boundary, counts = (each[order] for each in (first, features, on_boundary, counts))
        starts = np.flatnonzero(np.append(True, (np.diff(first) != 0) | (np.diff(features) != 0))[: len(first)])
        if len(starts):
            on_boundary = np.logical_and.reduceat(on_boundary, starts)
            kept = np.logical_or.reduceat(counts, starts)
            first, features, on_boundary = first[starts][kept], features[starts][kept], on_boundary[kept]
    return first, features, on_boundary


def with_alone(
    n: int, first: IntArray, second: IntArray, on_boundary: BoolArray
) -> tuple[IntArray, IntArray, BoolArray]:
    """Add to the pairs of `held` a row for each of n points that nothing holds, its feature `NONE`."""
    alone = np.setdiff1d(np.arange(n), first)
    rows = (first, alone), (second, np.full(len(alone), NONE)), (on_boundary, np.zeros(len(alone), np.bool_))
    order = np.argsort(np.concatenate(rows[0]), kind="stable")
    first, second, on_boundary = (np.concatenate(each)[order] for each in rows)
    return first, second, on_boundary
