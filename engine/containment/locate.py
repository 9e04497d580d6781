"""Public: where points lie with respect to one solid.

`locate` checks the arguments, cuts the batch into chunks and makes the report; locators.py has the table of methods.

Fast path for small batches without options: it calls the compiled kernel directly, with cached arguments. The general
path costs some 15 us before the first decision (budget, chunks, dispatch on types). A `Plan` names the compiled code
and its arguments and checks no types, so points are first brought to the type that the kernel was compiled for.
"""

from __future__ import annotations

from typing import Any, Final, Literal, TypeAlias, Unpack, overload

import numpy as np

from engine.compiling.jit import entry_of
from engine.containment.locators import Locator, exact_fallback, locator_of, polygon_by, polyhedron_by, settle
from engine.containment.methods.filters import NOT_FINITE
from engine.containment.methods.rational_locate import is_located
from engine.containment.policy import Choice, choose_for_mesh, choose_for_rings
from engine.errors import NotFiniteError
from engine.running.budget import UNLIMITED, Budget, Cancel, reading
from engine.running.parallel import Options, Progress, check_options, is_unlimited, run_chunks
from engine.solids.accepted import PointsLike, SolidLike
from engine.solids.base import Solid
from engine.solids.checks import DOUBLE, as_points, check_finite, plain_floats
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.registry import row_of
from engine.solids.shapes import as_solid
from engine.types import UNDECIDED, Accuracy, BoolArray, FloatArray, Int8Array

SMALL_BATCH: Final = 1024
"""Largest number of points of the fast path: more are a chunk of the general path."""
_SMALL: Final = 32
"""Number of edges up to which a polygon is always decided in one pass over its edges, however many points there are."""
_NO_FLAG: Final = np.zeros(1, np.uint8)
_KEYS: Final = {Choice.PASS: "pass_plan", Choice.LISTS: "list_plan", Choice.CELLS: "plan"}

Plan: TypeAlias = tuple[Any, tuple[Any, ...], str]
"""(compiled kernel, its arguments between points and locations, name of the method for `Accuracy.method`)."""
Located: TypeAlias = tuple[Int8Array, int, int, str]
"""(locations (n,) int8, number of points that the filter left open, number decided in rationals, name of the method).
"""


def locate_small_batch(points: object, solid: object) -> Located | None:
    """Return the locations of a small batch on the fast path, and counts; None where the general path must be taken.
    Raises as `locate` does."""
    if not isinstance(solid, Solid):
        return None
    array: Any = points
    if (  # as `is_ready` tells: a call of it would be a tenth of all
        type(array) is not np.ndarray
        or array.dtype is not DOUBLE
        or array.ndim != 2
        or array.shape[1] != solid.dimension
        or not array.flags.carray
    ):
        if not isinstance(points, (np.ndarray, list, tuple)) or getattr(points, "ndim", 1) == 0:
            return None
        if not 0 < len(points) <= SMALL_BATCH:
            return None
        if not is_located(row_of(solid)):
            return None
        plain = None if isinstance(points, np.ndarray) else plain_floats(points, 2)
        if plain is not None and plain.shape[1] == solid.dimension:
            array = plain
        else:
            array = as_points(points, solid.dimension, must_be_finite=False)
    n_points = len(array)
    if not 0 < n_points <= SMALL_BATCH:
        return None
    plan = solid.cached("plan")
    if plan is None:
        plan = _plan_of(solid, n_points)
        if plan is None:
            return None
    entry, prepared, method = plan
    locations = np.empty(n_points, np.int8)
    n_beyond = entry(array, *prepared, locations, _NO_FLAG)
    return (
        (locations, 0, 0, method) if n_beyond == 0 else _with_exact_fallback(array, solid, locations, n_beyond, method)
    )


def _with_exact_fallback(array: FloatArray, solid: Solid, locations: Int8Array, n_beyond: int, method: str) -> Located:
    if n_beyond == NOT_FINITE:
        check_finite(array, ("points",))
    rest = np.flatnonzero(locations == UNDECIDED)
    return locations, n_beyond, settle(exact_fallback(solid), array, locations, rest, UNLIMITED), method


def _plan_of(solid: Solid, n_points: int) -> Plan | None:
    """Return the `Plan` of a solid (compiled kernel and its arguments) for a batch of `n_points`, made at first use;
    None if `policy.py` chooses cells, or if the kernel is not compiled yet."""
    if isinstance(solid, Polygon) and len(solid.vertices) <= _SMALL:
        return _cached_plan(solid, "plan", polygon_by(solid, Choice.PASS, UNLIMITED))
    if isinstance(solid, Polygon):
        choice = choose_for_rings(solid, n_points)
        return solid.cached(_KEYS[choice]) or _cached_plan(solid, _KEYS[choice], polygon_by(solid, choice, UNLIMITED))
    if isinstance(solid, Polyhedron):
        choice = choose_for_mesh(solid, n_points)
        if choice == Choice.CELLS:
            return None
        return solid.cached(_KEYS[choice]) or _cached_plan(
            solid, _KEYS[choice], polyhedron_by(solid, choice, UNLIMITED)
        )
    return _cached_plan(solid, "plan", locator_of(solid).chosen(n_points, UNLIMITED))


def _cached_plan(solid: Solid, key: str, locator: Locator) -> Plan | None:
    if not locator.direct:
        return None
    kernel, *prepared = locator.direct
    entry = entry_of(kernel)
    if entry is kernel:
        return None
    plan: Plan = entry, tuple(prepared), locator.method
    return solid.prepared(key, lambda: plan)


@overload
def locate(
    points: PointsLike, solid: SolidLike, *, report: Literal[False] = False, **options: Unpack[Options]
) -> Int8Array: ...
@overload
def locate(
    points: PointsLike, solid: SolidLike, *, report: Literal[True], **options: Unpack[Options]
) -> tuple[Int8Array, Accuracy]: ...
def locate(
    points: PointsLike,
    solid: SolidLike,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Int8Array | tuple[Int8Array, Accuracy]:
    """Locate points in a solid: `Location` INSIDE 1, BOUNDARY 0 or OUTSIDE -1 for each.

    Parameters
    ----------
    points : array_like, shape (n_points, dimension)
        Floats or integers, or nested lists; borrowed, and may be empty.
    solid : Solid
        Any type but a surface, of the same dimension.
    workers : int, optional
        Threads; one a core by default.
    deadline : float, optional
        Seconds; after them the call ends with `DeadlineExceededError`.
    cancel : Cancel, optional
        A switch with which another thread ends the call.
    progress : callable, optional
        Called with the number of points done since the last call.
    report : bool, default False
        Also return an `Accuracy`.

    Returns
    -------
    ndarray of int8, shape (n_points,)
        With ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError, UnsupportedSolidError
        For arguments that break a rule; the message names the element.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    Methods: polygons and polyhedra by ray parity, convex solids by the signs of their planes, spheres by squared
    distance, implicit solids by the sign of their polynomial, CSG trees by max, min and min(A, -B) of their leaves.

    Boundary: BOUNDARY on any face or edge, even on one that another cancels under even-odd, and where both operands of
    a CSG node have their boundary.

    Degenerate input: zero-area faces and zero-length edges count for BOUNDARY only. A box with min = max, a sphere of
    radius 0 and a plane triangle without area are all boundary; the prism over a triangle of space without area is all
    of space, all of it BOUNDARY, as the formula gives it.

    Accuracy: exact for every finite input; an implicit solid made from a callable is decided by that callable.

    Cost: a small batch passes once over the faces, with nothing prepared. Larger ones have lists of faces built once,
    linear in the solid's size; a point then costs some of the faces near it.

    For many solids at once use `locate_scene`.

    References
    ----------
    The textbook, section 22.4.1; docs/algorithms.md has the paper of each method.

    Examples
    --------
    >>> from engine import Aabb, locate
    >>> locate([[0.5, 0.5], [1.0, 0.2], [2.0, 2.0]], Aabb([0, 0], [1, 1])).tolist()
    [1, 0, -1]
    """
    if isinstance(report, bool) and is_unlimited(workers, deadline, cancel, progress):
        batch = locate_small_batch(points, solid)
        if batch is not None:
            return (batch[0], Accuracy("exact", None, len(batch[0]), *batch[1:])) if report else batch[0]
    check_options(workers, progress, report=report)
    with reading(deadline, cancel) as reader:
        solid = as_solid(solid, "solid")
        choice = locator_of(solid)
        array = as_points(points, solid.dimension, must_be_finite=False)
    deadline, locations = reader.left(), np.empty(len(array), np.int8)
    beyond, rational = [], []
    with Budget(deadline, cancel, workers) as budget:
        budget.check()
        locator = choice.chosen(len(array), budget)

        def task(start: int, stop: int) -> None:
            if locator.decisions != "exact":
                check_finite(array[start:stop], ("points",))
            counts = locator.fill(array[start:stop], locations[start:stop], budget)
            beyond.append(counts.beyond)
            rational.append(counts.rational)

        try:
            first = len(array) if locator.is_long else SMALL_BATCH
            run_chunks(task, len(array), budget=budget, first_chunk=first, workers=workers, progress=progress)
        except NotFiniteError:
            check_finite(array, ("points",))  # names the first of all
            raise
    if not report:
        return locations
    return locations, Accuracy(locator.decisions, None, len(array), sum(beyond), sum(rational), locator.method)


@overload
def contains(
    points: PointsLike, solid: SolidLike, *, report: Literal[False] = False, **options: Unpack[Options]
) -> BoolArray: ...
@overload
def contains(
    points: PointsLike, solid: SolidLike, *, report: Literal[True], **options: Unpack[Options]
) -> tuple[BoolArray, Accuracy]: ...
def contains(
    points: PointsLike,
    solid: SolidLike,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> BoolArray | tuple[BoolArray, Accuracy]:
    """Return for each point whether a solid, a closed set, contains it: `locate` is INSIDE or BOUNDARY.

    Parameters
    ----------
    points, solid, workers, deadline, cancel, progress, report
        As for `locate`.

    Returns
    -------
    ndarray of bool, shape (n_points,)
        With ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    EngineError
        As `locate`.

    Notes
    -----
    Boundary, degenerate input, accuracy and cost are those of `locate`.

    References
    ----------
    The textbook, section 22.4.1.

    Examples
    --------
    >>> from engine import Sphere, contains
    >>> contains([[3.0, 4.0], [3.1, 4.0]], Sphere([0, 0], 5)).tolist()
    [True, False]
    """
    options = {"workers": workers, "deadline": deadline, "cancel": cancel, "progress": progress, "report": report}
    result: Any = locate(points, solid, **options)  # type: ignore[call-overload]
    return (result[0] >= 0, result[1]) if report else result >= 0
