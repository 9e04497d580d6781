"""Small bodies: convex polyhedra near contact, and thousands of bodies turned anyhow in a cube."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

import engine
from benchmarks import workloads
from benchmarks.poses import Pair, near_contact, random_rotations

BALLS = {10: (4, 2), 32: (10, 3), 100: (14, 7), 200: (18, 11)}
"""Vertices, and how these stand: so many around each of so many belts, and one at either pole."""
FILLING = 1.25
"""Side of a body's share of space, in radii of the ball around the body: most have one or two neighbours in contact."""


def belted_ball(n_vertices: int, seed: int) -> workloads.Mesh:
    """Return a convex polyhedron: the vertices of staggered belts on a sphere, under a random linear map."""
    n_around, n_belts = BALLS[n_vertices]
    heights = -np.cos(np.pi * (np.arange(n_belts) + 1) / (n_belts + 1))
    turns = 2 * np.pi * (np.arange(n_around)[None, :] + np.arange(n_belts)[:, None] / 2) / n_around
    radii = np.sqrt(1 - heights**2)[:, None]
    belts = np.stack([radii * np.cos(turns), radii * np.sin(turns), np.broadcast_to(heights[:, None], turns.shape)], -1)
    vertices = np.concatenate([[[0, 0, -1.0]], belts.reshape(-1, 3), [[0, 0, 1.0]]])
    here = np.arange(n_around)
    there, top = (here + 1) % n_around, len(vertices) - 1
    faces = [
        np.stack([0 * here, 1 + there, 1 + here], 1),
        np.stack([0 * here + top, top - n_around + here, top - n_around + there], 1),
    ]
    for start in range(1, top - n_around, n_around):
        a, b = start + here, start + there
        faces += [np.stack([a, b, a + n_around], 1), np.stack([b, b + n_around, a + n_around], 1)]
    name = f"belted_ball_{n_vertices}"
    random = workloads.generator(name, seed)
    stretch = random_rotations(random, 1)[0] * random.uniform(0.6, 1.0, 3)
    return workloads.Mesh(name, np.ascontiguousarray(vertices @ stretch), np.concatenate(faces))


@dataclass(frozen=True, slots=True, eq=False)
class Crowd:
    """Many bodies, few solids: which solid each body is, and where it stands."""

    name: str
    meshes: list[workloads.Mesh]
    kinds: np.ndarray
    rotations: np.ndarray
    translations: np.ndarray

    def poses(self) -> list[engine.Pose]:
        """Return where each body stands."""
        return [engine.Pose(turn, move) for turn, move in zip(self.rotations, self.translations, strict=True)]

    def frames(self) -> list[Crowd]:
        """Return the crowd a step away, every body moved, and as it stands."""
        random = workloads.generator(self.name, 1)
        step = random.uniform(-0.25, 0.25, self.translations.shape)
        return [replace(self, translations=self.translations + step), self]


@cache
def crowd(n_bodies: int, seed: int) -> Crowd:
    """Return bodies of 10 vertices at random places of a cube, turned at random, as many as meet a neighbour or two."""
    name = f"crowd_{n_bodies}"
    random = workloads.generator(name, seed)
    side = FILLING * n_bodies ** (1 / 3)
    meshes = [belted_ball(10, seed + number) for number in range(8)]
    return Crowd(
        name,
        [workloads.Mesh(mesh.name, 0.5 * mesh.vertices, mesh.faces) for mesh in meshes],
        random.integers(0, len(meshes), n_bodies),
        random_rotations(random, n_bodies),
        random.uniform(0.0, side, (n_bodies, 3)),
    )


@cache
def convex_pair(n_vertices: int, n_poses: int, seed: int) -> Pair:
    """Return two convex polyhedra near contact."""
    first, second = belted_ball(n_vertices, seed), belted_ball(n_vertices, seed + 1)
    return near_contact(first.name, first, second, True, n_poses, seed)
