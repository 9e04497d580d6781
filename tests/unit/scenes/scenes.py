"""Scenes of all types of solids, poses and sizes, for the tests of this folder."""

from __future__ import annotations

import numpy as np

from engine import Aabb, Convex, Csg, HalfSpace, Polygon, Polyhedron, Pose, Solid, Sphere, Surface, Triangle

OCTAHEDRON = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
FACES = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
Random = np.random.Generator


def pose_of(rng: Random, dimension: int, grid: float = 0.0, span: float = 3.0) -> Pose | None:
    """Return no pose, a step, a quarter turn or any turn; steps on a grid unless that is 0."""
    kind, step = rng.integers(4), rng.uniform(-span, span, dimension)
    if grid:
        step = np.round(step / grid) * grid
    if kind == 0:
        return None
    turn = np.eye(dimension)
    if kind == 2:
        turn[:2, :2] = [[0, -1], [1, 0]]
    if kind == 3:
        turn, _ = np.linalg.qr(rng.normal(size=(dimension, dimension)))
        turn[0] *= np.sign(np.linalg.det(turn))
    return Pose(turn, step)


def solids_of(dimension: int, *, for_pairs: bool = False) -> list[Solid]:
    """Return one solid of each type: those that take part in pairs, or those that contain points."""
    origin = [0.0] * dimension
    ball, box = Sphere(origin, 1.0), Aabb([-1.0] * dimension, [0.5] * dimension)
    half = HalfSpace([1.0] + [0.0] * (dimension - 1), -2.0)
    if dimension == 2:
        rings = Polygon([[[-1, -1], [1, -1], [1, 1], [-1, 1]], [[-0.5, -0.5], [0.5, -0.5], [0.0, 0.5]]])
        found: list[Solid] = [ball, box, half, rings, Triangle([[0, 0], [1, 0], [0, 1]])]
    else:
        found = [ball, box, half, Polyhedron(OCTAHEDRON, FACES)]
        sheet = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]], [[0, 1, 2], [0, 2, 3]])
        found.append(sheet if for_pairs else Triangle([[0, 0, 0], [1, 0, 0], [0, 1, 0.5]]))
    if not for_pairs:
        rows = np.vstack([np.eye(dimension), -np.ones(dimension)])
        found.append(Convex(np.column_stack([rows, np.ones(dimension + 1)])))
        found.append(Csg("difference", [box, Csg("union", [ball, half])]))
    return found


def scene_of(rng: Random, dimension: int, n: int, *, for_pairs: bool = False) -> tuple[list[Solid], list[Pose | None]]:
    """Return n bodies, of some solids each, on a grid as often as not."""
    solids = solids_of(dimension, for_pairs=for_pairs)
    chosen = [solids[k] for k in rng.integers(len(solids), size=n).tolist()]
    grid = 0.5 if rng.integers(2) else 0.0
    return chosen, [pose_of(rng, dimension, grid) for _ in chosen]
