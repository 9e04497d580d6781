"""Which features of two layers are related: pairs by a predicate, decided exactly.

Pairs are decided by relate.py; single points in large polygons as by `locate_scene`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np

from engine.distance.clearance import checked_distance
from engine.errors import InvalidInputError, InvalidOperationError, NotRepresentableError
from engine.layers.limits import Limits
from engine.layers.nearest import are_within, meets, nearest_pairs
from engine.layers.relate import PREDICATES, holds, matrices, transposed
from engine.layers.rows import locate_points_in_layer, unite
from engine.layers.shapes import POINT, MixedLayer, Shapes, in_range, pairs_between, shapes_of
from engine.polygon_overlay.pair_arrays import concatenate_polygons
from engine.solids.checks import shown
from engine.types import BoolArray, FloatArray, IntArray

_LARGE: Final = 64
"""Vertices of a polygon for which it pays to prepare it, about."""
_OF_POINTS: Final = {"intersects": (True, True), "covered_by": (True, True), "within": (True, False),
                     "touches": (False, True)}  # fmt: skip
"""Whether a predicate holds for a point inside a polygon, and for one on its boundary; of others for neither."""


def check_predicate(predicate: object, distance: float | None) -> float:
    """Raise for an unknown predicate, or a distance that does not fit to it; return the distance, 0.0 for none."""
    names = (*PREDICATES, "dwithin")
    if not isinstance(predicate, str) or predicate not in names:
        raise InvalidOperationError(
            f"predicate must be one of {', '.join(names)}; got {shown(predicate)}", ("predicate",)
        )
    if (predicate == "dwithin") != (distance is not None):
        raise InvalidInputError("distance belongs to predicate dwithin, which needs it", ("distance",))
    return 0.0 if distance is None else checked_distance(distance, "distance")


def related_pairs(left: MixedLayer, right: MixedLayer, predicate: str, distance: float, limits: Limits) -> IntArray:
    """Return (n, 2) pairs of a left and a right feature for which a predicate holds, sorted.

    Boundary: closed sets, with OGC's boundary of lines. Accuracy: exact; a polygon whose rings cross is united with
    itself first, and parts of a MultiPolygon that overlap with each other, which rounds where they cross."""
    if (pairs := _of_points(left, right, predicate, limits)) is not None:
        return pairs
    shapes, others = _shapes(left, right, predicate == "dwithin", limits)
    if predicate == "dwithin":
        return _chosen(pairs_between(shapes, others, distance, limits), are_within, shapes, others, distance, limits)
    pairs = pairs_between(shapes, others, 0.0, limits)
    if predicate == "intersects":
        return _chosen(pairs, meets, shapes, others, limits)
    pairs = pairs[_boxes_allow(predicate, shapes, others, pairs)]
    dims, theirs = shapes.dims[pairs[:, 0]], others.dims[pairs[:, 1]]
    bits, straight, turned = (
        np.zeros(len(pairs), np.int64),
        np.flatnonzero(dims <= theirs),
        np.flatnonzero(dims > theirs),
    )
    with limits.budget() as budget:
        bits[straight] = matrices(shapes, others, pairs[straight], False, budget, limits.workers)
        back = matrices(others, shapes, pairs[turned][:, ::-1].copy(), False, budget, limits.workers)
        bits[turned] = transposed(back)
    return pairs[holds(predicate, bits, dims, theirs)]


def _chosen(pairs: IntArray, function: Any, left: Shapes, right: Shapes, *more: Any) -> IntArray:
    return pairs[function(left, right, pairs, *more)]


def _boxes_allow(predicate: str, left: Shapes, right: Shapes, pairs: IntArray) -> BoolArray:
    """Return for pairs of features False where their boxes exclude a predicate."""
    (a, b), (c, d) = (
        np.split(shape.boxes[shape.box_firsts[rows] + 1], 2, axis=1)
        for shape, rows in ((left, pairs[:, 0]), (right, pairs[:, 1]))
    )
    result = np.ones(len(pairs), np.bool_)
    if predicate in ("within", "covered_by", "equals"):
        result &= ((c <= a) & (b <= d)).all(axis=1)
    if predicate in ("contains", "covers", "equals"):
        result &= ((a <= c) & (d <= b)).all(axis=1)
    return result


def _shapes(left: MixedLayer, right: MixedLayer, is_measured: bool, limits: Limits) -> tuple[Shapes, Shapes]:
    """Return two layers as `Shapes`, scaled so that signs of their coordinates are exact; polygons that are not simple
    are united with themselves first. is_measured: distances will be taken, for which no scale may be needed. Raises:
    NotRepresentableError if there is no such scale, or a scale is needed where distances are measured."""
    for layer in (left, right):
        if "shapes" not in layer.prepared:
            shapes, wrong = shapes_of(layer, limits)
            if len(wrong):
                shapes, _ = shapes_of(_cleaned(layer, wrong, limits), limits)
            layer.prepared.update(shapes=shapes, cleaned=wrong)
    made = left.prepared["shapes"], right.prepared["shapes"]
    scaled = in_range(*made)
    if is_measured and scaled[0] is not made[0]:
        raise NotRepresentableError("distances need coordinates within 2^-480 .. 2^480; scale the layers", ())
    return scaled


def nearest_of(
    left: MixedLayer, right: MixedLayer, most: float, is_exclusive: bool, limits: Limits
) -> tuple[IntArray, FloatArray]:
    """Return (n, 2) pairs of each left feature and all right ones nearest to it, sorted, and their distances.
    is_exclusive: those that are equal to it do not count."""
    shapes, others = _shapes(left, right, True, limits)
    equal = related_pairs(left, right, "equals", 0.0, limits) if is_exclusive else np.zeros((0, 2), np.int64)
    return nearest_pairs(shapes, others, most, equal[:, 0] * len(others.dims) + equal[:, 1], limits)


def _of_points(left: MixedLayer, right: MixedLayer, predicate: str, limits: Limits) -> IntArray | None:
    """Return the pairs of a layer of single points and one of large polygons, or such with overlapping parts, in either
    order; None for other layers."""
    if predicate == "dwithin":
        return None
    for points, areas, is_turned in ((left, right, False), (right, left, True)):
        is_point = (points.dims[points.dims >= 0] == POINT).all() and len(points.paths.offsets) <= 1 + len(points.dims)
        if not is_point or (np.diff(points.paths.path_offsets) > 1).any() or (areas.paths.dims >= 0).any():
            continue
        if len(areas.areas.arrays.vertices) < _LARGE * len(areas.areas) and not len(areas.areas.owners):
            continue
        name = {"contains": "within", "covers": "covered_by"}.get(predicate, predicate) if is_turned else predicate
        if is_turned and predicate in ("within", "covered_by"):
            name = ""
        inside, on_boundary = _OF_POINTS.get(name, (False, False))
        first, second, is_on = locate_points_in_layer(points.paths.vertices, areas.areas, limits)
        stays = np.where(is_on, on_boundary, inside)
        pairs = np.column_stack([points.paths.owners()[1][first], second])[stays]
        return pairs[np.lexsort((pairs[:, 0], pairs[:, 1]))][:, ::-1] if is_turned else pairs
    return None


def _cleaned(layer: MixedLayer, wrong: IntArray, limits: Limits) -> MixedLayer:
    """Return a layer in which the polygons numbered `wrong` are united with themselves, so that their rings are simple
    and do not cross."""
    arrays = layer.areas.arrays
    places = np.arange(len(layer.areas))
    places[wrong] = len(places) + np.arange(len(wrong))
    united = [unite([arrays.polygon(k)], limits) for k in wrong.tolist()]
    return replace(layer, areas=replace(layer.areas, arrays=concatenate_polygons([arrays, *united]).take(places)))
