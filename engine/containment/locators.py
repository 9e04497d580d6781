"""The table of point location methods that the rows of the registry name: a `Locator` for each type of solid.

A `Locator` fills an int8 location for each point of a chunk: a compiled filter kernel leaves UNDECIDED what is out of
its range, the exact fallback in rationals decides those points. Structures are prepared once a solid.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np

from engine.containment.cells.build import cells_of
from engine.containment.cells.locate import locate_by_cells
from engine.containment.methods.filters import NOT_FINITE, locate_by_polynomial, locate_in_ball, locate_in_box
from engine.containment.methods.half_spaces import locate_in_half_spaces
from engine.containment.methods.polygon_ray_parity import locate_in_rings
from engine.containment.methods.polyhedron_one_pass import locate_by_pass
from engine.containment.methods.polyhedron_ray_parity import locate_by_tree
from engine.containment.methods.rational_locate import (
    combine,
    fold_csg_tree,
    is_located,
    rational_location,
    unsupported,
)
from engine.containment.policy import LONG_PASS, Choice, choose_for_mesh, choose_for_rings
from engine.containment.prepared import EXACT, edges_of, prism_rows, ring_cells_of, rings_of, tree_of
from engine.errors import InvalidArrayError, NotFiniteError
from engine.running.budget import Budget
from engine.solids.base import Solid
from engine.solids.csg import Csg
from engine.solids.implicit import Implicit
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.pose import Pose
from engine.solids.primitives import Aabb, Convex, HalfSpace, Sphere, Triangle, rows_of
from engine.solids.registry import row_of
from engine.types import UNDECIDED, FloatArray, Int8Array, IntArray, read_only

Fill = Callable[[FloatArray, Int8Array, Budget], "Counts"]


class Counts(NamedTuple):
    """Counts of a chunk of points. beyond: how many the filter left open; rational: how many rationals decided."""

    beyond: int
    rational: int


class Locator(NamedTuple):
    """A point location method for one solid."""

    method: str
    """Stable short name, for `Accuracy.method`."""
    fill: Fill
    """Locates the points (n, dim) of a chunk into int8 (n,). Raises NotFiniteError unless a callable decides."""
    decisions: Literal["exact", "float64"] = "exact"
    for_batch: Callable[[int, Budget], Locator] | None = None
    """Returns the locator for a number of points, where the choice depends on that number; may build a structure."""
    direct: tuple[Any, ...] = ()
    """(kernel, its arguments between points and locations), where the locator is that kernel with its exact fallback
    only; else ()."""
    is_long: bool = False
    """Whether a call takes long however few points there are, so that a batch should not be cut into chunks."""

    def chosen(self, n_points: int, budget: Budget) -> Locator:
        """Return the locator for a batch of `n_points` points: one by a structure that pays for so many, or self."""
        return self if self.for_batch is None else self.for_batch(n_points, budget)


def with_exact_fallback(kernel: Callable[[FloatArray, Int8Array, Budget], int], rest: Fill) -> Fill:
    """Return a `Fill` that calls a filter kernel, then `rest` for the points that the kernel leaves UNDECIDED. kernel:
    returns how many points its filter left open (UNDECIDED ones included), or NOT_FINITE. The `Fill` raises
    NotFiniteError, which names no point, and as `Budget.check`, also where the kernel stopped early."""

    def fill(points: FloatArray, locations: Int8Array, budget: Budget) -> Counts:
        if len(points) == 0:
            return Counts(0, 0)
        with np.errstate(all="ignore"):  # uncompiled, numpy scalars warn where the filter means to overflow
            n_beyond = int(kernel(read_only(points), locations, budget))
        budget.check()
        if not n_beyond:
            return Counts(0, 0)
        if n_beyond == NOT_FINITE:
            raise NotFiniteError("a point is not finite", ("points",))
        return Counts(n_beyond, settle(rest, points, locations, np.flatnonzero(locations == UNDECIDED), budget))

    return fill


def settle(fill: Fill, points: FloatArray, locations: Int8Array, items: IntArray, budget: Budget) -> int:
    """Locate the points numbered `items` by `fill`, and write the results to locations[items]; return how many of them
    were decided in rationals."""
    if not len(items):
        return 0
    results = np.empty(len(items), np.int8)
    counts = fill(points[items], results, budget)
    locations[items] = results
    return counts.rational


def locator_of(solid: Solid) -> Locator:
    """Return the `Locator` for the type of `solid`; its structures are prepared at the first call. Raises:
    UnsupportedSolidError.
    """
    row = row_of(solid)
    if row.locator is not None:
        made: Locator = row.locator(solid)
        return made
    if not is_located(row):
        raise unsupported(solid)
    return Locator("exact", exact_fallback(solid))


def exact_fallback(solid: Solid, pose: Pose | None = None) -> Fill:
    """Return a `Fill` that locates each point in rational arithmetic, in `solid` under `pose` (None: not moved)."""

    def fill(points: FloatArray, locations: Int8Array, budget: Budget) -> Counts:
        for item, point in enumerate(points.tolist()):
            locations[item] = rational_location(point, solid, pose, budget.check)
        return Counts(len(points), len(points))

    return fill


def by_kernel(
    method: str, kernel: Callable[..., int], solid: Solid, *prepared: object, pose: Pose | None = None
) -> Locator:
    """Return the locator that calls ``kernel(points, *prepared, locations, flag)`` and decides the points left
    UNDECIDED in rational arithmetic, in `solid` under `pose` (None: not moved). method: name for `Accuracy.method`."""
    return Locator(method, _filled_by(kernel, *prepared, rest=exact_fallback(solid, pose)), direct=(kernel, *prepared))


def _filled_by(kernel: Callable[..., int], *prepared: object, rest: Fill) -> Fill:
    return with_exact_fallback(lambda points, out, budget: kernel(points, *prepared, out, budget.flag), rest)


def _by_choice(method: str, choose: Callable[[int, Budget], Locator]) -> Locator:
    return Locator(
        method, lambda points, out, budget: choose(len(points), budget).fill(points, out, budget), for_batch=choose
    )


def rows_locator(solid: HalfSpace | Convex) -> Locator:
    """Return the locator of a half-space or convex solid: signs of the plane equations at the point."""
    rows = rows_of(solid)
    return by_kernel("half_spaces", locate_in_half_spaces, solid, rows, np.ones(len(rows), np.bool_))


def ball_locator(solid: Sphere) -> Locator:
    """Return the locator of a ball: sign of r^2 - |p - c|^2."""
    return by_kernel("squared_distance", locate_in_ball, solid, solid.center, 0.0, solid.radius)


def box_locator(solid: Aabb) -> Locator:
    """Return the locator of an axis-aligned box: comparisons of coordinates."""
    return by_kernel("comparison", locate_in_box, solid, EXACT, solid.min, solid.max)


def triangle_locator(solid: Triangle) -> Locator:
    """Return the locator of a planar triangle, or of the prism over a triangle in space."""
    if solid.dimension == 2:
        return _by_choice(
            "same_side", lambda *_: by_kernel("same_side", locate_in_rings, solid, EXACT, edges_of(solid))
        )
    return _by_choice("prism", lambda _, budget: by_kernel("prism", locate_in_half_spaces, solid, *prism_rows(solid)))


def polygon_locator(solid: Polygon) -> Locator:
    """Return the locator of a polygon, by ray parity."""
    return _by_choice(
        "ring_crossing", lambda n_points, budget: polygon_by(solid, choose_for_rings(solid, n_points), budget)
    )


def polygon_by(solid: Polygon, choice: int, budget: Budget) -> Locator:
    """Return the locator of a polygon by one structure, built at first use; choice: PASS, LISTS (slabs) or CELLS."""
    if choice == Choice.CELLS:
        return by_kernel("ring_cells", locate_in_rings, solid, EXACT, ring_cells_of(solid, budget.flag, budget.check))
    rings = edges_of(solid) if choice == Choice.PASS else rings_of(solid, budget.check)
    return by_kernel("ring_crossing", locate_in_rings, solid, EXACT, rings)


def polyhedron_locator(solid: Polyhedron) -> Locator:
    """Return the locator of a polyhedron, by ray parity."""
    return _by_choice(
        "ray_parity", lambda n_points, budget: polyhedron_by(solid, choose_for_mesh(solid, n_points), budget)
    )


def polyhedron_by(solid: Polyhedron, choice: int, budget: Budget) -> Locator:
    """Return the locator of a polyhedron by one structure, built at first use; choice: PASS, LISTS (tree) or CELLS."""
    if choice == Choice.PASS:
        by_pass = by_kernel("ray_parity", locate_by_pass, solid, solid.vertices, solid.triangles)
        return by_pass._replace(is_long=len(solid.triangles) > LONG_PASS)
    by_rays = by_kernel("ray_parity", locate_by_tree, solid, EXACT, tree_of(solid, budget.check))
    if choice != Choice.CELLS:
        return by_rays
    return Locator("segment_parity", _filled_by(locate_by_cells, cells_of(solid, budget), rest=by_rays.fill))


def implicit_locator(solid: Implicit) -> Locator:
    """Return the locator of an implicit solid: sign of its polynomial, or of the caller's function."""
    if solid.function is not None:
        return Locator("callable", _call(solid), "float64")
    degree = int(solid.powers.sum(axis=1).max())
    return by_kernel("polynomial", locate_by_polynomial, solid, EXACT, solid.powers, solid.coefficients, degree)


def _call(solid: Implicit) -> Fill:
    """Return a `Fill` that takes the sign of the caller's function at each point."""
    function = solid.function
    assert function is not None

    def fill(points: FloatArray, locations: Int8Array, budget: Budget) -> Counts:
        values = np.asarray(function(points), np.float64)
        if values.shape != (len(points),):
            raise InvalidArrayError(
                f"function must return one number for each of {len(points)} points, got shape {values.shape}",
                ("solid", "function"),
            )
        if np.isnan(values).any():
            index = int(np.isnan(values).argmax())
            raise NotFiniteError(f"function returned NaN at {points[index].tolist()}", ("solid", "function"))
        locations[:] = np.sign(values)
        return Counts(0, 0)

    return fill


def csg_locator(solid: Csg, leaf_locator: Callable[[Solid], Locator] = locator_of) -> Locator:
    """Return the locator of a CSG tree: each distinct leaf is located once a chunk, and the tree combines the
    locations. leaf_locator: makes the locator of a leaf."""
    leaves: dict[int, Locator] = {}
    fold_csg_tree(solid, lambda leaf: leaves.setdefault(id(leaf), leaf_locator(leaf)), lambda *_: None)

    def fill(points: FloatArray, locations: Int8Array, budget: Budget) -> Counts:
        counts: list[Counts] = []

        def locate_leaf(leaf: Solid) -> Int8Array:
            of_leaf = np.empty(len(points), np.int8)
            counts.append(leaves[id(leaf)].chosen(len(points), budget).fill(points, of_leaf, budget))
            return of_leaf

        locations[:] = fold_csg_tree(solid, locate_leaf, combine)
        n_beyond, n_rational = sum(each.beyond for each in counts), sum(each.rational for each in counts)
        return Counts(min(n_beyond, len(points)), min(n_rational, len(points)))

    is_exact = all(leaf.decisions == "exact" for leaf in leaves.values())
    return Locator("csg_tree", fill, "exact" if is_exact else "float64")
