"""Pairs with a named body are those whose boxes meet, each once, and their rows say where the bodies stand."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, Pose, Scene
from engine.budget import Budget
from engine.scenes.scratch import scratch_for
from engine.scenes.standing import PairRows, Placed, list_pairs


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("reach", [0.0, 0.5])
def test_pairs_are_those_whose_boxes_meet(dimension: int, reach: float) -> None:
    rng, n, room = np.random.default_rng([dimension, int(2 * reach)]), 40, 400
    box, turn = Aabb([0] * dimension, [1] * dimension), np.eye(dimension)
    places = np.round(rng.uniform(0, 5, (n, dimension)) * 2) / 2
    before = [Pose(turn, place) for place in places]
    moved = {int(body): Pose(turn, places[body] + 1.5) for body in rng.choice(n, 9, replace=False)}
    for poses in ({}, moved):
        standing = Scene([box] * n, before).moved(poses)._standing
        named = np.unique(rng.integers(0, n, 12))
        rows = PairRows(
            np.empty(room, np.int64),
            np.empty(2 * room + 1, np.int64),
            np.empty((2 * room + 1, dimension, dimension)),
            np.empty((2 * room + 1, dimension)),
        )
        with Budget() as budget:
            arrays = standing.base.arrays(budget)
            still = Placed(arrays.kinds, arrays.rotations, arrays.translations)
            moves = Placed(arrays.kinds, *standing.placed_numbers(budget)[1:])
            scratch, where = scratch_for(standing.n_rows), standing.where(budget)
            n_pairs = list_pairs(
                named, reach, where, still, moves, rows, scratch, np.empty((2, dimension)), budget.flag
            )
            low, high = standing.boxes(budget).transpose(1, 0, 2)
        meet = ((low[:, None] <= high + reach) & (low <= high[:, None] + reach)).all(axis=2)
        expected = {(min(i, j), max(i, j)) for i in named.tolist() for j in range(n) if i != j and meet[i, j]}
        pairs = [divmod(key, n) for key in rows.keys[:n_pairs].tolist()]
        assert len(pairs) == len(set(pairs)) <= room
        assert expected <= set(pairs)
        far = {
            pair
            for pair in set(pairs) - expected
            if (low[list(pair)].max(0) - high[list(pair)].min(0) > 1.01 * reach).any()
        }
        assert not far
        for row, body in enumerate(np.array(pairs).ravel().tolist(), 1):
            assert rows.translations[row].tolist() == standing.pose(body).translation.tolist()  # type: ignore[union-attr]
        assert rows.rotations[0].tolist() == np.eye(dimension).tolist()


@pytest.mark.parametrize("unit", [5e-324, 2.0**-1040, 2.0**-1020, 1e300])
def test_new_pairs_of_bodies_so_small_that_the_scale_of_their_tree_has_no_inverse(unit: float) -> None:
    """A box beside another was told to be infinitely far away."""
    rng = np.random.default_rng(3)
    lows = rng.integers(-6, 7, (30, 2)) * unit
    scene = Scene([Aabb(low, low + rng.integers(1, 4, 2) * unit) for low in lows])
    moved = scene.moved({4: Pose(np.eye(2), [unit, -unit])})
    every, new = moved.collide(), moved.collide(moved=[4])
    rows = (every.first == 4) | (every.second == 4)
    assert rows.any()
    for name in ("first", "second", "relation"):
        assert getattr(new, name).tolist() == getattr(every, name)[rows].tolist()
    points = np.concatenate([lows, lows + unit])
    few, many = moved.locate(points[:3]), moved.locate(points)
    assert few.indices.tolist() == many.indices[: many.offsets[3]].tolist()
