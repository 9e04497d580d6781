"""Pairs of bodies near contact: random rotations, translations bisected to the contact and then jittered."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

import engine
from benchmarks.workloads import Mesh, MissingDataError, bumpy_sphere, generator, stored_mesh

JITTER = 2e-3
"""Largest distance along the direction of the bisection from the contact, as part of the size."""
BISECTIONS = 24

STORED = {
    "1k": ("igl_decimated-knight", "igl_decimated-knight"),
    "10k": ("igl_bunny", "c3d_fandisk"),
    "86k": ("igl_armadillo", "igl_armadillo"),
    "soup": ("fcl_env", "fcl_rob"),
}
TIMES = {"1k": 3, "10k": 5, "86k": 6}


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

    A bisection starts at a random place where the pair collides (of a soup: within the middle of the box) and one
    far outside.
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
    return Pair(name, first, second, is_closed, turns, np.ascontiguousarray(moves))


@cache
def pair_of_size(size: str, n_poses: int, seed: int) -> Pair:
    """Return the pair of `1k`, `10k` or `86k` faces, or `soup` (the environment and the robot of fcl)."""
    try:
        first, second = (stored_mesh(name) for name in STORED[size])
    except MissingDataError:
        if size == "soup":
            raise
        first = second = bumpy_sphere(f"bumpy_sphere_{20 * 4 ** TIMES[size]}", seed, TIMES[size])
    if size != "soup":
        first, second = unit_sized(first), unit_sized(second)
    return near_contact(f"{first.name} / {second.name}", first, second, size != "soup", n_poses, seed)
