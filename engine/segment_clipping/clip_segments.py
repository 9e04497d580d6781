"""Public: clip segments to a region."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, Unpack, overload

import numpy as np

from engine.predicates.rational import balanced_rows
from engine.running.budget import UNLIMITED, Budget, Cancel, reading
from engine.running.parallel import Options, Progress, check_options, is_unlimited
from engine.segment_clipping.ball_cut import decide_on_sphere, fill_on_sphere
from engine.segment_clipping.cohen_sutherland import decide_on_boxes
from engine.segment_clipping.cyrus_beck import as_columns, decide_on_rows
from engine.segment_clipping.decide_then_cut import Method, Plan, Scaled, clip_on_convex, scaled
from engine.segment_clipping.planes_cut import fill_on_boxes, fill_on_rows
from engine.solids.accepted import LinesLike, SolidLike
from engine.solids.base import Solid
from engine.solids.checks import as_point_groups, is_ready
from engine.solids.columns import Columns
from engine.solids.mesh import is_large
from engine.solids.pictures import Pictured
from engine.solids.primitives import Aabb, Convex, HalfSpace, Sphere, rows_between, rows_of
from engine.solids.registry import refused, row_of
from engine.solids.shapes import as_solid
from engine.types import Accuracy, FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SegmentPieces(Pictured, Columns):
    """The pieces of a batch of segments within a region, by source and then by t.

    Attributes
    ----------
    source : ndarray of int64, shape (m,)
        The segment each piece is a part of.
    start, end : ndarray of float64, shape (m, dim)
        Each coordinate the double nearest to the exact one.
    t : ndarray of float64, shape (m, 2)
        The parameters of both ends, each the nearest double.
    faces : ndarray of int64, shape (m, 2)
        The plane or face crossed at either end, -1 where the end is the segment's own.
    """

    _rows: ClassVar[str] = "pieces"
    source: IntArray
    start: FloatArray
    end: FloatArray
    t: FloatArray
    faces: IntArray

    def __iter__(self) -> Iterator[tuple[int, FloatArray, FloatArray]]:
        """Yield of each piece the segment that it is a part of, its start and its end."""
        return zip(self.source.tolist(), self.start, self.end)

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        """The pieces as a GeoJSON MultiLineString."""
        return {"type": "MultiLineString", "coordinates": np.stack([self.start, self.end], axis=1).tolist()}


@overload
def clip_segments(
    segments: LinesLike, region: SolidLike, *, report: Literal[False] = False, **options: Unpack[Options]
) -> SegmentPieces: ...


@overload
def clip_segments(
    segments: LinesLike, region: SolidLike, *, report: Literal[True], **options: Unpack[Options]
) -> tuple[SegmentPieces, Accuracy]: ...


def clip_segments(
    segments: LinesLike,
    region: SolidLike,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> SegmentPieces | tuple[SegmentPieces, Accuracy]:
    """Return the pieces of segments that lie in a region, a closed set.

    Parameters
    ----------
    segments : array_like, shape (n, 2, dim)
        Two points each; may be empty.
    region : Solid
        half_space, aabb, convex (may be empty or unbounded), sphere, polygon or polyhedron of the same dimension. In
        the last two a segment may have several pieces.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts segments.

    Returns
    -------
    SegmentPieces
        The parts of [0, 1] that no piece covers are outside of the region. With ``report=True`` a pair of it and an
        `Accuracy`.

    Raises
    ------
    UnsupportedSolidError, InvalidArrayError, WrongDimensionError, NotFiniteError
        For arguments that break a rule; the message names the segment.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    A piece is a maximal connected part of a segment within the region or on its boundary. Boxes are clipped by
    Cohen-Sutherland outcodes, convex regions by Cyrus-Beck, spheres by the roots of a quadratic, polygons and polyhedra
    by the elements of their boundary that a box tree gives; all with exact decisions on the original ends.

    Boundary: counts as inside. A segment in a face is kept, one that touches in a single point gives that point (t0 =
    t1). `faces` at the start is -1 exactly where t0 = 0, at the end where t1 = 1; else the plane crossed there, of
    several at one point the smallest, those that the segment runs along, or that have no area, last. Indices:
    half_space 0; aabb xmin, xmax, ymin, ymax, zmin, zmax; convex the row; sphere 0; polyhedron the face as given;
    polygon the edge, named by the index of its first vertex over all rings.

    Degenerate input: a segment of no length is a point, kept as a whole (t = (0, 1), faces -1) or dropped.

    Accuracy: decisions exact for every finite input. Coordinates and t are the doubles nearest to the exact values,
    each on its own, zero as +0.0; so a piece may stick out of a slanted plane by half a unit in the last place, and the
    ends of a tiny piece may be equal. On an aabb a coordinate cut by a plane is the plane's. No result overflows.

    Cost: O(n planes), or O(n (log faces + contacts)) after one preparation; allocates the outputs.

    References
    ----------
    Cohen and Sutherland in Newman, Sproull, Principles of Interactive Computer Graphics, 1979; Cyrus, Beck, Generalized
    two- and three-dimensional clipping, 1978; the textbook, section 22.4.2.

    Examples
    --------
    >>> from engine.solids.primitives import Aabb
    >>> pieces = clip_segments([[[-1.0, 1.0], [3.0, 1.0]]], Aabb(min=[0.0, 0.0], max=[2.0, 2.0]))
    >>> pieces.start.tolist(), pieces.end.tolist(), pieces.t.tolist(), pieces.faces.tolist()
    ([[0.0, 1.0]], [[2.0, 1.0]], [[0.25, 0.75]], [[0, 1]])
    """
    is_free = is_unlimited(workers, deadline, cancel, progress)
    if not is_free or report is not False:
        check_options(workers, progress, report=report)
    plan: Plan | None = region.cached("segment_plan") if isinstance(region, Solid) else None
    array: Any = segments
    solid: Any = region  # with a plan, one of ours
    if plan is None or not is_ready(array, 2, solid.dimension):
        with reading(deadline, cancel) as reader:
            region = as_solid(region, "region")
            plan = plan_for(region)
            array = as_point_groups(array, 2, region.dimension, ("segments",), must_be_finite=False)  # `cut` looks
        deadline = reader.left()
    if is_free and len(array) <= plan.few and (workers is None or not is_large(solid)):
        clipped, n_beyond, n_rational = plan.cut(array, region, plan, UNLIMITED, workers, None)
    else:
        with Budget(deadline, cancel, workers) as budget:
            clipped, n_beyond, n_rational = plan.cut(array, region, plan, budget, workers, progress)
    source, (start, end), t, faces = clipped
    pieces = SegmentPieces(source, start, end, t, faces)
    return (pieces, Accuracy("exact", 0.5, len(array), n_beyond, n_rational, plan.name)) if report else pieces


def plan_for(region: Solid) -> Plan:
    """Return the cached clipping plan of a solid. Raises: UnsupportedSolidError."""
    make = row_of(region).clip
    if make is None:
        more = "; hits tells where segments meet a surface" if row_of(region).hits else ""
        raise refused(region, "clip_segments does not take", lambda row: row.clip, more, ("region",))
    plan: Plan = region.prepared("segment_plan", lambda: make(region))
    return plan


def on_box(region: Aabb) -> Plan:
    """Return the clipping plan of a box: the kernels of Cohen-Sutherland clipping."""
    low, high = region.min, region.max

    def with_columns(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return low, high, as_columns(rows_between(low, high))

    def scale(segments: FloatArray) -> Scaled | None:
        batch = scaled(segments, low, high)
        return batch and replace(batch, region=with_columns(*batch.region))

    method = Method(decide_on_boxes, fill_on_boxes, with_columns(low, high), scale)
    return Plan("cohen_sutherland", clip_on_convex, method=method)


def on_planes(region: HalfSpace | Convex) -> Plan:
    """Return the clipping plan of a half-space or convex solid: the kernels of Cyrus-Beck clipping."""
    rows = rows_of(region)
    plain = balanced_rows(rows, 0)

    def scale(segments: FloatArray) -> Scaled | None:
        batch = scaled(segments)
        balanced = None if batch is None else balanced_rows(rows, batch.exponent)
        return None if batch is None or balanced is None else replace(batch, region=(as_columns(balanced),))

    method = Method(decide_on_rows, fill_on_rows, (as_columns(rows if plain is None else plain),), scale)
    return Plan("cyrus_beck", clip_on_convex, method=method)


def on_ball(region: Sphere) -> Plan:
    """Return the clipping plan of a ball: the kernels that compute roots of a quadratic."""
    center, radius = region.center, float(region.radius)

    def scale(segments: FloatArray) -> Scaled | None:
        batch = scaled(segments, center, np.array([radius]))
        return batch and replace(batch, region=(batch.region[0], float(batch.region[1][0])))

    method = Method(decide_on_sphere, fill_on_sphere, (center, radius), scale)
    return Plan("sphere_interval", clip_on_convex, method=method)
