"""Public: volume, area and centroid of a solid, each the double nearest to the exact value for the numbers given."""

from __future__ import annotations

from typing import Any, Final

from engine.errors import WrongDimensionError
from engine.running.budget import Budget, Cancel
from engine.running.parallel import Progress, check_options
from engine.solid_cutting.boundary import boundary, points_of, surface
from engine.solid_cutting.cut_measures import nearest_area, nearest_centroid, nearest_volume
from engine.solid_cutting.exact_measures import Measures
from engine.solids.accepted import SolidLike
from engine.solids.base import Solid
from engine.solids.mesh import Mesh, Polyhedron
from engine.solids.registry import Where, refused, row_of
from engine.solids.shapes import read_argument
from engine.types import Accuracy, FloatArray


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
    with Budget(deadline, cancel, workers) as budget:
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


def _volume_of_mesh(solid: Polyhedron, budget: Budget) -> tuple[float, bool]:
    given = boundary(solid, budget)
    return nearest_volume(given.points, given.triangles, budget)


def _area_of_mesh(solid: Mesh, budget: Budget) -> tuple[float, bool]:
    made = surface(solid, budget) if isinstance(solid, Polyhedron) else (points_of(solid), solid.triangles)
    return nearest_area(*made, budget)


def _centroid_of_mesh(solid: Polyhedron, budget: Budget) -> tuple[FloatArray, bool]:
    given = boundary(solid, budget)
    return nearest_centroid(given.points, given.triangles, budget)


MESH: Final = Measures(_volume_of_mesh, _area_of_mesh, _centroid_of_mesh)
SURFACE: Final = Measures(area=_area_of_mesh)
"""Cells of the table of solids (`engine/registry.py`)."""
