"""The clipping benchmark's workloads are seeded, and its smallest row runs. Nothing here is timed."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import clipping, workloads


@pytest.mark.parametrize("kind", ["random", "corner", "edge", "ulp"])
def test_segments_are_seeded(kind: str) -> None:
    first, second, other = (workloads.segments_of(kind, 3, 40, seed) for seed in (0, 0, 1))
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other)


def test_a_row_runs(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--quick", "--dry", "--rounds", "2", "--seconds", "0.01", "--only"]
    clipping.main([*words, "segments on sphere"])
    assert "wrong: ours 0 of 300" in capsys.readouterr().out
