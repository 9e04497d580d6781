"""The search over two trees: the pair of triangles that is the nearest is among those that it leaves."""

from __future__ import annotations

import random
from fractions import Fraction

import numpy as np
import pytest

import engine.collision.clearance.spreads as spreads
from engine import DeadlineExceededError, Polyhedron, Pose, clearance
from engine.budget import Budget
from engine.collision.clearance.spreads import SpreadPair, _ExactPair, spread_pair


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
