"""The textbook's methods that answer a question about a solid, as functions, with the number of steps an item takes."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import Any, Final

import numpy as np

from engine.solids.primitives import rows_of
from engine.textbook import clip_polygons, clip_segments, collision, polygons, polyhedra, solids
from engine.types import BoolArray, FloatArray

Methods = dict[str, tuple[Callable[..., Any], int]]
"""By name of the method: the function that answers, and how many steps it takes for one item."""
AHEAD: Final = np.array([0.5773, 0.2113, 0.7886])
"""Direction of the half-line; no component is zero."""
ANGLES: Final = 1e-6
"""Tolerance of the unsigned sum of angles, for which the textbook gives no number."""


def of_points(solid: Any) -> Methods:
    """Return the methods that locate points in this solid, by name: a function from points (n, dim) to (n,) bool,
    contained or not, and its number of steps for a point."""
    match solid.type:
        case "half_space":
            return {"half-space": (lambda points: solids.in_half_space(points, solid.normal, solid.offset), 1)}
        case "convex" | "aabb":
            rows = rows_of(solid)
            return {"half-spaces": (lambda points: solids.in_convex(points, rows), len(rows))}
        case "implicit" if solid.function is None:
            terms = solid.powers, solid.coefficients
            return {"sign of f": (lambda points: solids.in_implicit(points, *terms), len(terms[1]))}
        case "csg":
            return _of_tree(solid)
        case "polyhedron":
            rest = solid.vertices, solid.triangles, AHEAD
            return {"half-line": (lambda points: polyhedra.by_half_line(points, *rest), len(rest[1]))}
        case "triangle" if solid.dimension == 3:
            both = {"cross and dot products": solids.by_products, "projection": solids.by_projection}
            return {name: (lambda points, of=of: of(points, solid.vertices), 1) for name, of in both.items()}
        case "triangle" | "polygon":
            return _of_rings(solid.vertices, getattr(solid, "ring_offsets", np.array([0, len(solid.vertices)])))
    return {}


def _of_tree(solid: Any) -> Methods:
    """Return the method of a CSG tree, which asks the first method of each operand; {} if an operand has none."""
    if not all(operands := [list(of_points(operand).values())[:1] for operand in solid.operands]):
        return {}
    leaves: list[Any] = [leaf for ((leaf, _),) in operands]
    tree = reduce(lambda tree, leaf: (solid.operation, tree, leaf), leaves)
    return {"tree": (lambda points: solids.in_csg_tree(points, tree), sum(n for ((_, n),) in operands))}


def _of_rings(vertices: FloatArray, offsets: Any) -> Methods:
    n = len(vertices)
    found: Methods = {"half-line": (lambda points: polygons.by_half_line(points, vertices, offsets), n)}
    if len(offsets) == 2:  # these are for convex polygons; for others they are wrong by more than rounding
        found["signed angles"] = lambda points: polygons.by_signed_angles(points, vertices), n
        found["unsigned angles"] = lambda points: polygons.by_unsigned_angles(points, vertices, ANGLES), n
        found["same side"] = lambda points: polygons.by_same_side(points, vertices), n
    return found


def of_segments(region: Any) -> Methods:
    """Return the methods that clip segments (n, 2, dim) to this region, by name: a function that returns (n, 2 dim),
    both ends, NaN if nothing is left, and its number of steps for a segment."""
    kernels: dict[str, tuple[str, Any, tuple[str, ...]]] = {
        "half_space": ("half-space", clip_segments.on_half_space, ("normal", "offset")),
        "aabb": ("Cohen-Sutherland", clip_segments.on_box, ("min", "max")),
        "convex": ("Cohen-Sutherland by planes", clip_segments.on_convex, ("planes",)),
        "sphere": ("quadratic", clip_segments.on_sphere, ("center", "radius")),
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
    """Return the methods that clip polygons of one ring (n, size, dim) to this region, by name: a function that returns
    (n,) bool, whether a part is left, and its number of steps for a polygon."""
    if region.type not in ("half_space", "convex", "aabb"):
        return {}
    rows = rows_of(region)

    def ask(polygons: FloatArray) -> BoolArray:
        return np.array([bool(clip_polygons.on_convex([ring], rows)) for ring in polygons], np.bool_)

    return {"Sutherland-Hodgman": (ask, 4096 * len(rows))}


def of_pairs(first: Any, second: Any) -> Methods:
    """Return the methods that decide whether two polyhedra collide, by name: a function without arguments, and its
    number of steps, each a face of one against a vertex of the other."""
    if not first.type == second.type == "polyhedron":
        return {}
    meshes = first.vertices, first.triangles, second.vertices, second.triangles
    n_steps = max(len(meshes[0]) * len(meshes[3]), len(meshes[2]) * len(meshes[1]))
    shown: dict[str, Callable[..., bool]] = {
        "vertices in the other": collision.by_vertices,
        "edges through faces": collision.by_edges,
        "volumes first": collision.by_volumes,
    }
    return {name: (lambda of=of: bool(of(*meshes)), n_steps) for name, of in shown.items()}
