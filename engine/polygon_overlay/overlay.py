"""Polygon on polygon: intersection, union, difference and symmetric difference, concave on concave, with holes.

    subject + clip  ->  arrangement  ->  faces with two labels  ->  selected faces  ->  rings  ->  doubles
        (floats)         (exact)             (exact)                 (a table)      (exact)    (rounded, made valid)

All rings of both polygons are noded. Each face of that arrangement lies in the subject or not, in the clip or not
(even-odd over the polygon's rings); the operation is a table over these two labels. Edges between a selected face and
another bound the result. Decisions end there: rounding only moves vertices, and where it would make rings invalid the
rounded rings are arranged once more (in_integers.py).

Sources: the textbook's exercise on clipping a polygon by a concave one; exact arrangements as in D. Halperin and
M. Sharir, Arrangements, Handbook of Discrete and Computational Geometry, 2018.

The union of any number of polygons, and rings under a fill rule: one exact arrangement of all rings. A union pair by
pair would node edges repeatedly, and round crossings of crossings. Here all rings are noded once; the sources or the
winding number of each face are propagated over all faces (compiled/ring_nesting.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal, Unpack, cast, overload

import numpy as np

from engine.errors import InvalidOperationError, UnsupportedSolidError
from engine.polygon_overlay.compiled.loading import RingArrays
from engine.polygon_overlay.compiled.ring_nesting import Nesting, Rule
from engine.polygon_overlay.coverage import union_of_coverage
from engine.polygon_overlay.grid import from_units, grid_of
from engine.polygon_overlay.hidden import without_hidden
from engine.polygon_overlay.implicit_rings import NO_RINGS, one_polygon
from engine.polygon_overlay.in_integers import overlay_exactly
from engine.polygon_overlay.pair_arrays import PolygonArrays, polygon_arrays_of
from engine.polygon_overlay.result import Overlay, OverlayOptions
from engine.polygon_overlay.run import (
    SELECTED,
    SELECTED_ARRAYS,
    UNNAMED,
    Operation,
    overlay_compiled,
    overlay_few,
    rebuild_from_rounded_rings,
)
from engine.polygon_overlay.stripes import union_by_stripes
from engine.running.budget import Budget, Cancel, reading
from engine.running.parallel import Progress, check_options, is_unlimited
from engine.solids.accepted import SolidLike, SolidsLike
from engine.solids.base import Solid
from engine.solids.checks import shown
from engine.solids.polygon import Polygon
from engine.solids.shapes import as_solid, as_solids
from engine.types import Accuracy


@overload
def overlay(
    subject: SolidLike,
    clip: SolidLike,
    operation: Operation = ...,
    *,
    report: Literal[False] = False,
    **options: Unpack[OverlayOptions],
) -> Overlay: ...
@overload
def overlay(
    subject: SolidLike,
    clip: SolidLike,
    operation: Operation = ...,
    *,
    report: Literal[True],
    **options: Unpack[OverlayOptions],
) -> tuple[Overlay, Accuracy]: ...
def overlay(
    subject: SolidLike,
    clip: SolidLike,
    operation: Operation = "intersection",
    *,
    grid: float | None = None,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Overlay | tuple[Overlay, Accuracy]:
    """Combine two polygons; the result is separate pieces with holes.

    Parameters
    ----------
    subject, clip : Polygon
        Even-odd over all rings, which may cross, touch, overlap, repeat or have no area.
    operation : {"intersection", "union", "difference", "symmetric_difference"}
        "difference" is the subject without the clip.
    grid : float, optional
        Snap the result to multiples of a power of two or ten (the doubles nearest to these), so that borders that
        nearly coincide do. No edge moves by more than 0.71 of it and a unit in the last place; with it `area` is the
        output's, counts and `collapsed` go from the overlay before it to the output.
    workers : int, optional
        Accepted and not used: one overlay runs in one thread.
    deadline, cancel, report
        As for `locate`.
    progress : callable, optional
        Called with 1 at the end.

    Returns
    -------
    Overlay
        Simple rings that cross nowhere, holes inside their shells. With ``report=True`` a pair of it and an `Accuracy`,
        whose items are the edges of the input, and whose coordinates_ulp is 0.5 unless vertices were moved to keep
        rings valid: then it is the largest displacement in units in the last place of the largest coordinate.

    Raises
    ------
    UnsupportedSolidError, InvalidOperationError
        For a solid that is no polygon, an unknown operation or grid.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    An exact arrangement of both boundaries. For a convex region, a connected result and 3D there is `clip_polygons`.

    Boundary: pieces are the connected parts of the open interior. Parts that meet in one point are separate, a hole
    that touches its shell in a point stays a hole; walls between parts, spikes and shared edges vanish.

    Degenerate input: rings without area add nothing; an empty result has no pieces. Vertices on a straight stretch of
    the result's boundary are left out unless rings meet there, so equal point sets give equal rings.

    Accuracy: topology, counts and area are those of exact arithmetic for every finite input. Rounding may move, join,
    part or lose pieces: the result reports which (`collapsed`, `pieces_joined`, ...) and how far edges moved.

    Cost: n log n for n edges, plus pairs of edges whose boxes overlap, plus about a microsecond per crossing; twice
    that and more where rounding comes near other edges; some 10 us per edge and crossing where exponents lie further
    than 2^240 apart; some 0.2 ms per vertex where twelve rounds of rounding do not end. An edge costs 27 to 40 ns, one
    of a stretch of a large ring that is near nothing 3 to 5; a call costs 4 us besides, which `overlay_batch` spares,
    and up to as much again where fields of a small result are read first.

    References
    ----------
    Halperin, Sharir, Arrangements, Handbook of Discrete and Computational Geometry, 2018; Hobby, Practical segment
    intersection with finite precision output, 1999.

    Examples
    --------
    >>> from engine import Polygon, overlay
    >>> result = overlay(Polygon([[(0, 0), (4, 0), (4, 4), (0, 4)]]), Polygon([[(2, 2), (6, 2), (6, 6), (2, 6)]]))
    >>> result.area, result.pieces[0].shell.tolist()
    (4.0, [[2.0, 2.0], [4.0, 2.0], [4.0, 4.0], [2.0, 4.0]])
    """
    if type(subject) is Polygon and type(clip) is Polygon and report is False and grid is None:
        selected = SELECTED_ARRAYS.get(operation) if isinstance(operation, str) else None
        if selected is not None and is_unlimited(workers, deadline, cancel, progress):
            few = overlay_few(subject, clip, selected)
            if few is not None:
                return few
    check_operation(operation)
    check_options(workers, progress, report=report)
    with reading(deadline, cancel) as budget:
        first, second = (rings_of(as_solid(each, name), name) for each, name in ((subject, "subject"), (clip, "clip")))
        result, n_exact, n_rational = overlay_rings(first, second, operation, budget, UNNAMED, grid)
    if progress is not None:
        progress(1)
    if not report:
        return result
    n_edges = len(first.vertices) + len(second.vertices)
    return result, accuracy_of(ulps_moved(result), n_edges, n_exact, n_rational)


def check_operation(operation: str) -> None:
    if not isinstance(operation, str) or operation not in SELECTED:
        raise InvalidOperationError(
            f"operation must be one of {', '.join(SELECTED)}; got {shown(operation)}", ("operation",)
        )


def polygons_in(solids: SolidsLike, name: str) -> tuple[Solid, ...]:
    """Return polygons as a tuple, other shapes read (`as_solids`). name: of the argument, for errors. Raises
    UnsupportedSolidError for what is no polygon, with its index."""
    given = tuple(solids) if isinstance(solids, (list, tuple)) else ()
    if given and set(map(type, given)) == {Polygon}:
        return given
    read = tuple(as_solids(given or solids, name))
    for k, each in enumerate(read):
        rings_of(each, name, k)
    return read


def rings_of(solid: object, *where: str | int) -> RingArrays:
    """Return the rings of a polygon. where: the path of the argument, for errors. Raises UnsupportedSolidError for
    anything else."""
    if not isinstance(solid, Polygon):
        kind = solid.type if isinstance(solid, Solid) else type(solid).__name__
        raise UnsupportedSolidError(
            f"overlay takes polygons (2D), got {kind!r}; give its outline as a polygon, or use clip_polygons to cut "
            "polygons by a half_space, aabb or convex",
            where,
        )
    return RingArrays(solid.vertices, solid.ring_offsets)


def overlay_rings(
    subject: RingArrays, clip: RingArrays, operation: Operation, budget: Budget, nesting: Nesting = UNNAMED,
    grid: float | None = None, workers: int | None = 1,
) -> tuple[Overlay, int, int]:  # fmt: skip
    """Return the overlay of checked rings (either side may be empty), the number of edge pairs decided exactly, and of
    those decided in rationals. nesting: of the subject's rings, for a rule other than even-odd; then there is no clip,
    and the operation is "union". grid: spacing to which the result is snapped. workers: of large unions."""
    units = None if grid is None else grid_of(grid)
    first, second = subject, clip
    if units is not None:
        first = RingArrays(units.to_units(subject.vertices), subject.offsets)
        second = RingArrays(units.to_units(clip.vertices), clip.offsets)
    made = union_by_stripes(first, nesting, workers, budget) if nesting.rule == Rule.ANY else None
    compiled = overlay_compiled(first, second, operation, budget, nesting, units, made)
    if compiled is not None:
        result, n_exact, n_rational = *compiled, 0
    else:
        result, n_exact = overlay_exactly(first, second, operation, budget, nesting, units is not None)
        n_rational = n_exact
        if units is not None:
            result = from_units(result, units, len(subject.vertices), rebuild_from_rounded_rings, budget)
    if result._lost is not None and budget.deadline is not None:  # who set one waits no longer for what was lost
        vars(result)["collapsed"] = result._lost.parts(budget)
    return result, n_exact, n_rational


def ulps_moved(result: Overlay) -> float:
    """Return the largest displacement of a vertex, in ulps of the largest coordinate; at least 0.5."""
    if not result.vertices_moved:
        return 0.5
    return max(0.5, result.largest_displacement / float(np.spacing(np.abs(result.vertices).max())))


def accuracy_of(ulps: float, n_edges: int, n_exact: int, n_rational: int) -> Accuracy:
    """Return the accuracy report of one or many overlays. ulps: the largest displacement, in units in the last place;
    n_exact, n_rational: edge pairs decided exactly, and in rationals."""
    return Accuracy(
        decisions="exact", coordinates_ulp=ulps, n_items=n_edges, n_beyond_filter=n_exact, n_rational=n_rational,
        method="arrangement",
    )  # fmt: skip


FillRule = Literal["non_zero", "positive", "negative"]
_RULES: Final = {"non_zero": Rule.NON_ZERO, "positive": Rule.POSITIVE, "negative": Rule.NEGATIVE}


@overload
def union_all(
    polygons: SolidsLike, *, report: Literal[False] = False, **options: Unpack[OverlayOptions]
) -> Overlay: ...
@overload
def union_all(
    polygons: SolidsLike, *, report: Literal[True], **options: Unpack[OverlayOptions]
) -> tuple[Overlay, Accuracy]: ...
def union_all(
    polygons: SolidsLike,
    *,
    grid: float | None = None,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Overlay | tuple[Overlay, Accuracy]:
    """Unite any number of polygons, each even-odd within itself.

    Parameters
    ----------
    polygons : sequence of Polygon
        None at all, or some without rings, unite to nothing.
    grid : float, optional
        As for `overlay`.
    workers : int, optional
        As for `locate`; one thread works on fewer than 400,000 vertices.
    deadline, cancel, progress, report
        As for `overlay`.

    Returns
    -------
    Overlay
        Its `sources` are places in the list. With ``report=True`` a pair of it and an `Accuracy`, as of `overlay`.

    Raises
    ------
    UnsupportedSolidError, InvalidArrayError, InvalidOperationError
        For a solid that is no polygon, or a wrong grid.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    Boundary, degenerate input, accuracy: as of `overlay`, whose union this is for two polygons. Borders that polygons
    share vanish where they are one line exactly; `grid` makes them so.

    Cost: n log n for n edges in all, plus about a microsecond per crossing: 1,000 circles of 64 vertices 11 ms, 14,400
    parcels that share all their edges 10 ms; polygons that 160 others meet are united by groups first: 1,000
    circles of 32 vertices about one place 40 ms.

    References
    ----------
    As `overlay`.

    Examples
    --------
    >>> from engine import Polygon, union_all
    >>> squares = [Polygon([[(x, 0), (x + 1, 0), (x + 1, 1), (x, 1)]]) for x in range(3)]
    >>> union_all(squares).pieces[0].shell.tolist()
    [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]]
    """
    check_options(workers, progress, report=report)
    with Budget(deadline, cancel, workers) as budget:
        result, accuracy = _arrange_all(polygons, Rule.ANY, budget, grid, workers)
    if progress is not None:
        progress(1)
    return (result, accuracy) if report else result


def less_all(subject: Polygon, clips: Sequence[Polygon], budget: Budget) -> tuple[Overlay, Accuracy]:
    """Return a polygon with at least one ring, minus the union of others."""
    return _arrange_all([subject, *clips], Rule.FIRST_ALONE, budget)


def filled(rings: object, rule: FillRule, *, deadline: float | None = None, cancel: Cancel | None = None) -> Polygon:
    """Return what rings enclose under a fill rule of drawings, as a `Polygon`, which is even-odd.

    Parameters
    ----------
    rings : sequence of rings
        As those of `Polygon`.
    rule : {"non_zero", "positive", "negative"}
        Which winding numbers are inside.
    deadline, cancel
        As for `locate`.

    Returns
    -------
    Polygon
        Simple rings that cross nowhere, shells counter-clockwise, holes clockwise; no rings where nothing is enclosed.

    Raises
    ------
    InvalidOperationError
        The rule is unknown.
    EngineError
        As `Polygon`.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    A winding number counts how often rings run around a point counter-clockwise, less how often clockwise. Points
    without area (spikes, rings there and back) are left out.

    Accuracy: decisions exact; crossings are rounded as those of `overlay`. Cost: that of `union_all`.

    References
    ----------
    Hormann, Agathos, The point in polygon problem for arbitrary polygons, 2001.

    Examples
    --------
    >>> from engine import Polygon, filled
    >>> twice = [[(0, 0), (2, 0), (2, 2), (0, 2)], [(1, 1), (3, 1), (3, 3), (1, 3)]]
    >>> Polygon(twice).n_rings, filled(twice, "non_zero").n_rings, filled(twice, "negative").n_rings
    (2, 1, 0)
    """
    if not isinstance(rule, str) or rule not in _RULES:
        raise InvalidOperationError(f"rule must be one of {', '.join(_RULES)}; got {shown(rule)}", ("rule",))
    given = rings_of(Polygon(rings))
    nesting = Nesting(np.zeros(len(given.offsets) - 1, np.int64), np.zeros(0), int(_RULES[rule]))
    with Budget(deadline, cancel) as budget:
        result, _, _ = overlay_rings(given, NO_RINGS, "union", budget, nesting)
    return Polygon(result.rings)


def _arrange_all(
    polygons: SolidsLike, rule: Rule, budget: Budget, grid: float | None = None, workers: int | None = 1
) -> tuple[Overlay, Accuracy]:
    """Return the overlay of the rings of all polygons by a fill rule, each polygon a source of its own, and the
    accuracy report. grid: spacing to which the result is snapped."""
    each = cast("Sequence[Polygon]", polygons_in(polygons, "polygons"))
    flat = polygon_arrays_of(each) if each else PolygonArrays(*NO_RINGS, one_polygon(0))
    n, joined = len(flat.vertices), union_of_coverage(flat, budget) if rule == Rule.ANY and grid is None else None
    if joined is not None:
        result, n_exact, n_rational = *joined, 0
    else:
        if rule == Rule.ANY:
            flat = without_hidden(flat.without_repeats(), budget)  # of repeats each pair of edges would be one contact
        n_rings = np.diff(flat.polygon_offsets)  # polygons without rings have no number: a ring's is at least its own
        nesting = Nesting(np.repeat(np.cumsum(n_rings > 0) - 1, n_rings), np.zeros(0), int(rule))
        rings = RingArrays(*flat[:2])
        result, n_exact, n_rational = overlay_rings(rings, NO_RINGS, "union", budget, nesting, grid, workers)
    object.__setattr__(result, "_starts", flat.ring_offsets[flat.polygon_offsets[1:-1]])
    return result, accuracy_of(ulps_moved(result), n, n_exact, n_rational)
