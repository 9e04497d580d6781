"""Runs that were left out are put in place again, there or back, from the polygon that they belong to."""

from __future__ import annotations

import numpy as np

from engine.polygon_overlay.compiled.expanding import LEFT_OUT, count_left_out, expand_rings


def test_runs_there_and_back() -> None:
    subjects, clips = np.arange(20.0).reshape(10, 2), 100.0 + np.arange(20.0).reshape(10, 2)
    names = [(2, LEFT_OUT), (5, -1), (7, 12), (18, LEFT_OUT), (14, -1), (9, LEFT_OUT), (9, -1)]
    sources, offsets = np.array(names, np.int32), np.array([0, 5, 7])
    both = np.concatenate([subjects, clips])
    kept = both[sources[:, 0]] + 0.5
    full = [2, 3, 4, 5, 7, 18, 17, 16, 15, 14, 9, 9]
    n = len(names) + int(count_left_out(sources, 0, 5)) + int(count_left_out(sources, 5, 6))
    made = np.empty((n, 2)), np.empty((n, 2), np.int32), np.empty(3, np.int64)
    expand_rings(
        kept,
        sources,
        offsets[:2],
        subjects,
        clips,
        np.zeros(1, np.uint8),
        *(each[:10] for each in made[:2]),
        made[2][:2],
    )
    assert made[2][:2].tolist() == [0, 10]
    assert made[1][:10, 0].tolist() == full[:10]
    assert made[1][:10, 1].tolist() == [-1, -1, -1, -1, 12, -1, -1, -1, -1, -1]
    is_kept = np.isin(full[:10], sources[:5, 0])
    assert (made[0][:10] == both[full[:10]] + 0.5 * is_kept[:, None]).all()
