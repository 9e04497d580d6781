"""Trees of boxes and of discs."""

from __future__ import annotations

import time

import numba
import numpy as np
import pytest

from engine import Surface
from engine.bounding.bvh import MAX_DEPTH, UNUSED, WIDTH, Bvh
from engine.bounding.trees import MANY, build_balanced_bvh, build_bvh, build_stretched_bvh
from engine.collision.meshes.mesh_arrays import MeshBody, mesh_body_of
from engine.errors import CancelledError, DeadlineExceededError
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
    boxes, cancel = random_boxes(1000, 1.0, 0), Cancel()
    cancel.set()
    with Budget(cancel=cancel), Budget(), pytest.raises(CancelledError):
        build_bvh(boxes)


@pytest.mark.parametrize("many", [MANY, 1000])
def test_building_ends_soon_after_the_deadline(many: int) -> None:
    boxes = random_boxes(400_000, 1.0, 0)
    build_bvh(boxes[:2000], many=1000)
    before = time.thread_time()
    with Budget(deadline=0.02), pytest.raises(DeadlineExceededError):
        build_bvh(boxes, many=many)
    assert time.thread_time() - before < 0.1


def nodes_of(tree: Bvh) -> set[tuple[bytes, frozenset[int]]]:
    """Return the boxes of all nodes, with the items of each block, whatever their order."""
    return {
        ((np.sort(boxes, axis=1) + 0.0).tobytes(), frozenset(child[child < 0].tolist() if child[0] < 0 else []))
        for boxes, child in zip(tree.boxes, tree.child)
    }


def shapes_of_boxes() -> dict[str, np.ndarray]:
    """Return boxes of which large trees are hard to divide."""
    spread, low = random_boxes(5000, 1.0, 3), np.random.default_rng(4).uniform(-1, 1, (5000, 3))
    crowded, alone = spread * 2.0**-40, spread.copy()
    crowded[:100] = spread[:100]
    alone[:] = spread[:1]
    ladder = np.repeat(2.0 ** np.arange(0, 500, 0.1)[:, None], 6, axis=1) * [0, 0, 0, 1, 1, 1]
    flat = np.concatenate([low, low], axis=1) * [1, 1, 0, 1, 1, 0]
    return {"spread": spread, "crowded": crowded, "in one place": alone, "ladder": ladder, "flat": flat}


@pytest.mark.parametrize("name", shapes_of_boxes())
def test_a_tree_built_on_threads_has_the_nodes_of_another(name: str) -> None:
    boxes = shapes_of_boxes()[name]
    tree, other = build_bvh(boxes, many=500), build_bvh(boxes)
    check_tree(boxes, tree)
    if name not in ("in one place", "ladder"):  # case: runs are split in the middle, by order
        assert nodes_of(tree) == nodes_of(other)
    assert len(other.parts) == 2 < len(tree.parts)
    assert numba.typeof(tree) == numba.typeof(other)  # kernels take it, for which they are compiled
    place, start = tree.parts[0].tolist()
    assert [start, *tree.parts[-1].tolist()] == [0, len(tree.child), len(boxes)]
    assert (tree.child[:place] >= 0)[:, 0].all()
    for (first, item), (last, end) in zip(tree.parts, tree.parts[1:]):
        own = tree.child[first:last]
        assert sorted(own[own >= 0].tolist()) == list(range(first + 1, last))  # whole, apart from the others
        assert ((own < 0) & (own != EMPTY)).sum() == end - item


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
    tree, origin, scale, _ = build_stretched_bvh(np.concatenate([low, high], axis=1))
    assert (np.frexp(scale)[0] == 0.5).all()
    extents = (high.max(axis=0) - low.min(axis=0)) / scale
    assert extents.max() <= 4.0
    assert extents.min() > 2.0**-6 or units[2] in (2.0**-200, 1e-150)
    for node, lane in zip(*np.nonzero((tree.child < 0) & (tree.child != EMPTY))):
        item = -1 - tree.child[node, lane]
        centre, half = tree.boxes[node, :3, lane].astype(float), tree.boxes[node, 3:, lane].astype(float)
        assert (centre - half <= (low[item] - origin) / scale).all()
        assert (centre + half >= (high[item] - origin) / scale).all()
