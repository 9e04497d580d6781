"""Points, lines and polygons of a layer as flat arrays, with a tree over the edges of each feature; compiled."""

from __future__ import annotations

from collections import namedtuple
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrangement.simple_rings import BLOCK, fill_tree, has_simple_edges
from engine.compiling.jit import entry_of, inline, kernel
from engine.errors import NotRepresentableError
from engine.layers.limits import Limits
from engine.layers.rows import Layer
from engine.polygon_overlay.pair_arrays import PolygonArrays, concatenate_polygons
from engine.predicates.rational import shifted
from engine.predicates.vectors import as_point2
from engine.solids.ragged import next_in_rings, summed
from engine.types import BoolArray, FlagArray, FloatArray, Int8Array, IntArray, read_only

POINT: Final = 0
LINE: Final = 1
AREA: Final = 2
"""Dimensions of features; -1 for one without geometry."""
_EXPONENT: Final = 480
_SMALLEST, _LARGEST = 2.0**-_EXPONENT, 2.0**_EXPONENT
"""Range of nonzero coordinates in which signs of orientation are decided by expansions (simple_rings.py)."""


class Paths(NamedTuple):
    """The points and lines of a layer of n features. dims (n,): 0 or 1, -1 for features of other kinds; vertices,
    offsets: of paths, a point is a path of one vertex; path_offsets (n + 1,): of features into the paths."""

    dims: Int8Array
    vertices: FloatArray
    offsets: IntArray
    path_offsets: IntArray

    def owners(self) -> tuple[IntArray, IntArray]:
        """Return the path and the feature of each vertex."""
        paths = np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))
        return paths, np.repeat(np.arange(len(self.dims)), np.diff(self.path_offsets))[paths]

    def of(self, dim: int) -> Paths:
        """Return a layer of as many features in which those of dimension dim (0 or 1) have their paths, others none."""
        is_own, sizes, counts = self.dims == dim, np.diff(self.offsets), np.diff(self.path_offsets)
        own = np.repeat(is_own, counts)
        vertices = read_only(self.vertices[np.repeat(own, sizes)])
        return Paths(np.where(is_own, self.dims, -1), vertices, summed(sizes[own]), summed(np.where(is_own, counts, 0)))


@dataclass(frozen=True, slots=True, eq=False)
class MixedLayer:
    """A layer with features of any kind: its polygons (empty for other features), and its points and lines; prepared:
    what was made of it once: its `Shapes`, the union of its polygons."""

    areas: Layer
    paths: Paths
    prepared: dict[str, Any] = field(default_factory=dict, init=False)

    @property
    def dims(self) -> Int8Array:
        """Dimension of each feature, -1 for missing and empty ones."""
        return np.where(self.areas.arrays.sizes() > 0, AREA, self.paths.dims).astype(np.int8)

    @property
    def kinds(self) -> frozenset[int]:
        """The dimensions that features have."""
        return frozenset(self.dims.tolist()) - {-1}


Shapes = namedtuple("Shapes", "dims vertices following firsts ends end_firsts boxes box_firsts sizes")
"""Features as edges.

| field | shape | meaning |
|---|---|---|
| dims | (n,) int8 | POINT, LINE, AREA; -1 for none |
| vertices, following | (m, 2), (m,) | edge k is from vertex k to `following[k]` in the feature; itself at
  the end of a line, and of a point |
| firsts | (n + 1,) | first vertex of each feature |
| ends, end_firsts | (k, 2), (n + 1,) | boundary points of each line (ends of an odd number of its paths), sorted |
| boxes, box_firsts | | trees over the edges of features (simple_rings.py) |
| sizes | (2,) | least and largest magnitude of coordinates that are not 0; infinity and 0 if there are none |
"""
Shape = namedtuple("Shape", "dim points following ends boxes")
"""One feature of `Shapes`."""


@inline
def shape_of(shapes: Shapes, k: int) -> Shape:
    """Return feature k of a layer as a `Shape` of views."""
    own, ends = slice(shapes.firsts[k], shapes.firsts[k + 1]), slice(shapes.end_firsts[k], shapes.end_firsts[k + 1])
    boxes = shapes.boxes[shapes.box_firsts[k] : shapes.box_firsts[k + 1] + 1]
    return Shape(shapes.dims[k], shapes.vertices[own], shapes.following[own], shapes.ends[ends], boxes)


def shapes_of(layer: MixedLayer, limits: Limits) -> tuple[Shapes, IntArray]:
    """Return a layer as `Shapes`, and the numbers of polygons that are not simple: their edges meet elsewhere than in
    vertices between consecutive ones."""
    paths, areas = layer.paths, layer.areas.arrays
    n, dims = len(layer.areas), layer.dims
    vertices, offsets, groups = areas
    if (paths.dims >= 0).any():
        rings = PolygonArrays(paths.vertices, paths.offsets, paths.path_offsets)
        order = np.arange(n) + np.where(dims == AREA, n, 0)
        vertices, offsets, groups = concatenate_polygons([rings, areas]).take(order) if (dims == AREA).any() else rings
    firsts, following = read_only(offsets[groups]), next_in_rings(offsets)
    owners = np.repeat(np.arange(n), np.diff(groups))
    tails = offsets[1:] - 1
    is_open = (dims[owners] < AREA) & (np.diff(offsets) > 0)
    following[tails[is_open]] = tails[is_open]
    following -= np.repeat(firsts[:-1], np.diff(firsts))
    ends, end_firsts = _ends(vertices, offsets, owners, dims, n)
    sizes = np.diff(firsts)
    if (dims == LINE).any():  # case: all vertices of a line are one point: a point, as GEOS has it
        is_moving = (vertices != vertices[np.repeat(firsts[:-1], sizes)]).any(axis=1)
        n_moving = np.bincount(np.repeat(np.arange(n), sizes)[is_moving], minlength=n)
        dims = np.where((dims == LINE) & (n_moving == 0), POINT, dims).astype(np.int8)
    leaves = 1 << np.ceil(np.log2(np.maximum(1, -(-sizes // BLOCK)))).astype(np.int64)
    box_firsts = summed(2 * leaves - 1)  # the row before a root, which no tree uses, is the last of the feature before
    limits.budget().take(8 * (4 * int(box_firsts[-1]) + 3 * len(vertices)))
    boxes = np.zeros((box_firsts[-1] + 1, 4))
    magnitudes = np.abs(vertices)
    least = np.where(magnitudes > 0.0, magnitudes, np.inf).min(initial=np.inf)
    trees = boxes, box_firsts, np.array([least, magnitudes.max(initial=0.0)])
    made = Shapes(dims, read_only(vertices), read_only(following), firsts, ends, end_firsts, *trees)
    is_simple = np.ones(n, np.bool_)
    with limits.budget() as budget:
        entry_of(_build_trees)(made, is_simple, budget.flag)
        budget.check()
    return made, np.flatnonzero(~is_simple)


def _ends(
    vertices: FloatArray, offsets: IntArray, owners: IntArray, dims: Int8Array, n: int
) -> tuple[FloatArray, IntArray]:
    """Return the boundary points of n features: of lines the ends of an odd number of paths (OGC's mod-2 rule). owners:
    by path its feature."""
    paths = np.flatnonzero((dims[owners] == LINE) & (np.diff(offsets) > 1))
    feature = np.repeat(owners[paths], 2)
    points = vertices[np.column_stack([offsets[paths], offsets[paths + 1] - 1]).ravel()]
    order = np.lexsort((points[:, 1], points[:, 0], feature))
    feature, points = feature[order], points[order]
    starts = np.ones(len(feature), np.bool_)
    starts[1:] = (feature[1:] != feature[:-1]) | (points[1:] != points[:-1]).any(axis=1)
    heads = np.flatnonzero(starts)
    is_odd = np.diff(np.append(heads, len(feature))) % 2 == 1
    return read_only(points[heads[is_odd]]), summed(np.bincount(feature[heads[is_odd]], minlength=n))


@kernel
def _build_trees(shapes: Shapes, is_simple: BoolArray, flag: FlagArray) -> None:
    """Fill ``shapes.boxes`` with the tree of each feature's edges. is_simple (n,): set to False for polygons whose
    edges meet elsewhere than in vertices between consecutive ones."""
    for k in range(len(shapes.firsts) - 1):
        if flag[0] != 0:
            return
        first, end, root = shapes.firsts[k], shapes.firsts[k + 1], shapes.box_firsts[k] + 1
        if end - first <= BLOCK:  # the root is a leaf, with all vertices
            x, y, right, top = np.inf, np.inf, -np.inf, -np.inf
            for vertex in range(first, end):
                p = as_point2(shapes.vertices, vertex)
                x, right = p.x if p.x < x else x, p.x if p.x > right else right
                y, top = p.y if p.y < y else y, p.y if p.y > top else top
            shapes.boxes[root, 0], shapes.boxes[root, 1] = x, y
            shapes.boxes[root, 2], shapes.boxes[root, 3] = right, top
        if end - first > BLOCK or shapes.dims[k] == AREA:
            shape = shape_of(shapes, k)
            if end - first > BLOCK:
                fill_tree(shape.points, shape.following, shape.boxes)
            if shapes.dims[k] == AREA:
                is_simple[k] = has_simple_edges(shape.points, shape.following, shape.boxes, flag)


def in_range(left: Shapes, right: Shapes) -> tuple[Shapes, Shapes]:
    """Return two layers scaled by one power of two, so that exact signs are in range. Raises: NotRepresentableError if
    there is no such power."""
    least, most = min(left.sizes[0], right.sizes[0]), max(left.sizes[1], right.sizes[1])
    if least > _SMALLEST and most < _LARGEST:
        return left, right
    exponent = _EXPONENT - int(np.frexp(most)[1])
    moved: list[Any] = [
        shifted(each, exponent) for shape in (left, right) for each in (shape.vertices, shape.ends, shape.boxes)
    ]
    if any(each is None for each in moved) or np.ldexp(least, exponent) <= _SMALLEST:
        raise NotRepresentableError("coordinates of the layers span more than 2^960; leave the outliers out", ())
    a, b, c, d, e, f = moved
    return left._replace(vertices=a, ends=b, boxes=c.copy()), right._replace(vertices=d, ends=e, boxes=f.copy())


def boxes_of(shapes: Shapes) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return low and high corners of the features that are not empty, and their numbers."""
    numbers = np.flatnonzero(np.diff(shapes.firsts))
    roots = shapes.boxes[shapes.box_firsts[numbers] + 1]
    return roots[:, :2], roots[:, 2:], numbers


def pairs_between(left: Shapes, right: Shapes, reach: Any, limits: Limits) -> IntArray:
    """Return (n, 2) pairs of a left and a right feature whose boxes are within `reach` (a number, or one for each left
    feature), sorted."""
    (low, high, numbers), (their_low, their_high, theirs) = boxes_of(left), boxes_of(right)
    grown = np.broadcast_to(np.asarray(reach, float), (len(left.dims),))[numbers, None]
    if (grown > 0.0).any():  # rounded outward
        low, high = np.nextafter(low - grown, -np.inf), np.nextafter(high + grown, np.inf)
    n, low, high = len(numbers), np.concatenate([low, their_low]), np.concatenate([high, their_high])
    both = limits.pairs_of_boxes(low, high, None, n)
    return np.column_stack([numbers[both[:, 0]], theirs[both[:, 1] - n]])


def layer_of_areas(arrays: PolygonArrays) -> MixedLayer:
    """Return a layer of polygons."""
    n, none = len(arrays.polygon_offsets) - 1, np.zeros(0, np.int64)
    return MixedLayer(Layer(arrays, np.zeros(n, np.bool_), arrays.take(none), none), no_paths(n))


def single_points(vertices: FloatArray) -> MixedLayer:
    """Return a layer of points."""
    n = len(vertices)
    return MixedLayer(no_areas(n), Paths(np.zeros(n, np.int8), vertices, np.arange(n + 1), np.arange(n + 1)))


def no_paths(n: int) -> Paths:
    """Return the points and lines of a layer of n features that has none."""
    zeros = np.zeros(n + 1, np.int64)
    return Paths(np.full(n, -1, np.int8), np.zeros((0, 2)), zeros[:1], zeros)


def no_areas(n: int) -> Layer:
    """Return the polygons of a layer of n features that has none."""
    zeros = np.zeros(n + 1, np.int64)
    none = PolygonArrays(np.zeros((0, 2)), zeros[:1], zeros)
    return Layer(none, np.zeros(n, np.bool_), none.take(zeros[:0]), zeros[:0])
