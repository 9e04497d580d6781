"""Polygons gathered into flat arrays, and kernels that make room for what they find."""

from __future__ import annotations

import numpy as np
import pytest

from engine.arrays import read_only
from engine.parallel import Budget
from engine.polygon_overlay.compiled.kernel import DONE
from engine.polygon_overlay.run import gathered, run_kernel


@pytest.mark.parametrize("most_rings", [1, 4])
def test_gathered(most_rings: int) -> None:
    random = np.random.default_rng(most_rings)
    counts = [random.integers(3, 9, random.integers(1, most_rings + 1)) for _ in range(7)]
    offsets = [np.cumsum([0, *sizes]) for sizes in counts]
    vertices = [random.random((each[-1], 2)) for each in offsets]
    found = gathered(vertices, offsets)
    assert found.vertices.tolist() == np.concatenate(vertices).tolist()
    assert np.diff(found.ring_offsets).tolist() == np.concatenate(counts).tolist()
    assert np.diff(found.polygon_offsets).tolist() == [len(sizes) for sizes in counts]
    assert (found.most_vertices, found.most_rings) == (max(map(len, vertices)), max(map(len, counts)))


def test_room_is_made() -> None:
    """Two combs across each other: more contacts, vertices and rings than vertices in all."""
    n = 60
    teeth = np.array([[k + 0.5 * (j > 1), 0.1 if j in (0, 3) else n] for k in range(n) for j in range(4)])
    comb = np.concatenate([teeth, [[n, 0.0], [0, 0.0]]])
    sides = [gathered([read_only(each)] * 3, [np.array([0, len(each)])] * 3) for each in (comb, comb[:, ::-1] * 1.0)]
    found = run_kernel(*sides, "intersection", Budget())
    assert found.status.tolist() == [DONE] * 3
    assert len(set(found.counts[:, 0].tolist())) == 1
    assert found.counts[0, 0] > n * (n - 2)
