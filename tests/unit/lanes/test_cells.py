"""The parity of a segment over eight triangles: what its planes say, one triangle after the other; entries of a cell:
their signs are those of exact arithmetic beyond the band."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from engine.compiling.jit import kernel
from engine.lanes.cells import BAND, group_parity, groups_of, prefetch_group, set_entry, set_nothing
from engine.lanes.tracing import LANES
from engine.types import UNDECIDED


def one_by_one(group: np.ndarray, point: np.ndarray) -> int:
    """Return the parity over the lanes, in numbers of numpy, with UNDECIDED where one is within the band."""
    answer = 0
    for n in group.T:
        side, *edges = (n[k] * point[0] + n[k + 1] * point[1] + n[k + 2] * point[2] for k in (0, 4, 7, 10))
        side -= n[3]
        is_split = min(edges) < -BAND and max(edges) > BAND
        is_same = min(edges) > BAND or max(edges) < -BAND
        if side < -BAND and is_same:
            answer ^= 1
        elif not (side > BAND or is_split):
            answer |= UNDECIDED
    return answer


@kernel
def parities(groups: Any, points: Any, found: Any) -> None:
    for item in range(len(groups)):
        prefetch_group(groups, item)
        found[item] = group_parity(groups, item, points[item, 0], points[item, 1], points[item, 2])


def test_a_group_answers_as_its_triangles_one_by_one() -> None:
    random = np.random.default_rng(10)
    n = 3000
    groups = groups_of(n)
    groups[:] = random.uniform(-1, 1, groups.shape)
    groups[:, 3] = random.choice([-4.0, -0.1, -1e-4], (n, LANES))
    groups[::2, :, 1:] = groups[::2, :, :1]  # eight times one triangle: crossed by all or none, never odd
    groups[::7, :, 3] = np.nan  # one lane
    points = random.uniform(-0.6, 0.6, (n, 3)).astype(np.float32)
    points[::5] *= np.float32(1e-5)  # within the band of the edges
    found = np.empty(n, np.int64)
    parities(groups, points, found)
    expected = [one_by_one(groups[item], points[item]) for item in range(n)]
    assert [group_parity(groups, item, *points[item]) for item in range(n)] == expected
    assert found.tolist() == expected
    assert {0, 1, UNDECIDED} <= set(expected)
    assert not (found[2::14] & 1).any()
    assert (found[::7] & UNDECIDED).all()


def test_groups_begin_with_a_line_of_the_cache() -> None:
    for n in (0, 1, 5):
        assert groups_of(n).shape == (n, 14, LANES)
        assert groups_of(n).flags.c_contiguous
        assert n == 0 or groups_of(n).ctypes.data % 64 == 0


def exact_crossing(a: Any, b: Any, c: Any, x: Any) -> int | None:
    """Return whether the segment from 0 to x crosses the triangle, None where anything is degenerate; in integers."""
    p = [[Fraction(float(value)) for value in point] for point in (a, b, c, x)]

    def volume(u: Any, v: Any, w: Any) -> Fraction:
        crossed = [u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3] for k in range(3)]
        return sum((m * n for m, n in zip(crossed, w)), Fraction(0))

    def less(u: Any, v: Any) -> Any:
        return [m - n for m, n in zip(u, v)]

    edges = [volume(p[k], p[(k + 1) % 3], p[3]) for k in range(3)]
    of_r = volume(less(p[1], p[0]), less(p[2], p[0]), less([Fraction(0)] * 3, p[0]))
    of_x = volume(less(p[1], p[0]), less(p[2], p[0]), less(p[3], p[0]))
    if of_r == 0 or of_x == 0 or 0 in edges:
        return None
    return int(of_r * of_x < 0 and (min(edges) > 0 or max(edges) < 0))


def test_entries_are_right_beyond_their_band() -> None:
    random = np.random.default_rng(6)
    n_sure = n_crossed = 0
    for case in range(1500):
        a, b, c = random.uniform(-1, 1, (3, 3)) * random.choice([1.0, 30.0, 1e-3]) + random.uniform(-0.3, 0.3, 3)
        if case % 3 == 0:
            c = a + (b - a) * random.uniform(-1, 2) + random.normal(size=3) * 10.0 ** -random.integers(1, 12)
        weights = random.dirichlet([1, 1, 1])
        x = weights[0] * a + weights[1] * b + weights[2] * c
        x = x * (1 + random.choice([0, 1e-7, 1e-6, 1e-5, -1e-5, 0.3])) + random.normal(size=3) * 1e-7
        if np.abs(x).max() > 0.6:
            x = random.uniform(-0.6, 0.6, 3)
        groups, lane = groups_of(1), case % LANES
        with np.errstate(all="ignore"):
            for other in range(LANES):
                set_nothing(groups[0, :, other])
            set_entry(groups[0, :, lane], tuple(a), tuple(b), tuple(c), tuple(b - a), tuple(c - a))
            found = group_parity(groups, 0, *x.astype(np.float32))
        if found < UNDECIDED:
            n_sure += 1
            n_crossed += found
            assert found == exact_crossing(a, b, c, x)
    assert n_sure > 500
    assert n_crossed > 50
