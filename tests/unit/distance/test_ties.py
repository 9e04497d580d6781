"""Very many nearest pairs: where the search runs out of room, walls across one gap prove what all candidates say."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine import Polyhedron, Pose, Surface, clearance, clearance_poses
from engine.distance import spreads
from engine.distance.ties import nearest_between_walls
from tests.unit.collision.meshes.bodies import TURN, brick


@pytest.fixture(autouse=True)
def as_if_not_convex(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("nearest_of_hulls", "nearest_of_meshes"):
        monkeypatch.setattr(f"engine.distance.clearance.{name}", lambda *_: None)


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


@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize("size", [0.1, 1e-30, 1e100, 1e-200, 1e290])
def test_walls_of_coordinates_with_all_their_bits(
    size: float, pose: Pose | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The integers of such walls are beyond the largest double."""
    pose = pose and Pose(pose.rotation, size * pose.translation)
    turns = np.arange(200) * 2 * np.pi / 200
    ring, faces = np.column_stack([np.cos(turns), np.sin(turns)]), [list(range(200))[::-1], list(range(200, 400))]
    prism = np.concatenate([np.column_stack([ring, np.full(200, z)]) for z in (0.0, 1.0)])
    faces += [[k, (k + 1) % 200, 200 + (k + 1) % 200] for k in range(200)]
    faces += [[k, 200 + (k + 1) % 200, 200 + k] for k in range(200)]
    first, second = Polyhedron(size * prism, faces), Polyhedron(size * (prism + np.array([0.1, 0.2, 3.0])), faces)
    monkeypatch.setattr(spreads, "_ROOM", 64)
    found = clearance(first, second, first_pose=pose, second_pose=pose)
    assert found.distance == float(Fraction(second.vertices[0, 2]) - Fraction(first.vertices[200, 2]))
    assert found.features is not None
    assert [feature.kind for feature in found.features] == ["face", "face"]
    moved = clearance_poses(first, second, *(np.eye(3)[None], np.zeros((1, 3))))
    assert moved[0] == found.distance


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
