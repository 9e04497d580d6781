"""Which features of two layers are related: pairs by a predicate, decided exactly.

Pairs of which one is no polygon are decided by relate.py, the rest as by `collide_scene`, whose relations of RCC-8 say
which parts of a matrix are empty.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np

from engine.arrangement.simple_rings import find_rings
from engine.collision.codes import UNSETTLED
from engine.collision.meshes.placement import PoseArrays
from engine.collision.outline_batch import OutlineArrays, relate_outline_pairs
from engine.compiling.jit import entry_of
from engine.distance.clearance import checked_distance
from engine.errors import InvalidInputError, InvalidOperationError, NotRepresentableError
from engine.layers.limits import Limits
from engine.layers.nearest import are_within, meets, nearest_pairs
from engine.layers.relate import BB, EI, IE, II, PREDICATES, holds, matrices, transposed
from engine.layers.rows import Layer, locate_points_in_layer, unite
from engine.layers.shapes import AREA, POINT, MixedLayer, Shapes, in_range, pairs_between, shapes_of
from engine.polygon_overlay.pair_arrays import PolygonArrays, PolygonSelection, concatenate_polygons
from engine.running.parallel import run_chunks
from engine.scenes.collide_scene import collide_scene
from engine.solids.checks import shown
from engine.types import BoolArray, FloatArray, Int8Array, IntArray, Rcc8, read_only

_OF_RCC8: Final = np.array(
    [IE | EI, BB | IE | EI, II | IE | EI | BB, II | BB, II | EI | BB, II | EI, II | IE | BB, II | IE]
)
_OF_RELATION: Final = np.array([IE | EI, II | EI, II | IE, II | IE | EI | BB, BB | IE | EI, 0])
"""Bits of a matrix of two polygons that tell predicates apart: by code of `Rcc8`; and by code of `Relation`, and
UNSETTLED, where overlaps are proven to be PO."""
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
    are_areas, bits = (dims == AREA) & (theirs == AREA), np.zeros(len(pairs), np.int64)
    straight, turned = np.flatnonzero((dims <= theirs) & ~are_areas), np.flatnonzero(dims > theirs)
    with limits.budget() as budget:
        bits[straight] = matrices(shapes, others, pairs[straight], False, budget, limits.workers)
        back = matrices(others, shapes, pairs[turned][:, ::-1].copy(), False, budget, limits.workers)
        bits[turned] = transposed(back)
    if are_areas.any():
        bits[are_areas] = _of_areas(left.areas, right.areas, pairs[are_areas], predicate != "touches", limits)
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
    """Return two layers as edges in the range of exact signs. Raises: NotRepresentableError if there is no scale, or
    they need one where distances are measured."""
    for layer in (left, right):
        if "shapes" not in layer.prepared:
            layer.prepared["shapes"] = shapes_of(_cleaned(layer, limits), limits)
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


def _sides(arrays: PolygonArrays, limits: Limits) -> tuple[IntArray, Int8Array]:
    """Return following and sides of all edges of polygons, as `find_rings` has them."""
    following, sides = np.empty(len(arrays.vertices), np.int64), np.zeros(len(arrays.vertices), np.int8)
    with limits.budget() as budget:
        if len(sides):
            entry_of(find_rings)(arrays.vertices, *arrays[1:], len(sides), following, sides, budget.flag)
        budget.check()
    return following, sides


def _cleaned(layer: MixedLayer, limits: Limits) -> MixedLayer:
    """Return a layer whose polygons have simple rings that do not cross."""
    arrays = layer.areas.arrays
    sizes, (_, sides) = arrays.sizes(), _sides(arrays, limits)
    filled = np.flatnonzero(sizes)
    wrong = filled[sides[arrays.ring_offsets[arrays.polygon_offsets[filled]]] == 0]
    if not len(wrong):
        return layer
    places = np.arange(len(sizes))
    places[wrong] = len(sizes) + np.arange(len(wrong))
    united = [unite([arrays.polygon(k)], limits) for k in wrong.tolist()]
    return replace(layer, areas=replace(layer.areas, arrays=concatenate_polygons([arrays, *united]).take(places)))


def _of_areas(left: Layer, right: Layer, pairs: IntArray, has_detail: bool, limits: Limits) -> IntArray:
    """Return the bits of pairs of polygons: by the kernel of scenes, without an object each, then one by one. Without
    has_detail they serve for touches alone."""
    both = concatenate_polygons([left.arrays, right.arrays])
    n, shifted = len(both.polygon_offsets) - 1, pairs + np.array([0, len(left)])
    following, sides = _sides(both, limits)
    firsts = both.ring_offsets[both.polygon_offsets]
    pool = OutlineArrays(both.vertices, read_only(following), read_only(sides), read_only(firsts))
    relations, none = np.full(len(pairs), UNSETTLED, np.int8), np.zeros((0, 3), np.int32)
    poses, bodies = PoseArrays(np.tile(np.eye(2), (n, 1, 1)), np.zeros((n, 2)), True), np.arange(n)
    with limits.budget() as budget:

        def task(start: int, stop: int) -> None:
            some, codes = shifted[start:stop], relations[start:stop]
            entry_of(relate_outline_pairs)(pool, bodies, poses, some, False, has_detail, codes, none, budget.flag)
            budget.check()

        run_chunks(task, len(pairs), budget=budget, workers=limits.workers)
    bits = _OF_RELATION[relations]
    rest = np.flatnonzero(relations == UNSETTLED)
    if len(rest):
        names, places = np.unique(shifted[rest], return_inverse=True)
        only, solids = places.reshape(-1, 2), list(PolygonSelection(both, names))
        related = limits.record(collide_scene(solids, only=only, detail=True, **limits.options()))
        codes, keys = np.full(len(rest), int(Rcc8.DC)), only[:, 0] * n + only[:, 1]
        order = np.argsort(keys)
        codes[order[np.searchsorted(keys[order], related.first * n + related.second)]] = related.detail
        bits[rest] = _OF_RCC8[codes]
    return bits
