"""Eight boxes against a segment: no contact is missed, and each lane says what its axes say."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.bounding.trees import build_bvh
from engine.compiling.jit import kernel
from engine.lanes.boxes import enter_boxes
from engine.segment_clipping.on_boundary.descent import local_segment
from engine.types import Point3

Floats = np.ndarray


def test_touching_boxes_are_near() -> None:
    """Points of a segment make boxes that it touches, however long or short it is."""
    rng = np.random.default_rng(1)
    for size in (1e-9, 1.0, 1e3, 1e9):
        p, q = rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3)
        inside = p + rng.uniform(0, 1, (64, 1)) * (q - p)
        low, high = inside - rng.uniform(0, 0.1, (64, 3)), inside + rng.uniform(0, 0.1, (64, 3))
        p, q = p - size * (q - p), q + size * (q - p)
        tree = build_bvh(np.concatenate([low, high], axis=1))
        way = local_segment(Point3(*p), Point3(*q), tree.origin, np.full(3, 1.0 / tree.scale), 0.0)
        assert way.is_near
        entered = np.empty((1, 8), np.float32)
        for node in range(len(tree.child)):
            used = sum(1 << lane for lane in np.flatnonzero(tree.boxes[node, 3] >= 0))
            assert enter_boxes(tree.boxes, node, way.middle, way.inverse, way.slack, np.float32(1), entered) == used


@kernel
def asked(boxes: Any, numbers: Any, entered: Any, found: Any) -> None:
    m, e, rest = numbers[0], numbers[1], numbers[2]
    for node in range(len(boxes)):
        found[node] = enter_boxes(boxes, node, (m[0], m[1], m[2]), (e[0], e[1], e[2]), rest[0], rest[1], entered)


def is_entered(box: Floats, m: Floats, inverse: Floats, slack: float, last: float) -> bool:
    """Tell whether a segment enters all three slabs of a box before it leaves one, and before `last`."""
    first, end = np.float32(-1.0), last
    for k in range(3):
        centre, reach = (box[k] - m[k]) * inverse[k], (box[3 + k] + slack) * abs(inverse[k])
        first = centre - reach if centre - reach > first else first
        end = centre + reach if centre + reach < end else end
    return not first > end


def test_each_lane_says_what_its_slabs_say() -> None:
    rng = np.random.default_rng(4)
    boxes = rng.uniform(-1, 1, (300, 6, 8)).astype(np.float32)
    boxes[::9, 1] = [np.nan, np.inf, -np.inf, 0.0, -0.0, 1e-45, 3e38, -1e30]
    numbers, found = rng.uniform(-1, 1, (3, 3)).astype(np.float32) * np.float32(0.3), np.zeros(300, np.int64)
    entered = np.empty((1, 8), np.float32)
    for turn in range(4):
        numbers[1, turn - 1] = [0.0, 1e-45, np.inf, np.nan][turn]
        asked(boxes, numbers, entered, found)
        with np.errstate(all="ignore"):
            for node, lanes in enumerate(found.tolist()):
                are_in = [is_entered(box, numbers[0], numbers[1], *numbers[2, :2]) for box in boxes[node].T]
                assert lanes == sum(1 << lane for lane, is_in in enumerate(are_in) if is_in)
                if node % 16 == 0:
                    given = tuple(numbers[0]), tuple(numbers[1]), *numbers[2, :2]
                    assert enter_boxes(boxes, node, *given, entered) == lanes
        assert len(set(found.tolist())) > 5
