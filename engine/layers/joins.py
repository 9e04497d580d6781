"""Which features of two layers are related: pairs by a predicate, decided exactly.

Pairs of which one is no polygon are decided by relate.py, the rest as by `collide_scene`, whose relations of RCC-8 say
which parts of a matrix are empty.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np

from engine.arrangement.simple_rings import find_rings
from engine.compiling.jit import entry_of
from engine.errors import InvalidInputError, InvalidOperationError, NotRepresentableError
from engine.layers.nearest import are_within, meets, nearest_pairs
from engine.layers.relate import BB, EI, IE, II, PREDICATES, holds, matrices, transposed
from engine.layers.rows import Layer, Limits, locate_points_in_layer, unite
from engine.layers.shapes import AREA, POINT, MixedLayer, Shapes, in_range, pairs_between, shapes_of
from engine.polygon_overlay.pair_arrays import PolygonSelection, concatenate_polygons
from engine.scenes.collide_scene import collide_scene
from engine.solids.checks import shown
from engine.types import FloatArray, IntArray, Rcc8

_OF_RCC8: Final = np.array(
    [IE | EI, BB | IE | EI, II | IE | EI | BB, II | BB, II | EI | BB, II | EI, II | IE | BB, II | IE]
)
"""By code of `Rcc8`, the bits of a matrix of two polygons that tell predicates apart."""
_OF_POINTS: Final = {"intersects": (True, True), "covered_by": (True, True), "within": (True, False),
                     "touches": (False, True)}  # fmt: skip
"""Whether a predicate holds for a point inside a polygon, and for one on its boundary; of others for neither."""


def check_predicate(predicate: object, distance: object) -> float:
    """Raise for an unknown predicate, or a distance that does not fit to it; return the distance, 0.0 for none."""
    names = (*PREDICATES, "dwithin")
    if not isinstance(predicate, str) or predicate not in names:
        raise InvalidOperationError(
            f"predicate must be one of {', '.join(names)}; got {shown(predicate)}", ("predicate",)
        )
    if (predicate == "dwithin") != (distance is not None):
        raise InvalidInputError("distance belongs to predicate dwithin, which needs it", ("distance",))
    return 0.0 if distance is None else checked_reach(distance, "distance")


def checked_reach(distance: Any, name: str) -> float:
    """Return a distance as a float. Raises: InvalidInputError unless it is a finite number from 0."""
    is_number = isinstance(distance, (int, float, np.number)) and not isinstance(distance, bool)
    if not is_number or not 0.0 <= float(distance) < np.inf:
        raise InvalidInputError(f"{name} must be a number from 0, got {shown(distance)}", (name,))
    return float(distance)


def related_pairs(left: MixedLayer, right: MixedLayer, predicate: str, distance: float, limits: Limits) -> IntArray:
    """Return (n, 2) pairs of a left and a right feature for which a predicate holds, sorted.

    Boundary: closed sets, with OGC's boundary of lines. Accuracy: exact; a polygon whose rings cross is united with
    itself first, and parts of a MultiPolygon that overlap with each other, which rounds where they cross."""
    if (pairs := _of_points(left, right, predicate, limits)) is not None:
        return pairs
    shapes, others = in_range(shapes_of(_cleaned(left, limits), limits), shapes_of(_cleaned(right, limits), limits))
    if predicate == "dwithin":
        _check_unscaled(shapes, left)
        return _chosen(pairs_between(shapes, others, distance, limits), are_within, shapes, others, distance, limits)
    pairs = pairs_between(shapes, others, 0.0, limits)
    if predicate == "intersects":
        return _chosen(pairs, meets, shapes, others, limits)
    dims, theirs = shapes.dims[pairs[:, 0]], others.dims[pairs[:, 1]]
    are_areas, bits = (dims == AREA) & (theirs == AREA), np.zeros(len(pairs), np.int64)
    straight, turned = np.flatnonzero((dims <= theirs) & ~are_areas), np.flatnonzero(dims > theirs)
    with limits.budget() as budget:
        bits[straight] = matrices(shapes, others, pairs[straight], False, budget, limits.workers)
        back = matrices(others, shapes, pairs[turned][:, ::-1].copy(), False, budget, limits.workers)
        bits[turned] = transposed(back)
    if are_areas.any():
        bits[are_areas] = _of_areas(left.areas, right.areas, pairs[are_areas], limits)
    return pairs[holds(predicate, bits, dims, theirs)]


def _chosen(pairs: IntArray, function: Any, left: Shapes, right: Shapes, *more: Any) -> IntArray:
    return pairs[function(left, right, pairs, *more)]


def _check_unscaled(shapes: Shapes, layer: MixedLayer) -> None:
    if len(shapes.vertices) and not np.isin(np.abs(shapes.vertices).max(), np.abs(_vertices(layer))):
        raise NotRepresentableError("distances need coordinates within 2^-480 .. 2^480; scale the layers", ())


def _vertices(layer: MixedLayer) -> FloatArray:
    return np.concatenate([layer.areas.arrays.vertices, layer.paths.vertices])


def nearest_features(
    left: MixedLayer, right: MixedLayer, most: float, is_exclusive: bool, limits: Limits
) -> tuple[IntArray, FloatArray]:
    """Return (n, 2) pairs of each left feature and all right ones nearest to it, sorted, and their distances.
    is_exclusive: those that are equal to it do not count."""
    shapes, others = in_range(shapes_of(_cleaned(left, limits), limits), shapes_of(_cleaned(right, limits), limits))
    _check_unscaled(shapes, left)
    equal = related_pairs(left, right, "equals", 0.0, limits) if is_exclusive else np.zeros((0, 2), np.int64)
    return nearest_pairs(shapes, others, most, equal[:, 0] * len(others.dims) + equal[:, 1], limits)


def _of_points(left: MixedLayer, right: MixedLayer, predicate: str, limits: Limits) -> IntArray | None:
    """Return the pairs of a layer of single points and one of polygons, in either order; None for other layers."""
    if predicate == "dwithin":
        return None
    for points, areas, is_turned in ((left, right, False), (right, left, True)):
        is_point = (points.dims[points.dims >= 0] == POINT).all() and len(points.paths.offsets) <= 1 + len(points.dims)
        if not is_point or (np.diff(points.paths.path_offsets) > 1).any() or (areas.paths.dims >= 0).any():
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


def _cleaned(layer: MixedLayer, limits: Limits) -> MixedLayer:
    """Return a layer whose polygons have simple rings that do not cross."""
    arrays = layer.areas.arrays
    sizes = arrays.sizes()
    following, sides = np.empty(len(arrays.vertices), np.int64), np.zeros(len(arrays.vertices), np.int8)
    with limits.budget() as budget:
        if len(sides):
            entry_of(find_rings)(arrays.vertices, *arrays[1:], len(sides), following, sides, budget.flag)
        budget.check()
    filled = np.flatnonzero(sizes)
    wrong = filled[sides[arrays.ring_offsets[arrays.polygon_offsets[filled]]] == 0]
    if not len(wrong):
        return layer
    places = np.arange(len(sizes))
    places[wrong] = len(sizes) + np.arange(len(wrong))
    united = [unite(PolygonSelection(arrays, wrong[k : k + 1]), limits) for k in range(len(wrong))]
    return layer._replace(areas=replace(layer.areas, arrays=concatenate_polygons([arrays, *united]).take(places)))


def _of_areas(left: Layer, right: Layer, pairs: IntArray, limits: Limits) -> IntArray:
    """Return the bits of pairs of polygons."""
    names, places = np.unique(pairs + np.array([0, len(left)]), return_inverse=True)
    both = concatenate_polygons([left.arrays, right.arrays])
    n, only = len(both.polygon_offsets) - 1, places.reshape(-1, 2)
    relations = limits.record(
        collide_scene(list(PolygonSelection(both, names)), only=only, detail=True, **limits.options())
    )
    codes = np.full(len(pairs), int(Rcc8.DC))
    keys, found = only[:, 0] * n + only[:, 1], relations.first * n + relations.second
    order = np.argsort(keys)
    codes[order[np.searchsorted(keys[order], found)]] = relations.detail
    return _OF_RCC8[codes]
