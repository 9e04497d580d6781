"""Eight boxes against eight: compiled lanes and their plain twins say the same."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine.jit import kernel
from engine.lanes.boxes import (
    FRAME_ROWS,
    inside_box,
    lowest_bit,
    meeting,
    plain_inside_box,
    plain_lowest_bit,
    plain_meeting,
)


@kernel
def ask(first: Any, second: Any, frames: Any, found: Any) -> None:
    for item in range(found.shape[0]):
        found[item, 0], found[item, 1] = meeting(first, item, second, item, frames)


@kernel
def ask_box(boxes: Any, low: Any, high: Any, found: Any) -> None:
    for item in range(found.shape[0]):
        found[item, 0] = inside_box(boxes, item, (low[0], low[1], low[2]), (high[0], high[1], high[2]))
        found[item, 1] = lowest_bit(found[item, 0] | 256)


def random_boxes(n_nodes: int, rng: np.random.Generator) -> np.ndarray:
    boxes = rng.uniform(-1, 1, (n_nodes, 6, 8)).astype(np.float32)
    boxes[:, 3:] = np.abs(boxes[:, 3:]) * 0.2
    boxes[:, :3, 6:], boxes[:, 3:, 6:] = 0.0, -1e30  # unused lanes
    return boxes


@pytest.mark.parametrize("seed", range(3))
def test_lanes_equal_their_twins(seed: int) -> None:
    rng = np.random.default_rng(seed)
    first, second = random_boxes(200, rng), random_boxes(200, rng)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    frames = np.zeros((2, FRAME_ROWS, 8), np.float32)
    for which, matrix in enumerate((turn, turn.T)):
        frames[which, :9] = matrix.reshape(9, 1)
        frames[which, 9:18] = np.abs(matrix.reshape(9, 1))
        frames[which, 21] = 1e-6
    found = np.zeros((200, 2), np.int64)
    ask(first, second, frames, found)
    expected = [plain_meeting(first, item, second, item, frames) for item in range(200)]
    assert found.tolist() == [list(pair) for pair in expected]
    assert 0 < np.count_nonzero(found) < found.size
    assert all((pair[1] >> 16) == 0 and (pair[0] & 0xC0C0C0C0) == 0 for pair in expected)
    low, high = np.array([-0.3, -0.2, -1], np.float32), np.array([0.4, 0.3, 1], np.float32)
    ask_box(first, low, high, found)
    for item in range(200):
        lanes = plain_inside_box(first, item, low, high)
        assert found[item].tolist() == [lanes, plain_lowest_bit(lanes | 256)]
