"""Trees of boxes and of discs."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Surface
from engine.bounding import bvh
from engine.bounding.bvh import MAX_DEPTH, UNUSED, WIDTH, Bvh, build_balanced_bvh, build_bvh, build_stretched_bvh
from engine.collision.meshes.mesh_arrays import MeshBody, mesh_body_of
from engine.errors import CancelledError
from engine.lanes.boxes import EMPTY
from engine.running.budget import Budget, Cancel


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


@pytest.mark.parametrize("stretch", [(1, 1, 1), (1e5, 1, 1), (1, 1e-7, 1e3), (1, 0, 1e-40), (1e200, 1, 1e-200)])
def test_every_item_once_in_a_balanced_tree(stretch: tuple[float, float, float]) -> None:
    boxes = random_boxes(1000, 1.0, 7) * np.tile(stretch, 2)
    tree = build_balanced_bvh(boxes.copy())
    check_tree(boxes, tree)
    assert tree.scale == build_bvh(boxes).scale


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


# --- The flat cylinders of a tree hold the faces below their children, and are flat where these are ---


def faces_below(mesh: MeshBody, node: int) -> list[int]:
    """Return the triangles below a node."""
    child = mesh.arrays.child[node]
    if child[0] < 0:
        return [-1 - int(item) for item in child if item != EMPTY]
    return [face for below in child if below != EMPTY for face in faces_below(mesh, int(below))]


def surfaces() -> dict[str, Surface]:
    rng = np.random.default_rng(5)
    x, y = (values.ravel() for values in np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9)))
    cells = np.array([9 * row + column for row in range(8) for column in range(8)])
    faces = np.concatenate([np.stack([cells, cells + 1, cells + 10], 1), np.stack([cells, cells + 10, cells + 9], 1)])
    across, up = np.pi * x, 0.5 * np.pi * y
    sphere = np.stack([np.cos(up) * np.cos(across), np.cos(up) * np.sin(across), np.sin(up)], 1)
    return {
        "flat": Surface(np.stack([x, y, x + 2 * y], 1), faces),
        "waves": Surface(np.stack([x, y, 0.1 * np.sin(5 * x) * np.cos(4 * y)], 1), faces),
        "line": Surface(np.stack([x, 2 * x, 3 * x], 1), faces),
        "soup": Surface(rng.normal(size=(300, 3)), np.arange(300).reshape(-1, 3)),
        "sphere": Surface(sphere, faces),
    }


@pytest.mark.parametrize("name", surfaces())
def test_a_disc_holds_the_faces_of_its_child(name: str) -> None:
    mesh = mesh_body_of(surfaces()[name])
    arrays = mesh.arrays
    local = (arrays.vertices - arrays.origin) / arrays.scale
    for node in range(len(arrays.child)):
        for lane in range(8):
            below = int(arrays.child[node, lane])
            if below < 0:
                continue
            disc = arrays.discs[node, :, lane].astype(float)
            n = disc[3:6] / np.linalg.norm(disc[3:6])
            away = local[arrays.triangles[faces_below(mesh, below)]].reshape(-1, 3) - disc[:3]
            along = away @ n
            assert (np.abs(along) <= disc[7]).all()
            assert (np.linalg.norm(away - along[:, None] * n, axis=1) <= disc[6]).all()
            assert name != "flat" or disc[7] < 1e-5


@pytest.mark.parametrize("units", [[1.0, 1.0, 1.0], [1e5, 1.0, 1e-3], [1.0, 2.0**-90, 2.0**-200], [1e150, 1.0, 1e-150]])
def test_stretched_trees_have_axes_of_about_one_length(units: list[float]) -> None:
    """Powers of two, so that boxes are where they were; every leaf holds its item in the coordinates of its axis."""
    low = np.random.default_rng(2).uniform(-1, 1, (200, 3)) * units
    high = low + 0.01 * np.array(units)
    tree, origin, scale = build_stretched_bvh(np.concatenate([low, high], axis=1))
    assert (np.frexp(scale)[0] == 0.5).all()
    extents = (high.max(axis=0) - low.min(axis=0)) / scale
    assert extents.max() <= 4.0
    assert extents.min() > 2.0**-6 or units[2] in (2.0**-200, 1e-150)
    for node, lane in zip(*np.nonzero((tree.child < 0) & (tree.child != EMPTY))):
        item = -1 - tree.child[node, lane]
        centre, half = tree.boxes[node, :3, lane].astype(float), tree.boxes[node, 3:, lane].astype(float)
        assert (centre - half <= (low[item] - origin) / scale).all()
        assert (centre + half >= (high[item] - origin) / scale).all()
