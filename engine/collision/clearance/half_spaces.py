"""The gap between a half-space and a body given by triangles and a radius, or another half-space.

A linear function over a body is largest at a vertex. Floats leave the vertices that may be it, rationals decide.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.collision.clearance.bodies import feature_of, radius_of, spread_of
from engine.collision.clearance.exact import ScaledGap
from engine.collision.clearance.forms import PLANE, scaled_gap
from engine.collision.clearance.result import Feature
from engine.collision.exact_images import HalfSpaceImage, Vector, image_half_space, image_map, value_at
from engine.collision.meshes.mesh_arrays import MeshBody
from engine.collision.simple.boundary import pulled_back
from engine.parallel import Budget
from engine.predicates.exact_vectors import squared_length
from engine.solids.base import Solid
from engine.solids.half_space import HalfSpace
from engine.solids.pose import Pose


def gap_of_planes(
    solid: Solid, other: Solid, pose: Pose | None, other_pose: Pose | None, budget: Budget
) -> tuple[ScaledGap, tuple[Feature, Feature]]:
    """Return the gap of two bodies without a common point, one of them a half-space or both, and what it ends on."""
    if isinstance(solid, HalfSpace) and isinstance(other, HalfSpace):
        return _of_planes(image_half_space(solid.normal, solid.offset, pose),
                          image_half_space(other.normal, other.offset, other_pose)), (PLANE, PLANE)  # fmt: skip
    if isinstance(solid, HalfSpace):
        foot, point, feature = _foot_and_vertex(solid, pose, other, other_pose, budget)
        return scaled_gap(foot, point, (0.0, radius_of(other))), (PLANE, feature)
    assert isinstance(other, HalfSpace)
    foot, point, feature = _foot_and_vertex(other, other_pose, solid, pose, budget)
    return scaled_gap(point, foot, (radius_of(solid), 0.0)), (feature, PLANE)


def _of_planes(first: HalfSpaceImage, second: HalfSpaceImage) -> ScaledGap:
    """Return the gap of two half-spaces: their planes are parallel. Of all lines across, that through the origin."""
    p, q = (tuple(-offset * x / squared_length(normal) for x in normal) for normal, offset in (first, second))
    return scaled_gap(p, q, (0.0, 0.0))


def _foot_and_vertex(
    half_space: HalfSpace, half_space_pose: Pose | None, body: Solid, body_pose: Pose | None, budget: Budget
) -> tuple[Vector, Vector, Feature]:
    """Return the point of a plane and the point of a body that are nearest, and the vertex the latter is."""
    mesh, d = spread_of(body), body.dimension
    plane = image_half_space(half_space.normal, half_space.offset, half_space_pose)
    image = image_map(body_pose)
    best: tuple[Fraction, Vector, Feature] | None = None
    for vertex in _highest(pulled_back(plane, body_pose), mesh, d).tolist():
        budget.check()
        point = image(mesh.arrays.vertices[vertex, :d].tolist())
        value = value_at(plane, point)
        if best is None or value >= best[0]:
            triangle, corner = np.argwhere(mesh.arrays.triangles == vertex)[0].tolist()
            feature = feature_of(body, mesh, triangle, corner)
            if best is None or value > best[0] or feature.indices < best[2].indices:
                best = value, point, feature
    assert best is not None
    value, point, feature = best
    return tuple(x - value * n / squared_length(plane[0]) for x, n in zip(point, plane[0])), point, feature


def _highest(pulled: HalfSpaceImage, mesh: MeshBody, dimension: int) -> IntArray:
    """Return the vertices at which a linear function may be largest; the rounding is that of `signs_of`."""
    normal, offset = pulled
    largest = max(abs(value) for value in (*normal, offset))
    weights = np.array([float(value / largest) for value in normal])
    points: FloatArray = mesh.arrays.vertices[:, :dimension]
    with np.errstate(all="ignore"):
        values = points @ weights
        bounds = 2.0**-49 * (np.abs(points) @ np.abs(weights)) + 2.0**-1000 + 2.0**-1073 * np.abs(points).sum(axis=1)
        is_below = values + bounds < np.max(values - bounds)
    return np.flatnonzero(~is_below)
