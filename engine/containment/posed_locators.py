"""Locates points in posed solids: filters in the pose frame (the body's own), exact on input and transform.

A posed solid is the exact image of the solid under p -> R p + t; a sphere has the same radius about the exact image of
its centre. Points are moved into the solid's frame with a bound on the rounding and filtered there
(methods/filters.py); the rest goes to the exact fallback. Translations and quarter turns with exact differences use
the unposed kernels, so that flush instances on a lattice never reach rationals.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import ulp
from typing import Any

import numpy as np

from engine.containment.locators import (
    Counts,
    Fill,
    Locator,
    by_kernel,
    csg_locator,
    exact_fallback,
    locator_of,
    settle,
)
from engine.containment.methods.filters import (
    Frames,
    frames_of,
    locate_by_polynomial,
    locate_in_ball,
    locate_in_box,
    locate_in_rows_blurred,
    move_to_body_frame,
)
from engine.containment.methods.polygon_ray_parity import locate_in_rings
from engine.containment.methods.polyhedron_ray_parity import locate_by_tree
from engine.containment.methods.rational_locate import Check, to_world_frame
from engine.containment.prepared import prism_rows, rings_of, tree_of
from engine.running.budget import Budget
from engine.solids.base import Solid
from engine.solids.csg import Csg
from engine.solids.implicit import Implicit
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.pose import Pose
from engine.solids.primitives import Aabb, Convex, HalfSpace, Sphere, Triangle, rows_in_space, rows_of
from engine.solids.registry import row_of
from engine.types import UNDECIDED, FloatArray, Int8Array, read_only


def posed_locator(solid: Solid, pose: Pose | None) -> Locator:
    """Return the locator of `solid` under `pose`, which maps body coordinates to those of the points. Raises:
    UnsupportedSolidError.
    """
    if pose is None or pose.is_identity:
        return locator_of(solid)
    row = row_of(solid)
    if row.posed is not None:
        made: Locator = row.posed(solid, pose)
        return made
    return locator_of(solid)._replace(fill=exact_fallback(solid, pose), for_batch=None, direct=())


def posed_csg(solid: Csg, pose: Pose) -> Locator:
    """Return the locator of a CSG tree of which all leaves have the same pose."""
    return csg_locator(solid, lambda leaf: posed_locator(leaf, pose))


def posed_ball(solid: Sphere, pose: Pose) -> Locator:
    """Return the locator of a ball of the same radius about the image of its centre."""
    return by_kernel("squared_distance", locate_in_ball, solid, *posed_center(solid, pose), solid.radius, pose=pose)


def posed_implicit(solid: Implicit, pose: Pose) -> Locator:
    """Return the locator of a posed implicit solid: its function is evaluated at the preimages of the points."""
    if solid.function is None:
        return by_filter(terms)(solid, pose)
    unposed, frames = locator_of(solid), _frames(pose)
    by_preimage: Fill = lambda points, *rest: unposed.fill(_moved(points, frames)[0], *rest)  # noqa: E731
    return Locator(unposed.method, by_preimage, unposed.decisions)  # rounded: a callable decides in floats anyway


def by_filter(prepare: Callable[[Any, Check], tuple[Any, ...]]) -> Callable[[Any, Pose], Locator]:
    """Return a function (solid, pose) -> `Locator` that filters preimages of points in the pose frame, then decides the
    rest exactly. prepare: (solid, check) -> (kernel, *arguments) for a call kernel(points, blurs, *arguments,
    locations, flag)."""

    def locator(solid: Solid, pose: Pose) -> Locator:
        unposed = locator_of(solid)
        return Locator(unposed.method, _filtered(solid, pose, unposed, prepare), unposed.decisions)

    return locator


def box_sides(solid: Aabb, _: Check) -> tuple[Any, ...]:
    """Return (kernel, low corner, high corner) for `by_filter`."""
    return locate_in_box, solid.min, solid.max


def rows(solid: HalfSpace | Convex, _: Check) -> tuple[Any, ...]:
    """Return (kernel, plane rows (m, 4)) of a solid bounded by planes, for `by_filter`."""
    return locate_in_rows_blurred, rows_in_space(rows_of(solid))


def triangle(solid: Triangle, check: Check) -> tuple[Any, ...]:
    """Return (kernel, *arguments) for `by_filter`: of a planar triangle, or of the prism over a triangle in space."""
    if solid.dimension == 2:
        return rings(solid, check)
    return locate_in_rows_blurred, rows_in_space(prism_rows(solid)[0])


def rings(solid: Polygon | Triangle, check: Check) -> tuple[Any, ...]:
    """Return (kernel, `Rings`) of a polygon, for `by_filter`."""
    return locate_in_rings, rings_of(solid, check)


def faces(solid: Polyhedron, check: Check) -> tuple[Any, ...]:
    """Return (kernel, `TriangleTree`) of a polyhedron, for `by_filter`."""
    return locate_by_tree, tree_of(solid, check)


def terms(solid: Implicit, _: Check) -> tuple[Any, ...]:
    """Return (kernel, powers, coefficients, degree) of a polynomial, for `by_filter`."""
    return locate_by_polynomial, solid.powers, solid.coefficients, int(solid.powers.sum(axis=1).max())


@lru_cache(maxsize=64)
def _frames(pose: Pose) -> Frames:
    return frames_of([pose], pose.dimension)


def _moved(points: FloatArray, frames: Frames) -> tuple[FloatArray, FloatArray]:
    moved, blurs = np.empty_like(points), np.empty(len(points))
    with np.errstate(all="ignore"):
        move_to_body_frame(points, frames, moved, blurs)
    return read_only(moved), blurs


def _filtered(solid: Solid, pose: Pose, unposed: Locator, prepare: Callable[[Any, Check], tuple[Any, ...]]) -> Fill:
    frames, rest = _frames(pose), exact_fallback(solid, pose)

    def fill(points: FloatArray, locations: Int8Array, budget: Budget) -> Counts:
        (kernel, *prepared), (moved, blurs) = prepare(solid, budget.check), _moved(points, frames)
        with np.errstate(all="ignore"):
            n_beyond = int(kernel(moved, blurs, *prepared, locations, budget.flag))
        budget.check()
        if not n_beyond:
            return Counts(0, 0)
        n_rational = 0
        if frames.is_turn[0]:
            exact = np.flatnonzero((blurs == 0.0) & (locations == UNDECIDED))
            n_rational = settle(unposed.fill, moved, locations, exact, budget)
        n_rational += settle(rest, points, locations, np.flatnonzero(locations == UNDECIDED), budget)
        return Counts(n_beyond, n_rational)

    return fill


def posed_center(solid: Sphere, pose: Pose) -> tuple[FloatArray, float]:
    """Return the image of a ball's centre, rounded to nearest, and a bound on the error (infinite beyond float64)."""
    exact = to_world_frame(solid.center.tolist(), pose)
    try:
        center = np.array([float(value) for value in exact])
    except OverflowError:
        return np.zeros(solid.dimension), np.inf
    blur = 0.0 if center.tolist() == exact else ulp(float(np.abs(center).max()))
    return read_only(center), blur
