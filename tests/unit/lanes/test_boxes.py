"""Eight boxes against eight: in compiled code and in Python what tables of all pairs say."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine.compiling.jit import kernel
from engine.lanes.boxes import FRAME_ROWS, exchange, fill, inside_box, join, meeting
from engine.lanes.lanes import lowest_bit


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


def apart_on_axes(a: np.ndarray, b: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """Return (8, 8): is lane a apart from the image of lane b on an axis of a?"""
    matrix, sizes, shift = frame[:9].reshape(3, 3, 8), frame[9:18].reshape(3, 3, 8), frame[18:21]
    centre = matrix[:, 0] * b[0] + matrix[:, 1] * b[1] + matrix[:, 2] * b[2] + shift
    half = sizes[:, 0] * b[3] + sizes[:, 1] * b[4] + sizes[:, 2] * b[5] + frame[21]
    is_above = (centre - half)[:, None, :] > (a[:3] + a[3:])[:, :, None]
    is_below = (a[:3] - a[3:])[:, :, None] > (centre + half)[:, None, :]
    return (is_above | is_below).any(axis=0)


def table_of(a: np.ndarray, b: np.ndarray, frames: np.ndarray) -> list[int]:
    with np.errstate(all="ignore"):
        apart = apart_on_axes(a, b, frames[0]) | apart_on_axes(b, a, frames[1]).T
    bits = sum(1 << place for place in np.flatnonzero(~apart).tolist())
    return [bits & 0xFFFFFFFF, bits >> 32]


@pytest.mark.parametrize("seed", range(3))
def test_lanes_say_what_tables_of_pairs_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    first, second = random_boxes(200, rng), random_boxes(200, rng)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    frames = np.zeros((2, FRAME_ROWS, 8), np.float32)
    for which, matrix in enumerate((turn, turn.T)):
        frames[which, :9] = matrix.reshape(9, 1)
        frames[which, 9:18] = np.abs(matrix.reshape(9, 1))
        frames[which, 21:] = 1e-6
    first[3, :, 2], second[5, 4, :3] = np.nan, np.inf
    second[6, 0] = [0.0, -0.0, 1e-45, -1e-45, np.inf, -np.inf, np.nan, 3e38]
    found = np.zeros((200, 2), np.int64)
    ask(first, second, frames, found)
    expected = [table_of(first[item], second[item], frames) for item in range(200)]
    assert found.tolist() == expected
    assert [list(meeting(first, item, second, item, frames)) for item in range(20)] == expected[:20]
    assert 0 < np.count_nonzero(found) < found.size
    assert all((pair[1] >> 16) == 0 and (pair[0] & 0xC0C0C0C0) == 0 for pair in expected[7:])
    low, high = np.array([-0.3, -0.2, -1], np.float32), np.array([0.4, 0.3, 1], np.float32)
    ask_box(first, low, high, found)
    for item in range(200):
        b = first[item]
        meets = ~((b[:3] - b[3:] > high[:, None]) | (low[:, None] > b[:3] + b[3:])).any(axis=0)
        lanes = sum(1 << lane for lane in np.flatnonzero(meets).tolist())
        assert inside_box(first, item, tuple(low), tuple(high)) == lanes
        assert found[item].tolist() == [lanes, np.flatnonzero([*meets, True])[0]]


@kernel
def _work(rows: Any, others: Any) -> None:
    join(rows, 0, others, 1)
    exchange(rows, 1, 2)
    exchange(rows, 3, 3)
    fill(rows, 4, np.float32(np.inf))
    join(rows, 4, others, 0)


def test_rows_are_joined_exchanged_and_filled() -> None:
    random = np.random.default_rng(0)
    before, others = (random.normal(size=(n, 8)).astype(np.float32) for n in (5, 2))
    wanted = np.array([np.minimum(before[0], others[1]), before[2], before[1], before[3], others[0]])
    for work in (_work, getattr(_work, "py_func", _work)):
        rows = before.copy()
        work(rows, others)
        assert (rows == wanted).all()
