"""Clearance of pairs and of poses."""

from __future__ import annotations

import math
import random
from fractions import Fraction
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
import pytest

from engine import (
    Aabb,
    Cancel,
    CancelledError,
    Convex,
    HalfSpace,
    InvalidInputError,
    NotRepresentableError,
    NotRigidError,
    Polygon,
    Polyhedron,
    Pose,
    Sphere,
    Surface,
    UnsupportedPairError,
    clearance,
    clearance_poses,
)
from engine.collision.result import Clearance, Feature
from engine.predicates.rational import nearest_with_root
from tests.unit.collision.lattices import solid
from tests.unit.distance.makers import (
    FAMILIES,
    KINDS,
    Family,
    Question,
    Scale,
    body,
    distance,
    is_at_least,
    is_nearest,
    placed,
    pose,
    turn,
)

COUNTS = pytest.mark.parametrize("n", [4, pytest.param(400, marks=pytest.mark.full)])


def lengths_agree(found: Clearance) -> bool:
    """Tell whether the points are as far apart as is said, but for their rounding."""
    assert found.points is not None
    p, q = ([Fraction(x) for x in row] for row in found.points.tolist())
    squared = sum((x - y) ** 2 for x, y in zip(p, q))
    size = max(abs(x) for x in (*p, *q, Fraction(found.distance)))
    slack = Fraction(1, 2**48) * size + Fraction(1, 2**1060)
    return max(Fraction(found.distance) - slack, Fraction(0)) ** 2 <= squared <= (Fraction(found.distance) + slack) ** 2


def drawn(rng: random.Random, d: int, first: str, second: str) -> Question:
    """Return two bodies of named types of any size, anywhere or far away, and their poses."""
    scale = Scale(rng)
    offset = [rng.choice([0.0, 0.0, 5.0, *([1e6, 1e9] if scale.size < 1e299 else [])]) * scale.size for _ in range(d)]
    a, b = body(rng, scale, first, [0.0] * d), body(rng, scale, second, offset)
    return a, b, pose(rng, scale, d), pose(rng, scale, d)


def assert_agrees(question: Question, least: float) -> None:
    """Hold distance, points, bounds about the distance and another one, and the mirrored pair against rationals."""
    a, b, p, q = question
    try:
        one, other = solid(a), solid(b)
        exact = distance(a, b, p, q)
        found: Any = clearance(one, other, first_pose=placed(p), second_pose=placed(q))
    except (NotRepresentableError, NotImplementedError):
        return
    if exact is None:
        assert (found.distance, found.points, found.features) == (0.0, None, None), question
    else:
        assert is_nearest(found.distance, exact), question
        assert lengths_agree(found), question
    around = (0.0, math.nextafter(found.distance, 0.0), found.distance, math.nextafter(found.distance, math.inf))
    for bound in {*around, least}:
        answer = clearance(one, other, first_pose=placed(p), second_pose=placed(q), at_least=bound)
        assert answer == is_at_least(bound, exact), (question, bound)
    mirrored: Any = clearance(other, one, first_pose=placed(q), second_pose=placed(p))
    assert mirrored.distance == found.distance, question


@pytest.mark.parametrize(
    ("d", "first", "second"),
    [(d, *pair) for d in (2, 3) for pair in combinations_with_replacement(KINDS[d], 2)],
)
@COUNTS
def test_agrees_with_the_reference(d: int, first: str, second: str, n: int, seed: str) -> None:
    rng = random.Random(f"{d}{first}{second}{seed}")
    for _ in range(n):
        assert_agrees(drawn(rng, d, first, second), rng.choice([0.5, 1e-310, 1e300]))


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("family", FAMILIES)
@COUNTS
def test_agrees_with_the_reference_near_contact(family: Family, d: int, n: int, seed: str) -> None:
    rng = random.Random(f"{d}{family.__name__}{seed}")
    for _ in range(n):
        assert_agrees(family(rng, d), 1e-12)


def test_pythagorean_balls_are_at_least_their_distance_apart_and_no_ulp_more() -> None:
    for x, y, z, length in [(1, 2, 2, 3), (2, 3, 6, 7), (4, 4, 7, 9), (12, 15, 16, 25)]:
        for r, radius in [(1.0, 0.5), (0.25, 1.75), (0.0, 0.0)]:
            one, other = Sphere([0, 0, 0], r), Sphere([x, y, z], radius)
            exact = length - r - radius
            assert clearance(one, other).distance == exact  # type: ignore[union-attr]
            assert clearance(one, other, at_least=exact) is True
            assert clearance(one, other, at_least=math.nextafter(exact, math.inf)) is False


def test_names_the_features_and_the_smallest_faces() -> None:
    box, other = Aabb([0, 0, 0], [1, 1, 1]), Aabb([3, 2, 0.25], [4, 3, 0.75])
    found: Any = clearance(box, other)
    assert found.features[1].kind == "edge" or found.features[1].kind == "vertex"
    ball: Any = clearance(Polyhedron(*tetrahedron()), Sphere([0.25, 0.25, -2], 1))
    assert (ball.distance, ball.features) == (1.0, (Feature("face", (0,)), Feature("ball")))
    assert ball.points.tolist() == [[0.25, 0.25, 0.0], [0.25, 0.25, -1.0]]
    quad = Surface([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], [[0, 1, 2, 3]])
    diagonal: Any = clearance(quad, Sphere([2, 2, 3], 1))  # over the edge that cuts the face
    assert diagonal.features == (Feature("face", (0,)), Feature("ball"))
    edge: Any = clearance(Polygon([[(0, 0), (4, 0), (4, 4)]]), Sphere([2, -3], 1))
    assert edge.features == (Feature("edge", (0, 1)), Feature("ball"))
    plane: Any = clearance(HalfSpace([0, 0, 1], -2), box)
    assert (plane.distance, plane.features[0]) == (1.0, Feature("plane"))
    assert plane.features[1].kind == "vertex"


def tetrahedron() -> tuple[list[list[float]], list[list[int]]]:
    return [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


def test_a_body_in_a_cavity_is_as_far_as_the_walls_and_one_within_is_no_distance_apart() -> None:
    corners = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    outer, inner = np.array(corners) * 10.0, np.array(corners) * 6.0 + 2.0
    hollow = Polyhedron([*outer.tolist(), *inner.tolist()], quads + [[i + 8 for i in quad[::-1]] for quad in quads])
    assert clearance(hollow, Sphere([5, 5, 5], 1)).distance == 2.0  # type: ignore[union-attr]
    assert clearance(hollow, Sphere([1, 1, 1], 0.25)).distance == 0.0  # type: ignore[union-attr]
    assert clearance(hollow, Sphere([1, 1, 1], 0.25), at_least=0.1) is False


def test_equal_poses_are_left_out_and_a_denormal_gap_is_kept() -> None:
    box, beside = Aabb([0, 0, 0], [1, 1, 1]), Aabb([2, 0, 0], [3, 1, 1])
    tilted = Pose([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]], [1, 2, 3])
    assert clearance(box, beside, first_pose=tilted, second_pose=tilted).distance == 1.0  # type: ignore[union-attr]
    tiny = Aabb([0, 0], [5e-324, 1]), Aabb([1e-323, 0], [1, 1])
    assert clearance(*tiny).distance == 5e-324  # type: ignore[union-attr]
    wide = Sphere([-1.7e308, 0], 0), Sphere([1.7e308, 0], 0)
    assert clearance(*wide, at_least=1.7e308) is True
    with pytest.raises(NotRepresentableError, match="beyond the largest double"):
        clearance(*wide)


def test_points_of_bodies_moved_together_are_where_the_bodies_are() -> None:
    tetrahedron = Polyhedron(
        [[3, 0.5, 0.5], [4, 0, 0], [4, 1, 0], [4, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    )
    box, ball = Aabb([0, 0, 0], [1, 1, 1]), Sphere([0, 0, 0.5], 1.0)
    at = Pose([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [10, 20, 30])
    for first in (box, ball):
        for second in (tetrahedron, Sphere([4, 0.5, 0.5], 1.0)):
            alone, found = clearance(first, second), clearance(first, second, first_pose=at, second_pose=at)
            assert isinstance(found, Clearance)
            assert isinstance(alone, Clearance)
            assert (found.distance, found.features) == (alone.distance, alone.features)
            assert alone.points is not None
            expected = alone.points @ at.rotation.T + at.translation
            assert found.points is not None
            assert np.abs(found.points - expected).max() < 1e-14 * 40
    one, other = Polygon([[[0, 0], [1, 0], [0, 1]]]), Polygon([[[3, 0], [4, 0], [3, 1]]])
    flat = Pose(np.eye(2), [10, 20])
    found = clearance(one, other, first_pose=flat, second_pose=flat)
    assert isinstance(found, Clearance)
    assert found.points is not None
    assert found.points.tolist() == [[11, 20], [13, 20]]


def test_a_nearest_point_beyond_the_largest_double_is_an_error_with_what_to_do() -> None:
    far = Pose(np.eye(2), [1.5e308, 0.0])
    bodies = Aabb([1e308, 0.0], [1.1e308, 1.0]), Aabb([1e308, 3.0], [1.1e308, 4.0])
    with pytest.raises(NotRepresentableError, match="a nearest point is beyond"):
        clearance(*bodies, first_pose=far, second_pose=Pose(np.eye(2), [1.5e308, 1.0]))


def test_denormal_coordinates_are_made_larger_before_they_are_multiplied() -> None:
    """No pair of triangles was left where products of denormal coordinates were rounded."""
    flat = Aabb([5.1383e-320, 5.898e-320, -4.0474e-320], [1.3233e-319, 5.898e-320, 4.0474e-320])
    other = Aabb([1.3234e-319, 1.2142e-319, 1.2142e-319], [1.87024e-319, 2.0237e-319, 2.6068e-319])
    step = Pose(np.eye(3), [5.9e-321, 0.0, 0.0])
    assert clearance(flat, other, first_pose=step).distance == 1.0223e-319  # type: ignore[union-attr]


def test_turned_denormal_triangles_are_no_nearer_than_they_are() -> None:
    """Products of rotations and denormal numbers rounded the map between two trees by a part of the bodies."""
    rng = random.Random(4)
    for _ in range(150):
        size = rng.choice([2, 3, 4])
        bodies = [
            {"type": "surface", "faces": [[0, 1, 2]],
             "vertices": [[5e-324 * rng.randint(-size, size) for _ in range(3)] for _ in range(3)]} for _ in range(2)
        ]  # fmt: skip
        poses = [{"rotation": turn(rng, 3), "translation": [5e-324 * rng.randint(-size, size) for _ in range(3)]}
                 for _ in range(2)]  # fmt: skip
        assert_agrees((*bodies, *poses), 5e-324)  # type: ignore[arg-type]


def test_needles_are_as_far_apart_as_their_points() -> None:
    """The foot of a corner on a needle lay beside it: no pair was left, or `at_least` said no to the distance."""
    crossing = [
        [[510485.3506275446, 33231.7275930698, 859244.0625781787],
         [-510485.3506275446, -33231.7275930698, -859244.0625781787],
         [212531.8694631146, 13835.463019897632, 357731.6111428738]],
        [[510306.35199255316, 33462.93879106929, 859341.4652103785],
         [-510664.4090051294, -33000.57863215807, -859146.6220452638],
         [368675.6568592879, 24242.992387942573, 620950.1022030174]],
    ]  # fmt: skip
    beside = [
        [[0.8526763598924814, 0.5055056749863391, -0.13193573373848919],
         [-0.8526763598924814, -0.5055056749863391, 0.13193573373848919],
         [0.7344097446193057, 0.4353917982634468, -0.1136361849333536]],
        [[0.852675692701738, 0.5055068900774163, -0.1319353901040582],
         [-0.8526768623732406, -0.5055046148483314, 0.13193654816769268],
         [0.7615792843749679, 0.4515006325576422, -0.1178396749860621]],
    ]  # fmt: skip
    for pair in (crossing, beside):
        first, second = ({"type": "surface", "vertices": corners, "faces": [[0, 1, 2]]} for corners in pair)
        assert_agrees((first, second, None, None), 1e-12)


@pytest.mark.parametrize("wrong", [-1.0, math.nan, math.inf, "1", True, None.__class__])
def test_refuses_what_is_no_distance(wrong: Any) -> None:
    with pytest.raises(InvalidInputError, match="at_least must be a distance"):
        clearance(Sphere([0, 0], 1), Sphere([3, 0], 1), at_least=wrong)


def test_refuses_pairs_that_collide_refuses() -> None:
    with pytest.raises(UnsupportedPairError, match="convex"):
        clearance(Convex([[1, 0, 0]]), Sphere([0, 0], 1))


# --- Distances under many poses, against those of one pair at a time ---


@pytest.mark.parametrize("d", [2, 3])
def test_is_what_one_pair_at_a_time_says(d: int) -> None:
    rng = random.Random(d)
    for first in KINDS[d]:
        second = rng.choice(KINDS[d])
        scale = Scale(rng)
        one = solid(body(rng, scale, first, [0.0] * d))
        other = solid(body(rng, scale, second, [4.0 * scale.size] * d))
        turns = [turn(rng, d) for _ in range(8)]
        moves = [[2.0 * scale.number() for _ in range(d)] for _ in turns]
        poses = [Pose(r, t) for r, t in zip(turns, moves)]
        singly: list[Any] = [clearance(one, other, second_pose=pose) for pose in poses]
        found, report = clearance_poses(one, other, turns, moves, report=True)
        assert found.tolist() == [answer.distance for answer in singly], (first, second)
        assert (report.n_items, report.decisions) == (8, "exact")
        least = sorted(answer.distance for answer in singly)[4]
        bools = [clearance(one, other, second_pose=pose, at_least=least) for pose in poses]
        for workers in (1, 2):
            assert clearance_poses(one, other, turns, moves, at_least=least, workers=workers).tolist() == bools


def test_empty_and_wrong_input() -> None:
    box = solid({"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]})
    assert clearance_poses(box, box, np.empty((0, 3, 3)), np.empty((0, 3))).tolist() == []
    assert clearance_poses(box, box, [np.eye(3)], [[0.5, 0, 0]], at_least=0.0).tolist() == [True]
    with pytest.raises(NotRigidError, match=r"rotations\[1\]"):
        clearance_poses(box, box, [np.eye(3), 2.0 * np.eye(3)], np.zeros((2, 3)))
    cancel = Cancel()
    cancel.set()
    with pytest.raises(CancelledError):
        clearance_poses(box, box, [np.eye(3)], [[3, 0, 0]], cancel=cancel)


def test_near_ties_of_rings_around_rings_are_parted_exactly() -> None:
    """Of 600 corners each is as far from the other ring as the rest, but for its rounding."""
    n = 600
    t = np.arange(n) * 2 * np.pi / n
    ring = np.stack([np.cos(t), np.sin(t)], 1)
    move = np.array([0.3, 0.1])
    inner, hole = ring + move, ring * 1.5 + move
    found = clearance(Polygon([ring * 2 + move, hole]), Polygon([inner]))
    assert isinstance(found, Clearance)
    assert found.features is not None
    best = None
    for own, other in ((inner, hole), (hole, inner)):
        for step in (-1, 0):
            for k in range(n):
                places = own[k], other[(k + step) % n], other[(k + step + 1) % n]
                size = squared_from_segment(*(tuple(map(Fraction, place)) for place in places))
                best = size if best is None else min(best, size)
    assert best is not None
    assert found.distance == nearest_with_root(0, 1, best.numerator * best.denominator, best.denominator)
    bodies = np.concatenate([ring * 2 + move, hole]), inner
    ends = [[tuple(map(Fraction, body[k])) for k in each.indices] for body, each in zip(bodies, found.features)]
    ends.sort(key=len)
    assert len(ends[0]) == 1
    assert squared_from_segment(ends[0][0], ends[1][0], ends[1][-1]) == best


def squared_from_segment(p: Any, a: Any, b: Any) -> Fraction:
    """Return the exact squared distance of a point from a segment."""
    u, w = (b[0] - a[0], b[1] - a[1]), (p[0] - a[0], p[1] - a[1])
    size, along = u[0] * u[0] + u[1] * u[1], u[0] * w[0] + u[1] * w[1]
    share = Fraction(0) if size == 0 else min(max(along / size, Fraction(0)), Fraction(1))
    return Fraction((w[0] - share * u[0]) ** 2 + (w[1] - share * u[1]) ** 2)
