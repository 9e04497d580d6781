"""How the points of a batch are located in each type of solid: what the registry's rows name.

A `Locator` has a compiled half, which fills in an int8 location for each point of a chunk and leaves UNDECIDED what is
out of its range, and a rational half, which settles those. Structures are prepared once a solid.
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
from engine.containment.methods.rational_locate import combine, is_located, over_tree, rational_location, unsupported
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
    """How many points of a chunk needed more than the filter, and how many rational arithmetic."""

    beyond: int
    rational: int


class Locator(NamedTuple):
    """How to locate points in one solid."""

    method: str
    """Stable short name, for `Accuracy.method`."""
    fill: Fill
    """Locates the points (n, dim) of a chunk into int8 (n,). Raises NotFiniteError unless a callable decides."""
    decisions: Literal["exact", "float64"] = "exact"
    for_batch: Callable[[int, Budget], Locator] | None = None
    """Returns the locator to use for so many points, where that depends: it may build a structure that pays."""
    direct: tuple[Any, ...] = ()
    """The kernel, and what stands between points and locations among its arguments, where that is all there is."""
    is_long: bool = False
    """Whether a call takes long whatever the number of points, so that all of a batch are best asked at once."""

    def chosen(self, n_points: int, budget: Budget) -> Locator:
        """Return the locator for a batch of `n_points`."""
        return self if self.for_batch is None else self.for_batch(n_points, budget)


def settled(kernel: Callable[[FloatArray, Int8Array, Budget], int], rest: Fill) -> Fill:
    """Return the fill that runs `kernel` over a chunk and asks another fill about what it leaves UNDECIDED.

    kernel: returns how many points needed more than its filter, those left UNDECIDED among them, or NOT_FINITE.
    Raises NotFiniteError, which names no point, and what `Budget.check` raises, also when the kernel stopped early.
    """

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
    """Locate those points of a chunk that `items` numbers; return how many took rational arithmetic."""
    if not len(items):
        return 0
    found = np.empty(len(items), np.int8)
    counts = fill(points[items], found, budget)
    locations[items] = found
    return counts.rational


def locator_of(solid: Solid) -> Locator:
    """Return how points are located in `solid`; prepares nothing yet.

    Raises: UnsupportedSolidError.
    """
    row = row_of(solid)
    if row.locator is not None:
        made: Locator = row.locator(solid)
        return made
    if not is_located(row):
        raise unsupported(solid)
    return Locator("exact", rational_half(solid))


def rational_half(solid: Solid, pose: Pose | None = None) -> Fill:
    """Return the fill that asks rational arithmetic about each point."""

    def fill(points: FloatArray, locations: Int8Array, budget: Budget) -> Counts:
        for item, point in enumerate(points.tolist()):
            locations[item] = rational_location(point, solid, pose, budget.check)
        return Counts(len(points), len(points))

    return fill


def by_kernel(
    method: str, kernel: Callable[..., int], solid: Solid, *prepared: object, pose: Pose | None = None
) -> Locator:
    """Return the locator by a kernel that takes points, what is prepared of the solid, locations and flag."""
    return Locator(method, _filled_by(kernel, *prepared, rest=rational_half(solid, pose)), direct=(kernel, *prepared))


def _filled_by(kernel: Callable[..., int], *prepared: object, rest: Fill) -> Fill:
    return settled(lambda points, out, budget: kernel(points, *prepared, out, budget.flag), rest)


def _by_choice(method: str, choose: Callable[[int, Budget], Locator]) -> Locator:
    return Locator(
        method, lambda points, out, budget: choose(len(points), budget).fill(points, out, budget), for_batch=choose
    )


def rows_locator(solid: HalfSpace | Convex) -> Locator:
    """Return the locator by the planes that bound a solid."""
    rows = rows_of(solid)
    return by_kernel("half_spaces", locate_in_half_spaces, solid, rows, np.ones(len(rows), np.bool_))


def ball_locator(solid: Sphere) -> Locator:
    """Return the locator by the distance from the centre."""
    return by_kernel("squared_distance", locate_in_ball, solid, solid.center, 0.0, solid.radius)


def box_locator(solid: Aabb) -> Locator:
    """Return the locator by comparisons."""
    return by_kernel("comparison", locate_in_box, solid, EXACT, solid.min, solid.max)


def triangle_locator(solid: Triangle) -> Locator:
    """Return the locator in a triangle of the plane, or in the prism over one of space."""
    if solid.dimension == 2:
        return _by_choice(
            "same_side", lambda *_: by_kernel("same_side", locate_in_rings, solid, EXACT, edges_of(solid))
        )
    return _by_choice("prism", lambda _, budget: by_kernel("prism", locate_in_half_spaces, solid, *prism_rows(solid)))


def polygon_locator(solid: Polygon) -> Locator:
    """Return the locator by rays through the rings."""
    return _by_choice(
        "ring_crossing", lambda n_points, budget: polygon_by(solid, choose_for_rings(solid, n_points), budget)
    )


def polygon_by(solid: Polygon, choice: int, budget: Budget) -> Locator:
    """Return the locator by what policy.py chose; it builds that."""
    if choice == Choice.CELLS:
        return by_kernel("ring_cells", locate_in_rings, solid, EXACT, ring_cells_of(solid, budget.flag, budget.check))
    rings = edges_of(solid) if choice == Choice.PASS else rings_of(solid, budget.check)
    return by_kernel("ring_crossing", locate_in_rings, solid, EXACT, rings)


def polyhedron_locator(solid: Polyhedron) -> Locator:
    """Return the locator by rays through the faces."""
    return _by_choice(
        "ray_parity", lambda n_points, budget: polyhedron_by(solid, choose_for_mesh(solid, n_points), budget)
    )


def polyhedron_by(solid: Polyhedron, choice: int, budget: Budget) -> Locator:
    """Return the locator by what policy.py chose; it builds that."""
    if choice == Choice.PASS:
        by_pass = by_kernel("ray_parity", locate_by_pass, solid, solid.vertices, solid.triangles)
        return by_pass._replace(is_long=len(solid.triangles) > LONG_PASS)
    by_rays = by_kernel("ray_parity", locate_by_tree, solid, EXACT, tree_of(solid, budget.check))
    if choice != Choice.CELLS:
        return by_rays
    return Locator("segment_parity", _filled_by(locate_by_cells, cells_of(solid, budget), rest=by_rays.fill))


def implicit_locator(solid: Implicit) -> Locator:
    """Return the locator by the sign of a polynomial, or of a caller's function."""
    if solid.function is not None:
        return Locator("callable", _call(solid), "float64")
    degree = int(solid.powers.sum(axis=1).max())
    return by_kernel("polynomial", locate_by_polynomial, solid, EXACT, solid.powers, solid.coefficients, degree)


def _call(solid: Implicit) -> Fill:
    """Return the fill that takes the sign of the caller's own function."""
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
    """Return the locator of a tree: every distinct node is located once a chunk, its operands first."""
    leaves: dict[int, Locator] = {}
    over_tree(solid, lambda leaf: leaves.setdefault(id(leaf), leaf_locator(leaf)), lambda *_: None)

    def fill(points: FloatArray, locations: Int8Array, budget: Budget) -> Counts:
        counts: list[Counts] = []

        def locate_leaf(leaf: Solid) -> Int8Array:
            found = np.empty(len(points), np.int8)
            counts.append(leaves[id(leaf)].chosen(len(points), budget).fill(points, found, budget))
            return found

        locations[:] = over_tree(solid, locate_leaf, combine)
        n_beyond, n_rational = sum(each.beyond for each in counts), sum(each.rational for each in counts)
        return Counts(min(n_beyond, len(points)), min(n_rational, len(points)))

    is_exact = all(leaf.decisions == "exact" for leaf in leaves.values())
    return Locator("csg_tree", fill, "exact" if is_exact else "float64")
