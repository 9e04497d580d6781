"""Public: what Sutherland-Hodgman leaves of polygons on a convex region."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import accumulate
from typing import Any, ClassVar, Final, Literal, NamedTuple, Unpack, overload

import numpy as np
import numpy.typing as npt

from engine.arrays import BoolArray, FlagArray, FloatArray, Int8Array, IntArray, read_only
from engine.compiling.direct import entry_of
from engine.errors import EmptyGeometryError, InvalidArrayError, TooComplexError
from engine.polygon_clipping.in_integers import Row, clip_polygon
from engine.polygon_clipping.planes import KernelScene, kernel_scene, planes_of
from engine.polygon_clipping.rings import CLIPPED, PlaneTables
from engine.polygon_clipping.sutherland_hodgman import clip_rings
from engine.predicates.scaling import largest_of, scaled_back
from engine.running.budget import UNLIMITED, Budget, Cancel
from engine.running.parallel import Options, Progress, check_options, is_unlimited, run_chunks
from engine.solids.base import Solid
from engine.solids.checks import as_point_groups, as_points, check_dimension, check_finite, is_ready
from engine.solids.polygon import Polygon
from engine.solids.ragged import Ragged, summed
from engine.types import OPEN, Accuracy


class PolygonStatus(IntEnum):
    """What became of one polygon of a batch."""

    CLIPPED = 0
    TOO_COMPLEX = 1
    """An exact vertex would need more than 131,072 bits; nothing of the polygon is returned."""


@dataclass(frozen=True, slots=True, eq=False)
class ClippedPolygons(Ragged):
    """What is left of a batch of polygons, polygon by polygon, ring by ring.

    vertices: (m, dim) float64, each coordinate the double nearest to the exact one.
    ring_offsets: (r + 1,) int64, ring i holds the vertices ``ring_offsets[i]`` up to ``ring_offsets[i + 1]``.
    polygon_offsets: (n + 1,) int64, polygon i holds the rings ``polygon_offsets[i]`` up to ``polygon_offsets[i + 1]``.
    contours: (r,) int64, the contour of its polygon that each ring is left of; contours that vanish are missing.
    status: (n,) int8, a `PolygonStatus` for each polygon.
    may_have_bridges: (n,) bool, whether edges along a plane may run there and back, or along another contour.
    """

    _levels: ClassVar[tuple[str, ...]] = ("vertices", "ring_offsets", "polygon_offsets")
    vertices: FloatArray
    ring_offsets: IntArray
    polygon_offsets: IntArray
    contours: IntArray
    status: Int8Array
    may_have_bridges: BoolArray

    def __len__(self) -> int:
        return len(self.status)

    def rings(self, polygon: int) -> list[FloatArray]:
        """Return the rings left of one polygon, (k, dim) float64 each; borrowed."""
        first, last = self.polygon_offsets[polygon : polygon + 2]
        pairs = zip(self.ring_offsets[first:last], self.ring_offsets[first + 1 : last + 1])
        return [self.vertices[i:j] for i, j in pairs]


_AXES: Final = {2: (0, 1), 3: (0, 1, 2)}  # the `names` of `clip_rings`
_FEW: Final = 1024
"""Vertices that are clipped in the time that it takes to plan more."""
Polygons = Sequence[Polygon] | Sequence[Sequence[npt.ArrayLike]] | npt.NDArray[Any]


@overload
def clip_polygons(
    polygons: Polygons, region: Solid, *, report: Literal[False] = False, **options: Unpack[Options]
) -> ClippedPolygons: ...
@overload
def clip_polygons(
    polygons: Polygons, region: Solid, *, report: Literal[True], **options: Unpack[Options]
) -> tuple[ClippedPolygons, Accuracy]: ...
def clip_polygons(
    polygons: Polygons,
    region: Solid,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> ClippedPolygons | tuple[ClippedPolygons, Accuracy]:
    """Return what Sutherland-Hodgman leaves of polygons on a convex region.

    Each contour is cut by one plane after another: half_space 0; aabb xmin, xmax, ymin, ymax, zmin, zmax; convex in
    row order; polyhedron in face order. The result is defined as the exact algorithm on the original input, however
    long the cascade: a cut vertex stays exact until the end. It is connected: parts of a concave contour that fall
    apart stay joined by bridge edges along a plane, harmless under the even-odd rule. For separate pieces of polygons
    in the plane use `overlay`.

    Parameters
        polygons: `Polygon` solids, or lists of rings ((k, dim) numbers each, in 2D or 3D, planar or not), or an array
            (n, k, dim) of n polygons of one ring. A ring of one or two vertices is a point or a segment.
        region: half_space, aabb, convex, or a polyhedron that exact orientation certifies as convex.
        workers, deadline (seconds), cancel, progress: see `engine.running.parallel`.
        report: return ``(clipped, Accuracy)``.
    Returns
        `ClippedPolygons`; rings keep the direction of their contour, and start at its first vertex that is left.
    Boundary
        Counts as in: a contour in a plane is kept, one that touches in an edge or a point leaves two vertices or one.
    Degenerate input
        Vertices that coincide exactly one after another, around the ring, are merged into the first of them; vertices
        that merely round to the same doubles are not. Spikes, repeated and self-crossing contours are clipped as they
        are.
    Bridges
        `may_have_bridges` is False only where no bridge is possible: nothing is left, or at each plane that dropped a
        vertex all contours of the polygon together met the plane in at most two points (vertices on it, edges through).
    Accuracy
        Decisions exact for every finite input; coordinates are the doubles nearest to the exact values, zero as +0.0.
        Nothing overflows. An item too complex to finish is marked in `status` and spoils no other.
    Cost
        O(vertices x planes) for each polygon.
    Raises
        UnsupportedSolidError (a sphere would change the type of the result), InvalidArrayError, WrongDimensionError,
        NotFiniteError, EmptyGeometryError, DeadlineExceededError, CancelledError.

    >>> from engine.solids.half_space import HalfSpace
    >>> clipped = clip_polygons([[[[0, 0], [4, 0], [0, 4]]]], HalfSpace(normal=[-1.0, 0.0], offset=1.0))
    >>> clipped.rings(0)[0].tolist()
    [[0.0, 0.0], [1.0, 0.0], [1.0, 3.0], [0.0, 4.0]]
    """
    if report is False and is_unlimited(workers, deadline, cancel, progress):
        few = _clip_array(polygons, region) if isinstance(region, Solid) and isinstance(polygons, np.ndarray) else None
        if few is not None:
            return few
    check_options(workers, progress, report=report)
    with Budget(deadline, cancel) as budget:
        planes = planes_of(region, budget.check)
        contours = as_contours(polygons, region.dimension)
        clipped, n_beyond, n_rational = _clip(contours, region, planes, budget, workers, progress)
    if not report:
        return clipped
    return clipped, Accuracy("exact", 0.5, len(clipped), n_beyond, n_rational, "sutherland_hodgman")


def _clip_array(polygons: npt.NDArray[Any], region: Solid) -> ClippedPolygons | None:
    """Clip an array of few polygons; None where the region has no tables yet, or an item is for the general way."""
    tables = region.kept("clipping_tables")
    if tables is None or polygons.ndim != 3 or not is_ready(polygons, polygons.shape[1], region.dimension):
        return None
    n, size, _ = polygons.shape
    flat = polygons.reshape(-1)
    # the largest coordinate lies between the root of this sum, and that over the root of how many there are
    if not (0 < n * size <= _FEW and 2.0**-100 < flat.dot(flat) < 2.0**120):
        return None
    found = _clip_few(flat, tables, *_few_rings(n, size), UNLIMITED)
    return None if found is None else found[0]


def _equal_rings(n: int, size: int) -> tuple[IntArray, IntArray]:
    """Return the offsets of the rings of n polygons, and of these; read-only, as kernels are compiled for."""
    numbers = np.arange(n + 1)
    return read_only(size * numbers), read_only(numbers)


_few_rings = functools.lru_cache(64)(_equal_rings)
"""Those of arrays that are clipped at once, of up to `_FEW` vertices."""


def _clip_few(
    vertices: FloatArray, tables: PlaneTables, ring_offsets: IntArray, polygon_offsets: IntArray, budget: Budget
) -> tuple[ClippedPolygons, int] | None:
    """Clip few polygons, vertices as one row; return the result, and how many needed more than the filter.

    None where one is left open, or there is no room.
    """
    n, n_rings, d = len(polygon_offsets) - 1, len(ring_offsets) - 1, tables.high.shape[1] - 1
    out = np.empty(4 * len(vertices) + d * (4 * len(tables.high) + 64))  # spikes are cut many times
    ring_sizes, status = np.empty(n_rings, np.int64), np.zeros(n, np.int8)
    state, bridges = np.empty(n, np.uint8), np.empty(n, np.bool_)
    reached, written = entry_of(clip_rings, d)(
        vertices, ring_offsets, polygon_offsets, tables, 0, n, budget.flag, out, ring_sizes, state, bridges, _AXES[d]
    )
    budget.check()
    if reached < n or OPEN in (states := state.tolist()):
        return None
    left, sizes = out[: written * d].reshape(-1, d), ring_sizes.tolist()
    n_beyond = n - states.count(CLIPPED)
    if n == n_rings and all(sizes):
        offsets = np.array([0, *accumulate(sizes)], np.int64)
        return ClippedPolygons(left, offsets, polygon_offsets, np.zeros(n, np.int64), status, bridges), n_beyond
    return _gathered(left, ring_sizes, polygon_offsets, status, bridges), n_beyond


def _gathered(
    vertices: FloatArray, sizes: IntArray, polygon_offsets: IntArray, status: Int8Array, may_have_bridges: BoolArray
) -> ClippedPolygons:
    """Return what is left of polygons; sizes: the vertices of each ring, those that vanished with none."""
    left = np.flatnonzero(sizes)
    owners = np.repeat(polygon_offsets[:-1], np.diff(polygon_offsets))
    contours, ends = (np.arange(len(sizes)) - owners)[left], summed(sizes > 0)[polygon_offsets]
    return ClippedPolygons(vertices, summed(sizes[left]), ends, contours, status, may_have_bridges)


class Contours(NamedTuple):
    """The rings of all polygons."""

    vertices: FloatArray
    """(m, dim), read-only; zeros of either sign."""
    ring_offsets: IntArray
    polygon_offsets: IntArray
    largest: float
    """Magnitude of any coordinate."""


def as_contours(polygons: Any, dimension: int) -> Contours:
    """Return all rings; none at all are welcome, an array is borrowed.

    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError, EmptyGeometryError, each naming the element.
    """
    if isinstance(polygons, np.ndarray):
        array = as_point_groups(polygons, None, dimension, ("polygons",), must_be_finite=False)
        n, size = array.shape[:2]
        if n and not size:
            raise EmptyGeometryError("polygons[0] has no vertices; leave it out", ("polygons", 0))
        largest = largest_of(array)
        if not np.isfinite(largest):
            check_finite(array, ("polygons",))
        return Contours(array.reshape(-1, dimension), *_equal_rings(n, size), largest)
    if not isinstance(polygons, (list, tuple)):
        raise InvalidArrayError(
            f"polygons must be a list of polygons, got {type(polygons).__name__}; put a single one into a list",
            ("polygons",),
        )
    rings: list[FloatArray] = []
    counts: list[int] = []
    for i, polygon in enumerate(polygons):
        if isinstance(polygon, Polygon):
            check_dimension(polygon.dimension, dimension, ("polygons", i))
            found = np.split(polygon.vertices, polygon.ring_offsets[1:-1])
        elif isinstance(polygon, (list, tuple)) or (isinstance(polygon, np.ndarray) and polygon.ndim == 3):
            found = [as_points(ring, dimension, ("polygons", i, j)) for j, ring in enumerate(polygon)]
        else:
            raise InvalidArrayError(
                f"polygons[{i}] must be a Polygon or a list of rings, got {type(polygon).__name__}", ("polygons", i)
            )
        if not found:
            raise EmptyGeometryError(f"polygons[{i}] has no rings; leave it out", ("polygons", i))
        for j, ring in enumerate(found):
            if not len(ring):
                raise EmptyGeometryError(f"polygons[{i}][{j}] has no vertices; leave it out", ("polygons", i, j))
        rings += found
        counts.append(len(found))
    vertices = np.concatenate(rings) if rings else np.zeros((0, dimension))
    vertices.setflags(write=False)
    return Contours(vertices, summed([len(ring) for ring in rings]), summed(counts), largest_of(vertices))


def clip_chunk(
    scene: KernelScene, ring_offsets: IntArray, polygon_offsets: IntArray, first: int, last: int, budget: Budget,
    sizes: IntArray, state: FlagArray, may_have_bridges: BoolArray,
) -> FloatArray:  # fmt: skip
    """Clip polygons first .. last - 1 as far as the kernel can; return the vertices of those it settled, in order.

    Fills sizes (of rings), state and may_have_bridges (of polygons); see `clip_rings`.
    """
    n_vertices = int(ring_offsets[polygon_offsets[last]] - ring_offsets[polygon_offsets[first]])
    vertices, tables, done, parts = scene.vertices, scene.tables, first, list[FloatArray]()
    d = vertices.shape[1]
    room, clip = d * (n_vertices + 4 * len(tables.high) + 64), entry_of(clip_rings, d)
    flat, found = vertices.reshape(-1), (sizes, state, may_have_bridges)
    while done < last:
        out = np.empty(room)
        reached, written = clip(
            flat, ring_offsets, polygon_offsets, tables, done, last, budget.flag, out, *found, _AXES[d]
        )
        budget.check()
        parts.append(out[: written * d].reshape(-1, d))
        budget.take(2 * parts[-1].nbytes)
        if reached == done:
            room *= 2
            budget.take(room * out.itemsize)
        done = reached
    vertices = parts[0] if len(parts) == 1 else np.concatenate([np.zeros((0, d)), *parts])
    if scene.exponent:
        vertices, doubtful = scaled_back(vertices, scene.exponent)
        if doubtful.any():
            state[first:last] = OPEN
            sizes[polygon_offsets[first] : polygon_offsets[last]] = 0
            return vertices[:0]
    return vertices


def _clip(
    contours: Contours, region: Solid, planes: list[Row], budget: Budget, workers: int | None,
    progress: Progress | None,
) -> tuple[ClippedPolygons, int, int]:  # fmt: skip
    """Clip every polygon; return the result, how many polygons needed more than the filter, and rational arithmetic."""
    vertices, ring_offsets, polygon_offsets, largest = contours
    n, dimension = len(polygon_offsets) - 1, vertices.shape[1]
    scene = kernel_scene(region, vertices, largest, planes, budget.check)
    if scene is not None and scene.exponent == 0 and len(vertices) <= _FEW:
        few = _clip_few(vertices.reshape(-1), scene.tables, ring_offsets, polygon_offsets, budget)
        if few is not None:
            if progress is not None and n:
                progress(n)
            return *few, 0
    status, may_have_bridges = np.zeros(n, np.int8), np.zeros(n, np.bool_)
    sizes = np.zeros(len(ring_offsets) - 1, np.int64)
    parts: dict[int, FloatArray] = {}
    state = np.full(n, OPEN, np.uint8)

    def settle(i: int) -> FloatArray:
        rings = range(polygon_offsets[i], polygon_offsets[i + 1])
        points = [vertices[ring_offsets[j] : ring_offsets[j + 1]].tolist() for j in rings]
        try:
            found, may_have_bridges[i] = clip_polygon(points, planes, budget.check)
        except TooComplexError:
            status[i] = PolygonStatus.TOO_COMPLEX
            return np.zeros((0, dimension))
        sizes[rings.start : rings.stop] = [len(contour) for contour in found]
        return np.array([vertex for contour in found for vertex in contour], np.float64).reshape(-1, dimension)

    def task(first: int, last: int) -> None:
        settled = np.zeros((0, dimension))
        if scene is not None:
            settled = clip_chunk(
                scene, ring_offsets, polygon_offsets, first, last, budget, sizes, state, may_have_bridges
            )
        open_ones = first + np.flatnonzero(state[first:last] == OPEN)
        if len(open_ones):
            rings = polygon_offsets[first : last + 1]
            before = summed(sizes[rings[0] : rings[-1]])[rings - rings[0]]  # vertices that the kernel left
            found, taken = [], 0
            for i in open_ones:
                budget.check()
                found += [settled[taken : before[i - first]], settle(int(i))]
                taken = int(before[i - first])
            settled = np.concatenate([*found, settled[taken:]])
        parts[first] = settled

    run_chunks(task, n, budget=budget, workers=workers, progress=progress, first_chunk=64)
    vertices = np.concatenate([parts[first] for first in sorted(parts)]) if parts else np.zeros((0, dimension))
    clipped = _gathered(vertices, sizes, polygon_offsets, status, may_have_bridges)
    return clipped, int(np.count_nonzero(state)), int(np.count_nonzero(state == OPEN))
