"""Makes engine objects from the dictionaries that the references, the hard cases and the JSON interface share."""

from __future__ import annotations

from typing import Any

import engine

Dict = dict[str, Any]


def solid(data: Dict) -> engine.Solid:
    """Return the engine's solid of a dictionary."""
    match data["type"]:
        case "half_space":
            return engine.HalfSpace(data["normal"], data["offset"])
        case "sphere":
            return engine.Sphere(data["center"], data["radius"])
        case "aabb":
            return engine.Aabb(data["min"], data["max"])
        case "convex":
            return engine.Convex(data["planes"])
        case "polyhedron":
            return engine.Polyhedron(data["vertices"], data["faces"])
        case "surface":
            return engine.Surface(data["vertices"], data["faces"])
        case "triangle":
            return engine.Triangle(data["vertices"])
        case "polygon":
            return engine.Polygon(data["rings"])
        case "implicit":
            return engine.Implicit(data["terms"])
        case "csg":
            return engine.Csg(data["operation"], [solid(operand) for operand in data["operands"]])
    raise ValueError(data["type"])


def pose(data: Dict | None) -> engine.Pose | None:
    """Return the engine's pose of a dictionary, None for None."""
    return None if data is None else engine.Pose(data["rotation"], data["translation"])
