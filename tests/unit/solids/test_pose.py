"""Poses: what is a rotation, decided exactly; immutability and value equality."""

from __future__ import annotations

import math
import pickle
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import engine
from engine.solids.rotations import check_rotations


def random_rotations(n: int, dimension: int = 3) -> np.ndarray:
    matrices, _ = np.linalg.qr(np.random.default_rng(dimension).normal(size=(n, dimension, dimension)))
    matrices[np.linalg.det(matrices) < 0, 0] *= -1.0
    return matrices


def exact_defect(matrix: np.ndarray) -> Fraction:
    rows = [[Fraction(value) for value in row] for row in matrix.tolist()]
    n = len(rows)
    return max(
        abs(sum((rows[k][i] * rows[k][j] for k in range(n)), Fraction(0)) - int(i == j))
        for i in range(n)
        for j in range(n)
    )


def test_pose() -> None:
    pose = engine.Pose([[0, -1], [1, 0]], np.array([5, -0.0]))
    assert pose.dimension == 2
    assert pose.rotation.tolist() == [[0.0, -1.0], [1.0, 0.0]]
    assert "-0.0" not in repr(pose)
    assert not pose.is_identity
    assert engine.Pose.identity().is_identity
    assert engine.Pose.identity(2) == engine.Pose(np.eye(2), [0, 0])
    assert engine.Pose.identity(2) != engine.Pose.identity(3)
    assert engine.Pose.identity(2) != 5
    assert not engine.Pose(np.eye(3), [0, 0, 5e-324]).is_identity


def test_is_immutable_hashable_and_pickles() -> None:
    pose = engine.Pose(random_rotations(1)[0], [1, 2, 3])
    with pytest.raises(AttributeError, match="immutable"):
        pose.rotation = np.eye(3)
    with pytest.raises(AttributeError, match="immutable"):
        del pose.translation
    with pytest.raises(ValueError, match="read-only"):
        pose.rotation[0, 0] = 5.0
    again = pickle.loads(pickle.dumps(pose))
    assert again == pose
    assert hash(again) == hash(pose)
    assert not again.rotation.flags.writeable


@pytest.mark.parametrize("dimension", [2, 3])
def test_float_rotations_are_accepted(dimension: int) -> None:
    for matrix in random_rotations(50, dimension):
        assert engine.Pose(matrix, np.zeros(dimension)).dimension == dimension


def test_the_limit_is_exact() -> None:
    """One step of the last place decides: the diagonal entry s gives s^2 - 1 against 1e-12."""
    s = math.sqrt(1.0 + 1e-12)
    for _ in range(4):
        s = math.nextafter(s, 2.0)
    seen = set()
    for _ in range(9):
        matrix = np.diag([s, 1.0, 1.0])
        is_rotation = exact_defect(matrix) <= Fraction(1, 10**12)
        seen.add(is_rotation)
        if is_rotation:
            engine.Pose(matrix, [0, 0, 0])
        else:
            with pytest.raises(engine.NotRigidError):
                engine.Pose(matrix, [0, 0, 0])
        s = math.nextafter(s, 0.0)
    assert seen == {True, False}


@pytest.mark.parametrize(
    ("rotation", "translation", "error", "where", "words"),
    [
        ([[1, 0], [0, -1]], [0, 0], engine.NotRigidError, ("rotation",), "reflection"),
        (-np.eye(3), [0, 0, 0], engine.NotRigidError, ("rotation",), "reflection"),
        (np.zeros((3, 3)), [0, 0, 0], engine.NotRigidError, ("rotation",), "max|R^T R - I| is 1.0"),
        (np.eye(3) * 1e300, [0, 0, 0], engine.NotRigidError, ("rotation",), "above 1e300"),
        (np.eye(3) * (1 + 1e-11), [0, 0, 0], engine.NotRigidError, ("rotation",), "limit 1e-12"),
        ([[1, 1e-11], [0, 1]], [0, 0], engine.NotRigidError, ("rotation",), "[[1.0, 1e-11], [0.0, 1.0]]"),
        (np.eye(2), [0, 0, 0], engine.WrongDimensionError, ("translation",), "got 3"),
        (np.eye(4), [0, 0, 0, 0], engine.WrongDimensionError, ("rotation",), "got 4"),
        (np.zeros((2, 3)), [0, 0], engine.WrongDimensionError, ("rotation",), "square"),
        ([[1, 0], [0, float("nan")]], [0, 0], engine.NotFiniteError, ("rotation", 1, 1), "nan"),
        (np.eye(2), [0, float("inf")], engine.NotFiniteError, ("translation", 1), "inf"),
        (np.eye(2), [0, True], engine.InvalidArrayError, ("translation", 1), "True"),
        ([1, 0, 0, 1], [0, 0], engine.InvalidArrayError, ("rotation", 0), "must be a list"),
        (None, [0, 0], engine.InvalidArrayError, ("rotation",), "rotation"),
    ],
)
def test_refusals(rotation: Any, translation: Any, error: Any, where: tuple[Any, ...], words: str) -> None:
    with pytest.raises(error) as info:
        engine.Pose(rotation, translation)
    assert info.value.where == where
    assert words in str(info.value)
    for dimension in (1, 4, True, "3"):
        with pytest.raises(engine.WrongDimensionError):
            engine.Pose.identity(dimension)  # type: ignore[arg-type]


def test_many_rotations_at_once() -> None:
    matrices = random_rotations(1000)
    check_rotations(matrices)
    check_rotations(matrices[:0])
    matrices[700, 0] *= -1.0
    matrices[900] *= 2.0
    with pytest.raises(engine.NotRigidError, match=r"rotations\[700\]") as info:
        check_rotations(matrices)
    assert info.value.where == ("rotations", 700)
    with pytest.raises(engine.InvalidArrayError):
        check_rotations(np.zeros((4, 3, 2)))


def test_matrices_of_float32_are_taken_for_the_nearest_rotation() -> None:
    for dimension in (2, 3):
        for matrix in random_rotations(20, dimension):
            given = matrix.astype(np.float32).astype(np.float64)
            with pytest.raises(engine.NotRigidError, match=r"tolerance=\d\.\de-0"):
                engine.Pose(given, np.zeros(dimension))
            pose = engine.Pose(given, np.zeros(dimension), tolerance=1e-6)
            assert exact_defect(pose.rotation) < Fraction(1, 10**15)
            # the orthogonal factor is the one rotation whose transposed product with the matrix is symmetric
            product = [
                [sum(Fraction(a) * Fraction(b) for a, b in zip(u, v)) for v in given.T.tolist()]
                for u in pose.rotation.T.tolist()
            ]
            for i in range(dimension):
                for j in range(i):
                    assert abs(product[i][j] - product[j][i]) < Fraction(1, 10**15)
            assert np.abs(pose.rotation - matrix).max() < 1e-6


def test_what_is_rigid_enough_stays_as_given() -> None:
    for matrix in random_rotations(20):
        assert engine.Pose(matrix, [1, 2, 3], tolerance=1e-3) == engine.Pose(matrix, [1, 2, 3])
    with pytest.raises(engine.NotRigidError):
        engine.Pose(np.array([[0.6, -0.8], [0.8, 0.6]]), [0, 0], tolerance=0.0)
    quarter = engine.Pose([[0, -1 - 1e-9], [1, 0]], [0, 0], tolerance=1e-8)
    assert quarter.rotation.tolist() == [[0.0, -1.0], [1.0, 0.0]]
    tiny = engine.Pose([[1, -1e-300, 0], [1e-300, 1, 0], [0, 0, 1.0001]], [0, 0, 0], tolerance=1e-3)
    assert tiny.rotation.tolist() == [[1.0, -1e-300, 0.0], [1e-300, 1.0, 0.0], [0.0, 0.0, 1.0]]


@pytest.mark.parametrize("tolerance", [-1e-9, math.nan, math.inf, 0.2, "wide"])
def test_a_tolerance_that_is_none_is_refused(tolerance: Any) -> None:
    with pytest.raises(engine.EngineError, match="tolerance"):
        engine.Pose(np.eye(3), [0, 0, 0], tolerance=tolerance)


def test_a_reflection_is_refused_whatever_the_tolerance() -> None:
    with pytest.raises(engine.NotRigidError, match="reflection"):
        engine.Pose(np.diag([1.0, 1.0, -1.0 - 1e-9]), [0, 0, 0], tolerance=1e-3)


def test_quaternions() -> None:
    rng = np.random.default_rng(3)
    for scale in (1.0, 1e-300, 1e300):
        for quaternion in rng.normal(size=(20, 4)) * scale:
            w, x, y, z = map(Fraction, quaternion.tolist())
            square = w * w + x * x + y * y + z * z
            pose = engine.Pose.from_quaternion(quaternion, [1, 2, 3])
            assert pose.rotation[0, 1] == float(2 * (x * y - w * z) / square)
            assert pose.rotation[2, 2] == float((w * w - x * x - y * y + z * z) / square)
            assert exact_defect(pose.rotation) < Fraction(1, 10**14)
    assert engine.Pose.from_quaternion([2, 0, 0, 0], [0, 0, 0]).is_identity
    with pytest.raises(engine.NotRigidError, match="length 0"):
        engine.Pose.from_quaternion([0, 0, 0, -0.0], [0, 0, 0])
    with pytest.raises(engine.InvalidArrayError, match="w, x, y, z"):
        engine.Pose.from_quaternion([1, 0, 0], [0, 0, 0])


def test_matrices_of_homogeneous_coordinates() -> None:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = random_rotations(1)[0], [1, 2, 3]
    assert engine.Pose.from_matrix(matrix) == engine.Pose(matrix[:3, :3], [1, 2, 3])
    assert engine.Pose.from_matrix(matrix.astype(np.float32), tolerance=1e-6).dimension == 3
    with pytest.raises(engine.NotRigidError, match="transpose"):
        engine.Pose.from_matrix(matrix.T)
    for wrong in (np.eye(2), np.eye(5), np.zeros((3, 4))):
        with pytest.raises(engine.WrongDimensionError):
            engine.Pose.from_matrix(wrong)


def test_quaternions_in_either_order_by_name() -> None:
    turn = engine.Pose.from_quaternion((1, 2, 3, 4), (5, 6, 7))
    assert engine.Pose.from_quaternion(xyzw=(2, 3, 4, 1), translation=(5, 6, 7)) == turn
    assert engine.Pose.from_quaternion(wxyz=(1, 2, 3, 4)).translation.tolist() == [0, 0, 0]
    for wrong in ({}, {"wxyz": (1, 0, 0, 0), "xyzw": (0, 0, 0, 1)}):
        with pytest.raises(engine.InvalidArrayError, match="wxyz or as xyzw"):
            engine.Pose.from_quaternion(**wrong)


def test_six_printed_digits_are_refused_with_the_word_that_takes_them() -> None:
    turn = [[0.866025, -0.5, 0.0], [0.5, 0.866025, 0.0], [0.0, 0.0, 1.0]]
    with pytest.raises(
        engine.NotRigidError, match=r"allow it by tolerance=\d.*or as one of six digits by rounded=True"
    ):
        engine.Pose(turn)
    exact = engine.Pose(turn, rounded=True)
    assert exact == engine.Pose(turn, [0, 0, 0], tolerance=1e-5)
    assert exact_defect(exact.rotation) < Fraction(1, 10**15)
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    assert engine.Pose.from_matrix(matrix, rounded=True) == exact
    with pytest.raises(engine.NotRigidError, match=r"tolerance=4") as error:  # three digits: the number alone
        engine.Pose(np.round(turn, 3))
    assert "rounded" not in str(error.value)
    with pytest.raises(engine.InvalidArrayError, match="rounded must be True or False"):
        engine.Pose(turn, rounded=1)


@pytest.mark.parametrize("seed", range(20))
def test_axis_angle_and_rpy_are_those_of_the_formulas(seed: int) -> None:
    draw = np.random.default_rng(seed)
    axis, angle, (roll, pitch, yaw) = (
        draw.normal(size=3) * 1e200 ** draw.integers(-1, 2),
        *draw.uniform(-7, 7, 1),
        draw.uniform(-7, 7, 3),
    )
    x, y, z = axis / np.abs(axis).max() / np.linalg.norm(axis / np.abs(axis).max())
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rodrigues = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    assert np.allclose(engine.Pose.from_axis_angle(axis, angle).rotation, rodrigues, atol=1e-14)

    def about(axis: list[float], angle: float) -> np.ndarray:
        return engine.Pose.from_axis_angle(axis, angle).rotation

    expected = about([0, 0, 1], yaw) @ about([0, 1, 0], pitch) @ about([1, 0, 0], roll)
    assert np.allclose(engine.Pose.from_rpy([roll, pitch, yaw], [1, 2, 3]).rotation, expected, atol=1e-14)
    with pytest.raises(engine.NotRigidError, match="length 0"):
        engine.Pose.from_axis_angle([0, 0, 0], 1.0)
