"""Pairs with a named body are those whose boxes meet, each once, and their rows say where the bodies stand."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, Pose, Scene
from engine.parallel import Budget
from engine.scenes.moved_pairs import PairRows, Placed, list_pairs
from engine.scenes.posed_mesh import scratch_for


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
