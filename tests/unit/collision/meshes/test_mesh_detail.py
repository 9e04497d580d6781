"""Which of two overlapping meshes sticks out, known by hand."""

from __future__ import annotations

import pytest

from engine import Pose
from engine.collision.meshes.mesh_mesh import mesh_parts
from engine.collision.result import Parts, Work
from tests.unit.collision.meshes.bodies import TURN, brick

INNER, OUTER = (1, (1, 1, 1)), (3, (0, 0, 0))


@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (OUTER, OUTER, Parts(False, False, True)),
        (INNER, OUTER, Parts(False, True, False)),
        ((1, (0, 1, 1)), OUTER, Parts(False, True, True)),
        (OUTER, (2, (1, 1, 0)), Parts(True, False, True)),
        ((2, (2, 0, 0)), OUTER, Parts(True, True, True)),
    ],
)
def test_known_parts(
    first: tuple[int, tuple[float, float, float]],
    second: tuple[int, tuple[float, float, float]],
    expected: Parts,
    pose: Pose | None,
) -> None:
    assert mesh_parts(brick(*first), brick(*second), (pose, pose), Work()) == expected
