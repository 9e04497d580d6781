"""Overlays of layers of polygons, as rows of flat arrays.

A layer is a list of polygons, None where a feature has no geometry. Features are paired by their boxes; all pairs are
overlaid in one batch. Rows are in the order of geopandas.overlay: pairs by left, then right; then the remainders of the
left layer, then of the right.

Decisions are those of the plane: of altitudes, vertices that stay keep theirs, and none is interpolated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, cast

import numpy as np

from engine.errors import InvalidOperationError, NotRepresentableError
from engine.layers.limits import Limits
from engine.polygon_overlay.batch import OverlayBatch, overlay_batch
from engine.polygon_overlay.overlay import less_all, overlay, union_all
from engine.polygon_overlay.pair_arrays import (
    PolygonArrays,
    PolygonSelection,
    concatenate_offsets,
    concatenate_polygons,
    places_of,
)
from engine.polygon_overlay.result import Overlay
from engine.polygon_overlay.run import Operation
from engine.polygon_overlay.touching import NOWHERE, Touching, collapsed, concatenate_touching, touching
from engine.running.budget import note, polled
from engine.scenes.point_queries import locate_scene
from engine.solids.accepted import PointsLike
from engine.solids.checks import shown
from engine.solids.polygon import Polygon
from engine.solids.ragged import ascending, closed_rings, summed
from engine.types import BoolArray, FloatArray, IntArray

HOWS: Final[dict[str, tuple[bool, bool, bool]]] = {
    "intersection": (True, False, False),
    "union": (True, True, True),
    "identity": (True, True, False),
    "difference": (False, True, False),
    "symmetric_difference": (False, True, True),
}
"""By operation, whether the result has rows for pairs, for remainders of the left layer, for remainders of the right.
"""
NONE: Final = -1
_ROW_BYTES: Final = 300
_HIT_BYTES: Final = 40
"""Bytes of memory, at least, of the overlay of a pair; of a pair (point, feature that contains it)."""


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """The polygons of a layer, one for each of n features, which may be empty. arrays: the polygons. is_missing (n,):
    whether a feature has no geometry. parts, owners: the single parts of those features whose parts overlap (in
    `arrays` they are united), and the feature of each part."""

    arrays: PolygonArrays
    is_missing: BoolArray
    parts: PolygonArrays
    owners: IntArray

    def __len__(self) -> int:
        return len(self.is_missing)


@dataclass(frozen=True, slots=True, eq=False)
class LayerRows:
    """Rows of an overlay of layers, as ragged arrays.

    | field | dtype, shape | meaning |
    | --- | --- | --- |
    | left, right | int64 (m,) | the feature of each layer that a row comes from, or -1 |
    | vertices, ring_offsets | float64 (n, 2), int64 | rings; none repeats its first vertex |
    | piece_offsets | int64 | into the rings: a shell, counter-clockwise, before its holes, clockwise |
    | row_offsets | int64 (m + 1,) | into the pieces; none for: no geometry, no common area, or collapsed |
    | n_collapsed | int | rows left out because rounding collapsed them |
    | touching | | lines and points, by row: of points and lines, and where pairs of polygons meet without common area |
    """

    left: IntArray
    right: IntArray
    vertices: FloatArray
    ring_offsets: IntArray
    piece_offsets: IntArray
    row_offsets: IntArray
    n_collapsed: int = 0
    touching: Touching = NOWHERE

    def __len__(self) -> int:
        return len(self.left)

    def take(self, order: IntArray) -> LayerRows:
        """Return rows in an order: each once at most, all that have lines or points."""
        pieces = PolygonArrays(self.vertices, self.ring_offsets, self.piece_offsets)
        pieces, sizes = pieces.take(places_of(self.row_offsets, order)), summed(np.diff(self.row_offsets)[order])
        back = np.full(len(self), NONE)
        back[order] = np.arange(len(order))
        touching = self.touching._replace(lines=back[self.touching.lines], points=back[self.touching.points])
        return LayerRows(self.left[order], self.right[order], *pieces, sizes, self.n_collapsed, touching)

    @property
    def ragged(self) -> tuple[FloatArray, tuple[IntArray, IntArray, IntArray]]:
        """Coordinates and offsets of rings, polygons and rows, rings closed: for shapely.from_ragged_array."""
        positions, offsets = closed_rings(self.vertices, self.ring_offsets)
        return positions, (offsets, self.piece_offsets, self.row_offsets)


def overlay_rows(left: Layer, right: Layer, how: str, limits: Limits, with_touching: bool = False) -> LayerRows:
    """Overlay two layers: every feature of one with every feature of the other that it meets. how: a key of `HOWS`.

    Boundary: features that meet without common area make no row, unless with_touching. Degenerate input: polygons
    without area likewise; a feature without geometry is a row without pieces where remainders of its layer are
    included. Accuracy: decisions exact, coordinates rounded once. The remainder of a feature is its difference with the
    union of the others, in one arrangement. Cost: n log n for the boxes of both layers together, then that of
    `overlay_batch`. Raises: InvalidOperationError, NotRepresentableError, DeadlineExceededError, CancelledError."""
    check_how(how)
    of_pairs, of_left, of_right = HOWS[how]
    pairs, rivals = candidate_pairs(left, right, limits, with_rivals=of_left or of_right)
    parts = []
    if of_pairs:
        sides = PolygonSelection(left.arrays, pairs[:, 0]), PolygonSelection(right.arrays, pairs[:, 1])
        parts.append(rows_of_pairs(*sides, "intersection", pairs[:, 0], pairs[:, 1], limits, with_touching))
    if of_left:
        parts.append(_difference_rows(left, right, pairs, rivals[1], limits))
    if of_right:
        turned = pairs[np.lexsort((pairs[:, 0], pairs[:, 1]))][:, ::-1]
        rest = _difference_rows(right, left, turned, rivals[0], limits)
        parts.append(replace(rest, left=rest.right, right=rest.left))
    return parts[0] if len(parts) == 1 else concatenate_rows(parts)


def check_how(how: object) -> None:
    if not isinstance(how, str) or how not in HOWS:
        raise InvalidOperationError(f"how must be one of {', '.join(HOWS)}; got {shown(how)}", ("how",))


def candidate_pairs(
    left: Layer, right: Layer, limits: Limits, with_rivals: bool = False
) -> tuple[IntArray, tuple[IntArray, IntArray]]:
    """Return (pairs, rivals). pairs (n, 2): a left and a right feature whose boxes intersect, sorted. rivals: such
    pairs within the left layer, and within the right; empty unless with_rivals."""
    filled = [np.flatnonzero(layer.arrays.sizes()) for layer in (left, right)]
    corners = [layer.arrays.boxes(numbers) for layer, numbers in zip((left, right), filled)]
    low, high = (np.concatenate(each) for each in zip(*corners))
    numbers = np.concatenate([filled[0], filled[1] + len(left)])
    n = len(filled[0])
    both = limits.pairs_of_boxes(low, high, None, None if with_rivals else n, _ROW_BYTES)
    first, second = n > both.T
    pairs = numbers[both]
    rivals = pairs[second], pairs[~first] - len(left)
    return pairs[first & ~second] - np.array([0, len(left)]), rivals


def _difference_rows(layer: Layer, others: Layer, pairs: IntArray, rivals: IntArray, limits: Limits) -> LayerRows:
    """Return the rows of remainders: each feature of `layer` minus the features of `others` that it is paired with.
    pairs (n, 2): feature of layer, feature of others, sorted. rivals: pairs of `others` whose boxes intersect."""
    seconds, groups = pairs[:, 1], summed(np.bincount(pairs[:, 0], minlength=len(layer)))
    overlap = _groups_overlap(others, rivals, groups, seconds, limits)
    clips, is_there = others.arrays.take(seconds).merged(groups), layer.arrays.sizes() > 0
    jointly, singly = np.flatnonzero(is_there & ~overlap), np.flatnonzero(is_there & overlap)
    sides = PolygonSelection(layer.arrays, jointly), PolygonSelection(clips, jointly)
    rows = rows_of_pairs(*sides, "difference", jointly, np.full(len(jointly), NONE), limits)
    if len(singly):
        rests = []
        for k in singly.tolist():
            with limits.budget() as budget:
                own, rest = (
                    layer.arrays.polygon(k),
                    list(PolygonSelection(others.arrays, seconds[groups[k] : groups[k + 1]])),
                )
                if limits.grid is None:
                    rests.append(limits.record(less_all(own, rest, budget)))
                    continue
                clip = Polygon(limits.record(union_all(rest, **limits.options())).rings)
                rests.append(limits.record(overlay(own, clip, "difference", grid=limits.grid, **limits.options())))
        rows = concatenate_rows([rows, rows_of(rests, singly)])
    missing = np.flatnonzero(layer.is_missing)
    stays = np.flatnonzero(np.append(np.diff(rows.row_offsets) > 0, np.ones(len(missing), np.bool_)))
    offsets = np.append(rows.row_offsets, np.full(len(missing), rows.row_offsets[-1]))
    rows = replace(rows, left=np.append(rows.left, missing), right=np.full(len(offsets) - 1, NONE), row_offsets=offsets)
    return rows.take(stays[np.argsort(rows.left[stays], kind="stable")])


def _groups_overlap(others: Layer, rivals: IntArray, groups: IntArray, seconds: IntArray, limits: Limits) -> BoolArray:
    """Return for each group k (n_groups,) whether two of its features, seconds[groups[k]:groups[k + 1]] of `others`,
    have common area. groups: offsets; rivals: pairs of `others` whose boxes intersect."""
    has_overlap = np.zeros(len(groups) - 1, np.bool_)
    clashes = rivals[pairs_overlap(others.arrays, rivals, limits)]
    rivals_of: dict[int, set[int]] = {}
    for first, second in clashes.tolist():
        rivals_of.setdefault(first, set()).add(second)
    for k in np.flatnonzero(np.diff(groups) > 1).tolist() if rivals_of else ():
        here = set(seconds[groups[k] : groups[k + 1]].tolist())
        has_overlap[k] = any(not here.isdisjoint(rivals_of[each]) for each in here & rivals_of.keys())
    return has_overlap


def pairs_overlap(arrays: PolygonArrays, pairs: IntArray, limits: Limits) -> BoolArray:
    """Return for each pair of polygons whether they have common area."""
    sides = PolygonSelection(arrays, pairs[:, 0]), PolygonSelection(arrays, pairs[:, 1])
    return _overlay_batch(*sides, "intersection", limits).n_pieces_exact > 0


def unite(polygons: Sequence[Polygon], limits: Limits) -> PolygonArrays:
    """Return the union of polygons as one valid polygon, in arrays."""
    pieces = united_pieces(polygons, limits)
    return pieces.merged(np.array([0, len(pieces.polygon_offsets) - 1]))


def united_pieces(polygons: Sequence[Polygon], limits: Limits) -> PolygonArrays:
    """Return the pieces of the union of polygons."""
    union = limits.record(union_all(list(polygons), **limits.options()))
    return PolygonArrays(union.vertices, union.ring_offsets, union.piece_offsets)


def layer_of(parts: PolygonArrays, offsets: IntArray, is_missing: BoolArray, limits: Limits) -> Layer:
    """Return the `Layer` whose feature k has the polygons offsets[k] .. offsets[k + 1] - 1 of parts; overlapping ones
    of a feature are united."""
    owner = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    arrays = parts.merged(offsets)
    filled = np.flatnonzero(parts.sizes())
    several = filled[(np.diff(offsets) > 1)[owner[filled]]]
    low, high = parts.boxes(several)
    of = owner[several]
    pairs = several[limits.pairs_of_boxes(low, high, lambda pairs: of[pairs[:, 0]] == of[pairs[:, 1]])]
    overlapping = ascending(owner[pairs[pairs_overlap(parts, pairs, limits), 0]])
    if len(overlapping):
        those = [
            unite(PolygonSelection(parts, np.arange(offsets[k], offsets[k + 1])), limits) for k in overlapping.tolist()
        ]
        places = np.arange(len(offsets) - 1)
        places[overlapping] = len(offsets) - 1 + np.arange(len(those))
        arrays = concatenate_polygons([arrays, *those]).take(places)
    stored = np.flatnonzero(np.isin(owner, overlapping) & (parts.sizes() > 0))
    return Layer(arrays, is_missing, parts.take(stored), owner[stored])


def _overlay_batch(
    subjects: PolygonSelection, clips: PolygonSelection, operation: Operation, limits: Limits
) -> OverlayBatch:
    batch: Any = overlay_batch(subjects, clips, operation, **limits.options())
    return cast(OverlayBatch, limits.record(batch))


def rows_of_pairs(
    firsts: PolygonSelection, seconds: PolygonSelection, operation: Operation, left: IntArray, right: IntArray,
    limits: Limits, with_touching: bool = False,
) -> LayerRows:  # fmt: skip
    """Return those of the pairs (firsts[k], seconds[k]), of features left[k] and right[k], that have pieces, as rows;
    with_touching: or touch, where no grid is given."""
    if limits.grid is None:
        batch = _overlay_batch(firsts, seconds, operation, limits)
        more = _touching(firsts, seconds, batch, limits) if with_touching else NOWHERE
        return _rows(batch, left, right, more)
    options = {"grid": limits.grid, **limits.options()}
    made = [limits.record(overlay(one, other, operation, **options)) for one, other in zip(polled(firsts), seconds)]
    rows = rows_of(made, left)
    stays = np.diff(rows.row_offsets) > 0
    offsets = np.append(rows.row_offsets[:1], rows.row_offsets[1:][stays])
    return replace(rows, left=left[stays], right=right[stays], row_offsets=offsets)


def _touching(firsts: PolygonSelection, seconds: PolygonSelection, batch: OverlayBatch, limits: Limits) -> Touching:
    """Return the lines and points in which the pairs (firsts[k], seconds[k]) meet without common area, or to which
    their common area collapses. batch: their intersections."""
    shells = []
    for pair in np.flatnonzero(_is_lost(batch)).tolist():
        result = limits.record(
            overlay(firsts[pair], seconds[pair], "intersection", grid=limits.grid, **limits.options())
        )
        shells += [(pair, ring) for ring in (result._lost.shells() if result._lost else ())]
    with limits.budget() as budget:
        return concatenate_touching([touching(firsts, seconds, budget, limits.workers), collapsed(shells, budget)])


def _is_lost(batch: OverlayBatch) -> BoolArray:
    """Return (n_pairs,) bool: whether a pair of a batch has common area, all of which rounding collapses."""
    return (np.diff(batch.pair_offsets) == 0) & (batch.n_pieces_exact > 0)


def _rows(batch: OverlayBatch, left: IntArray, right: IntArray, more: Touching) -> LayerRows:
    """Return the pairs of a batch that have pieces, or touch, as rows; left, right: feature numbers of the pairs; more:
    lines and points of pairs that touch."""
    if batch.status.any():
        row = int(np.flatnonzero(batch.status)[0])
        raise NotRepresentableError(
            f"feature {left[row]} of one layer and what it meets of the other cross beyond the largest double; scale "
            "the layers down",
            (),
        )
    n_pieces = np.diff(batch.pair_offsets)
    is_row = n_pieces > 0
    is_row[more.lines] = is_row[more.points] = True
    rows = np.cumsum(is_row) - 1
    more = more._replace(lines=rows[more.lines], points=rows[more.points])
    stored = np.flatnonzero(is_row)
    lost = int((_is_lost(batch) & ~is_row).sum())
    rings = batch.vertices, batch.ring_offsets, batch.piece_offsets
    return LayerRows(left[stored], right[stored], *rings, summed(n_pieces[stored]), lost, more)


def concatenate_rows(parts: Sequence[LayerRows]) -> LayerRows:
    """Return the rows of all parts, in order."""
    starts = np.cumsum([0, *map(len, parts)]).tolist()
    touching = [
        part.touching._replace(lines=start + part.touching.lines, points=start + part.touching.points)
        for part, start in zip(parts, starts)
    ]
    return LayerRows(
        np.concatenate([part.left for part in parts]), np.concatenate([part.right for part in parts]),
        np.concatenate([part.vertices for part in parts]), concatenate_offsets([part.ring_offsets for part in parts]),
        concatenate_offsets([part.piece_offsets for part in parts]),
        concatenate_offsets([part.row_offsets for part in parts]),
        sum(part.n_collapsed for part in parts), concatenate_touching(touching),
    )  # fmt: skip


def rows_of(overlays: Sequence[Overlay], left: IntArray) -> LayerRows:
    """Return one row for each overlay, even without pieces; left: the feature of each."""
    return LayerRows(
        left, np.full(len(left), NONE), np.concatenate([np.zeros((0, 2)), *(each.vertices for each in overlays)]),
        concatenate_offsets([each.ring_offsets for each in overlays]),
        concatenate_offsets([each.piece_offsets for each in overlays]),
        summed(np.array([each.n_pieces for each in overlays], np.int64)),
        sum(each.n_pieces == 0 < each.n_pieces_exact for each in overlays),
    )  # fmt: skip


def locate_points_in_layer(points: PointsLike, layer: Layer, limits: Limits) -> tuple[IntArray, IntArray, BoolArray]:
    """Return (point, feature, on boundary) arrays (n,) for all pairs where the feature contains the point, sorted by
    point, feature. A feature with overlapping parts contains what one of its parts contains; a point on the boundary of
    some parts, in the interior of none, is on the feature's boundary unless it is inside the union of the parts."""
    there = np.flatnonzero(layer.arrays.sizes())
    solids = [*PolygonSelection(layer.arrays, there), *PolygonSelection(layer.parts, np.arange(len(layer.owners)))]
    hits = limits.record(locate_scene(points, solids, **limits.options()))
    limits.budget().take(_HIT_BYTES * len(hits.indices))
    first, second = np.repeat(np.arange(len(hits.offsets) - 1), np.diff(hits.offsets)), hits.indices
    features, on_boundary = np.concatenate([there, layer.owners])[second], hits.on_boundary
    if len(layer.owners):
        counts = (second >= len(there)) | ~np.isin(features, layer.owners)
        order = np.lexsort((features, first))
        first, features, on_boundary, counts = (each[order] for each in (first, features, on_boundary, counts))
        starts = np.flatnonzero(np.append(True, (np.diff(first) != 0) | (np.diff(features) != 0))[: len(first)])
        if len(starts):
            on_boundary = np.logical_and.reduceat(on_boundary, starts)
            stored = np.logical_or.reduceat(counts, starts)
            first, features, on_boundary = first[starts][stored], features[starts][stored], on_boundary[stored]
    return first, features, on_boundary


def with_unmatched(n: int, own: IntArray, others: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return columns (own, others, places), sorted by own: row k of the sorted pairs (own[k], others[k]) with places =
    k; and for each of the numbers 0 .. n - 1 that is in no pair one row with `NONE` as other and place."""
    alone = np.setdiff1d(np.arange(n), own)
    none, every = np.full(len(alone), NONE), np.concatenate([own, alone])
    order = np.argsort(every, kind="stable")
    return every[order], np.append(others, none)[order], np.append(np.arange(len(own)), none)[order]


def without_areas(left: IntArray, right: IntArray, touching: Touching) -> LayerRows:
    """Return rows that have lines and points alone. left, right (m,): the features of each row; touching: its parts."""
    nothing = np.zeros(1, np.int64)
    return LayerRows(left, right, np.zeros((0, 2)), nothing, nothing, np.zeros(len(left) + 1, np.int64), 0, touching)


def heights_at(places: FloatArray, rows: IntArray, sources: list[tuple[FloatArray, IntArray]]) -> FloatArray | None:
    """Return the altitude of each of n vertices of an answer, NaN for new ones; None if the input has no altitudes.

    places (n, 2), rows (n,): vertices, and the row of each. sources: for each input layer its vertices with altitude
    (m, 4), feature, x, y, altitude, and (n_rows,) the feature that each row comes from (or its group, if the first
    column has groups). Of two altitudes at a vertex the first counts."""
    heights = np.full(len(places), np.nan)
    sides = [(known[~np.isnan(known[:, 3]) & (known[:, 0] != NONE)], of_rows) for known, of_rows in sources]
    if not len(places) or not any(len(known) for known, _ in sides):
        return None
    for known, of_rows in sides:
        wanted = np.column_stack([of_rows[rows], places + 0.0])
        _, names = np.unique(np.concatenate([known[:, :3] + 0.0, wanted]), axis=0, return_inverse=True)
        names, values = names.reshape(-1), np.full(len(known) + len(wanted), np.nan)
        values[names[: len(known)][::-1]] = known[::-1, 3]
        heights = np.where(np.isnan(heights), values[names[len(known) :]], heights)
    n_new = int(np.isnan(heights).sum())
    note(f"altitudes: {len(places) - n_new} vertices keep theirs, {n_new} new ones have none")
    return heights
