"""The tree holds every item once, in boxes that contain it, at bounded depth."""

from __future__ import annotations

import numpy as np
import pytest

from engine.bounding import bvh
from engine.bounding.bvh import MAX_DEPTH, UNUSED, WIDTH, Bvh, build_bvh
from engine.budget import Budget, Cancel
from engine.errors import CancelledError
from engine.lanes.boxes import EMPTY


def check_tree(boxes: np.ndarray, tree: Bvh) -> None:
    """Every item once, within the box of its lane and of every lane above it."""
    found, waiting = [], [(0, 0, [])]
    while waiting:
        node, depth, above = waiting.pop()
        assert depth < MAX_DEPTH
        assert tree.child[node, 0] != EMPTY
        for lane in range(WIDTH):
            child = tree.child[node, lane]
            half = tree.boxes[node, 3:, lane].astype(float)
            if child == EMPTY:
                assert (half == UNUSED).all()
                continue
            around = [*above, (tree.boxes[node, :3, lane].astype(float), half)]
            assert (child < 0) == (tree.child[node, 0] < 0)
            if child >= 0:
                assert child > node
                waiting.append((int(child), depth + 1, around))
                continue
            found.append(-1 - child)
            with np.errstate(all="ignore"):
                low, high = ((end / tree.scale - tree.origin / tree.scale) for end in np.split(boxes[-1 - child], 2))
            for centre, half in around:
                assert (centre - half <= low).all()
                assert (high <= centre + half).all()
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


def test_building_looks_at_every_budget_around_it() -> None:
    boxes, cancel = random_boxes(50_000, 1.0, 0), Cancel()
    cancel.set()
    with Budget(cancel=cancel), Budget(), pytest.raises(CancelledError):
        build_bvh(boxes)


def test_a_tree_is_built_in_many_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[None] = []
    monkeypatch.setattr(bvh, "poll", lambda: steps.append(None))
    build_bvh(random_boxes(100_000, 1.0, 0))
    assert len(steps) > 5
