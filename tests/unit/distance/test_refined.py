"""Distances and points that double-doubles are sure of are those of integers; candidates they leave out were none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Aabb, Polyhedron, Sphere, Triangle
from engine.collision.meshes.mesh_arrays import STILL
from engine.collision.result import Feature
from engine.distance.spreads import SpreadPair, in_space
from engine.distance.traversal import ANSWERED, Query
from engine.running.budget import Budget

FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


def pairs(draw: np.random.Generator, size: float) -> list[tuple[Any, Any]]:
    corners = draw.uniform(-1, 1, (2, 4, 3))
    corners = size * np.array([p if np.linalg.det(p[1:] - p[0]) > 0 else p[[0, 2, 1, 3]] for p in corners])
    tetrahedra = [Polyhedron(p, FACES) for p in corners]
    ball, box = Sphere(corners[0, 0], 0.3 * size), Aabb(-0.5 * size * np.ones(3), 0.5 * size * np.ones(3))
    flat = [Triangle(draw.uniform(-1, 1, (3, 2)) * size) for _ in range(2)]
    return [(tetrahedra[0], tetrahedra[1]), (tetrahedra[0], ball), (ball, ball), (box, box), (box, ball),
            (flat[0], flat[1]), (flat[0], Sphere([0, 0], size))]  # fmt: skip


@pytest.mark.parametrize("size", [1.0, 1e-9, 1e120, 1e-290, 5e-324 * 2**60])
@pytest.mark.parametrize("gap", [1.0, 1e-3, 1e-9, 1e-14, 1e6])
def test_a_sure_distance_is_that_of_integers(size: float, gap: float) -> None:
    draw = np.random.default_rng(int(-np.log10(gap)) + 100)
    n_sure, n_told, n = 0, 0, 8
    for first, second in pairs(draw, size):
        d = first.dimension
        turns = np.linalg.qr(draw.normal(size=(n, d, d)))[0]
        turns[:, 0] *= np.sign(np.linalg.det(turns))[:, None]
        turns[: n // 4] = np.eye(d)
        ways = draw.normal(size=(n, d))
        moves = ways / np.linalg.norm(ways, axis=1)[:, None] * size * (4.0 + gap)
        moves[:2] = np.eye(d)[0] * size * (2.0 + gap)
        with Budget() as budget:
            pair = SpreadPair(first, second, STILL, in_space(turns, moves), budget)
            answers, sure = np.full(n, np.nan), np.full(n, np.nan)
            pair.fill(0, n, answers)
            asked = Query(np.inf, -1.0, *pair._radii, pair._reach, True)
            for how, item, rows in pair._unanswered(0, n, sure, asked):
                points = pair._room.points[:, :d].tolist()
                least = pair.least(item, rows)[0]
                exact = least.distance()
                if how == ANSWERED:
                    n_told += 1
                    assert points == least.clearance((Feature("ball"), Feature("ball")), d).points.tolist()  # type: ignore[union-attr]
                    assert [[least.gap.first, least.gap.second]] == [row[2:] for row in rows]
                n_sure += bool(sure[item] > 0.0)
                assert answers[item] == exact
                assert not sure[item] > 0.0 or sure[item] == exact
                sure[item] = exact
    assert (n_sure > 0 and n_told > 0) or size < 1e-300
