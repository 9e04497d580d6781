"""Outlines of the plane, alone and in pairs."""

from __future__ import annotations

import time
from fractions import Fraction

import numpy as np
import pytest

import engine
from engine import Aabb, Polygon, Pose, Sphere, Triangle, collide
from engine.collision.outline import is_clean, live_edges, outline_of, rounded, single_points
from engine.running.budget import Budget
from tests.unit.collision.lattices import COUNTS, Maker, aabb, check_pairs, polygon, triangle

SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4]]


def test_edges_run_around_each_ring_and_are_exact_under_poses() -> None:
    with Budget(None, None) as budget:
        outline = outline_of(Polygon([SQUARE, [[1, 1], [2, 1], [1, 2]]]), None, budget)
        assert outline.ends.tolist() == [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 4]]
        box = outline_of(Aabb([0, 0], [1, 2]), Pose([[0.6, -0.8], [0.8, 0.6]], [1, 0]), budget)
        assert box.edge(1) == (
            (Fraction(0.6) + 1, Fraction(0.8)),
            (Fraction(0.6) + 2 * Fraction(-0.8) + 1, Fraction(0.8) + 2 * Fraction(0.6)),
        )
        assert outline_of(Triangle([[0, 0], [1, 0], [0, 1]]), None, budget).n_edges == 3


def test_what_cancels_is_not_live() -> None:
    with Budget(None, None) as budget:
        outline = outline_of(Polygon([SQUARE, [[1, 0], [3, 0], [2, 1]]]), None, budget)
        assert not is_clean(outline, 0)
        assert is_clean(outline, 1)
        bottom = {tuple(sorted(edge)) for edge in live_edges(outline, budget) if edge[0][1] == edge[1][1] == 0}
        assert bottom == {((0, 0), (1, 0)), ((3, 0), (4, 0))}
        assert not live_edges(outline_of(Polygon([SQUARE, SQUARE[::-1]]), None, budget), budget)


def test_rings_of_one_position_are_points() -> None:
    with Budget(None, None) as budget:
        flat = outline_of(Triangle([[2, 2], [2, 2], [2, 2]]), None, budget)
        assert single_points(flat) == [0]
        assert single_points(outline_of(Polygon([SQUARE]), None, budget)) == []


def test_rounding_keeps_the_order_beyond_all_doubles() -> None:
    assert rounded(Fraction(1, 3)) == 1 / 3
    assert rounded(Fraction(10) ** 400) == float("inf") == -rounded(-(Fraction(10) ** 400))


@pytest.mark.parametrize("x", [0.25, 0.75, 1.25, 1.5])
def test_images_beyond_the_largest_double_lie_as_smaller_ones_do(x: float) -> None:
    turn, found = [[0.6, -0.8], [0.8, 0.6]], []
    for unit in (1.0, 2.0**1023):
        box, pose = Aabb([0, 0], [1.25 * unit, 1.25 * unit]), Pose(turn, [x * unit, 0.5 * unit])
        ball = Sphere([0.5 * unit, 1.5 * unit], 0.25 * unit)
        found.append(
            [collide(box, other, first_pose=pose, detail=True) for other in (box, Polygon([box_ring(box)]), ball)]
        )
        live = live_edges(outline_of(Polygon([box_ring(box)]), pose, Budget()), Budget())
        found[-1].append([sorted(tuple(value / Fraction(unit) for value in end) for end in edge) for edge in live])
    assert found[0] == found[1]


def box_ring(box: Aabb) -> list[list[float]]:
    (a, b), (c, d) = box.min.tolist(), box.max.tolist()
    return [[a, b], [c, b], [c, d], [a, d]]


# --- Polygons, triangles and boxes of the plane against each other ---


@pytest.mark.parametrize(
    ("d", "first", "second"),
    [(2, aabb, triangle), (2, aabb, polygon), (2, triangle, triangle), (2, triangle, polygon), (2, polygon, polygon)],
)
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


def test_large_outlines_end_at_their_deadline() -> None:
    t = np.linspace(0, 2 * np.pi, 300_000, endpoint=False)
    ring = np.stack([np.cos(t), np.sin(t)], axis=1) * (1 + 0.1 * np.sin(9999 * t))[:, None]
    ring[:, 0] += 3 * ring[:, 1] ** 2  # bent: not star-shaped
    body, step = engine.Polygon([ring]), Pose(np.eye(2), [0.001, 0.0])  # without a deadline 18 s, posed 80 s
    small = engine.Polygon([ring[::30000]])
    for pose_ in (None, step):
        collide(small, small, second_pose=pose_)  # compiles
        before = time.process_time()  # a busy machine may keep the call waiting
        with pytest.raises(engine.DeadlineExceededError):
            collide(body, body, second_pose=pose_, deadline=0.05)
        assert time.process_time() - before < 5
