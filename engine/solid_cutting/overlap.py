"""Public: the volume that two solids have in common, and its part of their union."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, Final

import numpy as np

from engine.collision.collide import posed, read_pair
from engine.compiling.jit import entry_of
from engine.errors import NotRepresentableError, RingTooShortError, UnsupportedPairError, WrongDimensionError
from engine.polygon_clipping.planes import plan_of
from engine.polygon_overlay.batch import overlay_batch
from engine.polygon_overlay.overlay import overlay
from engine.polygon_overlay.pair_arrays import PolygonSelection, arrays_of
from engine.predicates.rational import cross, determinant, dot, nearest_float, scaled_integers
from engine.running.budget import Budget, Cancel
from engine.running.parallel import Progress, check_options, run_chunks
from engine.solid_cutting.convex_bodies import of_bodies
from engine.solid_cutting.convex_rings import MOST_CORNERS, overlap_rings
from engine.solid_cutting.cut import cut_by_planes
from engine.solid_cutting.cut_measures import MOST_BITS, volume_between, volume_in_fractions, volume_of_cut
from engine.solid_cutting.exact_sums import exact_volume, mesh_of_half_spaces
from engine.solid_cutting.plane_cut import Points, plane_of
from engine.solid_cutting.shells import outward
from engine.solid_cutting.simple_measures import product, sides_of
from engine.solids.accepted import PoseLike, SolidLike
from engine.solids.base import Solid, named
from engine.solids.checks import as_floats
from engine.solids.convexity import convexity
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.pose import Pose
from engine.solids.primitives import Aabb, Convex, Triangle
from engine.types import Accuracy, FloatArray, read_only

Rows = list[list[Fraction]]
_FIRST_BITS: Final = 128
_BOX_NUMBERS: Final = 5
_COMFORTABLE: Final = 128
"""Exponents of coordinates up to which areas are far from the least and the largest double."""


def overlap_volume(
    first: SolidLike | Sequence[SolidLike],
    second: SolidLike | Sequence[SolidLike],
    *,
    first_pose: PoseLike | None = None,
    second_pose: PoseLike | None = None,
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
    first_pose, second_pose : Pose, optional
        As for `collide`; of lists, of all items. Polygons and triangles take none.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts pairs.

    Returns
    -------
    float
        For lists and arrays an array (n,) of float64. With ``report=True`` a pair of it and an `Accuracy`.

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

    Cost: milliseconds a pair of space; of arrays a part of a microsecond for convex polygons of at most 16 corners,
    others some microseconds.

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
    first_pose: PoseLike | None = None,
    second_pose: PoseLike | None = None,
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
        From 0.0 to 1.0; 0.0 where both have no volume. For lists and arrays an array (n,) of float64. With
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
        if are_many and all(isinstance(each, np.ndarray) for each in (first, second)) and poses == (None, None):
            values, n_exact = _of_arrays(first, second, is_ratio, workers, budget)
        else:
            pairs = list(zip(first, second, strict=True)) if are_many and _same(first, second) else [(first, second)]
            values, n_exact = of_bodies(pairs, poses, is_ratio, workers, budget), 0
            for number in np.flatnonzero(np.isnan(values)).tolist():
                budget.check()
                values[number], is_exact = _of_pair(*pairs[number], poses, is_ratio, budget)
                n_exact += is_exact
    n = len(values)
    if progress is not None:
        progress(n)
    answer = values if are_many else float(values[0])
    return (answer, Accuracy("exact", 0.5, n, n_exact, n_exact, "overlap")) if report else answer


def _is_rings(value: Any) -> bool:
    """Return whether a list or array is one polygon: positions or rings."""
    return isinstance(value, list) and len(value) > 0 and not isinstance(value[0], Solid)


def _same(first: Any, second: Any) -> bool:
    if len(first) != len(second):
        raise UnsupportedPairError(f"{len(first)} solids and {len(second)}; give as many of each", ("second",))
    return True


def _of_arrays(first: Any, second: Any, is_ratio: bool, workers: int | None, budget: Budget) -> tuple[FloatArray, int]:
    """Return areas, or their ratios, of arrays (n, k, 2) of polygons or (n, 5) of boxes, and how many took overlays."""
    sides = [_corners_of(each, name) for name, each in (("first", first), ("second", second))]
    _same(*sides)
    values = np.full(len(sides[0]), np.nan)
    if all(side.shape[1] <= MOST_CORNERS for side in sides):

        def fill(start: int, stop: int) -> None:
            some = [side[start:stop] for side in sides]
            entry_of(overlap_rings)(*some, is_ratio, values[start:stop], budget.flag)

        run_chunks(fill, len(values), budget=budget, workers=workers)
    rows = np.flatnonzero(np.isnan(values))
    if not len(rows):
        return values, 0
    one, other = (side[rows] for side in sides)
    if is_ratio:
        one, other = _scaled(one, other)
        pairs = (one, other), (one, _around(one)), (other, _around(other))
        values[rows] = _ratios([(_selection(p), _selection(q)) for p, q in pairs], workers, budget)
        return values, len(rows)
    limits: Any = {"deadline": budget.left(), "cancel": budget.cancel, "workers": workers}
    made: Any = overlay_batch(_selection(one), _selection(other), **limits)
    values[rows] = made.areas
    if len(beyond := np.flatnonzero(np.isinf(values))):
        pair = int(beyond[0])
        raise NotRepresentableError(
            f"the area of pair {pair} is beyond the largest float64; scale the input down", ("first", pair)
        )
    return values, len(rows)


def _corners_of(each: Any, name: str) -> FloatArray:
    """Return an array of polygons (n, k, 2), or of boxes (n, 5), as corners."""
    if each.ndim == 2 and each.shape[1] == _BOX_NUMBERS:
        x, y, width, height, angle = as_floats(each, 2, (name,)).T
        along = np.stack([np.cos(angle), np.sin(angle)], axis=1) / 2
        across = np.stack([-along[:, 1], along[:, 0]], axis=1) * height[:, None]
        along = along * width[:, None]
        ways = (-along - across, along - across, along + across, across - along)
        each = np.stack([x, y], axis=1)[:, None] + np.stack(ways, axis=1)
    corners = as_floats(each, 3, (name,))
    if corners.shape[2] != 2:
        raise WrongDimensionError(f"{name} must hold positions of 2 numbers each, got {corners.shape[2]}", (name,))
    if corners.shape[1] < 3:
        raise RingTooShortError(f"{name} has polygons of {corners.shape[1]} corners; give 3 or more", (name,))
    return read_only(corners)


def _ratios(pairs: Sequence[tuple[Any, Any]], workers: int | None, budget: Budget) -> FloatArray:
    """Return the nearest doubles of ratios of areas. pairs: of polygons, and of each with a box around, within which it
    has its own area."""
    limits: Any = {"deadline": budget.left(), "cancel": budget.cancel, "workers": workers}
    made: list[Any] = [overlay_batch(*pair, **limits) for pair in pairs]
    sums, values = np.stack([each.twice_areas() for each in made], axis=1), np.empty(len(made[0]))
    for row, parts in enumerate(sums.tolist()):
        budget.check()
        areas: list[list[Fraction]] = []
        if np.isfinite(sums[row]).all():
            middles = [Fraction(h) + Fraction(low) for h, low, _ in parts]
            areas = [[mid + way * Fraction(part[2]) for mid, part in zip(middles, parts)] for way in (-1, 1)]
        ends = [_ratio(some) for some in _extremes(*areas)] if areas else [0.0, 1.0]
        if ends[0] != ends[1]:
            ends = [_ratio([each[row].area_exact for each in made])]
        values[row] = ends[0]
    return values


def _extremes(low: Sequence[Fraction], high: Sequence[Fraction]) -> Any:
    """Return (both, first, second) at which their ratio is least, and greatest."""
    return (low[0], *high[1:]), (high[0], *low[1:])


def _selection(corners: FloatArray) -> PolygonSelection:
    """Return an array (n, k, 2) as polygons."""
    n, k = corners.shape[:2]
    arrays = arrays_of(corners.reshape(-1, 2), np.arange(0, n * k + 1, k), np.arange(n + 1))
    return PolygonSelection(arrays, np.arange(n))


def _scaled(*sides: FloatArray) -> list[FloatArray]:
    """Return corners (n, k, 2), each pair multiplied by powers of two by axis, where areas might be too large or too
    small for doubles."""
    exponents = np.frexp(np.maximum(*(np.abs(each).max(axis=1) for each in sides)))[1]
    exponents[np.abs(exponents) <= _COMFORTABLE] = 0
    return [np.ldexp(each, -exponents[:, None]) for each in sides] if exponents.any() else list(sides)


def _around(corners: FloatArray) -> FloatArray:
    """Return a box strictly around each polygon: with that it has its own area in common, crossing no edge."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    width = (high - low).max(axis=1, keepdims=True) + np.abs(low) + 1e-300
    low, high = low - width, high + width
    return np.stack([low, np.c_[high[:, 0], low[:, 1]], high, np.c_[low[:, 0], high[:, 1]]], axis=1)


def _ratio(volumes: Sequence[Fraction]) -> float:
    """Return the ratio of what two have in common to their union, from that and the volume of each."""
    both, first, second = volumes
    union = first + second - both
    return min(1.0, max(0.0, nearest_float(both / union))) if union > 0 else 0.0


def _of_pair(first: Any, second: Any, poses: tuple[Any, Any], is_ratio: bool, budget: Budget) -> tuple[float, bool]:
    """Return the common volume of two solids, or its ratio, and whether it took exact arithmetic."""
    if not (isinstance(first, Solid) and isinstance(second, Solid)):
        first, second, _ = read_pair(first, second, budget.left(), budget.cancel)
    if first.dimension != second.dimension:
        raise WrongDimensionError(
            f"first is {named(first.type)} in {first.dimension}D, second {named(second.type)} in {second.dimension}D; "
            "both must have one dimension",
            ("second",),
        )
    moves = posed(poses[0], first, "first_pose"), posed(poses[1], second, "second_pose")
    if first.dimension == 2 and any(isinstance(each, (Polygon, Triangle)) for each in (first, second)):
        return _of_polygons(first, second, moves, is_ratio, budget), False
    if isinstance(first, Aabb) and isinstance(second, Aabb) and moves == (None, None):
        ends = zip(first.min.tolist(), second.min.tolist(), first.max.tolist(), second.max.tolist())
        sides = [max(Fraction(0), Fraction(min(c, d)) - Fraction(max(a, b))) for a, b, c, d in ends]
        both = product(sides)
        own = [product(sides_of(each)) for each in (first, second)]
        return _ratio([both, *own]) if is_ratio else nearest_float(both), True
    rows = [_rows_of(each, move, budget) for each, move in zip((first, second), moves)]
    if rows[0] is not None and rows[1] is not None:
        both = _volume_within(rows[0] + rows[1], budget)
        if not is_ratio:
            return nearest_float(both), True
        return _ratio([both, *(_own_volume(*pair, budget) for pair in zip((first, second), moves))]), True
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
    """Return the planes of a convex solid under a pose, exact; None if it is not convex."""
    if not isinstance(solid, (Aabb, Convex)) and not (isinstance(solid, Polyhedron) and convexity(solid) is not None):
        return None
    return [_moved([Fraction(x) for x in row], pose) for row in plan_of(solid, budget.check).rows]


def _moved(row: list[Fraction], pose: Pose | None) -> list[Fraction]:
    """Return the row of a plane under a pose: that of R^-1 (x - t), times the determinant of R."""
    if pose is None:
        return row
    turn, move = _numbers(pose)
    *normal, offset = row
    columns = [tuple(line[k] for line in turn) for k in range(len(turn))]
    adjugate: list[tuple[Fraction, ...]]
    if len(turn) == 3:  # the rows of the adjugate are cross products of the columns
        adjugate = [*(cross(columns[(k + 1) % 3], columns[(k + 2) % 3]) for k in range(3))]
    else:
        adjugate = [(columns[1][1], -columns[1][0]), (-columns[0][1], columns[0][0])]
    made = [sum((normal[k] * adjugate[k][j] for k in range(len(turn))), Fraction(0)) for j in range(len(turn))]
    return [*made, offset * determinant(turn) - dot(made, move)]


def _numbers(pose: Pose) -> tuple[list[tuple[Fraction, ...]], list[Fraction]]:
    return [tuple(map(Fraction, line)) for line in pose.rotation.tolist()], [
        Fraction(x) for x in pose.translation.tolist()
    ]


def _volume_within(rows: Rows, budget: Budget) -> Fraction:
    mesh = mesh_of_half_spaces(rows, budget)
    return Fraction(0) if mesh is None else exact_volume(mesh)


def _own_volume(solid: Solid, pose: Pose | None, budget: Budget) -> Fraction:
    """Return the exact volume of a convex solid under a pose."""
    factor = Fraction(1) if pose is None else Fraction(determinant(_numbers(pose)[0]))
    if isinstance(solid, Aabb):
        return factor * product(sides_of(solid))
    own: Rows = [[Fraction(x) for x in row] for row in plan_of(solid, budget.check).rows]
    return factor * solid.prepared("exact_volume", lambda: _volume_within(own, budget), budget.check)


def _of_mesh(solid: Polyhedron, pose: Pose | None, rows: Rows, is_ratio: bool, budget: Budget) -> float:
    """Return what a polyhedron has in common with a convex region, whose planes are brought into its coordinates."""
    factor = Fraction(1)
    own = rows
    if pose is not None:
        turn, move = _numbers(pose)
        factor = Fraction(determinant(turn))
        columns = [tuple(line[k] for line in turn) for k in range(3)]
        own = [[*(dot(row[:3], column) for column in columns), dot(row[:3], move) + row[3]] for row in rows]
    left = cut_by_planes(solid, [plane_of(scaled_integers(row)) for row in own], budget)
    common = left.points, left.triangles
    if not len(left.triangles):
        return 0.0
    if not is_ratio:
        return volume_of_cut(*common, budget, factor)
    whole = Points(solid.vertices), outward(solid, budget)
    parts = [volume_between(*each, budget, factor) for each in (common, whole)]
    other = _volume_within(rows, budget)

    bits = _FIRST_BITS
    while bits <= MOST_BITS:
        low, high = zip(*(part(bits) for part in parts))
        least, most = (_ratio(some) for some in _extremes((*low, other), (*high, other)))
        if least == most:
            return least
        bits *= 4
    return _ratio([*(factor * volume_in_fractions(*each) for each in (common, whole)), other])


def _of_polygons(first: Solid, second: Solid, moves: tuple[Any, Any], is_ratio: bool, budget: Budget) -> float:
    """Return what polygons have in common. is_ratio: maybe each axis multiplied by a power of two."""
    if moves != (None, None):
        raise UnsupportedPairError("polygons take no pose here; move their vertices", ("first_pose",))
    sides = [_as_polygon(each) for each in (first, second)]
    if not is_ratio:
        return overlay(sides[0], sides[1], deadline=budget.left(), cancel=budget.cancel).area
    if not all(len(each.vertices) for each in sides):
        return 0.0
    places = _scaled(*(each.vertices[None] for each in sides))
    one, other = ([Polygon.of_arrays(read_only(at[0]), each.ring_offsets)] for at, each in zip(places, sides))
    boxes = [[Polygon([_around(at)[0]])] for at in places]
    return float(_ratios([(one, other), (one, boxes[0]), (other, boxes[1])], 1, budget)[0])


def _as_polygon(solid: Any) -> Polygon:
    if isinstance(solid, Aabb):
        (a, b), (c, d) = solid.min.tolist(), solid.max.tolist()
        return Polygon([[(a, b), (c, b), (c, d), (a, d)]])
    if isinstance(solid, Triangle):
        return Polygon([solid.vertices])
    if isinstance(solid, Polygon):
        return solid
    raise UnsupportedPairError(f"overlap of a polygon and a {solid.type} is not there; give polygons", ("second",))
