"""Public: where points lie with respect to one solid.

The table of methods is locators.py. Here the arguments are checked, the batch is cut into chunks, and the report made.
"""

from __future__ import annotations

from typing import Any, Literal, Unpack, overload

import numpy as np

from engine.arrays import BoolArray, Int8Array
from engine.containment.at_once import located_at_once
from engine.containment.locators import locator_of
from engine.errors import NotFiniteError
from engine.running.budget import Budget, Cancel
from engine.running.parallel import Options, Progress, check_options, is_unlimited, run_chunks
from engine.solids.base import Solid
from engine.solids.checks import as_points, check_finite
from engine.types import Accuracy


@overload
def locate(
    points: object, solid: Solid, *, report: Literal[False] = False, **options: Unpack[Options]
) -> Int8Array: ...
@overload
def locate(
    points: object, solid: Solid, *, report: Literal[True], **options: Unpack[Options]
) -> tuple[Int8Array, Accuracy]: ...
def locate(
    points: object,
    solid: Solid,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Int8Array | tuple[Int8Array, Accuracy]:
    """Locate points in a solid: `Location` INSIDE 1, BOUNDARY 0 or OUTSIDE -1 for each.

    Polygons and polyhedra by ray and parity, convex solids by their planes, spheres by squared distance, implicit
    solids by the sign of their polynomial, Boolean trees by max, min and min(A, -B) of their leaves. For many solids
    at once use `locate_scene`.

    Parameters
        points: ``(n_points, dimension)`` floats or integers, or nested lists; borrowed. None at all are welcome.
        solid: any but a surface, of the same dimension.
        workers: threads; None for one per core. deadline: seconds; cancel: a switch; progress: called with counts.
        report: True to get an `Accuracy` as well.
    Returns
        ``(n_points,)`` int8; with report=True a pair of it and an `Accuracy`.
    Boundary: BOUNDARY on any face or edge, even on one that another cancels under even-odd; on the on-on case of a
        Boolean combination.
    Degenerate input: zero-area faces and zero-length edges count for BOUNDARY only. A box with min = max and a sphere
        of radius 0 have only boundary, and so has a plane triangle without area; the prism over a triangle of space
        without area is all of space, all of it BOUNDARY, as the formula gives it.
    Accuracy: exact for every finite input; an implicit solid made from a callable is decided by that callable.
    Cost: few points pass once over the faces, with nothing prepared; many have lists built, linear in the solid's
        size, after which a point costs some of the faces near it or over it.
    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError, UnsupportedSolidError, DeadlineExceededError,
        CancelledError.
    Source: the textbook's section on containment; see the modules of the methods.

    >>> from engine import Aabb, locate
    >>> locate([[0.5, 0.5], [1.0, 0.2], [2.0, 2.0]], Aabb([0, 0], [1, 1])).tolist()
    [1, 0, -1]
    """
    if isinstance(report, bool) and is_unlimited(workers, deadline, cancel, progress):
        found = located_at_once(points, solid)
        if found is not None:
            return (found[0], Accuracy("exact", None, len(found[0]), *found[1:])) if report else found[0]
    check_options(workers, progress, report=report)
    choice = locator_of(solid)
    array = as_points(points, solid.dimension, must_be_finite=False)
    locations = np.empty(len(array), np.int8)
    beyond, rational = [], []
    with Budget(deadline, cancel) as budget:
        budget.check()
        locator = choice.chosen(len(array), budget)

        def task(start: int, stop: int) -> None:
            if locator.decisions != "exact":
                check_finite(array[start:stop], ("points",))
            counts = locator.fill(array[start:stop], locations[start:stop], budget)
            beyond.append(counts.beyond)
            rational.append(counts.rational)

        try:
            run_chunks(task, len(array), budget=budget, workers=workers, progress=progress)
        except NotFiniteError:
            check_finite(array, ("points",))  # names the first of all
            raise
    if not report:
        return locations
    return locations, Accuracy(locator.decisions, None, len(array), sum(beyond), sum(rational), locator.method)


@overload
def contains(
    points: object, solid: Solid, *, report: Literal[False] = False, **options: Unpack[Options]
) -> BoolArray: ...
@overload
def contains(
    points: object, solid: Solid, *, report: Literal[True], **options: Unpack[Options]
) -> tuple[BoolArray, Accuracy]: ...
def contains(
    points: object,
    solid: Solid,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> BoolArray | tuple[BoolArray, Accuracy]:
    """Tell for each point whether a solid, a closed set, holds it: `locate` is INSIDE or BOUNDARY.

    Parameters, cost, accuracy and errors are those of `locate`.

    Returns
        ``(n_points,)`` bool; with report=True a pair of it and an `Accuracy`.

    >>> from engine import Sphere, contains
    >>> contains([[3.0, 4.0], [3.1, 4.0]], Sphere([0, 0], 5)).tolist()
    [True, False]
    """
    options = {"workers": workers, "deadline": deadline, "cancel": cancel, "progress": progress, "report": report}
    found: Any = locate(points, solid, **options)  # type: ignore[call-overload]
    return (found[0] >= 0, found[1]) if report else found >= 0
