"""Public: bounds(solid), the box and the minimal enclosing ball (sphere); the boxes that posed ones are made from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, Unpack, overload

import numpy as np

from engine.bounding.aabb import box_of_points, corners_of_box, fill_box
from engine.bounding.double_description import corners_of_half_spaces
from engine.bounding.minimal_sphere import MinimalSphere, minimal_sphere, minimal_sphere_of_rationals
from engine.compiling.jit import entry_of
from engine.errors import EmptyGeometryError, NotRepresentableError, UnsupportedSolidError
from engine.predicates.rational import nearest_float
from engine.running.budget import Budget, Cancel
from engine.running.parallel import Options, Progress, check_options
from engine.solids.accepted import SolidLike
from engine.solids.base import Solid
from engine.solids.columns import brief
from engine.solids.mesh import Mesh, used_by_faces
from engine.solids.polygon import Polygon
from engine.solids.primitives import Aabb, Convex, Sphere, Triangle
from engine.solids.registry import Box, refused, row_of, unbounded
from engine.solids.shapes import read_argument
from engine.types import Accuracy, FloatArray, read_only

Check: TypeAlias = Callable[[], object] | None


@dataclass(frozen=True, slots=True)
class Bounds:
    """The two bounding volumes of a solid.

    Attributes
    ----------
    aabb : Aabb
        The smallest box along the axes.
    sphere : Sphere
        The minimal enclosing ball.
    """

    aabb: Aabb  # the smallest box, each coordinate the nearest double
    sphere: Sphere  # the smallest sphere: centre the nearest double, radius the smallest double that holds the solid

    def __repr__(self) -> str:
        return brief(f"Bounds({self.aabb!r}, {self.sphere!r})")


Reported: TypeAlias = tuple[Bounds, Accuracy]


@overload
def bounds(solid: SolidLike, *, report: Literal[False] = False, **options: Unpack[Options]) -> Bounds: ...
@overload
def bounds(solid: SolidLike, *, report: Literal[True], **options: Unpack[Options]) -> tuple[Bounds, Accuracy]: ...
def bounds(
    solid: SolidLike,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Bounds | tuple[Bounds, Accuracy]:
    """Return the smallest axis-aligned box and the minimal enclosing ball of a solid.

    Parameters
    ----------
    solid : Solid
        A sphere, aabb, triangle (flat, also in 3D), polygon, polyhedron, surface (only vertices that faces name count)
        or a bounded, non-empty convex.
    workers : int, optional
        One is used.
    deadline, cancel, report
        As for `locate`.
    progress : callable, optional
        Called with 1 when done.

    Returns
    -------
    Bounds
        With ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    UnsupportedSolidError
        A half_space, implicit, csg, or an unbounded convex.
    EmptyGeometryError
        A convex without points.
    NotRepresentableError, TooComplexError
        A bound is beyond the largest double; a stated cap on exact work was reached.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    Degenerate input: a single point has a box without size and a ball of radius 0.

    Accuracy: the box is exact for solids given by vertices. For a convex the exact corners are computed and each bound
    is rounded to the nearest double, likewise for a sphere, so there the box may miss the solid by half a unit in the
    last place. The ball has the exact centre of the minimal one, rounded to the nearest doubles, and the smallest
    radius about that centre whose closed ball contains the solid.

    Cost: O(n) per iteration, 5 to 20 iterations in practice: some 15 ms for 43,000 vertices. Cached with the solid.

    References
    ----------
    Welzl, Smallest enclosing disks (balls and ellipsoids), 1991; Gaertner, Fast and robust smallest enclosing balls,
    1999; Motzkin et al., The double description method, 1953.

    Examples
    --------
    >>> from engine.solids.polygon import Polygon
    >>> box = bounds(Polygon([[[0, 0], [4, 0], [4, 3]]]))
    >>> box.aabb, box.sphere
    (Aabb(min=[0.0, 0.0], max=[4.0, 3.0]), Sphere(center=[2.0, 1.5], radius=2.5))
    """
    solid, deadline = read_argument(solid, deadline, cancel)
    check_options(workers, progress, report=report)
    with Budget(deadline, cancel, workers) as budget:
        budget.check()
        result, accuracy = solid.prepared("bounds", lambda: _bounds_of(solid, budget), budget.check)
    if progress is not None:
        progress(1)
    return (result, accuracy) if report else result


def _bounds_of(solid: Solid, budget: Budget) -> Reported:
    row = row_of(solid)
    if row.bounds is None:
        more = "; others may reach to infinity or be empty"
        raise refused(solid, "bounds does not take", lambda row: row.bounds, more, ("solid",))
    result: Reported = row.bounds(solid, budget)
    return result


def bounds_of_sphere(solid: Sphere, _: Budget) -> Reported:
    """Return box and sphere of a ball and the accuracy report, for `Row.bounds`."""
    return Bounds(_box_of_sphere(solid), solid), _accuracy("sphere", 1)


def bounds_of_box(solid: Aabb, budget: Budget) -> Reported:
    """Return box and minimal sphere of an axis-aligned box and the accuracy report, for `Row.bounds`."""
    return _around(corners_of_box(solid.min, solid.max), budget, solid)


def bounds_of_vertices(solid: Mesh | Polygon | Triangle, budget: Budget) -> Reported:
    """Return box and minimal sphere of a solid that is bounded by its vertices and the accuracy report, for
    `Row.bounds`."""
    return _around(vertices_in_use(solid), budget)


def _around(points: FloatArray, budget: Budget, box: Aabb | None = None) -> Reported:
    ball = minimal_sphere(points, budget)
    result = Bounds(box or Aabb(*box_of_points(points)), Sphere(ball.center, ball.radius))
    return result, _accuracy("farthest_point_walk", len(points), ball)


def vertices_in_use(mesh: Mesh | Polygon | Triangle) -> FloatArray:
    """Return the vertices (n, dimension) of a solid, of a mesh those that a face uses."""
    return used_by_faces(mesh)[0] if isinstance(mesh, Mesh) else mesh.vertices


def bounds_of_convex(solid: Convex, budget: Budget) -> Reported:
    """Return box and minimal sphere of an intersection of half-spaces, from its exact corners, and the accuracy report,
    for `Row.bounds`."""
    corners = corners_of_half_spaces(solid.planes.tolist(), budget)
    if corners.is_empty:
        raise EmptyGeometryError("no point satisfies all rows of this convex, so it has no bounds", ("solid", "planes"))
    if not corners.is_bounded:
        raise UnsupportedSolidError(
            "this convex reaches to infinity, so it has no bounds; add the planes that close it", ("solid", "planes")
        )
    axes = range(solid.dimension)
    low = [nearest_float(min(point[axis] for point in corners.points)) for axis in axes]
    high = [nearest_float(max(point[axis] for point in corners.points)) for axis in axes]
    ball = minimal_sphere_of_rationals(corners.points, budget)
    result = Bounds(Aabb(low, high), Sphere(ball.center, ball.radius))
    n = len(corners.points)
    return result, Accuracy("exact", 0.5, n, n, n, "double_description")


def _box_of_sphere(solid: Sphere) -> Aabb:
    with np.errstate(over="ignore"):  # one rounded operation each: the nearest double
        low, high = solid.center - solid.radius, solid.center + solid.radius
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        raise NotRepresentableError(f"the box of {solid!r} ends beyond the largest float64; scale it down", ("solid",))
    return Aabb(low, high)


def _accuracy(method: str, n_items: int, ball: MinimalSphere | None = None) -> Accuracy:
    n_beyond, n_rational = (ball.n_candidates, ball.n_rational) if ball else (0, 0)
    return Accuracy("exact", 0.5, n_items, n_beyond, n_rational, method)


def vertices_box(solid: Mesh | Polygon | Triangle, check: Check) -> Box:
    """Return the `Box` (low, high, reach) of a solid with vertices, for `Row.box`; computed once. check: see
    `Solid.prepared`."""
    return solid.prepared("own_box", lambda: _box_of_vertices(solid), check)


def triangle_box(solid: Triangle, check: Check) -> Box:
    """Return the `Box` (low, high, reach) of a planar triangle, for `Row.box`; infinite for a triangle in space, whose
    prism is unbounded. check: see `Solid.prepared`."""
    return vertices_box(solid, check) if solid.dimension == 2 else unbounded(solid)


def _box_of_vertices(body: Mesh | Polygon | Triangle) -> tuple[FloatArray, FloatArray, float]:
    """Return (low, high, reach): the box of the vertices in use, and an upper bound on their distance from its centre.
    The square underflows for distances below 2^-537, for which 2^-500 is added; 2^-40 covers some ten roundings."""
    with np.errstate(all="ignore"):
        if isinstance(body, Mesh):
            low, high = np.empty(3), np.empty(3)
            reach = entry_of(fill_box)(read_only(body.vertices), read_only(body.triangles), low, high)
        else:
            low, high = box_of_points(body.vertices)
            aside = body.vertices - (0.5 * low + 0.5 * high)
            reach = (aside * aside).sum(axis=1).max()
    reach = float(np.sqrt(reach)) * (1.0 + 2.0**-40) + 2.0**-500
    return low, high, reach


def boxes_of_polygons(polygons: Sequence[Any]) -> tuple[FloatArray, FloatArray]:
    """Return the boxes (n, 2, 2) of polygons with vertices, and their reaches (n,), as `_box_of_vertices`."""
    points = np.frombuffer(b"".join([polygon.vertices for polygon in polygons])).reshape(-1, 2)
    counts = np.array([len(polygon.vertices) for polygon in polygons])
    starts = np.cumsum(counts) - counts
    low, high = np.minimum.reduceat(points, starts), np.maximum.reduceat(points, starts)
    with np.errstate(all="ignore"):
        aside = points - np.repeat(0.5 * low + 0.5 * high, counts, axis=0)
        reaches = np.sqrt(np.maximum.reduceat((aside * aside).sum(axis=1), starts))
    return np.stack([low, high], axis=1), reaches * (1.0 + 2.0**-40) + 2.0**-500
