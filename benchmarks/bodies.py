"""Bodies to collide: pairs near contact under poses, convex bodies, and thousands with random rotations in a cube."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

import engine
from benchmarks.workloads import Mesh, generator, stored_mesh, stored_or_bumpy

JITTER = 2e-3
"""Largest distance along the direction of the bisection from the contact, as part of the size."""
BISECTIONS = 24
STORED = {
    "1k": ("igl_decimated-knight", "igl_decimated-knight", 3),
    "10k": ("igl_bunny", "c3d_fandisk", 5),
    "86k": ("igl_armadillo", "igl_armadillo", 6),
    "soup": ("fcl_env", "fcl_rob", 0),
}
"""Two meshes, and how often a stand-in is subdivided; of soups (the environment and the robot of fcl) there is none."""
BALLS = {10: (4, 2), 32: (10, 3), 100: (14, 7), 200: (18, 11), 502: (25, 20)}
"""Vertices, and how these stand: so many around each of so many belts, and one at either pole."""
FILLING = 1.25
"""Side of a body's share of space, in radii of the ball around the body: most have one or two neighbours in contact."""


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """Two bodies, and poses of the second."""

    name: str
    first: Mesh
    second: Mesh
    is_closed: bool
    rotations: np.ndarray
    translations: np.ndarray

    def solids(self) -> tuple[engine.Solid, engine.Solid]:
        """Return new solids of the engine."""
        make = engine.Polyhedron if self.is_closed else engine.Surface
        return make(self.first.vertices, self.first.faces), make(self.second.vertices, self.second.faces)


def random_rotations(random: np.random.Generator, n_poses: int) -> np.ndarray:
    """Return uniformly distributed rotations."""
    q = random.normal(size=(n_poses, 4))
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.ascontiguousarray(np.array(rows).transpose(2, 0, 1))


def unit_sized(mesh: Mesh) -> Mesh:
    """Return the mesh with a largest extent of about 1 and its middle near the origin."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return Mesh(mesh.name, (mesh.vertices - 0.5 * (low + high)) / (high - low).max(), mesh.faces)


def near_contact(name: str, first: Mesh, second: Mesh, is_closed: bool, n_poses: int, seed: int) -> Pair:
    """Return poses at which about half of the pairs collide: bisected along random directions, then jittered.

    A bisection starts at a random place where the pair collides (of a soup: within the middle of the box) and one far
    outside.
    """
    random = generator(f"{name}/poses", seed)
    turns = random_rotations(random, n_poses)
    low, high = first.vertices.min(axis=0), first.vertices.max(axis=0)
    reach = np.linalg.norm(high - low) + np.linalg.norm(second.vertices, axis=1).max()
    directions = random.normal(size=(n_poses, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    middle = 0.5 * (low + high) - turns @ (0.5 * (second.vertices.min(axis=0) + second.vertices.max(axis=0)))
    if not is_closed:  # within the building, not around it
        middle = middle + random.uniform(-0.4, 0.4, (n_poses, 3)) * (high - low)
    near, far = np.zeros(n_poses), np.full(n_poses, reach)
    pair = Pair(name, first, second, is_closed, turns, middle)
    a, b = pair.solids()
    for _ in range(BISECTIONS):
        tried = 0.5 * (near + far)
        moves = middle + tried[:, None] * directions
        collides = engine.collide_poses(a, b, turns, moves, boolean=True) != engine.Relation.DISJOINT
        near, far = np.where(collides, tried, near), np.where(collides, far, tried)
    size = np.ptp(second.vertices, axis=0).max()
    moves = middle + (near + random.uniform(-JITTER, JITTER, n_poses) * size)[:, None] * directions
    return replace(pair, translations=np.ascontiguousarray(moves))


@cache
def pair_of_size(size: str, n_poses: int, seed: int) -> Pair:
    """Return the pair of `1k`, `10k` or `86k` faces, or `soup`."""
    *names, times = STORED[size]
    if size == "soup":
        first, second = map(stored_mesh, names)
    else:
        first, second = (unit_sized(stored_or_bumpy(name, times, seed)) for name in names)
    return near_contact(f"{first.name} / {second.name}", first, second, size != "soup", n_poses, seed)


def belted_ball(n_vertices: int, seed: int, is_round: bool = False) -> Mesh:
    """Return a convex polyhedron: the vertices of staggered belts on a sphere, under a random linear map or none."""
    n_around, n_belts = BALLS[n_vertices]
    heights = -np.cos(np.pi * (np.arange(n_belts) + 1) / (n_belts + 1))
    turns = 2 * np.pi * (np.arange(n_around)[None, :] + np.arange(n_belts)[:, None] / 2) / n_around
    radii = np.sqrt(1 - heights**2)[:, None]
    belts = np.stack([radii * np.cos(turns), radii * np.sin(turns), np.broadcast_to(heights[:, None], turns.shape)], -1)
    vertices = np.concatenate([[[0, 0, -1.0]], belts.reshape(-1, 3), [[0, 0, 1.0]]])
    here = np.arange(n_around)
    there, top = (here + 1) % n_around, len(vertices) - 1
    corners = [(0 * here, 1 + there, 1 + here), (0 * here + top, top - n_around + here, top - n_around + there)]
    for start in range(1, top - n_around, n_around):
        a, b = start + here, start + there
        corners += [(a, b, a + n_around), (b, b + n_around, a + n_around)]
    name = f"belted_ball_{n_vertices}"
    random = generator(name, seed)
    stretch = np.eye(3) if is_round else random_rotations(random, 1)[0] * random.uniform(0.6, 1.0, 3)
    return Mesh(name, np.ascontiguousarray(vertices @ stretch), np.concatenate([np.stack(abc, 1) for abc in corners]))


@cache
def convex_pair(n_vertices: int, n_poses: int, seed: int) -> Pair:
    """Return two convex polyhedra near contact."""
    first, second = belted_ball(n_vertices, seed), belted_ball(n_vertices, seed + 1)
    return near_contact(first.name, first, second, True, n_poses, seed)


@dataclass(frozen=True, slots=True, eq=False)
class Crowd:
    """Many bodies, few solids: the solid and the pose of each body."""

    name: str
    meshes: list[Mesh]
    kinds: np.ndarray
    rotations: np.ndarray
    translations: np.ndarray

    def poses(self) -> list[engine.Pose]:
        """Return where each body stands."""
        return [engine.Pose(turn, move) for turn, move in zip(self.rotations, self.translations, strict=True)]

    def solids(self) -> list[engine.Solid]:
        """Return the solid of each body, new, few of them different."""
        kinds = [engine.Polyhedron(mesh.vertices, mesh.faces) for mesh in self.meshes]
        return [kinds[kind] for kind in self.kinds]

    def frames(self) -> list[Crowd]:
        """Return the crowd a step away, every body moved, and as it stands."""
        step = generator(self.name, 1).uniform(-0.25, 0.25, self.translations.shape)
        return [replace(self, translations=self.translations + step), self]


@cache
def crowd(n_bodies: int, seed: int) -> Crowd:
    """Return bodies of 10 vertices at random places of a cube, turned at random, as many as meet a neighbour or two."""
    name, side = f"crowd_{n_bodies}", FILLING * n_bodies ** (1 / 3)
    random = generator(name, seed)
    balls = [belted_ball(10, seed + number) for number in range(8)]
    meshes = [Mesh(ball.name, 0.5 * ball.vertices, ball.faces) for ball in balls]
    kinds, turns = random.integers(0, len(meshes), n_bodies), random_rotations(random, n_bodies)
    return Crowd(name, meshes, kinds, turns, random.uniform(0.0, side, (n_bodies, 3)))
