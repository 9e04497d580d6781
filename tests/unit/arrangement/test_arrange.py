"""Splitting at crossings: degeneracies one by one, and random lattices against invariants."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine.arrangement.arrange import CROSS, MISS, Arrangement, arrange_rings, classify_pairs
from engine.errors import DeadlineExceededError
from engine.running.budget import Budget
from engine.types import UNDECIDED
from tests.unit.arrangement.segments import arrange_segments

Point = tuple[float, float]


def edges_of(arrangement: Arrangement) -> dict[tuple[tuple[Fraction, Fraction], tuple[Fraction, Fraction]], int]:
    exact = arrangement.nodes.exact
    ends = zip(arrangement.tails, arrangement.heads, strict=True)
    return {(exact(t), exact(h)): mask for (t, h), mask in zip(ends, arrangement.masks, strict=True)}


CASES = {
    "proper crossing": ([((0, 0), (2, 2)), ((0, 2), (2, 0))], 4, 5),
    "end on a segment": ([((0, 0), (4, 0)), ((2, 0), (2, 3))], 3, 4),
    "shared end": ([((0, 0), (4, 0)), ((4, 0), (5, 7))], 2, 3),
    "apart": ([((0, 0), (4, 0)), ((0, 1), (5, 7))], 2, 4),
    "collinear apart": ([((0, 0), (1, 1)), ((2, 2), (3, 3))], 2, 4),
    "collinear in an end": ([((0, 0), (1, 1)), ((1, 1), (3, 3))], 2, 3),
    "collinear overlap": ([((0, 0), (2, 2)), ((1, 1), (3, 3))], 3, 4),
    "one within the other": ([((0, 0), (9, 0)), ((3, 0), (6, 0))], 3, 4),
    "one within the other, one end shared": ([((0, 0), (9, 0)), ((0, 0), (6, 0))], 2, 3),
    "vertical overlap": ([((1, 5), (1, 0)), ((1, 3), (1, 9))], 3, 4),
    "equal and reversed": ([((0, 0), (9, 1)), ((9, 1), (0, 0))], 1, 2),
    "three through one point": ([((-3, -3), (3, 3)), ((-3, 3), (3, -3)), ((-3, 1), (3, -1))], 6, 7),
    "zero length": ([((1, 1), (1, 1)), ((0, 0), (2, 0))], 1, 2),
    "crossing on an overlap": ([((0, 0), (4, 0)), ((1, 0), (6, 0)), ((2, -1), (2, 1))], 6, 7),
}


@pytest.mark.parametrize("kind", [float, int, Fraction], ids=["float", "int", "Fraction"])
@pytest.mark.parametrize("name", CASES)
def test_cases(name: str, kind: type) -> None:
    segments, n_edges, n_nodes = CASES[name]
    typed = [tuple(tuple(kind(value) for value in end) for end in segment) for segment in segments]
    edges = edges_of(arrange_segments(typed))
    assert len(edges) == n_edges
    assert len({end for edge in edges for end in edge}) == n_nodes


def test_masks_combine_by_source() -> None:
    edges = edges_of(arrange_segments([((0, 0), (4, 0)), ((4, 0), (2, 0)), ((1, 0), (3, 0))], [1, 1, 2]))
    assert {(int(t[0]), int(h[0])): mask for (t, h), mask in edges.items()} == {
        (0, 1): 1,
        (1, 2): 3,
        (2, 3): 2,
        (3, 4): 0,
    }
    cancelled = arrange_segments([((0, 0), (4, 0)), ((4, 0), (0, 0))], [5, 1])
    assert (cancelled.masks, cancelled.cover) == ([4], [5])


def test_three_lines_that_nearly_meet_keep_their_triangle() -> None:
    ulp = 2.0**-52
    arrangement = arrange_segments([((0.0, 0.0), (1.0, 1.0)), ((0.0, 1.0), (1.0, 0.0)), ((0.5, 0.0), (0.5 + ulp, 1.0))])
    assert len(arrangement.tails) == 9


@pytest.mark.parametrize("scale", [1.0, 2.0**-1074, 2.0**1000])
@pytest.mark.parametrize("seed", range(4))
def test_lattice_segments_meet_only_in_nodes(seed: int, scale: float) -> None:
    random = np.random.default_rng(seed)
    ends = random.integers(0, 6, (25, 2, 2)).astype(float)
    edges = list(edges_of(arrange_segments([tuple(map(tuple, segment)) for segment in (ends * scale).tolist()])))
    unscaled = edges_of(arrange_segments([tuple(map(tuple, segment)) for segment in ends.tolist()]))
    factor = Fraction(scale)
    assert {tuple((x / factor, y / factor) for x, y in edge) for edge in edges} == set(unscaled)
    if scale == 1.0:
        again = edges_of(arrange_segments(edges))
        assert set(again) == set(edges)  # nothing left to split


def test_rings_close_themselves() -> None:
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    assert len(arrange_rings(square, [0, 4], [1]).tails) == 4


def test_deadline() -> None:
    random = np.random.default_rng(0).random((4000, 2))
    with Budget(deadline=0.0) as budget, pytest.raises(DeadlineExceededError):
        arrange_rings(random, [0, 4000], [1], budget)


def exact_turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> int:
    ax, ay, bx, by, cx, cy = (Fraction(float(value)) for value in (*a, *b, *c))
    value = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    return (value > 0) - (value < 0)


@pytest.mark.parametrize("scale", [1.0, 2.0**-40, 2.0**500, 2.0**-530, 2.0**-1060])
def test_sure_verdicts_are_right(scale: float) -> None:
    """The filter never contradicts exact arithmetic, settles easy pairs, and is unsure beyond the exponent range."""
    random = np.random.default_rng(3)
    points = random.integers(0, 5, (400, 2)) + random.choice([0.0, 2.0**-50], (400, 2))
    points = points * scale
    segments = np.arange(400).reshape(-1, 2)
    pairs = random.integers(0, 200, (3000, 2))
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    verdicts = classify_pairs(points, segments, pairs)
    for (i, j), verdict in zip(pairs, verdicts, strict=True):
        (a, b), (c, d) = points[segments[i]], points[segments[j]]
        first = exact_turn(a, b, c) * exact_turn(a, b, d)
        second = exact_turn(c, d, a) * exact_turn(c, d, b)
        if verdict == CROSS:
            assert first == second == -1
        elif verdict == MISS:
            assert first == 1 or second == 1
    if 2.0**-500 < scale < 2.0**400:
        assert (verdicts != UNDECIDED).mean() > 0.5


def test_filter_segments_that_share_an_end_miss_unless_collinear() -> None:
    points = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (2.0, 0.0)])
    segments = np.array([(0, 1), (0, 2), (0, 3)])
    assert classify_pairs(points, segments, np.array([(0, 1), (0, 2)])).tolist() == [MISS, UNDECIDED]


def test_filter_is_unsure_of_overflow() -> None:
    points = np.array([(-1e300, 0.0), (1e300, 1.0), (0.0, -1e300), (0.0, 1e300)])
    assert classify_pairs(points, np.array([(0, 1), (2, 3)]), np.array([(0, 1)])).tolist() == [UNDECIDED]
