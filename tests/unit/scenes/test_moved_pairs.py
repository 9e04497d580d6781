"""Boxes of bodies, and the pairs of those that moved."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, Csg, HalfSpace, Polygon, Pose, Scene, Solid, Sphere, Triangle
from engine.containment.methods.rational_locate import no_check, to_world_frame
from engine.running.budget import Budget
from engine.scenes.bodies import body_box
from engine.scenes.near_boxes import scratch_for
from engine.scenes.placements import PairRows, Placed, list_pairs
from tests.unit.containment.scenes import box_mesh, made


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("reach", [0.0, 0.5])
def test_pairs_are_those_whose_boxes_meet(dimension: int, reach: float) -> None:
    rng, n, room = np.random.default_rng([dimension, int(2 * reach)]), 40, 400
    box, turn = Aabb([0] * dimension, [1] * dimension), np.eye(dimension)
    places = np.round(rng.uniform(0, 5, (n, dimension)) * 2) / 2
    before = [Pose(turn, place) for place in places]
    moved = {int(body): Pose(turn, places[body] + 1.5) for body in rng.choice(n, 9, replace=False)}
    for poses in ({}, moved):
        placements = Scene([box] * n, before).moved(poses)._placements
        named = np.unique(rng.integers(0, n, 12))
        rows = PairRows(
            np.empty(room, np.int64),
            np.empty(2 * room + 1, np.int64),
            np.empty((2 * room + 1, dimension, dimension)),
            np.empty((2 * room + 1, dimension)),
        )
        with Budget() as budget:
            arrays = placements.base.arrays(budget)
            still = Placed(arrays.kinds, arrays.rotations, arrays.translations)
            moves = Placed(arrays.kinds, *placements.placed_numbers(budget)[1:])
            scratch, where = scratch_for(placements.n_rows), placements.where(budget)
            n_pairs = list_pairs(
                named, reach, where, still, moves, rows, scratch, np.empty((2, dimension)), budget.flag
            )
            low, high = placements.boxes(budget).transpose(1, 0, 2)
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
            assert rows.translations[row].tolist() == placements.pose(body).translation.tolist()  # type: ignore[union-attr]
        assert rows.rotations[0].tolist() == np.eye(dimension).tolist()


@pytest.mark.parametrize("unit", [5e-324, 2.0**-1040, 2.0**-1020, 1e300])
def test_new_pairs_of_bodies_so_small_that_the_scale_of_their_tree_has_no_inverse(unit: float) -> None:
    """A box beside another was reported infinitely far away."""
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


# --- Boxes of single bodies hold all of their points ---


POSE = Pose([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]], [0.1, 1e9, -3])
FLAT = Pose([[0.6, -0.8], [0.8, 0.6]], [0.1, 1e-300])


@pytest.mark.parametrize("solid", [made(box_mesh([0, 0, 0], [1, 2, 3])), Polygon([[[0, 0], [3, 0], [1, 0.1]]])])
def test_images_of_vertices_are_in_the_box(solid: Polygon) -> None:
    pose = POSE if solid.dimension == 3 else FLAT
    low, high = body_box(solid, pose, no_check)
    for vertex in solid.vertices.tolist():
        image = to_world_frame(vertex, pose)
        assert all(a <= x <= b for a, x, b in zip(low.tolist(), image, high.tolist()))
    assert (high - low).max() < 10


@pytest.mark.parametrize("radius", [0.0, 0.1, 5e-324, 1e300])
def test_balls_grow_by_their_radius(radius: float) -> None:
    low, high = body_box(Sphere([0.1, 0.2, 0.3], radius), POSE, no_check)
    center = to_world_frame([0.1, 0.2, 0.3], POSE)
    assert all(a <= x - int(radius) <= x + int(radius) <= b for a, x, b in zip(low.tolist(), center, high.tolist()))
    assert body_box(Sphere([0, 0], 2.0), None, no_check)[1].min() >= 2.0


def test_what_has_no_bounds_has_an_infinite_box() -> None:
    for solid in (HalfSpace([1, 0, 0], 0), Triangle(np.eye(3))):
        assert np.isinf(body_box(solid, POSE, no_check)).all()
    assert np.isinf(body_box(Aabb([-1.7e308] * 3, [1.7e308] * 3), POSE, no_check)).any()


def test_trees_take_the_boxes_of_their_operands() -> None:
    first, second = Aabb([0, 0], [2, 2]), Aabb([1, 1], [3, 3])

    def box(operation: str, *operands: Solid) -> list[list[float]]:
        return [side.tolist() for side in body_box(Csg(operation, operands), None, no_check)]

    assert box("union", first, second) == [[0, 0], [3, 3]]
    assert box("intersection", first, second) == [[1, 1], [2, 2]]
    assert box("difference", first, second) == [[0, 0], [2, 2]]
    assert box("union", Csg("difference", [first, second]), HalfSpace([1, 0], 0)) == [[-np.inf] * 2, [np.inf] * 2]
