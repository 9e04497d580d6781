"""Very many nearest pairs: where the search runs out of room, walls across one gap prove what all candidates say."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Polyhedron, Pose, Surface, clearance
from engine.distance import spreads
from engine.distance.ties import nearest_between_walls
from tests.unit.collision.meshes.bodies import TURN, brick

MOVES = [(0, 0, 2.5), (0.5, 0.25, 2 + 2.0**-40), (1.5, 0, 3), (2.5, 2.5, 0), (3, 3, 3), (2.25, -1, 0.5), (0, -4, 1)]


def answered(first: Polyhedron, second: Polyhedron, pose: Pose | None, room: int, patch: pytest.MonkeyPatch) -> object:
    patch.setattr(spreads, "_ROOM", room)
    answer = clearance(first, second, first_pose=pose, second_pose=pose)
    assert not isinstance(answer, bool)
    assert answer.points is not None
    return answer.distance, answer.points.tolist(), answer.features


@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize("move", MOVES)
def test_little_room_changes_nothing(
    move: tuple[float, float, float], pose: Pose | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = brick(2), brick(2, move)
    plenty = answered(first, second, pose, 4096, monkeypatch)
    for room in (16, 64):
        assert answered(first, second, pose, room, monkeypatch) == plenty


def test_walls_prove_plates_and_nothing_of_bodies_that_reach_around(monkeypatch: pytest.MonkeyPatch) -> None:
    proven: list[bool] = []

    def watched(*arguments: object) -> object:
        row = nearest_between_walls(*arguments)  # type: ignore[arg-type]
        proven.append(row is not None)
        return row

    monkeypatch.setattr(spreads, "nearest_between_walls", watched)
    monkeypatch.setattr(spreads, "_ROOM", 64)
    lower, upper = brick(8), brick(8, (0.5, 0.25, 8.5))
    assert clearance(lower, upper).distance == 0.5
    assert proven == [True]
    proven.clear()
    cover = Surface(  # around the upper body, and as near
        np.concatenate([lower.vertices, [[20.0, 0, 30], [0, 20, 30], [-20, -20, 30]]]),
        [*lower.triangles.tolist(), [len(lower.vertices) + k for k in range(3)]],
    )
    assert clearance(cover, upper).distance == 0.5
    assert proven
    assert not any(proven)
