"""Public: volume, area and centroid of a solid, each the double nearest to the exact value for the numbers given."""

from __future__ import annotations

from fractions import Fraction
from math import isfinite
from typing import Any, Final, TypeVar

import numpy as np

from engine.compiling.jit import entry_of
from engine.errors import NotRepresentableError, WrongDimensionError
from engine.predicates.rational import SMALLEST_NORMAL, exponent_of, nearest_float, shifted
from engine.running.budget import Budget, Cancel
from engine.running.parallel import Progress, check_options
from engine.solid_cutting.boundary import boundary, surface
from engine.solid_cutting.cut_measures import area_of_cut, centroid_in_fractions, volume_of_cut
from engine.solid_cutting.exact_measures import Measures, exact_centroid, exact_faces, exact_volume, nearest_area
from engine.solid_cutting.sums import LOST_TO_ROOTS, bound_of, sum_area, sum_moments, sum_volume
from engine.solids.accepted import SolidLike
from engine.solids.base import Solid
from engine.solids.mesh import Mesh, Polyhedron
from engine.solids.registry import Where, refused, row_of
from engine.solids.shapes import read_argument
from engine.types import Accuracy, FloatArray, IntArray, read_only

T = TypeVar("T")


def volume(
    solid: SolidLike,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> float | tuple[float, Accuracy]:
    """Return the volume of a solid of space, the double nearest to the exact one.

    Parameters
    ----------
    solid : Solid
        A polyhedron, aabb, sphere or bounded convex of space.
    workers, progress : optional
        Accepted by every operation; one solid is one item.
    deadline, cancel, report
        As for `locate`.

    Returns
    -------
    float
        With ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    UnsupportedSolidError
        A solid of another type, or an unbounded convex.
    WrongDimensionError
        A solid of the plane: use `area`.
    InvalidInputError
        Faces of a polyhedron cross; the message names two.
    NotRepresentableError
        The volume is beyond the largest double.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    A polyhedron is even-odd: what an odd number of shells holds is inside, whatever way their faces are turned. Shells
    may touch themselves and each other, in corners, along edges and with faces; where faces pass through each other
    the call is refused.

    Degenerate input: 0.0 for a flat or empty solid.

    Accuracy: sums in double-doubles with a proven bound, in integers where that does not decide.

    Cost: some 0.02 us a face. The first call for a polyhedron that is not star-shaped also looks for faces that meet, 4
    us a face, and cancels those that lie on each other, some 150 us for each of them; that is cached with the solid.

    References
    ----------
    Mirtich, Fast and accurate computation of polyhedral mass properties, 1996.

    Examples
    --------
    >>> from engine import Aabb, Convex
    >>> volume(Aabb([0, 0, 0], [1, 2, 3])), volume(Convex([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [-1, -1, -1, 1]]))
    (6.0, 0.16666666666666666)
    """
    return _measured(solid, "volume", workers, deadline, cancel, progress, report)


def area(
    solid: SolidLike,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> float | tuple[float, Accuracy]:
    """Return the area of a solid of the plane, or of the surface of one of space, the double nearest to the exact one.

    Parameters
    ----------
    solid : Solid
        A polygon, triangle, aabb, sphere, bounded convex, polyhedron or surface.
    workers, progress : optional
        Accepted by every operation; one solid is one item.
    deadline, cancel, report
        As for `locate`.

    Returns
    -------
    float
        With ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    UnsupportedSolidError
        A solid of another type, or an unbounded convex.
    InvalidInputError
        Some faces of a polyhedron pass through each other, and others lie on each other; the message names two.
    NotRepresentableError
        The area is beyond the largest double.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    A polygon is even-odd, its rings may cross. The area of a polyhedron is that of the boundary of its interior: parts
    of faces that lie on each other count once if an odd number do, else not. Of a surface every face counts.

    Degenerate input: 0.0 for what has no area. Faces of a polyhedron may pass through each other; if some lie on each
    other too it is refused.

    Accuracy: as `volume`; sums of square roots are decided by as many digits as it takes.

    Cost: some 0.05 us a face of a mesh, and of a polyhedron what `volume` does once; a polygon that of `union_all`.

    References
    ----------
    Besicovitch, On the linear independence of fractional powers of integers, 1940.

    Examples
    --------
    >>> from engine import Aabb, Polygon
    >>> area(Polygon([[[0, 0], [4, 0], [4, 3]]])), area(Aabb([0, 0, 0], [1, 2, 3]))
    (6.0, 22.0)
    """
    return _measured(solid, "area", workers, deadline, cancel, progress, report)


def centroid(
    solid: SolidLike,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> FloatArray | tuple[FloatArray, Accuracy]:
    """Return the centroid of a solid, each coordinate the double nearest to the exact one.

    Parameters
    ----------
    solid : Solid
        A polyhedron, aabb, sphere, bounded convex, polygon or triangle of the plane.
    workers, progress : optional
        Accepted by every operation; one solid is one item.
    deadline, cancel, report
        As for `locate`.

    Returns
    -------
    ndarray of float64, shape (dimension,)
        With ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    UnsupportedSolidError
        A solid of another type, or an unbounded convex.
    EmptyGeometryError
        A solid without volume, or of the plane without area.
    InvalidInputError
        Faces of a polyhedron cross; the message names two.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    Of the solid, of uniform density: not the mean of the vertices. Even-odd, degenerate input, accuracy: as `volume`.
    A box or ball without size has a centroid all the same: its middle.

    Cost: some 0.15 us a face.

    References
    ----------
    Mirtich, Fast and accurate computation of polyhedral mass properties, 1996.

    Examples
    --------
    >>> from engine import Polygon
    >>> centroid(Polygon([[[0, 0], [6, 0], [0, 3]]])).tolist()
    [2.0, 1.0]
    """
    return _measured(solid, "centroid", workers, deadline, cancel, progress, report)


def _measured(
    solid: SolidLike, what: str, workers: Any, deadline: float | None, cancel: Cancel | None,
    progress: Progress | None, report: bool,
) -> Any:  # fmt: skip
    body, deadline = read_argument(solid, deadline, cancel)
    check_options(workers, progress, report=report)
    with Budget(deadline, cancel) as budget:
        budget.check()
        value, is_exact = measure(body, what, budget)
    if progress is not None:
        progress(1)
    return (value, Accuracy("exact", 0.5, 1, int(is_exact), int(is_exact), body.type)) if report else value


def measure(solid: Solid, what: str, budget: Budget, where: Where = ("solid",)) -> tuple[Any, bool]:
    """Return `what` (volume, area or centroid) of a solid, the nearest double, and whether integers decided the
    rounding."""
    measures = row_of(solid).volumes
    method = getattr(measures, what, None)
    if method is None:
        raise refused(solid, f"{what} does not take", lambda row: getattr(row.volumes, what, None), "", where)
    if what == "volume" and solid.dimension == 2:
        raise WrongDimensionError("a solid of the plane has no volume; use area", where)
    return method(solid, budget)


def _of_mesh(solid: Polyhedron, budget: Budget, what: str) -> tuple[Any, bool]:
    """Return the volume or centroid (`what`) of a polyhedron, and whether integers decided: not where the bound on the
    kernels' sums proves the rounding."""
    given = boundary(solid, budget)
    triangles = given.triangles
    if len(given.points) > len(solid.vertices):
        if what == "volume":
            return volume_of_cut(given.points, triangles, budget), False
        return np.array([nearest_float(x) for x in centroid_in_fractions(given.points, triangles)]), True
    exponent = exponent_of(solid.vertices)
    points = shifted(solid.vertices, -exponent)
    if points is not None and len(triangles):
        with np.errstate(all="ignore"):
            value = (_volume_of if what == "volume" else _centroid_of)(points, triangles, budget)
            result = None if value is None else np.ldexp(value, 3 * exponent if what == "volume" else exponent)
        budget.check()
        if result is not None and _is_scaled(result, exponent):
            return (float(result) if what == "volume" else result), False
    budget.check()
    mesh = exact_faces(solid.vertices, triangles)
    if what == "volume":
        return nearest_float(exact_volume(mesh)), True
    return np.array([nearest_float(x) for x in exact_centroid(mesh)]), True


def _is_scaled(result: Any, exponent: int) -> bool:
    """Return whether `result`, already multiplied by 2^exponent, is proven not to have been rounded by that: the
    exponent is 0, or all its numbers are normal and finite (a zero may have underflowed: False)."""
    sizes = np.abs(result)
    return bool(exponent == 0 or ((sizes > SMALLEST_NORMAL) & (sizes < np.inf)).all())


def _six_volumes(
    points: FloatArray, triangles: IntArray, z0: float, budget: Budget
) -> tuple[Fraction, Fraction] | None:
    """Return six times the volume, for z measured from z0, and a bound on its error; None where a sum overflows."""
    sums = np.zeros((1, 3))
    entry_of(sum_volume)(read_only(points), triangles, z0, sums, budget.flag)
    return _summed(sums[0], len(triangles))


def _summed(sums: FloatArray, n: int, more: float = 0.0) -> tuple[Fraction, Fraction] | None:
    """Return a sum of n terms, given as (high part, low part, sum of sizes), exactly, and a bound on its
    error, to which `more` is added."""
    h, low, size = sums.tolist()
    bound = bound_of(size, n) + more
    if not isfinite(h + low + bound):
        return None
    return Fraction(h) + Fraction(low), Fraction(bound)


def _rounded(value: Fraction, error: Fraction) -> float | None:
    """Return the double to which value - error and value + error both round, None if they differ."""
    try:
        low, high = nearest_float(value - error), nearest_float(value + error)
    except NotRepresentableError:
        return None
    return low if low == high else None


def _volume_of(points: FloatArray, triangles: IntArray, budget: Budget) -> float | None:
    six = _six_volumes(points, triangles, float(points[triangles[0, 0], 2]), budget)
    return None if six is None else _rounded(six[0] / 6, six[1] / 6)


def _centroid_of(points: FloatArray, triangles: IntArray, budget: Budget) -> FloatArray | None:
    origin = read_only(points[triangles[0, 0]].copy())
    six = _six_volumes(points, triangles, float(origin[2]), budget)
    if six is None or not six[1] < six[0]:
        return None
    (v, v_bound), sums, made = six, np.zeros((3, 3)), []
    entry_of(sum_moments)(read_only(points), triangles, origin, sums, budget.flag)
    for k in range(3):
        moment = _summed(sums[k], len(triangles))
        if moment is None:
            return None
        factor = 8 if k == 2 else 4
        share = moment[0] / (factor * v)
        error = (moment[1] + abs(share) * factor * v_bound) / (factor * (v - v_bound))
        value = _rounded(share + Fraction(float(origin[k])), error)
        if value is None:
            return None
        made.append(value)
    return np.array(made)


def _area_of_mesh(solid: Mesh, budget: Budget) -> tuple[float, bool]:
    triangles = read_only(solid.triangles)
    if isinstance(solid, Polyhedron):
        all_points, triangles = surface(solid, budget)
        if len(all_points) > len(solid.vertices):
            return area_of_cut(all_points, triangles, budget), False
    exponent = exponent_of(solid.vertices)
    points = shifted(solid.vertices, -exponent)
    if points is not None:
        sums = np.zeros((1, 3))
        with np.errstate(all="ignore"):
            entry_of(sum_area)(read_only(points), triangles, sums, budget.flag)
            budget.check()
            n = len(triangles)
            twice = _summed(sums[0], n, n * LOST_TO_ROOTS)
            half = None if twice is None else _rounded(twice[0] / 2, twice[1] / 2)
            result = None if half is None else float(np.ldexp(half, 2 * exponent))
        if result is not None and _is_scaled(result, exponent):
            return result, False
    budget.check()
    return nearest_area(exact_faces(solid.vertices, triangles)), True


MESH: Final = Measures(
    lambda solid, budget: _of_mesh(solid, budget, "volume"), _area_of_mesh,
    lambda solid, budget: _of_mesh(solid, budget, "centroid"),
)  # fmt: skip
SURFACE: Final = Measures(area=_area_of_mesh)
"""Cells of the table of solids (`engine/registry.py`)."""
