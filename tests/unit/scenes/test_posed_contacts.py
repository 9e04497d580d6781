"""Segments that touch posed meshes or run in their surfaces: compiled, and what rationals say to the last bit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import engine
from engine import Polyhedron, Pose, Scene, Surface
from engine.running.budget import UNLIMITED
from engine.scenes.hits import lines_on
from engine.scenes.posed_contacts import cut_posed
from engine.segment_clipping import hits as on_one
from engine.segment_clipping.profiles import clip_exactly
from engine.types import UNDECIDED
from tests.unit.scenes.scenes import FACES, OCTAHEDRON, Random
from tests.unit.scenes.test_clip import assert_exact, assert_first_and_any, expected_pieces

CORNERS = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
SIDES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
         [1, 5, 7], [1, 7, 3]]  # fmt: skip


def about(axis: int, angle: float) -> Any:
    """Return a rotation about an axis, whose coordinate stays exactly as it is."""
    turn, (i, j) = np.eye(3), ((axis + 1) % 3, (axis + 2) % 3)
    turn[i, i], turn[i, j], turn[j, i], turn[j, j] = math.cos(angle), -math.sin(angle), math.sin(angle), math.cos(angle)
    return turn


def fan(n: int) -> tuple[Any, Any]:
    """Return a prism whose bottom and top are fans about their middles."""
    around = (
        np.round(64 * np.stack([np.cos(2 * np.pi * np.arange(n) / n), np.sin(2 * np.pi * np.arange(n) / n)], 1)) / 64
    )
    low, high = np.pad(around, ((0, 0), (0, 1))), np.pad(around, ((0, 0), (0, 1)), constant_values=1.0)
    faces = [
        face for i, j in zip(range(n), [*range(1, n), 0])
        for face in ([2 * n + 1, n + i, n + j], [2 * n, j, i], [i, j, n + j], [i, n + j, n + i])
    ]  # fmt: skip
    return np.concatenate([low, high, [[0, 0, 0], [0, 0, 1]]]), faces


def turn_of(rng: Random) -> Any:
    kind = rng.integers(4)
    if kind == 0:
        return about(int(rng.integers(3)), [0.3, math.pi / 4, math.pi / 6][rng.integers(3)])
    if kind == 1:
        return about(2, math.pi / 4) @ about(0, math.pi / 4)
    if kind == 2:
        return np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    return Pose.from_quaternion(rng.normal(size=4)).rotation


def awkward(rng: Random, n: int) -> tuple[Any, Any, Any]:
    """Return corners and faces of a mesh, a pose, and segments whose ends lie in its corners, edges and faces, as far
    as rounding lets them."""
    corners, faces = [(CORNERS, SIDES), (2 * CORNERS - 1, SIDES), (np.array(OCTAHEDRON) + 0.0, FACES), fan(5)][
        rng.integers(4)
    ]
    steps = [np.zeros(3), rng.integers(-3, 4, 3) + 0.0, rng.normal(size=3), rng.integers(-3, 4, 3) * 2.0**-30]
    pose = Pose(turn_of(rng), steps[rng.integers(4)])
    ends = []
    for _ in range(n):
        triangles = corners[np.array(faces)[rng.integers(len(faces), size=2)]]
        weights = rng.integers(0, 3, (2, 3)) + 0.0
        weights[weights.sum(axis=1) == 0] = 1.0
        p, q = np.einsum("ik,ikd->id", weights / weights.sum(axis=1, keepdims=True), triangles[[0, rng.integers(2)]])
        if (p == q).all():
            q = np.add(p, [0.3, 0.2, 0.1])
        p, q = p + (p - q) * [0.0, 1.0, 0.5][rng.integers(3)], q + (q - p) * [0.0, 1.0, 0.5][rng.integers(3)]
        ends.append([pose.rotation @ p + pose.translation, pose.rotation @ q + pose.translation])
    return (corners, faces), pose, np.array(ends)


@pytest.mark.parametrize("seed", range(24))
def test_pieces_are_those_of_rationals(seed: int) -> None:
    rng = np.random.default_rng([7, seed])
    mesh, pose, segments = awkward(rng, 12)
    scale = 2.0 ** [0, 40, -40, 0][seed % 4]
    placed = Pose(pose.rotation, pose.translation * scale)
    solids: list[Any] = [Polyhedron(mesh[0] * scale, mesh[1]), Surface(mesh[0] * scale, mesh[1][:-1])]
    for solid in solids:
        found, left, are_long = cut_posed(segments * scale, solid, placed, UNLIMITED)
        expected = clip_exactly(segments * scale, np.arange(len(segments)), solid, placed, UNLIMITED)
        assert not len(left)
        assert not (are_long == UNDECIDED).any()
        for column, other in zip(found, expected):
            np.testing.assert_array_equal(column, other)
        differ = found.t[:, 0] != found.t[:, 1]
        assert (are_long[differ] == 1).all()


@pytest.mark.parametrize("seed", range(8))
def test_pieces_without_a_pose(seed: int) -> None:
    """Lattice lines: back from a start in a corner they passed its triangles on the wrong side."""
    rng = np.random.default_rng([10, seed])
    corners, faces = [(CORNERS, SIDES), (np.array(OCTAHEDRON) + 0.0, FACES)][seed % 2]
    segments = rng.integers(-2, 4, (120, 2, 3)) / [1.0, 2.0][seed // 4]
    segments = segments[(segments[:, 0] != segments[:, 1]).any(axis=1)]
    for solid in (Polyhedron(corners, faces), Surface(corners, faces[:-1])):
        found, left, are_long = cut_posed(segments, solid, None, UNLIMITED)
        assert not len(left)
        assert not (are_long == UNDECIDED).any()
        for column, other in zip(found, clip_exactly(segments, np.arange(len(segments)), solid, None, UNLIMITED)):
            np.testing.assert_array_equal(column, other)


@pytest.mark.parametrize("off", [1e-30, 2.0**-53, 3e-16])
def test_segments_as_long_along_two_axes_but_for_what_rounds(off: float) -> None:
    """Signs in doubles and in integers are perturbed along the same axis: the rounded vector's longest."""
    starts = np.array([[x, y, off] for x in (0.0, 1.0) for y in (0.0, 0.5, 1.0)])
    ways = np.array([[x, y, z] for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0) for z in (-1.0, 1.0)])
    ends = np.round(starts)[:, None] + ways
    segments = np.stack([np.broadcast_to(starts[:, None], ends.shape), ends], axis=2).reshape(-1, 2, 3)
    solid = Polyhedron(CORNERS, SIDES)
    found, left, _ = cut_posed(segments, solid, None, UNLIMITED)
    assert not len(left)
    for column, other in zip(found, clip_exactly(segments, np.arange(len(segments)), solid, None, UNLIMITED)):
        np.testing.assert_array_equal(column, other)


@pytest.mark.parametrize("seed", range(4))
def test_a_corner_at_an_end_is_a_point(seed: int) -> None:
    """One in nine was ranked as a piece longer than that, where no pose is."""
    rng = np.random.default_rng([11, seed])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    solid: Any = Polyhedron(CORNERS @ Pose.from_quaternion(rng.normal(size=4)).rotation, quads)
    corners = np.tile(solid.vertices, (2, 1))
    away = corners + rng.normal(size=corners.shape)
    segments = np.concatenate([np.stack([away, corners], axis=1), np.stack([corners, away], axis=1)])
    found, report = Scene([solid]).clip_segments(segments, report=True)
    assert report.n_rational == 0
    assert_exact(found, segments, expected_pieces(segments, [solid], [None]))


@pytest.mark.parametrize("seed", range(6))
def test_in_scenes(seed: int) -> None:
    rng = np.random.default_rng([8, seed])
    mesh, pose, segments = awkward(rng, 6)
    solids: list[Any] = [Polyhedron(*mesh), Surface(*mesh), Polyhedron(*mesh)]
    poses = [pose, pose, Pose(pose.rotation @ about(2, 1.0), pose.translation)]
    scene = Scene(solids, poses)
    found, report = scene.clip_segments(segments, report=True)
    assert report.n_rational == 0
    assert_exact(found, segments, expected_pieces(segments, solids, list(poses)))
    assert_first_and_any(scene, segments, found)


@pytest.mark.parametrize("seed", range(24))
def test_hits_are_those_of_integers(seed: int) -> None:
    rng = np.random.default_rng([9, seed])
    mesh, pose, segments = awkward(rng, 12)
    solid = Surface(mesh[0], mesh[1][: -(seed % 2) or None])
    target, is_ray = on_one.on_mesh(solid, UNLIMITED), seed % 3 == 0
    given = np.stack([segments[:, 0], segments[:, 1] - segments[:, 0]], axis=1) if is_ray else segments
    lines = lines_on(on_one.plain_lines(given, is_ray), np.arange(len(given)), pose)
    (source, *columns), left = on_one.find(lines, target, on_one.ALL, UNLIMITED, 1)
    assert not len(left)
    exact = on_one.exact_on(lines, np.arange(len(given)), target, UNLIMITED)
    rows = on_one.columns_of([(item, each) for item, found in exact.items() for each in found])
    for column, other in zip([source, *columns], rows):
        np.testing.assert_array_equal(column, other)
    assert engine.Scene([solid], [pose]).hits(given, rays=is_ray, keep="any").tolist() == [
        bool(x) for x in exact.values()
    ]


def test_numbers_too_far_apart_take_rationals() -> None:
    """A corner of 2^-1000 beside those of size 1: products of its bits with others are too long."""
    corners = CORNERS + [[2.0**-1000, 0, 0]] * (CORNERS == [0, 0, 1]).all(axis=1)[:, None]
    pose = Pose(about(2, 0.3), [0.5, 0.25, 0.125])
    solid = Polyhedron(corners, SIDES)
    p, q = (pose.rotation @ corners[k] + pose.translation for k in (1, 5))
    segments = np.array([[p, q], [p, 2 * q - p]])
    found, report = Scene([solid], [pose]).clip_segments(segments, report=True)
    assert report.n_rational == 2
    assert_exact(found, segments, expected_pieces(segments, [solid], [pose]))


@pytest.mark.parametrize("pose", [None, Pose(about(2, 0.3), [0, 0, 0.25])])
def test_a_point_on_a_face_without_area(pose: Any) -> None:
    """It was a ZeroDivisionError."""
    flat, z = Surface([[0, 0, 1], [1, 0, 1], [2, 0, 1], [0, 2, 1]], [[0, 1, 2], [0, 2, 3]]), 1.25 if pose else 1.0
    segments = np.array([[[0, 0, z], [0, 0, z]], [[0, 0, z], [0, 0, 3]], [[1.5, 0, z], [1.5, 0, z]]])
    found = Scene([flat], [pose]).clip_segments(segments)
    assert_exact(found, segments, expected_pieces(segments, [flat], [pose]))
