"""Features united by group: polygons, with what a coverage among them leaves open, lines and points.

A lake that one feature leaves out is a hole of that feature. What several features enclose is a gap between them,
whatever its size: no tolerance tells a lake between parcels from a digitizing error, so gaps are reported with their
places, and refused on request. Lines of a group count outside of its polygons, points outside of both.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import cast

import numpy as np

from engine.errors import InvalidInputError
from engine.layers.joins import related_pairs
from engine.layers.limits import Limits
from engine.layers.path_rows import path_rows
from engine.layers.rows import NONE, Layer, LayerRows, pairs_overlap, rows_of, without_areas
from engine.layers.shapes import AREA, LINE, POINT, MixedLayer, Paths, single_points
from engine.layers.wrapping import joined_rows
from engine.polygon_overlay.coverage import union_of_coverage
from engine.polygon_overlay.overlay import overlay, union_all
from engine.polygon_overlay.pair_arrays import PolygonArrays, PolygonSelection
from engine.polygon_overlay.result import Overlay
from engine.polygon_overlay.touching import NOWHERE, Place, Touching, join_edges
from engine.predicates.orientation import BOUND_2D, GUARD_2D
from engine.predicates.rational import orient2d_rational
from engine.running.budget import note, polled
from engine.solids.checks import shown
from engine.solids.ragged import summed
from engine.types import BoolArray, FloatArray, IntArray, read_only

_MOST_SHOWN = 10


def check_gaps(gaps: object, coverage: bool, grid: float | None) -> None:
    """Raise unless `gaps` is keep, or refuse for a coverage without a grid."""
    if not isinstance(gaps, str) or gaps not in ("keep", "refuse"):
        raise InvalidInputError(f"gaps must be keep or refuse, got {shown(gaps)}", ("gaps",))
    if gaps == "refuse" and (not coverage or grid is not None):
        raise InvalidInputError(
            "gaps are refused of a coverage without a grid: set coverage, leave grid out", ("gaps",)
        )


def gaps_of(union: Overlay, polygons: PolygonArrays) -> list[Place]:
    """Return the lexicographically first vertex of each gap in the union of polygons that do not overlap."""
    is_hole = np.ones(len(union.ring_offsets) - 1, np.bool_)
    is_hole[union.piece_offsets[:-1]] = False
    holes = [_corners(union.rings[k].tolist()) for k in np.flatnonzero(is_hole).tolist()]
    if not holes:
        return []
    firsts = {hole[0] for hole in holes}
    starts = polygons.ring_offsets[:-1]
    filled = np.flatnonzero(np.diff(polygons.ring_offsets))
    least = np.minimum.reduceat(polygons.vertices[:, 0], starts[filled])
    known = set()
    lefts = {x for x, _ in firsts}
    for ring, x in zip(filled.tolist(), polled(least.tolist())):
        if x in lefts:
            known.add(_corners(polygons.vertices[slice(*polygons.ring_offsets[ring : ring + 2])].tolist()))
    return [hole[0] for hole in holes if hole not in known]


def _corners(ring: list[list[float]]) -> tuple[Place, ...]:
    """Return the corners of a simple ring (vertices where it turns), from the lexicographically first on, in the
    direction of the lower of its neighbours: equal for rings of one shape, however they are written."""
    places = [(x + 0.0, y + 0.0) for x, y in ring]
    n = len(places)
    turns = [p for k, p in enumerate(places) if orient2d_rational(places[k - 1], p, places[(k + 1) % n]) != 0]
    first = turns.index(min(turns)) if turns else 0
    turns = turns[first:] + turns[:first]
    return tuple(turns if turns[1:2] < turns[-1:] else turns[:1] + turns[:0:-1])


def report_gaps(places: list[Place], is_refused: bool) -> None:
    """Tell the places of gaps, or refuse them."""
    if not places:
        return
    some = ", ".join(f"({x!r}, {y!r})" for x, y in places[:_MOST_SHOWN]) + ", ..." * (len(places) > _MOST_SHOWN)
    if is_refused:
        raise InvalidInputError(f"coverage: features enclose a gap at {some}; close it, or keep gaps", ("coverage",))
    note(f"coverage: {len(places)} gaps, which several features enclose and none has as a hole: at {some}")


def dissolve_rows(
    layer: Layer, groups: IntArray, n_groups: int, limits: Limits, is_coverage: bool = False, gaps: str = "keep"
) -> LayerRows:
    """Return one row for each group, the union of its features; groups: group of each feature, -1 for none.
    is_coverage: features of a group must not overlap; gaps: keep, or refuse holes that several of them enclose."""
    order = np.argsort(groups, kind="stable")
    ends = np.searchsorted(groups[order], np.arange(n_groups + 1)).tolist()
    if is_coverage:
        parts, places = [], list[Place]()
        for start, stop in pairwise(ends):
            some = order[start:stop]
            parts.append(_joined_coverage(layer, some, limits))
            with limits.budget():
                places += gaps_of(parts[-1], layer.arrays.take(some)) if limits.grid is None else []
        with limits.budget():
            report_gaps(places, gaps == "refuse")
        return rows_of(parts, np.arange(n_groups))
    members = (list(PolygonSelection(layer.arrays, order[start:stop])) for start, stop in pairwise(ends))
    unions = [limits.record(union_all(some, grid=limits.grid, **limits.options())) for some in members]
    return rows_of(unions, np.arange(n_groups))


def _joined_coverage(layer: Layer, members: IntArray, limits: Limits) -> Overlay:
    """Return the union of features that do not overlap. Raises: InvalidInputError that names two that do."""
    members = members[layer.arrays.sizes()[members] > 0]
    some = layer.arrays.take(members)
    with limits.budget() as budget:
        made = union_of_coverage(some, budget, is_claimed=True) if len(members) and limits.grid is None else None
    if made is not None:
        return made[0]
    pairs = limits.pairs_of_boxes(*some.boxes(np.arange(len(members))))
    if len(clash := np.flatnonzero(pairs_overlap(some, pairs, limits))):
        i, j = pairs[clash[0]].tolist()
        x, y = overlay(some.polygon(i), some.polygon(j), "intersection").vertices[0].tolist()
        what = f"features {members[i]} and {members[j]} overlap at ({x!r}, {y!r})"
        raise InvalidInputError(f"coverage: {what}; correct them, or leave coverage out", ("coverage",))
    polygons = list(PolygonSelection(some, np.arange(len(members))))
    return cast(Overlay, limits.record(union_all(polygons, grid=limits.grid, **limits.options())))


def dissolve_mixed(
    layer: MixedLayer, groups: IntArray, n_groups: int, limits: Limits, is_coverage: bool = False, gaps: str = "keep"
) -> LayerRows:
    """Return one row for each group, the union of its features: of lines what is outside of its polygons, of points
    those on neither; is_coverage, gaps: as `dissolve_rows`."""
    if AREA in layer.kinds or not layer.kinds:
        rows = dissolve_rows(layer.areas, groups, n_groups, limits, is_coverage, gaps)
    else:
        rows = without_areas(np.arange(n_groups), np.full(n_groups, NONE), NOWHERE)
    if layer.kinds - {AREA}:
        lines, points = _dissolve_lines(layer, groups, n_groups, limits), _dissolve_points(layer, groups, limits)
        rows = replace(rows, touching=Touching(*lines, *points))
    return joined_rows(rows, limits)


def _dissolve_points(layer: MixedLayer, groups: IntArray, limits: Limits) -> tuple[IntArray, FloatArray]:
    """Return group and place of the points that are on no line or polygon of their group, each once, sorted."""
    points, others = layer.paths.of(POINT), MixedLayer(layer.areas, layer.paths.of(LINE))
    own = groups[points.owners()[1]]
    if not len(own):
        return own, points.vertices
    covered, by = related_pairs(single_points(points.vertices), others, "intersects", 0.0, limits).T
    stays = own != NONE
    stays[covered[own[covered] == groups[by]]] = False
    made = np.unique(np.column_stack([own, points.vertices])[stays], axis=0)
    return made[:, 0].astype(np.int64), made[:, 1:]


def _dissolve_lines(
    layer: MixedLayer, groups: IntArray, n_groups: int, limits: Limits
) -> tuple[IntArray, FloatArray, IntArray]:
    """Return (owners, vertices, offsets): the group of each line of an answer, and the lines. They are those of each
    group, stretches that lie on one another taken once, outside of its polygons. Lines that cross get no vertex there,
    which rounding would put beside them."""
    paths = layer.paths.of(LINE)
    path, features = paths.owners()
    tails = np.flatnonzero((path[:-1] == path[1:]) & (groups[features[:-1]] != NONE))
    ends = np.stack([paths.vertices[tails], paths.vertices[tails + 1]], axis=1)
    turned = (ends[:, 0, 0] > ends[:, 1, 0]) | ((ends[:, 0, 0] == ends[:, 1, 0]) & (ends[:, 0, 1] > ends[:, 1, 1]))
    ends[turned] = ends[turned, ::-1]
    rows = np.unique(np.column_stack([groups[features[tails]], ends.reshape(-1, 4)]), axis=0)
    rows = rows[(rows[:, 1:3] != rows[:, 3:]).any(axis=1)]
    firsts = np.searchsorted(rows[:, 0], np.arange(n_groups + 1))
    edges = [((a, b), (c, d)) for _, a, b, c, d in polled(rows.tolist())]
    cuts = _cuts(edges, rows, limits)
    lines, owners = list[list[Place]](), list[int]()
    with limits.budget():
        for group in polled(np.flatnonzero(np.diff(firsts)).tolist()):
            own = range(firsts[group], firsts[group + 1])
            parts = {part for k in own for part in pairwise(sorted({*edges[k], *cuts.get(k, ())}))}
            joined = join_edges(sorted(parts))
            lines += joined
            owners += [group] * len(joined)
    of_lines, offsets = np.array(owners, np.int64), summed([*map(len, lines)])
    vertices = np.array([place for line in polled(lines) for place in line]).reshape(-1, 2)
    if AREA not in layer.kinds or not lines:
        return of_lines, vertices, offsets
    n = len(lines)
    paths = Paths(np.full(n, LINE, np.int8), read_only(vertices), offsets, np.arange(n + 1))
    rows_left = path_rows(paths, layer.areas, groups, of_lines, limits, frozenset([LINE]))
    made = rows_left.touching
    return of_lines[rows_left.left[made.lines]], made.vertices, made.offsets


def _cuts(edges: list[tuple[Place, Place]], rows: FloatArray, limits: Limits) -> dict[int, set[Place]]:
    """Return the points at which edges, sorted pairs of points, are split: where an end of another one of the group
    lies on one that is collinear. rows (n, 5): group, ends."""
    own, ends, cuts = rows[:, 0], rows[:, 1:].reshape(-1, 2, 2), dict[int, set[Place]]()
    if not len(rows):
        return cuts
    start, size = ends.min(axis=(0, 1)), (ends.max(axis=(0, 1)) / 2 - ends.min(axis=(0, 1)) / 2)
    at = (ends / 2 - start / 2) / np.where(size > 0.0, size, 1.0)  # in 0 .. 1; groups side by side
    at[:, :, 0] += 2.0 * own[:, None]
    slack = 2.0**-48 * (2.0 + at.max())
    low, high = at.min(axis=1) - slack, at.max(axis=1) + slack

    def may_overlap(pairs: IntArray) -> BoolArray:
        return (own[pairs[:, 0]] == own[pairs[:, 1]]) & _may_be_collinear(ends, pairs)

    with limits.budget():
        for i, j in polled(limits.pairs_of_boxes(low, high, may_overlap).tolist()):
            (a, b), (c, d) = edges[i], edges[j]
            if max(a, c) < min(b, d) and orient2d_rational(a, b, c) == orient2d_rational(a, b, d) == 0:
                cuts.setdefault(i, set()).update(p for p in (c, d) if a < p < b)
                cuts.setdefault(j, set()).update(p for p in (a, b) if c < p < d)
    return cuts


def _may_be_collinear(rows: FloatArray, pairs: IntArray) -> BoolArray:
    """Return for pairs of edges False where doubles prove that an end of the second is beside the line of the first."""
    (a, b), (c, d) = (rows[pairs[:, k]].transpose(1, 0, 2) for k in range(2))
    result = np.ones(len(pairs), np.bool_)
    with np.errstate(all="ignore"):
        for p in (c, d):
            left, right = (a - p)[:, 0] * (b - p)[:, 1], (a - p)[:, 1] * (b - p)[:, 0]
            result &= ~(np.abs(left - right) > BOUND_2D * (np.abs(left) + np.abs(right)) + GUARD_2D)
    return result
