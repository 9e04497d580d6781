"""Overlays of points and lines by polygons, as rows.

Lines are clipped segment by segment on all polygons at once, as scenes are. Where polygons count together, ends on one
segment get ranks: by their parameter where these differ, rounding being monotone; where not, they are one point if they
are on one edge, which neighbours share; the rest is sorted exactly (scenes/ends.py). Intervals that share a point are
merged by rank; pieces that reach the end of a segment are joined with those that begin the next.
"""

from __future__ import annotations

from contextlib import suppress
from typing import NamedTuple

import numpy as np

from engine.errors import NotRepresentableError
from engine.layers.joins import related_pairs
from engine.layers.limits import Limits
from engine.layers.rows import (
    HOWS,
    NONE,
    Layer,
    LayerRows,
    check_how,
    concatenate_rows,
    rows_of_pairs,
    united_pieces,
    without_areas,
)  # fmt: skip
from engine.layers.rows import overlay_rows as overlay_areas
from engine.layers.shapes import LINE, POINT, MixedLayer, Paths, layer_of_areas, no_areas, no_paths, single_points
from engine.layers.wrapping import joined_rows
from engine.polygon_overlay.pair_arrays import PolygonArrays, PolygonSelection, concatenate_polygons, places_of
from engine.polygon_overlay.touching import Touching
from engine.running.budget import Budget
from engine.scenes.clip import loose_pieces, sorted_exactly
from engine.scenes.ends import LoosePieces, merge_parts, take_pieces
from engine.scenes.scene import Scene
from engine.solids.ragged import ascending, closed_rings, next_in_rings, summed
from engine.types import BoolArray, FloatArray, IntArray, read_only


class _Intervals(NamedTuple):
    """Stretches of input segments inside regions, sorted by key, then segment.

    | field | shape | meaning |
    |---|---|---|
    | key, segment | (m,) | the region's number, and the input segment |
    | ends | (2, m, 2) | first and last point |
    | own | (2, m) | whether that point is the segment's own end |
    """

    key: IntArray
    segment: IntArray
    ends: FloatArray
    own: BoolArray


def overlay_mixed(
    left: MixedLayer, right: MixedLayer, how: str, limits: Limits, kinds: frozenset[int], with_touching: bool
) -> LayerRows:
    """Overlay a layer of any features with one of polygons, as `overlay_rows` those of polygons alone. kinds: the
    dimensions of parts that stay in rows of points and lines; with_touching: of polygons too."""
    check_how(how)
    areas = overlay_areas(left.areas, right.areas, how, limits, with_touching)
    if (left.paths.dims < 0).all():
        return joined_rows(areas, limits)
    of_pairs, of_left, _ = HOWS[how]
    parts = [areas]
    if of_pairs:
        parts.append(path_rows(left.paths, right.areas, np.arange(len(right.areas)), None, limits, kinds))
    if of_left:
        keys, outside = (np.zeros(len(each), np.int64) for each in (right.areas, left.areas))
        parts.append(path_rows(left.paths, right.areas, keys, outside, limits, kinds))
    return joined_rows(sorted_rows(parts), limits)


def clip_mixed(
    layer: MixedLayer, mask: MixedLayer, limits: Limits, kinds: frozenset[int], with_touching: bool
) -> LayerRows:
    """Cut a layer to the union of polygons, a row for each feature that is left; kinds, with_touching: as
    `overlay_mixed`."""
    if limits.is_outside:
        rows = overlay_mixed(layer, mask, "difference", limits, kinds, False)
        stays = (np.diff(rows.row_offsets) > 0) | (layer.paths.dims[rows.left] >= 0)  # not those without geometry
        return rows.take(np.flatnonzero(stays))
    there = np.flatnonzero(mask.areas.arrays.sizes())
    if "union" not in mask.prepared:
        mask.prepared["union"] = united_pieces(PolygonSelection(mask.areas.arrays, there), limits)
    parts = _clip_areas(layer, mask.prepared["union"], limits, with_touching)
    if (layer.paths.dims >= 0).any():
        zeros = np.zeros(len(mask.areas), np.int64)
        parts.append(path_rows(layer.paths, mask.areas, zeros, None, limits, kinds))
    return joined_rows(sorted_rows(parts), limits)


def _clip_areas(layer: MixedLayer, pieces: PolygonArrays, limits: Limits, with_touching: bool) -> list[LayerRows]:
    """Return the rows of a layer's polygons, each clipped to `pieces`, the disjoint polygons of a mask. A polygon that
    meets no boundary of the mask is taken whole or left out; one near a single piece is clipped to that piece alone."""
    arrays, own = layer.areas.arrays, np.flatnonzero(layer.areas.arrays.sizes())
    whole = pieces.merged(np.array([0, len(pieces.polygon_offsets) - 1]))
    inside = own[:0]
    if limits.grid is None and len(own):
        with suppress(NotRepresentableError):  # beyond the range of exact signs all are cut
            met, inside = (ascending(related_pairs(layer, other, "intersects", 0.0, limits)[:, 0])
                           for other in (_outline_of(pieces), layer_of_areas(whole)))  # fmt: skip
            cut = np.union1d(met, layer.prepared.get("cleaned", own[:0]))
            own, inside = np.intersect1d(own, cut), np.intersect1d(own, np.setdiff1d(inside, cut))
    n, ends = len(own), zip(arrays.boxes(own), pieces.boxes(np.arange(len(pieces.polygon_offsets) - 1)))
    low, high = (np.concatenate(each) for each in ends)
    first, second = limits.pairs_of_boxes(low, high, None, n).T
    counts = np.bincount(first, minlength=n)
    is_one = counts[first] == 1
    several = own[counts > 1]
    sides = (
        (own[first[is_one]], pieces, second[is_one] - n, with_touching),
        (several, whole, np.zeros(len(several), np.int64), with_touching),
        (inside, arrays, inside, False),
    )
    return [
        rows_of_pairs(PolygonSelection(arrays, some), PolygonSelection(others, numbers), "intersection", some,
                      np.zeros(len(some), np.int64), limits, has_touching)
        for some, others, numbers, has_touching in sides
    ]  # fmt: skip


def _outline_of(pieces: PolygonArrays) -> MixedLayer:
    """Return the rings of polygons as one feature of lines."""
    vertices, offsets = closed_rings(pieces.vertices, pieces.ring_offsets)
    paths = Paths(np.array([LINE], np.int8), read_only(vertices), offsets, np.array([0, len(offsets) - 1]))
    return MixedLayer(no_areas(1), paths)


def sorted_rows(parts: list[LayerRows]) -> LayerRows:
    """Return the rows of all parts in the order of `overlay_rows`."""
    rows = concatenate_rows(parts)
    section = np.where(rows.right == NONE, 1, np.where(rows.left == NONE, 2, 0))
    return rows.take(np.lexsort((rows.right, rows.left, section)))


def path_rows(
    paths: Paths, areas: Layer, keys: IntArray, outside: IntArray | None, limits: Limits, kinds: frozenset[int]
) -> LayerRows:
    """Return a row for each feature of points or lines and each key, with the parts of the feature in the polygons that
    have that key. keys: by polygon a number; polygons of one number are one region. outside: None; or by feature a key:
    a row for each feature, with its parts in no polygon of that key. kinds: dimensions of parts that stay."""
    kinds_of = {POINT: _of_points, LINE: _of_lines}
    made = [
        parts_of(paths, areas, keys, outside, limits) for dim, parts_of in kinds_of.items() if (paths.dims == dim).any()
    ]
    pairs = np.concatenate([each[0] for each in made])
    sizes = np.concatenate([np.diff(each[1].offsets) for each in made])
    vertices = np.concatenate([each[1].vertices for each in made])
    stays = np.isin(np.minimum(sizes, 2) - 1, [*kinds])
    names, rows = _unique(*pairs[stays].T)
    owners = np.zeros(len(pairs), np.int64)
    owners[stays] = rows
    offsets = summed(sizes)
    lines, points = np.flatnonzero(stays & (sizes > 1)), np.flatnonzero(stays & (sizes == 1))
    touching = Touching(
        owners[lines], vertices[places_of(offsets, lines)], summed(sizes[lines]), owners[points],
        vertices[offsets[points]],
    )  # fmt: skip
    return without_areas(names[:, 0], names[:, 1] if outside is None else np.full(len(names), NONE), touching)


def _unique(first: IntArray, second: IntArray) -> tuple[IntArray, IntArray]:
    """Return the distinct pairs (first[k], second[k]), both >= 0, as (n, 2) sorted, and by k the row there."""
    n = int(second.max(initial=0)) + 1
    names, places = np.unique(first * n + second, return_inverse=True)
    return np.column_stack(np.divmod(names, n)), places


class _Parts(NamedTuple):
    """Points and lines of an answer: vertices (n, 2), and offsets (m + 1,) of parts into them; a point has one
    vertex."""

    vertices: FloatArray
    offsets: IntArray


def _of_points(
    paths: Paths, areas: Layer, keys: IntArray, outside: IntArray | None, limits: Limits
) -> tuple[IntArray, _Parts]:
    """Return (m, 2) rows (feature, key), and as `_Parts` the points that a layer's point features have in the polygons
    with that key. keys: by polygon. outside: as in `path_rows`; the key of a row is 0 then."""
    paths = paths.of(POINT)
    vertices, features = paths.vertices, paths.owners()[1]
    points, polygons = single_points(vertices), MixedLayer(areas, no_paths(len(areas)))
    first, second = related_pairs(points, polygons, "intersects", 0.0, limits).T
    if outside is not None:
        first = np.setdiff1d(np.arange(len(vertices)), first[keys[second] == outside[features[first]]])
        units = np.column_stack([first, np.zeros(len(first), np.int64)])
    else:
        units = _unique(first, keys[second])[0]
    pairs = np.column_stack([features[units[:, 0]], units[:, 1]])
    return pairs, _Parts(vertices[units[:, 0]], np.arange(len(units) + 1))


def _of_lines(
    paths: Paths, areas: Layer, keys: IntArray, outside: IntArray | None, limits: Limits
) -> tuple[IntArray, _Parts]:
    """Return (m, 2) rows (feature, key), and as `_Parts` the lines that a layer's line features have in the polygons
    with that key. keys: by polygon. outside: as in `path_rows`; the key of a row is 0 then."""
    path, features = paths.owners()
    firsts = np.flatnonzero((path[:-1] == path[1:]) & (paths.dims[features[:-1]] == LINE))
    segments = read_only(np.stack([paths.vertices[firsts], paths.vertices[firsts + 1]], axis=1))
    is_whole = np.isin(np.arange(len(areas)), areas.owners, invert=True) & (areas.arrays.sizes() > 0)
    there = np.flatnonzero(is_whole)
    solids = concatenate_polygons([areas.arrays.take(there), areas.parts])
    scene = Scene(list(PolygonSelection(solids, np.arange(len(there) + len(areas.owners)))))
    owners = keys[np.concatenate([there, areas.owners]).astype(np.int64)]
    with limits.budget() as budget:
        if len(scene):
            pieces = loose_pieces(segments, scene._placements, budget, limits.workers)
        else:
            pieces = merge_parts([], 2)
        if outside is not None:
            is_own = owners[pieces.body] == outside[features[firsts[pieces.source]]]
            pieces = take_pieces(pieces, np.flatnonzero(is_own))
        if len(np.unique(owners)) == len(owners):  # each polygon alone: its pieces are apart
            order = np.lexsort((pieces.t[:, 0], owners[pieces.body], pieces.source))
            ends, own = pieces.ends[:, order], (pieces.faces[order] < 0).T
            merged = _Intervals(owners[pieces.body[order]], pieces.source[order], ends, own)
        else:
            merged = _merged(owners, _ranked(pieces, segments, solids, scene, budget, limits.workers))
    if outside is not None:
        merged = _between(merged, segments)
    order = np.lexsort((merged.segment, merged.key, features[firsts[merged.segment]]))  # stable: along a segment too
    merged = _Intervals(merged.key[order], merged.segment[order], merged.ends[:, order], merged.own[:, order])
    feature, own_path = features[firsts[merged.segment]], path[firsts[merged.segment]]
    goes_on = np.zeros(len(order), np.bool_)
    goes_on[1:] = (
        (merged.key[1:] == merged.key[:-1]) & (own_path[1:] == own_path[:-1])
        & (firsts[merged.segment[1:]] == firsts[merged.segment[:-1]] + 1) & merged.own[1, :-1] & merged.own[0, 1:]
    )  # fmt: skip
    heads = np.flatnonzero(~goes_on)
    part = np.cumsum(~goes_on) - 1
    both = np.stack([merged.ends[0], merged.ends[1]], axis=1).reshape(-1, 2)
    twice = np.repeat(part, 2)
    is_new = np.ones(len(both), np.bool_)
    is_new[1:] = (twice[1:] != twice[:-1]) | (both[1:] != both[:-1]).any(axis=1)
    parts = _Parts(both[is_new], summed(np.bincount(twice[is_new], minlength=len(heads))))
    return np.column_stack([feature[heads], merged.key[heads]]), parts


class _Ranked(NamedTuple):
    """Pieces of segments in bodies with `ranks` (n, 2), numbers that order all ends along their segments, equal for
    equal points; the other fields as in `ScenePieces`."""

    source: IntArray
    body: IntArray
    start: FloatArray
    end: FloatArray
    faces: IntArray
    ranks: IntArray


def _ranked(
    pieces: LoosePieces, segments: FloatArray, solids: PolygonArrays, scene: Scene, budget: Budget, workers: int | None
) -> _Ranked:
    """Return pieces of segments (n, 2, 2) with the ranks of their ends: by t where all differ or lie on one edge, else
    exactly. solids: the bodies of the scene."""
    m, twice = len(pieces.source), np.repeat(np.arange(len(pieces.source)), 2)
    segment, t, faces = pieces.source[twice], pieces.t.ravel(), pieces.faces.ravel()
    order = np.lexsort((t, segment))
    is_new = np.ones(2 * m, np.bool_)
    is_new[1:] = (segment[order][1:] != segment[order][:-1]) | (t[order][1:] != t[order][:-1])
    ranks = np.empty(2 * m, np.int64)
    ranks[order] = np.cumsum(is_new) - 1
    after, firsts = next_in_rings(solids.ring_offsets), solids.ring_offsets[solids.polygon_offsets]
    tied = np.flatnonzero(np.bincount(ranks, minlength=1)[ranks] > 1)
    edges = firsts[pieces.body[twice[tied]]] + np.maximum(faces[tied], 0)
    ends = np.stack([solids.vertices[edges], solids.vertices[after[edges]]], axis=1)
    is_own = faces[tied] < 0  # the end of the segment, on no edge
    ends[is_own] = segments[segment[tied[is_own]], (tied[is_own] & 1), None]
    turned = (ends[:, 0, 0] > ends[:, 1, 0]) | ((ends[:, 0, 0] == ends[:, 1, 0]) & (ends[:, 0, 1] > ends[:, 1, 1]))
    ends[turned] = ends[turned, ::-1]
    of = np.argsort(ranks[tied], kind="stable")
    heads = np.flatnonzero(np.append(True, np.diff(ranks[tied][of]) > 0)[: len(of)])
    first = np.repeat(ends[of][heads], np.diff(np.append(heads, len(of))), axis=0)
    differ = (ends[of] != first).any(axis=(1, 2))
    is_open = np.zeros(len(segments), np.bool_)
    is_open[segment[tied[of[differ]]]] = True
    left = is_open[pieces.source]
    stays = np.flatnonzero(~left)
    columns = pieces.source, pieces.body, *pieces.ends, pieces.faces, ranks.reshape(-1, 2)
    made = [tuple(each[stays] for each in columns)]
    if left.any():
        exact = sorted_exactly(take_pieces(pieces, np.flatnonzero(left)), segments, scene._placements, budget, workers)
        made.append((exact.source, exact.body, exact.start, exact.end, exact.faces, exact.ranks))
    return _Ranked(*(np.concatenate(each) for each in zip(*made)))


def _merged(keys: IntArray, pieces: _Ranked) -> _Intervals:
    """Return the union, on each segment and for each key, of the pieces in bodies with that key. keys: by body."""
    keys = keys[pieces.body]
    order = np.lexsort((pieces.ranks[:, 1], pieces.ranks[:, 0], keys, pieces.source))
    key, segment, (first, last) = keys[order], pieces.source[order], pieces.ranks[order].T
    is_group = np.ones(len(order), np.bool_)
    is_group[1:] = (key[1:] != key[:-1]) | (segment[1:] != segment[:-1])
    base = (np.cumsum(is_group) - 1) * (int(last.max(initial=0)) + 1)  # ranks are below the number of ends
    reached = np.maximum.accumulate(base + last) if len(order) else base
    is_head = is_group.copy()
    is_head[1:] |= base[1:] + first[1:] > reached[:-1]
    heads = np.flatnonzero(is_head)
    if not len(heads):
        return _Intervals(key, segment, np.zeros((2, 0, 2)), np.zeros((2, 0), np.bool_))
    of = np.cumsum(is_head) - 1
    ends, own = (first[heads], np.maximum.reduceat(last, heads)), (pieces.faces[order] < 0).T
    is_first, is_last = first == ends[0][of], last == ends[1][of]
    own_ends = np.stack(
        [np.logical_or.reduceat(own[0] & is_first, heads), np.logical_or.reduceat(own[1] & is_last, heads)]
    )
    final = np.zeros(len(heads), np.int64)
    final[of[is_last]] = order[is_last]
    return _Intervals(key[heads], segment[heads], np.stack([pieces.start[order[heads]], pieces.end[final]]), own_ends)


def _between(inside: _Intervals, segments: FloatArray) -> _Intervals:
    """Return the stretches of segments (n, 2, 2) that no interval covers, with key 0. inside: disjoint intervals,
    sorted along each segment, all of one key."""
    n, m = len(segments), len(inside.segment)
    every, own = np.arange(n), np.ones(n, np.bool_)
    begins = np.argsort(np.concatenate([every, inside.segment]), kind="stable")
    stops = np.argsort(np.concatenate([inside.segment, every]), kind="stable")
    starts = np.concatenate([segments[:, 0], inside.ends[1]])[begins]
    ends = np.concatenate([inside.ends[0], segments[:, 1]])[stops]
    is_own = np.concatenate([own, np.zeros(m, np.bool_)])[begins], np.concatenate([np.zeros(m, np.bool_), own])[stops]
    is_gap = ~np.concatenate([~own, inside.own[1]])[begins] & ~np.concatenate([inside.own[0], ~own])[stops]
    segment = np.concatenate([every, inside.segment])[begins][is_gap]
    made = np.stack([starts, ends])[:, is_gap], np.stack(is_own)[:, is_gap]
    return _Intervals(np.zeros(len(segment), np.int64), segment, *made)
