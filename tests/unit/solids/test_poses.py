"""Many poses as one value: made of what people hold, checked once, taken wherever many poses are."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

import engine

CUBE = engine.Aabb((0, 0, 0), (1, 1, 1))
MATRICES = np.tile(np.eye(4), (3, 1, 1))
MATRICES[:, 0, 3] = (3.0, 1.0, 0.5)
SLIDE = engine.Poses(MATRICES)


@pytest.mark.parametrize("held", [
    MATRICES.tolist(), [engine.Pose.from_matrix(each) for each in MATRICES], iter(list(MATRICES)), SLIDE,
    [(np.eye(3), each) for each in MATRICES[:, :3, 3]],
])  # fmt: skip
def test_poses_of_what_people_hold(held: Any) -> None:
    assert engine.Poses(held) == SLIDE
    assert engine.Poses(MATRICES[:, :3, :3], MATRICES[:, :3, 3]) == SLIDE


def test_poses_are_a_value_and_a_sequence() -> None:
    assert (len(SLIDE), SLIDE.dimension, repr(SLIDE)) == (3, 3, "<Poses: 3 in 3D>")
    assert list(SLIDE) == [engine.Pose(np.eye(3), (x, 0, 0)) for x in (3.0, 1.0, 0.5)]
    assert SLIDE[-1] == engine.Pose(np.eye(3), (0.5, 0, 0))
    assert SLIDE[1:] == engine.Poses(MATRICES[1:])
    assert pickle.loads(pickle.dumps(SLIDE)) == SLIDE
    assert hash(engine.Poses(MATRICES)) == hash(SLIDE) != hash(SLIDE[1:])
    assert SLIDE != 3
    with pytest.raises(AttributeError, match="immutable"):
        SLIDE.rotations = MATRICES
    flat = engine.Poses([np.eye(3)])
    assert (flat.dimension, flat[0]) == (2, engine.Pose.identity(2))
    assert len(engine.Poses([])) == len(engine.Poses(np.zeros((0, 4, 4)))) == 0


def test_they_are_taken_where_many_poses_are() -> None:
    relations = engine.collide_poses(CUBE, CUBE, SLIDE)
    assert relations.tolist() == [0, 4, 3]
    assert engine.clearance_poses(CUBE, CUBE, SLIDE).tolist() == [2.0, 0.0, 0.0]
    scene = engine.Scene([CUBE] * 3, SLIDE)
    assert scene.collide() == engine.collide_scene([CUBE] * 3, SLIDE)
    assert [pair[:2] for pair in scene.collide()] == [(1, 2)]
    assert engine.locate_scene([(3.5, 0.5, 0.5)], [CUBE] * 3, SLIDE)[0].tolist() == [0]
    with pytest.raises(engine.WrongDimensionError):
        engine.collide_poses(engine.Aabb((0, 0), (1, 1)), engine.Aabb((0, 0), (1, 1)), SLIDE)


def test_the_first_contact_has_a_number() -> None:
    relations: Any = engine.collide_poses(CUBE, CUBE, SLIDE)
    assert relations.first_contact == 1
    assert engine.collide_poses(CUBE, CUBE, SLIDE[1:]).first_contact == 0
    assert engine.collide_poses(CUBE, CUBE, SLIDE[:1]).first_contact is None
    assert engine.collide_poses(CUBE, CUBE, engine.Poses([])).first_contact is None
    named, witnesses = engine.collide_poses(CUBE, CUBE, SLIDE, witnesses=True)
    assert named.first_contact == 1
    assert witnesses[0] is None


def test_rows_of_quaternions_axes_and_angles() -> None:
    turns, moves = [[1, 0, 0, 1], [2, 0, 0, 0]], [[0, 0, 5], [1, 2, 3]]
    made = engine.Poses.from_quaternions(turns, moves)
    assert list(made) == [engine.Pose.from_quaternion(*each) for each in zip(turns, moves, strict=True)]
    assert engine.Poses.from_quaternions(xyzw=[[0, 0, 1, 1], [0, 0, 0, 2]], translations=moves) == made
    axes, angles = [[0, 0, 1], [1, 2, 3]], [0.5, -2.0]
    assert list(engine.Poses.from_axis_angle(axes, angles, moves)) == [
        engine.Pose.from_axis_angle(*each) for each in zip(axes, angles, moves, strict=True)
    ]
    assert engine.Poses.from_rpy(axes)[1] == engine.Pose.from_rpy(axes[1])


def test_six_digits_are_taken_by_a_word() -> None:
    turn = np.array([[0.866025, -0.5, 0], [0.5, 0.866025, 0], [0, 0, 1]])
    with pytest.raises(engine.NotRigidError, match="rounded=True"):
        engine.Poses([np.eye(3), turn], np.zeros((2, 3)))
    made = engine.Poses([np.eye(3), turn], np.zeros((2, 3)), rounded=True)
    assert made[1] == engine.Pose(turn, rounded=True)


@pytest.mark.parametrize(("make", "words"), [
    (lambda: engine.Poses(7), "must be a list of poses"),
    (lambda: engine.Poses([np.eye(4), np.eye(3)]), r"poses\[1\] has dimension 2, poses\[0\] has 3"),
    (lambda: engine.Poses([np.diag([2.0, 1, 1, 1])]), "is no rotation"),
    (lambda: engine.Poses(np.zeros((2, 3, 3)), np.zeros((1, 3))), "equally many"),
    (lambda: engine.Poses(np.zeros((1, 5, 5)), np.zeros((1, 5))), "5"),
    (lambda: engine.Poses([np.eye(3) * np.nan], [[0, 0, 0]]), "nan"),
    (lambda: engine.Poses.from_quaternions(), "as wxyz or as xyzw"),
    (lambda: engine.Poses.from_quaternions([[1, 0, 0, 0], [0, 0, 0, 0]]), "length 0"),
    (lambda: engine.Poses.from_axis_angle([[0, 0, 1]], [1, 2]), "equally many"),
    (lambda: engine.Poses.from_rpy([[0, 0, 0]], [[0, 0, 0], [1, 1, 1]]), "equally many"),
])  # fmt: skip
def test_what_are_no_poses_is_refused(make: Any, words: str) -> None:
    with pytest.raises(engine.EngineError, match=words):
        make()


def test_no_poses_have_a_dimension_too() -> None:
    none = engine.Poses([engine.Pose.identity(2)])[:0]
    assert (none.dimension, pickle.loads(pickle.dumps(none)), engine.Poses([]).dimension) == (2, none, 3)
    for size in (0, 1, 2):
        with pytest.raises(engine.EngineError):
            engine.Poses(np.zeros((1, size, size)))


def test_an_index_is_a_whole_number() -> None:
    poses = engine.Poses([np.eye(4)])
    for index in (None, 0.0, [0], (0, 0)):
        with pytest.raises(TypeError):
            poses[index]  # type: ignore[index]


def test_a_matrix_that_is_no_motion_is_named_as_a_matrix() -> None:
    for matrix in (np.diag([2.0, 1, 1, 1]), np.diag([-1.0, 1, 1, 1])):
        with pytest.raises(engine.NotRigidError) as raised:
            engine.Pose.from_matrix(matrix)
        assert raised.value.where == ("matrix",)
