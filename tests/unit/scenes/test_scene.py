"""A scene that stays answers as one that is made for each question, whatever moved since."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from engine import (
    Aabb,
    Convex,
    DeadlineExceededError,
    EmptyGeometryError,
    IndexOutOfRangeError,
    InvalidArrayError,
    InvalidOperationError,
    Pose,
    Scene,
    Solid,
    Sphere,
    Surface,
    UnsupportedPairError,
    UnsupportedSolidError,
    WrongDimensionError,
    collide_scene,
    locate_scene,
)
from tests.unit.scenes.scenes import pose_of, scene_of

STEP = Pose(np.eye(3), [1, 0, 0])


def assert_same_pairs(found: Any, expected: Any) -> None:
    for name in ("first", "second", "relation", "detail", "distance"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    assert found.witnesses == expected.witnesses


def assert_same_locations(found: Any, expected: Any) -> None:
    for name in ("offsets", "indices", "on_boundary"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
        assert getattr(found, name).dtype == getattr(expected, name).dtype


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_locates_as_a_scene_of_its_own_whatever_moved(dimension: int, seed: int) -> None:
    rng = np.random.default_rng([seed, dimension])
    solids, poses = scene_of(rng, dimension, 30)
    points = np.round(rng.uniform(-4, 4, (200, dimension)) * 2) / 2
    scene = Scene(solids, poses)
    for turn in range(4):
        assert_same_locations(scene.locate(points), locate_scene(points, solids, poses))
        for few in (points[:1], points[1:4]):  # asked body by body
            assert_same_locations(scene.locate(few), locate_scene(few, solids, poses))
        named = rng.choice(30, size=3 + 20 * (turn == 2), replace=False).tolist()
        steps: dict[int, Pose | None] = {body: pose_of(rng, dimension, 0.5) for body in named}
        scene = scene.moved(steps)
        poses = [steps.get(body, pose) for body, pose in enumerate(poses)]
        assert scene.poses == tuple(poses)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_collides_as_a_scene_of_its_own_and_new_pairs_follow_from_the_old(dimension: int, seed: int) -> None:
    rng = np.random.default_rng([seed, dimension])
    solids, poses = scene_of(rng, dimension, 20, for_pairs=True)
    scene = Scene(solids, poses)
    known: Any = scene.collide()
    assert_same_pairs(known, collide_scene(solids, poses))
    named = rng.choice(20, size=4, replace=False).tolist()
    steps: dict[int, Pose | None] = {body: pose_of(rng, dimension, 0.5) for body in named}
    after, gap = scene.moved(steps), 0.5 if seed % 2 else None
    placed = [steps.get(body, pose) for body, pose in enumerate(poses)]
    whole: Any = collide_scene(solids, placed, witnesses=True, gap=gap)
    new: Any = after.collide(moved=named, witnesses=True, gap=gap)
    has_moved = np.isin(whole.first, named) | np.isin(whole.second, named)
    np.testing.assert_array_equal(new.first, whole.first[has_moved])
    np.testing.assert_array_equal(new.second, whole.second[has_moved])
    np.testing.assert_array_equal(new.relation, whole.relation[has_moved])
    assert list(new.witnesses) == [w for w, keep in zip(whole.witnesses, has_moved.tolist()) if keep]
    assert_same_pairs(after.collide(witnesses=True, gap=gap), whole)
    if gap:
        return
    stayed = ~(np.isin(known.first, named) | np.isin(known.second, named))
    kept = zip(known.first[stayed].tolist(), known.second[stayed].tolist(), known.relation[stayed].tolist())
    old_and_new = sorted([*kept, *zip(new.first.tolist(), new.second.tolist(), new.relation.tolist())])
    assert old_and_new == [*zip(whole.first.tolist(), whole.second.tolist(), whole.relation.tolist())]


def test_moved_pairs_may_be_skipped_or_named() -> None:
    solids: list[Solid] = [Aabb([0, 0, 0], [1, 1, 1])] * 4
    scene = Scene(solids)
    found: Any = scene.collide(moved=[1], skip=[[1, 0]])
    assert [*zip(found.first.tolist(), found.second.tolist())] == [(1, 2), (1, 3)]
    found = scene.collide(moved=[1], only=[[3, 1], [2, 3]], detail=True)
    assert (found.first.tolist(), found.second.tolist(), found.detail.tolist()) == ([1], [3], [3])
    assert len(found.first) == 1


def test_is_a_value() -> None:
    scene = Scene([Sphere([0, 0, 0], 1), Aabb([0, 0, 0], [1, 2, 3])], [None, STEP]).moved({0: STEP})
    copy = pickle.loads(pickle.dumps(scene))
    assert copy.poses == scene.poses
    assert len(copy) == 2
    assert_same_pairs(copy.collide(), scene.collide())
    with pytest.raises(AttributeError, match="a scene is immutable"):
        scene.solids = ()  # type: ignore[misc]
    box: Any = scene.bounds
    assert (box[0] <= [0, -1, -1]).all()
    assert (box[1] >= [2, 2, 3]).all()
    assert np.abs(box - [[0, -1, -1], [2, 2, 3]]).max() < 1e-9
    assert repr(scene) == "Scene(2 bodies)"


def test_memory_counts_what_is_prepared() -> None:
    scene = Scene([Aabb([k, 0], [k + 2, 1]) for k in range(1000)])
    before = scene.memory
    scene.collide()
    assert scene.memory > before + 1000 * 32


def test_nothing_is_a_scene_too() -> None:
    scene = Scene([])
    assert scene.bounds is None
    assert len(scene.collide().first) == 0  # type: ignore[union-attr]
    assert len(scene.collide(moved=[]).first) == 0  # type: ignore[union-attr]
    assert_same_locations(scene.locate(np.zeros((2, 2))), locate_scene(np.zeros((2, 2)), []))


def test_says_which_body_is_wrong() -> None:
    scene = Scene([Sphere([0, 0, 0], 1), Sphere([1, 0, 0], 1)])
    with pytest.raises(IndexOutOfRangeError, match="poses names body 2, which is not there; the scene has 2"):
        scene.moved({2: STEP})
    with pytest.raises(WrongDimensionError, match=r"poses\[1\] has dimension 2"):
        scene.moved({1: Pose.identity(2)})
    with pytest.raises(InvalidArrayError, match=r"poses\[1\] must be a Pose, a matrix"):
        scene.moved({1: 3})  # type: ignore[dict-item]
    with pytest.raises(InvalidArrayError, match="poses must be a dict"):
        scene.moved([STEP])  # type: ignore[arg-type]
    with pytest.raises(IndexOutOfRangeError, match="moved names body -1"):
        scene.collide(moved=[-1])
    with pytest.raises(InvalidArrayError, match="moved names bodies by index, got float"):
        scene.collide(moved=[1.0])  # type: ignore[list-item]
    with pytest.raises(InvalidArrayError, match="moved must be a list of bodies, got ndarray"):
        scene.collide(moved=np.array(1))  # type: ignore[arg-type]
    with pytest.raises(InvalidOperationError, match="keep must be all, first or any"):
        scene.clip_segments(np.zeros((1, 2, 3)), keep=np.zeros(2))  # type: ignore[call-overload]
    with pytest.raises(WrongDimensionError, match=r"solids\[1\] is 2D, solids\[0\] 3D"):
        Scene([Sphere([0, 0, 0], 1), Sphere([0, 0], 1)])
    with pytest.raises(UnsupportedPairError, match=r"solids\[1\] is a convex"):
        Scene([Sphere([0, 0, 0], 1), Convex([[1, 0, 0, 1]])]).collide(moved=[0])
    sheets = Scene([Sphere([9, 9, 9], 1), Surface(np.eye(3), [[0, 1, 2]]), Sphere([0, 0, 0], 1)])
    with pytest.raises(UnsupportedSolidError, match=r"solids\[1\] is a surface, which has no interior"):
        sheets.collide(moved=[2], detail=True)
    with pytest.raises(UnsupportedSolidError):
        sheets.locate(np.zeros((1, 3)))
    with pytest.raises(DeadlineExceededError):
        scene.collide(deadline=-1.0)
    with pytest.raises(DeadlineExceededError):
        scene.locate(np.zeros((1, 3)), deadline=-1.0)


def test_an_empty_body_is_named_with_its_number() -> None:
    nothing = Convex([[1, 0, 0, 1], [-1, 0, 0, -3]])
    scene = Scene([Aabb([0, 0, 0], [1, 1, 1]), nothing])
    with pytest.raises(EmptyGeometryError, match=r"solids\[1\] has no point to be near"):
        scene.distances([[5.0, 0, 0]])
