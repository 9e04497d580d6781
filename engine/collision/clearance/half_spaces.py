"""The gap between a half-space and a body given by triangles and a radius, or another half-space.

A linear function over a body is largest at a vertex. Floats leave the vertices that may be it, rationals decide.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from engine.budget import Budget
from engine.collision.clearance.bodies import feature_of, radius_of, spread_of
from engine.collision.clearance.exact import ScaledGap
from engine.collision.clearance.forms import PLANE, scaled_gap
from engine.collision.exact_images import Vector, image_half_space, image_point, value_at
from engine.collision.result import Feature, Poses
from engine.collision.simple.boundary import pulled_back
from engine.predicates.rational import squared_length
from engine.solids.base import Solid
from engine.solids.half_space import HalfSpace


def gap_of_planes(one: Solid, other: Solid, poses: Poses, budget: Budget) -> tuple[ScaledGap, tuple[Feature, Feature]]:
    """Return the gap of two bodies without a common point, one of them a half-space or both, and what it ends on."""
    if isinstance(one, HalfSpace) and isinstance(other, HalfSpace):
        # their planes are parallel; of all lines across, that through the origin
        planes = image_half_space(one, poses[0]), image_half_space(other, poses[1])
        p, q = (tuple(-offset * x / squared_length(normal) for x in normal) for normal, offset in planes)
        return scaled_gap(p, q, (0.0, 0.0)), (PLANE, PLANE)
    if isinstance(one, HalfSpace):
        foot, point, feature = _foot_and_vertex(one, other, poses, budget)
        return scaled_gap(foot, point, (0.0, radius_of(other))), (PLANE, feature)
    assert isinstance(other, HalfSpace)
    foot, point, feature = _foot_and_vertex(other, one, poses[::-1], budget)
    return scaled_gap(point, foot, (radius_of(one), 0.0)), (feature, PLANE)


def _foot_and_vertex(space: HalfSpace, body: Solid, poses: Poses, budget: Budget) -> tuple[Vector, Vector, Feature]:
    """Return the point of a plane and the point of a body that are nearest, and the vertex the latter is."""
    mesh, d = spread_of(body), body.dimension
    plane = image_half_space(space, poses[0])
    best: tuple[Fraction, Vector, Feature] | None = None
    (_, weights, _), points = pulled_back(plane, poses[1]), mesh.arrays.vertices[:, :d]
    with np.errstate(all="ignore"):  # the rounding is that of `signs_of`
        values = points @ weights
        bounds = 2.0**-49 * (np.abs(points) @ np.abs(weights)) + 2.0**-1000 + 2.0**-1073 * np.abs(points).sum(axis=1)
        is_below = values + bounds < np.max(values - bounds)
    for vertex in np.flatnonzero(~is_below).tolist():
        budget.check()
        point = image_point(mesh.arrays.vertices[vertex, :d].tolist(), poses[1])
        value = value_at(plane, point)
        if best is None or value >= best[0]:
            triangle, corner = np.argwhere(mesh.arrays.triangles == vertex)[0].tolist()
            feature = feature_of(body, mesh, triangle, corner)
            if best is None or value > best[0] or feature.indices < best[2].indices:
                best = value, point, feature
    assert best is not None
    value, point, feature = best
    return tuple(x - value * n / squared_length(plane[0]) for x, n in zip(point, plane[0])), point, feature
