"""rational_location: points that are no floats, poses, every solid."""

from __future__ import annotations

import random
from fractions import Fraction

import pytest

from engine import Pose, UnsupportedSolidError
from engine.containment.rational_locate import rational_location, to_body_frame, to_world_frame
from engine.solids.surface import Surface
from tests.reference.containment import locate as reference
from tests.unit.containment.scenes import box_mesh, lattice_solids, made, spelled

TURNS = {2: [[0.6, -0.8], [0.8, 0.6]], 3: [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]]}


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("posed", [False, True])
def test_rational_points_equal_the_reference(dimension: int, posed: bool) -> None:
    source = random.Random(dimension)
    pose = Pose(TURNS[dimension], [0.1, -0.7, 0.3][:dimension]) if posed else None
    as_json = {"rotation": pose.rotation.tolist(), "translation": pose.translation.tolist()} if pose else None
    for solid in lattice_solids(dimension, 1):
        for _ in range(12):
            point = [Fraction(source.randint(0, 12), 3) for _ in range(dimension)]
            if pose is not None:
                point = to_world_frame(point, pose)
            try:
                expected = reference(point, solid, as_json)
            except ValueError:
                continue
            assert rational_location(point, made(solid), pose) == expected, (spelled(solid), point)


def test_frames_are_inverse() -> None:
    pose = Pose(TURNS[3], [1e300, -5e-324, 0.1])
    point = [Fraction(1, 3), Fraction(-2, 7), Fraction(5)]
    assert to_body_frame(to_world_frame(point, pose), pose) == point


def test_points_beyond_the_floats() -> None:
    box = made(box_mesh([0, 0, 0], [1, 1, 1]))
    assert rational_location([Fraction(1, 3), Fraction(10) ** 400, 0], box) == -1
    assert rational_location([Fraction(1, 3), Fraction(1, 10**400), Fraction(1, 2)], box) == 1


def test_surface_is_refused_and_checks_are_made() -> None:
    with pytest.raises(UnsupportedSolidError):
        rational_location([0, 0, 0], Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    calls: list[int] = []
    rational_location([0.5, 0.5, 0.5], made(box_mesh([0, 0, 0], [1, 1, 1])), check=lambda: calls.append(1))
    assert calls
