"""Nearest points of convex bodies: what floats prove is what a search in both trees and integers say."""

from __future__ import annotations

import random
from fractions import Fraction

import numpy as np
import pytest

from engine import Aabb, Clearance, Polyhedron, Pose, Sphere, Surface, Triangle, clearance, clearance_poses, contains
from engine.bounding.aabb import corners_of_box
from engine.distance.clearance import do_meet
from engine.distance.convex_nearest import MOST_TRIANGLES, hull_of, nearest_of_hulls, nearest_of_meshes
from engine.distance.spreads import SpreadPair, spread_pair
from engine.running.budget import UNLIMITED
from engine.solids.base import Solid
from tests.unit.distance.makers import CORNERS, QUADS, turn
from tests.unit.distance.test_traversal import ball

TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
SIZES = [1.0, 1.0, 1.0, 2.0**-30, 1e6, 1e-12, 1e40, 1e-60, 1e-290, 1e290]


def hull(rng: np.random.Generator) -> Solid:
    """Return a convex body near the origin, flat ones and lattices among them."""
    kind = int(rng.integers(6))
    if kind == 0:
        return Aabb(-rng.integers(1, 4, 3) / 2, rng.integers(1, 4, 3) / 2)
    if kind == 1:
        return Sphere(rng.normal(size=3), float(rng.uniform(0.2, 1.0)))
    if kind == 2:  # faces of four corners
        return Polyhedron(np.array(CORNERS) * rng.integers(1, 4, 3), QUADS)
    if kind == 3:  # each corner twice over, and one that no face has
        vertices = np.concatenate([np.array(CORNERS)[::-1], np.array(CORNERS), [[9.0, 9.0, 9.0]]])
        return Polyhedron(vertices, [*(np.array(QUADS[:3]) + 8).tolist(), *(7 - np.array(QUADS[3:])).tolist()])
    corners = rng.integers(-2, 3, (4, 3)).astype(float) if kind == 4 else rng.normal(size=(4, 3)) * [1, 1, 1e-5]
    corners[3] += [0.0, 0.0, 0.5]
    return Polyhedron(corners, TETRAHEDRON if rng.random() < 0.5 else [face[::-1] for face in TETRAHEDRON])


def scaled(solid: Solid, size: float, move: np.ndarray) -> Solid:
    if isinstance(solid, Aabb):
        return Aabb(size * (solid.min + move), size * (solid.max + move))
    if isinstance(solid, Sphere):
        return Sphere(size * (solid.center + move), size * solid.radius)
    assert isinstance(solid, (Polyhedron, Surface))
    faces = np.split(solid.face_indices, solid.face_offsets[1:-1])
    return type(solid)(size * (solid.vertices + move), [face.tolist() for face in faces])


def pose(rng: np.random.Generator, size: float) -> Pose | None:
    if rng.random() < 0.5:
        return None
    move = rng.integers(-3, 4, 3) if rng.random() < 0.5 else rng.normal(size=3)
    return Pose(turn(random.Random(int(rng.integers(1 << 30))), 3) if rng.random() < 0.7 else np.eye(3), size * move)


def check_crossing(found: Clearance, first: Solid, second: Solid) -> None:
    """Points of two edges are the nearest doubles to those across from each other along the axes with gaps."""
    assert found.points is not None
    assert found.features is not None
    ends = []
    for solid, feature in zip((first, second), found.features):
        corners = solid.vertices if isinstance(solid, (Polyhedron, Surface)) else corners_of_box(solid.min, solid.max)  # type: ignore[attr-defined]
        ends.append([[Fraction(x) for x in corners[k].tolist()] for k in feature.indices])
    free = [k for k in range(3) if found.points[0, k] == found.points[1, k]]
    (p, q), (s, t) = ends
    if len(free) == 2:
        i, j = free
        turn = (q[i] - p[i]) * (t[j] - s[j]) - (q[j] - p[j]) * (t[i] - s[i])
        share = ((s[i] - p[i]) * (t[j] - s[j]) - (s[j] - p[j]) * (t[i] - s[i])) / turn
        assert found.points[0].tolist() == [float(x + share * (y - x)) for x, y in zip(p, q)]
        share = ((s[i] - p[i]) * (q[j] - p[j]) - (s[j] - p[j]) * (q[i] - p[i])) / turn
        assert found.points[1].tolist() == [float(x + share * (y - x)) for x, y in zip(s, t)]


def check_tie(found: Clearance, first: Solid, second: Solid, pair: SpreadPair, is_unposed: bool) -> None:
    """Points that the search does not give are as near, exactly, and on the lowest faces that have such."""
    every = ((i, j, 0, 0) for i in range(len(pair.meshes[0].faces)) for j in range(len(pair.meshes[1].faces)))
    least, triangles = pair.least(0, every)
    assert found.distance == least.distance()
    assert found.points is not None
    if np.array_equal(found.points, least.ends()) or isinstance(first, Sphere) or isinstance(second, Sphere):
        return
    if is_unposed and [feature.kind for feature in found.features or ()] == ["edge", "edge"]:
        check_crossing(found, first, second)
        return
    square = sum((Fraction(x) - Fraction(y)) ** 2 for x, y in found.points.T.tolist())
    assert square == Fraction(least.gap.top, least.gap.bottom) / Fraction(least.scale) ** 2
    if is_unposed:
        for point, mesh, triangle in zip(found.points, pair.meshes, triangles):
            own = np.flatnonzero(mesh.faces == mesh.faces[triangle])
            corners = mesh.arrays.vertices[mesh.arrays.triangles[own]]
            assert any(contains(point[None], Triangle(each))[0] for each in corners)


@pytest.mark.parametrize("seed", range(4))
def test_points_across_axes(seed: int) -> None:
    """Boxes, prisms, balls and bodies that are not convex on a lattice, turned by right angles and moved: mostly proven
    without integers."""
    rng, n_proven, n = np.random.default_rng(seed), 0, 0
    for _ in range(150):
        size = float(rng.choice([1.0, 0.1, 2.0**-300, 2.0**300]))
        first, second = (scaled(on_lattice(rng), size, rng.integers(-6, 7, 3) / 2) for _ in range(2))
        poses = None, None
        if rng.random() < 0.5:
            turns = np.eye(3)[rng.permutation(3)] * rng.choice([-1, 1], 3)[:, None]
            turns *= np.linalg.det(turns)
            poses = None, Pose(turns, rng.integers(-4, 5, 3) * size)
        if do_meet(first, second, poses, UNLIMITED):
            continue
        found, n = nearest_of_hulls(first, second, poses), n + (size == 1.0)
        found = nearest_of_meshes(first, second, poses) if found is None else found
        if found is not None:
            n_proven += size == 1.0
            check_tie(found, first, second, spread_pair(first, second, poses, UNLIMITED), poses == (None, None))
    assert n_proven > 0.7 * n


@pytest.mark.parametrize("seed", range(3))
def test_crossed_bars(seed: int) -> None:
    """Bars across each other: only their edges cross, at points that are no doubles."""
    rng, n_proven = np.random.default_rng(seed), 0
    for _ in range(60):
        bars, axes = [], rng.permutation(3)
        for way, height in (([1, 0], 0.0), ([0, 1], float(rng.integers(3, 9)) / 2)):
            along = 9 * np.array(way) + rng.integers(-2, 3, 2)
            across = np.array([-along[1], along[0]]) * float(rng.choice([0.05, 0.1, 1 / 16]))
            middle = rng.integers(-1, 2, 2) * float(rng.choice([0.5, 0.1]))
            ring = [middle + i * along + j * across for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            corners = np.concatenate([np.column_stack([ring, np.full(4, height + z)]) for z in (0.0, 1.0)])
            sides = [[k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4] for k in range(4)]
            faces = [[3, 2, 1, 0], [4, 5, 6, 7], *sides]
            bars.append(Polyhedron(corners[:, axes], faces))
        first, second = bars
        found = nearest_of_meshes(first, second, (None, None))
        if found is not None and found.features is not None and {each.kind for each in found.features} == {"edge"}:
            n_proven += 1
            assert found.distance == spread_pair(first, second, (None, None), UNLIMITED).clearance(0).distance
            check_crossing(found, first, second)
    assert n_proven > 30


def on_lattice(rng: np.random.Generator) -> Solid:
    """Return a box, a prism of eight sides or an L, a part of its faces or a ball on a lattice, faces in any order."""
    kind = int(rng.integers(6))
    if kind == 0:
        return Aabb(-rng.integers(1, 4, 3) / 2, rng.integers(1, 4, 3) / 2)
    if kind == 1:
        return Sphere(rng.integers(-2, 3, 3) / 2, float(rng.integers(1, 4)) / 4)
    faces, corners = QUADS, np.array(CORNERS) * rng.integers(1, 4, 3)
    if kind != 5:
        eight, ell = [[1, 0], [2, 0], [3, 1], [3, 2], [2, 3], [1, 3], [0, 2], [0, 1]], [[0, 0], [2, 0], [2, 1], [1, 1],
                      [1, 2], [0, 2]]  # fmt: skip
        ring = np.array(eight if kind == 2 else ell, float)
        n = len(ring)
        corners = np.concatenate([np.column_stack([ring, np.full(n, z)]) for z in (0.0, 2.0)])
        sides = [[k, (k + 1) % n, (k + 1) % n + n, k + n] for k in range(n)]
        faces = [list(range(n))[::-1], list(range(n, 2 * n)), *sides]
        corners = corners @ np.array([[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]) if rng.random() < 0.3 else corners
    faces = [faces[k] for k in rng.permutation(len(faces))]
    return Surface(corners, faces[: len(faces) // 2]) if kind == 3 else Polyhedron(corners, faces)


@pytest.mark.parametrize("seed", range(4))
def test_nearest_points_are_those_of_the_search(seed: int) -> None:
    rng, n_proven, n = np.random.default_rng(seed), 0, 0
    for _ in range(250):
        size = float(rng.choice(SIZES))
        move = rng.integers(-4, 5, 3) * float(rng.choice([1.0, 1.0, 1e5]))
        first = scaled(hull(rng), size, move)
        second = scaled(hull(rng), size, move + rng.integers(-5, 6, 3))
        poses = pose(rng, size), pose(rng, size)
        if poses[0] is not None and poses[0] == poses[1]:
            continue
        found = nearest_of_hulls(first, second, poses)
        meet = do_meet(first, second, poses, UNLIMITED)
        n += not meet and 1e-20 < size < 1e20
        if found is not None:
            assert not meet
            pair = spread_pair(first, second, poses, UNLIMITED)
            searched = pair.clearance(0)
            assert found.distance == searched.distance
            if found.features != searched.features:  # of several pairs of points another
                check_tie(found, first, second, pair, poses == (None, None))
            else:
                assert np.array_equal(found.points, searched.points)  # type: ignore[arg-type]
            n_proven += 1e-20 < size < 1e20
    assert n_proven > 0.5 * n


def test_all_pairs_of_faces_of_lattices() -> None:
    rng = np.random.default_rng(5)
    for _ in range(40):
        first, second = scaled(hull(rng), 1.0, np.zeros(3)), scaled(hull(rng), 1.0, rng.integers(3, 7, 3))
        found = nearest_of_hulls(first, second, (None, None))
        pair = spread_pair(first, second, (None, None), UNLIMITED)
        if found is not None:
            check_tie(found, first, second, pair, True)


def test_distances_under_poses_are_those_alone() -> None:
    rng, first, second = np.random.default_rng(6), ball(1, 0), Polyhedron(np.array(CORNERS), QUADS)
    assert hull_of(second) is not None
    first = Polyhedron(np.array(CORNERS) - 0.5, QUADS) if hull_of(first) is None else first
    turns = np.array([turn(random.Random(seed), 3) for seed in range(40)])
    moves = rng.normal(size=(40, 3)) * 2.0
    turns[:4], moves[:4] = np.eye(3), [[0.5, 0, 0], [1.5, 0.25, 0], [3, 3, 3], [0.25, 0.25, 0.25]]
    alone = [clearance(first, second, second_pose=Pose(*motion)).distance for motion in zip(turns, moves)]  # type: ignore[union-attr]
    assert clearance_poses(first, second, turns, moves).tolist() == alone
    for least in (alone[1], np.median(alone), np.nextafter(alone[2], 9.0)):
        told = clearance_poses(first, second, turns, moves, at_least=float(least)).tolist()
        assert told == [
            clearance(first, second, second_pose=Pose(*motion), at_least=float(least)) for motion in zip(turns, moves)
        ]
        for distance, answer in zip(alone, told):
            assert distance == least or answer == (distance > least)


def test_what_is_not_convex_or_has_many_faces_is_left_to_the_search() -> None:
    notched = ball(2, 0)
    large = Polyhedron(*_sphere(40))
    assert len(large.triangles) > MOST_TRIANGLES
    assert hull_of(notched) is None is hull_of(large)
    assert nearest_of_hulls(notched, large, (None, None)) is None


def _sphere(n: int) -> tuple[np.ndarray, list[list[int]]]:
    """Return about a sphere of 4 n^2 triangles, of n rings."""
    angles, rise = np.arange(2 * n) * np.pi / n, np.cos(np.arange(1, n + 1) * np.pi / (n + 1))
    rings = [np.column_stack([np.outer(np.sqrt(1 - z * z), [np.cos(angles), np.sin(angles)]).reshape(2, -1).T,
                              np.full(2 * n, z)]) for z in rise]  # fmt: skip
    faces = [
        [[k, (k + 1) % (2 * n), 2 * n + (k + 1) % (2 * n)], [k, 2 * n + (k + 1) % (2 * n), 2 * n + k]]
        for k in range(2 * n)
    ]
    body = [(np.array(face) + 2 * n * ring)[::-1].tolist() for ring in range(n - 1) for pair in faces for face in pair]
    top, bottom = 2 * n * n, 2 * n * n + 1
    caps = [[top, k, (k + 1) % (2 * n)] for k in range(2 * n)]
    last = 2 * n * (n - 1)
    caps += [[bottom, last + (k + 1) % (2 * n), last + k] for k in range(2 * n)]
    return np.concatenate([*rings, [[0, 0, 1.0], [0, 0, -1.0]]]), body + caps
