"""Solids for these tests, each as the engine's object and as the reference's JSON."""

from __future__ import annotations

import json
import random
from typing import Any

import numpy as np

import engine

MAKERS: dict[str, Any] = {
    "half_space": lambda s: engine.HalfSpace(s["normal"], s["offset"]),
    "sphere": lambda s: engine.Sphere(s["center"], s["radius"]),
    "aabb": lambda s: engine.Aabb(s["min"], s["max"]),
    "convex": lambda s: engine.Convex(s["planes"]),
    "polyhedron": lambda s: engine.Polyhedron(s["vertices"], s["faces"]),
    "triangle": lambda s: engine.Triangle(s["vertices"]),
    "polygon": lambda s: engine.Polygon(s["rings"]),
    "implicit": lambda s: engine.Implicit(s["terms"]),
    "csg": lambda s: engine.Csg(s["operation"], [made(operand) for operand in s["operands"]]),
}


def made(solid: dict[str, Any]) -> Any:
    """Return the engine's object for a JSON solid."""
    return MAKERS[solid["type"]](solid)


def box_mesh(low: list[float], high: list[float]) -> dict[str, Any]:
    """Return a box as a polyhedron of 12 triangles, outward."""
    corners = [[(low, high)[bit >> k & 1][k] for k in range(3)] for bit in range(8)]
    quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    faces = [f for a, b, c, d in quads for f in ([a, b, c], [a, c, d])]
    return {"type": "polyhedron", "vertices": corners, "faces": faces}


def merged(*meshes: dict[str, Any]) -> dict[str, Any]:
    """Return several meshes as one polyhedron, whatever their position to each other."""
    vertices: list[Any] = []
    faces: list[Any] = []
    for mesh in meshes:
        faces += [[index + len(vertices) for index in face] for face in mesh["faces"]]
        vertices += mesh["vertices"]
    return {"type": "polyhedron", "vertices": vertices, "faces": faces}


def lattice_solids(dimension: int, seed: int) -> list[dict[str, Any]]:
    """Return small solids on the lattice 0..4, so that lattice points meet every degeneracy."""
    source = random.Random(seed)

    def point(n: int = dimension) -> list[float]:
        return [float(source.randint(0, 4)) for _ in range(n)]

    low = point()
    leaf = [
        {"type": "half_space", "normal": [1.0, *(x - 2.0 for x in point(dimension - 1))], "offset": -3.0},
        {"type": "sphere", "center": point(), "radius": float(source.choice([0, 1, 2, 5**0.5]))},
        {"type": "aabb", "min": low, "max": [x + source.randint(0, 2) for x in low]},
        {"type": "convex", "planes": [[*(float(source.randint(-2, 2)) for _ in range(dimension - 1)), 1.0, -2.0]] * 2
         + [[-1.0, *([0.0] * (dimension - 1)), 3.0]]},
        {"type": "triangle", "vertices": [[0.0] * dimension, point(), [4.0, *point(dimension - 1)]]},
        {"type": "implicit", "terms": [{"powers": [2, 1, 0][:dimension], "coefficient": 1.0},
                                       {"powers": [0, 1, 2][-dimension:], "coefficient": -1.0}]},
    ]  # fmt: skip
    if dimension == 2:
        leaf.append({"type": "polygon", "rings": [[point() for _ in range(5)], [point() for _ in range(4)]]})
    else:
        vertices = [point() for _ in range(4)]
        faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
        tetrahedron = {"type": "polyhedron", "vertices": vertices, "faces": faces}
        leaf.append(merged(tetrahedron, box_mesh([0.0, 1.0, 1.0], [3.0, 2.0, 4.0])))
    trees = [{"type": "csg", "operation": name, "operands": source.sample(leaf, 2)} for name in ("union", "difference")]
    return [*leaf, *trees, {"type": "csg", "operation": "intersection", "operands": trees}]


def lattice_points(dimension: int) -> np.ndarray[Any, Any]:
    """Return every lattice point -1..5, and the same moved by half and by an ulp along the first axis."""
    axes = np.meshgrid(*[np.arange(-1.0, 6.0)] * dimension, indexing="ij")
    points = np.stack(axes, axis=-1).reshape(-1, dimension)
    moved, close = points.copy(), points.copy()
    moved[:, 0] += 0.5
    close[:, 0] = np.nextafter(close[:, 0], 9.0)
    return np.concatenate([points, moved, close])


def spelled(solid: dict[str, Any]) -> str:
    """Return a solid for an assertion's message."""
    return json.dumps(solid)
