"""Which of the textbook's methods answer a question about a solid, ready to be asked, and what an item costs them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from engine.arrays import BoolArray, FloatArray
from engine.textbook import (
    cohen_sutherland,
    collide_by_edges,
    collide_by_vertices,
    collide_by_volumes,
    convex,
    convex_cohen_sutherland,
    half_space,
    polygon_angle_sum,
    polygon_ray_parity,
    polygon_same_side,
    polyhedron_ray_parity,
    segment_half_space,
    segment_sphere,
    sutherland_hodgman,
    triangle_cross_dot,
    triangle_projection,
)

Methods = dict[str, tuple[Callable[..., Any], int]]
"""For each name how to ask, and how many steps an item takes."""
AHEAD: Final = np.array([0.5773, 0.2113, 0.7886])
"""The direction of the half-line: no component is zero."""
ANGLES: Final = 1e-6
"""The tolerance that the unsigned sum of angles needs, and the textbook does not name."""


def of_points(solid: Any) -> Methods:
    """Return what tells of points (n, dim) whether a solid contains them."""
    match solid.type:
        case "half_space":
            return {"half-space": (lambda points: half_space.contains(points, solid.normal, solid.offset), 1)}
        case "convex":
            return {"half-spaces": (lambda points: convex.contains(points, solid.planes), len(solid.planes))}
        case "polyhedron":
            rest = solid.vertices, solid.triangles, AHEAD
            return {"half-line": (lambda points: polyhedron_ray_parity.contains(points, *rest), len(rest[1]))}
        case "triangle" if solid.dimension == 3:
            both = {"cross and dot products": triangle_cross_dot, "projection": triangle_projection}
            return {name: (lambda points, of=of: of.contains(points, solid.vertices), 1) for name, of in both.items()}
        case "triangle" | "polygon":
            return _of_rings(solid.vertices, getattr(solid, "ring_offsets", np.array([0, len(solid.vertices)])))
    return {}


def _of_rings(vertices: FloatArray, offsets: Any) -> Methods:
    n = len(vertices)
    found: Methods = {"half-line": (lambda points: polygon_ray_parity.contains(points, vertices, offsets), n)}
    if len(offsets) == 2:  # these are for convex polygons; for others they are wrong by more than rounding
        found["signed angles"] = lambda points: polygon_angle_sum.contains_signed(points, vertices), n
        found["unsigned angles"] = lambda points: polygon_angle_sum.contains_unsigned(points, vertices, ANGLES), n
        found["same side"] = lambda points: polygon_same_side.contains(points, vertices), n
    return found


def of_segments(region: Any) -> Methods:
    """Return what clips segments (n, 2, dim): rows of both ends, NaN where nothing is kept."""
    kernels: dict[str, tuple[str, Any, tuple[str, ...]]] = {
        "half_space": ("half-space", segment_half_space.clip, ("normal", "offset")),
        "aabb": ("Cohen-Sutherland", cohen_sutherland.clip, ("min", "max")),
        "convex": ("Cohen-Sutherland by planes", convex_cohen_sutherland.clip, ("planes",)),
        "sphere": ("quadratic", segment_sphere.clip, ("center", "radius")),
    }
    if region.type not in kernels:
        return {}
    name, kernel, attributes = kernels[region.type]
    rest = [getattr(region, attribute) for attribute in attributes]

    def ask(segments: FloatArray) -> Any:
        clipped, kept = kernel(segments, *rest)
        return np.where((kept == 1)[:, None], clipped.reshape(len(segments), -1), np.nan)

    return {name: (ask, len(getattr(region, "planes", "1")))}


def of_polygons(region: Any) -> Methods:
    """Return what tells of polygons of one ring (n, size, dim) whether anything of them is kept."""
    match region.type:
        case "half_space":
            rows = np.append(region.normal, region.offset)[None]
        case "convex":
            rows = region.planes
        case "aabb":
            axes = np.repeat(np.eye(region.dimension), 2, axis=0)
            axes[1::2] *= -1.0
            rows = np.column_stack([axes, np.stack([-region.min, region.max], axis=1).ravel()])
        case _:
            return {}

    def ask(polygons: FloatArray) -> BoolArray:
        return np.array([bool(sutherland_hodgman.clip_on_convex([ring], rows)) for ring in polygons], np.bool_)

    return {"Sutherland-Hodgman": (ask, 4096 * len(rows))}


def of_pairs(first: Any, second: Any) -> Methods:
    """Return what tells whether two bodies collide; a step is a face of one against a vertex of the other."""
    if not first.type == second.type == "polyhedron":
        return {}
    meshes = first.vertices, first.triangles, second.vertices, second.triangles
    n_steps = max(len(meshes[0]) * len(meshes[3]), len(meshes[2]) * len(meshes[1]))
    shown = {"vertices in the other": collide_by_vertices, "edges through faces": collide_by_edges,
             "volumes first": collide_by_volumes}  # fmt: skip
    return {name: (lambda of=of: bool(of.collide(*meshes)), n_steps) for name, of in shown.items()}
