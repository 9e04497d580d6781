"""What the batches answer of a scene is what single pairs say; contacts of meshes they leave."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, Pose, Relation, Solid, Sphere, Surface, WrongDimensionError, collide
from engine.collision.batches import SceneBatches, distinct_of, scene_bodies
from engine.collision.codes import UNSETTLED
from engine.running.budget import Budget

TURN = Pose([[0, -1], [1, 0]], [5, 0])


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


def test_one_object_is_one_kind_and_boxes_hold_the_bodies() -> None:
    box, ball = Aabb([0, 0], [2, 1]), Sphere([0, 0], 1)
    bodies = scene_bodies([box, ball, box], [None, TURN, TURN])
    assert bodies.kinds.tolist() == [0, 1, 0]
    assert bodies.is_posed.tolist() == [False, True, True]
    assert bodies.rotations[0].tolist() == bodies.rotations[1].tolist() == [[1, 0], [0, 1]]
    assert bodies.translations[2:].tolist() == [[5, 0], [5, 0]]
    assert (bodies.low[0].tolist(), bodies.high[0].tolist()) == ([0, 0], [2, 1])
    assert np.allclose(bodies.low[1:], [[4, -1], [4, 0]])
    assert np.allclose(bodies.high[1:], [[6, 1], [5, 2]])
    assert (bodies.low[1:] <= [[4, -1], [4, 0]]).all()


def test_no_bodies_and_wrong_dimensions() -> None:
    assert scene_bodies([], None).low.shape == (0, 3)
    with pytest.raises(WrongDimensionError, match=r"poses\[1\]"):
        scene_bodies([Sphere([0, 0, 0], 1)] * 2, [None, TURN])


@pytest.mark.parametrize("n", [0, 1, 1000])
def test_solids_are_numbered_in_the_order_in_which_they_first_appear(n: int) -> None:
    solids = [Sphere([0, 0, 0], 1) for _ in range(50)]
    bodies = [solids[k] for k in np.random.default_rng(n).integers(0, 50, n)]
    distinct, kinds = distinct_of(bodies)
    places: dict[int, int] = {}
    assert kinds.tolist() == [places.setdefault(id(body), len(places)) for body in bodies]
    assert [id(solid) for solid in distinct] == list(places)
