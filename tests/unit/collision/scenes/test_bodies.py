"""The bodies of a scene as arrays: kinds, poses, boxes around them."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, Pose, Sphere, WrongDimensionError
from engine.collision.scenes.batches import distinct_of, scene_bodies

TURN = Pose([[0, -1], [1, 0]], [5, 0])


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
