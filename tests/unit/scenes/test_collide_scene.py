"""Scenes: the pairs of the sweep are those of asking every pair, for every mix of bodies and poses."""

from __future__ import annotations

import random
import time
from functools import partial
from typing import Any

import numba
import numpy as np
import pytest

from engine import (
    Aabb,
    DeadlineExceededError,
    HalfSpace,
    IndexOutOfRangeError,
    InvalidArrayError,
    Polygon,
    Polyhedron,
    Pose,
    Relation,
    Sphere,
    Surface,
    Triangle,
    UnsupportedSolidError,
    WrongDimensionError,
)
from engine.bounding.box_grid import pairs_of_boxes
from engine.collision.collide import collide
from engine.collision.collide_poses import collide_poses
from engine.compiling.jit import KERNELS
from engine.errors import InvalidInputError
from engine.scenes.collide_scene import collide_scene
from tests.reference.shapes import box

EYE = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
TURN = [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]


def every_pair(solids: list, poses: list) -> list[tuple[int, int, int]]:
    found = []
    for i in range(len(solids)):
        for j in range(i + 1, len(solids)):
            relation = collide(solids[i], solids[j], first_pose=poses[i], second_pose=poses[j]).relation
            if relation != Relation.DISJOINT:
                found.append((i, j, int(relation)))
    return found


def as_list(pairs) -> list[tuple[int, int, int]]:
    return list(zip(pairs.first.tolist(), pairs.second.tolist(), pairs.relation.tolist()))


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_scene_is_every_pair(dimension: int) -> None:
    rng = random.Random(dimension)
    solids, poses = [], []
    for k in range(24):
        at = np.array([rng.randint(0, 8) for _ in range(dimension)], float)
        kind = k % 4
        if kind == 0:
            solids.append(Aabb(at, at + rng.randint(0, 3)))
        elif kind == 1:
            solids.append(Sphere(at, rng.choice([0.0, 1.0, 2.0])))
        elif kind == 2:
            solids.append(HalfSpace([1.0] * dimension, -float(rng.randint(16, 40))) if k == 2 else Aabb(at, at + 1))
        elif dimension == 2:
            solids.append(Triangle(at + np.array([[0, 0], [2, 0], [0, 2]])))
        else:
            solids.append(Aabb(at, at + 2))
        turn = [row[:dimension] for row in TURN[:dimension]]
        poses.append(Pose(turn, [1.0] * dimension) if k % 5 == 4 else None)
    assert as_list(collide_scene(solids, poses)) == every_pair(solids, poses)
    assert as_list(collide_scene(solids, poses, workers=1)) == as_list(collide_scene(solids, poses, workers=3))


def test_pairs_can_be_left_out_or_looked_at_alone() -> None:
    cubes = [Aabb([k, 0, 0], [k + 1, 1, 1]) for k in range(4)]
    assert as_list(collide_scene(cubes)) == [(0, 1, 4), (1, 2, 4), (2, 3, 4)]
    assert as_list(collide_scene(cubes, skip=[(2, 1)])) == [(0, 1, 4), (2, 3, 4)]
    assert as_list(collide_scene(cubes, only=[(2, 1), (0, 3)])) == [(1, 2, 4)]
    assert as_list(collide_scene(cubes, only=[])) == []


@pytest.mark.parametrize("name", ["only", "skip"])
def test_millions_of_named_pairs_end_at_the_deadline(name: str) -> None:
    """Sorting 4.5 million keys by np.unique took 4 s, in which nothing was asked."""
    cubes, pairs = [Aabb([0, 0, 0], [1, 1, 1])] * 3000, np.stack(np.triu_indices(3000, 1), axis=1)
    begun = time.perf_counter()
    options: Any = {name: pairs}
    with pytest.raises(DeadlineExceededError):
        collide_scene(cubes, deadline=0.05, **options)
    assert time.perf_counter() - begun < 2.0


def test_a_crowd_of_convex_bodies_under_poses_is_every_pair() -> None:
    rng = np.random.default_rng(3)
    corner = Polyhedron([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    kinds = [corner, Aabb([0, 0, 0], [1, 0.5, 0.25]), Aabb([0, 0, 0], [0.25, 0.25, 0.25]), corner]
    solids = [kinds[k % 4] for k in range(300)]
    poses = [
        None if k % 7 == 0 else Pose(TURN if k % 3 else EYE, np.round(rng.uniform(0, 4, 3) * 4) / 4) for k in range(300)
    ]
    pairs = collide_scene(solids, poses)
    only = rng.integers(0, 300, (60, 2))
    some = [(i, j) for i, j in zip(pairs.first.tolist(), pairs.second.tolist())][::25]
    for i, j in {*some, *((int(min(row)), int(max(row))) for row in only if row[0] != row[1])}:
        relation = collide(solids[i], solids[j], first_pose=poses[i], second_pose=poses[j]).relation
        assert dict(zip(zip(pairs.first.tolist(), pairs.second.tolist()), pairs.relation.tolist())).get(
            (i, j), 0
        ) == int(relation)
    assert set(pairs.relation.tolist()) >= {Relation.OVERLAPPING, Relation.TOUCHING}
    yes = collide_scene(solids, poses, boolean=True)
    assert (yes.first.tolist(), yes.second.tolist()) == (pairs.first.tolist(), pairs.second.tolist())
    assert (yes.relation == Relation.TOUCHING).all()


def test_ten_thousand_boxes_in_a_lattice_touch_their_neighbours() -> None:
    n = 22
    at = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    cubes = [Aabb(corner, corner + 1) for corner in at.astype(float)]
    pairs, report = collide_scene(cubes, report=True)
    neighbours = sum((n - (dx != 0)) * (n - (dy != 0)) * (n - (dz != 0)) for dx, dy, dz in np.ndindex(3, 3, 3)) - n**3
    assert len(pairs.first) == neighbours // 2 == report.n_items
    assert (pairs.relation == Relation.TOUCHING).all()


@pytest.mark.parametrize("options", [{}, {"boolean": True}, {"witnesses": True}, {"detail": True}])
def test_groups_of_pairs_are_decided_as_one_by_one(options: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Meshes that are not convex, balls and boxes, in contact too, posed, unposed and under the identity."""
    wedge = Polyhedron(
        [[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0], [0, 0, 1], [2, 0, 1], [2, 1, 1], [1, 1, 1],
         [1, 2, 1], [0, 2, 1]],
        [[5, 4, 3, 2, 1, 0], [6, 7, 8, 9, 10, 11], *([k, (k + 1) % 6, (k + 1) % 6 + 6, k + 6] for k in range(6))],
    )  # fmt: skip
    sheet = Surface([[0, 0, 0], [3, 0, 0], [0, 3, 0], [3, 3, 1]], [[0, 1, 2], [1, 3, 2]])
    kinds, rng = (
        [wedge, sheet, Sphere([0.5, 0.5, 0.5], 0.5), Aabb([0, 0, 0], [1, 1, 2]), wedge],
        np.random.default_rng(8),
    )
    kinds = kinds[:1] + kinds[2:] if "detail" in options else kinds
    solids = [kinds[k % len(kinds)] for k in range(160)]
    places = np.round(rng.uniform(0, 9, (160, 3)) * 2) / 2
    poses = [
        None if k % 9 == 0 else Pose(TURN if k % 2 else EYE, [0, 0, 0] if k % 11 == 0 else place)
        for k, place in enumerate(places)
    ]
    answers = collide_scene(solids, poses, workers=3, **options)
    assert len(set(answers.relation.tolist())) > 1 or "boolean" in options
    monkeypatch.setattr("engine.scenes.pair_groups._FEW", 10**9)
    alone = collide_scene(solids, poses, **options)
    assert as_list(answers) == as_list(alone)
    assert answers.witnesses == alone.witnesses
    for i, j, relation in as_list(answers)[::7]:
        one = collide(solids[i], solids[j], first_pose=poses[i], second_pose=poses[j])
        assert one.relation == relation or "boolean" in options


def test_pairs_found_in_several_blocks_are_sorted(monkeypatch: pytest.MonkeyPatch) -> None:
    at = np.random.default_rng(5).uniform(0, 8, (600, 3))
    solids = [Sphere(place, 0.5) for place in at]
    expected = collide_scene(solids, witnesses=True, detail=True)
    monkeypatch.setattr("engine.scenes.collide_scene.pairs_of_boxes", partial(pairs_of_boxes, block=50))
    found = collide_scene(solids, witnesses=True, detail=True)
    assert as_list(found) == as_list(expected) == sorted(as_list(expected))
    assert found.witnesses == expected.witnesses
    assert found.detail.tolist() == expected.detail.tolist()


def test_the_same_solid_many_times_counts_once_and_bad_poses_are_named() -> None:
    cube, ball = Aabb([0, 0, 0], [1, 1, 1]), Sphere([0, 0, 0], 1)
    steps = [Pose(EYE, [k, 0, 0]) for k in range(5)]
    assert as_list(collide_scene([cube, ball, cube, cube, ball], steps)) == every_pair(
        [cube, ball, cube, cube, ball], steps
    )
    with pytest.raises(WrongDimensionError, match=r"poses\[1\]"):
        collide_scene([cube, cube], [None, Pose(np.eye(2), [0, 0])])
    with pytest.raises(InvalidArrayError, match=r"poses\[1\]"):
        collide_scene([cube, cube], [steps[0], np.eye(3)])


def test_an_empty_scene_and_a_single_body_have_no_pairs() -> None:
    assert as_list(collide_scene([])) == []
    assert as_list(collide_scene([Sphere([0, 0], 1)])) == []


def test_bad_scenes_are_named() -> None:
    square = Polygon([[[0, 0], [1, 0], [1, 1]]])
    cube = Aabb([0, 0, 0], [1, 1, 1])
    with pytest.raises(WrongDimensionError) as caught:
        collide_scene([cube, square])
    assert caught.value.where == ("solids", 1)
    with pytest.raises(UnsupportedSolidError) as unsupported:
        collide_scene([cube, "cube"])
    assert unsupported.value.where == ("solids", 1)
    with pytest.raises(InvalidArrayError, match="as many"):
        collide_scene([cube], [None, None])
    with pytest.raises(IndexOutOfRangeError) as index:
        collide_scene([cube], skip=[(0, 5)])
    assert index.value.where == ("skip", 0)
    with pytest.raises(DeadlineExceededError):
        collide_scene([cube, cube], deadline=0.0)


def test_witnesses_come_with_the_pairs_when_asked_for() -> None:
    pairs = collide_scene([Sphere([0, 0, 0], 2), Sphere([0, 0, 0], 1)], witnesses=True)
    assert pairs.witnesses is not None
    assert pairs.witnesses[0] is not None
    assert (pairs.witnesses[0].kind, pairs.witnesses[0].containing) == ("containment", "first")


def test_a_flag_of_numpy_compiles_no_kernels_of_its_own() -> None:
    boxes = [Aabb([k, 0, 0], [k + 1, 1, 1]) for k in range(3)]
    turns, moves = np.eye(3)[None].repeat(20, axis=0), np.zeros((20, 3))
    kinds = []
    flag: Any
    for flag in (True, np.bool_(True)):
        pairs = collide_scene(boxes, [None, Pose(np.eye(3), [0.0, 0.0, 0.5]), None], boolean=flag)
        assert pairs.relation.astype(bool).all()
        assert collide_poses(boxes[0], boxes[1], turns, moves, boolean=flag).astype(bool).all()
        kinds.append([len(each.signatures) for each in KERNELS if not numba.config.DISABLE_JIT])
    assert kinds[0] == kinds[1]
    for flag in (1, "yes"):
        with pytest.raises(InvalidInputError, match="boolean must be True or False"):
            collide_scene(boxes, boolean=flag)
        with pytest.raises(InvalidInputError, match="boolean must be True or False"):
            collide_poses(boxes[0], boxes[1], turns, moves, boolean=flag)


def test_a_scene_in_which_all_meet_all_ends_at_its_deadline() -> None:
    solids = [Aabb([0, 0, 0], [1 + k, 1, 1]) for k in range(12_000)]  # 72 million pairs, 20 s
    collide_scene(solids[:3])  # compiles
    before = time.process_time()  # a busy machine may keep the call waiting
    with pytest.raises(DeadlineExceededError):
        collide_scene(solids, deadline=0.2)
    assert time.process_time() - before < 5


def test_few_bodies_lie_to_each_other_as_two_alone_do(seed: str) -> None:
    source = random.Random(f"few bodies {seed}")
    for _ in range(200):
        solids = []
        for _ in range(source.choice([2, 3, 5, 6])):
            low = [source.randrange(3) for _ in range(3)]
            high = [a + source.randrange(1, 3) for a in low]
            mesh = Polyhedron(*(box(low, high)[name] for name in ("vertices", "faces")))
            solids.append(source.choice([Aabb(low, high), Sphere(low, source.randrange(1, 3)), mesh]))
        found = collide_scene(solids, detail=True)
        told = zip(found.first.tolist(), found.second.tolist(), found.relation.tolist(), found.detail.tolist())
        pairs = [(i, j) for j in range(len(solids)) for i in range(j)]
        alone = [(i, j, collide(solids[i], solids[j], detail=True)) for i, j in sorted(pairs)]
        assert [*told] == [(i, j, pair.relation, pair.detail) for i, j, pair in alone if pair.relation]
