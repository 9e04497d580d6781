"""Public: pairs of triangles in batches, solids of the plane and surfaces in space.

In the plane orient2d alone decides. Two convex polygons without a common point have an edge of one of them with all of
the other strictly outside (the normals of their Minkowski difference are those of their edges). So nine signs for each
triangle decide: an edge with the other strictly outside: disjoint; all nine positive: the other is inside; an edge with
the other outside or on it: the interiors are apart, the triangles touch; else they overlap. A triangle without area is
a segment or a point without interior. Its edges run along its line both ways, so either side of the line may be the
outside; two on one line have a common point if their boxes have.

Source: the textbook's exercise 22.4-5; separating axis test after S. Gottschalk et al., OBBTree, 1996, in exact signs.
"""

from __future__ import annotations

import numpy as np

from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, TOUCHING, UNSETTLED
from engine.collision.meshes.exact_body import classify_exact
from engine.collision.meshes.mesh_arrays import NO_AREA, UNKNOWN_AXIS, axis_of
from engine.collision.meshes.triangle_triangle import APART, Facet, classify, classify_near, facet_at, with_pose
from engine.collision.outline import collide_outline_outline
from engine.collision.result import Work
from engine.compiling.jit import allocating_kernel, inline, kernel, merged
from engine.errors import InvalidArrayError, WrongDimensionError
from engine.predicates.orientation import orient2d
from engine.predicates.rational import scaled_integers
from engine.predicates.vectors import as_point2
from engine.running.budget import Budget, Cancel
from engine.running.parallel import Progress, check_options, run_chunks
from engine.solids.checks import as_point_groups
from engine.solids.primitives import Triangle
from engine.types import UNDECIDED, Accuracy, FloatArray, Int8Array, Point2, Relation


@inline
def as_facet2(t: FloatArray) -> Facet:
    """Return a planar triangle (3, 2) as a `Facet` of three points."""
    return Facet(as_point2(t, 0), as_point2(t, 1), as_point2(t, 2))


@inline
def are_apart_on_axis(p: float, q: float, r: float, s: float, t: float, u: float) -> bool:
    """Return whether the interval spanned by p, q, r and the one spanned by s, t, u are disjoint."""
    return max(p, q, r) < min(s, t, u) or max(s, t, u) < min(p, q, r)


@inline
def are_boxes_apart(t: Facet, u: Facet) -> bool:
    """Return whether the boxes around two triangles are disjoint along x or y."""
    if are_apart_on_axis(t.p.x, t.q.x, t.r.x, u.p.x, u.q.x, u.r.x):
        return True
    return are_apart_on_axis(t.p.y, t.q.y, t.r.y, u.p.y, u.q.y, u.r.y)


@merged
def against_edge(p: Point2, q: Point2, u: Facet) -> int:
    """Return the relation of triangle u to the closed half-plane left of the line from p to q. DISJOINT: u is strictly
    right; SECOND_INSIDE_FIRST: strictly left; TOUCHING: right and on the line; OVERLAPPING: on both sides, or left and
    on it; UNSETTLED."""
    a, b, c = orient2d(p, q, u.p), orient2d(p, q, u.q), orient2d(p, q, u.r)
    if max(a, b, c) == UNDECIDED:
        return UNSETTLED
    if max(a, b, c) < 0:
        return DISJOINT
    if min(a, b, c) > 0:
        return SECOND_INSIDE_FIRST
    return TOUCHING if max(a, b, c) == 0 else OVERLAPPING


@inline
def against_edges(t: Facet, u: Facet) -> int:
    """Return the relation of triangle u to t, counter-clockwise, by the lines of t's edges alone, or UNSETTLED.
    DISJOINT and SECOND_INSIDE_FIRST are final; TOUCHING: the interiors are disjoint; OVERLAPPING: no edge of t
    separates."""
    first = against_edge(t.p, t.q, u)
    if first in (UNSETTLED, DISJOINT):
        return first
    second = against_edge(t.q, t.r, u)
    if second in (UNSETTLED, DISJOINT):
        return second
    third = against_edge(t.r, t.p, u)
    if third in (UNSETTLED, DISJOINT):
        return third
    if first == SECOND_INSIDE_FIRST and second == SECOND_INSIDE_FIRST and third == SECOND_INSIDE_FIRST:
        return SECOND_INSIDE_FIRST
    return TOUCHING if first == TOUCHING or second == TOUCHING or third == TOUCHING else OVERLAPPING


@inline
def relation_of_triangles(t: Facet, u: Facet) -> int:
    """Return the relation of two closed planar triangles, with or without area, or UNSETTLED."""
    if are_boxes_apart(t, u):
        return DISJOINT
    t_turn, u_turn = orient2d(t.p, t.q, t.r), orient2d(u.p, u.q, u.r)
    if t_turn == UNDECIDED or u_turn == UNDECIDED:
        return UNSETTLED
    if t_turn < 0:
        t = Facet(t.p, t.r, t.q)
    if u_turn < 0:
        u = Facet(u.p, u.r, u.q)
    first = against_edges(t, u)
    if first in (UNSETTLED, DISJOINT, SECOND_INSIDE_FIRST):
        return first
    second = against_edges(u, t)
    if second in (UNSETTLED, DISJOINT):
        return second
    if second == SECOND_INSIDE_FIRST:
        return FIRST_INSIDE_SECOND
    have_interiors = t_turn != 0 and u_turn != 0
    return OVERLAPPING if have_interiors and first == OVERLAPPING and second == OVERLAPPING else TOUCHING


@kernel
def relate_triangles_2d(first: FloatArray, second: FloatArray, relations: Int8Array) -> None:
    """Fill relations (n,) int8 (`Relation` codes, or UNSETTLED) for rows i of two arrays (n, 3, 2) float64."""
    for item in range(relations.shape[0]):
        relations[item] = relation_of_triangles(as_facet2(first[item]), as_facet2(second[item]))


@allocating_kernel
def relate_triangles_3d(first: FloatArray, second: FloatArray, relations: Int8Array) -> None:
    """Fill relations (n,) int8 with DISJOINT or TOUCHING for rows i of two arrays (n, 3, 3) float64 of triangles in
    space; UNSETTLED for triangles without area, or if exponents are out of range."""
    poses = np.zeros((1, 12))  # nothing here has one
    for item in range(relations.shape[0]):
        t, u = facet_at(first[item], 0, 1, 2), facet_at(second[item], 0, 1, 2)
        relations[item] = UNSETTLED
        if are_boxes_apart(t, u) or are_apart_on_axis(t.p.z, t.q.z, t.r.z, u.p.z, u.q.z, u.r.z):
            relations[item] = DISJOINT
            continue
        axis, other_axis = axis_of(t), axis_of(u)
        if axis in (NO_AREA, UNKNOWN_AXIS) or other_axis in (NO_AREA, UNKNOWN_AXIS):
            continue
        how = classify_near(t, u, 0.0)
        if how == UNDECIDED:
            how = classify(poses, with_pose(t), with_pose(u), axis, 0.0)
        if how != UNDECIDED:
            relations[item] = DISJOINT if how == APART else TOUCHING


def collide_triangles(
    first: object,
    second: object,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Int8Array | tuple[Int8Array, Accuracy]:
    """Decide how each of many triangles relates to its partner, exactly.

    Parameters
    ----------
    first, second : array_like, shape (n_pairs, 3, d)
        d is 2 or 3; either orientation.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts pairs.

    Returns
    -------
    ndarray of int8, shape (n_pairs,)
        Codes of `Relation`; with ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError
        For arrays that break a rule; the message names the triangle.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    In the plane triangles are solids, with all five relations; in space they are surfaces: disjoint or touching.

    Boundary: one common point is enough to touch.

    Degenerate input: a triangle without area is the segment or point it covers, which has no interior: it may lie
    inside another, and never overlaps.

    Accuracy: exact for all finite input.

    Cost: constant per pair; some 100 us where exponents leave the orientation tests undecided.

    References
    ----------
    Guigue, Devillers, 2003; separating axes after Gottschalk et al., OBBTree, 1996; the textbook, exercise 22.4-5.

    Examples
    --------
    >>> collide_triangles([[[0, 0], [4, 0], [0, 4]]], [[[1, 1], [2, 1], [1, 2]]]).tolist()
    [2]
    """
    check_options(workers, progress, report=report)
    a, b = as_point_groups(first, 3, None, ("first",)), as_point_groups(second, 3, None, ("second",))
    if len(a) != len(b):
        raise InvalidArrayError(f"first and second must be equally many, got {len(a)} and {len(b)}", ("second",))
    if len(a) and a.shape[2] != b.shape[2]:
        raise WrongDimensionError(f"first is {a.shape[2]}D, second {b.shape[2]}D; both need one dimension", ("second",))
    is_planar, relations = a.shape[2] == 2, np.empty(len(a), np.int8)
    n_open: list[int] = []
    with Budget(deadline, cancel) as budget:

        def task(start: int, stop: int) -> None:
            part = relations[start:stop]
            with np.errstate(all="ignore"):  # uncompiled runs only
                (relate_triangles_2d if is_planar else relate_triangles_3d)(a[start:stop], b[start:stop], part)
            still_open = start + np.flatnonzero(part == UNSETTLED)
            n_open.append(len(still_open))
            for item in still_open.tolist():
                budget.check()
                relations[item] = _relate_exactly(a[item], b[item], budget)

        run_chunks(task, len(a), budget=budget, workers=workers, progress=progress)
    if not report:
        return relations
    method = "separating_edges" if is_planar else "orientation_signs"
    return relations, Accuracy("exact", None, len(a), sum(n_open), sum(n_open), method)


def _relate_exactly(t: FloatArray, u: FloatArray, budget: Budget) -> Relation:
    """Return the relation of two triangles (3, d) by integer or rational arithmetic."""
    if t.shape[1] == 2:
        return collide_outline_outline(Triangle(t), Triangle(u), (None, None), Work(budget, witness=False)).relation
    numbers = scaled_integers([*t.ravel().tolist(), *u.ravel().tolist()])
    a, b, c, d, e, f = (tuple(numbers[k : k + 3]) for k in range(0, 18, 3))
    return Relation.DISJOINT if classify_exact((a, b, c), (d, e, f)) == APART else Relation.TOUCHING
