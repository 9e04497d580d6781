"""Public: the volume that two solids have in common, and its part of their union."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, Final

import numpy as np

from engine.collision.collide import read_pair
from engine.collision.exact_images import as_vector, image_plane, plane_in_frame
from engine.errors import InvalidArrayError, UnsupportedPairError, WrongDimensionError
from engine.polygon_clipping.planes import plan_of
from engine.predicates.rational import Number, determinant, nearest_float, scaled_integers
from engine.running.budget import Budget, Cancel
from engine.running.parallel import Progress, check_options
from engine.solid_cutting.boundary import boundary
from engine.solid_cutting.cut import cut_by_planes
from engine.solid_cutting.cut_measures import narrowed, nearest_volume, volume_between, volume_in_fractions
from engine.solid_cutting.exact_measures import exact_volume, mesh_of_half_spaces, volume_of_boxes
from engine.solid_cutting.overlap_batches import (
    check_same_length,
    extremes,
    of_bodies,
    overlap_of_polygons,
    overlaps_of_arrays,
    pose_of,
    ratio_of,
)
from engine.solid_cutting.plane_cut import plane_of, plane_through
from engine.solids.accepted import PoseLike, PosesLike, SolidLike
from engine.solids.base import Solid, named
from engine.solids.convexity import convexity
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.pose import Pose
from engine.solids.poses import Poses
from engine.solids.primitives import Aabb, Convex, Triangle
from engine.types import Accuracy, FloatArray

Rows = list[list[Fraction]]
_FEW: Final = 64
"""Faces of a mesh up to which it is looked at whether it is convex after all."""


def overlap_volume(
    first: SolidLike | Sequence[SolidLike],
    second: SolidLike | Sequence[SolidLike],
    *,
    first_pose: PoseLike | PosesLike | None = None,
    second_pose: PoseLike | PosesLike | None = None,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> float | FloatArray | tuple[float | FloatArray, Accuracy]:
    """Return the volume that two solids have in common, in the plane the area, the double nearest to the exact one.

    Parameters
    ----------
    first, second : Solid, list of Solid, or ndarray of float64, shape (n, k, 2) or (n, 5)
        Of space: an aabb, convex or convex polyhedron each, or one of them any polyhedron. Of the plane: polygon,
        triangle or aabb each, or convex or aabb each. Lists and arrays are pairs, item by item: (n, k, 2) polygons of k
        corners (rectangles, turned ones too), (n, 5) boxes by centre, width, height and angle in radians, whose corners
        are computed in float64 and then taken as they are.
    first_pose, second_pose : Pose, Poses or list of Pose and None, optional
        As for `collide`; of lists, of all items, or one for each. Two solids with many poses are as many pairs.
        Polygons and triangles take none.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts pairs.

    Returns
    -------
    float
        For lists, arrays and many poses an array (n,) of float64. With ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    UnsupportedPairError
        Two polyhedra that are not convex, or another pair without a method; the message says what to use.
    InvalidInputError
        Faces of a polyhedron cross; lists differ in length.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    Boundary: 0.0 for solids that touch. Degenerate input: 0.0 for flat or empty solids.

    Accuracy: of exact images under poses; corners of what is common are exact fractions.

    Cost: of lists of convex solids some 10 microseconds a pair, milliseconds where faces lie in one plane that is at
    a right angle to no axis; of a mesh that of `cut`; of arrays a part of a microsecond for convex polygons of at most
    16 corners, others some microseconds.

    References
    ----------
    Motzkin et al., The double description method, 1953.

    Examples
    --------
    >>> from engine import Aabb
    >>> overlap_volume(Aabb([0, 0, 0], [2, 2, 2]), Aabb([1, 1, 1], [3, 3, 3]))
    1.0
    """
    options = (workers, deadline, cancel, progress, report)
    return _of_pairs(first, second, (first_pose, second_pose), options, False)


def iou(
    first: SolidLike | Sequence[SolidLike],
    second: SolidLike | Sequence[SolidLike],
    *,
    first_pose: PoseLike | PosesLike | None = None,
    second_pose: PoseLike | PosesLike | None = None,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> float | FloatArray | tuple[float | FloatArray, Accuracy]:
    """Return the volume that two solids have in common over that of their union, in the plane of areas.

    Parameters
    ----------
    first, second, first_pose, second_pose
        As for `overlap_volume`.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts pairs.

    Returns
    -------
    float
        From 0.0 to 1.0; 0.0 where both have no volume. For lists, arrays and many poses an array (n,) of float64. With
        ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    EngineError
        As `overlap_volume`.

    Notes
    -----
    Boundary, degenerate input and cost: as `overlap_volume`.

    Accuracy: the nearest double.

    References
    ----------
    Jaccard, The distribution of the flora in the alpine zone, 1912.

    Examples
    --------
    >>> squares = np.array([[[0, 0], [2, 0], [2, 2], [0, 2]]], float)
    >>> iou(squares, squares + 1.0).tolist()
    [0.14285714285714285]
    """
    options = (workers, deadline, cancel, progress, report)
    return _of_pairs(first, second, (first_pose, second_pose), options, True)


def _of_pairs(first: Any, second: Any, poses: tuple[Any, Any], options: tuple[Any, ...], is_ratio: bool) -> Any:
    workers, deadline, cancel, progress, report = options
    check_options(workers, progress, report=report)
    are_many = all(isinstance(each, (list, np.ndarray)) and not _is_rings(each) for each in (first, second))
    with Budget(deadline, cancel) as budget, np.errstate(all="ignore"):
        budget.check()
        moves = [_listed(pose) for pose in poses]
        if are_many and all(isinstance(each, np.ndarray) for each in (first, second)) and moves == [None, None]:
            values, n_exact = overlaps_of_arrays(first, second, is_ratio, workers, budget)
        else:
            pairs = _pairs_of(first, second, moves, are_many, budget)
            are_many = are_many or any(isinstance(move, list) for move in moves)
            values, n_exact = of_bodies(pairs, moves, is_ratio, workers, budget), 0
            for number in np.flatnonzero(np.isnan(values)).tolist():
                budget.check()
                values[number], is_exact = _of_pair(*pairs[number], moves, number, is_ratio, budget)
                n_exact += is_exact
    n = len(values)
    if progress is not None:
        progress(n)
    answer = values if are_many else float(values[0])
    return (answer, Accuracy("exact", 0.5, n, n_exact, n_exact, "overlap")) if report else answer


def _is_rings(value: Any) -> bool:
    """Return whether a list or array is one polygon: positions or rings."""
    return isinstance(value, list) and len(value) > 0 and not isinstance(value[0], Solid)


def _listed(pose: Any) -> Any:
    """Return many poses as a list, others as they are."""
    if isinstance(pose, np.ndarray) and pose.ndim == 3:
        pose = Poses(pose)
    is_many = isinstance(pose, Poses) or (isinstance(pose, list) and not set(map(type, pose)) - {Pose, type(None)})
    return list(pose) if is_many else pose


def _pairs_of(
    first: Any, second: Any, moves: Sequence[Any], are_many: bool, budget: Budget
) -> Sequence[tuple[Any, Any]]:
    """Return the pairs of an argument. moves: poses of all, or lists."""
    if are_many:
        check_same_length(first, second)
    elif not (isinstance(first, Solid) and isinstance(second, Solid)):
        first, second, _ = read_pair(first, second, budget.left(), budget.cancel)
    counts = [len(move) for move in moves if isinstance(move, list)]
    n = len(first) if are_many else counts[0] if counts else 1
    for name, move in zip(("first_pose", "second_pose"), moves):
        if isinstance(move, list) and len(move) != n:
            raise InvalidArrayError(f"{name} has {len(move)} poses for {n} pairs; give one, or one for each", (name,))
    return list(zip(first, second)) if are_many else [(first, second)] * n


def _of_pair(
    first: Any, second: Any, poses: Sequence[Any], number: int, is_ratio: bool, budget: Budget
) -> tuple[float, bool]:
    """Return the common volume of two solids, or its ratio to that of the union (is_ratio), and whether integers
    decided."""
    if not (isinstance(first, Solid) and isinstance(second, Solid)):
        first, second, _ = read_pair(first, second, budget.left(), budget.cancel)
    if first.dimension != second.dimension:
        raise WrongDimensionError(
            f"first is {named(first.type)} in {first.dimension}D, second {named(second.type)} in {second.dimension}D; "
            "both must have one dimension",
            ("second",),
        )
    moves = pose_of(poses[0], first, 0, number), pose_of(poses[1], second, 1, number)
    if first.dimension == 2 and any(isinstance(each, (Polygon, Triangle)) for each in (first, second)):
        return overlap_of_polygons(first, second, moves, is_ratio, budget), False
    if isinstance(first, Aabb) and isinstance(second, Aabb) and moves == (None, None):
        both = volume_of_boxes(first, second)
        return ratio_of([both, *map(volume_of_boxes, (first, second))]) if is_ratio else nearest_float(both), True
    rows = [_rows_of(each, move, budget) for each, move in zip((first, second), moves)]
    if rows[0] is not None and rows[1] is not None:
        both = _volume_within(rows[0] + rows[1], budget)
        if not is_ratio:
            return nearest_float(both), True
        return ratio_of([both, *(_own_volume(*pair, budget) for pair in zip((first, second), moves))]), True
    if rows == [None, None] and isinstance(first, Polyhedron) and isinstance(second, Polyhedron):
        rows[1] = _rows_of_thin(second, moves[1], budget)
        rows[0] = _rows_of_thin(first, moves[0], budget) if rows[1] is None else None
        if [] in rows:
            return 0.0, True
    if rows[0] is None and isinstance(first, Polyhedron) and rows[1] is not None:
        return _of_mesh(first, moves[0], rows[1], is_ratio, budget), False
    if rows[1] is None and isinstance(second, Polyhedron) and rows[0] is not None:
        return _of_mesh(second, moves[1], rows[0], is_ratio, budget), False
    more = (
        "cut one of them into convex parts"
        if first.type == second.type == "polyhedron"
        else "collide says how they lie"
    )
    raise UnsupportedPairError(
        f"overlap_volume does not take a {first.type} with a {second.type}: give an aabb, convex or convex polyhedron, "
        f"any polyhedron with one of these, or polygons of the plane; {more}",
        ("second",),
    )


def _rows_of(solid: Solid, pose: Pose | None, budget: Budget) -> Rows | None:
    """Return the exact planes of a convex solid under a pose, each (normal, offset); None if the solid is not
    convex."""
    if not isinstance(solid, (Aabb, Convex)) and not (isinstance(solid, Polyhedron) and convexity(solid) is not None):
        return None
    planes = (_as_plane(row) for row in plan_of(solid, budget.check).rows)
    return [[*normal, offset] for normal, offset in (image_plane(plane, pose) for plane in planes)]


def _rows_of_thin(solid: Polyhedron, pose: Pose | None, budget: Budget) -> Rows | None:
    """Return what `_rows_of` does of a convex polyhedron of few faces that is thinner than doubles lie, so that no
    certificate is there; none for one without interior."""
    if len(solid.triangles) > _FEW:
        return None
    given = boundary(solid, budget)
    planes = [plane_through(solid.vertices[whole]).reversed for whole in given.wholes]
    if any((given.points.sides(plane, budget) < 0).any() for plane in planes):
        return None
    return [[*normal, offset] for normal, offset in (image_plane(_as_plane(each.integers), pose) for each in planes)]


def _as_plane(row: Sequence[Number]) -> tuple[tuple[Fraction, ...], Fraction]:
    *normal, offset = as_vector(row)
    return tuple(normal), offset


def _determinant(pose: Pose | None) -> Fraction:
    rows = [] if pose is None else pose.rotation.tolist()
    return Fraction(determinant([as_vector(row) for row in rows]))


def _volume_within(rows: Rows, budget: Budget) -> Fraction:
    mesh = mesh_of_half_spaces(rows, budget)
    return Fraction(0) if mesh is None else exact_volume(mesh)


def _own_volume(solid: Solid, pose: Pose | None, budget: Budget) -> Fraction:
    """Return the exact volume of a convex solid under a pose."""
    factor = _determinant(pose)
    if isinstance(solid, Aabb):
        return factor * volume_of_boxes(solid)
    own: Rows = [[Fraction(x) for x in row] for row in plan_of(solid, budget.check).rows]
    return factor * solid.prepared("exact_volume", lambda: _volume_within(own, budget), budget.check)


def _of_mesh(solid: Polyhedron, pose: Pose | None, rows: Rows, is_ratio: bool, budget: Budget) -> float:
    """Return the common volume of a polyhedron and a convex region given by `rows`, or its ratio to that of the union;
    pose: of the polyhedron, into whose coordinates the rows are brought."""
    factor = _determinant(pose)
    own = [plane_in_frame(_as_plane(row), pose) for row in rows]
    left = cut_by_planes(solid, [plane_of(scaled_integers([*normal, offset])) for normal, offset in own], budget)
    common = left.points, left.triangles
    if not len(left.triangles):
        return 0.0
    if not is_ratio:
        return nearest_volume(*common, budget, factor)[0]
    whole = left.given.points, left.given.triangles
    parts = [volume_between(*each, budget, factor) for each in (common, whole)]
    other = _volume_within(rows, budget)

    def ends_of(bits: int) -> Any:
        low, high = zip(*(part(bits) for part in parts))
        return extremes((*low, other), (*high, other))

    value = narrowed(ends_of, ratio_of)
    exact = (factor * volume_in_fractions(*each) for each in (common, whole))
    return ratio_of([*exact, other]) if value is None else value
