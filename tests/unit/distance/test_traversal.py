"""The way down two trees, triangles that are near, the exact distance of two."""

from __future__ import annotations

import random
from fractions import Fraction

import numpy as np
import pytest

import engine.distance.spreads as spreads
from engine import DeadlineExceededError, Polyhedron, Pose, clearance
from engine.collision.meshes.near_triangles import FACE, nearest_points, relative_to, rounding_bound
from engine.collision.meshes.triangle_triangle import Facet
from engine.compiling.jit import kernel
from engine.distance.exact import nearest_of_triangles
from engine.distance.spreads import SpreadPair, _ExactPair, spread_pair
from engine.running.budget import Budget
from engine.types import Point3
from tests.reference.distance import squared_distance
from tests.reference.exact import Q, q, square, sub, vector
from tests.unit.distance.makers import turn


def ball(n: int, seed: int) -> Polyhedron:
    """Return a bumpy ball of 8 n^2 faces or so."""
    rng = np.random.default_rng(seed)
    turn, rise = np.linspace(0, 2 * np.pi, 4 * n, endpoint=False), np.linspace(-1, 1, n + 2)[1:-1]
    rings = [[(np.sqrt(1 - z * z) * np.cos(a), np.sqrt(1 - z * z) * np.sin(a), z) for a in turn] for z in rise]
    vertices = np.array([p for ring in rings for p in ring] + [(0, 0, -1.0), (0, 0, 1.0)])
    vertices *= rng.uniform(0.8, 1.2, (len(vertices), 1))
    m = 4 * n
    faces = []
    for k in range(m):
        after = (k + 1) % m
        for low in range(0, m * (n - 1), m):
            faces += [[low + k, low + after, low + m + after], [low + k, low + m + after, low + m + k]]
        faces += [[m * n, after, k], [m * n + 1, m * (n - 1) + k, m * (n - 1) + after]]
    return Polyhedron(vertices, faces)


def one(pair: SpreadPair, least: Fraction | None = None) -> float:
    """Return the distance under the one pose, or 0.0 where it is below the least."""
    answers = np.full(1, np.nan)
    pair.fill(0, 1, answers, least)
    return float(answers[0])


def least(first: Polyhedron, second: Polyhedron, pose: Pose | None, every_pair: bool) -> float:
    with Budget() as budget:
        pair = spread_pair(first, second, (None, pose), budget)
        if every_pair:
            a, b = (range(len(mesh.faces)) for mesh in pair.meshes)
            exact = _ExactPair(*pair.meshes, (None, pose), (0.0, 0.0))
            gaps = [exact.gap(i, j, 0, 0) for i in a for j in b]
            best = gaps[0]
            for gap in gaps:
                best = gap if gap.gap.is_less(best.gap) else best
            return best.distance()
        return one(pair)


@pytest.mark.parametrize("n", [2, pytest.param(5, marks=pytest.mark.full)])
def test_finds_what_looking_at_every_pair_finds(n: int) -> None:
    rng = random.Random(n)
    first, second = ball(n, 1), ball(n, 2)
    for away in (2.6, 3.0, 8.0):
        turn = np.linalg.qr(np.random.default_rng(int(away)).normal(size=(3, 3)))[0]
        turn[0] *= np.sign(np.linalg.det(turn))
        pose = Pose(turn, [away, rng.uniform(-0.3, 0.3), 0.1])
        assert least(first, second, pose, False) == least(first, second, pose, True)


def test_bodies_that_enclose_each_other_and_little_room(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ball in a cavity of its own shape: no line parts them, so that the heap does all, and its room must grow."""
    inner, outer = ball(6, 3), ball(6, 3)
    shell = Polyhedron(
        np.concatenate([3.0 * outer.vertices, 1.5 * outer.vertices]),
        np.concatenate([outer.triangles, outer.triangles[:, ::-1] + len(outer.vertices)]),
    )
    with Budget() as budget:
        expected = one(spread_pair(shell, inner, (None, None), budget))
        monkeypatch.setattr(spreads, "_ROOM", 32)
        pair = spread_pair(shell, inner, (None, None), budget)
        assert one(pair) == expected
        assert one(pair, Fraction(expected) / 2)
        assert not one(pair, Fraction(expected) * 2)
    assert clearance(shell, inner).distance == expected  # type: ignore[union-attr]


def test_the_deadline_holds() -> None:
    with pytest.raises(DeadlineExceededError):
        clearance(ball(6, 3), ball(6, 4), second_pose=Pose(np.eye(3), [3, 0, 0]), deadline=0.0)


def test_the_deadline_holds_where_every_pair_of_triangles_is_a_candidate() -> None:
    """Sums of coordinates beyond 1e300 are not searched: the list of all pairs would be long before it is looked at."""
    first = ball(20, 3)
    huge = [Polyhedron(1e304 * (first.vertices + np.array([away, 0, 0])), first.triangles) for away in (0, 3)]
    with pytest.raises(DeadlineExceededError):
        clearance(huge[0], huge[1], at_least=1e304, deadline=0.05)


# --- Float bounds on the distance of two triangles: both sides of the exact one, and close to it ---


@kernel
def bounds(s: Facet, t: Facet) -> tuple[float, float]:
    origin = s.p
    s, t = relative_to(origin, s), relative_to(origin, t)
    _, across = nearest_points(s, t, np.inf)
    slack = rounding_bound(s, t)
    return across.low - slack, across.size + slack


def test_bounds_enclose_the_exact_distance_closely() -> None:
    rng = random.Random(7)
    for _ in range(200):
        offset = rng.choice([2.5, 2.0 + 2.0**-40, 9.0])
        whole = rng.random() < 0.5
        s, t = (
            [[float(rng.randint(0, 2)) if whole else rng.uniform(0, 2) for _ in range(3)] for _ in range(3)]
            for _ in range(2)
        )
        t = [[x + offset, y, z] for x, y, z in t]
        low, high = bounds(*(Facet(*(Point3(*p) for p in hull)) for hull in (s, t)))
        exact = squared_distance(*[tuple(dict.fromkeys(map(vector, hull))) for hull in (s, t)])
        assert q(max(low, 0.0)) ** 2 <= exact <= q(high) ** 2, (s, t)
        assert high - low <= 1e-12 * (1.0 + high) or np.sqrt(float(exact)) < 1e-6, (s, t)


def test_the_foot_on_a_needle_is_a_point_of_it_though_its_normal_is_rounded_away() -> None:
    """A foot along such a normal lay off the needle, and nearer than any point of it."""
    rng = random.Random(1)
    for _ in range(400):
        rotation, thin, near = turn(rng, 3), 10.0 ** rng.uniform(-17, -1), 10.0 ** rng.uniform(-8, 0)
        slant = 10.0 ** rng.uniform(-8, 0)
        first = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [rng.uniform(-1, 1), thin, -thin * rng.uniform(-1, 1)]]
        second = [
            [-1.0, -slant, near],
            [1.0, slant, near],
            [rng.uniform(-1, 1), 0.0, near + slant * rng.uniform(-1, 1)],
        ]
        hulls = [[[sum(r * x for r, x in zip(row, p)) for row in rotation] for p in hull] for hull in (first, second)]
        low, high = bounds(*(Facet(*(Point3(*p) for p in hull)) for hull in hulls))
        exact = squared_distance(*[tuple(dict.fromkeys(map(vector, hull))) for hull in hulls])
        assert q(max(low, 0.0)) ** 2 <= exact <= q(high) ** 2, hulls


# --- The squared distance of two triangles in integers, against every choice of corners ---


def test_is_the_least_of_all_choices_of_corners_from_any_suggestion() -> None:
    rng = random.Random(5)
    for _ in range(60):
        s, t = ([tuple(rng.randint(0, 3) for _ in range(3)) for _ in range(3)] for _ in range(2))
        t = [(x + 4, y, z) for x, y, z in t]  # apart, often parallel, often without area
        expected = squared_distance(*[tuple(dict.fromkeys(map(vector, hull))) for hull in (s, t)])
        for first, second in [(0, 0), (rng.randrange(7), rng.randrange(7)), (FACE, 1)]:
            gap = nearest_of_triangles((s[0], s[1], s[2]), (t[0], t[1], t[2]), first, second)
            assert Q(gap.top, gap.bottom) == expected, (s, t, first, second)
            p, q = ([Q(x, end.denominator) for x in end.numerators] for end in (gap.p, gap.q))
            assert square(sub(tuple(p), tuple(q))) == expected
