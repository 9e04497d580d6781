"""How far apart are two bodies? Meshes under poses, and pairs so near that rounding decides.

Pairs near contact are judged by rational arithmetic. Rows of poses compare the peers with ours: the distances of 1,280
and of 20,480 faces are too many to ask the reference for; tests hold ours against rationals on smaller meshes.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

import engine
from benchmarks.answers.shapes import BOX, SQUARE, corners
from benchmarks.bodies import Pair, random_rotations
from benchmarks.contenders import Couple, Placed
from benchmarks.contest import Contest, Goals, Size, Task, field_of
from benchmarks.errors import distances, exact_distances
from benchmarks.fields.collision import request
from benchmarks.workloads import Mesh, Rings, bumpy_sphere, document, generator

POSES: dict[str, Goals] = {"coal": (3.0, 6.0), "fcl": (3.0, 6.0)}
FAR: dict[str, tuple[float, float]] = {"near": (2.05, 2.15), "far": (5.0, 8.0), "mixed": (1.5, 4.0)}
"""How far apart the middles are, in radii of the bumpy balls."""
CUBE = corners(np.zeros(3), np.ones(3))
PEERS = ("coal", "fcl", "manifold3d")


def tasks(size: Size) -> Iterator[Task]:
    """Yield the rows, all with one thread."""
    yield Task("nearly in contact", partial(_hard, size, 3, PEERS), True)
    yield Task("polygons nearly in contact", partial(_hard, size, 2, ("shapely",)), True)
    for place in FAR:
        yield Task(f"1k faces, {place}", partial(_poses, size, "1k", 3, place), place == "mixed")
        yield Task(f"20k faces, {place}", partial(_poses, size, "20k", 5, place))


def _poses(size: Size, name: str, times: int, place: str) -> Contest:
    """Bumpy balls, subdivided so many times; the exact answers are ours."""
    n_poses = size.n(400, 50)
    first, second = (bumpy_sphere(f"clearance {name} {seed}", seed, times) for seed in (1, 2))
    draw = generator(f"clearance {name} {place}", size.seed)
    ways = draw.normal(size=(n_poses, 3))
    moves = ways / np.linalg.norm(ways, axis=1)[:, None] * draw.uniform(*FAR[place], n_poses)[:, None]
    radius = np.linalg.norm(first.vertices, axis=1).max()
    pair = Pair(name, first, second, True, random_rotations(draw, n_poses), moves * radius)
    exact = engine.clearance_poses(*pair.solids(), pair.rotations, pair.translations)
    about = f"bumpy balls of {len(first.faces):,} faces, middles {FAR[place][0]} to {FAR[place][1]} radii apart"
    rows, asked = np.arange(n_poses), field_of("clearance poses", pair, POSES, 1)
    return Contest("clearance", f"{name} faces, {place}", False, rows, exact, distances, asked, about,
                   request=partial(request, pair, path="/v1/clearance"))  # fmt: skip


def _hard(size: Size, dimension: int, peers: tuple[str, ...]) -> Contest:
    couples = [_couple(generator(f"clearance {dimension}/{k}", size.seed), dimension, k) for k in range(size.n(90, 12))]
    exact = exact_distances(couples)
    is_apart = exact > 0.0
    couples, exact = [couple for couple, remaining in zip(couples, is_apart) if remaining], exact[is_apart]

    def asked(item: int) -> tuple[str, dict[str, Any]]:
        first, second = (document(body.shape) for body in couples[item])
        return "/v1/clearance", {"first": first, "second": second}

    about = "balls and boxes an ulp apart, turned boxes whose faces are flush, bars that cross, all of them apart"
    result = field_of("clearance pairs", None, peers, 1)
    name = "nearly in contact" if dimension == 3 else "polygons nearly in contact"
    return Contest("clearance", name, True, couples, exact, distances, result, about, request=asked)


def _couple(draw: np.random.Generator, dimension: int, k: int) -> Couple:
    """Return two bodies that are apart as a rule, by an ulp or a little more."""
    turn = random_rotations(draw, 1)[0]
    if dimension == 2:
        angle = draw.uniform(0.0, 6.3)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        moved = SQUARE + np.array([1.0 + 10.0 ** draw.uniform(-16, -6), draw.uniform(-0.5, 0.5)])
        bodies = SQUARE @ turn.T, moved @ turn.T
        return Placed(Rings("a", [bodies[0]])), Placed(Rings("b", [bodies[1]]))
    if k % 3 == 0:
        a, b, c = draw.uniform(0.5, 3.0, 3)
        length = np.sqrt(a * a + b * b + c * c)
        radius = draw.uniform(0.1, 0.9) * length
        other = np.nextafter(length - radius, 0.0) - draw.integers(0, 3) * np.spacing(length)
        return Placed(engine.Sphere([0, 0, 0], radius)), Placed(engine.Sphere([a, b, c], other))
    if k % 3 == 1:
        low, wide = draw.uniform(-1, 1, 3), draw.uniform(0.5, 2, 3)
        high = low + wide
        start = np.array([np.nextafter(high[0], 9.0), *(low[1:] + draw.uniform(-0.4, 0.4, 2))])
        return Placed(engine.Aabb(low, high)), Placed(engine.Aabb(start, start + wide))
    if k % 2:
        moved = CUBE + np.array([1.0 + 10.0 ** draw.uniform(-15, -6), *draw.uniform(-0.5, 0.5, 2)])
        return Placed(Mesh("a", CUBE @ turn.T, BOX)), Placed(Mesh("b", moved @ turn.T, BOX))
    bar, tilt = CUBE * [100.0, 0.01, 0.01], 10.0 ** draw.uniform(-9, -4)
    crossed = bar @ np.array([[1, tilt, 0], [-tilt, 1, 0], [0, 0, 1.0]]) + [0, 0, 0.01 + 10.0 ** draw.uniform(-12, -6)]
    return Placed(Mesh("a", bar @ turn.T, BOX)), Placed(Mesh("b", crossed @ turn.T, BOX))
