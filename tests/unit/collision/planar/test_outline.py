"""Edges of planar bodies: their numbers, which of them cancel, which rings are points."""

from __future__ import annotations

from fractions import Fraction

from engine import Aabb, Polygon, Pose, Triangle
from engine.collision.planar.outline import is_clean, live_edges, outline_of, rounded, single_points
from engine.parallel import Budget

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
