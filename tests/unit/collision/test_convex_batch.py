"""Convex bodies that share a vertex, many pairs at once: each as alone, under poses that round nothing, or do."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from engine import Polyhedron, Pose, Relation, collide, collide_scene
from engine.collision.batches import SceneBatches, scene_bodies
from engine.collision.codes import UNSETTLED
from engine.running.budget import UNLIMITED
from tests.unit.distance.makers import CORNERS, QUADS

TURNS = [np.eye(3), np.eye(3)[[1, 2, 0]], np.diag([-1.0, -1.0, 1.0]), [[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1.0]]]


def cubes(n: int, size: float, is_posed: bool) -> tuple[list[Any], list[Any]]:
    """Return n^3 cubes on a grid, as meshes, or as one under poses."""
    corners = np.array(CORNERS) * size
    places = [np.array(at) * size for at in itertools.product(range(n), repeat=3)]
    if is_posed:
        cube = Polyhedron(corners, QUADS)
        return [cube] * n**3, [Pose(np.eye(3), at) for at in places]
    return [Polyhedron(corners + at, QUADS) for at in places], [None] * n**3


@pytest.mark.parametrize("size", [1.0, 0.5, 0.1, 1e-12, 1e200, 5e-324])
@pytest.mark.parametrize("is_posed", [False, True])
def test_cubes_on_a_grid(size: float, is_posed: bool) -> None:
    solids, poses = cubes(4, size, is_posed)
    found = collide_scene(solids, poses)
    for first, second, relation in zip(found.first.tolist(), found.second.tolist(), found.relation.tolist()):
        alone = collide(solids[first], solids[second], first_pose=poses[first], second_pose=poses[second])
        assert alone.relation == relation
    if size in (1.0, 0.5):  # nothing is rounded
        assert (found.relation == Relation.TOUCHING).all()
        assert len(found.first) == ((3 * 4 - 2) ** 3 - 4**3) // 2


def test_cubes_on_a_grid_are_left_to_nobody() -> None:
    solids, poses = cubes(3, 1.0, False)
    pairs = np.array(list(itertools.combinations(range(27), 2)))
    batches = SceneBatches(scene_bodies(solids, poses))
    for boolean in (False, True):
        relations = batches.relations(pairs, boolean, False, UNLIMITED, 1)
        assert not (relations == UNSETTLED).any()
        for (i, j), relation in zip(pairs.tolist(), relations.tolist()):
            assert (relation == Relation.TOUCHING) == (np.abs(solids[i].vertices[0] - solids[j].vertices[0]).max() <= 1)


@pytest.mark.parametrize("seed", range(3))
def test_lattice_bodies_in_any_position(seed: int) -> None:
    rng = np.random.default_rng(seed)
    solids, poses = [], list[Pose | None]()
    for _ in range(60):
        corners = np.array(CORNERS) * rng.integers(1, 3, 3)
        if rng.random() < 0.4:  # a corner cut off at the middles of edges, or a body turned inside out
            corners = corners.copy()
            corners[7] = corners[[3, 5, 6]].mean(axis=0) if rng.random() < 0.5 else corners[7]
        faces = [face[::-1] for face in QUADS] if rng.random() < 0.3 else QUADS
        solids.append(Polyhedron(corners + rng.integers(-2, 3, 3), faces if (corners[7] % 1 == 0).all() else QUADS))
        turn = TURNS[rng.integers(len(TURNS))]
        poses.append(Pose(turn, rng.integers(-1, 2, 3) * 1.0) if rng.random() < 0.6 else None)
    found = collide_scene(solids, poses)
    told = {(i, j): r for i, j, r in zip(found.first.tolist(), found.second.tolist(), found.relation.tolist())}
    for i, j in itertools.combinations(range(60), 2):
        alone = collide(solids[i], solids[j], first_pose=poses[i], second_pose=poses[j])
        assert told.get((i, j), Relation.DISJOINT) == alone.relation
