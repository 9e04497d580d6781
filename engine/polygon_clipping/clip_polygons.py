"""Public: what Sutherland-Hodgman leaves of polygons on a convex region."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import accumulate
from typing import Any, ClassVar, Final, Literal, NamedTuple, Unpack, overload

import numpy as np
import numpy.typing as npt

from engine.compiling.jit import entry_of
from engine.errors import TooComplexError
from engine.polygon_clipping.contours import FEW, USUAL, Contours, as_contours, few_rings
from engine.polygon_clipping.in_integers import clip_polygon
from engine.polygon_clipping.planes import KernelScene, Plan, kernel_scene, plan_of
from engine.polygon_clipping.rings import CLIPPED, PlaneTables
from engine.polygon_clipping.sutherland_hodgman import clip_rings
from engine.predicates.rational import scaled_back
from engine.running.budget import UNLIMITED, Budget, Cancel
from engine.running.joining import SECONDS_OF_BYTE
from engine.running.parallel import Options, Progress, check_options, is_unlimited, run_chunks
from engine.solids.accepted import SolidLike, SolidsLike
from engine.solids.base import Solid
from engine.solids.checks import is_ready
from engine.solids.pictures import Pictured
from engine.solids.polygon import Polygon
from engine.solids.ragged import Ragged, rings_as_geojson, summed
from engine.solids.shapes import as_solid
from engine.types import OPEN, Accuracy, BoolArray, FlagArray, FloatArray, Int8Array, IntArray, read_only


class PolygonStatus(IntEnum):
    """Outcome of one polygon of a batch."""

    CLIPPED = 0
    TOO_COMPLEX = 1
    """An exact vertex would need more than 131,072 bits; nothing of the polygon is returned."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ClippedPolygons(Pictured, Ragged):
    """What is left of a batch of polygons, polygon by polygon, ring by ring.

    Attributes
    ----------
    vertices : ndarray of float64, shape (m, dim)
        Each coordinate the double nearest to the exact one.
    ring_offsets : ndarray of int64, shape (r + 1,)
        Ring i has the vertices ``ring_offsets[i]`` up to ``ring_offsets[i + 1]``.
    polygon_offsets : ndarray of int64, shape (n + 1,)
        Polygon i has the rings ``polygon_offsets[i]`` up to ``polygon_offsets[i + 1]``.
    contours : ndarray of int64, shape (r,)
        The contour of its polygon that each ring is left of; contours that vanish are missing.
    status : ndarray of int8, shape (n,)
        A `PolygonStatus` for each polygon.
    may_have_bridges : ndarray of bool, shape (n,)
        Whether edges along a plane may run there and back, or along another contour.
    """

    _rows: ClassVar[str] = "polygons"
    _levels: ClassVar[tuple[str, ...]] = ("vertices", "ring_offsets", "polygon_offsets")
    _not_rows: ClassVar[tuple[str, ...]] = ("contours",)
    vertices: FloatArray
    ring_offsets: IntArray
    polygon_offsets: IntArray
    contours: IntArray
    status: Int8Array
    may_have_bridges: BoolArray

    def __len__(self) -> int:
        return len(self.status)

    def __iter__(self) -> Iterator[list[FloatArray]]:
        """Yield the rings left of each polygon."""
        return map(self.rings, range(len(self)))

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        """What is left as a GeoJSON MultiPolygon, of each polygon its rings, closed; bridges stay."""
        return rings_as_geojson(self)

    def rings(self, polygon: int) -> list[FloatArray]:
        """Return the rings left of one polygon.

        Parameters
        ----------
        polygon : int
            Its place in the batch.

        Returns
        -------
        list of ndarray, shape (k, dim)
            Views of `vertices`.
        """
        first, last = self.polygon_offsets[polygon : polygon + 2]
        pairs = zip(self.ring_offsets[first:last], self.ring_offsets[first + 1 : last + 1])
        return [self.vertices[i:j] for i, j in pairs]


_AXES: Final = {2: (0, 1), 3: (0, 1, 2)}  # the `names` of `clip_rings`
_MANY: Final = 1 << 16
"""Rings from which several threads put in place what is left."""
Polygons = Sequence[Polygon] | Sequence[Sequence[npt.ArrayLike]] | npt.NDArray[Any] | SolidsLike


@overload
def clip_polygons(
    polygons: Polygons, region: SolidLike, *, report: Literal[False] = False, **options: Unpack[Options]
) -> ClippedPolygons: ...
@overload
def clip_polygons(
    polygons: Polygons, region: SolidLike, *, report: Literal[True], **options: Unpack[Options]
) -> tuple[ClippedPolygons, Accuracy]: ...
def clip_polygons(
    polygons: Polygons,
    region: SolidLike,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> ClippedPolygons | tuple[ClippedPolygons, Accuracy]:
    """Return what Sutherland-Hodgman leaves of polygons in a convex region.

    Parameters
    ----------
    polygons : sequence of Polygon, sequence of lists of rings, or array_like of shape (n, k, dim)
        Rings are (k, dim) numbers in 2D or 3D, planar or not; the array has n polygons of one ring. A ring of one or
        two vertices is a point or a segment.
    region : Solid
        half_space, aabb, convex, or a polyhedron that exact orientation certifies as convex.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts polygons.

    Returns
    -------
    ClippedPolygons
        Rings keep the direction of their contour, and start at its first vertex that is left. With ``report=True`` a
        pair of it and an `Accuracy`.

    Raises
    ------
    UnsupportedSolidError
        A sphere, for example, would change the type of the result.
    InvalidArrayError, WrongDimensionError, NotFiniteError, EmptyGeometryError
        For arguments that break a rule; the message names the polygon.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    Each contour is cut by one plane after another: half_space 0; aabb xmin, xmax, ymin, ymax, zmin, zmax; convex in row
    order; polyhedron in face order. The result is that of the exact algorithm, however long the cascade: a cut vertex
    stays exact until the end. It is connected: parts of a concave contour that fall apart stay joined by bridge edges
    along a plane, harmless under the even-odd rule. For separate pieces in the plane use `overlay`.

    Boundary: counts as inside. A contour in a plane is kept; one that touches leaves an edge's two vertices, or one.

    Degenerate input: equal vertices one after another, around the ring, are merged into the first; such that merely
    round alike are not. Spikes, repeated and self-crossing contours are clipped as they are.

    Bridges: `may_have_bridges` is False only where none is possible: nothing is left, or all contours of the polygon
    together met each plane that dropped a vertex in at most two points.

    Accuracy: decisions exact for every finite input; coordinates are the nearest doubles, zero as +0.0. Nothing
    overflows. An item too complex to finish is marked in `status` and spoils no other.

    Cost: O(vertices x planes) for each polygon.

    References
    ----------
    Sutherland, Hodgman, Reentrant polygon clipping, 1974; the textbook, section 22.4.2.

    Examples
    --------
    >>> from engine import HalfSpace, clip_polygons
    >>> clipped = clip_polygons([[[[0, 0], [4, 0], [0, 4]]]], HalfSpace(normal=[-1.0, 0.0], offset=1.0))
    >>> clipped.rings(0)[0].tolist()
    [[0.0, 0.0], [1.0, 0.0], [1.0, 3.0], [0.0, 4.0]]
    """
    is_free = is_unlimited(workers, deadline, cancel, progress)
    if not is_free or report is not False:
        check_options(workers, progress, report=report)
    region = region if isinstance(region, Solid) else as_solid(region, "region")
    plan = region.cached("clipping_plan")
    if plan is not None and is_free and report is False and isinstance(polygons, np.ndarray):
        few = _clip_array(polygons, plan, region.dimension)
        if few is not None:
            return few
    is_small = not isinstance(polygons, np.ndarray) or polygons.size <= FEW  # else several threads read, in a budget
    contours = as_contours(polygons, region.dimension) if plan is not None and is_free and is_small else None
    if plan is not None and contours is not None and len(contours.vertices) <= FEW:
        clipped, n_beyond, n_rational = _clip(contours, plan, UNLIMITED, workers, None)
    else:
        with Budget(deadline, cancel, workers) as budget:
            plan = plan_of(region, budget.check)
            contours = as_contours(polygons, region.dimension, workers, budget) if contours is None else contours
            clipped, n_beyond, n_rational = _clip(contours, plan, budget, workers, progress)
    if not report:
        return clipped
    return clipped, Accuracy("exact", 0.5, len(clipped), n_beyond, n_rational, "sutherland_hodgman")


def _clip_array(polygons: npt.NDArray[Any], plan: Plan, dimension: int) -> ClippedPolygons | None:
    """Clip an array (n, size, dim) of few polygons; None if it needs the general path, which also checks it."""
    if plan.tables is None or polygons.ndim != 3 or not is_ready(polygons, polygons.shape[1], dimension):
        return None
    n, size, _ = polygons.shape
    flat = polygons.reshape(-1)
    if not (0 < len(flat) <= FEW and USUAL[0] < np.vdot(flat, flat) < USUAL[1]):
        return None
    result = _clip_few(flat, plan.tables, *few_rings(n, size), UNLIMITED)
    return None if result is None else result[0]


class Batch(NamedTuple):
    """Polygons and planes (contours, plan, scene), and arrays to fill: see `Clipped` and `ClippedPolygons`."""

    contours: Contours
    plan: Plan
    scene: KernelScene | None
    sizes: IntArray
    state: FlagArray
    may_have_bridges: BoolArray
    status: Int8Array


def clip_chunk(batch: Batch, first: int, last: int, budget: Budget) -> FloatArray:
    """Clip polygons first .. last - 1; return their vertices (n, dim), in order, and fill the other results."""
    (d, _, ring_offsets, polygon_offsets, _), _, scene, sizes, state, *_ = batch
    done, parts = first, list[FloatArray]()
    if scene is None:
        state[first:last], done = OPEN, last
    else:
        flat, tables, clip, outputs = read_only(scene.vertices), scene.tables, entry_of(clip_rings, d), batch[3:6]
        n_vertices = int(ring_offsets[polygon_offsets[last]] - ring_offsets[polygon_offsets[first]])
        room = d * (n_vertices + 4 * len(tables.high) + 64)
    while done < last:
        out = np.empty(room)
        reached, written = clip(
            flat, ring_offsets, polygon_offsets, tables, done, last, budget.flag, out, *outputs, _AXES[d]
        )
        parts.append(out[: written * d].reshape(-1, d))
        budget.check()
        budget.take(2 * parts[-1].nbytes)
        if reached == done:
            room *= 2
            budget.take(room * out.itemsize)
        done = reached
    left = parts[0] if len(parts) == 1 else np.concatenate([np.zeros((0, d)), *parts])
    if scene is not None and scene.exponent:
        left, doubtful = scaled_back(left, scene.exponent)
        if doubtful.any():
            state[first:last], sizes[polygon_offsets[first] : polygon_offsets[last]], left = OPEN, 0, left[:0]
    open_ones = first + np.flatnonzero(state[first:last] == OPEN)
    if not len(open_ones):
        return left
    rings = polygon_offsets[first : last + 1]
    before = summed(sizes[rings[0] : rings[-1]])[rings - rings[0]]  # vertices that the kernel left
    settled, taken = list[FloatArray](), 0
    for i in open_ones:
        budget.check()
        settled += [left[taken : before[i - first]], _clip_in_integers(batch, int(i), budget)]
        taken = int(before[i - first])
    return np.concatenate([*settled, left[taken:]])


def _clip_in_integers(batch: Batch, i: int, budget: Budget) -> FloatArray:
    """Return the vertices (n, dim) left of polygon i, clipped in Python's integers, and fill its other results in
    `batch`."""
    d, vertices, ring_offsets, polygon_offsets, _ = batch.contours
    rings, points = range(polygon_offsets[i], polygon_offsets[i + 1]), vertices.reshape(-1, d)
    contours = [points[ring_offsets[j] : ring_offsets[j + 1]].tolist() for j in rings]
    try:
        clipped, batch.may_have_bridges[i] = clip_polygon(contours, batch.plan.rows, budget.check)
    except TooComplexError:
        batch.status[i], clipped = PolygonStatus.TOO_COMPLEX, [[] for _ in rings]
    batch.sizes[rings.start : rings.stop] = [len(contour) for contour in clipped]
    return np.array([vertex for contour in clipped for vertex in contour], np.float64).reshape(-1, d)


def _clip(
    contours: Contours, plan: Plan, budget: Budget, workers: int | None, progress: Progress | None
) -> tuple[ClippedPolygons, int, int]:
    """Clip every polygon; return the result, the number of polygons beyond the filter, and of those in rational
    arithmetic."""
    d, vertices, ring_offsets, polygon_offsets, size = contours
    scene = kernel_scene(plan, vertices, size, budget.check)
    if scene is not None and scene.exponent == 0 and len(vertices) <= FEW:
        few = _clip_few(vertices, scene.tables, ring_offsets, polygon_offsets, budget)
        if few is not None:
            if progress is not None and len(few[0]):
                progress(len(few[0]))
            return *few, 0
    n, sizes, parts = len(polygon_offsets) - 1, np.zeros(len(ring_offsets) - 1, np.int64), dict[int, FloatArray]()
    state, may_have_bridges, status = np.empty(n, np.uint8), np.zeros(n, np.bool_), np.zeros(n, np.int8)
    batch = Batch(contours, plan, scene, sizes, state, may_have_bridges, status)

    def task(first: int, last: int) -> None:
        parts[first] = clip_chunk(batch, first, last, budget)

    run_chunks(task, n, budget=budget, workers=workers, progress=progress, first_chunk=64)
    clipped = _assemble(parts, sizes, polygon_offsets, (status, may_have_bridges), d, budget, workers)
    return clipped, int(np.count_nonzero(state)), int(np.count_nonzero(state == OPEN))


def _clip_few(
    vertices: FloatArray, tables: PlaneTables, ring_offsets: IntArray, polygon_offsets: IntArray, budget: Budget
) -> tuple[ClippedPolygons, int] | None:
    """Clip few polygons, flat vertices (m * dim,), in one call of the kernel; return the result, and the number of
    polygons beyond the filter. None if one is left open, or does not fit."""
    d = tables.high.shape[1] - 1
    n, n_rings, clip = len(polygon_offsets) - 1, len(ring_offsets) - 1, entry_of(clip_rings, d)
    if clip is clip_rings:
        vertices = read_only(vertices)  # of the kind that it is compiled for
    out = np.empty(4 * len(vertices) + d * (4 * len(tables.high) + 64))  # spikes are cut many times
    sizes, status = np.empty(n_rings, np.int64), np.zeros(n, np.int8)
    state, bridges = np.empty(n, np.uint8), np.empty(n, np.bool_)
    reached, written = clip(
        vertices, ring_offsets, polygon_offsets, tables, 0, n, budget.flag, out, sizes, state, bridges, _AXES[d]
    )
    if budget is not UNLIMITED:
        budget.check()
    if reached < n or OPEN in (states := state.tolist()):
        return None
    left, each, n_beyond = out[: written * d].reshape(-1, d), sizes.tolist(), n - states.count(CLIPPED)
    if n == n_rings and all(each):
        ends, contours = np.array([0, *accumulate(each)], np.int64), np.zeros(n, np.int64)
        return ClippedPolygons(left, ends, polygon_offsets, contours, status, bridges), n_beyond
    return _assemble({0: left}, sizes, polygon_offsets, (status, bridges), d, budget, 1), n_beyond


def _assemble(
    parts: dict[int, FloatArray], sizes: IntArray, polygon_offsets: IntArray, flags: tuple[Int8Array, BoolArray],
    dimension: int, budget: Budget, workers: int | None,
) -> ClippedPolygons:  # fmt: skip
    """Return the clipped polygons. parts: by number of their first polygon, the vertices (n, dim) left of several, ring
    after ring; sizes: number of vertices left of each ring, 0 for rings that vanished; polygon_offsets: of polygons
    into all given rings; flags: `status` and `may_have_bridges`."""
    if len(sizes) < _MANY:
        return _assemble_at_once(parts, sizes, polygon_offsets, flags, dimension)
    firsts = sorted(parts)
    ends = [*firsts[1:], len(polygon_offsets) - 1]
    starts = summed([len(parts[first]) for first in firsts])
    parted = [sizes[polygon_offsets[first] : polygon_offsets[end]] for first, end in zip(firsts, ends)]
    rings = summed([int(np.count_nonzero(some)) for some in parted])
    vertices = np.empty((starts[-1], dimension))
    contours, ring_offsets = np.empty(rings[-1], np.int64), np.empty(rings[-1] + 1, np.int64)
    offsets = np.empty(len(polygon_offsets), np.int64)
    ring_offsets[0] = offsets[0] = 0
    is_single = len(polygon_offsets) == len(sizes) + 1  # a ring each

    def fill(begin: int, stop: int) -> None:
        for k in range(begin, stop):
            budget.check()
            own, ring, end, is_left = polygon_offsets[firsts[k] : ends[k] + 1], rings[k], rings[k + 1], parted[k] > 0
            ends_of = ring_offsets[ring + 1 : end + 1]
            np.add(np.cumsum(parted[k][is_left], out=ends_of), starts[k], out=ends_of)
            before = ring + np.cumsum(is_left)
            offsets[firsts[k] + 1 : ends[k] + 1] = before if is_single else before[own[1:] - own[0] - 1]
            contours[ring:end] = 0
            if not is_single:
                number = np.arange(len(is_left)) - np.repeat(own[:-1] - own[0], np.diff(own))
                contours[ring:end] = number[is_left]
            vertices[starts[k] : starts[k + 1]] = parts[firsts[k]]

    pace = SECONDS_OF_BYTE * (vertices.nbytes + 3 * offsets.nbytes) / len(firsts)
    run_chunks(fill, len(firsts), budget=budget, workers=workers, first_chunk=1, pace=pace)
    return ClippedPolygons(vertices, ring_offsets, offsets, contours, *flags)


def _assemble_at_once(
    parts: dict[int, FloatArray], sizes: IntArray, polygon_offsets: IntArray, flags: tuple[Int8Array, BoolArray],
    dimension: int,
) -> ClippedPolygons:  # fmt: skip
    """As `_assemble`, for few rings."""
    vertices = parts[0] if len(parts) == 1 else np.concatenate([
        np.zeros((0, dimension)), *(parts[first] for first in sorted(parts))
    ])  # fmt: skip
    left, ends = np.flatnonzero(sizes), summed(sizes > 0)
    contours = np.zeros(len(left), np.int64)
    if len(polygon_offsets) != len(sizes) + 1:  # not a ring each
        owners = np.repeat(polygon_offsets[:-1], np.diff(polygon_offsets))
        contours, ends = (np.arange(len(sizes)) - owners)[left], summed(sizes > 0)[polygon_offsets]
    return ClippedPolygons(vertices, summed(sizes[left]), ends, contours, *flags)
