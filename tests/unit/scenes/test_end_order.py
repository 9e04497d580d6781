"""Ends of pieces that round alike: kernels order them as integers do, and leave them nothing of bodies that touch."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Aabb, Convex, Polyhedron, Pose, Scene, Solid, Sphere
from engine.running.budget import UNLIMITED
from engine.scenes import ends
from engine.scenes.clip import _exact_ends
from engine.types import UNDECIDED
from tests.reference.shapes import box
from tests.unit.scenes.scenes import FACES, OCTAHEDRON, scene_of

TURNED = Pose([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]], [0.1, 0.2, 0.3])


def mesh(low: Any, high: Any) -> Polyhedron:
    json = box(low, high)
    return Polyhedron(json["vertices"], json["faces"])


def lattice(make: Any) -> list[Solid]:
    return [make([i, j, k], [i + 1, j + 1, k + 1]) for i in range(3) for j in range(3) for k in range(2)]


def octahedra(n: int) -> list[Solid]:
    return [Polyhedron(OCTAHEDRON, FACES)] * n


SCENES: dict[str, tuple[list[Solid], Any]] = {
    "one box": ([Aabb([0, 0, 0], [2, 3, 1])] * 5, None),
    "equal boxes": ([Aabb([0, 0, 0], [2, 3, 1]) for _ in range(5)], None),
    "equal balls": ([Sphere([1, 1, 1], 1.5) for _ in range(5)], None),
    "one mesh": (octahedra(5), None),
    "one mesh under one pose": (octahedra(5), [TURNED] * 5),
    "one box under equal poses": (
        [Aabb([0, 0, 0], [2, 3, 1])] * 3,
        [Pose(TURNED.rotation, [1, 0, 0]) for _ in range(3)],
    ),
    "boxes side by side": (lattice(Aabb), None),
    "meshes side by side": (lattice(mesh), None),
    "boxes and meshes": (lattice(mesh)[:9] + lattice(Aabb)[6:], None),
    "planes through one line": ([Convex([[1, k, 0, 0], [-1, 0, 0, 3]]) for k in range(1, 7)], None),
}


def exactly_ordered(scene: Scene, segments: Any, found: Any) -> tuple[Any, ...]:
    """Return the arrays of `found`, ordered by exact parameters alone."""
    unknown = np.full(len(found), UNDECIDED)
    pieces = ends.LoosePieces(
        found.source, found.body, unknown, np.stack([found.start, found.end]), found.t, found.faces
    )
    return ends._sort_exactly(pieces, _exact_ends(segments, scene._placements, UNLIMITED))


def assert_ordered(scene: Scene, segments: Any, found: Any) -> None:
    names = ("source", "body", "start", "end", "t", "faces", "ranks")
    for name, array in zip(names, exactly_ordered(scene, segments, found)):
        np.testing.assert_array_equal(getattr(found, name), array)


@pytest.mark.parametrize("name", SCENES)
def test_ends_at_one_place_need_no_integers(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bodies that are equal, share faces, edges and corners, or meet in one line that the segment passes."""
    rng, (solids, poses) = np.random.default_rng(4), SCENES[name]
    lines = rng.uniform(-1.5, 3, (120, 2, 3)) if name != "planes through one line" else np.zeros((0, 2, 3))
    through = rng.integers(-2, 9, (40, 2, 3)) / 2.0
    through[:, 0, :2] *= -1.0 if name == "planes through one line" else 1.0
    segments = np.concatenate([lines, through[(through[:, 0] != through[:, 1]).any(axis=1)]])
    if poses is not None or "ball" in name:
        segments = lines
    scene = Scene(solids, poses)
    with monkeypatch.context() as patch:
        patch.setattr(ends, "_sort_exactly", lambda *_: pytest.fail("some order is left to integers"))
        found = scene.clip_segments(segments)
    assert len(found) > 20
    assert_ordered(scene, segments, found)


def test_every_order_is_that_of_integers() -> None:
    """Bodies of all types and poses, some moved, on a lattice as often as not."""
    rng, n = np.random.default_rng(5), 0
    for dimension in (2, 3) * 6:
        solids, poses = scene_of(rng, dimension, 12)
        scene = Scene(solids + solids[:3], poses + poses[:3]).moved({0: None, 1: poses[0]})
        segments = np.concatenate(
            [rng.integers(-4, 5, (20, 2, dimension)) / 2.0, rng.uniform(-4, 4, (10, 2, dimension))]
        )
        found = scene.clip_segments(segments)
        assert_ordered(scene, segments, found)
        n += len(found)
    assert n > 500


def test_bodies_that_are_not_prepared_yet_share_one_array_of_pieces() -> None:
    """Memory grows with the answer, not with the bodies that a call prepares."""
    corners = np.stack(np.meshgrid(*[np.arange(7.0)] * 3), axis=-1).reshape(-1, 3)
    scene, seen = Scene([Aabb(corner, corner + 0.5) for corner in corners]), []
    merge = ends.merge_parts
    segments = np.random.default_rng(6).uniform(0, 7, (200, 2, 3))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "engine.scenes.clip.merge_parts", lambda parts, *rest: seen.append(len(parts)) or merge(parts, *rest)
        )
        assert len(scene.clip_segments(segments)) > 200
    assert seen == [1]
