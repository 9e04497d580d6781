"""The parity of a segment over eight triangles: what its planes say, one triangle after the other."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.jit import kernel
from engine.lanes.cells import BAND, group_parity, groups_of, prefetch_group
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
