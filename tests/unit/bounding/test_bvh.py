"""The tree holds every item once, in boxes that contain it, at bounded depth."""

from __future__ import annotations

import numpy as np
import pytest

from engine.bounding.bvh import MAX_DEPTH, Bvh, build_bvh


def check_tree(boxes: np.ndarray, tree: Bvh) -> None:
    found, waiting = [], [(0, 0)]
    while waiting:
        node, depth = waiting.pop()
        assert depth < MAX_DEPTH
        child = tree.child[node]
        if child < 0:
            found.append(-1 - child)
            assert np.array_equal(tree.boxes[node], boxes[-1 - child])
            continue
        assert child > node
        union = np.concatenate(
            [
                np.minimum(tree.boxes[child, :3], tree.boxes[child + 1, :3]),
                np.maximum(tree.boxes[child, 3:], tree.boxes[child + 1, 3:]),
            ]
        )
        assert np.array_equal(union, tree.boxes[node])
        waiting += [(child, depth + 1), (child + 1, depth + 1)]
    assert sorted(found) == list(range(len(boxes)))


def random_boxes(n_items: int, scale: float, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    low = rng.uniform(-1, 1, (n_items, 3)) * scale
    return np.concatenate([low, low + rng.uniform(0, 0.1, (n_items, 3)) * scale], axis=1)


@pytest.mark.parametrize("scale", [1.0, 1e300, 1.7e308, 1e-300, 5e-324])
@pytest.mark.parametrize("n_items", [1, 2, 3, 500])
def test_every_item_once(n_items: int, scale: float) -> None:
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        boxes = np.clip(random_boxes(n_items, scale, n_items), -1.7e308, 1.7e308)
        check_tree(boxes, build_bvh(boxes))


def test_equal_centres_and_geometric_sizes_stay_shallow() -> None:
    boxes = np.array([[-(2.0**k), -1, -1, 2.0**k, 1, 1] for k in range(-500, 500)])
    check_tree(boxes, build_bvh(boxes))
    ladder = np.array([[2.0**k, 0, 0, 2.0 ** (k + 1), 1, 1] for k in range(-500, 500)])
    check_tree(ladder, build_bvh(ladder))
