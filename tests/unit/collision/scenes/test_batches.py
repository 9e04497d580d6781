"""What the batches answer of a scene is what single pairs say; contacts of meshes they leave."""

from __future__ import annotations

import numpy as np

from engine import Aabb, Pose, Relation, Solid, Sphere, Surface, collide
from engine.collision.codes import UNSETTLED
from engine.collision.scenes.batches import SceneBatches, scene_bodies
from engine.running.budget import Budget


def test_agrees_with_single_pairs_where_it_answers() -> None:
    rng = np.random.default_rng(5)
    shapes: list[Solid] = [Aabb([0, 0, 0], [1, 1, 1]), Sphere([0, 0, 0], 1), Surface(np.eye(3), [[0, 1, 2]])]
    solids = [shapes[k % 3] for k in range(24)]
    turns, _ = np.linalg.qr(rng.normal(size=(24, 3, 3)))
    turns *= np.sign(np.linalg.det(turns))[:, None, None]
    poses = [None if k % 4 == 0 else Pose(turns[k], rng.normal(size=3)) for k in range(24)]
    pairs = np.array([(i, j) for i in range(24) for j in range(i + 1, 24)])
    with Budget(None, None) as budget:
        batches = SceneBatches(scene_bodies(solids, poses))
        found = batches.relations(pairs, False, False, budget, None)
    has_surface = (pairs % 3 == 2).any(axis=1)
    assert (found[has_surface] == UNSETTLED).all()
    assert (found[~has_surface] != UNSETTLED).mean() > 0.9
    for (i, j), how in zip(pairs.tolist(), found.tolist()):
        if how != UNSETTLED:
            assert how == collide(solids[i], solids[j], first_pose=poses[i], second_pose=poses[j]).relation


def test_many_equal_balls_and_boxes_are_decided_unless_their_detail_is_asked() -> None:
    solids: list[Solid] = [Sphere([1, 2, 3], 1) for _ in range(4)]
    box = Aabb([0, 0, 0], [1, 2, 3])
    turn = Pose([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]], [0.1, 0.2, 0.3])
    bodies = scene_bodies([*solids, box, box], [None, None, turn, turn, turn, turn])
    pairs = np.array([(0, 1), (2, 3), (4, 5)])
    for detail in (False, True):
        with Budget(None, None) as budget:
            found = SceneBatches(bodies).relations(pairs, False, detail, budget, None)
        assert (found == (UNSETTLED if detail else Relation.OVERLAPPING)).all()
