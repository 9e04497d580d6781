"""Many pairs of convex bodies at once: what is sure is what one pair at a time says."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine import Aabb, Polyhedron, Pose, Sphere, clearance, clearance_poses, collide_scene
from engine.collision.convex_body import convex_body_of, pool_bodies
from engine.collision.meshes.placement import PoseArrays
from engine.collision.simple.form_relations import N_NUMBERS
from engine.distance.convex_gaps import gaps_of_pairs
from tests.reference.exact import nearest_double_with_root
from tests.unit.distance.makers import CORNERS, QUADS

TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
N = 12


def bodies(size: float) -> list[Any]:
    return [
        Aabb(size * np.array([-0.5, -0.3, -0.4]), size * np.array([0.5, 0.3, 0.4])),
        Polyhedron(size * TETRAHEDRON, FACES),
        Polyhedron(size * (TETRAHEDRON * [3.0, 0.01, 0.2] + 7.0), FACES),
        Sphere([0.1 * size, 0, 0], 0.4 * size),
    ]


def turns(draw: np.random.Generator) -> Any:
    found = np.linalg.qr(draw.normal(size=(N, 3, 3)))[0]
    found[:, 0] *= np.sign(np.linalg.det(found))[:, None]
    found[::3] = np.eye(3)
    return found


@pytest.mark.parametrize("size", [1.0, 1e-12, 1e40, 1e-150, 1e290])
def test_what_is_sure_is_what_clearance_says(size: float) -> None:
    draw, some = np.random.default_rng(5), bodies(size)
    pool = pool_bodies([found for solid in some if (found := convex_body_of(solid)) is not None])
    forms, numbers = np.full((len(some), N_NUMBERS), np.nan), np.arange(len(some))
    n_sure = n = 0
    for first in range(len(some)):
        for second in range(len(some)):
            rotations, moves = np.concatenate([turns(draw), turns(draw)]), draw.normal(size=(2 * N, 3))
            moves[N:] += moves[N:] * draw.choice([0.0, 1.0, 5.0], (N, 1))
            moves *= size * draw.choice([1.0, 1.0, 30.0])
            rotations[-2:], moves[-2:] = rotations[:2], moves[:2] + np.array([1.25 * size, 0, 0])  # parallel faces
            poses = [Pose(turn, move) for turn, move in zip(rotations, moves)]
            places = np.column_stack([np.arange(N), N + np.arange(N)])
            alone: list[Any] = [
                clearance(some[first], some[second], first_pose=poses[i], second_pose=poses[j]).distance  # type: ignore[union-attr]
                for i, j in places
            ]
            expected, kinds = np.array(alone), np.broadcast_to([first, second], (N, 2)).copy()
            places, kinds, expected = places[expected > 0], kinds[expected > 0], expected[expected > 0]
            for gap in (1e308, float(np.median(expected)), 0.5 * size):
                found, told = np.empty(len(places)), np.empty(len(places))
                for is_measured, answers in ((True, found), (False, told)):
                    gaps_of_pairs(forms, pool, numbers, kinds, PoseArrays(rotations, moves, True), places, gap,
                                  is_measured, answers, np.zeros(1, np.uint8))  # fmt: skip
                below = np.where(expected < gap, expected, np.inf)
                assert (np.isnan(found) | (found == below)).all(), (first, second, gap)
                assert (np.isnan(told) | ((told == np.inf) == (below == np.inf))).all(), (first, second, gap)
                n_sure, n = n_sure + int((~np.isnan(found)).sum()), n + len(found)
    assert n_sure > 0.8 * n or not 1e-30 < size < 1e50


def test_the_gap_itself_is_left_open() -> None:
    box, other = Aabb([0, 0, 0], [1, 1, 1]), Aabb([4, 5, 0], [5, 6, 1])  # 5 apart
    pool = pool_bodies([body for solid in (box, other) if (body := convex_body_of(solid)) is not None])
    still = PoseArrays(np.eye(3)[None], np.zeros((1, 3)), True)
    for gap, expected in ((5.0, np.nan), (np.nextafter(5.0, 6.0), 5.0), (np.nextafter(5.0, 4.0), np.inf)):
        found = np.empty(1)
        gaps_of_pairs(np.full((2, N_NUMBERS), np.nan), pool, np.arange(2), np.array([[0, 1]]), still,
                      np.zeros((1, 2), np.int64), gap, True, found, np.zeros(1, np.uint8))  # fmt: skip
        assert np.array_equal(found, [expected], equal_nan=True)


def test_boxes_of_rounded_sizes_are_as_far_as_rationals_say() -> None:
    """Of parallel edges the denominator of the weights is 0, and rounds to a number on either side of it."""
    draw, some = np.random.default_rng(0), [1, 3, 7, 10]
    for _ in range(200):
        sizes = draw.integers(1, 10, (2, 3)) / draw.choice(some, (2, 1))
        move = draw.integers(-30, 30, 3) / draw.choice(some)
        first, second = (Polyhedron(np.array(CORNERS) * size, QUADS) for size in sizes)
        square = Fraction(0)
        for x, own, their in zip(move.tolist(), *sizes.tolist()):
            square += max(Fraction(0), Fraction(x) - Fraction(own), -Fraction(x) - Fraction(their)) ** 2
        expected = nearest_double_with_root(Fraction(0), Fraction(1), square) if square else 0.0
        assert clearance_poses(first, second, np.eye(3)[None], move[None]).tolist() == [expected]
        found = collide_scene([first, second], [None, Pose(np.eye(3), move)], gap=100.0)
        assert np.array_equal(found.distance, [expected])  # type: ignore[arg-type]
